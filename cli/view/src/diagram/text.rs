//! The texts of icons: `%name` and the like replaced by what they stand for (Modelica 3.6, section 18.6.5.5).

/// Replaces `%name`, `%class`, `%%`, and `%p` or `%{p}` by what `parameter` says of a parameter.
pub(crate) fn filled(text: &str, name: &str, class: &str, mut parameter: impl FnMut(&str) -> Option<String>) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('%') {
        out.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        if let Some(after) = rest.strip_prefix('%') {
            out.push('%');
            rest = after;
            continue;
        }
        let (word, after) = match rest.strip_prefix('{').and_then(|inner| inner.split_once('}')) {
            Some(found) => found,
            None => {
                let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
                let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
                let word = rest[..end].trim_end_matches('.');
                (word, &rest[word.len()..])
            }
        };
        rest = after;
        match word {
            "" => out.push('%'),
            "name" => out.push_str(name),
            "class" => out.push_str(class.rsplit('.').next().unwrap_or(class)),
            word => out.push_str(&parameter(word).unwrap_or_else(|| word.to_string())),
        }
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_percent_signs_stand_for() {
        let filled = |text: &str| filled(text, "r", "A.B.Resistor", |name| (name == "R").then(|| "10".to_string()));
        assert_eq!(filled("%name: R=%R Ohm"), "r: R=10 Ohm");
        assert_eq!(filled("%class %%, %{R}k, %T."), "Resistor %, 10k, T.");
        assert_eq!(filled("50 %"), "50 %");
    }
}
