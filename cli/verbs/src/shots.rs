//! The shots of a bench beside a model whose parameters somebody changes: each is run under its conditions, and what its measuring chains would
//! show stands beside what they have shown.
//!
//! [`Shots::of_report`] reads them from the folder of a report (`hyd discover --report`), for the model that it has written; [`Shots::of_study`]
//! takes those of a study, everything that may be off as expected. A channel is an expression of the model; a second model with all of them as
//! variables is translated for these runs. A deviation is plain, without what a search does about correlation or times: the root of
//! the mean square of measured minus shown over the standard deviation of the noise, over the samples that count.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use hyd_compiler::{Compilation, Extras, Goal, Severity};
use hyd_discovery::is_below;
use hyd_results::{Trajectory, note_read};
use hyd_run::{BackendName, InputArguments, InputTable, RunArguments, Solver, Status, parameter_file, read_text};
use hyd_system::Place;
use serde_json::Value;

use crate::discovered_files::fingerprint;
use crate::study::{Opened, failure};
use crate::{Failure, Libraries, Listener, Request, Run, compile_text, run_diagnostic, with_whole_loops};

/// Rows of a run at least and at most; in between it has a row for each sample.
const ROWS: (usize, usize) = (200, 50_000);

/// Part of a value by which it may differ from the end of a range that it is at: tables have nine digits.
const END: f64 = 1e-7;

/// Shots, and the model with their channels.
pub struct Shots {
    /// Channels that are measured.
    pub channels: Vec<Channel>,
    /// Shots in their order.
    pub all: Vec<Shot>,
    /// One for all shots, or one for each where starts of states differ, which the translation takes.
    translated: Vec<Translated>,
}

/// The model with the channels as variables, and column and sign, or value, of each of them in a run.
struct Translated {
    compilation: Compilation,
    found: Vec<Found>,
}

/// What a name ends with that sets the start of a state: the translation takes it.
pub const START: &str = ".start";

/// A channel.
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Unit of its numbers.
    pub unit: String,
    /// Words for people.
    pub words: String,
    /// Expression of the model.
    pub expression: String,
    /// Standard deviation of its noise.
    pub sigma: f64,
}

/// A shot.
pub struct Shot {
    /// Number given by the lab.
    pub number: usize,
    /// It was not fitted.
    pub held_out: bool,
    /// Its conditions and what was fitted for it alone: parameters with their values as text.
    pub set: Vec<(String, String)>,
    /// Its recorded inputs.
    pub table: Option<InputTable>,
    /// When its run begins and ends (s).
    pub span: (f64, f64),
    /// Times of its samples (s).
    pub times: Vec<f64>,
    /// What was measured, by channel; none where the shot lacks it.
    pub traces: Vec<Option<Trace>>,
}

/// What a channel has shown in a shot, in its unit.
pub struct Trace {
    /// Measured values; NaN where a sample does not count.
    pub measured: Vec<f64>,
    /// The base model as fitted.
    pub base: Option<Vec<f64>>,
    /// The model as it was found.
    pub found: Option<Vec<f64>>,
    chain: Chain,
    /// What is added to it over time.
    added: Vec<f64>,
}

/// A measuring chain: `gain*model(t - late - clock*t) + offset` within limits.
#[derive(Clone, Copy)]
struct Chain {
    gain: f64,
    offset: f64,
    late: f64,
    clock: f64,
    limits: (f64, f64),
}

impl Chain {
    fn clamped(&self, value: f64) -> f64 {
        value.max(self.limits.0).min(self.limits.1)
    }
}

enum Found {
    Column(usize, f64),
    Parameter(usize, f64),
    Constant(f64),
}

/// A shot with changed parameters.
pub struct Answer {
    /// What the channels show, at the times of the shot; none where the shot lacks the channel, or where its run failed.
    pub curves: Vec<Option<Vec<f64>>>,
    /// How far that is from what was measured, in standard deviations of the noise.
    pub deviations: Vec<Option<f64>>,
    /// Why there are none.
    pub message: String,
    /// It was interrupted.
    pub interrupted: bool,
}

/// What the model has at the times of a shot, by channel, and what its run says.
struct Modelled {
    channels: Vec<Vec<f64>>,
    message: String,
}

