//! Functions of the language and those that hide them.
//!
//! Names are looked up from the inside out, and what is predefined stands outermost (Modelica 3.6, section 5.3.1): a function `max`
//! of the class, of a package around it or of an import is what `max` means there.  Operators with special meaning cannot be
//! declared (3.7).

use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Name};

use crate::builtins::Builtin;
use crate::instantiation::instance::Scope;
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// The function or operator of the language that a call in this scope means; `None` where a declaration hides it.
    pub fn predefined(&mut self, scope: Scope, function: &ComponentRef) -> Option<Builtin> {
        let builtin = Builtin::named_by(function)?;
        let name = &function.parts[0].name.name;
        if function.global {
            // A leading dot: what is predefined stands at the top (5.3.1), and a class there that has the name hides it.
            let name = name.clone();
            return (!builtin.can_be_hidden() || self.table.top(&name).is_none()).then_some(builtin);
        }
        if !builtin.can_be_hidden() || !self.is_declared(scope, name) {
            return Some(builtin);
        }
        // What is only asked for its size is left out wherever an expression is looked through.
        if builtin.asks_for_sizes() {
            let message = format!("a declaration that hides the function `{name}` is outside the language profile");
            self.table.report(Diagnostic::error(Code::OutsideProfile, message).at(function.span, "called here"));
            return Some(builtin);
        }
        None
    }

    /// The array that a call of `array` is: `{a, b}` for `array(a, b)` and `{e for i in r}` for `array(e for i in r)` (section 10.4).
    pub fn array_of_call(
        &mut self,
        scope: Scope,
        function: &ComponentRef,
        arguments: &Arguments,
        span: Span,
    ) -> Option<Expr> {
        let is_named = |name: &Name| Builtin::from_name(name) == Some(Builtin::Array);
        if !is_named(&function.parts[0].name.name) || self.predefined(scope, function) != Some(Builtin::Array) {
            return None;
        }
        let kind = match arguments {
            Arguments::List { positional, named } if named.is_empty() && !positional.is_empty() => {
                ExprKind::Array(positional.clone())
            }
            Arguments::List { .. } => return None,
            Arguments::Reduction(body, iterators) => ExprKind::ArrayFor(body.clone(), iterators.clone()),
        };
        Some(Expr { kind, span })
    }

    /// True if a declaration around the scope has this name.
    fn is_declared(&mut self, scope: Scope, name: &Name) -> bool {
        let Some(shape) = self.instances[scope.inst].shape.clone() else { return false };
        let key = (shape.frames[scope.frame as usize].class, shape.frames[0].class, name.clone());
        if let Some(&known) = self.declared_names.get(&key) {
            return known;
        }
        let declared = shape.visible(name, scope.frame).is_some() || self.first_class(scope, name).is_some();
        self.declared_names.insert(key, declared);
        declared
    }
}
