//! `when` equations: conditions become discrete Booleans, assignments become equations that hold at events.
//!
//! `when c then v = e; end when` is `b = c; v = if b and not pre(b) and not initial() then e else pre(v)`; `elsewhen`
//! branches fire only if none before does (Modelica 3.6, section 8.3.5).  At the start only conditions that name
//! `initial()` fire.

use hyd_instance::{Builtin, ScalarType, Scope};
use hyd_source::{Code, Origin};
use hyd_symbolic::NodeId;
use hyd_typed::{Base, Equation, Expr, Kind as Form};

use crate::model::{Section, VarId};
use crate::sections::loops::Loops;
use crate::sections::when_condition::{Source, StatementCondition, WhenCondition, parts_of};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind};

fn is_clock(condition: &Expr) -> bool {
    condition.ty.base == Base::Scalar(ScalarType::Clock)
}

impl Flattener<'_, '_> {
    pub(crate) fn when(
        &mut self,
        equation: &Equation,
        branches: &[(Expr, Vec<Equation>)],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        if let Some((clock, body)) = branches.iter().find(|(condition, _)| is_clock(condition)) {
            match branches {
                [_] => self.clocked_when(clock, body, scope, loops),
                _ => {
                    let message = "a `when` of a clock has no `elsewhen`: each clock is a `when` of its own";
                    let _ = self.error(Code::Misplaced, equation.span, message);
                }
            }
            return;
        }
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

    /// `when clock then ...`: equations as outside, which hold at the ticks of the clock and have it (Modelica 3.6, section 16.6).
    fn clocked_when(&mut self, clock: &Expr, body: &[Equation], scope: Scope, loops: &Loops<'_>) {
        let mut made = None;
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let value = flat.lower(clock, cx, &[])?;
            let first = flat.clocked_source(clock.span, &value, cx)?;
            made = Some((first, cx.loop_counts().iter().product::<usize>() as u32));
            Ok(())
        });
        let Some(made) = made else { return };
        let before = self.clock_around.replace(made);
        if let (Some(_), Some(first)) = (before, body.first()) {
            let _ = self.error(Code::Misplaced, first.span, "`when` is not allowed inside `when`");
        }
        for equation in body {
            self.equation(equation, scope, loops, false);
        }
        self.clock_around = before;
    }

    /// The conditions of one branch as discrete Booleans (`{a, b}`, or a vector of two, gives two), with their equations.
    fn conditions(
        &mut self,
        expr: &Expr,
        number: u32,
        branch: usize,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<Vec<WhenCondition>> {
        let found = self.condition_variables(expr, number, branch, scope, loops)?;
        let parts = parts_of(expr);
        for (condition, source) in found.conditions.iter().zip(&found.sources) {
            if let WhenCondition::Variable(first) = condition
                && !self.condition_equation((parts[source.part], source.element), *first, scope, loops)
            {
                return None;
            }
        }
        Some(found.conditions)
    }

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

    /// `$when1.1.1 = condition`; false if the condition has no meaning, which has been said.
    fn condition_equation(
        &mut self,
        (expr, element): (&Expr, Option<usize>),
        first: VarId,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> bool {
        let origin = Origin { path: self.path(scope.inst), span: expr.span };
        let start = self.context_of(scope);
        let before = self.scopes.table.messages.count();
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let (left, right) = flat.condition_sides((expr, element), first, cx)?;
            flat.emit(Section::Discrete, left, right, &cx.loop_counts(), &origin);
            Ok(())
        });
        self.scopes.table.messages.count() == before
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
}
