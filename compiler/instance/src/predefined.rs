//! Functions of the language and those that hide them.
//!
//! Names are looked up from the inside out, and what is predefined stands outermost (Modelica 3.6, section 5.3.1): a function `max`
//! of the class, of a package around it or of an import is what `max` means there.  Operators with special meaning cannot be
//! declared (3.7).

use hyd_syntax::tree::ComponentRef;

use crate::build::InstanceTree;
use crate::instance::Scope;

/// Operators and types that no declaration hides.
const NEVER_HIDDEN: &[&str] = &[
    "der",
    "pre",
    "edge",
    "change",
    "reinit",
    "initial",
    "terminal",
    "sample",
    "delay",
    "noEvent",
    "smooth",
    "homotopy",
    "semiLinear",
    "assert",
    "terminate",
    "cardinality",
    "inStream",
    "actualStream",
    "spatialDistribution",
    "Integer",
    "String",
];

impl InstanceTree<'_> {
    /// The function or operator of the language that a call in this scope would mean; `None` for a name with dots and where a
    /// declaration hides it.
    pub fn predefined<'r>(&mut self, scope: Scope, function: &'r ComponentRef) -> Option<&'r str> {
        match function.parts.as_slice() {
            [only] if !function.global && !self.is_declared(scope, &only.name.name) => Some(&only.name.name),
            _ => None,
        }
    }

    /// True if a declaration around the scope has this name.
    fn is_declared(&mut self, scope: Scope, name: &hyd_syntax::tree::Name) -> bool {
        if NEVER_HIDDEN.contains(&name.as_ref()) {
            return false;
        }
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