/// Why there is none.
struct NoRun {
    message: String,
    interrupted: bool,
}

/// The text of a model that shots are for.
#[derive(Clone, Copy)]
pub struct Text<'a> {
    /// Its file.
    pub file: &'a Path,
    /// The text.
    pub text: &'a str,
    /// Full name of the class.
    pub class: &'a str,
}

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
        libraries: &Libraries,
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
        let mut shots = Self::translated(model, (channels, all), &driven, libraries, listener)?;
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

    /// The shots of a study beside its model, with everything that may be off as expected.
    ///
    /// # Errors
    /// Channels or parameters that the model does not have.
    pub fn of_study(opened: &Opened, libraries: &Libraries, listener: &dyn Listener) -> Result<Self, Failure> {
        let setup = &opened.setup;
        let make = || opened.sources();
        let machine = opened.machine(&opened.workshop(&make), listener)?;
        let problem = setup.problem(&machine, &[]).map_err(failure)?;
        let channels = setup.data.channels.iter().map(|own| Channel {
            name: own.name.clone(),
            unit: own.unit.clone(),
            words: own.words.clone(),
            expression: own.expression.clone(),
            sigma: own.noise.sigma * own.scale.abs(),
        });
        let channels: Vec<Channel> = channels.collect();
        let mut driven = BTreeSet::new();
        let mut all = Vec::new();
        for (shot, (data, own)) in setup.data.shots.iter().zip(&setup.bench.shots).enumerate() {
            driven.extend(own.inputs.keys().cloned());
            let traces = data.traces.iter().zip(&setup.data.channels).map(|(trace, info)| {
                let trace = trace.as_ref()?;
                let counted = trace.values.iter().zip(&trace.used);
                let measured = counted.map(|(value, used)| if *used { value * info.scale } else { f64::NAN });
                let (low, high) = (info.limits.0 * info.scale, info.limits.1 * info.scale);
                let limits = (low.min(high), low.max(high));
                let chain = Chain { gain: info.scale, offset: 0.0, late: 0.0, clock: 0.0, limits };
                Some(Trace { measured: measured.collect(), base: None, found: None, chain, added: Vec::new() })
            });
            // What is alike in all shots is as the model says.
            let is_shared = |name: &str| {
                let is_condition = setup.study.conditions.contains_key(name);
                let place = problem.places.iter().position(|place| place.name() == name);
                let is_alike = |k: usize| problem.base.iter().all(|values| values[k] == problem.base[0][k]);
                !is_condition && place.is_some_and(is_alike)
            };
            let text = problem.parameter_file(&vec![0.0; problem.unknowns.len()], shot, &setup.bench.name);
            let mut set = parameter_file::parse(&text).map_err(Failure::Fault)?;
            set.retain(|(name, _)| !is_shared(name));
            all.push(Shot {
                number: data.number,
                held_out: setup.held_out.contains(&shot),
                set,
                table: recorded(own, (data.span.start, data.span.stop))?,
                span: (data.span.start, data.span.stop),
                traces: traces.collect(),
                times: data.times.clone(),
            });
        }
        let model = Text { file: &opened.model_file, text: &opened.model_text, class: &opened.class };
        let driven: Vec<String> = driven.into_iter().collect();
        Self::translated(model, (channels, all), &driven, libraries, listener)
    }

    fn translated(
        model: Text<'_>,
        (channels, all): (Vec<Channel>, Vec<Shot>),
        driven: &[String],
        libraries: &Libraries,
        listener: &dyn Listener,
    ) -> Result<Self, Failure> {
        let name = model.file.display().to_string();
        if let Some(channel) = channels.iter().find(|own| own.expression.contains(';')) {
            return Err(Failure::Fault(format!("`{}` is not an expression of a channel", channel.expression)));
        }
        let expressions: Vec<&str> = channels.iter().map(|own| own.expression.as_str()).collect();
        let known = format!("{}{}", model.text, expressions.join(" "));
        let (class, variable) = (free("WithChannels", &known), free("channel", &known));
        // A text within a package is found by the name of its class.
        let preamble = if model.text.trim_start().starts_with("within") { "" } else { model.text };
        let mut text = format!("{preamble}\nmodel {class}\n  extends {};\n", model.class);
        for (k, channel) in channels.iter().enumerate() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  Real {variable}{k} = ({});", channel.expression);
        }
        let _ = writeln!(text, "end {class};");
        let starts = |shot: &Shot| -> Vec<(String, String)> {
            shot.set.iter().filter(|(name, _)| name.ends_with(START)).cloned().collect()
        };
        let mut sets: Vec<Vec<(String, String)>> = all.iter().map(starts).collect();
        if sets.iter().all(Vec::is_empty) {
            sets.truncate(1);
        }
        let translate = |set: Vec<(String, String)>| {
            let mut sources = libraries.path(model.file, model.text).map_err(Failure::Fault)?;
            let request = Request { class: Some(class.clone()), set, goal: Goal::Run };
            let extras = Extras { driven, ..Extras::default() };
            let compilation = compile_text(&mut sources, &name, &text, &request, &extras);
            Translated::of(compilation, (&name, &variable, channels.len()), listener)
        };
        let translated = sets.into_iter().map(translate).collect::<Result<_, Failure>>()?;
        Ok(Self { channels, all, translated })
    }

    /// Takes what a report shows beyond its chains for what is added to them, so that a run of the model as it stands is the curve of the report.
    fn learn_added(&mut self) {
        for shot in 0..self.all.len() {
            let models = self.models(shot, &[], &|| false).ok();
            for (k, trace) in self.all[shot].traces.iter_mut().enumerate() {
                let Some(trace) = trace else { continue };
                let (Some(models), Some(found)) = (&models, &trace.found) else { continue };
                let chain = trace.chain;
                let added = models.channels[k].iter().zip(found).map(|(model, found)| {
                    let whole = chain.gain * model + chain.offset;
                    let is_at = |end: f64| end.is_finite() && (found - end).abs() <= END * end.abs().max(found.abs());
                    // Of what is at the end of a range nothing more is known.
                    let is_clipped = is_at(chain.limits.0) || is_at(chain.limits.1) || chain.clamped(whole) != whole;
                    if is_clipped || !whole.is_finite() { 0.0 } else { found - whole }
                });
                trace.added = added.collect();
            }
        }
    }

    /// What the model has at the times of a shot, by channel.
    fn models(&self, shot: usize, changed: &[(String, String)], stopped: &dyn Fn() -> bool) -> Result<Modelled, NoRun> {
        let own = &self.all[shot];
        let kept = own.set.iter().filter(|(name, _)| changed.iter().all(|(other, _)| other != name));
        let set: Vec<(String, String)> = kept.chain(changed).cloned().collect();
        let span = own.span.1 - own.span.0;
        let period = match own.times.as_slice() {
            [first, .., last] => (last - first) / (own.times.len() - 1) as f64,
            _ => span,
        };
        let rows = (span / period).round();
        let rows = if rows.is_finite() { (rows as usize).clamp(ROWS.0, ROWS.1) } else { ROWS.0 };
        let arguments = RunArguments {
            start: Some(own.span.0),
            stop: Some(own.span.1),
            tolerance: None,
            intervals: Some(rows),
            every_step: false,
            max_steps: None,
            solver: Solver::Auto,
            inputs: InputArguments::default(),
            result: None,
            variables: None,
            sensitivity: None,
            backend: BackendName::Native,
            profile: false,
            json: true,
        };
        let Translated { compilation, found } = &self.translated[shot.min(self.translated.len() - 1)];
        let run = Run {
            compilation,
            set: &set,
            units: None,
            table: own.table.as_ref(),
            arguments: &arguments,
            drawn: false,
            translate_s: 0.0,
            progress: false,
        };
        let whole = || with_whole_loops(compilation, &set);
        let (outcome, rows) = run.simulate(&whole, &Trajectory::new, stopped).map_err(|failure| match failure {
            Failure::Fault(message) | Failure::Usage(message) | Failure::Solver(message) => {
                NoRun { message, interrupted: false }
            }
            _ => NoRun { message: "the run could not begin".to_string(), interrupted: false },
        })?;
        if let Err(error) = &outcome.result {
            let flat = compilation.flat.as_deref();
            let told = run_diagnostic(error, &compilation.files, flat, None);
            let interrupted = matches!(outcome.summary.status, Status::Interrupted);
            return Err(NoRun { message: told.message, interrupted });
        }
        let parameters = rows.parameters();
        let values = found.iter().zip(&own.traces).map(|(found, trace)| {
            let times = own
                .times
                .iter()
                .map(|&time| trace.as_ref().map_or(time, |own| time - own.chain.late - own.chain.clock * time));
            match *found {
                Found::Column(column, sign) => at_times(&rows, column, times).map(|value| sign * value).collect(),
                Found::Parameter(k, sign) => {
                    vec![sign * parameters.get(k).copied().unwrap_or(f64::NAN); own.times.len()]
                }
                Found::Constant(value) => vec![value; own.times.len()],
            }
        });
        let message = outcome.summary.message.clone().unwrap_or_default();
        Ok(Modelled { channels: values.collect(), message })
    }

    /// A shot with some parameters changed, those that it sets itself among them. `stopped` is asked after every step.
    pub fn run(&self, shot: usize, changed: &[(String, String)], stopped: &dyn Fn() -> bool) -> Answer {
        let own = &self.all[shot];
        let nothing = |message: String, interrupted: bool| Answer {
            curves: own.traces.iter().map(|_| None).collect(),
            deviations: own.traces.iter().map(|_| None).collect(),
            message,
            interrupted,
        };
        let Modelled { channels: models, message } = match self.models(shot, changed, stopped) {
            Ok(found) => found,
            Err(NoRun { message, interrupted }) => return nothing(message, interrupted),
        };
        let curves = own.traces.iter().zip(models).map(|(trace, model)| {
            let trace = trace.as_ref()?;
            let added = trace.added.iter().copied().chain(std::iter::repeat(0.0));
            let shown = model
                .into_iter()
                .zip(added)
                .map(|(model, added)| trace.chain.clamped(trace.chain.gain * model + trace.chain.offset + added));
            Some(shown.collect::<Vec<f64>>())
        });
        let curves: Vec<Option<Vec<f64>>> = curves.collect();
        let deviations = own
            .traces
            .iter()
            .zip(&curves)
            .zip(&self.channels)
            .map(|((trace, curve), channel)| deviation(&trace.as_ref()?.measured, curve.as_ref()?, channel.sigma));
        Answer { deviations: deviations.collect(), curves, message, interrupted: false }
    }
}

