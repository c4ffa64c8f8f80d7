//! What is looked at: a model that can be run again, and results of files beside it.

use std::collections::BTreeSet;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_compiler::inquiry::of_instances;
use hyd_compiler::render::render;
use hyd_compiler::{Code, Compilation, Diagnostic, Extras, Goal, Severity};
use hyd_results::{Table, Trajectory};
use hyd_run::{Failure, RunArguments, Selection, Status, clock, parameters, read_text};
use hyd_system::{DaeSystem, Hold, Place, Series, ValueKind};
use hyd_verbs::result_table::read_runs;
use hyd_verbs::unit::is_unit;
use hyd_verbs::unit_model::unit_model;
use hyd_verbs::{Host, Joined, Libraries, Listener, Request, Run, compile_text, run_diagnostic, with_whole_loops};
use serde_json::{Map, Value, json};

use hyd_verbs::shots::{START, Shot, driven_by, is_written_model, written_class};
use hyd_verbs::study::{StudyFiles, open as open_study};

use crate::beside::Beside;
use crate::diagram::extract::{Extracted, extract};
use crate::encode::Numbers;
use crate::finding;
use crate::planned;

/// Runs of files that one page overlays.
const MOST_RUNS: usize = 12;
/// Names of variables with values that are no numbers, in a message.
const MOST_NAMED: usize = 5;
/// Variables that are drawn at first when nobody says which.
const FEW: usize = 3;

/// A model, translated.
pub(crate) struct Model {
    pub(crate) file: PathBuf,
    pub(crate) compilation: Compilation,
    pub(crate) extracted: Extracted,
    /// Parameters that are set from outside.
    pub(crate) set: Vec<(String, String)>,
    pub(crate) stop: Option<f64>,
    /// Connectors and inputs that lack what is connected to them: the model is a component, and cannot be run.
    pub(crate) open_ends: Vec<String>,
    /// The text.
    pub(crate) text: String,
    /// Where its classes come from.
    libraries: Libraries,
    /// Inputs that follow records of shots: without a shot it cannot be run.
    pub(crate) driven: Vec<String>,
    /// Units of other tools that are blocks of it.
    joined: Option<Joined>,
    /// It is such a unit, and its text says no more than what is given to it and shown of it.
    pub(crate) is_unit: bool,
}

/// A run that a file holds.
pub(crate) struct FileRun {
    pub(crate) label: String,
    pub(crate) table: Table,
}

/// What is looked at.
pub(crate) struct Session {
    pub(crate) title: String,
    pub(crate) model: Option<Model>,
    pub(crate) runs: Vec<FileRun>,
    /// What a search says of the model.
    pub(crate) finding: Option<Value>,
    /// The shots that would settle what the search leaves open.
    pub(crate) next: Option<Value>,
    /// Shots of a bench beside the model.
    pub(crate) beside: Option<Beside>,
    /// Name and unit of each variable of the files.
    pub(crate) units: std::collections::BTreeMap<String, String>,
}

/// What to take of a model's file.
pub(crate) struct Chosen<'a> {
    pub(crate) class: Option<&'a str>,
    pub(crate) set: &'a [(String, String)],
    pub(crate) stop: Option<f64>,
    pub(crate) libraries: &'a Libraries,
    pub(crate) strict_units: bool,
    /// The set of shots of a study.
    pub(crate) bench: Option<&'a Path>,
    /// How processes of units of other tools are begun.
    pub(crate) host: Option<&'a Host>,
}

fn ends_in(file: &Path, endings: &[&str]) -> bool {
    let ending = file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    endings.contains(&&*ending)
}

