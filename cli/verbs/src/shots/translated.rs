//! The model of shots, translated once more with their channels as variables.

use std::fmt::Write;
use std::path::PathBuf;

use hyd_compiler::{Compilation, Extras, Goal};
use hyd_results::Trajectory;
use hyd_system::Place;

use super::{Channel, Shot, Text, starts_of};
use crate::{Failure, Host, Joined, Libraries, Listener, Request, compile_text};

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

/// Where classes, units and inputs of a model come from.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    /// Inputs that shots have recorded.
    pub(super) driven: &'a [String],
    pub(super) libraries: &'a Libraries,
    /// How processes of units of other tools are begun.
    pub(super) host: Option<&'a Host>,
}

/// The model with its channels as text, to be translated for starts of states.
pub(super) struct Translator {
    file: PathBuf,
    /// The text of the model, and the one with its channels.
    texts: (String, String),
    /// Name of the class with the channels, word of their variables, how many there are.
    channels: (String, String, usize),
    driven: Vec<String>,
    libraries: Libraries,
}

/// The model for these shots: one for all, or one for each where they begin at states of their own; what translates it for other starts; its units.
///
/// # Errors
/// Channels that the model does not have, units that cannot be used.
pub(super) fn translated(
    model: Text<'_>,
    (channels, shots): (&[Channel], &[Shot]),
    around: Around<'_>,
    listener: &dyn Listener,
) -> Result<(Vec<Translated>, Translator, Option<Joined>), Failure> {
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
    let translator = Translator {
        file: model.file.to_path_buf(),
        texts: (model.text.to_string(), text),
        channels: (class, variable, channels.len()),
        driven: around.driven.to_vec(),
        libraries: around.libraries.clone(),
    };
    let mut sets: Vec<Vec<(String, String)>> = shots.iter().map(|shot| starts_of(&shot.set)).collect();
    if sets.iter().all(Vec::is_empty) {
        sets.truncate(1);
    }
    let all: Vec<Translated> =
        sets.into_iter().map(|set| translator.translate(set, listener)).collect::<Result<_, _>>()?;
    let flat = all.first().and_then(|own| own.compilation.flat.as_deref());
    let joined = flat.map_or(Ok(None), |flat| Joined::open(flat, around.libraries, around.host))?;
    Ok((all, translator, joined))
}

impl Translator {
    /// The model that begins at these states.
    ///
    /// # Errors
    /// Channels that the model does not have.
    pub(super) fn translate(&self, set: Vec<(String, String)>, listener: &dyn Listener) -> Result<Translated, Failure> {
        let (class, variable, count) = &self.channels;
        let name = self.file.display().to_string();
        let mut sources = self.libraries.path(&self.file, &self.texts.0).map_err(Failure::Fault)?;
        let request = Request { class: Some(class.clone()), set, goal: Goal::Run };
        let extras = Extras { driven: &self.driven, joined: true, ..Extras::default() };
        let compilation = compile_text(&mut sources, &name, &self.texts.1, &request, &extras);
        Translated::of(compilation, (&name, variable, *count), listener)
    }
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