impl Translated {
    /// Finds so many channels, called by one word and their number, in the model of a file.
    fn of(
        compilation: Compilation,
        (name, variable, channels): (&str, &str, usize),
        listener: &dyn Listener,
    ) -> Result<Self, Failure> {
        if compilation.has_errors() || compilation.model.is_none() {
            listener.diagnostics(&compilation.files, &compilation.diagnostics);
            return Err(Failure::Fault(format!("the channels of the bench cannot be translated with `{name}`")));
        }
        let found = (0..channels).map(|k| {
            let tables = compilation.model.as_ref()?.tables();
            let (own, element) = tables.find(&format!("{variable}{k}"))?;
            let source = own.sources.get(element)?;
            let sign = if source.negated { -1.0 } else { 1.0 };
            Some(match source.place {
                Place::Output(at) => Found::Column(at as usize, sign),
                Place::Parameter(at) => Found::Parameter(at as usize, sign),
                Place::Constant(value) => Found::Constant(sign * value),
            })
        });
        let found = found.collect::<Option<_>>();
        let found = found.ok_or_else(|| Failure::Fault(format!("`{name}`: a channel of the bench has no values")))?;
        Ok(Self { compilation, found })
    }
}

/// The recorded inputs of a shot of a study.
fn recorded(shot: &hyd_discovery::Shot, span: (f64, f64)) -> Result<Option<InputTable>, Failure> {
    let Some((text, holds)) = shot.input_table(span) else { return Ok(None) };
    let holds: Vec<String> = holds.iter().map(|(name, hold)| format!("{name}={}", hold.name())).collect();
    InputTable::unpack(Path::new(&shot.file), text.as_bytes(), &holds).map(Some)
}

