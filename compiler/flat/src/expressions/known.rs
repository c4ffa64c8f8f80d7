//! Whether an expression has its value before the run.

use hyd_instance::InstId;
use hyd_syntax::tree::Variability;
use hyd_typed::{Expr, any_variable, reads_run};

use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// True if an expression is made of constants and parameters; the start may still have to find one of them.
    pub(crate) fn made_of_parameters(&mut self, expr: &Expr) -> bool {
        !self.reads(expr, &mut |_, _| false)
    }

    /// True if an expression is made of constants and of parameters that have their values before the run.
    pub(crate) fn known_before_run(&mut self, expr: &Expr) -> bool {
        let mut on_the_way = Vec::new();
        !self.reads(expr, &mut |flat, inst| flat.is_late(inst, &mut on_the_way))
    }

    /// True if the value depends on the run, or on a parameter for which `late` holds.
    fn reads(&mut self, expr: &Expr, late: &mut dyn FnMut(&mut Self, InstId) -> bool) -> bool {
        reads_run(expr)
            || any_variable(expr, &mut |variable| {
                let last = variable.last();
                self.scopes.variability(last) > Variability::Parameter || late(self, last)
            })
    }

    /// A parameter that the start determines, or whose binding reads one.  `on_the_way`: those whose bindings are being looked at; a
    /// cycle of them is reported elsewhere.
    fn is_late(&mut self, inst: InstId, on_the_way: &mut Vec<InstId>) -> bool {
        if let Some(&late) = self.late.get(&inst) {
            return late;
        }
        if on_the_way.contains(&inst) {
            return false;
        }
        let late = self.scopes.is_free(inst) || {
            let binding =
                self.scopes.instances[inst].primitive.as_ref().and_then(|primitive| primitive.binding.clone());
            let said = binding.as_ref().and_then(|applied| Some((applied.tree.binding.clone()?, applied.scope)));
            on_the_way.push(inst);
            let late = said.is_some_and(|(expr, scope)| {
                let typed = self.quietly(|flat| flat.typed_in(&expr, scope));
                typed.is_ok_and(|expr| self.reads(&expr, &mut |flat, inst| flat.is_late(inst, on_the_way)))
            });
            on_the_way.pop();
            late
        };
        self.late.insert(inst, late);
        late
    }
}
