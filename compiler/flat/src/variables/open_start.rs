//! Start values that are given from outside, for those who carry the model into other tools.
//!
//! A start value that is a number and holds (`fixed = true`) becomes a parameter, `x.start`, that the start value follows, so that it can be
//! set on the translated model as any parameter.  One that follows from parameters is set by these.

use hyd_instance::InstId;
use hyd_instance::modifier::Applied;
use hyd_system::{Settable, ValueKind, Variability};
use hyd_typed::{Expr, Kind as Form};

use crate::model::{PerElement, Section, StateSelect, VarId, VariableBlock};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, CounterId, Kind, SlotKey};

impl Flattener<'_, '_> {
    /// Whether the start value of a variable is to be a parameter.
    pub(crate) fn is_open_start(&self, inst: InstId, start: &Expr) -> bool {
        let block = &self.model.variables[self.blocks[&inst]];
        let holds = block.variability == Variability::Continuous && block.fixed == PerElement::All(true);
        let is_real = block.kind == ValueKind::Real && block.count > 0;
        holds && is_real && self.is_for_other_tools() && is_number(start)
    }

    /// The parameter, its value, and the start value that follows it.
    pub(crate) fn open_start(&mut self, inst: InstId, applied: &Applied, start: &Expr) {
        let block = &self.model.variables[self.blocks[&inst]];
        let (variable, count, origin) = (block.first, block.count, block.origin.clone());
        let mut name = block.name.clone();
        match name.parts.last_mut() {
            Some((text, sizes)) if sizes.is_empty() => *text = format!("{text}.start").into(),
            _ => name.parts.push((".start".into(), Vec::new())),
        }
        let parameter = VariableBlock {
            name,
            first: VarId(self.scalars()),
            variability: Variability::Parameter,
            description: None,
            settable: Settable::Yes,
            protected: true,
            has_start: false,
            state_select: PerElement::All(StateSelect::Default),
            ..block.clone()
        };
        let first = parameter.first;
        let parameter = self.add_variables(parameter);
        self.equation_of_block(parameter, (inst, applied), start, (Section::Binding, Kind::Var), false);
        self.begin_slots();
        let mut slot = |kind: Kind, first: VarId| {
            let slot = self.slots.slot(SlotKey::Variable(kind, first, Affine::counter(CounterId(0))));
            self.model.templates.arena.slot(slot)
        };
        let (left, right) = (slot(Kind::Start, variable), slot(Kind::Var, first));
        self.emit(Section::Start, left, right, &[count as usize], &origin);
    }
}

/// A number, or numbers in braces.
fn is_number(expr: &Expr) -> bool {
    match &expr.kind {
        Form::Integer(_) | Form::Real(_) => true,
        Form::Unary(_, inner) => is_number(inner),
        Form::Array(items) => items.iter().all(is_number),
        _ => false,
    }
}
