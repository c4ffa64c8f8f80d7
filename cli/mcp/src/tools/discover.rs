//! `discover`: where a model and a bench disagree, what is missing, and the model that has it.

use hyd_verbs::discover::{SearchOptions, discover as search};
use serde_json::{Value, json};

use super::{BENCH, LIBRARIES, SEED, STUDY, Tool, files_below, opened, with_messages};
use crate::answer::Answer;
use crate::arguments::{Kind, optional, required};
use crate::calls::Call;

/// What shows that a folder holds a report.
const MARK: &str = "report.json";

pub(super) const TOOL: Tool = Tool {
    name: "discover",
    title: "Find what a model lacks",
    says: "Compares a model with a bench, locates where they disagree, names the effect that is missing if the records prove it, and writes a report with \
           the model that has it. Gives the report's data: status, effects with sizes and standard errors, gaps of every channel before and after, places, \
           rivals. The report in full, with pictures, lies in the folder. May take many minutes; ask for progress.",
    arguments: &[
        STUDY,
        BENCH,
        required(
            "report",
            Kind::Text,
            "folder of the report, relative to the folder that is served; a new one, or one with an earlier report",
        ),
        optional("resume", Kind::Flag, "goes on where an earlier call for the same report was ended"),
        SEED,
        LIBRARIES,
    ],
    is_reading: false,
    run: discover,
};

fn discover(call: &Call<'_>) -> Result<Answer, String> {
    let given = &call.given;
    let report = call.workplace.folder.target_folder("report", given.needed("report"), MARK);
    // A search that was ended has left its fits, and no report yet.
    let report = match (report, given.flag("resume")) {
        (Err(_), true) => call.workplace.folder.target_folder("report", given.needed("report"), "fits.jsonl")?,
        (report, _) => report?,
    };
    let (files, opened) = opened(call)?;
    let options = SearchOptions {
        report: report.clone(),
        resume: given.flag("resume"),
        calibrate: None,
        shared: None,
        seed: given.natural("seed").unwrap_or(1),
    };
    let found = match opened.and_then(|opened| search(&files, &opened, &options, &call.kept)) {
        Ok(found) => found,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let mut data: Value = serde_json::from_str(&found.json).unwrap_or_default();
    let mut written = Vec::new();
    files_below(&report, &mut written);
    data["files"] = json!(written);
    data["model_file"] = json!(found.model.map(|path| path.display().to_string()));
    Ok(Answer::done(call.kept.text() + &found.text, with_messages(call, data)))
}
