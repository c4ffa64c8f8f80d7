//! Calls of external functions and constructors of external objects at translation (Modelica 3.6, sections 12.9 and 12.9.7).

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Component, ComponentRef, Direction, Expr, ExprKind, ExternalCall, Name};

use crate::external::{self, Given};
use crate::instantiation::instance::{LocalClass, Scope};
use crate::instantiation::scopes::Scopes;
use crate::values::evaluate::Env;
use crate::values::value::Value;

impl Scopes<'_> {
    /// The constructor function of a class of external objects; `None` for any other class.
    pub fn constructor_of_object(&mut self, local: &LocalClass) -> Result<Option<LocalClass>, Reported> {
        if !self.is_object(local)? {
            return Ok(None);
        }
        let constructor = self.table.member_class(local.class, &Name::from("constructor"));
        match constructor {
            Some(class) => Ok(Some(LocalClass::plain(class))),
            None => {
                let name = self.table.full_name(local.class);
                let declared = self.table.class(local.class).def.name.span;
                let message = format!("the external object `{name}` has no function `constructor`");
                Err(self.error(Code::UnknownName, declared, message))
            }
        }
    }

    /// True for a class that extends `ExternalObject`.
    pub fn is_object(&mut self, local: &LocalClass) -> Result<bool, Reported> {
        if !self.table.class(local.class).has_bases {
            return Ok(false);
        }
        Ok(self.table.shape(local.class)?.builtin.as_deref() == Some("ExternalObject"))
    }

    /// What the external function of this name gives for these values; `None` where the name is not known.
    pub fn external_value(&mut self, span: Span, name: &str, arguments: &[Value]) -> Option<Result<Given, Reported>> {
        if name == "ModelicaRandom_automaticGlobalSeed" {
            let message =
                format!("an automatic seed is always {}, so that runs can be repeated", external::AUTOMATIC_SEED);
            self.table.report(Diagnostic::warning(Code::OutsideProfile, message).at(span, ""));
        }
        let table = &mut self.table;
        let given = external::call(name, arguments, &mut |file| table.data_file(file))?;
        Some(given.map_err(|sentence| self.error(Code::Value, span, sentence)))
    }

    /// Calls the external function of a clause with these arguments: what it gives to variables of the function around; `None` where it is
    /// not known here.
    pub(crate) fn call_external(
        &mut self,
        span: Span,
        call: &ExternalCall,
        components: &[(u32, Component)],
        scope: Scope,
        arguments: &[Value],
    ) -> Result<Option<Vec<(ComponentRef, Value)>>, Reported> {
        if external::is_effect_only(&call.name.name) {
            self.no_effect(span, &call.name.name);
            let went_well = call.output.iter().map(|target| (target.clone(), Value::Boolean(true)));
            return Ok(Some(went_well.collect()));
        }
        if external::sets_hidden_state(&call.name.name) {
            self.found.hidden_state = arguments.first().cloned();
            return Ok(Some(Vec::new()));
        }
        let Some(given) = self.external_value(span, &call.name.name, arguments) else { return Ok(None) };
        let Given { value, set } = given?;
        let mut all = Vec::new();
        if let (Some(target), Some(value)) = (&call.output, value) {
            let value = self.of_output(value, &target.parts[0].name.name, components, scope)?;
            all.push((target.clone(), value));
        }
        for (position, value) in set {
            if let Some(ExprKind::Ref(target)) = call.arguments.get(position).map(|argument| &argument.kind) {
                all.push((target.clone(), value));
            }
        }
        Ok(Some(all))
    }

    /// A value as the output holds it: the number of a literal where that is an enumeration.
    fn of_output(
        &mut self,
        value: Value,
        name: &Name,
        components: &[(u32, Component)],
        scope: Scope,
    ) -> Result<Value, Reported> {
        let (Value::Integer(k), Some((_, component))) =
            (&value, components.iter().find(|(_, component)| component.name.name == *name))
        else {
            return Ok(value);
        };
        if crate::classes::shape::is_builtin(&component.class.parts[0].name) {
            return Ok(value);
        }
        let local = self.find_class(scope, &component.class)?;
        Ok(match self.enumeration(local.class) {
            Some(enumeration) => Value::Enumeration(enumeration, u32::try_from(*k).unwrap_or(1)),
            None => value,
        })
    }

    /// Says that a function with effects outside of the model is not run.
    pub fn no_effect(&mut self, span: Span, name: &str) {
        let message = format!("`{name}` is not called: it would only act outside of the model");
        self.table.report(Diagnostic::warning(Code::OutsideProfile, message).at(span, ""));
    }
}

/// The output of the function around that an argument is.
pub(crate) fn is_set_by_call<'e>(argument: &'e Expr, components: &[(u32, Component)]) -> Option<&'e Name> {
    let ExprKind::Ref(reference) = &argument.kind else { return None };
    let name = &reference.parts[0].name.name;
    let is_it = |c: &Component| c.name.name == *name && c.direction == Some(Direction::Output);
    components.iter().any(|(_, c)| is_it(c)).then_some(name)
}

/// The value that a variable of a function has.
pub(crate) fn value_so_far(env: &Env, name: &Name) -> Option<Value> {
    env.names.iter().rev().find(|(known, _)| known == name).map(|(_, value)| value.clone())
}
