//! `outer` elements: the `inner` one they mean, and whether its type fits (Modelica 3.6, section 5.4).

use hyd_source::{Code, Diagnostic, Reported};
use hyd_syntax::tree::Component;

use crate::instantiation::instance::{InstId, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;

impl Scopes<'_> {
    /// The `inner` element must be a subtype of what the `outer` declaration says.
    pub(crate) fn check_inner(&mut self, inner: InstId, declaration: &Component, scope: Scope) -> Result<(), Reported> {
        if self.is_broken(inner) {
            return Ok(());
        }
        let wanted = self.type_of(scope, &declaration.class)?;
        let scalar = match &wanted {
            TypeOf::Scalar(scalar) => Some(scalar.clone()),
            TypeOf::Class(local, shape) => match self.enumeration(local.class) {
                Some(enumeration) => Some(ScalarType::Enumeration(enumeration)),
                None => shape.builtin.as_deref().map(ScalarType::of_builtin),
            },
        };
        let found = &self.instances[inner];
        let offered = found.primitive.as_ref().map(|p| p.scalar.clone());
        let class = found.class.filter(|_| offered.is_none());
        let message = match (&offered, &scalar, class, &wanted) {
            (Some(a), Some(b), ..) if a == b => return Ok(()),
            (None, None, Some(new), TypeOf::Class(local, _)) => {
                let wanted = local.class;
                let Some(why) = self.table.why_not(new, wanted) else { return Ok(()) };
                format!("`inner {}` does not fit: {why}", declaration.name.name)
            }
            (None, None, ..) => return Ok(()),
            _ => {
                let name = &declaration.name.name;
                let class_name = |table: &crate::ClassTable<'_>| class.map(|c| table.full_name(c)).unwrap_or_default();
                let inner_type = offered.as_ref().map_or_else(|| class_name(&self.table), |s| s.name().to_string());
                let outer_type = scalar.as_ref().map_or_else(
                    || declaration.class.parts.iter().map(|p| p.name.as_ref()).collect::<Vec<_>>().join("."),
                    |s| s.name().to_string(),
                );
                format!("`outer {name}` is {outer_type}, but `inner {name}` is {inner_type}")
            }
        };
        let declared = self.instances[inner].span;
        self.table.report(
            Diagnostic::error(Code::TypeMismatch, message)
                .at(declaration.name.span, "`outer` here")
                .with(declared, "`inner` here"),
        );
        Err(Reported)
    }
}
