//! The conditions that a shot can be made under: which of them vary, how far, and where in between one looks.
//!
//! Points are drawn on a lattice of low discrepancy (additive recurrence with the powers of the generalised golden ratio, Roberts 2018), so that
//! few of them lie everywhere and the same call gives the same points.

use std::collections::BTreeMap;

use hyd_compiler::did_you_mean;
use hyd_system::math;

use crate::study::bench_limits::BenchLimits;
use crate::{Fault, Setup};

/// Points of which at least one must be allowed before anything is run.
const LOOKED_AT: usize = 4096;
/// Most conditions that vary at once.
const MOST_AXES: usize = 8;

/// What is asked for.
#[derive(Clone, Debug, Default)]
pub struct Wish {
    /// Conditions that may be set, with their ends; none: those that differ among the shots, between the ends that were seen.
    pub vary: Vec<(String, f64, f64)>,
    /// How many shots.
    pub shots: usize,
    /// Number of the shot that is like the new ones in all that does not vary; none: the longest.
    pub like: Option<usize>,
}

impl Wish {
    /// Reads `NAME=LOW:HIGH`.
    ///
    /// # Errors
    /// A sentence on a text that is not of this form.
    pub fn range(text: &str) -> Result<(String, f64, f64), Fault> {
        let wrong = || Fault::new(format!("--vary {text}: write NAME=LOW:HIGH, such as p0=5e6:20e6"));
        let (name, ends) = text.split_once('=').ok_or_else(wrong)?;
        let (low, high) = ends.split_once(':').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
        Ok((name.trim().to_string(), number(low)?, number(high)?))
    }

    /// Says whether the set has these conditions, before anything is run.
    ///
    /// # Errors
    /// A sentence on what is not there or leaves nothing.
    pub fn check(&self, setup: &Setup) -> Result<(), Fault> {
        let space = Space::new(setup, self)?;
        for place in space.lattice(LOOKED_AT) {
            if space.at(&place)?.is_some() {
                return Ok(());
            }
        }
        let place = setup.study.place(&["limits"]);
        Err(Fault::new(format!("{place}`[limits]` of the study forbid all points of these ranges")))
    }
}

/// A condition that varies.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    /// Its name in the set.
    pub condition: String,
    /// Its ends.
    pub ends: (f64, f64),
    /// First number and distance of those that can be set.
    grid: Option<(f64, f64)>,
}

/// All of them.
pub(crate) struct Space<'a> {
    /// The conditions that vary.
    pub axes: Vec<Axis>,
    /// Position of the shot that new ones are like.
    pub template: usize,
    /// What the bench can do, and where the study says what a shot costs.
    limits: &'a BenchLimits,
    cost_place: String,
    conditions: BTreeMap<String, f64>,
}

/// Conditions of a shot that could be made.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    /// Values of the axes.
    pub values: Vec<f64>,
    /// All conditions.
    pub conditions: BTreeMap<String, f64>,
    /// What the shot costs.
    pub cost: f64,
}

impl<'a> Space<'a> {
    /// # Errors
    /// A sentence on conditions that are not there, ends that leave nothing, too many conditions.
    pub(crate) fn new(setup: &'a Setup, wish: &Wish) -> Result<Self, Fault> {
        let shots = &setup.bench.shots;
        let template = match wish.like {
            Some(number) => shots
                .iter()
                .position(|shot| shot.number == number)
                .ok_or_else(|| Fault::new(format!("--like: the set has no shot {number}")))?,
            None => {
                let length = |k: &usize| shots[*k].times[shots[*k].times.len() - 1] - shots[*k].times[0];
                let longest = (0..shots.len()).rev().max_by(|a, b| length(a).total_cmp(&length(b)));
                longest.ok_or_else(|| Fault::new("the set has no shots"))?
            }
        };
        let limits = &setup.study.limits;
        limits_are_known(setup, template)?;
        let axes = if wish.vary.is_empty() { seen(setup)? } else { asked(setup, &wish.vary)? };
        if axes.len() > MOST_AXES {
            return Err(Fault::new(format!(
                "{} conditions vary, and no more than {MOST_AXES} can be looked at; name the important ones with --vary",
                axes.len()
            )));
        }
        let cost_place = setup.study.place(&["limits", "cost"]);
        Ok(Self { axes, template, limits, cost_place, conditions: shots[template].conditions.clone() })
    }