impl Session {
    /// Reads and translates; what the compiler says goes to the listener.
    ///
    /// # Errors
    /// Why there is nothing to look at.
    pub(crate) fn open(files: &[PathBuf], chosen: &Chosen<'_>, listener: &dyn Listener) -> Result<Self, Failure> {
        let is_model = |file: &PathBuf| ends_in(file, &["hyd", "mo"]);
        let is_study = |file: &PathBuf| ends_in(file, &["toml"]);
        let Some(first) = files.first() else { return Err(Failure::Usage("no file is given".to_string())) };
        if let Some(other) = files[1..].iter().find(|file| is_model(file) || is_study(file)) {
            let other = other.display();
            return Err(Failure::Usage(format!(
                "`{other}`: only the first file may be a model or a study; further ones are results that are overlaid"
            )));
        }
        for (k, file) in files.iter().enumerate() {
            if is_unit(file) && k > 0 {
                let file = file.display();
                return Err(Failure::Usage(format!("`{file}`: a unit of another tool comes first, like a model")));
            }
            if !is_model(file)
                && !is_unit(file)
                && !is_study(file)
                && finding::report_of(file).is_none()
                && !ends_in(file, &["csv", "parquet", "mat"])
                && !file.is_dir()
            {
                let file = file.display();
                return Err(Failure::Usage(format!(
                    "`{file}`: models end in .hyd or .mo, studies in .toml, results in .csv, .parquet or .mat"
                )));
            }
        }
        let (mut model, mut beside) = (None, None);
        if is_study(first) {
            let (own, shots) = Model::of_study(first, chosen, listener)?;
            (model, beside) = (Some(own), Some(shots));
        } else if is_unit(first) {
            model = Some(Model::of_unit(first, chosen, listener)?);
        } else if is_model(first) {
            let reports = files[1..].iter().filter_map(|file| finding::report_of(file));
            let written = reports.filter(|report| is_written_model(report, first)).collect::<Vec<_>>();
            let report = written.first().map(|report| finding::parse(report)).transpose()?;
            let driven = report.as_ref().map(driven_by).unwrap_or_default();
            let text = read_text(first).map_err(|error| Failure::Fault(error.to_string()))?;
            let own = Model::open(first, text, chosen, &driven, listener)?;
            let class = own.compilation.model_name.as_deref();
            if let Some(known) = report.as_ref().and_then(written_class).filter(|known| Some(*known) != class) {
                let words =
                    format!("the shots of this report stand beside `{known}`, the model that its search has written");
                listener.sentence(Severity::Note, &words);
            }
            let report = report.filter(|report| class.is_some() && written_class(report) == class);
            if let (Some(report), Some(file)) = (&report, written.first()) {
                beside = Beside::of_report(file, report, &own, (chosen.libraries, chosen.host), listener)?;
            }
            model = Some(own);
        }
        if chosen.bench.is_some() && !is_study(first) {
            let first = first.display();
            return Err(Failure::Usage(format!(
                "`{first}`: --bench belongs to a study (.toml), which says what its channels are"
            )));
        }
        let mut session = Session {
            title: match &model {
                Some(model) => model.compilation.model_name.as_deref().unwrap_or_default().to_string(),
                None => first.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            },
            model,
            runs: Vec::new(),
            finding: None,
            next: None,
            beside,
            units: std::collections::BTreeMap::new(),
        };
        for file in &files[usize::from(session.model.is_some())..] {
            let Some(report) = finding::report_of(file) else {
                session.read(file)?;
                continue;
            };
            let name = session.model.as_ref().and_then(|model| model.compilation.model_name.as_deref());
            let Some(name) = name else {
                let file = file.display();
                return Err(Failure::Usage(format!(
                    "`{file}` is the report of a search: the model that it is of comes first"
                )));
            };
            if session.finding.is_some() {
                return Err(Failure::Usage("a page shows the finding of one search".to_string()));
            }
            let written = session.model.as_ref().is_some_and(|model| is_written_model(&report, &model.file))
                && written_class(&finding::parse(&report)?) == Some(name);
            session.finding = Some(finding::read(&report, (!written).then_some(name))?);
            let folder = report.parent().unwrap_or(Path::new(""));
            session.next = planned::read(folder, &finding::parse(&report)?, listener)?;
        }
        Ok(session)
    }

