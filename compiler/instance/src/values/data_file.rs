//! Columns of data files, read at translation.
//!
//! A function whose body is `external "hyd" values = csvColumn(file, column);` takes two Strings and gives the numbers
//! that stand in a column of a file with a header.  Fields are separated by commas, semicolons or tabs, whichever the
//! header has; every row has as many as the header; lines that are empty or begin with `#` are passed over.  A name of a column may be followed by its unit
//! (`p_R [Pa]`).  Where the file lies is for the source of texts to know.  External functions of other languages are
//! outside the profile.

use hyd_source::{Code, Diagnostic, Reported, Span, did_you_mean};
use hyd_syntax::tree::{Component, Direction, External, Name};

use crate::instantiation::scopes::Scopes;
use crate::values::value::Value;

impl Scopes<'_> {
    /// Whether an external clause asks for a column of a file.
    pub fn is_column_reader(&self, external: &External) -> bool {
        let call = external.call.as_ref().filter(|_| external.language.as_deref() == Some("hyd"));
        call.is_some_and(|call| call.output.is_some() && call.name.name.as_ref() == "csvColumn")
    }

    /// The numbers of a column, for a call with these values of its inputs.
    pub fn read_column(&mut self, span: Span, inputs: &[Value]) -> Result<Vec<f64>, Reported> {
        let [Value::Text(file), Value::Text(column)] = inputs else {
            let message = "a column of a file is asked for by two Strings: the file and the column";
            return Err(self.error(Code::BadArguments, span, message));
        };
        let text = self.table.data_file(file).map_err(|sentence| self.error(Code::FileAccess, span, sentence))?;
        column_of(&text, column).map_err(|(sentence, help)| {
            let message = format!("`{file}`: {sentence}");
            self.table.report(Diagnostic::error(Code::Value, message).at(span, "").maybe_help(help));
            Reported
        })
    }

    /// The outputs of a call of a function that reads a column, by its components and the values found so far.
    pub(crate) fn column_outputs(
        &mut self,
        span: Span,
        components: &[(u32, Component)],
        values: &[(Name, Value)],
    ) -> Result<Vec<Value>, Reported> {
        let inputs = components.iter().filter(|(_, c)| c.direction == Some(Direction::Input));
        let inputs: Vec<Value> = inputs
            .filter_map(|(_, c)| values.iter().find(|(name, _)| *name == c.name.name).map(|(_, value)| value.clone()))
            .collect();
        let column = self.read_column(span, &inputs)?;
        Ok(vec![Value::array(column.into_iter().map(Value::Real).collect())])
    }
}

/// A sentence and perhaps an advice.
type Wrong = (String, Option<String>);

fn column_of(text: &str, wanted: &str) -> Result<Vec<f64>, Wrong> {
    let mut lines =
        text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    if let Some(k) = text.lines().position(|line| line.len() > LONGEST) {
        return Err((format!("line {} is longer than {} MB", k + 1, LONGEST >> 20), None));
    }
    let Some((_, header)) = lines.next() else { return Err(("the file is empty".to_string(), None)) };
    let header = header.trim_start_matches('\u{feff}');
    let separator = [';', '\t'].into_iter().find(|&c| header.contains(c)).unwrap_or(',');
    let names: Vec<&str> = fields(header, separator).map(bare).collect();
    let k = position(&names, wanted)?;
    let mut values = Vec::new();
    for (number, line) in lines {
        let line_number = number + 1;
        let row: Vec<&str> = fields(line, separator).map(bare).collect();
        if row.len() != names.len() {
            let few = if row.len() == 1 { "1 field".to_string() } else { format!("{} fields", row.len()) };
            let sentence = format!("line {line_number} has {few}, and the header {}", names.len());
            let is_comma = separator == ',' && row.len() > names.len();
            return Err((sentence, is_comma.then(|| DECIMAL_POINT.to_string())));
        }
        match row[k].parse::<f64>() {
            Ok(value) if value.is_finite() => values.push(value),
            _ => {
                let is_comma = row[k].replacen(',', ".", 1).parse::<f64>().is_ok();
                let sentence = format!("line {line_number}: `{}` is not a number", shortened(row[k]));
                return Err((sentence, is_comma.then(|| DECIMAL_POINT.to_string())));
            }
        }
    }
    if values.is_empty() { Err(("there are no rows below its header".to_string(), None)) } else { Ok(values) }
}

