//! Numbers of declarations that may have been meant in another unit.

use std::collections::BTreeMap;

use hyd_flat::{FlatModel, Section, Target, VarId};
use hyd_source::Span;
use hyd_system::{Variability, significant};

use super::{Found, Rank};
use crate::suspects::{Suspect, round_to};

/// Units of SI, and what people count in beside them: words, and by how much the number has to be multiplied.
const OTHERS: [(&str, &[(&str, f64)]); 14] = [
    ("m", &[("mm", 1e-3), ("cm", 1e-2)]),
    ("m2", &[("mm2", 1e-6), ("cm2", 1e-4)]),
    ("m3", &[("litres", 1e-3), ("cm3", 1e-6)]),
    ("m/s", &[("km/h", 1.0 / 3.6), ("mm/s", 1e-3)]),
    ("m3/s", &[("litres per minute", 1.0 / 6e4)]),
    ("s", &[("minutes", 60.0), ("hours", 3600.0), ("ms", 1e-3)]),
    ("1/s", &[("turns per minute", 1.0 / 60.0)]),
    ("rad/s", &[("turns per minute", std::f64::consts::TAU / 60.0)]),
    ("rad", &[("degrees", std::f64::consts::PI / 180.0)]),
    ("Pa", &[("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3)]),
    ("kg", &[("g", 1e-3), ("t", 1e3)]),
    ("J", &[("kJ", 1e3), ("kW.h", 3.6e6)]),
    ("N/m", &[("N/mm", 1e3)]),
    ("J/(kg.K)", &[("kJ/(kg.K)", 1e3)]),
];
/// What is tried of units that have no others: prefixes that were left out.
const PREFIXES: [(&str, f64); 3] = [("kilo", 1e3), ("milli", 1e-3), ("micro", 1e-6)];
/// Sizes of numbers that people write in units that are small or large beside those of SI.
const SMALLEST_OF_SMALL: f64 = 1.0;
const SMALLEST_OF_LARGE: f64 = 0.05;
const MOST: f64 = 1e4;
/// Zero degrees Celsius (K).
const ZERO_CELSIUS: f64 = 273.15;

impl Found<'_> {
    /// Numbers of the file, by the units of the variables that they are values of.
    pub(super) fn numbers(&mut self, flat: &FlatModel, inferred: &[(VarId, String)]) {
        let usual: BTreeMap<u32, Suspect> =
            crate::suspects(flat).into_iter().map(|own| (own.span.start, own)).collect();
        let mut known: BTreeMap<u32, (Span, String, String, f64, [bool; 2])> = BTreeMap::new();
        let blocks = flat.equations.iter().filter(|block| matches!(block.section, Section::Binding | Section::Start));
        for equations in blocks.filter(|block| block.origin.span.file == self.file) {
            let template = flat.templates.get(equations.template);
            let Some(value) = flat.templates.arena.as_constant(template.right) else { continue };
            let span = equations.origin.span;
            let is_number = self.snippet(span).parse::<f64>().is_ok_and(|own| own == value);
            let Some(Target::Var(v) | Target::Start(v)) = equations.operands.first().map(|own| own.target()) else {
                continue;
            };
            let (block, k) = flat.locate(v);
            let block = &flat.variables[block];
            let is_parameter = block.variability <= Variability::Parameter || equations.section == Section::Start;
            let declared = block.element_units.get(k).or(block.unit.as_ref()).map(|unit| unit.to_string());
            let is_declared = declared.is_some();
            let unit = declared.or_else(|| inferred.iter().find(|own| own.0 == v).map(|own| own.1.clone()));
            let name = block.name.element(k);
            let is_limit = self.asserted.has(&name);
            if let (true, true, Some(unit)) = (is_number, is_parameter, unit) {
                known.entry(span.start).or_insert((span, unit, name, value, [is_declared, is_limit]));
            }
        }
        for (span, unit, name, value, [is_declared, is_limit]) in known.into_values() {
            if let Some(own) = usual.get(&span.start) {
                self.number(Rank::Unit, span, own.meant, own.words.clone());
            }
            // That numbers of another size bring the solver through says nothing: only where somebody has said what is meant, and not of what is
            // compared there.
            if value == 0.0 || !self.trouble.judged || is_limit {
                continue;
            }
            let old = self.snippet(span).to_string();
            let meant = |found: &mut Self, rank: Rank, new: f64, words: &str| {
                let rank = if is_declared { rank } else { Rank::InferredUnit };
                let text = significant(new);
                found.number(rank, span, new, format!("`{name}` = {old} {words}: write {text}"));
            };
            if unit == "K" {
                meant(self, Rank::OtherUnit, value + ZERO_CELSIUS, "may be meant in degrees Celsius");
                continue;
            }
            // Nobody counts in millimetres to write parts of one, or in bar to write millions.
            let fits = |factor: f64| {
                (if factor < 1.0 { SMALLEST_OF_SMALL } else { SMALLEST_OF_LARGE }..MOST).contains(&value.abs())
            };
            if let Some((_, others)) = OTHERS.iter().find(|(own, _)| *own == unit) {
                for (words, factor) in others.iter().filter(|(_, factor)| fits(*factor)) {
                    meant(self, Rank::OtherUnit, round_to(value * factor, 6), &format!("may be meant in {words}"));
                }
            } else if unit != "1" {
                for (words, factor) in PREFIXES.iter().filter(|(_, factor)| fits(*factor)) {
                    meant(self, Rank::Prefix, round_to(value * factor, 6), &format!("may lack the prefix {words}"));
                }
            }
        }
    }

    fn number(&mut self, rank: Rank, span: Span, meant: f64, words: String) {
        let edit = self.replaced(span, significant(meant));
        self.push(rank, words, vec![edit]);
    }
}
