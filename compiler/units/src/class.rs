//! The unit of each scalar variable: declared, unknown, or none needed.
//!
//! All elements of an array share an unknown unit until that leads to a contradiction; then each element gets its own
//! (an array of states or of sensors may mix units).  Blocks with the same unit share a class, so equations of equal
//! units are looked at once.

use std::sync::Arc;

use hyd_flat::{ConstId, FlatModel, Operand, PerElement, Target, VarId, VariableBlock};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic, Edit, Files, Span};
use hyd_symbolic::BodyId;
use hyd_system::ValueKind;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::form::{Form, Product, UnknownId};
use crate::parse::parse_unit;
use crate::print::UnitNames;
use crate::unit::{Unit, same_factor};

/// The declared units of a model.
pub(crate) struct Declared {
    /// Unit of each variable block, if readable; by element where they differ.
    pub of_block: Vec<PerElement<Option<Unit>>>,
    /// Units of the numbers that have one.
    pub of_number: FxHashMap<ConstId, Unit>,
    /// Units of the results of compiled functions.
    pub of_result: FxHashMap<(BodyId, u32), Unit>,
    /// Texts for units.
    pub names: UnitNames,
    /// Some unit has a factor other than 1.
    pub scaled: bool,
    /// Unit strings that cannot be read or do not fit.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads the unit strings of all variables, each string once.
pub(crate) fn read_declared(flat: &FlatModel, files: &Files) -> Declared {
    let mut known: FxHashMap<Arc<str>, Option<Unit>> = FxHashMap::default();
    let mut reported: FxHashSet<(Span, Arc<str>)> = FxHashSet::default();
    let mut result = Declared {
        of_block: Vec::new(),
        of_number: FxHashMap::default(),
        of_result: FxHashMap::default(),
        names: UnitNames::default(),
        scaled: false,
        diagnostics: Vec::new(),
    };
    for block in flat.variables.raw.iter() {
        let mut read = |text: &Option<Arc<str>>, display: bool| -> Option<Unit> {
            let text = text.as_ref().filter(|t| !t.is_empty())?;
            let unit = *known.entry(text.clone()).or_insert_with(|| parse_unit(text).ok());
            if unit.is_none() && reported.insert((block.origin.span, text.clone())) {
                result.diagnostics.push(unreadable(block, text, display, files));
            }
            unit
        };
        let unit = read(&block.unit, false);
        let units: Vec<(Option<Unit>, Arc<str>)> =
            block.element_units.iter().map(|text| (read(&Some(text.clone()), false), text.clone())).collect();
        let display = read(&block.display_unit, true);
        if let (Some(unit), Some(shown), Some(text), Some(display)) = (unit, display, &block.unit, &block.display_unit)
            && unit.dimension != shown.dimension
            && reported.insert((block.origin.span, display.clone()))
        {
            let message = format!("`{}` has the unit {text}, but shall be shown in {display}", block.name.element(0));
            let fault = Diagnostic::warning(Code::UnitMismatch, message).at(block.origin.span, "declared here");
            result.diagnostics.push(fault);
        }
        let all = units.iter().map(|(unit, text)| (*unit, Some(text))).chain([(unit, block.unit.as_ref())]);
        for (unit, text) in all {
            if let (Some(unit), Some(text)) = (unit, text) {
                result.names.declare(unit, text);
                result.scaled |= !same_factor(unit.factor, 1.0);
            }
        }
        result.of_block.push(match units.is_empty() {
            true => PerElement::All(unit),
            false => PerElement::Each(units.into_iter().map(|(unit, _)| unit).collect()),
        });
    }
    read_numbers(flat, &mut result);
    result
}

/// The units of constants and of the results of functions.
fn read_numbers(flat: &FlatModel, result: &mut Declared) {
    let mut reported: FxHashSet<Span> = FxHashSet::default();
    for quantity in &flat.quantities {
        match parse_unit(&quantity.unit) {
            Ok(unit) => {
                result.names.declare(unit, &quantity.unit);
                result.scaled |= !same_factor(unit.factor, 1.0);
                result.of_number.insert(quantity.id, unit);
            }
            Err(error) if reported.insert(quantity.declared) => {
                let message = format!("the unit \"{}\" of `{}` {}", quantity.unit, quantity.name, error.reason);
                let fault = Diagnostic::error(Code::UnitSyntax, message).at(quantity.declared, "declared here");
                result.diagnostics.push(fault.maybe_help(error.help));
            }
            Err(_) => {}
        }
    }
    for (body, output, text) in &flat.result_units {
        if let Ok(unit) = parse_unit(text) {
            result.names.declare(unit, text);
            result.scaled |= !same_factor(unit.factor, 1.0);
            result.of_result.insert((*body, *output), unit);
        }
    }
}

fn unreadable(block: &VariableBlock, text: &str, display: bool, files: &Files) -> Diagnostic {
    let (reason, help, meant) = match parse_unit(text) {
        Err(error) => (error.reason, error.help, error.meant),
        Ok(_) => (String::new(), None, None),
    };
    let what = if display { "displayUnit" } else { "unit" };
    let message = format!("the {what} \"{text}\" of `{}` {reason}", block.name.element(0));
    let diagnostic = if display {
        Diagnostic::warning(Code::UnitSyntax, message)
    } else {
        Diagnostic::error(Code::UnitSyntax, message)
    };
    let diagnostic = diagnostic.at(block.origin.span, "declared here").maybe_help(help);
    match meant.and_then(|meant| Some((written(files, block.origin.span, what, text)?, meant))) {
        Some((span, meant)) => {
            diagnostic.propose(format!("write `{meant}` for `{text}`"), vec![Edit { span, text: meant }])
        }
        None => diagnostic,
    }
}

/// Where a declaration writes this string for an attribute, without its quotes; none where its type does.
fn written(files: &Files, name: Span, attribute: &str, text: &str) -> Option<Span> {
    let whole = files.text(name.file);
    let rest = whole.get(name.end as usize..)?;
    let rest = &rest[..rest.find(';').unwrap_or(rest.len())];
    let quoted = format!("\"{text}\"");
    let places = rest.match_indices(&quoted).map(|(at, _)| at);
    let is_value = |at: &usize| {
        let before = rest[..*at].trim_end().strip_suffix('=').map(str::trim_end);
        let word = before.and_then(|before| before.rsplit(|c: char| !c.is_alphanumeric()).next());
        word == Some(attribute)
    };
    let start = name.end as usize + places.into_iter().find(is_value)? + 1;
    Some(Span::new(name.file, start, start + text.len()))
}

const TAG_SHIFT: u32 = 30;
const INDEX: u32 = (1 << TAG_SHIFT) - 1;
const KNOWN: u32 = 0;
const UNKNOWN: u32 = 1;
const COUNT: u32 = 2;

/// A slot as far as units go; equal codes mean equal forms.
pub(crate) type SlotClass = u64;

const DER: u64 = 1 << 32;
/// Nothing is known or asked of the unit.
const FREE: u64 = 1 << 36;
const NEGATED: u64 = 1 << 33;
const NUMBER: u64 = 1 << 34;

/// The class of every scalar.
pub(crate) struct Classes {
    of_scalar: Vec<u32>,
    /// What each delay site delays.
    sources: Vec<VarId>,
    /// Which variable each recorded input is.
    driven: Vec<VarId>,
    units: Vec<Unit>,
    numbers: FxHashMap<ConstId, u32>,
    offsets: bool,
    /// First scalar that each unknown unit stands for.
    pub unknowns: Vec<VarId>,
    /// Unknown arrays have one unit per element.
    pub split: bool,
}

impl Classes {
    /// Numbers the units; with `split`, each element of an array without unit has its own.
    pub(crate) fn new(flat: &FlatModel, declared: &Declared, split: bool) -> Self {
        let mut known: FxHashMap<(crate::unit::Dimension, u64, u64), u32> = FxHashMap::default();
        let mut result = Self {
            of_scalar: Vec::with_capacity(flat.scalars as usize),
            sources: flat.delays.iter().flat_map(|d| (0..d.count).map(|k| VarId(d.source.0 + k))).collect(),
            driven: (0..flat.driven_inputs()).filter_map(|k| flat.driven_variable(k)).collect(),
            units: Vec::new(),
            numbers: FxHashMap::default(),
            offsets: false,
            unknowns: Vec::new(),
            split,
        };
        for (block, unit) in flat.variables.raw.iter().zip(&declared.of_block) {
            let count = block.count as usize;
            let units = match unit {
                PerElement::All(unit) => unit,
                PerElement::Each(units) => {
                    for (k, unit) in units.iter().enumerate() {
                        match unit {
                            Some(unit) => {
                                let number = result.number_of(unit, &mut known);
                                result.extend(KNOWN << TAG_SHIFT | number, 1);
                            }
                            None => result.add_unknown(VarId(block.first.0 + k as u32)),
                        }
                    }
                    continue;
                }
            };
            let undeclared = units.is_none() && block.unit.as_ref().is_none_or(|t| t.is_empty());
            match units {
                Some(unit) => {
                    let number = result.number_of(unit, &mut known);
                    result.extend(KNOWN << TAG_SHIFT | number, count);
                }
                None if block.kind != ValueKind::Real && undeclared => result.extend(COUNT << TAG_SHIFT, count),
                None => {
                    for k in 0..count {
                        if k == 0 || split {
                            result.add_unknown(VarId(block.first.0 + k as u32));
                        } else {
                            let number = result.unknowns.len() as u32 - 1;
                            result.of_scalar.push(UNKNOWN << TAG_SHIFT | number & INDEX);
                        }
                    }
                }
            }
        }
        let mut numbers: Vec<(ConstId, Unit)> = declared.of_number.iter().map(|(id, unit)| (*id, *unit)).collect();
        numbers.sort_unstable_by_key(|(id, _)| *id);
        for (id, unit) in numbers {
            let number = result.number_of(&unit, &mut known);
            result.numbers.insert(id, number);
        }
        result
    }

