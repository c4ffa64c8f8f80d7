//! Numbers of declarations that may have been meant in another unit, or with the point elsewhere: by their sizes, and by what their classes say.

use std::collections::BTreeMap;

use hyd_flat::{FlatModel, Section, Target, VarId};
use hyd_source::Span;
use hyd_syntax::tree::{BinaryOp, ExprKind};
use hyd_system::math::powi;
use hyd_system::{Variability, significant};

use super::defaults::literal;
use super::{Found, Rank, number};
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

/// A number by so much larger or smaller than the default of its class is far from it; one that is not is what is meant.
const FAR: f64 = 5.0;
/// By so much a number may differ from the default of its class when its point is moved.
const NEAR: f64 = 3.0;
/// Places by which a point may be off.
const MOST_PLACES: i32 = 3;

/// A number that the text gives a variable.
struct Given {
    span: Span,
    /// Of the variable, and whether its declaration states it.
    unit: String,
    is_declared: bool,
    name: String,
    value: f64,
    /// `12/1000`: the number that was converted, as text.
    converted: Option<(String, f64)>,
    /// An assertion compares with it.
    is_limit: bool,
}

impl Found<'_> {
    /// Numbers of the file, by the units of the variables that they are values of.
    pub(super) fn numbers(&mut self, flat: &FlatModel, inferred: &[(VarId, String)]) {
        let usual: BTreeMap<u32, Suspect> =
            crate::suspects(flat).into_iter().map(|own| (own.span.start, own)).collect();
        let defaults = self.classes.defaults();
        for given in self.given(flat, inferred) {
            let is_plain = given.converted.is_none();
            if let Some(own) = usual.get(&given.span.start).filter(|_| is_plain) {
                self.number(Rank::Unit, given.span, own.meant, own.words.clone());
            }
            if given.value == 0.0 || given.is_limit {
                continue;
            }
            // A one and its powers of ten are there for want of a number.
            let is_meant = |default: &f64| !format!("{:e}", default.abs()).starts_with("1e");
            let default = defaults.get(&given.span.start).copied().filter(is_meant);
            // Of a run that only fails to go on another number says as little.
            let is_asked = self.trouble.judged || self.trouble.undefined || self.trouble.start;
            if let Some(default) = default.filter(|&default| is_asked && is_far(given.value, default)) {
                self.far_from_default(&given, default);
            }
            // That numbers of another size bring the solver through says nothing: only where somebody has said what is meant, and not of what is
            // compared there, nor of what is near that of its class.
            let is_usual = default.is_some_and(|default| !is_far(given.value, default));
            if self.trouble.judged && is_plain && !is_usual {
                self.other_unit(&given);
            }
        }
    }

    /// The numbers of the file, in its order.
    fn given(&self, flat: &FlatModel, inferred: &[(VarId, String)]) -> Vec<Given> {
        let mut known: BTreeMap<u32, Given> = BTreeMap::new();
        let blocks = flat.equations.iter().filter(|block| matches!(block.section, Section::Binding | Section::Start));
        for equations in blocks.filter(|block| block.origin.span.file == self.file) {
            let template = flat.templates.get(equations.template);
            let Some(value) = flat.templates.arena.as_constant(template.right) else { continue };
            let span = equations.origin.span;
            let is_number = self.snippet(span).parse::<f64>().is_ok_and(|own| own == value);
            let converted = if is_number { None } else { self.converted(span, value) };
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
            if let (true, true, Some(unit)) = (is_number || converted.is_some(), is_parameter, unit) {
                let given = Given { span, unit, is_declared, name, value, converted, is_limit };
                known.entry(span.start).or_insert(given);
            }
        }
        known.into_values().collect()
    }

    /// The number that stands before the factor in `12/1000` or `12*1e-3`.
    fn converted(&self, span: Span, value: f64) -> Option<(String, f64)> {
        let text = self.snippet(span);
        let expr = hyd_syntax::parse_expression(self.file, text).value?;
        let whole = literal(&expr)?;
        let ExprKind::Binary(BinaryOp::Mul | BinaryOp::Div, first, _) = &expr.kind else { return None };
        let own = &text[first.span.start as usize..first.span.end as usize];
        let is_it = (whole - value).abs() <= 1e-12 * value.abs();
        Some((own.to_string(), number(first)?)).filter(|_| is_it)
    }

    /// A number far from what its class says: in another unit, converted by another factor, or with its point elsewhere.
    fn far_from_default(&mut self, given: &Given, default: f64) {
        let (old, name) = (self.snippet(given.span).to_string(), &given.name);
        let far = format!("`{name}` = {old} is far from {}, the default of its class", significant(default));
        let others = OTHERS.iter().find(|(own, _)| *own == given.unit).map_or(&[][..], |(_, others)| others);
        for (words, factor) in others {
            let (value, text) = match &given.converted {
                Some((number, value)) => (value * factor, conversion(number, *factor)),
                None => (given.value * factor, significant(round_to(given.value * factor, 6))),
            };
            if !is_far(value, default) {
                let edit = self.replaced(given.span, text.clone());
                let words = format!("{far}, and may be meant in {words}: write {text}");
                self.push(Rank::FarFromDefault, words, vec![edit]);
            }
        }
        let moved = |places: &i32| round_to(given.value * powi(10.0, *places), 6);
        let places = (-MOST_PLACES..=MOST_PLACES).filter(|places| *places != 0);
        let nearest = places.min_by(|a, b| ratio(moved(a), default).total_cmp(&ratio(moved(b), default)));
        let nearest = nearest.filter(|places| given.converted.is_none() && ratio(moved(places), default) < NEAR);
        if let Some(places) = nearest {
            let text = significant(moved(&places));
            self.number(Rank::Point, given.span, moved(&places), format!("{far}: write {text}"));
        }
    }

    /// A number that may be meant in another unit, by its size.
    fn other_unit(&mut self, given: &Given) {
        let (old, value) = (self.snippet(given.span).to_string(), given.value);
        let meant = |found: &mut Self, rank: Rank, new: f64, words: &str| {
            let rank = if given.is_declared { rank } else { Rank::InferredUnit };
            let text = significant(new);
            found.number(rank, given.span, new, format!("`{}` = {old} {words}: write {text}", given.name));
        };
        if given.unit == "K" {
            return meant(self, Rank::OtherUnit, value + ZERO_CELSIUS, "may be meant in degrees Celsius");
        }
        // Nobody counts in millimetres to write parts of one, or in bar to write millions.
        let fits = |factor: f64| {
            (if factor < 1.0 { SMALLEST_OF_SMALL } else { SMALLEST_OF_LARGE }..MOST).contains(&value.abs())
        };
        if let Some((_, others)) = OTHERS.iter().find(|(own, _)| *own == given.unit) {
            for (words, factor) in others.iter().filter(|(_, factor)| fits(*factor)) {
                meant(self, Rank::OtherUnit, round_to(value * factor, 6), &format!("may be meant in {words}"));
            }
        } else if given.unit != "1" {
            for (words, factor) in PREFIXES.iter().filter(|(_, factor)| fits(*factor)) {
                meant(self, Rank::Prefix, round_to(value * factor, 6), &format!("may lack the prefix {words}"));
            }
        }
    }

    fn number(&mut self, rank: Rank, span: Span, meant: f64, words: String) {
        let edit = self.replaced(span, significant(meant));
        self.push(rank, words, vec![edit]);
    }
}

/// By how much one number is larger than the other; infinite where they differ in sign.
fn ratio(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    if ratio > 0.0 && ratio.is_finite() { ratio.max(ratio.recip()) } else { f64::INFINITY }
}

fn is_far(value: f64, default: f64) -> bool {
    ratio(value, default) > FAR
}

/// A number times a factor, as people write it.
fn conversion(number: &str, factor: f64) -> String {
    let divisor = factor.recip();
    match (divisor - divisor.round()).abs() < 1e-9 * divisor && divisor > 1.0 {
        true => format!("{number}/{}", significant(divisor.round())),
        false => format!("{number}*{}", significant(factor)),
    }
}
