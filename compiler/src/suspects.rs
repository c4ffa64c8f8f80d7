//! Parameters whose number looks like one in another unit: 6 Pa where 6 bar are meant, 40 K for 40 degrees Celsius, 12 rad for 12 degrees.
//!
//! Only asked where a run has failed, as a number by itself is not a fault.  A unit tells which others people count in beside it; a value is
//! suspect where it is far from what is usual for its type (the `nominal` value, a full turn for angles, room temperature) and near it
//! if it is read in one of those.  Values are those that stand in the text as numbers.

use hyd_flat::{FlatModel, Section, Target, VariableBlock};
use hyd_source::{FileId, Span};
use hyd_system::{Variability, significant};

/// So many times the nominal value, or a part of it, is far.
const FAR: f64 = 100.0;
/// So many times the nominal value, or a part of it, is near.
const NEAR: f64 = 50.0;
/// Angles beyond so many degrees are hardly given in degrees.
const MOST_DEGREES: f64 = 720.0;
/// A type whose usual value is at least this is one of pressures in machines (Pa), of which this many bar are the most.
const HIGH: f64 = 1e4;
const MOST_BAR: f64 = 250.0;
/// Temperatures below this are hardly meant (K).
const COLD: f64 = 150.0;
/// A type whose usual value is at least this is one of absolute temperatures (K).
const WARM: f64 = 200.0;

/// A parameter whose number looks like one in another unit.
#[derive(Clone, PartialEq, Debug)]
pub struct Suspect {
    /// Its name.
    pub name: String,
    /// Where its value stands.
    pub span: Span,
    /// What it may be, as a sentence.
    pub words: String,
    /// The number that was meant, if it is.
    pub meant: f64,
    /// How far its value is from what is usual, as a factor.
    distance: f64,
}

/// Units of SI, and what people count in beside them: words, and by how much the number has to be multiplied.  Not here are those whose values
/// span too many sizes of machines to say what is usual, such as lengths and voltages.
const OTHERS: [(&str, &[(&str, f64)]); 4] = [
    ("J/(kg.K)", &[("kJ/(kg.K)", 1e3)]),
    ("J/kg", &[("kJ/kg", 1e3)]),
    ("1/s", &[("turns per minute", 1.0 / 60.0)]),
    ("rad/s", &[("turns per minute", std::f64::consts::TAU / 60.0)]),
];

/// The suspects among what the model's own text gives a number, those farthest from what is usual first.
pub fn suspects(flat: &FlatModel) -> Vec<Suspect> {
    let own = own_file(flat);
    let mut found: Vec<Suspect> = Vec::new();
    for equations in flat.equations.iter().filter(|block| block.section == Section::Binding) {
        let template = flat.templates.get(equations.template);
        let Some(value) = flat.templates.arena.as_constant(template.right) else { continue };
        if Some(equations.origin.span.file) != own {
            continue;
        }
        for operand in &equations.operands {
            let Target::Var(v) = operand.target() else { continue };
            let (block, k) = flat.locate(v);
            let block = &flat.variables[block];
            let value = if operand.negated() { -value } else { value };
            if block.variability > Variability::Parameter || found.iter().any(|own| own.span == equations.origin.span) {
                continue;
            }
            found.extend(suspect(block, k, value, equations.origin.span));
        }
    }
    found.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    found
}

/// The file in which what stands at the top of the model is declared.
fn own_file(flat: &FlatModel) -> Option<FileId> {
    let equations = flat.equations.iter().map(|block| &block.origin);
    let variables = flat.variables.iter().filter(|block| block.made.is_none()).map(|block| &block.origin);
    variables.chain(equations).find(|origin| origin.path.is_empty()).map(|origin| origin.span.file)
}