/// Root of the mean square of measured minus shown over the standard deviation of the noise; none where no sample counts.
pub fn deviation(measured: &[f64], shown: &[f64], sigma: f64) -> Option<f64> {
    let counted = measured.iter().zip(shown).filter(|(measured, _)| measured.is_finite());
    let (sum, count) = counted.fold((0.0, 0), |(sum, count), (measured, shown)| {
        let own = (measured - shown) / sigma;
        (sum + own * own, count + 1)
    });
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}

/// A column of a run at times that ascend, on straight lines between rows.
fn at_times(rows: &Trajectory, column: usize, times: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    let mut k = 0;
    times.map(move |time| {
        let known = rows.times();
        if known.is_empty() {
            return f64::NAN;
        }
        // The last row at the time or before it.
        while k + 1 < known.len() && known[k + 1] <= time {
            k += 1;
        }
        let value = rows.row(k)[column];
        if k + 1 == known.len() || time <= known[k] {
            return value;
        }
        let part = (time - known[k]) / (known[k + 1] - known[k]);
        value + part * (rows.row(k + 1)[column] - value)
    })
}

/// A name that stands nowhere in a text.
fn free(name: &str, text: &str) -> String {
    let mut found = name.to_string();
    let mut number = 1;
    while text.contains(&found) {
        number += 1;
        found = format!("{name}_{number}_");
    }
    found
}

