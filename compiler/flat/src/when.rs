//! `when` equations: conditions become discrete Booleans, assignments become equations that hold at events.
//!
//! `when c then v = e; end when` is `b = c; v = if b and not pre(b) and not initial() then e else pre(v)`; `elsewhen`
//! branches fire only if none before does (Modelica 3.6, section 8.3.5).  At the start only conditions that name
//! `initial()` fire.

use hyd_instance::Scope;
use hyd_source::{Code, Origin};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::{ComponentRef, Equation, Expr, ExprKind, Variability};

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::model::{Section, VarId};
use crate::section::Loops;

/// One condition of a branch.
#[derive(Clone, Debug)]
pub(crate) enum WhenCondition {
    /// `initial()`
    Initial,
    /// A discrete Boolean, one per element of the loops.
    Variable(VarId),
}

impl Flattener<'_, '_> {
    pub(crate) fn when(
        &mut self,
        equation: &Equation,
        branches: &[(Expr, Vec<Equation>)],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        let number = self.next_when();
        let mut conditions: Vec<Vec<WhenCondition>> = Vec::new();
        for (k, (condition, _)) in branches.iter().enumerate() {
            match self.conditions(condition, number, k, scope, loops) {
                Some(found) => conditions.push(found),
                None => return,
            }
        }
        self.when_body(equation, branches, &conditions, scope, loops);
    }

    /// The conditions of one branch as discrete Booleans (`{a, b}`, or a vector of two, gives two).
    pub(crate) fn conditions(
        &mut self,
        expr: &Expr,
        number: u32,
        branch: usize,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<Vec<WhenCondition>> {
        let parts: Vec<&Expr> = match &expr.kind {
            ExprKind::Array(items) => items.iter().collect(),
            _ => vec![expr],
        };
        let mut result = Vec::new();
        for part in parts {
            if let ExprKind::Call(function, _) = &part.kind
                && function.parts.len() == 1
                && function.parts[0].name.name.as_ref() == "initial"
            {
                result.push(WhenCondition::Initial);
                continue;
            }
            let Some(size) = self.size_of_condition(part, scope, loops) else {
                result.push(WhenCondition::Variable(self.condition_variable(
                    (part, None),
                    number,
                    (branch, result.len()),
                    scope,
                    loops,
                )?));
                continue;
            };
            for element in 0..size {
                let place = (branch, result.len());
                let one = self.condition_variable((part, Some(element)), number, place, scope, loops)?;
                result.push(WhenCondition::Variable(one));
            }
        }
        Some(result)
    }

    /// The number of a `when` of the text.
    pub(crate) fn next_when(&mut self) -> u32 {
        self.tables().notes.whens += 1;
        self.all_notes().map(|notes| notes.whens).sum()
    }

    /// The size of a condition that is a vector.
    fn size_of_condition(&mut self, expr: &Expr, scope: Scope, loops: &Loops<'_>) -> Option<usize> {
        let slots = std::mem::take(&mut self.slots);
        let mut probe = self.context_of(scope);
        let shape = self.quietly(|flat| flat.enter_all(&mut probe, loops).and_then(|()| flat.shape(expr, &mut probe)));
        self.slots = slots;
        match shape.as_deref() {
            Ok([size]) => Some(*size),
            _ => None,
        }
    }

    /// `$when1.1.1 = condition`, one per element of the loops around.
    fn condition_variable(
        &mut self,
        (expr, element): (&Expr, Option<usize>),
        number: u32,
        part: (usize, usize),
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<VarId> {
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
        let name = format!("$when{number}.{}.{}", part.0 + 1, part.1 + 1);
        let first = self.made_boolean(name, &sizes, origin.clone());
        let start = self.context_of(scope);
        let before = self.tree.table.messages.count();
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let index: Vec<Affine> = element.iter().map(|&k| Affine::constant(k as i64)).collect();
            let value = flat.lower(expr, cx, &index)?;
            flat.want_boolean(expr.span, "the condition of a `when`", &value)?;
            let left = flat.condition_slot(first, cx, Kind::Var)?;
            flat.emit(Section::Discrete, left, value.node, &cx.loop_counts(), &origin);
            Ok(())
        });
        (self.tree.table.messages.count() == before).then_some(first)
    }

    fn condition_slot(&mut self, first: VarId, cx: &Context, kind: Kind) -> Result<NodeId, Fail> {
        let mut offset = Affine::constant(0);
        for (k, &size) in cx.counts.iter().enumerate() {
            let at = match &cx.fixed {
                Some(values) if k < values.len() => Affine::constant(values[k]),
                _ => Affine::counter(crate::index::CounterId(k as u32)),
            };
            offset = crate::flatten::scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
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
            self.tree.instances[inst].variability = Variability::Discrete;
        }
    }
}

pub(crate) fn print_ref(reference: &ComponentRef) -> String {
    hyd_syntax::print_expr(&Expr { kind: ExprKind::Ref(reference.clone()), span: reference.span })
}
