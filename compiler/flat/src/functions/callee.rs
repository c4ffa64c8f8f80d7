//! What a call calls: a function by its name, or one that was handed to the function in which the call stands; and which texts it only
//! shows.

use std::rc::Rc;

use hyd_instance::{InstId, Scope};
use hyd_source::Code;
use hyd_syntax::tree::Name;
use hyd_typed::{Call, Callee, Function};

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

    /// True if a String is nothing but a text for people: no value of the model depends on it.
    pub(crate) fn only_shows(&mut self, function: &Function, text: &Name, scope: Scope) -> bool {
        let mut seen: Vec<(InstId, Name)> = Vec::new();
        let Some(mut open) = function.shows(text) else { return false };
        while let Some(handed) = open.pop() {
            let Ok(next) = self.function(&handed.function, scope) else { return false };
            let input = match &handed.input {
                Ok(k) => next.inputs().nth(*k).map(|input| input.name.name.clone()),
                Err(name) => Some(name.clone()),
            };
            let Some(input) = input else { return false };
            let key = (next.inst, input);
            if seen.contains(&key) {
                continue;
            }
            let Some(further) = next.shows(&key.1) else { return false };
            open.extend(further);
            seen.push(key);
        }
        true
    }
}
