//! Conditions of `when` as discrete Booleans, and when a branch fires.

use hyd_instance::{Builtin, ScalarType, Scope};
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::Variability;
use hyd_typed::{Base, Expr, Kind as Form};

use crate::model::VarId;
use crate::sections::loops::Loops;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};

/// One condition of a branch.
#[derive(Clone, Debug)]
pub(crate) enum WhenCondition {
    /// `initial()`
    Initial,
    /// A discrete Boolean, one per element of the loops.
    Variable(VarId),
}

/// The conditions of a branch of a `when` statement.
#[derive(Clone, Debug)]
pub(crate) struct StatementCondition {
    /// Where the branch says them.
    pub span: Span,
    /// The variables that hold them.
    pub conditions: Vec<WhenCondition>,
    /// Where their values come from.
    pub sources: Vec<Source>,
}

/// Where the value of a condition comes from: one of several in braces, an element of a vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source {
    pub part: usize,
    pub element: Option<usize>,
}

/// The parts of a condition.
pub(crate) fn parts_of(expr: &Expr) -> Vec<&Expr> {
    match &expr.kind {
        Form::Array(items) => items.iter().collect(),
        _ => vec![expr],
    }
}

/// True for a condition that is a clock.
pub(super) fn is_clock(condition: &Expr) -> bool {
    condition.ty.base == Base::Scalar(ScalarType::Clock)
}

