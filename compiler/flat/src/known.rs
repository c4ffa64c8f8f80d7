//! Whether an expression has its value before the run.

use hyd_instance::{InstId, Resolved, Scope};
use hyd_syntax::tree::{Expr, Name, Variability};

use crate::flatten::Flattener;
use crate::walk::{any_ref, iterator_names, reads_run};

impl Flattener<'_, '_> {
    /// True if an expression is made of constants and parameters; the start may still have to find one of them.
    pub(crate) fn made_of_parameters(&mut self, expr: &Expr, scope: Scope) -> bool {
        !self.reads(expr, scope, &[], &mut |_, _| false)
    }

    /// True if an expression is made of constants and of parameters that have their values before the run.
    pub(crate) fn known_before_run(&mut self, expr: &Expr, scope: Scope) -> bool {
        self.known_with(expr, scope, &[])
    }

    /// The same where loop variables with these names are around.
    pub(crate) fn known_with(&mut self, expr: &Expr, scope: Scope, loops: &[Name]) -> bool {
        let mut on_the_way = Vec::new();
        !self.reads(expr, scope, loops, &mut |flat, inst| flat.is_late(inst, &mut on_the_way))
    }

    /// True if the value depends on the run, or on a parameter for which `late` holds.
    fn reads(
        &mut self,
        expr: &Expr,
        scope: Scope,
        loops: &[Name],
        late: &mut dyn FnMut(&mut Self, InstId) -> bool,
    ) -> bool {
        if reads_run(expr) {
            return true;
        }
        let mut iterators = iterator_names(expr);
        iterators.extend_from_slice(loops);
        any_ref(expr, &mut |reference| {
            let first = &reference.parts[0].name.name;
            if iterators.contains(first) {
                return false;
            }
            if first.as_ref() == "time" {
                return true;
            }
            match self.tree.resolve(scope, reference) {
                Ok(Resolved::Variable(steps)) => {
                    let last = steps[steps.len() - 1].0;
                    self.tree.instances[last].variability > Variability::Parameter || late(self, last)
                }
                _ => false,
            }
        })
    }

    /// A parameter that the start determines, or whose binding reads one.  `on_the_way`: those whose bindings are being looked at; a
    /// circle of them is reported elsewhere.
    fn is_late(&mut self, inst: InstId, on_the_way: &mut Vec<InstId>) -> bool {
        if let Some(&late) = self.late.get(&inst) {
            return late;
        }
        if on_the_way.contains(&inst) {
            return false;
        }
        let late = self.tree.is_free(inst) || {
            let binding = self.tree.instances[inst].primitive.as_ref().and_then(|primitive| primitive.binding.clone());
            let said = binding.as_ref().and_then(|applied| Some((applied.tree.binding.as_ref()?, applied.scope)));
            on_the_way.push(inst);
            let late = said.is_some_and(|(expr, scope)| {
                self.reads(expr, scope, &[], &mut |flat, inst| flat.is_late(inst, on_the_way))
            });
            on_the_way.pop();
            late
        };
        self.late.insert(inst, late);
        late
    }
}
