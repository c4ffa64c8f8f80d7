//! The unit that a declaration gives, where no instance is made of it: inputs and outputs of functions, fields of records.
//!
//! What the declaration itself says counts before what its type says (Modelica 3.6, section 7.2.4).

use std::sync::Arc;

use hyd_syntax::tree::Component;

use crate::classes::modifier::{Applied, AstMod, Mods};
use crate::instantiation::instance::{ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::evaluate::Env;
use crate::values::value::Value;

impl Scopes<'_> {
    /// The `unit` of a Real declaration, read in `scope`; `None` if it gives none.  Mistakes on the way are not reported here:
    /// whoever reads the declaration for its value does that.
    pub fn declared_unit(&mut self, scope: Scope, declaration: &Component) -> Option<Arc<str>> {
        let unit = self.quietly(|scopes| scopes.read_unit(scope, declaration));
        unit.filter(|text| !text.is_empty())
    }

    fn read_unit(&mut self, scope: Scope, declaration: &Component) -> Option<Arc<str>> {
        let own = Applied::new(Arc::new(AstMod::from_syntax(&declaration.modification)), scope);
        let mut mods: Mods = vec![own];
        if let TypeOf::Class(local, shape) = self.type_of(scope, &declaration.class).ok()? {
            let real = shape.builtin.as_ref().is_some_and(|name| ScalarType::of_builtin(name) == ScalarType::Real);
            if !real {
                return None;
            }
            mods.extend(local.mods.iter().cloned());
            let inst = self.package_of(&local).ok()?;
            for (frame, tree) in shape.frames.last().into_iter().flat_map(|f| &f.modifications) {
                let scope = Scope { inst, frame: *frame };
                mods.push(Applied::new(tree.clone(), scope));
            }
        }
        for applied in &mods {
            let said = applied.tree.children.iter().find(|(name, _)| name.as_ref() == "unit");
            let Some(expr) = said.and_then(|(_, tree)| tree.binding.clone()) else { continue };
            let value = self.evaluate(&expr, applied.scope, &Env::default()).ok()?;
            return match value.uniform().unwrap_or(&value) {
                Value::Text(text) => Some(text.clone()),
                _ => None,
            };
        }
        None
    }
}