    fn number_of(&mut self, unit: &Unit, known: &mut FxHashMap<(crate::unit::Dimension, u64, u64), u32>) -> u32 {
        let key = (unit.dimension, unit.factor.to_bits(), unit.offset.to_bits());
        let next = self.units.len() as u32;
        let number = *known.entry(key).or_insert(next);
        if number == next {
            self.units.push(*unit);
            self.offsets |= unit.offset != 0.0;
        }
        number
    }

    fn add_unknown(&mut self, v: VarId) {
        self.unknowns.push(v);
        let number = self.unknowns.len() as u32 - 1;
        self.of_scalar.push(UNKNOWN << TAG_SHIFT | number & INDEX);
    }

    fn extend(&mut self, class: u32, count: usize) {
        self.of_scalar.resize(self.of_scalar.len() + count, class);
    }

    /// The class of an operand; numbers keep their identity with `exact`.
    pub(crate) fn of(&self, operand: Operand, exact: bool) -> SlotClass {
        let sign = if self.offsets && operand.negated() { NEGATED } else { 0 };
        match operand.target() {
            Target::Var(v) | Target::Pre(v) | Target::Start(v) => u64::from(self.of_scalar[v.index()]) | sign,
            Target::Der(v) => u64::from(self.of_scalar[v.index()]) | DER,
            Target::Const(c) if self.numbers.contains_key(&c) => {
                u64::from(KNOWN << TAG_SHIFT | self.numbers[&c]) | sign
            }
            Target::Const(c) if exact => NUMBER | c.0 as u64 | if operand.negated() { NEGATED } else { 0 },
            Target::Delayed(site) => u64::from(self.of_scalar[self.sources[site as usize].index()]),
            // It stands before the delay time only, and both together have the unit of what is delayed.
            Target::DelayedRate(_) => FREE,
            Target::Input(k) => u64::from(self.of_scalar[self.driven[k as usize].index()]),
            Target::InputRate(k) => u64::from(self.of_scalar[self.driven[k as usize].index()]) | DER,
            Target::Const(_) | Target::Held(_) | Target::Chosen(_) => u64::from(COUNT << TAG_SHIFT),
        }
    }

