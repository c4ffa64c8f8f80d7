//! Sizes of arrays: declared, taken from a value (`:`), or added by a type; bounded.

use hyd_source::{Code, Reported};
use hyd_syntax::tree::{ComponentRef, Expr};

use crate::classes::modifier::Mods;
use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::work::MAX_ELEMENTS;
use crate::values::evaluate::Env;

impl Scopes<'_> {
    /// A declared size; `:` takes it from the binding.
    pub(crate) fn size(
        &mut self,
        dim: &Expr,
        k: usize,
        scope: Scope,
        mods: &Mods,
        name: &str,
    ) -> Result<usize, Reported> {
        if matches!(dim.kind, hyd_syntax::tree::ExprKind::Colon) {
            let Some(applied) = crate::classes::modifier::binding(mods).cloned() else {
                let message = format!("`{name}` has size `:` and no value that gives it a size");
                return Err(self.error(Code::ArrayShape, dim.span, message));
            };
            let around = |scopes: &Self| applied.spread.iter().map(|&i| scopes.instances[i].dims.len()).sum::<usize>();
            let (given, skip) = match applied.tree.binding.clone() {
                Some(expr) if self.depends_on_run(&expr, applied.scope, &Env::default()) => {
                    let parts = applied.spread.iter().filter_map(|&i| self.instances[i].part_of.as_ref());
                    let parts: usize = parts.map(|(_, at)| at.len()).sum();
                    (self.shape_of(&expr, applied.scope, &Env::default())?, around(self) + parts)
                }
                _ => (self.evaluate_applied(&applied)?.shape(), around(self)),
            };
            return given.get(skip + k).copied().ok_or_else(|| {
                let message = format!("the value of `{name}` has too few dimensions");
                self.error(Code::ArrayShape, dim.span, message)
            });
        }
        self.declared_size(dim, scope, &Env::default(), name)
    }

    pub(crate) fn check_size(&mut self, inst: InstId) -> Result<(), Reported> {
        let dims = crate::instantiation::instance::full_dims(&self.instances, inst);
        let total = dims.iter().try_fold(1usize, |product, &d| product.checked_mul(d)).unwrap_or(usize::MAX);
        if total > MAX_ELEMENTS {
            let (name, span) = (self.instances[inst].name.clone(), self.instances[inst].span);
            let message = format!("`{name}` has more than {MAX_ELEMENTS} elements");
            return Err(self.error(Code::Limit, span, message));
        }
        Ok(())
    }
}

/// `Boolean` as a size or range: `false`, then `true` (Modelica 3.6, section 10.5).
pub fn names_boolean(reference: &ComponentRef) -> bool {
    matches!(reference.parts.as_slice(), [only] if only.name.name.as_ref() == "Boolean" && only.subscripts.is_empty())
}
