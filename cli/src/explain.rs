//! `hyd explain CODE`: the paragraph behind an error code; without a code, the list of all.

use std::fmt::Write as _;

use hyd_source::{Code, did_you_mean};

use crate::arguments::Explain;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn explain(arguments: &Explain) -> Result<(), Failure> {
    let text = match &arguments.code {
        None => list(),
        Some(wanted) => {
            let code = Code::ALL.iter().find(|code| code.number().eq_ignore_ascii_case(wanted.trim()));
            match code {
                Some(code) => format!("{code}: {}\n\n{}\n", code.title(), fold(code.explanation(), 80)),
                None => {
                    let hint = did_you_mean(&wanted.to_uppercase(), Code::ALL.iter().map(|code| code.number()));
                    let hint = hint.unwrap_or_else(|| "`hyd explain` lists all codes".to_string());
                    return Err(Failure::Usage(format!("there is no code `{wanted}`; {hint}")));
                }
            }
        }
    };
    output::print(&text)
}

fn list() -> String {
    let mut text = String::new();
    for code in Code::ALL {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{code}  {}", code.title());
    }
    text
}

/// Breaks a paragraph into lines of at most `width` characters.
fn fold(paragraph: &str, width: usize) -> String {
    let mut text = String::new();
    let mut column = 0;
    for word in paragraph.split_whitespace() {
        let length = word.chars().count();
        if column > 0 && column + 1 + length > width {
            text.push('\n');
            column = 0;
        } else if column > 0 {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += length;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_are_folded() {
        assert_eq!(fold("one two three  four", 9), "one two\nthree\nfour");
        assert_eq!(fold("", 9), "");
    }
}
