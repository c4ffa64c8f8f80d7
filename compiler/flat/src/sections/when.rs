//! `when` equations: conditions become discrete Booleans, assignments become equations that hold at events.
//!
//! `when c then v = e; end when` is `b = c; v = if b and not pre(b) and not initial() then e else pre(v)`; `elsewhen`
//! branches fire only if none before does (Modelica 3.6, section 8.3.5).  At the start only conditions that name
//! `initial()` fire.

use hyd_instance::Scope;
use hyd_source::{Code, Origin};
use hyd_typed::{Equation, Expr};

use crate::model::{Section, VarId};
use crate::sections::loops::Loops;
use crate::sections::when_condition::{WhenCondition, is_clock, parts_of};
use crate::state::flattener::Flattener;

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
}
