//! Flat model to equation system: every scalar variable gets a role, every scalar equation its own entry.
//!
//! A variable is a state if its derivative occurs anywhere, discrete if it is declared so or is not a real number
//! (Modelica 3.6, section 3.8.4), otherwise algebraic; parameters and constants follow from the declaration.  Equations
//! keep the order of the text; an entry is a template and a range of operands, so memory is a few words each.  Nothing
//! is eliminated here.

use hyd_flat::{EquationBlock, FlatModel, Operand, Section, Target, VarId, VariableBlock};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{Node, SlotId, alias};
use hyd_system::{ValueKind, Variability};

use crate::system::{EqId, Equation, EquationSystem, OperandRange, Reduction, Resolution, Role};

/// The equation system of a flat model, all variables standing for themselves.
///
/// The section of an equation says how it was written; here it is corrected by what it determines: an equation of Real
/// type among discrete variables holds at events, one that only hands a discrete value to a continuous variable at all
/// times.
pub fn assign_roles(mut flat: FlatModel) -> EquationSystem {
    let roles = roles(&flat);
    for block in 0..flat.equations.len() {
        flat.equations[block].section = effective_section(&flat, &roles, &flat.equations[block]);
    }
    let mut operands = Vec::with_capacity(flat.equations.iter().map(|b| b.operands.len()).sum());
    let mut equations = IndexVec::new();
    for (number, block) in flat.equations.iter().enumerate() {
        let arity = flat.templates.get(block.template).arity;
        for element in 0..block.count {
            let first = operands.len() as u32 + element * arity;
            let operands = OperandRange { first, len: arity };
            equations.push(Equation { template: block.template, operands, block: number as u32, element, order: 0 });
        }
        operands.extend_from_slice(&block.operands);
    }
    let resolution = IndexVec::filled(Resolution::Own, roles.len());
    let (reduction, fixed_by_others) = (Reduction::default(), Vec::new());
    EquationSystem { flat, roles, resolution, operands, equations, reduction, fixed_by_others }
}

fn roles(flat: &FlatModel) -> IndexVec<VarId, Role> {
    let mut roles = IndexVec::filled(Role::Algebraic, flat.scalars as usize);
    for block in flat.variables.iter() {
        for k in 0..block.count {
            roles[VarId(block.first.0 + k)] = declared_role(block);
        }
    }
    for operand in flat.equations.iter().flat_map(|block| &block.operands) {
        if let Target::Der(v) = operand.target()
            && roles[v] == Role::Algebraic
        {
            roles[v] = Role::State;
        }
    }
    roles
}

fn declared_role(block: &VariableBlock) -> Role {
    match block.variability {
        Variability::Constant => Role::Constant,
        Variability::Parameter => Role::Parameter,
        Variability::Discrete => Role::Discrete,
        Variability::Continuous if block.kind != ValueKind::Real && !block.at_any_time => Role::Discrete,
        Variability::Continuous => Role::Algebraic,
    }
}

fn effective_section(flat: &FlatModel, roles: &IndexVec<VarId, Role>, block: &EquationBlock) -> Section {
    let role = |operand: &Operand| match operand.target() {
        Target::Var(v) => Some(roles[v]),
        Target::Der(_) => Some(Role::State),
        _ => None,
    };
    let is_continuous = |operand| matches!(role(operand), Some(Role::State | Role::Algebraic));
    let is_discrete = |operand| role(operand) == Some(Role::Discrete);
    let arity = flat.templates.get(block.template).arity as usize;
    if arity == 0 {
        return block.section;
    }
    let mut equations = block.operands.chunks(arity);
    match block.section {
        Section::Continuous if equations.all(|o| !o.iter().any(is_continuous) && o.iter().any(is_discrete)) => {
            Section::Discrete
        }
        Section::Discrete
            if arity == 2 && alias(&flat.templates.arena, &flat.templates.get(block.template)).is_some() =>
        {
            let hands_on = equations.all(|o| o.iter().any(is_continuous) && o.iter().any(is_discrete));
            if hands_on { Section::Continuous } else { Section::Discrete }
        }
        section => section,
    }
}

impl EquationSystem {
    /// What an equation is for.
    pub fn section(&self, id: EqId) -> Section {
        self.flat.equations[self.equations[id].block as usize].section
    }

    /// The equations of a section, in order.
    pub fn equations_in(&self, section: Section) -> Vec<EqId> {
        self.equations.indices().filter(|&id| self.section(id) == section).collect()
    }

    /// The slot on the left side of an equation, if that is all that stands there.
    pub fn left_slot(&self, id: EqId) -> Option<SlotId> {
        let templates = &self.flat.templates;
        match templates.arena.node(templates.get(self.equations[id].template).left) {
            Node::Slot(slot) => Some(slot),
            _ => None,
        }
    }

    /// What that slot reads.
    pub fn left_operand(&self, id: EqId) -> Option<Operand> {
        self.left_slot(id).map(|slot| self.operands_of(self.equations[id].operands)[slot.index()])
    }

    /// True for an equation `value = delayed(source)`, which holds while the model runs but not at the start.
    pub fn is_delay(&self, id: EqId) -> bool {
        let equation = self.equations[id];
        let reads = self.operands_of(equation.operands);
        equation.order == 0 && reads.iter().any(|operand| matches!(operand.target(), Target::Delayed(_)))
    }

    /// Variables that stand for themselves.
    pub fn is_own(&self, v: VarId) -> bool {
        self.resolution[v] == Resolution::Own
    }

    /// True for a continuous unknown of the simulation: a state, candidate or algebraic variable that stands for itself.
    pub fn is_continuous(&self, v: VarId) -> bool {
        self.is_own(v) && self.roles[v].is_continuous()
    }
}
