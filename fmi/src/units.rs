//! Unit definitions: every unit string of a variable, what it means, and the display units that go with it.

use std::collections::{BTreeMap, BTreeSet};

use crate::facts::{Facts, KnownUnit};
use crate::variables::Entry;
use crate::xml::{Attributes, Document, number};

const SYMBOLS: [&str; 7] = ["kg", "m", "s", "A", "K", "mol", "cd"];

/// The unit of the time, which no text need have named.
const SECOND: KnownUnit = KnownUnit { powers: Some([0, 0, 1, 0, 0, 0, 0]), angle: 0, factor: 1.0, offset: 0.0 };

/// Units with their display units.
pub(crate) struct Units(BTreeMap<String, BTreeSet<String>>);

impl Units {
    /// Those of all variables; a display unit that cannot be converted to is taken from its variable.
    pub(crate) fn of(entries: &mut [Entry], facts: &Facts) -> Self {
        let mut units: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for entry in entries {
            if entry.unit.is_empty() {
                entry.display_unit.clear();
                continue;
            }
            let display = units.entry(entry.unit.clone()).or_default();
            if entry.display_unit.is_empty() {
                continue;
            }
            let known = (facts.units.get(&entry.unit), facts.units.get(&entry.display_unit));
            match known {
                (Some(unit), Some(other)) if unit.powers == other.powers && unit.powers.is_some() => {
                    display.insert(entry.display_unit.clone());
                }
                _ => entry.display_unit.clear(),
            }
        }
        Self(units)
    }

    pub(crate) fn write(&self, document: &mut Document, facts: &Facts) {
        if self.0.is_empty() {
            return;
        }
        document.element("UnitDefinitions", Attributes::default(), |document| {
            for (name, display) in &self.0 {
                let known = facts.units.get(name).or_else(|| (name == "s").then_some(&SECOND));
                document.element("Unit", Attributes::default().with("name", name), |document| {
                    if let Some(unit) = known {
                        base_unit(document, unit);
                    }
                    for other in display {
                        if let (Some(unit), Some(shown)) = (known, facts.units.get(other)) {
                            let factor = rounded(unit.factor / shown.factor);
                            let offset = rounded((unit.offset - shown.offset) / shown.factor);
                            let attributes = Attributes::default().with("name", other);
                            let attributes = attributes.maybe("factor", (factor != 1.0).then(|| number(factor)));
                            document.empty(
                                "DisplayUnit",
                                attributes.maybe("offset", (offset != 0.0).then(|| number(offset))),
                            );
                        }
                    }
                });
            }
        });
    }
}

/// A quotient without the rounding error of its last digit: 3.6 km/h, not 3.5999999999999996.
fn rounded(value: f64) -> f64 {
    let short = format!("{value:.14e}").parse().unwrap_or(value);
    if (short - value).abs() <= 2.0 * f64::EPSILON * value.abs() { short } else { value }
}

fn base_unit(document: &mut Document, unit: &KnownUnit) {
    let Some(powers) = unit.powers else { return };
    let mut attributes = Attributes::default();
    for (symbol, power) in SYMBOLS.iter().zip(powers) {
        attributes = attributes.maybe(symbol, (power != 0).then_some(power));
    }
    let attributes = attributes.maybe("rad", (unit.angle != 0).then_some(unit.angle));
    let attributes = attributes.maybe("factor", (unit.factor != 1.0).then(|| number(unit.factor)));
    document.empty("BaseUnit", attributes.maybe("offset", (unit.offset != 0.0).then(|| number(unit.offset))));
}

#[cfg(test)]
mod tests {
    use super::rounded;

    #[test]
    fn quotients_lose_the_error_of_their_last_digit_and_nothing_else() {
        assert_eq!(rounded(1.0 / (1000.0 / 3600.0)), 3.6);
        assert_eq!(rounded(1.0 / 3.0), 1.0 / 3.0);
        assert_eq!(rounded(-273.15), -273.15);
        assert_eq!(rounded(0.0), 0.0);
    }
}
