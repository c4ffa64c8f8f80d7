//! Recorded inputs of shots: columns of their tables that drive inputs of the model.
//!
//! A column is read in the units of the model, `(column - offset)/scale`, and acts `lag` later than it was recorded.  Runs that begin
//! before the first sample, or that a lag lets look beyond an end, find the value at that end.

use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_compiler::did_you_mean;
use hyd_system::{DaeSystem, Gap, Hold, InputSite, Series, SeriesError, fill_gaps};

use crate::bench::Shot;
use crate::study::{Input, Study};
use crate::{Fault, magnitude::is_plausible, magnitude::shown};

/// Rows of a table for a recorded input: times (s), values in units of the table, and lines.
pub(crate) struct Rows<'a> {
    /// Times (s).
    pub times: &'a [f64],
    /// Values, NaN where there is none.
    pub values: &'a [f64],
    /// Lines of the table.
    pub lines: &'a [u64],
}

/// The samples of an input, and what the user should know of them.
///
/// # Errors
/// A sentence on samples that are missing or make no sense, without the table's name.
pub(crate) fn series(name: &str, input: &Input, rows: &Rows<'_>) -> Result<(Arc<Series>, Option<String>), String> {
    let column = &input.column;
    let Rows { times, values, lines } = rows;
    let at = |k: usize| format!("line {}, column `{column}` of the input `{name}`", lines[k]);
    let mut values = values.to_vec();
    if values.iter().all(|value| value.is_nan()) {
        return Err(format!("the column `{column}` of the input `{name}` is empty"));
    }
    let filled = fill_gaps(times, &mut values, input.hold).map_err(|gap| match gap {
        Gap::First => format!("{}: the first sample is missing", at(0)),
        Gap::Last => format!("{}: the last sample is missing", at(lines.len() - 1)),
        Gap::Wide(k, count) => {
            format!("{}: {count} samples in a row are missing; single ones are filled from the neighbours", at(k))
        }
    })?;
    for (k, value) in values.iter_mut().enumerate() {
        *value = (*value - input.offset) / input.scale;
        if !is_plausible(*value) {
            return Err(format!("{}: it becomes {}, larger than any variable", at(k), shown(*value)));
        }
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    if input.lag.abs() > last - first {
        return Err(format!("the input `{name}` lags by {} s, longer than the record", input.lag));
    }
    let times: Vec<f64> = times.iter().map(|time| time + input.lag).collect();
    let made = Series::new(times, values, input.hold).map_err(|error| match error {
        SeriesError::Order(k) | SeriesError::NotFinite(k) => format!("{}: the lag leaves no distance of times", at(k)),
        _ => format!("the column `{column}` of the input `{name}` is not a series of samples"),
    })?;
    let warning = filled.first().map(|&k| {
        let what = if filled.len() == 1 { "a sample is".into() } else { format!("{} samples are", filled.len()) };
        format!("{}: {what} missing and filled from the neighbours", at(k))
    });
    Ok((Arc::new(made), warning))
}

/// Recorded inputs of all shots, ready for the systems of a model.
#[derive(Clone, Default)]
pub(crate) struct ShotInputs {
    /// Per shot the series of each recorded input of the model.
    shots: Vec<Vec<Arc<Series>>>,
}

impl ShotInputs {
    /// The inputs of a translated model in every shot; `sites`: those of the system that somebody must give values.
    ///
    /// # Errors
    /// A sentence with the line of the study: no such input, elements without a column, a derivative that a held value has not.
    pub(crate) fn new(
        study: &Study,
        shots: &[Shot],
        (sites, system): (&[InputSite], &dyn DaeSystem),
        known: &[String],
    ) -> Result<Self, Fault> {
        for (name, input) in &study.inputs {
            let place = study.place(&["inputs", name]);
            let Some(site) = sites.iter().find(|site| *site.name == **name) else {
                let hint = not_an_input(name, system, known);
                return Err(Fault::new(format!(
                    "{place}the model has no input `{name}` of type Real at its top{hint}"
                )));
            };
            if site.differentiated && input.hold == Hold::Zero {
                return Err(Fault::new(format!(
                    "{place}the equations need the derivative of the input `{name}`, and a value that is held (zero) has none; \
                     hold it \"linear\" or \"smooth\""
                )));
            }
        }
        if let Some(site) = sites.iter().find(|site| !study.inputs.contains_key(&*site.name)) {
            let bare = site.name.split('[').next().unwrap_or_default();
            let other = study.inputs.keys().find(|name| name.split('[').next() == Some(bare));
            let place = other.map_or_else(String::new, |other| study.place(&["inputs", other]));
            return Err(Fault::new(format!(
                "{place}the input `{bare}` is recorded in part: `{}` has no column",
                site.name
            )));
        }
        let of = |shot: &Shot| -> Result<Vec<Arc<Series>>, Fault> {
            let own = sites.iter().map(|site| shot.inputs.get(&*site.name).cloned());
            own.collect::<Option<_>>().ok_or_else(|| Fault::new(format!("shot {} lacks an input", shot.number)))
        };
        Ok(Self { shots: shots.iter().map(of).collect::<Result<_, _>>()? })
    }

    /// Lets a system follow the inputs of a shot.
    pub(crate) fn hand_over(&self, system: &mut dyn DaeSystem, shot: usize) -> Result<(), Fault> {
        for (k, series) in self.shots.get(shot).into_iter().flatten().enumerate() {
            let refused = |_| Fault::new(format!("input {} of the model cannot follow its record", k + 1));
            system.set_input(k, series).map_err(refused)?;
        }
        Ok(())
    }
}

/// How a name that is not one of the inputs `known` comes to follow a column, or which input was perhaps meant.
fn not_an_input(name: &str, system: &dyn DaeSystem, known: &[String]) -> String {
    match (system.tables().find(name), did_you_mean(name, known.iter().map(String::as_str))) {
        (Some(_), _) if name.contains('.') => {
            format!("; to let `{name}` follow a column, connect it to an input that the model itself declares")
        }
        (Some(_), _) => {
            format!("; declared as `input Real {name}`, without an equation for it, it can follow a column")
        }
        (None, Some(hint)) => format!("; {hint}"),
        (None, None) if known.is_empty() => String::new(),
        (None, None) => format!("; it has: {}", known.join(", ")),
    }
}

/// Inputs of a model that neither follow a column nor are set by the study, with what they are instead.
pub(crate) fn idle(study: &Study, inputs: &[String]) -> Vec<String> {
    let bare = |name: &str| name.split('[').next().unwrap_or_default().to_string();
    let is_set = |name: &&String| {
        let set = study.nuisances.values().any(|own| bare(own.parameter()) == bare(name));
        set || study.inputs.keys().chain(study.conditions.keys()).any(|own| bare(own) == bare(name))
    };
    let said = |name: &String| {
        format!(
            "`{name}` is an input of the model without a column in `[inputs]` of the study: it keeps its start value in all shots"
        )
    };
    inputs.iter().filter(|name| !is_set(name)).map(said).collect()
}

/// Sentences on runs that begin before their inputs do: `starts` (s) by shot.
pub(crate) fn early_starts(study: &Study, shots: &[Shot], starts: &[f64]) -> Vec<String> {
    let mut said = BTreeMap::new();
    for (shot, &start) in shots.iter().zip(starts).filter(|_| !study.inputs.is_empty()) {
        let (first, next) = (shot.times[0], shot.times[1]);
        if first - start > 1.5 * (next - first) {
            said.entry(shot.number).or_insert_with(|| {
                let (number, early) = (shot.number, first - start);
                format!("shot {number}: the run begins {early} s before the first sample, and inputs keep their first value until then")
            });
        }
    }
    said.into_values().collect()
}
