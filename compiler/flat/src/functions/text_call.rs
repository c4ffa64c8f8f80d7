//! Calls whose arguments are texts: run over values, before the run.
//!
//! A String has no value during a run, so what a function makes of texts, such as a number that it finds in a file, is known at
//! translation.  Functions that take texts apart (records of tokens, texts that are compared) have no form over nodes.

use hyd_typed::{Call, Expr, any_variable};

use crate::state::context::Context;
use crate::state::flattener::{Flattener, Outputs};

impl Flattener<'_, '_> {
    /// The output of a call in a model whose arguments are texts and literals; `None` where that is not so, or gives no value.
    pub(crate) fn call_over_texts(&mut self, expr: &Expr, call: &Call, cx: &Context) -> Option<Outputs> {
        let arguments = || call.positional.iter().chain(call.named.iter().map(|(_, argument)| argument));
        let is_known = |argument: &Expr| argument.ty.is_text() || !any_variable(argument, &mut |_| true);
        if cx.depth > 0 || !arguments().any(|argument| argument.ty.is_text()) || !arguments().all(is_known) {
            return None;
        }
        let (found, draft) = self.attempt(|flat| {
            let closure = flat.callee(call, cx).ok()?;
            let mut outputs = closure.function.outputs();
            let (Some(output), None) = (outputs.next(), outputs.next()) else { return None };
            if !output.is_simple() || closure.function.external.is_some() {
                return None;
            }
            let (env, _) = cx.env();
            let value = flat.scopes.evaluate(&expr.evaluable(), cx.scope, &env).ok()?;
            let local = flat.local_of_value(expr.span, &value, output.ty.base.clone()).ok()?;
            Some(vec![(output.name.name.clone(), local)])
        });
        if found.is_some() {
            self.keep(draft);
        }
        found
    }
}
