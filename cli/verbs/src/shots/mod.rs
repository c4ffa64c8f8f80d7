//! The shots of a bench beside a model whose parameters somebody changes: each is run under its conditions, and what its measuring chains would
//! show stands beside what they have shown.
//!
//! [`Shots::of_report`] reads them from the folder of a report (`hyd discover --report`), for the model that it has written; [`Shots::of_study`]
//! takes those of a study, with what may be off ([`Slack`]) as expected or moved by whoever looks. A channel is an expression of the model; a second model with all of them as
//! variables is translated for these runs. A deviation is plain, without what a search does about correlation or times: the root of
//! the mean square of measured minus shown over the standard deviation of the noise, over the samples that count.

mod chain;
mod curves;
mod of_report;
mod of_study;
mod slack;
mod translated;

use std::path::Path;

use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_results::Trajectory;
use hyd_run::{InputTable, RunArguments, Status};

use chain::Chain;
use translated::{Translated, Translator};

use crate::{Failure, Joined, Listener, Run, run_diagnostic, with_whole_loops};

pub use of_report::{WRITTEN_MODEL, driven_by, is_written_model, written_class};
pub use slack::{Counts, Slack};

/// What a name ends with that sets the start of a state: the translation takes it.
pub const START: &str = ".start";

/// Rows of a run at least and at most; in between it has a row for each sample.
const ROWS: (usize, usize) = (200, 50_000);

/// Shots, and the model with their channels.
pub struct Shots {
    /// Channels that are measured.
    pub channels: Vec<Channel>,
    /// Shots in their order.
    pub all: Vec<Shot>,
    /// What may be off, where a study says so.
    pub slack: Vec<Slack>,
    /// One for all shots, or one for each where starts of states differ, which the translation takes.
    translated: Vec<Translated>,
    /// Makes one more, where a start is moved.
    translator: Translator,
    /// Units of other tools that are blocks of the model.
    joined: Option<Joined>,
    /// Relative tolerance of runs; none: as the model says.
    tolerance: Option<f64>,
}

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

/// What is changed.
#[derive(Clone, Copy, Default)]
pub struct Changed<'a> {
    /// Parameters, with their values as text, those that shots set themselves among them.
    pub set: &'a [(String, String)],
    /// What may be off, by name.
    pub off: &'a [(String, f64)],
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

impl Shots {
    /// Why these numbers cannot be off so far.
    ///
    /// # Errors
    /// A sentence.
    pub fn refuse(&self, off: &[(String, f64)]) -> Result<(), String> {
        slack::refused(&self.slack, off)
    }

    /// What a shot sets where these numbers are off.
    pub fn conditions(&self, shot: usize, off: &[(String, f64)]) -> Vec<(String, String)> {
        let mut set = self.all[shot].set.clone();
        for (name, value) in slack::moved(&self.slack, off, shot) {
            let value = format!("{value:?}");
            match set.iter_mut().find(|(known, _)| *known == name) {
                Some(known) => known.1 = value,
                None => set.push((name, value)),
            }
        }
        set
    }

    /// What the model has at the times of a shot, by channel.
    fn models(&self, shot: usize, changed: Changed<'_>, stopped: &dyn Fn() -> bool) -> Result<Modelled, NoRun> {
        let own = &self.all[shot];
        let conditions = self.conditions(shot, changed.off);
        let kept = conditions.iter().filter(|(name, _)| changed.set.iter().all(|(other, _)| other != name));
        let set: Vec<(String, String)> = kept.chain(changed.set).cloned().collect();
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
            tolerance: self.tolerance,
            intervals: Some(rows),
            ..RunArguments::default()
        };
        let starts = starts_of(&set);
        let again = (starts != starts_of(&own.set)).then(|| self.translator.translate(starts, &Silent)).transpose();
        let again = again.map_err(not_begun)?;
        let translated = again.as_ref().unwrap_or(&self.translated[shot.min(self.translated.len() - 1)]);
        let compilation = &translated.compilation;
        let run = Run {
            compilation,
            set: &set,
            units: self.joined.as_ref(),
            table: own.table.as_ref(),
            arguments: &arguments,
            drawn: false,
            only_shown: false,
            translate_s: 0.0,
            progress: false,
        };
        let whole = || with_whole_loops(compilation, &set);
        let (outcome, rows) = run.simulate(&whole, &Trajectory::new, stopped).map_err(not_begun)?;
        if let Err(error) = &outcome.result {
            let flat = compilation.flat.as_deref();
            let told = run_diagnostic(error, &compilation.files, flat, None);
            let interrupted = matches!(outcome.summary.status, Status::Interrupted);
            return Err(NoRun { message: told.message, interrupted });
        }
        let values = own.traces.iter().enumerate().map(|(channel, trace)| {
            let chain = trace.as_ref().map(|own| slack::chain(&self.slack, changed.off, (shot, channel), own.chain));
            let time = |&time: &f64| chain.map_or(time, |chain| chain.machine_time(time));
            translated.channel(channel, &rows, &own.times.iter().map(time).collect::<Vec<_>>())
        });
        let message = outcome.summary.message.clone().unwrap_or_default();
        Ok(Modelled { channels: values.collect(), message })
    }

    /// A shot with some numbers changed. `stopped` is asked after every step.
    pub fn run(&self, shot: usize, changed: Changed<'_>, stopped: &dyn Fn() -> bool) -> Answer {
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
        let curves = own.traces.iter().zip(models).enumerate().map(|(channel, (trace, model))| {
            let trace = trace.as_ref()?;
            let chain = slack::chain(&self.slack, changed.off, (shot, channel), trace.chain);
            let added = trace.added.iter().copied().chain(std::iter::repeat(0.0));
            let shown = model.into_iter().zip(added).map(|(model, added)| chain.shown(model, added));
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

/// Starts of states among parameters, in the order of their names.
fn starts_of(set: &[(String, String)]) -> Vec<(String, String)> {
    let mut starts: Vec<(String, String)> = set.iter().filter(|(name, _)| name.ends_with(START)).cloned().collect();
    starts.sort();
    starts
}

fn not_begun(failure: Failure) -> NoRun {
    match failure {
        Failure::Fault(message) | Failure::Usage(message) | Failure::Solver(message) => {
            NoRun { message, interrupted: false }
        }
        _ => NoRun { message: "the run could not begin".to_string(), interrupted: false },
    }
}

/// Hears nothing: what a translation with other starts has to say was said before.
struct Silent;

impl Listener for Silent {
    fn sentence(&self, _severity: Severity, _text: &str) {}

    fn diagnostics(&self, _files: &Files, _diagnostics: &[Diagnostic]) {}
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
