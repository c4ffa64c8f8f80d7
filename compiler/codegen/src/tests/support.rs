//! Sorted systems built by hand, with derivatives from symbolic gradients, so that code is tested without a front end.
#![allow(dead_code, clippy::unwrap_used)]

use std::sync::Arc;

use hyd_equations::jacobian::PlanJacobian;
use hyd_equations::{
    Assignment, Check, EqId, Equation, EquationSystem, EventRelation, OperandRange, Plan, Residual, Resolution, Role,
    SortedSystem, Trigger, Unknown,
};
use hyd_flat::{
    ConstId, EquationBlock, FlatModel, Message, Operand, PerElement, Section, StateSelect, Target, VarId, VariableBlock,
};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{FileId, Files, Origin, Span};
use hyd_symbolic::{Arena, Function, NodeId, Relation, SlotId, Template, gradient};
use hyd_system::{CheckKind, NamePattern, Settable, ValueKind, Variability};

use crate::{CompiledModel, Instance, Jacobians, Options, generate};

pub(crate) struct Maker {
    pub sorted: SortedSystem,
    pub files: Files,
    text: String,
}

/// Grows one expression; each target it reads gets a slot.
pub(crate) struct Expression<'a> {
    pub arena: &'a mut Arena,
    constants: &'a mut IndexVec<ConstId, f64>,
    operands: Vec<Operand>,
}

impl Expression<'_> {
    pub(crate) fn read(&mut self, operand: Operand) -> NodeId {
        let slot = SlotId::new(self.operands.len());
        self.operands.push(operand);
        self.arena.slot(slot)
    }
    pub(crate) fn var(&mut self, v: VarId) -> NodeId {
        self.read(Operand::new(Target::Var(v)))
    }
    pub(crate) fn minus(&mut self, v: VarId) -> NodeId {
        self.read(Operand::new(Target::Var(v)).negate())
    }
    pub(crate) fn der(&mut self, v: VarId) -> NodeId {
        self.read(Operand::new(Target::Der(v)))
    }
    pub(crate) fn pre(&mut self, v: VarId) -> NodeId {
        self.read(Operand::new(Target::Pre(v)))
    }
    pub(crate) fn start(&mut self, v: VarId) -> NodeId {
        self.read(Operand::new(Target::Start(v)))
    }
    pub(crate) fn held(&mut self, r: u32) -> NodeId {
        self.read(Operand::new(Target::Held(r)))
    }
    /// A number in a slot.
    pub(crate) fn number(&mut self, value: f64) -> NodeId {
        let c = self.constants.push(value);
        self.read(Operand::new(Target::Const(c)))
    }
    pub(crate) fn c(&mut self, value: f64) -> NodeId {
        self.arena.constant(value)
    }
    pub(crate) fn add(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.arena.add(a, b)
    }
    pub(crate) fn sub(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.arena.sub(a, b)
    }
    pub(crate) fn mul(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.arena.mul(a, b)
    }
    pub(crate) fn div(&mut self, a: NodeId, b: NodeId) -> NodeId {
        self.arena.div(a, b)
    }
    pub(crate) fn call(&mut self, function: Function, a: NodeId) -> NodeId {
        self.arena.call1(function, a)
    }
    pub(crate) fn compare(&mut self, relation: Relation, a: NodeId, b: NodeId) -> NodeId {
        self.arena.compare(relation, a, b)
    }
    pub(crate) fn time(&mut self) -> NodeId {
        self.arena.intern(hyd_symbolic::Node::Time)
    }
}

type Made = (NodeId, OperandRange, EqId);

impl Maker {
    pub(crate) fn new() -> Self {
        let flat = FlatModel { name: "Test".into(), ..FlatModel::default() };
        let system = EquationSystem {
            flat,
            roles: IndexVec::new(),
            resolution: IndexVec::new(),
            operands: Vec::new(),
            equations: IndexVec::new(),
            reduction: hyd_equations::Reduction::default(),
            fixed_by_others: Vec::new(),
        };
        let sorted = SortedSystem {
            late_starts: Vec::new(),
            system,
            bindings: Vec::new(),
            starts: Vec::new(),
            simulation: Plan::default(),
            initial: Plan::default(),
            discrete: Vec::new(),
            reinits: Vec::new(),
            checks: Vec::new(),
            relations: Vec::new(),
            selections: Vec::new(),
            pivots: Vec::new(),
            redundant: Vec::new(),
        };
        Self { sorted, files: Files::new(), text: String::new() }
    }