    fn read(&mut self, file: &Path) -> Result<(), Failure> {
        let found = read_runs(file, &|_| true)?;
        self.units.extend(found.units);
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let is_taken = self.runs.iter().any(|run| run.label == stem);
        let label = if is_taken { file.display().to_string() } else { stem };
        if found.runs.iter().all(|(_, table)| table.times.is_empty()) {
            return Err(Failure::Fault(format!("`{}` holds no rows", file.display())));
        }
        for (member, table) in found.runs {
            if self.runs.len() >= MOST_RUNS {
                return Err(Failure::Usage(format!("`{}`: a page overlays {MOST_RUNS} runs of files", file.display())));
            }
            let label = member.map_or_else(|| label.clone(), |member| format!("{label}: {member}"));
            self.runs.push(FileRun { label, table: split_units(table, &mut self.units) });
        }
        Ok(())
    }

    /// Columns of a run of a file.
    pub(crate) fn of_file(&self, run: usize, wanted: &dyn Fn(usize) -> bool) -> Option<Numbers> {
        let FileRun { label, table } = self.runs.get(run)?;
        let columns = (0..table.names.len()).filter(|&k| wanted(k)).map(|k| (k, table.columns[k].clone()));
        let names = table.names.iter().zip(&table.columns);
        let wrong =
            names.filter(|(_, values)| values.iter().any(|value| !value.is_finite())).map(|(name, _)| name.as_str());
        let header = json!({"label": label, "status": "file", "message": not_numbers(wrong)});
        Some(Numbers { header, times: table.times.clone(), parameters: Vec::new(), columns: columns.collect() })
    }

    /// For each run of a file its name, the columns by name, and what does not change in it.
    pub(crate) fn of_files(&self) -> Value {
        let one = |run: &FileRun| {
            let columns: Map<String, Value> =
                run.table.names.iter().enumerate().map(|(k, name)| (name.clone(), k.into())).collect();
            let constants: Map<String, Value> =
                run.table.constants.iter().map(|(name, value)| (name.clone(), (*value).into())).collect();
            json!({"label": run.label, "columns": columns, "constants": constants})
        };
        self.runs.iter().map(one).collect()
    }
}

/// Column names such as `p [Pa]` into name and unit.
fn split_units(mut table: Table, units: &mut std::collections::BTreeMap<String, String>) -> Table {
    for name in &mut table.names {
        if let Some((own, unit)) = name.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")) {
            let (own, unit) = (own.trim_end().to_string(), unit.to_string());
            units.insert(own.clone(), unit);
            *name = own;
        }
    }
    table
}

/// A sentence on variables whose values are no numbers somewhere; empty if there are none.
fn not_numbers<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() {
        return String::new();
    }
    let more = match names.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let shown = &names[..names.len().min(MOST_NAMED)];
    format!("values that are no finite numbers are left out of the plots: {}{more}", shown.join(", "))
}

impl Model {
    /// The model of a study, and the shots beside it.
    fn of_study(study: &Path, chosen: &Chosen<'_>, listener: &dyn Listener) -> Result<(Self, Beside), Failure> {
        let Some(bench) = chosen.bench else {
            let study = study.display();
            return Err(Failure::Usage(format!("`{study}` is a study: --bench SET.json names its set of shots")));
        };
        let files = StudyFiles {
            study: study.to_path_buf(),
            bench: bench.to_path_buf(),
            libraries: chosen.libraries.clone(),
            threads: NonZeroUsize::new(1),
            host: chosen.host.cloned(),
        };
        let opened = open_study(&files, listener)?;
        let class = chosen.class.unwrap_or(&opened.class);
        if class != opened.class {
            return Err(Failure::Usage(format!(
                "the model of this study and set is `{}`, not `{class}`",
                opened.class
            )));
        }
        let shots = opened.setup.bench.shots.iter();
        let driven: BTreeSet<String> = shots.flat_map(|shot| shot.inputs.keys().cloned()).collect();
        let driven: Vec<String> = driven.into_iter().collect();
        let chosen = Chosen { class: Some(class), ..*chosen };
        // Of a unit of another tool it is the text that declares what the study names of it.
        let model = Self::open(&opened.model_file, opened.model_text.clone(), &chosen, &driven, listener)?;
        let model = Self { is_unit: opened.unit.is_some(), ..model };
        let beside = Beside::of_study(&opened, &model, (chosen.libraries, chosen.host), listener)?;
        Ok((model, beside))
    }

