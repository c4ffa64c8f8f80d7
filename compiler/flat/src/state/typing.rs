//! What is typed while the model is made flat: texts of modifications, of records and of injected terms.

use std::rc::Rc;

use hyd_instance::{LocalClass, Scope};
use hyd_syntax::tree::Expr as Text;
use hyd_typed::{Elaborator, Expr, Function};

use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;

impl<'s> Flattener<'_, 's> {
    /// Types the text of a scope.
    pub(crate) fn elaborator(&mut self, scope: Scope, cx: Option<&Context>) -> Elaborator<'_, 's> {
        let locals = cx.map_or_else(Vec::new, |cx| cx.names.iter().map(|(n, local)| (n.clone(), local.ty())).collect());
        Elaborator::new(self.scopes, &mut self.typing, scope, locals)
    }

    /// A text in a scope without local names.
    pub(crate) fn typed_in(&mut self, expr: &Text, scope: Scope) -> Result<Expr, Fail> {
        Ok(self.elaborator(scope, None).expr(expr)?)
    }

    /// The function that is called, with its declarations and statements.
    pub(crate) fn function(&mut self, local: &LocalClass, scope: Scope) -> Result<Rc<Function>, Fail> {
        Ok(self.elaborator(scope, None).function(local)?)
    }
}
