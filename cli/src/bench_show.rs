//! `hyd bench show SET.json`: a page with all shots and channels of a set, before any model.
//!
//! What is shown is computed by `Study::sheet`; the page draws it without a network (`bench_page/page.html`, `page.js`).

use std::path::Path;

use hyd_discovery::{Bench, Fault, Study};
use hyd_results::write_whole;
use hyd_run::read_text;
use serde_json::Value;

use crate::arguments::{MessageFormat, Show};
use crate::{Failure, output};
use hyd_verbs::Libraries;
use hyd_verbs::page::{STYLE, framed};
use hyd_verbs::study::failure;

const OWN_STYLE: &str = include_str!("bench_page/page.css");
const SCRIPT: &str = include_str!("bench_page/page.js");

/// Runs the verb.
pub(crate) fn show(arguments: &Show) -> Result<(), Failure> {
    let text = |path: &Path| read_text(path).map_err(|error| Failure::Fault(error.to_string()));
    let set = text(&arguments.set)?;
    let folder = arguments.set.parent().unwrap_or(Path::new("")).to_path_buf();
    let libraries = Libraries { allow_outside: arguments.allow_outside, ..Libraries::default() };
    let mut read = |name: &str| {
        let path = libraries
            .file_of(&folder, name)
            .map_err(|why| Fault::new(format!("`{}`: the table {why}", arguments.set.display())))?;
        read_text(&path).map_err(|error| Fault::new(error.to_string()))
    };
    let study = match &arguments.study {
        Some(path) => {
            Study::parse(&text(path)?).map_err(|fault| Failure::Fault(format!("`{}`: {fault}", path.display())))?
        }
        None => {
            let headers = headers(&set, &mut read).map_err(failure)?;
            Study::of_columns(&headers)
                .map_err(|fault| Failure::Fault(format!("`{}`: {fault}", arguments.set.display())))?
        }
    };
    // What the recorder wrote is looked at, not what a fit would make of it.
    let study = study.of_every_row();
    let bench = Bench::parse(&arguments.set, &set, &study, &mut read).map_err(failure)?;
    if arguments.study.is_some() {
        for sentence in &bench.warnings {
            output::sentence("warning", sentence, MessageFormat::Text);
        }
    }
    let data = study.sheet(&bench);
    write_whole(&arguments.output, page(&data).as_bytes())
        .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", arguments.output.display())))?;
    output::print(&words(&data, &arguments.output))
}

/// The columns of the tables that a set names; what is wrong with the set is said when it is read.
fn headers(set: &str, read: &mut dyn FnMut(&str) -> Result<String, Fault>) -> Result<Vec<Vec<String>>, Fault> {
    let Ok(set) = serde_json::from_str::<Value>(set) else { return Ok(vec![vec!["time_s".into(), "-".into()]]) };
    let experiments = set.get("experiments").and_then(Value::as_array).into_iter().flatten();
    let mut headers = Vec::new();
    for file in experiments.filter_map(|own| own.get("file")?.as_str()) {
        let text = read(file)?;
        let header = text.lines().next().unwrap_or_default();
        headers.push(header.split(',').map(|name| name.trim().trim_matches('"').to_string()).collect());
    }
    if headers.is_empty() { Ok(vec![vec!["time_s".into(), "-".into()]]) } else { Ok(headers) }
}

fn page(data: &Value) -> String {
    framed("A bench before any model", &format!("{STYLE}{OWN_STYLE}"), SCRIPT, data)
}

/// What stands out, for people.
fn words(data: &Value, page: &Path) -> String {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let mut text = String::new();
    for channel in list(&data["channels"]) {
        for note in list(&channel["notes"]) {
            let (name, note) =
                (channel["name"].as_str().unwrap_or_default(), note.as_str().unwrap_or_default().to_string());
            text.push_str(&format!("{name}: {note}\n"));
        }
    }
    let (shots, channels) = (list(&data["shots"]).len(), list(&data["channels"]).len());
    let several = |count: usize, what: &str| if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") };
    text.push_str(&format!("{} of {} in {}\n", several(channels, "channel"), several(shots, "shot"), page.display()));
    text
}
