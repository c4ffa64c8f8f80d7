//! What a bench can do: the settings that can be made, what its channels may show, and what a shot costs.
//!
//! `[limits]` of a study.  Regions of settings that must not be entered are lists of conditions that hold at once; a cost is a formula of the
//! conditions, and only its ratios count.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::Fault;
use crate::study::formula::evaluate;

/// `[limits]`.
#[derive(Deserialize, Clone, Default, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct BenchLimits {
    /// What can be set, by condition.
    pub settings: BTreeMap<String, Setting>,
    /// What channels may show, by their column (units of the table).
    pub channels: BTreeMap<String, Shown>,
    /// Regions that must not be entered: by condition, all of which hold at once.
    pub forbidden: Vec<BTreeMap<String, Region>>,
    /// What a shot costs, a formula of the conditions; the same for all where there is none.
    pub cost: Option<String>,
}

/// What a condition can be set to.
#[derive(Deserialize, Clone, Copy, Default, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Setting {
    /// Smallest number.
    pub min: Option<f64>,
    /// Largest number.
    pub max: Option<f64>,
    /// Distance of numbers that can be set, counted from `min`, or from 0.
    pub step: Option<f64>,
}

/// What a channel may show.
#[derive(Deserialize, Clone, Copy, Default, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Shown {
    /// Smallest number.
    pub min: Option<f64>,
    /// Largest number.
    pub max: Option<f64>,
}

/// A side of a number, or a band of numbers.
#[derive(Deserialize, Clone, Copy, Default, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Region {
    /// Above this.
    pub above: Option<f64>,
    /// Below this.
    pub below: Option<f64>,
}

impl Region {
    fn holds(&self, value: f64) -> bool {
        self.above.is_none_or(|above| value > above) && self.below.is_none_or(|below| value < below)
    }
}

impl BenchLimits {
    /// True if these conditions lie within what can be set, and in no forbidden region.
    pub(crate) fn allow(&self, conditions: &BTreeMap<String, f64>) -> bool {
        let can_be_set = self.settings.iter().all(|(name, setting)| {
            conditions.get(name).is_none_or(|&value| {
                setting.min.is_none_or(|min| value >= min) && setting.max.is_none_or(|max| value <= max)
            })
        });
        let is_inside = |region: &BTreeMap<String, Region>| {
            region.iter().all(|(name, side)| conditions.get(name).is_some_and(|&value| side.holds(value)))
        };
        can_be_set && !self.forbidden.iter().any(is_inside)
    }

    /// What a shot costs.
    ///
    /// # Errors
    /// A formula that cannot be evaluated, or that gives no positive number.
    pub(crate) fn cost_of(&self, conditions: &BTreeMap<String, f64>) -> Result<f64, Fault> {
        let Some(formula) = &self.cost else { return Ok(1.0) };
        let cost = evaluate(formula, &|name| conditions.get(name).copied())?;
        if cost > 0.0 { Ok(cost) } else { Err(Fault::new(format!("`{formula}` is {cost}, and a cost is positive"))) }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::BenchLimits;

    /// What a bench can do changes no search, so that a calibration and fits that were kept hold on.
    #[test]
    fn limits_are_not_part_of_a_search() {
        let text = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"x\" }\n";
        let study = |text: &str| crate::Study::parse(text).unwrap_or_else(|fault| panic!("{fault}"));
        let (without, with) = (study(text), study(&format!("{text}[limits.settings.p]\nmax = 2.0\n")));
        assert_ne!(format!("{without:?}"), format!("{with:?}"));
        assert_eq!(format!("{:?}", without.of_search()), format!("{:?}", with.of_search()));
    }

    /// Regions are forbidden where all that they say holds; outside of what can be set nothing is allowed.
    #[test]
    fn a_region_is_left_by_any_of_its_sides() {
        let text = "cost = \"1 + p/1e7\"\n[settings.p]\nmin = 1e6\nmax = 2e7\n[[forbidden]]\np = { above = 1e7 }\nU = { above = 30, below = 40 }\n";
        let limits: BenchLimits = toml::from_str(text).unwrap_or_else(|error| panic!("{error}"));
        let at = |p: f64, u: f64| BTreeMap::from([("p".to_string(), p), ("U".to_string(), u)]);
        assert!(limits.allow(&at(5e6, 35.0)) && limits.allow(&at(1.5e7, 25.0)) && limits.allow(&at(1.5e7, 45.0)));
        assert!(!limits.allow(&at(1.5e7, 35.0)) && !limits.allow(&at(2.1e7, 25.0)) && !limits.allow(&at(1e5, 25.0)));
        assert_eq!(limits.cost_of(&at(1e7, 0.0)).ok(), Some(2.0));
        assert!(limits.cost_of(&at(-2e7, 0.0)).is_err());
    }
}
