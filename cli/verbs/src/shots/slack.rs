//! What may be off in the shots of a study, as numbers that somebody moves: parameters within their tolerances, beginnings of states, the trigger,
//! and offsets and gains of the measuring chains.

use hyd_discovery::{Machine, Meaning, Problem, Unknown};
use hyd_system::significant;

use super::chain::Chain;
use super::{Channel, START};

/// How far one is moved, in standard deviations: of what is as the study says, 99.7 % lies within.
const REACH: f64 = 3.0;

/// How a number counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Counts {
    /// Parameters are multiplied by the value.
    Factor,
    /// Parameters get the value.
    Value,
    /// Parameters that are times become later (s).
    Later,
    /// A channel is multiplied.
    Gain(usize),
    /// Something is added to a channel (its unit).
    Offset(usize),
    /// The record is late (s).
    Late,
}

/// A number that may be off.
#[derive(Clone, Debug)]
pub struct Slack {
    /// Its name.
    pub name: String,
    /// How it counts.
    pub counts: Counts,
    /// The shot that it is of; none for all.
    pub shot: Option<usize>,
    /// Unit of the parameters, or of the channel.
    pub unit: String,
    /// What it is expected to be.
    pub expected: f64,
    /// Standard deviation.
    pub tolerance: f64,
    /// From where to where it is moved.
    pub range: (f64, f64),
    /// What it may be: no more than the limits of its parameters allow.
    pub limits: (f64, f64),
    /// Parameters that it moves, with the values that they have in each shot by themselves.
    pub parameters: Vec<(String, Vec<f64>)>,
}

impl Slack {
    /// All of a study.
    pub(super) fn all(problem: &Problem<'_>, machine: &Machine, channels: &[Channel], scales: &[f64]) -> Vec<Self> {
        problem.unknowns.iter().filter_map(|own| Self::of(own, problem, machine, (channels, scales))).collect()
    }

    /// None for what makes no difference, and for what only a search takes up (what chains add, lags, clocks).
    fn of(
        unknown: &Unknown,
        problem: &Problem<'_>,
        machine: &Machine,
        (channels, scales): (&[Channel], &[f64]),
    ) -> Option<Self> {
        let places = unknown.places();
        let of_parameter = || places.first().map(|&k| machine.unit(&problem.places[k]).to_string()).unwrap_or_default();
        let (counts, unit, scale) = match unknown.meaning {
            Meaning::Relative { .. } => (Counts::Factor, of_parameter(), 1.0),
            Meaning::Value { .. } => (Counts::Value, of_parameter(), 1.0),
            Meaning::Late { .. } if places.is_empty() => (Counts::Late, "s".to_string(), 1.0),
            Meaning::Late { .. } => (Counts::Later, "s".to_string(), 1.0),
            Meaning::Gain { channel, .. } => (Counts::Gain(channel), String::new(), 1.0),
            Meaning::Offset { channel, .. } => {
                (Counts::Offset(channel), channels[channel].unit.clone(), scales[channel])
            }
            _ => return None,
        };
        let value = |xi: f64| unknown.value(unknown.within(xi)) * scale;
        let between = |far: f64| (value(-far).min(value(far)), value(-far).max(value(far)));
        let parameters: Vec<(String, Vec<f64>)> = places
            .iter()
            .map(|&k| (problem.set_as(k), problem.base.iter().map(|values| values[k]).collect()))
            .collect();
        let is_nothing = |values: &[f64]| values.iter().all(|value| *value == 0.0);
        if counts == Counts::Factor && parameters.iter().all(|(_, values)| is_nothing(values)) {
            return None;
        }
        Some(Self {
            name: unknown.name.clone(),
            counts,
            shot: unknown.shot,
            unit,
            expected: value(0.0),
            tolerance: ((unknown.value(1.0) - unknown.value(0.0)) * scale).abs(),
            range: between(REACH),
            limits: between(Unknown::LIMIT),
            parameters,
        })
    }

    /// The parameter and its value, where it is one number that is alike in all shots, so that setting the parameter is all there is to it.
    pub fn plain(&self) -> Option<(&str, f64)> {
        let [(name, values)] = &self.parameters[..] else { return None };
        let is_plain = self.shot.is_none()
            && matches!(self.counts, Counts::Factor | Counts::Value)
            && !name.ends_with(START)
            && values.iter().all(|value| *value == values[0]);
        is_plain.then_some((name.as_str(), values[0]))
    }

    fn touches(&self, shot: usize) -> bool {
        self.shot.is_none_or(|own| own == shot)
    }
}

/// Why these numbers cannot be.
pub(super) fn refused(all: &[Slack], off: &[(String, f64)]) -> Result<(), String> {
    for (name, value) in off {
        let Some(own) = all.iter().find(|own| own.name == *name) else {
            return Err(format!("the study has no number `{name}` that may be off"));
        };
        let (low, high) = own.limits;
        if !(low..=high).contains(value) {
            let [value, low, high] = [*value, low, high].map(significant);
            return Err(format!("`{name}` cannot be {value}: it lies between {low} and {high}"));
        }
    }
    Ok(())
}