/// The column of this name, or the only one of this name and a unit.
fn position(names: &[&str], wanted: &str) -> Result<usize, Wrong> {
    let called = |is: &dyn Fn(&str) -> bool| -> Vec<usize> { (0..names.len()).filter(|&k| is(names[k])).collect() };
    let mut found = called(&|name| name == wanted);
    if found.is_empty() {
        found = called(&|name| without_unit(name) == wanted);
    }
    match found[..] {
        [k] => Ok(k),
        [] => {
            let help = did_you_mean(wanted, names.iter().copied())
                .or_else(|| Some(format!("its columns are {}", shortened(&names.join(", ")))));
            Err((format!("there is no column `{wanted}`"), help))
        }
        _ => Err((format!("{} of its columns are called `{wanted}`", found.len()), None)),
    }
}

/// Longest line (bytes): its fields take many times as much memory.
const LONGEST: usize = 1 << 20;
/// What is to be said of `1,5`.
const DECIMAL_POINT: &str = "numbers have a decimal point, not a comma";

/// The beginning of what may be long.
fn shortened(text: &str) -> String {
    const MOST: usize = 200;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_string(),
    }
}

/// The fields of a line; what is quoted holds no separators.
fn fields(line: &str, separator: char) -> impl Iterator<Item = &str> {
    let mut is_quoted = false;
    line.split(move |c| {
        is_quoted ^= c == '"';
        c == separator && !is_quoted
    })
}

/// A field without blanks and quotes around it.
fn bare(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).unwrap_or(field).trim()
}

/// A name without the unit that follows it in brackets.
fn without_unit(name: &str) -> &str {
    name.split(['[', '(']).next().unwrap_or(name).trim_end()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::column_of;

    #[test]
    fn separators_quotes_units_and_comments() {
        for text in [
            "t,p [Pa]\n0,1\n1,2e5\n",
            "# of a bench\n\"t\";\"p (Pa)\"\n0;1\n\n1;2e5",
            "\u{feff}t\tp\n0\t1\r\n1\t 2e5 \r\n",
        ] {
            assert_eq!(column_of(text, "p"), Ok(vec![1.0, 2e5]), "{text:?}");
        }
    }

    #[test]
    fn faults_name_the_line() {
        let wrong = |text: &str| column_of(text, "p").unwrap_err().0;
        assert_eq!(wrong("# c\nt,p\n0,1\n1,x\n"), "line 4: `x` is not a number");
        assert_eq!(wrong("t,p\n0,1\n1\n"), "line 3 has 1 field, and the header 2");
        assert_eq!(wrong("t,p\n0,1\n1,2,3\n"), "line 3 has 3 fields, and the header 2");
        assert_eq!(wrong("t,p\n0,1\n1,1e999\n"), "line 3: `1e999` is not a number");
        assert_eq!(wrong("t,p\n0,1\n1,\n"), "line 3: `` is not a number");
        assert_eq!(wrong("p,p\n0,1\n"), "2 of its columns are called `p`");
        assert_eq!(wrong("p [Pa],p (bar)\n0,1\n"), "2 of its columns are called `p`");
        assert_eq!(wrong("t,p\n"), "there are no rows below its header");
        assert_eq!(wrong("t,q\n0,1\n"), "there is no column `p`");
        assert_eq!(wrong(""), "the file is empty");
        assert_eq!(column_of("t,q\n0,1\n", "p").unwrap_err().1.unwrap(), "its columns are t, q");
    }

    /// `1,5` is neither 1 nor 5 nor 1.5.
    #[test]
    fn decimal_commas_are_told() {
        for (text, sentence) in [
            ("p\n1,5\n", "line 2 has 2 fields, and the header 1"),
            ("t,p\n0,1,5\n", "line 2 has 3 fields, and the header 2"),
            ("t;p\n0;1,5\n", "line 2: `1,5` is not a number"),
            ("t\tp\n0\t1,5\n", "line 2: `1,5` is not a number"),
            ("t,p\n0,\"1,5\"\n", "line 2: `1,5` is not a number"),
        ] {
            let wrong = column_of(text, "p").unwrap_err();
            assert_eq!((wrong.0.as_str(), wrong.1.as_deref()), (sentence, Some(super::DECIMAL_POINT)), "{text:?}");
        }
        // What is quoted holds no separators.
        assert_eq!(column_of("\"a, b\",p\n\"x, y\",2\n", "p"), Ok(vec![2.0]));
        assert_eq!(column_of("t;\"p, left\"\n0;3\n", "p, left"), Ok(vec![3.0]));
    }
}