fn suspect(block: &VariableBlock, k: usize, value: f64, span: Span) -> Option<Suspect> {
    let unit = block.element_units.get(k).or(block.unit.as_ref())?;
    let usual = block.nominal.get(k);
    // Units of a law, such as 1 K, are no measures.
    if value == 1.0 {
        return None;
    }
    let name = block.name.element(k);
    let shown = significant(value);
    let found = |meant: f64, words: String, distance: f64| {
        let words = format!("{words}, write {}", significant(meant));
        Some(Suspect { words, name: name.clone(), span, meant, distance })
    };
    match (&**unit, usual) {
        ("rad", _) if (1.01 * std::f64::consts::TAU..=MOST_DEGREES).contains(&value.abs()) => {
            let degrees = significant((value.to_degrees() * 10.0).round() / 10.0);
            let words = format!("`{name}` = {shown} rad is {degrees} degrees: if it is meant in degrees");
            found(round_to(value.to_radians(), 4), words, value.abs() / std::f64::consts::TAU)
        }
        ("K", Some(usual)) if usual >= WARM && value < COLD => {
            let celsius = significant(((value - 273.15) * 100.0).round() / 100.0);
            let words = format!("`{name}` = {shown} K is {celsius} degC: if it is meant in degrees Celsius");
            found(((value + 273.15) * 100.0).round() / 100.0, words, usual / value.abs().max(1.0))
        }
        ("Pa", Some(usual)) if usual >= HIGH && (1.0..=MOST_BAR).contains(&value) => {
            let words = format!("`{name}` = {shown} Pa is next to nothing: if it is meant in bar");
            found(round_to(value * 1e5, 5), words, usual / value)
        }
        (_, Some(usual)) if usual > 0.0 && value != 0.0 => {
            let ratio = value.abs() / usual;
            if (1.0 / FAR..FAR).contains(&ratio) {
                return None;
            }
            let (_, others) = OTHERS.iter().find(|(own, _)| *own == &**unit)?;
            let near = |factor: f64| (1.0 / NEAR..=NEAR).contains(&(ratio * factor));
            let (other, factor) = others.iter().find(|(_, factor)| near(*factor))?;
            let usual = significant(usual);
            let words = format!(
                "`{name}` = {shown} {unit} is far from the usual size of such a value ({usual} {unit}): if it is meant in {other}"
            );
            found(round_to(value * factor, 5), words, ratio.max(1.0 / ratio))
        }
        _ => None,
    }
}

/// A number with so many significant digits.
pub(crate) fn round_to(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use hyd_instance::SourceText;

    use super::suspects;
    use crate::{Goal, Options, Sources, compile};

    struct Nothing;

    impl Sources for Nothing {
        fn find(&mut self, _: &[std::sync::Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    #[test]
    fn numbers_of_other_units_are_seen_and_others_are_not() {
        let of = |unit: &str, more: &str, value: &str| {
            let text =
                format!("model M\n  parameter Real p(unit = \"{unit}\"{more}) = {value};\n  Real x = p;\nend M;\n");
            let options = Options { model: None, set: Vec::new(), goal: Goal::Flat, clock: || 0.0 };
            let flat = compile(&mut Nothing, "m.mo", &text, &options).flat.expect("it translates");
            suspects(&flat).first().map(|own| own.words.rsplit(' ').next().unwrap_or_default().to_string())
        };
        let pressure = ", nominal = 1e6";
        assert_eq!(of("Pa", pressure, "6").as_deref(), Some("600000"));
        assert_eq!(of("Pa", pressure, "6e5"), None);
        assert_eq!(of("Pa", "", "6"), None);
        assert_eq!(of("Pa", pressure, "3000"), None);
        assert_eq!(of("K", ", nominal = 300", "40").as_deref(), Some("313.15"));
        assert_eq!(of("K", ", nominal = 300", "290"), None);
        // A difference of temperatures.
        assert_eq!(of("K", ", nominal = 10", "40"), None);
        assert_eq!(of("rad", "", "12").as_deref(), Some("0.2094"));
        assert_eq!(of("rad", "", "3.1"), None);
        assert_eq!(of("rad", "", "6000"), None);
        assert_eq!(of("m", ", nominal = 1e-3", "2"), None);
        assert_eq!(of("1/s", ", nominal = 25", "3000").as_deref(), Some("50"));
        assert_eq!(of("J/(kg.K)", ", nominal = 1e3", "4.18").as_deref(), Some("4180"));
    }
}
