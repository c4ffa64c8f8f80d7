//! The model of shots, translated once more with their channels as variables.

use std::fmt::Write;

use hyd_compiler::{Compilation, Extras, Goal};
use hyd_results::Trajectory;
use hyd_system::Place;

use super::{Channel, START, Shot, Text};
use crate::{Failure, Libraries, Listener, Request, compile_text};

/// The model with the channels as variables, and column and sign, or value, of each of them in a run.
pub(super) struct Translated {
    pub(super) compilation: Compilation,
    found: Vec<Found>,
}

enum Found {
    Column(usize, f64),
    Parameter(usize, f64),
    Constant(f64),
}

/// The model for these shots: one for all, or one for each where they begin at states of their own.  `driven`: inputs that shots have recorded.
///
/// # Errors
/// Channels that the model does not have.
pub(super) fn translated(
    model: Text<'_>,
    (channels, shots): (&[Channel], &[Shot]),
    driven: &[String],
    libraries: &Libraries,
    listener: &dyn Listener,
) -> Result<Vec<Translated>, Failure> {
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
    let mut sets: Vec<Vec<(String, String)>> = shots.iter().map(starts).collect();
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
    sets.into_iter().map(translate).collect()
}

impl Translated {
    /// A channel in a run, at times that ascend.
    pub(super) fn channel(&self, channel: usize, rows: &Trajectory, times: &[f64]) -> Vec<f64> {
        match self.found[channel] {
            Found::Column(column, sign) => at_times(rows, column, times).map(|value| sign * value).collect(),
            Found::Parameter(k, sign) => {
                vec![sign * rows.parameters().get(k).copied().unwrap_or(f64::NAN); times.len()]
            }
            Found::Constant(value) => vec![value; times.len()],
        }
    }

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

/// A column of a run at times that ascend, on straight lines between rows.
fn at_times(rows: &Trajectory, column: usize, times: &[f64]) -> impl Iterator<Item = f64> {
    let mut k = 0;
    times.iter().map(move |&time| {
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
