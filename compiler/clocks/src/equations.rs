//! Variables and equations that this stage adds.

use hyd_flat::{
    EquationBlock, FlatModel, Made, Operand, PerElement, Section, StateSelect, Target, VarId, VariableBlock,
};
use hyd_index::TypedIndex;
use hyd_source::Origin;
use hyd_symbolic::{NodeId, SlotId, canonical};
use hyd_system::{NamePattern, Settable, ValueKind, Variability};

/// A discrete variable of the translation's own.
pub(crate) fn variable(flat: &mut FlatModel, name: String, kind: ValueKind, origin: &Origin) -> VarId {
    let first = VarId(flat.scalars);
    flat.scalars += 1;
    flat.variables.push(VariableBlock {
        name: NamePattern::scalar(name),
        first,
        count: 1,
        kind,
        declared: None,
        variability: Variability::Discrete,
        unit: None,
        element_units: Vec::new(),
        display_unit: None,
        description: None,
        settable: Settable::No,
        protected: true,
        made: Some(Made::Clock),
        has_start: false,
        fixed: PerElement::All(false),
        min: PerElement::All(f64::NEG_INFINITY),
        max: PerElement::All(f64::INFINITY),
        limit_spans: [None, None],
        at_any_time: false,
        nominal: PerElement::All(None),
        state_select: PerElement::All(StateSelect::Default),
        origin: origin.clone(),
    });
    first
}

/// An expression in the making: what its slots read.
#[derive(Default)]
pub(crate) struct Slots(pub Vec<Operand>);

impl Slots {
    pub(crate) fn read(&mut self, flat: &mut FlatModel, target: Target) -> NodeId {
        self.0.push(Operand::new(target));
        flat.templates.arena.slot(SlotId::new(self.0.len() - 1))
    }

    /// Adds `left = right`.
    pub(crate) fn define(
        mut self,
        flat: &mut FlatModel,
        section: Section,
        left: Target,
        right: NodeId,
        origin: &Origin,
    ) {
        let left = self.read(flat, left);
        let (template, order) = canonical(&mut flat.templates.arena, left, right);
        let template = flat.templates.intern(template);
        let operands = order.iter().map(|slot| self.0[slot.index()]).collect();
        let origin = origin.clone();
        flat.equations.push(EquationBlock { section, made: true, template, count: 1, operands, origin });
    }

    /// Adds `v = if tick then value else pre(v)`.
    pub(crate) fn at_tick(mut self, flat: &mut FlatModel, (v, tick): (VarId, VarId), value: NodeId, origin: &Origin) {
        let tick = self.read(flat, Target::Var(tick));
        let before = self.read(flat, Target::Pre(v));
        let value = flat.templates.arena.select(tick, value, before);
        self.define(flat, Section::Discrete, Target::Var(v), value, origin);
    }
}
