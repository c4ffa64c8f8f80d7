//! Shots of a bench beside the model: what of them goes to the page.

use std::path::Path;

use hyd_compiler::Severity;
use hyd_run::{Failure, clock};
use hyd_verbs::shots::{Answer, Changed, Counts, Shots, Slack, Text, deviation};
use hyd_verbs::study::Opened;
use hyd_verbs::{Host, Libraries, Listener};
use serde_json::{Value, json};

use crate::encode::Numbers;
use crate::session::Model;

/// Samples of a channel that a page draws.
const MOST_DRAWN: usize = 2000;

/// Parameters with their values as text.
type Set<'a> = &'a [(String, String)];

/// Shots, and how the model stands beside them before anything is changed.
pub(crate) struct Beside {
    pub(crate) shots: Shots,
    at_first: Vec<Answer>,
    /// Parameters that say how large what was found is, with the effects that they belong to.
    sizes: Vec<(String, String)>,
}

impl Beside {
    /// The shots of a report beside the model that it has written; none if the report does not describe them.
    ///
    /// # Errors
    /// Files that do not fit.
    pub(crate) fn of_report(
        file: &Path,
        report: &Value,
        model: &Model,
        origin: (&Libraries, Option<&Host>),
        listener: &dyn Listener,
    ) -> Result<Option<Self>, Failure> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let class = model.compilation.model_name.as_deref().unwrap_or_default();
        let text = Text { file: &model.file, text: &model.text, class };
        let Some(shots) = Shots::of_report(folder, report, text, origin, listener)? else {
            let shown = file.display();
            let words = format!(
                "`{shown}` is of an earlier version and does not say how its shots are shown: they are left out; another search writes them"
            );
            listener.sentence(Severity::Warning, &words);
            return Ok(None);
        };
        let mut sizes = Vec::new();
        for effect in report["effects"].as_array().into_iter().flatten() {
            for size in effect["parameters"].as_object().into_iter().flatten().map(|(_, size)| size) {
                let names = size["parameters"].as_array().into_iter().flatten().filter_map(Value::as_str);
                let words = effect["equation"].as_str().unwrap_or_default();
                sizes.extend(names.map(|name| (name.to_string(), words.to_string())));
            }
        }
        Ok(Some(Self::new(shots, sizes, model)))
    }

    /// The shots of a study beside its model.
    ///
    /// # Errors
    /// Channels or parameters that the model does not have.
    pub(crate) fn of_study(
        opened: &Opened,
        model: &Model,
        (libraries, host): (&Libraries, Option<&Host>),
        listener: &dyn Listener,
    ) -> Result<Self, Failure> {
        Ok(Self::new(Shots::of_study(opened, libraries, host, listener)?, Vec::new(), model))
    }

    fn new(shots: Shots, sizes: Vec<(String, String)>, model: &Model) -> Self {
        let first = Changed { set: &model.set, off: &[] };
        let runs = (0..shots.all.len()).map(|shot| shots.run(shot, first, &hyd_run::interrupt::requested));
        Self { at_first: runs.collect(), shots, sizes }
    }

    /// All of it as data.
    pub(crate) fn data(&self) -> Value {
        let channels = self.shots.channels.iter().map(|own| {
            json!({"name": own.name, "unit": own.unit, "words": own.words, "expression": own.expression, "sigma": own.sigma})
        });
        let shots = self.shots.all.iter().zip(&self.at_first).map(|(shot, first)| {
            let stride = stride(shot.times.len());
            let traces = shot.traces.iter().zip(&first.curves).zip(&self.shots.channels).map(|((trace, now), channel)| {
                let trace = trace.as_ref()?;
                let away = |curve: &Option<Vec<f64>>| deviation(&trace.measured, curve.as_ref()?, channel.sigma);
                Some(json!({"measured": thinned(&trace.measured, stride), "base": trace.base.as_deref().map(|own| thinned(own, stride)),
                    "now": now.as_deref().map(|own| thinned(own, stride)), "before": away(&trace.base), "found": away(&trace.found)}))
            });
            let conditions: Vec<(&String, &String)> = shot.set.iter().map(|(name, value)| (name, value)).collect();
            json!({"number": shot.number, "heldout": shot.held_out, "set": conditions, "times": thinned(&shot.times, stride),
                "traces": traces.collect::<Vec<_>>(), "deviations": first.deviations, "message": first.message, "stride": stride})
        });
        let sizes: Vec<Value> = self.sizes.iter().map(|(name, words)| json!({"name": name, "words": words})).collect();
        let slack = self.shots.slack.iter().map(|own| of_slack(own, &self.shots));
        json!({"channels": channels.collect::<Vec<_>>(), "all": shots.collect::<Vec<_>>(), "sizes": sizes,
            "slack": slack.collect::<Vec<_>>()})
    }

    /// The answer to changed parameters: how far each shot is from what was measured, and the curves of one of them.  What belongs to shots alone,
    /// as their conditions, is changed in that one only.
    /// `model`: what is set for all of them; `off`: what is off, and how far.
    pub(crate) fn answer(
        &self,
        (model, changed, off): (Set<'_>, Set<'_>, &[(String, f64)]),
        chosen: usize,
        stopped: &dyn Fn() -> bool,
    ) -> Numbers {
        let begin = clock::wall_seconds();
        let (mut deviations, mut messages) = (Vec::new(), Vec::new());
        let mut numbers = Numbers::default();
        for (k, shot) in self.shots.all.iter().enumerate() {
            let is_own = |name: &String| shot.set.iter().any(|(own, _)| own == name);
            let of_shot = changed.iter().filter(|(name, _)| k == chosen || !is_own(name)).cloned();
            let of_shot: Vec<(String, String)> = of_shot.collect();
            let others = model.iter().filter(|(name, _)| of_shot.iter().all(|(other, _)| other != name)).cloned();
            let set: Vec<(String, String)> = others.chain(of_shot.iter().cloned()).collect();
            let answer = self.shots.run(k, Changed { set: &set, off }, stopped);
            if answer.interrupted || stopped() {
                return Numbers { header: json!({"status": "interrupted", "message": ""}), ..Numbers::default() };
            }
            if k == chosen {
                let every = stride(shot.times.len());
                numbers.times = shot.times.iter().copied().step_by(every).collect();
                let curves =
                    answer.curves.iter().enumerate().filter_map(|(channel, own)| Some((channel, own.as_ref()?)));
                let curves = curves.map(|(channel, own)| (channel, own.iter().copied().step_by(every).collect()));
                numbers.columns = curves.collect();
            }
            deviations.push(answer.deviations);
            messages.push(answer.message);
        }
        numbers.header = json!({"status": "done", "deviations": deviations, "messages": messages,
            "ms": (clock::wall_seconds() - begin) * 1e3});
        numbers
    }
}