impl Flattener<'_, '_> {
    /// The variables of the conditions of one branch; what they are equal to is the matter of who asks for them.
    pub(crate) fn condition_variables(
        &mut self,
        expr: &Expr,
        number: u32,
        branch: usize,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<StatementCondition> {
        let (mut conditions, mut sources) = (Vec::new(), Vec::new());
        for (part, expr) in parts_of(expr).into_iter().enumerate() {
            if is_clock(expr) {
                let message = "clocks in algorithm sections are outside the language profile";
                let _ = self.error(Code::OutsideProfile, expr.span, message);
                return None;
            }
            if matches!(expr.kind, Form::Builtin(Builtin::Initial, _)) {
                conditions.push(WhenCondition::Initial);
                sources.push(Source { part, element: None });
                continue;
            }
            let elements = match self.size_of_condition(expr, scope, loops) {
                Some(size) => (0..size).map(Some).collect(),
                None => vec![None],
            };
            for element in elements {
                let name = format!("$when{number}.{}.{}", branch + 1, conditions.len() + 1);
                conditions.push(WhenCondition::Variable(self.condition_variable(expr, name, scope, loops)?));
                sources.push(Source { part, element });
            }
        }
        Some(StatementCondition { span: expr.span, conditions, sources })
    }

    /// The size of a condition that is a vector.
    fn size_of_condition(&mut self, expr: &Expr, scope: Scope, loops: &Loops<'_>) -> Option<usize> {
        if expr.ty.rank == 0 {
            return None;
        }
        let slots = std::mem::take(&mut self.slots);
        let mut probe = self.context_of(scope);
        let shape = self.quietly(|flat| flat.enter_all(&mut probe, loops).and_then(|()| flat.shape(expr, &mut probe)));
        self.slots = slots;
        match shape.as_deref() {
            Ok([size]) => Some(*size),
            _ => None,
        }
    }

    /// The variable of a condition, one per element of the loops around.
    fn condition_variable(&mut self, expr: &Expr, name: String, scope: Scope, loops: &Loops<'_>) -> Option<VarId> {
        let origin = Origin { path: self.path(scope.inst), span: expr.span };
        let mut probe = self.context_of(scope);
        // The loops decide how many conditions there are; their sizes do not depend on counters.
        let sizes = match self.enter_all(&mut probe, loops) {
            Ok(()) => probe.counts.clone(),
            Err(_) => {
                let message =
                    "the loops around a `when` must have ranges that are known and do not depend on each other";
                let _ = self.error(Code::NotStructural, expr.span, message);
                return None;
            }
        };
        Some(self.made_boolean(name, &sizes, origin))
    }

    /// The variable of a condition and its value.
    pub(crate) fn condition_sides(
        &mut self,
        (expr, element): (&Expr, Option<usize>),
        first: VarId,
        cx: &mut Context,
    ) -> Result<(NodeId, NodeId), Fail> {
        let index: Vec<Affine> = element.iter().map(|&k| Affine::constant(k as i64)).collect();
        let value = self.lower(expr, cx, &index)?;
        self.want_boolean(expr.span, "the condition of a `when`", &value)?;
        Ok((self.condition_slot(first, cx, Kind::Var)?, value.node))
    }

    pub(crate) fn condition_slot(&mut self, first: VarId, cx: &Context, kind: Kind) -> Result<NodeId, Fail> {
        let mut offset = Affine::constant(0);
        for (k, &size) in cx.counts.iter().enumerate() {
            let at = match &cx.fixed {
                Some(values) if k < values.len() => Affine::constant(values[k]),
                _ => Affine::counter(crate::state::index::CounterId(k as u32)),
            };
            offset = crate::state::flattener::scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
        }
        let slot = self.slots.slot(SlotKey::Variable(kind, first, offset));
        Ok(self.model.templates.arena.slot(slot))
    }

    /// When each branch fires.
    pub(crate) fn fires(&mut self, conditions: &[Vec<WhenCondition>], cx: &Context) -> Result<Vec<NodeId>, Fail> {
        let mut result: Vec<NodeId> = Vec::new();
        let mut earlier: Option<NodeId> = None;
        for branch in conditions {
            let mut own: Option<NodeId> = None;
            for condition in branch {
                let edge = match condition {
                    WhenCondition::Initial => self.model.templates.arena.intern(Node::Initial),
                    WhenCondition::Variable(first) => {
                        let now = self.condition_slot(*first, cx, Kind::Var)?;
                        let before = self.condition_slot(*first, cx, Kind::Pre)?;
                        let arena = &mut self.model.templates.arena;
                        let off = arena.not(before);
                        let rises = arena.and(now, off);
                        let initial = arena.intern(Node::Initial);
                        let running = arena.not(initial);
                        arena.and(rises, running)
                    }
                };
                let arena = &mut self.model.templates.arena;
                own = Some(own.map_or(edge, |o| arena.or(o, edge)));
            }
            let arena = &mut self.model.templates.arena;
            let own = own.unwrap_or_else(|| arena.constant(0.0));
            let fires = match earlier {
                None => own,
                Some(before) => {
                    let none = arena.not(before);
                    arena.and(own, none)
                }
            };
            earlier = Some(earlier.map_or(own, |e| arena.or(e, own)));
            result.push(fires);
        }
        Ok(result)
    }

    /// A Real variable set inside `when` changes at events only.
    pub(crate) fn make_discrete(&mut self, inst: hyd_instance::InstId) {
        if let Some(&block) = self.blocks.get(&inst)
            && self.model.variables[block].variability == hyd_system::Variability::Continuous
        {
            self.model.variables[block].variability = hyd_system::Variability::Discrete;
            self.scopes.found.variability.insert(inst, Variability::Discrete);
        }
    }

    /// The number of a `when` of the text.
    pub(crate) fn next_when(&mut self) -> u32 {
        self.tables().notes.whens += 1;
        self.all_notes().map(|notes| notes.whens).sum()
    }

    /// Reports a `reinit` of what cannot be a state.
    pub(crate) fn is_no_state(&mut self, state: &Expr) -> bool {
        let Some(variable) = state.variable() else { return false };
        let (variability, declared) =
            (self.scopes.variability(variable.last()), self.scopes.instances[variable.last()].span);
        if variability == Variability::Continuous {
            return false;
        }
        let parameter = variability <= Variability::Parameter;
        let why = if parameter { "is constant" } else { "has no derivative" };
        let message = format!("`reinit` needs a state, but `{}` {why}", printed(state));
        self.report(Diagnostic::error(Code::Misplaced, message).at(state.span, "").with(declared, "declared here"));
        true
    }
}

/// An expression as it is written.
pub(crate) fn printed(expr: &Expr) -> String {
    hyd_syntax::print_expr(&expr.written())
}
