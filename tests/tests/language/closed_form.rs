//! Values of expected closed forms: numbers, `pi`, the four operations, powers and elementary functions.
//!
//! A recursive descent over the grammar sum = product {+- product}, product = power {*/ power}, power = [-] atom [^ power].
//! Written for the tests alone, so that what a model must give is not computed by the code under test.

/// The value of a text; panics with the text if it is none.
pub(crate) fn value(text: &str) -> f64 {
    let mut reader = Reader { rest: text.trim(), whole: text };
    let value = reader.sum();
    assert!(reader.rest.is_empty(), "`{text}`: cannot read `{}`", reader.rest);
    value
}

struct Reader<'t> {
    rest: &'t str,
    whole: &'t str,
}

impl Reader<'_> {
    fn take(&mut self, sign: char) -> bool {
        let Some(rest) = self.rest.strip_prefix(sign) else { return false };
        self.rest = rest.trim_start();
        true
    }

    fn sum(&mut self) -> f64 {
        let mut value = self.product();
        loop {
            if self.take('+') {
                value += self.product();
            } else if self.take('-') {
                value -= self.product();
            } else {
                return value;
            }
        }
    }

    fn product(&mut self) -> f64 {
        let mut value = self.power();
        loop {
            if self.take('*') {
                value *= self.power();
            } else if self.take('/') {
                value /= self.power();
            } else {
                return value;
            }
        }
    }

    fn power(&mut self) -> f64 {
        if self.take('-') {
            return -self.power();
        }
        let base = self.atom();
        if self.take('^') { base.powf(self.power()) } else { base }
    }

    fn atom(&mut self) -> f64 {
        if self.take('(') {
            let value = self.sum();
            assert!(self.take(')'), "`{}`: a bracket is open", self.whole);
            return value;
        }
        let letters = self.rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(self.rest.len());
        if self.rest.starts_with(|c: char| c.is_ascii_alphabetic()) {
            let name = &self.rest[..letters];
            self.rest = self.rest[letters..].trim_start();
            return match name {
                "pi" => std::f64::consts::PI,
                _ => function(name, self.atom()),
            };
        }
        let end = number_end(self.rest);
        let (number, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        number.parse().unwrap_or_else(|_| panic!("`{}`: `{number}` is not a number", self.whole))
    }
}

/// Where digits, point and exponent end.
fn number_end(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut end = 0;
    while let Some(&byte) = bytes.get(end) {
        let sign_of_exponent = matches!(byte, b'+' | b'-') && end > 0 && matches!(bytes[end - 1], b'e' | b'E');
        if !(byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'E') || sign_of_exponent) {
            break;
        }
        end += 1;
    }
    end
}

fn function(name: &str, x: f64) -> f64 {
    match name {
        "exp" => x.exp(),
        "log" => x.ln(),
        "log10" => x.log10(),
        "sqrt" => x.sqrt(),
        "sin" => x.sin(),
        "cos" => x.cos(),
        "tan" => x.tan(),
        "asin" => x.asin(),
        "acos" => x.acos(),
        "atan" => x.atan(),
        "sinh" => x.sinh(),
        "cosh" => x.cosh(),
        "tanh" => x.tanh(),
        "acosh" => x.acosh(),
        _ => panic!("unknown function `{name}`"),
    }
}

#[test]
fn closed_forms_have_their_values() {
    for (text, expected) in [
        ("1.5e-3", 1.5e-3),
        ("-2^2", -4.0),
        ("2*(3 - 1)/4", 1.0),
        ("exp(-1)", (-1.0f64).exp()),
        ("2^-1", 0.5),
        ("8 - 3 - 2", 3.0),
        ("sin(pi/6) + 1", 1.5),
    ] {
        assert!((value(text) - expected).abs() < 1e-15, "{text}");
    }
}
