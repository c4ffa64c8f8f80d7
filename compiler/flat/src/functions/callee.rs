//! What a call calls: a function by its name, or one that was handed to the function in which the call stands.

use std::rc::Rc;

use hyd_source::Code;
use hyd_typed::{Call, Callee};

use crate::state::context::{Closure, Context, Fail, Local};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// The function that is called, with the inputs that were given where it was handed on.
    pub(crate) fn callee(&mut self, call: &Call, cx: &Context) -> Result<Rc<Closure>, Fail> {
        match &call.function {
            Callee::Class(class) => {
                let function = self.function(class, cx.scope)?;
                Ok(Rc::new(Closure { function, given: Vec::new() }))
            }
            Callee::Local(local) => match cx.local(local.name()) {
                Some(Local::Function(closure)) => Ok(closure.clone()),
                _ => {
                    let message = format!("`{}` is not a function that is known here", local.name());
                    Err(self.error(Code::BadArguments, call.name.span, message))
                }
            },
        }
    }
}
