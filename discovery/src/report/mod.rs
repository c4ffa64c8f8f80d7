//! What is written down: the model as text, the findings as JSON, measured and simulated channels, a summary to read.
//!
//! Numbers of the extended model come from runs of the text that is written, translated anew.  Gaps are roots of the mean square of
//! residuals in standard deviations of the noise (1.0 is noise); see [`crate::evidence::proof`].

mod course;
mod disturbed;
mod fitted;
mod json;
mod nearest;
mod parameter_file;
mod parameters;
mod phases;
mod shot_files;
mod sizes;
mod summary;
mod trajectories;
mod written;

use std::sync::Arc;

use hyd_compiler::{ForeignBlock, print_string};
use serde_json::{Value, json};

use crate::catalogue::Candidate;
use crate::evidence::proof::Gap;
use crate::search::{Findings, Pass, Status};
use crate::unknowns::EffectPart;
use crate::variant::data_files::DataFiles;
use crate::variant::{Insert, Workshop};
use crate::{Fault, Setup};

pub use fitted::FittedReport;
pub(crate) use shot_files::ShotFiles;
pub use shot_files::quoted;
pub use trajectories::{ChannelCurves, ShotCurves};

/// Everything that is written down.
pub struct Report {
    /// `report.json`.
    pub json: Value,
    /// `discovered.hyd`, if something was named.
    pub model: Option<String>,
    /// Measured, base and extended, shot by shot.
    pub curves: Vec<ShotCurves>,
    /// The parameters of that model, or of the base model, for the first shot that was fitted: `parameters.toml`.
    pub parameters: String,
    /// For the terminal.
    pub summary: String,
    /// Names and texts of the files that the report points at.
    pub texts: Vec<(String, String)>,
    /// What belongs to each shot alone, for runs of the model; none if nothing was named.
    pub shots: Vec<ShotFiles>,
    /// Data files that the model reads, by their names in the folder of the report.
    pub data: DataFiles,
    /// Names of data files that the model reads and that cannot stand in that folder.
    pub lost: Vec<String>,
    /// Units of other tools that the model holds, in their order.
    pub units: Vec<ForeignBlock>,
    /// Name of the file and text of the law that was found, an effect for a library.
    pub law: Option<(String, Arc<str>)>,
}

/// Gaps of one model on the shots that were fitted and on those held out.
struct Gaps {
    train: Gap,
    held_out: Option<Gap>,
}

/// The gaps of the machine as its drawings say, of the base model as fitted, and of the model with what was found.
struct AllGaps {
    raw: Option<Gap>,
    before: Gaps,
    after: Option<Gaps>,
}

/// Study, set, models and what was found.
#[derive(Clone, Copy)]
struct Scene<'a> {
    setup: &'a Setup,
    workshop: &'a Workshop<'a>,
    findings: &'a Findings,
    first: &'a Pass,
    last: &'a Pass,
}

/// The folder that a report is for.
#[derive(Clone, Copy)]
pub struct Folder<'a> {
    /// Knows the names of texts that every reader has.
    pub built_in: &'a dyn Fn(&str) -> bool,
    /// Names of the files that are written there whatever is found.
    pub taken: &'a [&'a str],
}

impl Report {
    /// The file of the model that has what was found, in the folder of a report.
    pub const MODEL: &str = "discovered.hyd";

    /// Writes everything down.
    ///
    /// # Errors
    /// When the written model cannot be translated or run.
    pub fn of(
        setup: &Setup,
        workshop: &Workshop<'_>,
        findings: &Findings,
        seconds: f64,
        folder: Folder<'_>,
    ) -> Result<Self, Fault> {
        match &findings.law {
            Some(law) => law.known_to(workshop, |workshop| Self::with(setup, workshop, findings, seconds, folder)),
            None => Self::with(setup, workshop, findings, seconds, folder),
        }
    }

    fn with(
        setup: &Setup,
        workshop: &Workshop<'_>,
        findings: &Findings,
        seconds: f64,
        folder: Folder<'_>,
    ) -> Result<Self, Fault> {
        let (Some(first), Some(last)) = (findings.passes.first(), findings.passes.last()) else {
            return Err(Fault::run("nothing was fitted"));
        };
        // What was tried on the way is not part of the answer that nothing is missing.
        let last = if findings.status == Status::Adequate { first } else { last };
        let scene = Scene { setup, workshop, findings, first, last };
        let base = first.base.problem(setup)?;
        let raw = Gap::of(&base, &vec![0.0; base.unknowns.len()], &setup.train, false).ok();
        let before = gaps(setup, &base, &first.fit.xi)?;
        let extended = if is_named(findings.status) { Some(scene.extend(folder)?) } else { None };
        let with = extended.as_ref().map(|own| own.problem(&scene)).transpose()?;
        let after = match &with {
            Some(problem) => Some(gaps(setup, problem, &last.fit.xi)?),
            None => None,
        };
        let parameters = {
            let (shot, class) = (setup.train[0], &workshop.class);
            match &with {
                Some(problem) => {
                    let title = format!("{} ({class} with what was found)", workshop.extended_name());
                    problem.parameter_file(&last.fit.xi, shot, &title)
                }
                None => base.parameter_file(&first.fit.xi, shot, class),
            }
        };
        let gaps = AllGaps { raw, before, after };
        let curves = trajectories::curves(&scene, &gaps)?;
        let shots = match (&extended, &with) {
            (Some(own), Some(problem)) => shot_files::shot_files(&scene, (&gaps, own), problem, Self::MODEL),
            _ => Vec::new(),
        };
        let mut json = json::json(&scene, &gaps, seconds)?;
        let texts = scene.pointed_at(&json)?;
        if let (Value::Object(object), Some(own)) = (&mut json, &extended) {
            object.insert("change".into(), json!(own.own));
            object.insert("run".into(), json::run(&shots, own.data.keys()));
        }
        let summary = summary::summary(&scene, &gaps, seconds, &json)?;
        drop(with);
        let (model, data, lost) = extended.map_or_else(Default::default, |own| (Some(own.whole), own.data, own.lost));
        let law = findings.law.as_ref().map(|law| (law.file(), law.text.clone()));
        let units = last.base.machine.blocks().to_vec();
        Ok(Report { json, model, curves, parameters, summary, texts, shots, data, lost, units, law })
    }
}