    /// A unit of another tool, by the text that declares what it is given and what it shows.
    fn of_unit(file: &Path, chosen: &Chosen<'_>, listener: &dyn Listener) -> Result<Self, Failure> {
        let model = Self::open(file, unit_model(file, listener)?, chosen, &[], listener)?;
        Ok(Self { is_unit: true, ..model })
    }

    /// `driven`: names of inputs that shots have recorded.
    fn open(
        file: &Path,
        text: String,
        chosen: &Chosen<'_>,
        driven: &[String],
        listener: &dyn Listener,
    ) -> Result<Self, Failure> {
        let name = file.display().to_string();
        let extras = Extras { strict_units: chosen.strict_units, driven, joined: true, ..Extras::default() };
        let set = chosen.set.to_vec();
        let request = Request { class: chosen.class.map(str::to_string), set: set.clone(), goal: Goal::Run };
        let mut sources = chosen.libraries.path(file, &text).map_err(Failure::Fault)?;
        let mut compilation = compile_text(&mut sources, &name, &text, &request, &extras);
        let open_ends: Vec<String> = compilation.forgive_open_ends().iter().map(ToString::to_string).collect();
        compilation.diagnostics.retain(|own| own.code != Code::OpenInput || open_ends.is_empty());
        listener.diagnostics(&compilation.files, &compilation.diagnostics);
        if compilation.has_errors() {
            return Err(Failure::Reported);
        }
        let mut sources = chosen.libraries.path(file, &text).map_err(Failure::Fault)?;
        let class = compilation.model_name.clone();
        let extracted = of_instances(&mut sources, (&name, &text), (class.as_deref(), &set), extract);
        let extracted = extracted.map_err(|(files, diagnostics)| {
            listener.diagnostics(&files, &diagnostics);
            Failure::Reported
        })?;
        let driven = driven.to_vec();
        let flat = compilation.flat.as_deref();
        let start = flat.and_then(|flat| flat.experiment.start).unwrap_or(0.0);
        if let Some(stop) = chosen.stop.filter(|stop| !(*stop > start && stop.is_finite())) {
            return Err(Failure::Usage(format!("--stop {stop}: a run begins at {start} s")));
        }
        let joined = flat.map_or(Ok(None), |flat| Joined::open(flat, chosen.libraries, chosen.host))?;
        Ok(Self {
            file: file.to_path_buf(),
            compilation,
            extracted,
            set,
            stop: chosen.stop,
            open_ends,
            text,
            driven,
            joined,
            is_unit: false,
            libraries: chosen.libraries.clone(),
        })
    }

    /// Values of all parameters where nothing but `set` is changed; none for a model that cannot be run.
    pub(crate) fn parameters(&self) -> Result<Vec<f64>, Failure> {
        let Some(model) = &self.compilation.model else { return Ok(Vec::new()) };
        let mut system = model.instantiate();
        self.bind(&mut system, &self.set).map_err(Failure::Fault)?;
        Ok(system.parameters().to_vec())
    }