/// The curves of one shot.
struct Record {
    number: usize,
    times: Vec<f64>,
    /// Measured, base and found by channel.
    traces: Vec<Option<[Vec<f64>; 3]>>,
}

/// True if a shot has no curves of another channel.
fn is_alone(record: &Record, channel: usize) -> bool {
    record.traces.iter().enumerate().all(|(k, trace)| k == channel || trace.is_none())
}

/// The curves of a report, shot by shot.
///
/// # Errors
/// The number of a line that is not one of them.
fn records(text: &str, channels: &[Channel]) -> Result<Vec<Record>, usize> {
    let mut all: Vec<Record> = Vec::new();
    let mut last = None;
    for (line, row) in text.lines().enumerate().skip(1).map(|(k, row)| (k + 1, row)) {
        // A name of a channel may hold commas: what stands before and behind it does not.
        let (number, rest) = row.split_once(',').ok_or(line)?;
        let number: usize = number.parse().map_err(|_| line)?;
        let mut fields = rest.rsplitn(6, ',');
        let mask = fields.next().ok_or(line)?;
        let mut value = || fields.next().ok_or(line);
        let (found, base, measured, time, name) = (value()?, value()?, value()?, value()?, value()?);
        let parsed = |text: &str| text.parse::<f64>().map_err(|_| line);
        let channel = channels.iter().position(|own| own.name == name).ok_or(line)?;
        let time = parsed(time)?;
        // Shots of one number stand one behind the other.
        let is_back = all.last().is_some_and(|own| own.traces[channel].is_some() && own.times.last() >= Some(&time));
        if last != Some((number, channel)) || is_back && all.last().is_some_and(|own| is_alone(own, channel)) {
            let is_same = all.last().is_some_and(|own| own.number == number && own.traces[channel].is_none());
            if !is_same {
                let traces = channels.iter().map(|_| None).collect();
                all.push(Record { number, times: Vec::new(), traces });
            }
            last = Some((number, channel));
        }
        let Some(own) = all.last_mut() else { continue };
        let is_first = is_alone(own, channel);
        let curves = own.traces[channel].get_or_insert_with(Default::default);
        if is_first {
            own.times.push(time);
        } else if own.times.get(curves[0].len()) != Some(&time) {
            return Err(line);
        }
        let is_counted = mask == "0";
        curves[0].push(if is_counted { parsed(measured)? } else { f64::NAN });
        curves[1].push(parsed(base)?);
        curves[2].push(parsed(found)?);
    }
    let is_whole = |own: &Record| own.traces.iter().flatten().all(|trace| trace[0].len() == own.times.len());
    if all.iter().all(is_whole) { Ok(all) } else { Err(text.lines().count()) }
}