/// Where a model comes from, for its annotation.
fn discovered(class: &str, status: &str, set: &str) -> String {
    let [class, status, set] = [class, status, set].map(print_string);
    format!("discovered(from = {class}, status = {status}, set = {set})")
}

fn is_named(status: Status) -> bool {
    matches!(status, Status::Named | Status::Sensor | Status::Law)
}

fn gaps(setup: &Setup, problem: &crate::problem::Problem<'_>, xi: &[f64]) -> Result<Gaps, Fault> {
    let train = Gap::of(problem, xi, &setup.train, false)?;
    let held_out = match setup.held_out.is_empty() {
        true => None,
        false => Some(Gap::of(problem, xi, &setup.held_out, true)?),
    };
    Ok(Gaps { train, held_out })
}

impl Scene<'_> {
    /// Texts of the files that effects, terms and places of a report stand in.
    fn pointed_at(&self, json: &Value) -> Result<Vec<(String, String)>, Fault> {
        let law = json["law"].as_object().map(|_| &json["law"]);
        let lists =
            ["effects", "location", "proposed"].into_iter().filter_map(|key| json[key].as_array()).flatten().chain(law);
        let mut names: Vec<&str> = lists.filter_map(|own| own["file"].as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let mut files = self.workshop.files(&inserts(self.setup, self.last)?)?;
        // What an effect has taken the place of is in the base model only.
        for base in self.workshop.files(&[])? {
            if files.iter().all(|(name, _)| *name != base.0) {
                files.push(base);
            }
        }
        files.retain(|(name, _)| names.contains(&name.as_str()));
        Ok(files)
    }
}

/// The effects of a pass with their fitted values; what is another one in every shot gets its mean over the fitted shots.
fn inserts(setup: &Setup, pass: &Pass) -> Result<Vec<Insert>, Fault> {
    let problem = pass.base.problem(setup)?;
    let value = |part: EffectPart| {
        let of = problem.unknowns.iter().zip(&pass.fit.xi).filter(|(unknown, _)| {
            unknown.effect == Some(part) && unknown.shot.is_none_or(|shot| setup.train.contains(&shot))
        });
        let values: Vec<f64> = of.map(|(unknown, &xi)| unknown.value(xi)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let make = |(effect, candidate): (usize, &Candidate)| {
        let values = (0..candidate.effect.parameters.len()).map(|parameter| value(EffectPart { effect, parameter }));
        Insert { candidate: candidate.clone(), values: values.collect() }
    };
    Ok(pass.base.inserts.iter().enumerate().map(make).collect())
}

/// A number, or null where there is none.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hyd_compiler::{Goal, Options, SourceText, Sources, compile};

    use super::discovered;
    use crate::variant::Workshop;

    struct Nothing;

    impl Sources for Nothing {
        fn find(&mut self, _: &[std::sync::Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    /// The name of a set and the words of a library are anybody's.
    #[test]
    fn no_name_and_no_words_break_the_text() {
        let nasty = "a \"quoted\" \\ word\nand an end \\";
        let workshop = Workshop {
            study: "bench.toml".into(),
            sources: &|| Box::new(Nothing),
            preamble: String::new(),
            file: "base.hyd".into(),
            class: "'my \\\"own\\\"'".into(),
            channels: Vec::new(),
            starts: Vec::new(),
            driven: Vec::new(),
            library_classes: Arc::new([]),
            opaque: None,
            others: crate::variant::other_files::OtherFiles::default(),
        };
        let annotation = format!("  annotation(__hyd({}));\n", discovered(&workshop.class, "named", nasty));
        let base = format!("model {0}\n  Real x = 1;\nend {0};\n", workshop.class);
        let text = base + &workshop.extended(&[], nasty, &[], &annotation);
        let options = Options { model: Some("Discovered".into()), set: Vec::new(), goal: Goal::Flat, clock: || 0.0 };
        let compilation = compile(&mut Nothing, "discovered.hyd", &text, &options);
        assert!(
            compilation.diagnostics.is_empty() && compilation.flat.is_some(),
            "{text}\n{:?}",
            compilation.diagnostics
        );
        assert!(text.contains(r#"set = "a \"quoted\" \\ word\nand an end \\""#), "{text}");
    }
}
