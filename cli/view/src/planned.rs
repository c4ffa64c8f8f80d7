//! The shots to make next (`hyd next --report`), for the page of the finding that they are to settle.

use std::path::Path;

use hyd_compiler::Severity;
use hyd_results::note_read;
use hyd_run::{Failure, read_text};
use hyd_verbs::Listener;
use serde_json::Value;

/// The file that programs read, in the folder of a report.
const DATA: &str = "next.json";
/// Points of a map that a page draws: a search for shots runs some hundreds.
const MOST_POINTS: usize = 3000;

/// What a folder says of the shots to make next; none where it says nothing, and, with a warning, where that is of another search than its report.
///
/// # Errors
/// A file that cannot be read, or is none of `hyd next`.
pub(crate) fn read(folder: &Path, report: &Value, listener: &dyn Listener) -> Result<Option<Value>, Failure> {
    let file = folder.join(DATA);
    if !file.is_file() {
        return Ok(None);
    }
    let shown = file.display();
    let text = read_text(&file).map_err(|error| Failure::Fault(error.to_string()))?;
    note_read(&file);
    let wrong = |why: &str| Failure::Fault(format!("`{shown}` is not what `hyd next` writes: {why}"));
    let mut found: Value = serde_json::from_str(&text).map_err(|error| wrong(&error.to_string()))?;
    fault(&found).map_or(Ok(()), |why| Err(wrong(why)))?;
    for (key, what) in [("set", "of the set"), ("status", "of a search that ended as")] {
        if let (Some(own), Some(known)) = (found[key].as_str(), report[key].as_str())
            && own != known
        {
            let words = format!(
                "`{shown}` is {what} `{own}`, and the report beside it {what} `{known}`: it is left out; another `hyd next` writes it anew"
            );
            listener.sentence(Severity::Warning, &words);
            return Ok(None);
        }
    }
    if let Some(points) = found["points"].as_array_mut() {
        points.truncate(MOST_POINTS);
    }
    Ok(Some(found))
}

/// Why this is no answer that can be drawn; none if it is one.
fn fault(found: &Value) -> Option<&'static str> {
    let Some(shots) = found["shots"].as_array() else { return Some("it has no `shots`") };
    if shots.iter().any(|shot| !shot["settings"].is_array() || !shot["conditions"].is_object()) {
        return Some("a shot has no conditions");
    }
    let axes = match &found["vary"] {
        Value::Null => &Vec::new(),
        Value::Array(axes) => axes,
        _ => return Some("`vary` is not a list"),
    };
    let is_axis = |axis: &Value| axis["condition"].is_string() && axis["low"].is_number() && axis["high"].is_number();
    if !axes.iter().all(is_axis) {
        return Some("a condition that varies has no ends");
    }
    let all = |key: &str| found[key].as_array().into_iter().flatten();
    let has_all = |own: &Value| own["values"].as_array().is_some_and(|values| values.len() == axes.len());
    if !all("points").chain(all("made")).all(has_all) {
        return Some("a point of the map lacks a condition");
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::cell::RefCell;

    use hyd_compiler::{Diagnostic, Files};
    use serde_json::json;

    use super::*;

    /// Keeps sentences.
    #[derive(Default)]
    struct Heard(RefCell<String>);

    impl Listener for Heard {
        fn sentence(&self, _severity: Severity, text: &str) {
            self.0.borrow_mut().push_str(text);
        }

        fn diagnostics(&self, _files: &Files, _diagnostics: &[Diagnostic]) {}
    }

    #[test]
    fn shots_to_make_belong_to_their_search() {
        let folder = std::env::temp_dir().join(format!("hyd-view-planned-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let report = json!({"set": "B", "status": "ambiguous"});
        let said = |text: &str| {
            std::fs::write(folder.join(DATA), text).unwrap();
            let heard = Heard::default();
            let found = match read(&folder, &report, &heard) {
                Ok(found) => found.map_or("none".to_string(), |own| own.to_string()),
                Err(Failure::Fault(text)) => text,
                Err(other) => format!("{other:?}"),
            };
            (found, heard.0.into_inner())
        };
        let good = r#"{"set": "B", "status": "ambiguous", "shots": [{"settings": ["p = 1"], "conditions": {"p": 1}}],
            "vary": [{"condition": "p", "low": 0, "high": 2}], "points": [{"values": [1], "worth": 3.5}]}"#;
        assert!(said(good).0.contains("3.5") && said(good).1.is_empty(), "{:?}", said(good));
        let other = said(&good.replace("\"B\"", "\"C\""));
        assert!(other.0 == "none" && other.1.contains("is of the set `C`"), "{other:?}");
        let other = said(&good.replace("ambiguous", "named"));
        assert!(other.0 == "none" && other.1.contains("ended as `named`"), "{other:?}");
        assert!(said(&good.replace("[1]", "[1, 2]")).0.contains("lacks a condition"));
        assert!(said(&good.replace("\"low\"", "\"least\"")).0.contains("has no ends"));
        assert!(said("[]").0.contains("is not what `hyd next` writes") && said("{").0.contains("is not what"));
        assert!(said(r#"{"set": "B", "nothing": "no shot would settle it", "shots": []}"#).0.contains("no shot"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(read(&folder, &report, &Heard::default()).ok(), Some(None));
    }
}
