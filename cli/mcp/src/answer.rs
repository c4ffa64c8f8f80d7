//! What a call of a tool gives: a short text, the same as data, and whether it failed; both of bounded size.

use hyd_run::Failure;
use serde_json::{Value, json};

use crate::kept::Kept;

/// Characters of the text of an answer.
const LONGEST_TEXT: usize = 24_000;
/// Items of a list in the data of an answer.
const MOST_ITEMS: usize = 100;

/// The answer to a call.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    pub(crate) text: String,
    pub(crate) data: Value,
    pub(crate) is_error: bool,
}

impl Answer {
    /// What was asked for.
    pub(crate) fn done(text: String, data: Value) -> Self {
        Self { text, data, is_error: false }
    }

    /// Arguments that make no sense; the sentence says what would.
    pub(crate) fn refused(sentence: String) -> Self {
        let data = json!({"status": "refused", "message": sentence});
        Self { text: sentence, data, is_error: true }
    }

    /// A verb that ended short of success, with what was said on the way.
    pub(crate) fn failed(failure: &Failure, kept: &Kept<'_>) -> Self {
        let status = match failure {
            Failure::Solver(_) | Failure::SolverReported => "failed",
            Failure::Usage(_) => "refused",
            Failure::Reported | Failure::Fault(_) | Failure::OutputClosed => "rejected",
        };
        let sentence = match failure {
            Failure::Fault(sentence) | Failure::Usage(sentence) | Failure::Solver(sentence) => {
                // Arguments of tools have the names of options.
                Some(sentence.trim_start_matches("--").to_string())
            }
            _ => None,
        };
        let (messages, _) = kept.messages();
        let text = kept.text() + &sentence.as_ref().map(|own| format!("error: {own}\n")).unwrap_or_default();
        let data = json!({"status": status, "message": sentence, "messages": messages});
        Self { text, data, is_error: true }
    }

    /// As `result` of a call has it.
    pub(crate) fn result(mut self) -> Value {
        let mut cut = Vec::new();
        shorten(&mut self.data, "", &mut cut);
        if let (Value::Object(data), false) = (&mut self.data, cut.is_empty()) {
            data.insert("left_out".into(), cut.into());
        }
        let text = cut_text(&self.text, LONGEST_TEXT);
        json!({"content": [{"type": "text", "text": text}], "structuredContent": self.data, "isError": self.is_error})
    }
}

/// The first characters of a text, with a note of what was cut.
fn cut_text(text: &str, most: usize) -> String {
    if text.len() <= most {
        return text.to_string();
    }
    let end = text[..text.floor_char_boundary(most)].rfind('\n').map_or(text.floor_char_boundary(most), |at| at + 1);
    let lines = text[end..].lines().count();
    format!("{}({lines} more lines are left out)\n", &text[..end])
}

/// Keeps the first items of long lists; `cut` names the lists with their whole lengths.
fn shorten(value: &mut Value, path: &str, cut: &mut Vec<Value>) {
    match value {
        Value::Array(items) => {
            if items.len() > MOST_ITEMS {
                cut.push(json!({"list": path, "items": items.len(), "shown": MOST_ITEMS}));
                items.truncate(MOST_ITEMS);
            }
            for (k, item) in items.iter_mut().enumerate() {
                shorten(item, &format!("{path}[{k}]"), cut);
            }
        }
        Value::Object(fields) => {
            for (name, field) in fields {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                shorten(field, &path, cut);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_cut_with_a_note() {
        let data = json!({"a": {"b": vec![1; 250]}, "c": [1, 2]});
        let result = Answer::done("x".into(), data).result();
        let own = &result["structuredContent"];
        assert_eq!(own["a"]["b"].as_array().map(Vec::len), Some(MOST_ITEMS));
        assert_eq!(own["c"], json!([1, 2]));
        assert_eq!(own["left_out"], json!([{"list": "a.b", "items": 250, "shown": 100}]));
    }

    #[test]
    fn long_texts_are_cut_at_a_line() {
        assert_eq!(cut_text("one\ntwo\nthree\n", 9), "one\ntwo\n(1 more lines are left out)\n");
        assert_eq!(cut_text("ééé", 3), "é(1 more lines are left out)\n");
        assert_eq!(cut_text("short", 5), "short");
    }
}
