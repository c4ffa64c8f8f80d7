//! `fit`: what may be off, fitted to the shots of a bench.

use hyd_compiler::Severity;
use hyd_verbs::Listener;
use hyd_verbs::fit::{FitOptions, fit as fitted};

use super::{BENCH, LIBRARIES, SEED, STUDY, Tool, files_below, opened, with_messages};
use crate::answer::Answer;
use crate::arguments::{Kind, optional};
use crate::calls::Call;

/// What shows that a folder holds a report.
const MARK: &str = "fit.html";

pub(super) const TOOL: Tool = Tool {
    name: "fit",
    title: "Fit a model to a bench",
    says: "Fits what may be off (tolerances of parameters, conditions, sensors, clocks) to the shots of a bench, and tells what is left: the gap of every \
           channel in units of noise (1 is noise alone), the fitted values with their standard errors, and whether the fit converged. May take minutes.",
    arguments: &[
        STUDY,
        BENCH,
        optional(
            "profile",
            Kind::Texts,
            "names of what may be off whose 95 % interval is wanted, from the profile of the likelihood",
        ),
        SEED,
        optional(
            "write_parameters",
            Kind::Text,
            "file (*.toml) for the parameters as fitted, for runs of the model; relative to the folder that is served; a new one [default: none is \
             written]",
        ),
        optional(
            "report",
            Kind::Text,
            "folder of a report (page, picture, curves, values, parameters), relative to the folder that is served; a new one, or one with an earlier \
             report of a fit [default: none is written]",
        ),
        LIBRARIES,
    ],
    is_reading: false,
    run: fit,
};

fn fit(call: &Call<'_>) -> Result<Answer, String> {
    let (folder, given) = (&call.workplace.folder, &call.given);
    let target =
        given.text("write_parameters").map(|name| folder.target("write_parameters", name, &["toml"])).transpose()?;
    let report = given.text("report").map(|name| folder.target_folder("report", name, MARK)).transpose()?;
    let (_, opened) = opened(call)?;
    let options = FitOptions {
        seed: given.natural("seed").unwrap_or(1),
        profile: given.texts("profile"),
        write_parameters: target.clone(),
        report: report.clone(),
    };
    let found = match opened.and_then(|opened| fitted(&opened, &options, &call.kept)) {
        Ok(found) => found,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let mut data = found.json;
    let mut written = Vec::new();
    if let Some(path) = target {
        folder.wrote(&path);
        written.push(path.display().to_string());
    }
    report.iter().for_each(|folder| files_below(folder, &mut written));
    if !written.is_empty() {
        data["files"] = written.into();
    }
    if let Some(sentence) = &found.unconverged {
        call.kept.sentence(Severity::Warning, sentence);
    }
    let text = call.kept.text() + &found.text;
    Ok(Answer { text, data: with_messages(call, data), is_error: found.unconverged.is_some() })
}
