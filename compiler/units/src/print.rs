//! Units as text: as the user wrote them, by their special name, or as a product of base units.
//!
//! What `to_text` gives reads back as the same unit where the factor is 1; other factors are put in front as a number, for
//! which the grammar of units has no notation.

use rustc_hash::FxHashMap;
use std::sync::Arc;

use crate::rational::Rational;
use crate::unit::{BASE_SYMBOLS, Dimension, Unit, same_factor};

/// Familiar names of coherent units, tried in this order.
const FAMILIAR: &[&str] = &[
    "1", "kg", "m", "s", "A", "K", "mol", "cd", "N", "Pa", "J", "W", "V", "C", "F", "Ohm", "S", "Wb", "T", "H", "m2",
    "m3", "m/s", "m/s2", "m3/s", "1/s", "kg/s", "kg/m3", "N/m", "N.s/m", "Pa.s", "J/(kg.K)", "W/(m.K)", "V/m", "A/m",
    "H/m",
];

/// Finds texts for units; prefers those of the model.
#[derive(Default)]
pub(crate) struct UnitNames {
    declared: FxHashMap<Dimension, Vec<(Unit, Arc<str>)>>,
}

impl UnitNames {
    /// Notes that the model writes a unit so; the first text of a unit stays.
    pub(crate) fn declare(&mut self, unit: Unit, text: &Arc<str>) {
        let list = self.declared.entry(unit.dimension).or_default();
        if !list.iter().any(|(known, _)| same_unit(known, &unit)) {
            list.push((unit, text.clone()));
        }
    }

    /// The unit as text.
    pub(crate) fn text(&self, unit: &Unit) -> String {
        let declared = self.declared.get(&unit.dimension).and_then(|l| l.iter().find(|(u, _)| same_unit(u, unit)));
        match declared {
            // A number is `1`, whether or not the model calls it an angle.
            Some((_, text)) if !(unit.dimension.is_none() && unit.factor == 1.0) => text.to_string(),
            _ => to_text(unit),
        }
    }
}

fn same_unit(a: &Unit, b: &Unit) -> bool {
    a.dimension == b.dimension && same_factor(a.factor, b.factor) && (a.offset - b.offset).abs() < 1e-6
}

/// The unit as text without a model: special name or base units, a factor other than 1 in front.
pub fn to_text(unit: &Unit) -> String {
    let familiar =
        FAMILIAR.iter().find(|text| crate::parse_unit(text).is_ok_and(|known| known.dimension == unit.dimension));
    let text = familiar.map_or_else(|| base_units(&unit.dimension), |text| (*text).to_string());
    if same_factor(unit.factor, 1.0) { text } else { format!("{} {text}", number(unit.factor)) }
}

/// A factor with as many digits as it needs, at most 10.
pub(crate) fn number(value: f64) -> String {
    let rounded = format!("{value:.9e}").parse::<f64>().unwrap_or(value);
    if (1e-4..1e7).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// `kg.m2/(s3.A)`
fn base_units(dimension: &Dimension) -> String {
    let part = |positive: bool| -> Vec<String> {
        let powers = BASE_SYMBOLS.iter().zip(dimension.0);
        powers.filter(|(_, e)| !e.is_zero() && (e.value() > 0.0) == positive).map(|(s, e)| power(s, e)).collect()
    };
    let (above, below) = (part(true), part(false));
    let numerator = if above.is_empty() { "1".to_string() } else { above.join(".") };
    match below.as_slice() {
        [] => numerator,
        [one] => format!("{numerator}/{one}"),
        _ => format!("{numerator}/({})", below.join(".")),
    }
}

fn power(symbol: &str, exponent: Rational) -> String {
    let (numerator, denominator) = exponent.parts();
    match (numerator.abs(), denominator) {
        (1, 1) => symbol.to_string(),
        (n, 1) => format!("{symbol}{n}"),
        (n, d) => format!("{symbol}({n}/{d})"),
    }
}