    /// How long a run takes in the model (s).
    pub(crate) fn length(&self) -> f64 {
        let said = self.compilation.flat.as_ref().map(|flat| flat.experiment.clone()).unwrap_or_default();
        let start = said.start.unwrap_or(0.0);
        self.stop.or(said.stop).map_or(1.0, |stop| stop - start)
    }

    /// Full names of the states.
    pub(crate) fn states(&self) -> Vec<String> {
        let Some(model) = &self.compilation.model else { return Vec::new() };
        let system = model.instantiate();
        let differential = system.structure().differential.iter().enumerate();
        differential.filter(|(_, state)| **state).map(|(k, _)| system.tables().unknown_name(k)).collect()
    }

    /// Variables that are drawn at first: those of the first figure, those that the model asks for, or its first few.
    pub(crate) fn first_drawn(&self) -> Vec<String> {
        if !self.extracted.plot.is_empty() {
            return self.extracted.plot.clone();
        }
        let Some(model) = &self.compilation.model else { return Vec::new() };
        let shown = Selection::default().shown(model.tables());
        // What does not change makes no curve.
        let changes = shown.into_iter().filter(|own| matches!(own.column.source.place, Place::Output(_)));
        let reals = changes.filter(|own| {
            model.tables().find(&own.column.name).is_none_or(|(variable, _)| variable.kind == ValueKind::Real)
        });
        reals.take(FEW).map(|own| own.column.name).collect()
    }

    /// Runs the model with some parameters changed, under the conditions of a shot if one is given, as they are and with what is off in it; gives its rows and its summary.
    pub(crate) fn run(
        &self,
        changed: &[(String, String)],
        under: Option<(&Shot, &[(String, String)])>,
        stopped: &dyn Fn() -> bool,
    ) -> (Value, Trajectory) {
        let begin = clock::wall_seconds();
        let (shot, conditions) = under.map_or((None, &[][..]), |(shot, conditions)| (Some(shot), conditions));
        let mut set: Vec<(String, String)> = Vec::new();
        for own in conditions.iter().chain(&self.set).chain(changed) {
            set.retain(|(name, _)| *name != own.0);
            set.push(own.clone());
        }
        let arguments = RunArguments {
            start: shot.map(|shot| shot.span.0),
            stop: self.stop.or(shot.map(|shot| shot.span.1)),
            ..RunArguments::default()
        };
        // Starts of states are taken by the translation.
        let starts: Vec<(String, String)> = set.iter().filter(|(name, _)| name.ends_with(START)).cloned().collect();
        let again = match starts.is_empty() {
            true => None,
            false => match self.translated_with(starts) {
                Ok(again) => Some(again),
                Err(words) => return (json!({"status": "refused", "message": words}), Trajectory::new()),
            },
        };
        let compilation = again.as_ref().unwrap_or(&self.compilation);
        if let Err(words) = self.within_limits(&set) {
            return (json!({"status": "refused", "message": words}), Trajectory::new());
        }
        let run = Run {
            units: self.joined.as_ref(),
            compilation,
            set: &set,
            table: shot.and_then(|shot| shot.table.as_ref()),
            arguments: &arguments,
            drawn: false,
            only_shown: false,
            translate_s: 0.0,
            progress: false,
        };
        let whole = || with_whole_loops(compilation, &set);
        let (outcome, rows) = match run.simulate(&whole, &Trajectory::new, stopped) {
            Ok(ran) => ran,
            Err(failure) => return (json!({"status": "refused", "message": words(failure)}), Trajectory::new()),
        };
        let status = match outcome.summary.status {
            Status::Done => "done",
            Status::Terminated => "terminated",
            Status::Interrupted => "interrupted",
            Status::Failed => "failed",
        };
        let message = match &outcome.result {
            Ok(_) => outcome.summary.message.clone().unwrap_or_default(),
            Err(_) if status == "interrupted" => String::new(),
            Err(error) => {
                let diagnostic: Diagnostic =
                    run_diagnostic(error, &compilation.files, compilation.flat.as_deref(), None);
                render(&compilation.files, &[diagnostic], false)
            }
        };
        let header = json!({
            "status": status,
            "message": message,
            "warnings": outcome.summary.warnings,
            "ms": (clock::wall_seconds() - begin) * 1e3,
        });
        (header, rows)
    }

