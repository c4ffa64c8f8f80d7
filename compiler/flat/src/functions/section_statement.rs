//! What statements of an algorithm section do to the variables of the model.

use std::rc::Rc;

use hyd_source::{Code, Origin, Span};
use hyd_system::Variability;
use hyd_typed::{Expr, Statement};

use crate::functions::draw::AtEvent;
use crate::model::Section;
use crate::sections::when_condition::{StatementCondition, WhenCondition, parts_of};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// `when` in an algorithm: the branch that fires runs, else all stays as it was.
    pub(crate) fn run_when(
        &mut self,
        span: Span,
        branches: &[(Expr, Vec<Statement>)],
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let mut conditions = Vec::new();
        for (condition, _) in branches {
            match cx.whens.iter().find(|found| found.span == condition.span).cloned() {
                Some(found) => {
                    self.decide(condition, &found, cx)?;
                    conditions.push(found.conditions);
                }
                None => {
                    let message = "`when` is allowed only at the top of an algorithm section of a model";
                    return Err(self.error(Code::Misplaced, span, message));
                }
            }
        }
        let fires = self.fires(&conditions, cx)?;
        let before = cx.in_when;
        for (k, (condition, body)) in branches.iter().enumerate() {
            let mut yes = cx.clone();
            yes.in_when = true;
            let arena = &mut self.model.templates.arena;
            yes.holds = Some(cx.holds.map_or(fires[k], |holds| arena.and(holds, fires[k])));
            yes.event = Some(AtEvent::new(fires[k], cx));
            self.run(body, &mut yes)?;
            let no = cx.clone();
            self.join_contexts(condition.span, fires[k], yes, no, cx)?;
        }
        cx.in_when = before;
        Ok(())
    }

    /// The values of the conditions of a branch here: what was assigned above has its new value, other discrete variables of the section have the
    /// one before the event.
    fn decide(&mut self, condition: &Expr, found: &StatementCondition, cx: &mut Context) -> Result<(), Fail> {
        let targets = cx.algorithm_targets.iter().copied();
        let discrete = targets.filter(|&v| self.variable_of(v).variability == Variability::Discrete).collect();
        // Continuous variables are read as they are, also above their assignment: their values from before mean nothing there.
        let mut here = Context { algorithm_targets: Rc::new(discrete), ..cx.clone() };
        let parts = parts_of(condition);
        for (variable, source) in found.conditions.iter().zip(&found.sources) {
            if let WhenCondition::Variable(first) = variable {
                let part = parts[source.part];
                let (left, right) = self.condition_sides((part, source.element), *first, &mut here)?;
                cx.decided.push((left, right, part.span));
            }
        }
        Ok(())
    }

    /// `reinit(state, value)` in a `when` of an algorithm.
    pub(crate) fn run_reinit(&mut self, span: Span, state: &Expr, value: &Expr, cx: &mut Context) -> Result<(), Fail> {
        if self.is_no_state(state) {
            return Err(Fail::Reported);
        }
        let shape = self.shape(state, cx)?;
        let acts = cx.holds.unwrap_or_else(|| self.model.templates.arena.constant(1.0));
        let origin = Origin { path: self.path(cx.scope.inst), span };
        let scalar = self.shape(value, cx)?.is_empty();
        for at in crate::sections::if_equation::positions(&shape) {
            let target = self.lower(state, cx, &at)?;
            let new = self.lower(value, cx, if scalar { &[] } else { &at })?;
            self.want_number(value.span, "`reinit`", &new)?;
            let right = self.model.templates.arena.select(acts, new.node, target.node);
            self.emit(Section::Reinit, target.node, right, &cx.loop_counts(), &origin);
        }
        Ok(())
    }
}
