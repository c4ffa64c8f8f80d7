//! Functions as arguments of functions that are called at translation, with some of their inputs given (Modelica 3.6, section 12.4.2).

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{ClassKind, Component, ComponentRef, Expr, ExprKind, Ident, Name};

use crate::classes::shape::is_builtin;
use crate::instantiation::instance::{LocalClass, Scope};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;
use crate::values::evaluate::Env;
use crate::values::value::Value;

/// A function that an input stands for.
#[derive(Clone, Debug)]
pub struct FunctionValue {
    /// Its class.
    pub local: LocalClass,
    /// Inputs that are given with it.
    pub given: Vec<(Name, Value)>,
}

impl Env {
    /// The function that an input of the function around is.
    pub(crate) fn function(&self, name: &ComponentRef) -> Option<&FunctionValue> {
        let [only] = name.parts.as_slice() else { return None };
        let found = self.functions.iter().rev().find(|(own, _)| *own == only.name.name);
        found.map(|(_, function)| function).filter(|_| !name.global)
    }
}

/// A function, and the inputs that the argument which names it gives it.
type WithGiven<'e> = (FunctionValue, &'e [(Ident, Expr)]);

impl Scopes<'_> {
    /// The function that an argument is, where the input asks for one, and the inputs that the argument gives it; `None` for a value.
    pub(crate) fn function_value<'e>(
        &mut self,
        argument: &'e Expr,
        (declared, input): (Scope, &Component),
        scope: Scope,
        env: &Env,
    ) -> Result<Option<WithGiven<'e>>, Reported> {
        let (name, given): (&ComponentRef, &[(Ident, Expr)]) = match &argument.kind {
            // `function f(a = 1)`
            ExprKind::Partial(name, given) => (name, given),
            ExprKind::Ref(name) if env.function(name).is_some() => (name, &[]),
            ExprKind::Ref(name)
                if env.get(&name.parts[0].name.name).is_none() && self.asks_for_function(declared, input) =>
            {
                (name, &[])
            }
            _ => return Ok(None),
        };
        let function = match env.function(name) {
            Some(known) => known.clone(),
            None => self.function_named(argument.span, name, scope)?,
        };
        Ok(Some((function, given)))
    }

    fn function_named(&mut self, span: Span, name: &ComponentRef, scope: Scope) -> Result<FunctionValue, Reported> {
        match self.resolve(scope, name)? {
            Resolved::Class(local) if self.table.class(local.class).def.kind == ClassKind::Function => {
                Ok(FunctionValue { local, given: Vec::new() })
            }
            _ => Err(self.error(Code::TypeMismatch, span, "a function is needed here")),
        }
    }

    fn asks_for_function(&mut self, scope: Scope, input: &Component) -> bool {
        if matches!(input.class.parts.as_slice(), [only] if is_builtin(&only.name)) {
            return false;
        }
        let found = self.quietly(|scopes| scopes.find_class(scope, &input.class));
        found.is_ok_and(|local| self.table.class(local.class).def.kind == ClassKind::Function)
    }
}
