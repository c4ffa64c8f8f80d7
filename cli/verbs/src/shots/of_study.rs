//! The shots of a study, under the conditions that were noted.

use std::collections::BTreeSet;
use std::path::Path;

use hyd_run::{InputTable, parameter_file};

use super::chain::Chain;
use super::slack::Slack;
use super::translated::{Around, translated};
use super::{Channel, Shot, Shots, Text, Trace};
use crate::study::{Opened, failure};
use crate::{Failure, Host, Libraries, Listener};

impl Shots {
    /// The shots of a study beside its model, with everything that may be off as expected.
    ///
    /// # Errors
    /// Channels or parameters that the model does not have.
    pub fn of_study(
        opened: &Opened,
        libraries: &Libraries,
        host: Option<&Host>,
        listener: &dyn Listener,
    ) -> Result<Self, Failure> {
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
        let around = Around { driven: &driven, libraries, host };
        let (translated, translator, joined) = translated(model, (&channels, &all), around, listener)?;
        let scales: Vec<f64> = setup.data.channels.iter().map(|own| own.scale).collect();
        let slack = Slack::all(&problem, &machine, &channels, &scales);
        let tolerance = Some(setup.study.run.tolerance);
        Ok(Self { channels, all, slack, translated, translator, joined, tolerance })
    }
}

/// The recorded inputs of a shot of a study.
fn recorded(shot: &hyd_discovery::Shot, span: (f64, f64)) -> Result<Option<InputTable>, Failure> {
    let Some((text, holds)) = shot.input_table(span) else { return Ok(None) };
    let holds: Vec<String> = holds.iter().map(|(name, hold)| format!("{name}={}", hold.name())).collect();
    InputTable::unpack(Path::new(&shot.file), text.as_bytes(), &holds).map(Some)
}