    /// An array of variables.
    pub(crate) fn array(&mut self, name: &str, count: u32, role: Role) -> Vec<VarId> {
        let flat = &mut self.sorted.system.flat;
        let first = VarId(flat.scalars);
        flat.scalars += count;
        let dims = if count == 1 { Vec::new() } else { vec![count] };
        let name = NamePattern { parts: vec![(name.into(), dims)], derivative: false };
        let (variability, kind) = match role {
            Role::Parameter => (Variability::Parameter, ValueKind::Real),
            Role::Constant => (Variability::Constant, ValueKind::Real),
            Role::Discrete => (Variability::Discrete, ValueKind::Real),
            _ => (Variability::Continuous, ValueKind::Real),
        };
        flat.variables.push(VariableBlock {
            name,
            first,
            count,
            kind,
            declared: None,
            variability,
            unit: Some("m".into()),
            element_units: Vec::new(),
            display_unit: None,
            description: None,
            settable: if role == Role::Parameter { Settable::Yes } else { Settable::No },
            protected: false,
            made: None,
            has_start: false,
            fixed: PerElement::All(false),
            min: PerElement::All(f64::NEG_INFINITY),
            max: PerElement::All(f64::INFINITY),
            limit_spans: [None, None],
            at_any_time: false,
            nominal: PerElement::All(Some(10.0)),
            state_select: PerElement::All(StateSelect::Default),
            origin: Origin { path: "".into(), span: Span::new(FileId(0), 0, 0) },
        });
        for _ in 0..count {
            self.sorted.system.roles.push(role);
            self.sorted.system.resolution.push(Resolution::Own);
        }
        (0..count).map(|k| VarId(first.0 + k)).collect()
    }

    pub(crate) fn scalar(&mut self, name: &str, role: Role) -> VarId {
        self.array(name, 1, role)[0]
    }

    pub(crate) fn expression(&mut self, text: &str, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) -> Made {
        let system = &mut self.sorted.system;
        let flat = &mut system.flat;
        let mut expression =
            Expression { arena: &mut flat.templates.arena, constants: &mut flat.constants, operands: Vec::new() };
        let value = grow(&mut expression);
        let operands = expression.operands;
        let zero = flat.templates.arena.constant(0.0);
        let template = flat.templates.intern(Template { left: value, right: zero, arity: operands.len() as u32 });
        let range = OperandRange { first: system.operands.len() as u32, len: operands.len() as u32 };
        system.operands.extend(&operands);
        let start = self.text.len();
        self.text.push_str(text);
        let span = Span::new(FileId(0), start, self.text.len());
        self.text.push('\n');
        let block = flat.equations.len() as u32;
        flat.equations.push(EquationBlock {
            section: Section::Continuous,
            made: false,
            template,
            count: 1,
            operands,
            origin: Origin { path: "part".into(), span },
        });
        let equation = system.equations.push(Equation { template, operands: range, block, element: 0, order: 0 });
        (value, range, equation)
    }

