//! Functions as values: arguments of calls, with some of their inputs given (Modelica 3.6, section 12.4.2).

use std::rc::Rc;

use hyd_source::{Code, Diagnostic, did_you_mean};
use hyd_syntax::tree::ClassKind;
use hyd_typed::{Expr, Kind};

use crate::state::context::{Closure, Context, Fail, Local};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// An argument of a call: a function that is handed on, or a local value.
    pub(crate) fn argument(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        match self.as_function(expr, cx)? {
            Some(function) => Ok(Local::Function(function)),
            None => self.local_value(expr, cx),
        }
    }

    /// The function that an expression hands on; `None` if it is none.
    fn as_function(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Rc<Closure>>, Fail> {
        match &expr.kind {
            Kind::Class(class, _) if self.scopes.table.class(class.class).def.kind == ClassKind::Function => {
                let function = self.function(class, cx.scope)?;
                Ok(Some(Rc::new(Closure { function, given: Vec::new() })))
            }
            Kind::Local(local) if expr.ty.is_function() => match cx.local(local.name()) {
                Some(Local::Function(closure)) => Ok(Some(closure.clone())),
                _ => Ok(None),
            },
            Kind::Function(call) => {
                let closure = self.callee(call, cx)?;
                let mut given = closure.given.clone();
                for (name, value) in &call.named {
                    let open = closure.function.inputs().map(|input| &input.name.name);
                    let open: Vec<_> = open.filter(|input| !given.iter().any(|(known, _)| known == *input)).collect();
                    if !open.contains(&&name.name) {
                        let help = did_you_mean(&name.name, open.into_iter().map(|input| input.as_ref()));
                        let message = format!("there is no input `{}`", name.name);
                        let error = Diagnostic::error(Code::BadArguments, message).at(name.span, "");
                        self.report(error.maybe_help(help));
                        return Err(Fail::Reported);
                    }
                    given.push((name.name.clone(), self.argument(value, cx)?));
                }
                Ok(Some(Rc::new(Closure { function: closure.function.clone(), given })))
            }
            _ => Ok(None),
        }
    }
}