    /// A point of the unit cube, moved to what can be set; none where the bench must not go.
    ///
    /// # Errors
    /// A cost that cannot be evaluated.
    pub(crate) fn at(&self, cube: &[f64]) -> Result<Option<Point>, Fault> {
        let mut conditions = self.conditions.clone();
        let mut values = Vec::with_capacity(self.axes.len());
        for (axis, &place) in self.axes.iter().zip(cube) {
            let value = axis.value(place);
            conditions.insert(axis.condition.clone(), value);
            values.push(value);
        }
        if !self.limits.allow(&conditions) {
            return Ok(None);
        }
        let cost =
            self.limits.cost_of(&conditions).map_err(|fault| Fault::new(format!("{}{fault}", self.cost_place)))?;
        Ok(Some(Point { values, conditions, cost }))
    }

    /// The unit cube's place of a point.
    pub(crate) fn cube(&self, point: &Point) -> Vec<f64> {
        let place = |(axis, value): (&Axis, &f64)| (value - axis.ends.0) / (axis.ends.1 - axis.ends.0);
        self.axes.iter().zip(&point.values).map(place).collect()
    }

    /// `count` places of the unit cube: its middle, then a lattice.
    pub(crate) fn lattice(&self, count: usize) -> Vec<Vec<f64>> {
        let dimensions = self.axes.len();
        // The root of x^(d+1) = x + 1.
        let mut ratio = 2.0_f64;
        for _ in 0..60 {
            ratio = math::pow(1.0 + ratio, 1.0 / (dimensions as f64 + 1.0));
        }
        let steps: Vec<f64> = (1..=dimensions).map(|k| 1.0 / math::pow(ratio, k as f64)).collect();
        let middle = vec![0.5; dimensions];
        let place = |k: usize| steps.iter().map(|step| (0.5 + step * k as f64).fract()).collect();
        std::iter::once(middle).chain((1..count).map(place)).collect()
    }

    /// Number that channels may show: smallest and largest, in units of the table.
    pub(crate) fn shown(&self, channel: &str) -> (f64, f64) {
        let own = self.limits.channels.get(channel).copied().unwrap_or_default();
        (own.min.unwrap_or(f64::NEG_INFINITY), own.max.unwrap_or(f64::INFINITY))
    }
}

impl Axis {
    /// The number at a place between the ends, as it can be set.
    fn value(&self, place: f64) -> f64 {
        let (low, high) = self.ends;
        let value = low + (high - low) * place.clamp(0.0, 1.0);
        let Some((first, step)) = self.grid else { return value };
        let turn = |count: f64| first + count * step;
        let (least, most) = (((low - first) / step - 1e-9).ceil(), ((high - first) / step + 1e-9).floor());
        turn(((value - first) / step).round().clamp(least, most))
    }
}

/// An axis between two ends, narrowed to what the bench can do.
fn axis(setup: &Setup, condition: &str, (low, high): (f64, f64)) -> Result<Axis, Fault> {
    let own = setup.study.limits.settings.get(condition).copied().unwrap_or_default();
    let ends = (own.min.map_or(low, |min| low.max(min)), own.max.map_or(high, |max| high.min(max)));
    let grid = own.step.map(|step| (own.min.unwrap_or(0.0), step));
    let fits = grid
        .is_none_or(|(first, step)| ((ends.0 - first) / step - 1e-9).ceil() < ((ends.1 - first) / step + 1e-9).floor());
    if ends.0 < ends.1 && fits {
        return Ok(Axis { condition: condition.to_string(), ends, grid });
    }
    let place = setup.study.place(&["limits", "settings", condition]);
    Err(Fault::new(format!("{place}within the limits of the bench `{condition}` cannot vary between {low} and {high}")))
}

