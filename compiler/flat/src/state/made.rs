//! Variables that the translation makes beside the declared ones: conditions, long folds, delays, derivatives.

use hyd_source::{Origin, Span};
use hyd_symbolic::{NodeId, SlotId};
use hyd_system::{NamePattern, Settable, ValueKind, Variability};

use crate::model::{EquationBlock, Operand, PerElement, Section, StateSelect, Target, VarId, VariableBlock};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, advance};

/// What the translation made a variable for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Made {
    /// What changes at events: the condition of a `when`, a sample, an integer.
    Event,
    /// A long fold or a part of one; the name of its function.
    Fold(&'static str),
    /// A clock, a value that an operator of clocks gives, or what it is computed from.
    Clock,
    /// A delayed value, or what it is computed from.
    Delay,
    /// What a stream variable is of that which flows in.
    InStream,
    /// Derivatives that are variables: element `k` is that of the scalar variable `of + k`.
    Derivative {
        /// The first of the variables behind.
        of: VarId,
        /// How many times they are differentiated, from 1.
        order: u32,
    },
}

/// Variables for the derivatives of `count` neighbours from element `element` of a block; their name says nothing else than that.
pub fn derivative_block(
    block: &VariableBlock,
    (element, count): (usize, usize),
    order: u32,
    first: VarId,
) -> VariableBlock {
    let whole = count == block.count as usize;
    let name = if whole { block.name.clone() } else { NamePattern::scalar(block.name.element(element)) };
    VariableBlock {
        name: wrap(name, order),
        first,
        count: count as u32,
        declared: None,
        unit: (0..order).fold(block.unit.clone(), |unit, _| unit.map(|unit| rate_unit(&unit).into())),
        element_units: Vec::new(),
        display_unit: None,
        description: None,
        settable: Settable::No,
        made: Some(Made::Derivative { of: VarId(block.first.0 + element as u32), order }),
        has_start: false,
        fixed: PerElement::All(false),
        min: PerElement::All(f64::NEG_INFINITY),
        max: PerElement::All(f64::INFINITY),
        limit_spans: [None, None],
        at_any_time: false,
        nominal: PerElement::All(None),
        state_select: PerElement::All(StateSelect::Default),
        ..block.clone()
    }
}

/// A variable for what flows into a connector, for all of a stream variable.
pub(crate) fn in_stream_block(block: &VariableBlock, first: VarId) -> VariableBlock {
    let mut parts = block.name.parts.clone();
    match parts.first_mut() {
        Some((text, _)) => *text = format!("inStream({text}").into(),
        None => parts.push(("inStream(".into(), Vec::new())),
    }
    parts.push((")".into(), Vec::new()));
    VariableBlock {
        name: NamePattern { parts, derivative: false },
        first,
        description: None,
        protected: true,
        made: Some(Made::InStream),
        ..block.clone()
    }
}

/// `der(...)` around a name, `order` times.
fn wrap(name: NamePattern, order: u32) -> NamePattern {
    let mut parts = name.parts;
    let open = "der(".repeat(order as usize);
    match parts.first_mut() {
        Some((text, _)) => *text = format!("{open}{text}").into(),
        None => parts.push((open.into(), Vec::new())),
    }
    parts.push((")".repeat(order as usize).into(), Vec::new()));
    NamePattern { parts, derivative: name.derivative }
}

/// Unit of a time derivative: `m` to `m/s`, `m/s` to `m/s2`, `kg/m3` to `kg/(m3.s)`; unknown stays unknown.
pub fn rate_unit(unit: &str) -> String {
    match unit.split_once('/') {
        _ if unit.is_empty() => String::new(),
        None => format!("{unit}/s"),
        Some((above, "s")) => format!("{above}/s2"),
        Some((above, below)) => match below.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
            Some(inner) => format!("{above}/({inner}.s)"),
            None => format!("{above}/({below}.s)"),
        },
    }
}

impl Flattener<'_, '_> {
    /// A discrete Boolean (a condition of a `when`), one per element of the loops around it.
    pub(crate) fn made_boolean(&mut self, name: String, dims: &[usize], origin: Origin) -> VarId {
        self.make(Made::Event, name, dims, (ValueKind::Boolean, Variability::Discrete), origin)
    }

    /// A variable, one per element of the loops around it.
    pub(crate) fn make(
        &mut self,
        made: Made,
        name: String,
        dims: &[usize],
        (kind, variability): (ValueKind, Variability),
        origin: Origin,
    ) -> VarId {
        let sizes: Vec<u32> = dims.iter().map(|&d| d as u32).collect();
        let name = NamePattern { parts: vec![(name.into(), sizes)], derivative: false };
        let first = VarId(self.scalars());
        let count = name.count() as u32;
        self.add_variables(VariableBlock {
            name,
            first,
            count,
            kind,
            declared: None,
            variability,
            unit: None,
            element_units: Vec::new(),
            display_unit: None,
            description: None,
            settable: Settable::No,
            protected: true,
            made: Some(made),
            has_start: false,
            fixed: PerElement::All(variability <= Variability::Parameter),
            min: PerElement::All(f64::NEG_INFINITY),
            max: PerElement::All(f64::INFINITY),
            limit_spans: [None, None],
            at_any_time: false,
            nominal: PerElement::All(None),
            state_select: PerElement::All(StateSelect::Default),
            origin,
        });
        first
    }

