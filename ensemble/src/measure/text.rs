//! The text of a measure to a tree.
//!
//! ```text
//! sum        = product { ("+" | "-") product }
//! product    = sign { ("*" | "/") sign }
//! sign       = ["+" | "-"] power
//! power      = atom ["^" power-with-sign]
//! atom       = number | "(" sum ")" | function "(" arguments ")" | variable
//! arguments  = sum { "," sum }, of `when`: sum [("<" | "<=" | ">" | ">=") sum]
//! ```
//!
//! A variable is its full name, subscripts and `der(...)` included.

use std::fmt;

use hyd_system::math::Function;

/// What is taken of the values that an expression has during a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Reduction {
    Max,
    Min,
    Mean,
    Rms,
    Integral,
    Start,
    Final,
    When,
}

impl Reduction {
    const ALL: [(&'static str, Reduction); 8] = [
        ("max", Reduction::Max),
        ("min", Reduction::Min),
        ("mean", Reduction::Mean),
        ("rms", Reduction::Rms),
        ("integral", Reduction::Integral),
        ("start", Reduction::Start),
        ("final", Reduction::Final),
        ("when", Reduction::When),
    ];

    /// `max` and `min` of two arguments are functions of values.
    fn of(name: &str, arguments: usize) -> Option<Self> {
        let found = Self::ALL.iter().find(|(own, _)| *own == name)?.1;
        (arguments == 1 || !matches!(found, Reduction::Max | Reduction::Min)).then_some(found)
    }
}

/// Operators and functions of values.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Operation {
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    Call(Function),
}

/// An expression, over names or over what they have become.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Term<V> {
    Number(f64),
    Variable(V),
    Apply(Operation, Vec<Term<V>>),
    Reduce(Reduction, Box<Term<V>>),
    /// The left side is the larger one; or equal, where the flag says so.
    Above(Box<[Term<V>; 2]>, bool),
}

/// What is wrong with a text.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MeasureError {
    /// The text.
    pub text: String,
    /// What is wrong, and where.
    pub reason: String,
}

impl fmt::Display for MeasureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "measure `{}`: {}", self.text, self.reason)
    }
}

impl std::error::Error for MeasureError {}

/// Brackets within brackets; a text with more is a slip.
const DEEPEST: usize = 100;

/// Reads a text.
pub(crate) fn parse(text: &str) -> Result<Term<String>, MeasureError> {
    let mut reader = Reader { text, at: 0, depth: 0 };
    let read = reader.sum().and_then(|term| match reader.rest() {
        "" => Ok(term),
        rest => Err(format!("`{rest}` is one thing too many")),
    });
    let term = read.and_then(|term| check(&term, false).map(|()| term));
    term.map_err(|reason| MeasureError { text: text.to_string(), reason })
}

/// Refuses what stands where it has no meaning.
fn check(term: &Term<String>, reduced: bool) -> Result<(), String> {
    match term {
        Term::Number(_) | Term::Variable(_) => Ok(()),
        Term::Apply(_, arguments) => arguments.iter().try_for_each(|argument| check(argument, reduced)),
        Term::Reduce(..) if reduced => {
            Err("what is measured of a run has no course in time that could be measured again".to_string())
        }
        Term::Reduce(_, inner) => check(inner, true),
        Term::Above(sides, _) => sides.iter().try_for_each(|side| check(side, reduced)),
    }
}

struct Reader<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
}

type Read = Result<Term<String>, String>;

