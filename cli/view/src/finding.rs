//! What a search says of a model (`hyd discover --report`): the places where something seems to be missing, for its diagram.

use std::path::{Path, PathBuf};

use hyd_results::note_read;
use hyd_run::{Failure, read_text};
use serde_json::{Value, json};

/// The file of a report's folder that programs read.
const DATA: &str = "report.json";
/// Places that a page lists.
const MOST_PLACES: usize = 200;

/// The data of a report, where a path is one: its folder, or the file in it.
pub(crate) fn report_of(path: &Path) -> Option<PathBuf> {
    let file = if path.is_dir() { path.join(DATA) } else { path.to_path_buf() };
    (file.file_name().is_some_and(|name| name == DATA) && file.is_file()).then_some(file)
}

/// The report in a file.
///
/// # Errors
/// It cannot be read or is not JSON.
pub(crate) fn parse(file: &Path) -> Result<Value, Failure> {
    let shown = file.display();
    let text = read_text(file).map_err(|error| Failure::Fault(error.to_string()))?;
    note_read(file);
    serde_json::from_str(&text)
        .map_err(|error| Failure::Fault(format!("`{shown}` is not a report of `hyd discover`: {error}")))
}

/// Reads a report of the model `name`, or of any model.
///
/// # Errors
/// It cannot be read, is not a report, or is one of another model.
pub(crate) fn read(file: &Path, name: Option<&str>) -> Result<Value, Failure> {
    let shown = file.display();
    let report = parse(file)?;
    let (Some(model), Some(places)) = (report["model"].as_str(), report["location"].as_array()) else {
        return Err(Failure::Fault(format!(
            "`{shown}` is not a report of `hyd discover`: it names no model or no places"
        )));
    };
    if let Some(name) = name.filter(|name| *name != model) {
        return Err(Failure::Usage(format!("`{shown}` is the report of a search in `{model}`, not in `{name}`")));
    }
    let place = |own: &Value| {
        json!({"component": own["component"], "components": own["components"], "equation": own["equation"], "effect": own["effect"], "coefficient": own["coefficient"],
            "shape": own["shape"], "unit": own["unit"], "score": own["score"]})
    };
    let named = report["effects"].as_array().into_iter().flatten().map(|own| {
        json!({"component": own["component"], "components": own["components"], "effect": own["effect"], "words": own["equation"], "parameters": own["parameters"]})
    });
    Ok(json!({
        "sentence": report["sentence"],
        "status": report["status"],
        "needed": report["needed"],
        "places": places.iter().take(MOST_PLACES).map(place).collect::<Vec<_>>(),
        "named": named.collect::<Vec<_>>(),
    }))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_report_belongs_to_its_model() {
        let folder = std::env::temp_dir().join(format!("hyd-view-finding-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join(DATA);
        let said = |text: &str| {
            std::fs::write(&file, text).unwrap();
            match read(&file, Some("M")) {
                Ok(found) => found.to_string(),
                Err(Failure::Fault(text) | Failure::Usage(text)) => text,
                Err(other) => format!("{other:?}"),
            }
        };
        let report = r#"{"model": "M", "sentence": "named", "effects": [], "location": [{"component": "a", "equation": "x = 0", "score": 3.5}]}"#;
        assert!(said(report).contains(r#""component":"a""#), "{}", said(report));
        assert!(said(&report.replace("\"M\"", "\"N\"")).ends_with("is the report of a search in `N`, not in `M`"));
        assert!(said("{}").contains("not a report of `hyd discover`"));
        assert!(said("[").contains("not a report of `hyd discover`"));
        assert_eq!(report_of(&folder), Some(file.clone()));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(report_of(&folder), None);
    }
}