    /// Adds `left = right`, which says what a made variable is, for all values of the counters.
    pub(crate) fn define(&mut self, left: NodeId, right: NodeId, counts: &[usize], origin: &Origin) {
        self.define_in(Section::Continuous, left, right, counts, origin);
    }

    /// The same in a section of its own.
    pub(crate) fn define_in(
        &mut self,
        section: Section,
        left: NodeId,
        right: NodeId,
        counts: &[usize],
        origin: &Origin,
    ) {
        if let Some(block) = self.equations_over(section, left, right, counts, origin) {
            self.tables().equations.push(EquationBlock { made: true, ..block });
        }
    }

    /// The variables that are the derivatives of what a slot reads, with their equations `w = der(v)`: the first of
    /// them and the place of each.  Each derivative is made once, those of a whole array as an array.
    pub(crate) fn rate_variable(
        &mut self,
        span: Span,
        v: VarId,
        offset: &Affine,
        cx: &Context,
    ) -> Result<(VarId, Affine), Fail> {
        let counts = cx.loop_counts();
        let total: usize = counts.iter().product();
        let mut counters = vec![0i64; counts.len()];
        let mut differentiated = Vec::with_capacity(total);
        for _ in 0..total {
            differentiated.push(VarId((i64::from(v.0) + offset.at(&counters)) as u32));
            advance(&mut counters, &counts);
        }
        let Some(&first) = differentiated.first() else { return Ok((v, offset.clone())) };
        if offset.as_constant().is_some() {
            differentiated.truncate(1);
        }
        if !differentiated.iter().any(|&v| self.rate_of(v).is_some()) {
            let origin = Origin { path: self.path(cx.scope.inst), span };
            self.make_rates(&differentiated, &origin);
        }
        let rates: Option<Vec<VarId>> = differentiated.iter().map(|&v| self.rate_of(v)).collect();
        let rates = rates.ok_or(Fail::NeedsExpansion)?;
        let distance = |k: usize| i64::from(rates[k].0) - i64::from(rates[0].0);
        let moved = |k: usize| i64::from(differentiated[k].0) - i64::from(first.0);
        if (0..rates.len()).all(|k| distance(k) == moved(k)) {
            return Ok((rates[0], Affine { constant: 0, terms: offset.terms.clone() }));
        }
        if (0..rates.len()).all(|k| distance(k) == k as i64) {
            return Ok((rates[0], crate::expressions::delay::offset(cx)?));
        }
        Err(Fail::NeedsExpansion)
    }

    fn rate_of(&self, v: VarId) -> Option<VarId> {
        self.all_notes().find_map(|notes| notes.rates.get(&v).copied())
    }

    /// Makes the derivatives of these variables.
    fn make_rates(&mut self, variables: &[VarId], origin: &Origin) {
        let block = self.variable_of(variables[0]);
        let (start, count) = (block.first, block.count as usize);
        let mut sorted: Vec<u32> = variables.iter().map(|v| v.0).collect();
        sorted.sort_unstable();
        sorted.dedup();
        let is_whole = sorted.len() == count && sorted[0] == start.0 && sorted[count - 1] == start.0 + count as u32 - 1;
        let pieces: Vec<(VarId, usize)> = match is_whole {
            true => vec![(start, count)],
            false => variables.iter().map(|&v| (v, 1)).collect(),
        };
        let mut operands = Vec::with_capacity(2 * variables.len());
        for (of, count) in pieces {
            if self.rate_of(of).is_some() {
                continue;
            }
            let (block, element) = self.locate(of);
            let first = VarId(self.scalars());
            let made = derivative_block(self.variable(block), (element, count), 1, first);
            self.add_variables(made);
            for k in 0..count as u32 {
                let (rate, v) = (VarId(first.0 + k), VarId(of.0 + k));
                operands.push([Operand::new(Target::Var(rate)), Operand::new(Target::Der(v))]);
                self.tables().notes.rates.insert(v, rate);
            }
        }
        let arena = &mut self.model.templates.arena;
        let (left, right) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
        let (template, order) = self.template(left, right);
        let count = operands.len() as u32;
        let operands = operands.iter().flat_map(|own| order.iter().map(|slot| own[slot.0 as usize])).collect();
        let (section, origin) = (Section::Continuous, origin.clone());
        self.tables().equations.push(EquationBlock { section, made: true, template, count, operands, origin });
    }
}

#[cfg(test)]
mod tests {
    use super::rate_unit;

    #[test]
    fn units_of_rates_are_legal_unit_strings() {
        let pairs =
            [("m", "m/s"), ("m/s", "m/s2"), ("kg/m3", "kg/(m3.s)"), ("J/(kg.K)", "J/(kg.K.s)"), ("", ""), ("1", "1/s")];
        for (unit, rate) in pairs {
            assert_eq!(rate_unit(unit), rate);
        }
    }
}