impl<'a> Reader<'a> {
    /// What is left, without blanks in front.
    fn rest(&mut self) -> &'a str {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest
    }

    fn take(&mut self, token: &str) -> bool {
        let found = self.rest().starts_with(token);
        self.at += if found { token.len() } else { 0 };
        found
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        match self.take(token) {
            true => Ok(()),
            false => Err(format!("`{token}` is missing at {}", self.place())),
        }
    }

    fn place(&mut self) -> String {
        match self.rest() {
            "" => "the end".to_string(),
            rest => format!("`{rest}`"),
        }
    }

    fn sum(&mut self) -> Read {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err("it is nested too deeply".to_string());
        }
        let mut term = self.product()?;
        loop {
            let operation = match self.rest().as_bytes().first() {
                Some(b'+') => Operation::Add,
                Some(b'-') => Operation::Subtract,
                _ => break,
            };
            self.at += 1;
            term = Term::Apply(operation, vec![term, self.product()?]);
        }
        self.depth -= 1;
        Ok(term)
    }

    fn product(&mut self) -> Read {
        let mut term = self.signed()?;
        loop {
            let operation = match self.rest().as_bytes().first() {
                Some(b'*') => Operation::Multiply,
                Some(b'/') => Operation::Divide,
                _ => return Ok(term),
            };
            self.at += 1;
            term = Term::Apply(operation, vec![term, self.signed()?]);
        }
    }

    fn signed(&mut self) -> Read {
        let negated = self.take("-");
        if !negated {
            self.take("+");
        }
        let term = self.atom()?;
        let term = match self.take("^") {
            true => Term::Apply(Operation::Call(Function::Pow), vec![term, self.exponent()?]),
            false => term,
        };
        Ok(if negated { Term::Apply(Operation::Negate, vec![term]) } else { term })
    }

    /// As in model texts there are no powers of powers without brackets.
    fn exponent(&mut self) -> Read {
        let negated = self.take("-");
        let term = self.atom()?;
        Ok(if negated { Term::Apply(Operation::Negate, vec![term]) } else { term })
    }

    fn atom(&mut self) -> Read {
        if self.take("(") {
            let term = self.sum()?;
            self.expect(")")?;
            return Ok(term);
        }
        match self.rest().chars().next() {
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' || c == '\'' => self.named(),
            _ => Err(format!("a number, a variable or a function is missing at {}", self.place())),
        }
    }

    fn number(&mut self) -> Read {
        let rest = self.rest();
        let bytes = rest.as_bytes();
        let digit = |k: usize| bytes.get(k).is_some_and(u8::is_ascii_digit);
        let mut end = (0..).find(|&k| !digit(k) && bytes.get(k) != Some(&b'.')).unwrap_or(rest.len());
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            if digit(end + 1 + sign) {
                end = (end + 1 + sign..).find(|&k| !digit(k)).unwrap_or(rest.len());
            }
        }
        self.at += end;
        rest[..end].parse().map(Term::Number).map_err(|_| format!("`{}` is not a number", &rest[..end]))
    }

    /// A variable, or a function with its arguments.
    fn named(&mut self) -> Read {
        let begin = self.at;
        let name = self.name()?;
        if name == "der" && self.take("(") {
            self.derivative()?;
            return Ok(Term::Variable(plain(&self.text[begin..self.at])));
        }
        if !self.take("(") {
            return Ok(Term::Variable(plain(name)));
        }
        let mut arguments = vec![self.argument(name)?];
        while self.take(",") {
            arguments.push(self.sum()?);
        }
        self.expect(")")?;
        let count = arguments.len();
        let operation = match (Reduction::of(name, count), Function::from_name(name)) {
            (Some(reduction), _) if count == 1 => {
                return Ok(Term::Reduce(reduction, Box::new(arguments.swap_remove(0))));
            }
            (None, Some(function)) if function.arity() == count => Operation::Call(function),
            (None, None) => return Err(format!("there is no function `{name}`")),
            _ => return Err(format!("`{name}` has another number of arguments than {count}")),
        };
        Ok(Term::Apply(operation, arguments))
    }

    /// The first argument of a function; that of `when` may be a relation.
    fn argument(&mut self, function: &str) -> Read {
        let left = self.sum()?;
        if function != "when" {
            return Ok(left);
        }
        let relations = [("<=", false, true), (">=", true, true), ("<", false, false), (">", true, false)];
        let Some((_, above, equal)) = relations.into_iter().find(|(token, ..)| self.take(token)) else {
            return Ok(left);
        };
        let right = self.sum()?;
        Ok(Term::Above(Box::new(if above { [left, right] } else { [right, left] }), equal))
    }

    /// What stands in the brackets of `der`, and the closing one.
    fn derivative(&mut self) -> Result<(), String> {
        self.rest();
        if self.name()? == "der" && self.take("(") {
            self.derivative()?;
        }
        self.expect(")")
    }

    /// Letters, digits, dots, subscripts and quoted parts.
    fn name(&mut self) -> Result<&'a str, String> {
        let rest = self.rest();
        let (mut quoted, mut escaped, mut subscript) = (false, false, false);
        let mut belongs = |c: char| {
            let own = match c {
                _ if escaped => true,
                '\'' => true,
                _ if quoted => true,
                '[' => !subscript,
                ']' => subscript,
                ',' | ' ' => subscript,
                _ => c.is_alphanumeric() || c == '_' || c == '.',
            };
            quoted ^= c == '\'' && !escaped;
            escaped = c == '\\' && quoted && !escaped;
            subscript = if quoted { subscript } else { (subscript || c == '[') && c != ']' };
            own
        };
        let end = rest.find(|c| !belongs(c)).unwrap_or(rest.len());
        if end == 0 {
            return Err(format!("a variable is missing at {}", self.place()));
        }
        self.at += end;
        Ok(&rest[..end])
    }
}