    pub(crate) fn assignment(
        &mut self,
        target: Target,
        level: u32,
        text: &str,
        grow: impl FnOnce(&mut Expression<'_>) -> NodeId,
    ) -> Assignment {
        let (value, operands, equation) = self.expression(text, grow);
        Assignment { target, value, operands, equation, level }
    }

    pub(crate) fn bind(&mut self, v: VarId, level: u32, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) {
        let assignment = self.assignment(Target::Var(v), level, "binding", grow);
        self.sorted.bindings.push(assignment);
    }

    pub(crate) fn start(&mut self, v: VarId, value: f64) {
        let assignment = self.assignment(Target::Start(v), 0, "start", |e| e.number(value));
        self.sorted.starts.push(assignment);
    }

    pub(crate) fn assign(
        &mut self,
        v: VarId,
        level: u32,
        text: &str,
        grow: impl FnOnce(&mut Expression<'_>) -> NodeId,
    ) {
        let assignment = self.assignment(Target::Var(v), level, text, grow);
        self.sorted.simulation.assignments.push(assignment);
    }

    pub(crate) fn discrete(&mut self, v: VarId, level: u32, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) {
        let assignment = self.assignment(Target::Var(v), level, "discrete", grow);
        self.sorted.discrete.push(assignment);
    }

    pub(crate) fn reinit(&mut self, v: VarId, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) {
        let assignment = self.assignment(Target::Var(v), 0, "reinit", grow);
        self.sorted.reinits.push(assignment);
    }

    /// An unknown with its residual; they form a block.
    pub(crate) fn solve(
        &mut self,
        v: VarId,
        differential: bool,
        text: &str,
        grow: impl FnOnce(&mut Expression<'_>) -> NodeId,
    ) {
        let (value, operands, equation) = self.expression(text, grow);
        let plan = &mut self.sorted.simulation;
        let k = plan.unknowns.len() as u32;
        plan.unknowns.push(Unknown { target: Target::Var(v), differential });
        plan.residuals.push(Residual { value, operands, equation });
        plan.blocks.push([0..0, k..k + 1, k..k + 1]);
    }

    pub(crate) fn solve_initially(&mut self, target: Target, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) {
        let (value, operands, equation) = self.expression("initial", grow);
        let plan = &mut self.sorted.initial;
        plan.unknowns.push(Unknown { target, differential: false });
        plan.residuals.push(Residual { value, operands, equation });
    }

    pub(crate) fn assign_initially(
        &mut self,
        target: Target,
        level: u32,
        grow: impl FnOnce(&mut Expression<'_>) -> NodeId,
    ) {
        let assignment = self.assignment(target, level, "initial assignment", grow);
        self.sorted.initial.assignments.push(assignment);
    }

    /// `left - right > 0` (or `>=`) as a relation; `instant` for one in time.
    pub(crate) fn relation(
        &mut self,
        relation: Relation,
        grow: impl FnOnce(&mut Expression<'_>) -> (NodeId, NodeId, Option<NodeId>),
    ) -> u32 {
        let (mut root, mut timed) = (None, None);
        let (truth, operands, equation) = self.expression("relation", |e| {
            let (a, b, at) = grow(e);
            let upward = matches!(relation, Relation::Greater | Relation::GreaterEqual);
            root = Some(if upward { e.sub(a, b) } else { e.sub(b, a) });
            let at_equality = matches!(relation, Relation::GreaterEqual | Relation::LessEqual);
            timed = at.map(|instant| Trigger::Time { instant, rises: upward, right_after: at_equality != upward });
            e.compare(relation, a, b)
        });
        let trigger = timed.unwrap_or(Trigger::State);
        self.sorted.relations.push(EventRelation { truth, root: root.unwrap(), operands, trigger, equation });
        self.sorted.relations.len() as u32 - 1
    }

    pub(crate) fn check(&mut self, text: &str, kind: CheckKind, grow: impl FnOnce(&mut Expression<'_>) -> NodeId) {
        let (value, operands, equation) = self.expression("check", grow);
        let message = self.sorted.system.flat.messages.len() as u32;
        self.sorted.system.flat.messages.push(Message { text: text.into(), parts: Vec::new(), error: true });
        let condition = Residual { value, operands, equation };
        self.sorted.checks.push(Check { condition, message, kind });
    }

    /// Compiles what was made.
    pub(crate) fn compile(&mut self, options: &Options) -> Instance {
        self.model(options).unwrap().instantiate()
    }

    /// The model of what was made, or why there is none.
    pub(crate) fn model(&mut self, options: &Options) -> Result<CompiledModel, hyd_source::Diagnostic> {
        let files = self.files();
        let simulation = derivatives(&mut self.sorted, false);
        let initial = derivatives(&mut self.sorted, true);
        let jacobians = Jacobians { simulation: &simulation, initial: &initial };
        generate(&self.sorted, jacobians, &files, options)
    }

    fn files(&self) -> Files {
        let mut files = Files::new();
        files.add("test.hyd", Arc::<str>::from(self.text.as_str()));
        files
    }
}

/// Partials and supports of a plan, by the definition.
pub(crate) fn derivatives(sorted: &mut SortedSystem, initial: bool) -> PlanJacobian {
    let plan = if initial { sorted.initial.clone() } else { sorted.simulation.clone() };
    let n = plan.unknowns.len() as u32;
    let mut forms: Vec<NodeId> = Vec::new();
    let mut jacobian = PlanJacobian::default();
    let rows: Vec<(NodeId, OperandRange)> = plan
        .assignments
        .iter()
        .map(|a| (a.value, a.operands))
        .chain(plan.residuals.iter().map(|r| (r.value, r.operands)))
        .collect();
    let mut supports: Vec<Vec<u32>> = Vec::new();
    for &(value, operands) in &rows {
        let form = forms.iter().position(|&f| f == value).unwrap_or_else(|| {
            forms.push(value);
            let arena = &mut sorted.system.flat.templates.arena;
            let mut list = gradient(arena, value);
            list.retain(|&(_, node)| !arena.is(node, 0.0));
            list.sort_by_key(|&(slot, _)| slot);
            jacobian.forms.push_row(list);
            forms.len() - 1
        });
        jacobian.form_of_row.push(form as u32);
        let mut support: Vec<u32> = Vec::new();
        for &(slot, _) in jacobian.forms.row(form) {
            let target = sorted.system.operands_of(operands)[slot.index()].target();
            if let Some(k) = plan.unknowns.iter().position(|u| u.target == target) {
                support.push(k as u32);
            }
            if let (Target::Der(v), false) = (target, initial)
                && let Some(k) = plan.unknowns.iter().position(|u| u.target == Target::Var(v))
            {
                support.push(n + k as u32);
            }
            if let Some(a) = plan.assignments.iter().position(|a| a.target == target) {
                support.extend(&supports[a]);
            }
        }
        support.sort_unstable();
        support.dedup();
        supports.push(support.clone());
        jacobian.support.push_row(support);
    }
    for (r, support) in supports[plan.assignments.len()..].iter().enumerate() {
        for &c in support {
            let r = r as u32;
            if c < n { jacobian.state_pattern.push((r, c)) } else { jacobian.rate_pattern.push((r, c - n)) }
        }
    }
    jacobian
}