/// A number that may be off.  One that a parameter alone says is that parameter, in its unit; any other goes by its name.
fn of_slack(own: &Slack, shots: &Shots) -> Value {
    let channel = match own.counts {
        Counts::Gain(channel) | Counts::Offset(channel) => Some(shots.channels[channel].name.as_str()),
        _ => None,
    };
    let kind = match own.counts {
        Counts::Factor => "factor",
        Counts::Value => "value",
        Counts::Later => "later",
        Counts::Gain(_) => "gain",
        Counts::Offset(_) => "offset",
        Counts::Late => "late",
    };
    let (plain, by) = match own.plain() {
        Some((name, base)) if own.counts == Counts::Factor => (Some(name), base),
        Some((name, _)) => (Some(name), 1.0),
        None => (None, 1.0),
    };
    let ends = |(low, high): (f64, f64)| [(low * by).min(high * by), (low * by).max(high * by)];
    json!({"name": own.name, "kind": kind, "shot": own.shot, "channel": channel, "unit": own.unit, "plain": plain,
        "expected": own.expected * by, "tolerance": own.tolerance * by.abs(), "range": ends(own.range), "limits": ends(own.limits),
        "parameters": own.parameters})
}

/// Every how many-th sample is drawn.
fn stride(samples: usize) -> usize {
    samples.div_ceil(MOST_DRAWN).max(1)
}

/// Every so many-th number; what is none is null.
fn thinned(values: &[f64], stride: usize) -> Vec<Value> {
    let short = |value: &f64| if value.is_finite() { json!(value) } else { Value::Null };
    values.iter().step_by(stride).map(short).collect()
}