    /// The model with starts of states as a shot has them.
    fn translated_with(&self, set: Vec<(String, String)>) -> Result<Compilation, String> {
        let mut sources = self.libraries.path(&self.file, &self.text)?;
        let request =
            Request { class: self.compilation.model_name.as_deref().map(str::to_string), set, goal: Goal::Run };
        let extras = Extras { driven: &self.driven, joined: true, ..Extras::default() };
        let name = self.file.display().to_string();
        let again = compile_text(&mut sources, &name, &self.text, &request, &extras);
        if again.has_errors() { Err(render(&again.files, &again.diagnostics, false)) } else { Ok(again) }
    }

    /// `Err`: which parameter is outside of its limits.  A run does not ask, for the translation does where `--set` gives values.
    pub(crate) fn within_limits(&self, set: &[(String, String)]) -> Result<(), String> {
        let Some(model) = &self.compilation.model else { return Ok(()) };
        let mut system = model.instantiate();
        let set: Vec<(String, String)> = set.iter().filter(|(name, _)| !name.ends_with(START)).cloned().collect();
        self.bind(&mut system, &set)?;
        parameters::outside(&model.payload().parameters.limits, &system).map_or(Ok(()), Err)
    }

    /// Sets parameters, and finds those that follow from others.
    ///
    /// # Errors
    /// A parameter that cannot be set so.
    fn bind(&self, system: &mut dyn DaeSystem, set: &[(String, String)]) -> Result<(), String> {
        parameters::apply(system, set, &self.compilation.set_at_translation)?;
        let model = self.compilation.model.as_ref();
        let start = model.and_then(|model| model.payload().experiment.start).unwrap_or(0.0);
        // Recorded inputs change no parameter, but without any nothing is bound.
        for input in 0..system.structure().inputs.len() {
            let still = Series::new(vec![start, start + 1.0], vec![0.0, 0.0], Hold::Linear).map(Arc::new);
            if let Ok(still) = still {
                let _ = system.set_input(input, &still);
            }
        }
        // What fails here fails in the run, which says why.
        let _ = system.bind(start);
        Ok(())
    }

    /// What of a run goes to the page.
    pub(crate) fn numbers(&self, header: Value, rows: &Trajectory, wanted: &[usize]) -> Numbers {
        let width = if rows.is_empty() { 0 } else { rows.row(0).len() };
        let column = |k: usize| (k, (0..rows.len()).map(|row| rows.row(row)[k]).collect());
        Numbers {
            header,
            times: rows.times().to_vec(),
            parameters: rows.parameters().to_vec(),
            columns: wanted.iter().filter(|&&k| k < width).map(|&k| column(k)).collect(),
        }
    }
}

/// What a failure says.
fn words(failure: Failure) -> String {
    match failure {
        Failure::Fault(text) | Failure::Usage(text) | Failure::Solver(text) => text,
        Failure::Reported | Failure::SolverReported | Failure::OutputClosed => "the run could not begin".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_carry_units_and_what_is_no_number_is_named() {
        let mut units = std::collections::BTreeMap::new();
        let table = Table { names: vec!["p [Pa]".into(), "a[2]".into()], ..Table::default() };
        assert_eq!(split_units(table, &mut units).names, ["p", "a[2]"]);
        assert_eq!(units.get("p").map(String::as_str), Some("Pa"));
        assert_eq!(not_numbers([].into_iter()), "");
        let many = ["a", "b", "c", "d", "e", "f", "g"];
        assert!(not_numbers(many.into_iter()).ends_with("a, b, c, d, e and 2 more"));
    }
}