/// The conditions that are asked for.
fn asked(setup: &Setup, vary: &[(String, f64, f64)]) -> Result<Vec<Axis>, Fault> {
    let mut axes: Vec<Axis> = Vec::new();
    for (name, low, high) in vary {
        let condition = named(setup, name)?;
        if axes.iter().any(|axis| axis.condition == condition) {
            return Err(Fault::new(format!("--vary {name}: `{condition}` varies already")));
        }
        if !(low < high && low.is_finite() && high.is_finite()) {
            return Err(Fault::new(format!("--vary {name}: {low}:{high} is not a range; write {name}=LOW:HIGH")));
        }
        axes.push(axis(setup, &condition, (*low, *high))?);
    }
    Ok(axes)
}

/// The condition of the set that a name means: its own, its own without the unit behind it, or a parameter that it decides alone.
fn named(setup: &Setup, name: &str) -> Result<String, Fault> {
    let known: Vec<&String> = setup.bench.shots.iter().flat_map(|shot| shot.conditions.keys()).collect();
    let is_known = |name: &str| known.iter().any(|known| *known == name);
    if is_known(name) {
        return Ok(name.to_string());
    }
    if let Some(formula) = setup.study.conditions.get(name).filter(|formula| is_known(formula.trim())) {
        return Ok(formula.trim().to_string());
    }
    let mut with_unit: Vec<&String> =
        known.iter().copied().filter(|own| own.rsplit_once('_').is_some_and(|(stem, _)| stem == name)).collect();
    with_unit.sort_unstable();
    with_unit.dedup();
    if let [only] = with_unit[..] {
        return Ok(only.clone());
    }
    let hint = did_you_mean(name, known.iter().map(|own| own.as_str())).unwrap_or_else(|| {
        let mut all: Vec<&str> = known.iter().map(|own| own.as_str()).filter(|own| *own != "shot").collect();
        all.sort_unstable();
        all.dedup();
        format!("it has: {}", all.join(", "))
    });
    Err(Fault::new(format!("--vary {name}: the shots record no condition `{name}`; {hint}")))
}

/// Refuses limits of conditions that the shots do not record.
fn limits_are_known(setup: &Setup, template: usize) -> Result<(), Fault> {
    let (limits, known) = (&setup.study.limits, &setup.bench.shots[template].conditions);
    let regions = limits.forbidden.iter().enumerate().flat_map(|(k, own)| own.keys().map(move |name| (Some(k), name)));
    for (region, name) in limits.settings.keys().map(|name| (None, name)).chain(regions) {
        if known.contains_key(name) {
            continue;
        }
        let place = match region {
            None => setup.study.place(&["limits", "settings", name]),
            Some(k) => setup.study.place(&["limits", "forbidden", &k.to_string(), name]),
        };
        let hint = did_you_mean(name, known.keys().map(String::as_str));
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        return Err(Fault::new(format!("{place}the shots record no condition `{name}`{hint}")));
    }
    Ok(())
}

/// The conditions of formulas that differ among the shots, between the ends that were seen.
fn seen(setup: &Setup) -> Result<Vec<Axis>, Fault> {
    let mut names: Vec<String> =
        setup.study.conditions.values().flat_map(|own| crate::study::formula::names(own)).collect();
    names.sort_unstable();
    names.dedup();
    let mut axes = Vec::new();
    for name in names {
        let values = setup.bench.shots.iter().filter_map(|shot| shot.conditions.get(&name).copied());
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
        if low < high {
            axes.push(axis(setup, &name, (low, high))?);
        }
    }
    if axes.is_empty() {
        return Err(Fault::new(
            "all shots were made under the same conditions; say with --vary NAME=LOW:HIGH what can be set",
        ));
    }
    Ok(axes)
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn settings_stand_on_the_grid_of_the_bench() {
        let axis = Axis { condition: String::new(), ends: (0.12, 0.98), grid: Some((0.0, 0.25)) };
        let values: Vec<f64> = [0.0, 0.3, 0.5, 0.9, 1.0].iter().map(|&place| axis.value(place)).collect();
        assert_eq!(values, [0.25, 0.5, 0.5, 0.75, 0.75]);
    }
}
