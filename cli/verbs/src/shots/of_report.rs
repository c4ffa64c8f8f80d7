//! The shots of a report, from the files of its folder.

use std::collections::BTreeSet;
use std::path::Path;

use hyd_compiler::Severity;
use hyd_discovery::is_below;
use hyd_results::note_read;
use hyd_run::{InputArguments, parameter_file, read_text};
use serde_json::Value;

use super::chain::Chain;
use super::curves::records;
use super::translated::{Around, translated};
use super::{Changed, Channel, Shot, Shots, Text, Trace};
use crate::discovered_files::fingerprint;
use crate::{Failure, Host, Libraries, Listener};

/// Name of the file of the model that a report has written, in its folder.
pub const WRITTEN_MODEL: &str = hyd_discovery::Report::MODEL;
/// Name of the file of a report that programs read.
const REPORT: &str = "report.json";
/// Name of the table of curves in the folder of a report.
const CURVES: &str = "trajectories.csv";

/// True if a file is the model that the report in a folder has written.
pub fn is_written_model(report: &Path, file: &Path) -> bool {
    let own = report.parent().unwrap_or(Path::new("")).join(WRITTEN_MODEL);
    match (own.canonicalize(), file.canonicalize()) {
        (Ok(own), Ok(file)) => own == file,
        _ => false,
    }
}

/// Name of the class that a report has written; none where nothing was found.
pub fn written_class(report: &Value) -> Option<&str> {
    report["change"].as_str()?.split_whitespace().nth(1)
}

/// Names of the inputs that shots of a report drive.
pub fn driven_by(report: &Value) -> Vec<String> {
    let shots = report["run"]["shots"].as_array().into_iter().flatten();
    let names: BTreeSet<&String> =
        shots.filter_map(|own| own["holds"].as_object()).flat_map(|own| own.keys()).collect();
    names.into_iter().cloned().collect()
}

impl Shots {
    /// The shots of a report beside the model that it has written; none if it says nothing of them, as those of earlier versions.
    ///
    /// # Errors
    /// A file of the folder that cannot be read or does not fit the others, channels that the model does not have.
    pub fn of_report(
        folder: &Path,
        report: &Value,
        model: Text<'_>,
        (libraries, host): (&Libraries, Option<&Host>),
        listener: &dyn Listener,
    ) -> Result<Option<Self>, Failure> {
        let fault = |name: &str, what: &str| Failure::Fault(format!("`{}`: {what}", folder.join(name).display()));
        let described = report["run"]["shots"].as_array().filter(|all| !all.is_empty());
        let Some(described) = described.filter(|all| all.iter().all(|own| own["shown"].is_array())) else {
            return Ok(None);
        };
        let text_of = |own: &Value| own.as_str().unwrap_or_default().to_string();
        let channels = report["channels"].as_array().into_iter().flatten().map(|own| {
            let shown = described.iter().flat_map(|shot| shot["shown"].as_array().into_iter().flatten());
            let written = shown.into_iter().find(|shown| shown["channel"] == own["name"]);
            Channel {
                name: text_of(&own["name"]),
                unit: text_of(&own["unit"]),
                words: text_of(&own["words"]),
                expression: text_of(written.map_or(&own["expression"], |shown| &shown["expression"])),
                sigma: own["sigma"].as_f64().unwrap_or(f64::NAN),
            }
        });
        let channels: Vec<Channel> = channels.collect();
        let path = folder.join(CURVES);
        let curves = read_text(&path).map_err(|error| Failure::Fault(error.to_string()))?;
        note_read(&path);
        let recorded = records(&curves, &channels).map_err(|line| {
            fault(CURVES, &format!("line {line} is not one of the curves that `{REPORT}` has, or not in their order"))
        })?;
        if recorded.len() != described.len() {
            return Err(fault(
                CURVES,
                &format!("it has the curves of {} shots, and `{REPORT}` {}", recorded.len(), described.len()),
            ));
        }
        let mut all = Vec::new();
        for (own, record) in described.iter().zip(recorded) {
            let wrong = || fault(REPORT, &format!("what it says of shot {} is not whole", record.number));
            if own["shot"].as_u64() != Some(record.number as u64) {
                return Err(fault(CURVES, &format!("its shots are not those of `{REPORT}`, or not in their order")));
            }
            let inside = |name: &str| match is_below(name) {
                true => Ok(folder.join(name)),
                false => Err(fault(REPORT, &format!("`{name}` is not a file of its folder"))),
            };
            let parameters = inside(own["parameters"].as_str().ok_or_else(wrong)?)?;
            let table = match own["inputs"].as_str() {
                None => None,
                Some(name) => {
                    let holds = own["holds"].as_object().into_iter().flatten();
                    let hold = holds.filter_map(|(name, hold)| Some(format!("{name}={}", hold.as_str()?))).collect();
                    InputArguments { input: Some(inside(name)?), hold }.read()?
                }
            };
            let number = |key: &str| own[key].as_f64().ok_or_else(wrong);
            let chain_of = |channel: &Channel| {
                let shown = own["shown"].as_array()?.iter().find(|own| own["channel"] == *channel.name)?;
                let end = |k: usize, open: f64| shown["limits"][k].as_f64().unwrap_or(open);
                Some(Chain {
                    gain: shown["gain"].as_f64()?,
                    offset: shown["offset"].as_f64()?,
                    late: shown["late"].as_f64()?,
                    clock: shown["clock"].as_f64()?,
                    limits: (end(0, f64::NEG_INFINITY), end(1, f64::INFINITY)),
                })
            };
            let traces = channels.iter().zip(record.traces).map(|(channel, curves)| {
                let Some([measured, base, found]) = curves else { return Ok(None) };
                let chain = chain_of(channel).ok_or_else(wrong)?;
                Ok(Some(Trace { measured, base: Some(base), found: Some(found), chain, added: Vec::new() }))
            });
            all.push(Shot {
                number: record.number,
                held_out: own["heldout"] == true,
                set: parameter_file::read(&parameters)?,
                table,
                span: (number("start")?, number("stop")?),
                traces: traces.collect::<Result<_, Failure>>()?,
                times: record.times,
            });
        }
        let driven = driven_by(report);
        let around = Around { driven: &driven, libraries, host };
        let (translated, translator, joined) = translated(model, (&channels, &all), around, listener)?;
        let slack = Vec::new();
        let mut shots = Self { channels, all, slack, translated, translator, joined, tolerance: None };
        if report["run"]["fingerprint"].as_str() == Some(&fingerprint(model.text.as_bytes())) {
            shots.learn_added();
        } else {
            let edited = model.file.display();
            listener.sentence(Severity::Warning, &format!(
                "`{edited}` is not as the report has written it: what a measuring chain adds over time (hum, drift) is left out"
            ));
        }
        Ok(Some(shots))
    }

    /// Takes what a report shows beyond its chains for what is added to them, so that a run of the model as it stands is the curve of the report.
    fn learn_added(&mut self) {
        for shot in 0..self.all.len() {
            let models = self.models(shot, Changed::default(), &|| false).ok();
            for (k, trace) in self.all[shot].traces.iter_mut().enumerate() {
                let Some(trace) = trace else { continue };
                let (Some(models), Some(found)) = (&models, &trace.found) else { continue };
                let added =
                    models.channels[k].iter().zip(found).map(|(model, found)| trace.chain.added(*model, *found));
                trace.added = added.collect();
            }
        }
    }
}