/// The parameters of a shot that these numbers move, with their values.
pub(super) fn moved(all: &[Slack], off: &[(String, f64)], shot: usize) -> Vec<(String, f64)> {
    let mut values: Vec<(String, f64)> = Vec::new();
    for own in all.iter().filter(|own| own.touches(shot)) {
        let Some((_, number)) = off.iter().find(|(name, _)| *name == own.name) else { continue };
        for (name, base) in &own.parameters {
            let at = values.iter().position(|(known, _)| known == name).unwrap_or_else(|| {
                values.push((name.clone(), base[shot]));
                values.len() - 1
            });
            match own.counts {
                Counts::Factor => values[at].1 *= number,
                Counts::Value => values[at].1 = *number,
                Counts::Later => values[at].1 += number,
                Counts::Gain(_) | Counts::Offset(_) | Counts::Late => {}
            }
        }
    }
    values
}

/// The measuring chain of a channel in a shot, as these numbers make it.
pub(super) fn chain(all: &[Slack], off: &[(String, f64)], (shot, channel): (usize, usize), mut chain: Chain) -> Chain {
    for own in all.iter().filter(|own| own.touches(shot)) {
        let Some((_, number)) = off.iter().find(|(name, _)| *name == own.name) else { continue };
        match own.counts {
            Counts::Gain(of) if of == channel => chain.gain *= number,
            Counts::Offset(of) if of == channel => chain.offset += number,
            Counts::Late => chain.late += number,
            _ => {}
        }
    }
    chain
}

#[cfg(test)]
mod tests {
    use super::{Chain, Counts, Slack, chain, moved, refused};

    fn slack(name: &str, counts: Counts, shot: Option<usize>, parameters: &[(&str, [f64; 2])]) -> Slack {
        let parameters = parameters.iter().map(|(name, values)| (name.to_string(), values.to_vec())).collect();
        let (unit, ends) = (String::new(), (-5.0, 5.0));
        let (expected, tolerance) = (1.0, 0.1);
        Slack { name: name.into(), counts, shot, unit, expected, tolerance, range: ends, limits: ends, parameters }
    }

    #[test]
    fn numbers_move_the_parameters_of_their_shots() {
        let all = [
            slack("p", Counts::Factor, None, &[("p0", [2.0, 3.0])]),
            slack("k", Counts::Factor, None, &[("k", [4.0, 4.0])]),
            slack("trigger (shot 2)", Counts::Later, Some(1), &[("on", [0.0, 0.0]), ("off", [1.0, 2.0])]),
            slack("h (shot 1)", Counts::Value, Some(0), &[("h.start", [0.5, 0.7])]),
        ];
        let plain: Vec<Option<(&str, f64)>> = all.iter().map(Slack::plain).collect();
        assert_eq!(plain, [None, Some(("k", 4.0)), None, None], "setting it is the same in all shots");
        let off = |name: &str, value: f64| (name.to_string(), value);
        let off = [off("p", 1.5), off("trigger (shot 2)", 0.25), off("h (shot 1)", 0.6)];
        let own = |shot: usize| moved(&all, &off, shot);
        assert_eq!(own(0), [("p0".to_string(), 3.0), ("h.start".to_string(), 0.6)]);
        assert_eq!(own(1), [("p0".to_string(), 4.5), ("on".to_string(), 0.25), ("off".to_string(), 2.25)]);
        assert!(refused(&all, &off).is_ok());
        assert!(refused(&all, &[("p".into(), 7.0)]).is_err_and(|why| why.contains("between -5 and 5")));
        assert!(refused(&all, &[("q".into(), 1.0)]).is_err_and(|why| why.contains("no number `q`")));
        assert!(refused(&all, &[("p".into(), f64::NAN)]).is_err());
    }

    #[test]
    fn numbers_change_the_chain_of_their_channel() {
        let all = [
            slack("gain of a", Counts::Gain(0), None, &[]),
            slack("offset of b", Counts::Offset(1), None, &[]),
            slack("trigger (shot 1)", Counts::Late, Some(0), &[]),
        ];
        let off: Vec<(String, f64)> =
            all.iter().zip([1.5, 0.25, 0.125]).map(|(own, value)| (own.name.clone(), value)).collect();
        let open = (f64::NEG_INFINITY, f64::INFINITY);
        let plain = Chain { gain: 1e3, offset: 0.0, late: 0.0, clock: 0.0, limits: open };
        let of = |shot: usize, channel: usize| {
            let own = chain(&all, &off, (shot, channel), plain);
            (own.gain, own.offset, own.late)
        };
        assert_eq!((of(0, 0), of(1, 1)), ((1500.0, 0.0, 0.125), (1e3, 0.25, 0.0)));
    }
}
