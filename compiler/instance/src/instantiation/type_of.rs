//! What the class of a component is: a predefined type, or a class with its shape.

use std::rc::Rc;

use hyd_source::Reported;
use hyd_syntax::tree::Path;

use crate::classes::shape::{Shape, is_builtin};
use crate::instantiation::instance::{LocalClass, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;

/// The class a declaration names, resolved.
pub(crate) enum TypeOf {
    Scalar(ScalarType),
    Class(LocalClass, Rc<Shape>),
}

impl Scopes<'_> {
    pub(crate) fn type_of(&mut self, scope: Scope, path: &Path) -> Result<TypeOf, Reported> {
        if path.parts.len() == 1 && is_builtin(&path.parts[0].name) {
            let name = &path.parts[0].name;
            return Ok(TypeOf::Scalar(ScalarType::of_builtin(name)));
        }
        let local = self.find_class(scope, path)?;
        let shape = self.table.shape(local.class)?;
        Ok(TypeOf::Class(local, shape))
    }
}
