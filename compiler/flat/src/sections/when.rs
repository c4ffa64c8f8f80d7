//! `when` equations: conditions become discrete Booleans, assignments become equations that hold at events.
//!
//! `when c then v = e; end when` is `b = c; v = if b and not pre(b) and not initial() then e else pre(v)`; `elsewhen`
//! branches fire only if none before does (Modelica 3.6, section 8.3.5).  At the start only conditions that name
//! `initial()` fire.

use hyd_instance::{Builtin, ScalarType, Scope};
use hyd_source::{Code, Origin};
use hyd_typed::{Base, Equation, Expr, Kind as Form};

use crate::model::{Section, VarId};
use crate::sections::loops::Loops;
use crate::sections::when_condition::WhenCondition;
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
            Form::Array(items) => items.iter().collect(),
            _ => vec![expr],
        };
        let mut result = Vec::new();
        for part in parts {
            if is_clock(part) {
                let message = "clocks in algorithm sections are outside the language profile";
                let _ = self.error(Code::OutsideProfile, part.span, message);
                return None;
            }
            if matches!(part.kind, Form::Builtin(Builtin::Initial, _)) {
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
        let before = self.scopes.table.messages.count();
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let index: Vec<Affine> = element.iter().map(|&k| Affine::constant(k as i64)).collect();
            let value = flat.lower(expr, cx, &index)?;
            flat.want_boolean(expr.span, "the condition of a `when`", &value)?;
            let left = flat.condition_slot(first, cx, Kind::Var)?;
            flat.emit(Section::Discrete, left, value.node, &cx.loop_counts(), &origin);
            Ok(())
        });
        (self.scopes.table.messages.count() == before).then_some(first)
    }
}
