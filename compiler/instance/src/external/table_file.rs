//! Matrices in text files, as the documentation of the library's tables describes them.
//!
//! A file begins with `#1`; a matrix is `double name(rows,columns)`, also `float`, followed by its numbers row by row; `#` and `//` begin comments
//! that end with the line; numbers are separated by blanks, tabs, commas, semicolons and line ends.  A file of separated values has one
//! matrix, a row a line.

/// The matrix called `name`; `separated` says which character divides the values of a line and how many lines are passed over first.
pub(crate) fn matrix_of_file(
    text: &str,
    name: &str,
    separated: Option<(char, usize)>,
) -> Result<Vec<Vec<f64>>, String> {
    match separated {
        Some((delimiter, header)) => separated_values(text, delimiter, header),
        None => named_matrix(text, name),
    }
}

fn separated_values(text: &str, delimiter: char, header: usize) -> Result<Vec<Vec<f64>>, String> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (k, line) in text.lines().enumerate().skip(header).filter(|(_, line)| !line.trim().is_empty()) {
        let row: Result<Vec<f64>, String> = line.trim().split(delimiter).map(|field| number(field, k)).collect();
        let row = row?;
        if rows.first().is_some_and(|first| first.len() != row.len()) {
            return Err(format!("line {} has {} values, the first {}", k + 1, row.len(), rows[0].len()));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn number(field: &str, line: usize) -> Result<f64, String> {
    let found = field.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    found.ok_or_else(|| format!("line {}: `{}` is not a number", line + 1, field.trim()))
}

fn named_matrix(text: &str, name: &str) -> Result<Vec<Vec<f64>>, String> {
    if !text.starts_with("#1") {
        return Err("a file of tables begins with `#1`".to_string());
    }
    let mut lines = text.lines().enumerate();
    let mut seen = Vec::new();
    while let Some((k, line)) = lines.next() {
        let Some((found, rows, columns, rest)) = head(line) else { continue };
        if found != name {
            seen.push(found.to_string());
            continue;
        }
        return numbers(k, rest, &mut lines, rows, columns);
    }
    Err(format!("there is no table `{name}`; its tables are {}", seen.join(", ")))
}

/// `double name(rows,columns)` and what follows it.
fn head(line: &str) -> Option<(&str, usize, usize, &str)> {
    let line = line.trim_start();
    let rest = line.strip_prefix("double").or_else(|| line.strip_prefix("float"))?;
    let rest = rest.strip_prefix([' ', '\t'])?;
    let (name, rest) = rest.split_once('(')?;
    let (sizes, rest) = rest.split_once(')')?;
    let (rows, columns) = sizes.split_once(',')?;
    Some((name.trim(), rows.trim().parse().ok()?, columns.trim().parse().ok()?, rest))
}

/// Most numbers of a table.
const MOST: usize = 1 << 22;

fn numbers<'t>(
    first: usize,
    rest: &'t str,
    lines: &mut impl Iterator<Item = (usize, &'t str)>,
    rows: usize,
    columns: usize,
) -> Result<Vec<Vec<f64>>, String> {
    let wanted = rows.checked_mul(columns).filter(|&count| count <= MOST);
    let wanted = wanted.ok_or_else(|| format!("the table has more than {MOST} numbers"))?;
    let mut all = Vec::with_capacity(wanted);
    for (k, line) in std::iter::once((first, rest)).chain(lines) {
        let line = line.split('#').next().unwrap_or("");
        let line = line.split("//").next().unwrap_or("");
        let fields = line.split([' ', '\t', ',', ';', '\r']).filter(|field| !field.is_empty());
        for field in fields.take(wanted - all.len()) {
            all.push(number(field, k)?);
        }
        if all.len() == wanted {
            return Ok(if columns == 0 { Vec::new() } else { all.chunks(columns).map(<[f64]>::to_vec).collect() });
        }
    }
    Err(format!("the table has {} numbers instead of {wanted}", all.len()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::matrix_of_file;

    #[test]
    fn matrices_are_found_by_name_and_comments_passed_over() {
        let text =
            "#1\n# of a pump\ndouble a(1,2)\n  9 8\nfloat b( 2, 3 ) # here\n1, 2 ; 3 // first row\n\n4e0\t5 -6\n7\n";
        assert_eq!(matrix_of_file(text, "b", None), Ok(vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, -6.0]]));
        assert_eq!(matrix_of_file(text, "a", None), Ok(vec![vec![9.0, 8.0]]));
        assert_eq!(matrix_of_file(text, "c", None).unwrap_err(), "there is no table `c`; its tables are a, b");
        let short = "#1\ndouble a(2,2)\n1 2 3\n";
        assert_eq!(matrix_of_file(short, "a", None).unwrap_err(), "the table has 3 numbers instead of 4");
        assert_eq!(matrix_of_file("double a(1,1)\n1", "a", None).unwrap_err(), "a file of tables begins with `#1`");
        let bad = "#1\ndouble a(1,2)\n1 x\n";
        assert_eq!(matrix_of_file(bad, "a", None).unwrap_err(), "line 3: `x` is not a number");
    }

    #[test]
    fn separated_values_have_a_row_a_line() {
        let text = "t;y\n0;1\n1;2.5\n";
        assert_eq!(matrix_of_file(text, "", Some((';', 1))), Ok(vec![vec![0.0, 1.0], vec![1.0, 2.5]]));
        assert_eq!(matrix_of_file("1,2\n3\n", "", Some((',', 0))).unwrap_err(), "line 2 has 1 values, the first 2");
    }
}