    /// What a class means.
    pub(crate) fn form(&self, class: SlotClass) -> Form {
        let code = class as u32;
        if class & NUMBER != 0 {
            return Form::COUNT;
        }
        if class & FREE != 0 {
            return Form::Free;
        }
        let mut product = match code >> TAG_SHIFT {
            KNOWN => Product::known(&self.units[(code & INDEX) as usize]),
            UNKNOWN => Product::unknown(code & INDEX),
            _ => return Form::COUNT,
        };
        if class & NEGATED != 0 {
            product.offset = product.offset.map(|o| -o);
        }
        if class & DER != 0 {
            product.offset = Some(0.0);
            let rate = product.times(&Product::rule(&Unit::SECOND), crate::rational::Rational::whole(-1));
            return rate.map_or(Form::Free, Form::Quantity);
        }
        Form::Quantity(product)
    }

    /// The unknown unit a class stands for.
    pub(crate) fn unknown(&self, class: SlotClass) -> Option<UnknownId> {
        let code = class as u32;
        (class & (NUMBER | FREE) == 0 && code >> TAG_SHIFT == UNKNOWN).then_some(code & INDEX)
    }

    /// The unknown unit of a scalar.
    pub(crate) fn unknown_of(&self, v: VarId) -> Option<UnknownId> {
        self.unknown(u64::from(self.of_scalar[v.index()]))
    }

    /// True if an array without unit exists whose elements share one.
    pub(crate) fn could_split(&self, flat: &FlatModel) -> bool {
        let shared = |v: &VarId| flat.variables[flat.locate(*v).0].count > 1;
        !self.split && self.unknowns.iter().any(shared)
    }
}