/// A name as tables have it: without blanks but in quotes.
fn plain(name: &str) -> String {
    let mut quoted = false;
    let kept = |c: &char| {
        quoted ^= *c == '\'';
        quoted || *c != ' '
    };
    name.chars().filter(kept).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_read_as_they_are_meant() {
        let variable = |name: &str| Term::Variable(name.to_string());
        let max = |inner| Term::Reduce(Reduction::Max, Box::new(inner));
        assert_eq!(parse(" max( a[2].b[1, 3] ) ").unwrap(), max(variable("a[2].b[1,3]")));
        assert_eq!(parse("max(der(der(x)))").unwrap(), max(variable("der(der(x))")));
        assert_eq!(parse("max('a) b'.c)").unwrap(), max(variable("'a) b'.c")));
        let above =
            |left, right, equal| Term::Reduce(Reduction::When, Box::new(Term::Above(Box::new([left, right]), equal)));
        assert_eq!(parse("when(y > 4e-3)").unwrap(), above(variable("y"), Term::Number(4e-3), false));
        assert_eq!(parse("when(y<=1)").unwrap(), above(Term::Number(1.0), variable("y"), true));
        // -2^2 is -(2^2), and 1 - 2 - 3 is -4.
        let value = |text: &str| match crate::measure::value(&parse(text).unwrap(), &|_: &String| f64::NAN) {
            Ok(value) => value,
            Err(()) => panic!("{text}"),
        };
        for (text, expected) in [
            ("-2^2", -4.0),
            ("1-2-3", -4.0),
            ("2*3/4", 1.5),
            ("2^-1", 0.5),
            ("max(1,2)+min(3,4)", 5.0),
            ("1.5e1", 15.0),
        ] {
            assert_eq!(value(text), expected, "{text}");
        }
    }

    #[test]
    fn slips_are_named() {
        for (text, reason) in [
            ("", "a number, a variable or a function is missing at the end"),
            ("max(y", "`)` is missing at the end"),
            ("max(y))", "`)` is one thing too many"),
            ("max(y) z", "`z` is one thing too many"),
            ("maximum(y)", "there is no function `maximum`"),
            ("sqrt(y, 2)", "`sqrt` has another number of arguments than 2"),
            ("when(y, 2)", "`when` has another number of arguments than 2"),
            ("max(y > 2)", "`)` is missing at `> 2)`"),
            ("1.2.3", "`1.2.3` is not a number"),
            ("max(mean(y))", "what is measured of a run has no course in time that could be measured again"),
            ("y + * 2", "a number, a variable or a function is missing at `* 2`"),
        ] {
            assert_eq!(parse(text).unwrap_err().reason, reason, "{text}");
        }
        assert!(parse(&"(".repeat(10_000)).is_err());
    }
}
