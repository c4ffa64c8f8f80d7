//! Sizes of arrays: declared, taken from a value (`:`), or added by a type; bounded.

use std::rc::Rc;

use hyd_source::{Code, Reported};
use hyd_syntax::tree::{ClassBody, Component, ComponentRef, Expr};

use crate::classes::modifier::Mods;
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::evaluate::Env;
use crate::values::value::Value;

/// Largest number of elements of one array of components or variables.
const MAX_ELEMENTS: usize = 1 << 27;

impl Scopes<'_> {
    /// Evaluates declared sizes; `:` takes its size from the binding.
    pub(crate) fn sizes(
        &mut self,
        dims: &[Expr],
        scope: Scope,
        mods: &Mods,
        name: &str,
    ) -> Result<Vec<usize>, Reported> {
        let mut sizes = Vec::with_capacity(dims.len());
        for (k, dim) in dims.iter().enumerate() {
            sizes.push(self.size(dim, k, scope, mods, name)?);
        }
        Ok(sizes)
    }

    pub(crate) fn size(
        &mut self,
        dim: &Expr,
        k: usize,
        scope: Scope,
        mods: &Mods,
        name: &str,
    ) -> Result<usize, Reported> {
        if matches!(dim.kind, hyd_syntax::tree::ExprKind::Colon) {
            let Some(applied) = crate::classes::modifier::binding(mods).cloned() else {
                let message = format!("`{name}` has size `:` and no value that gives it a size");
                return Err(self.error(Code::ArrayShape, dim.span, message));
            };
            let around = |scopes: &Self| applied.spread.iter().map(|&i| scopes.instances[i].dims.len()).sum::<usize>();
            let (given, skip) = match applied.tree.binding.clone() {
                Some(expr) if self.depends_on_run(&expr, applied.scope, &Env::default()) => {
                    let parts = applied.spread.iter().filter_map(|&i| self.instances[i].part_of.as_ref());
                    let parts: usize = parts.map(|(_, at)| at.len()).sum();
                    (self.shape_of(&expr, applied.scope, &Env::default())?, around(self) + parts)
                }
                _ => (self.evaluate_applied(&applied)?.shape(), around(self)),
            };
            return given.get(skip + k).copied().ok_or_else(|| {
                let message = format!("the value of `{name}` has too few dimensions");
                self.error(Code::ArrayShape, dim.span, message)
            });
        }
        if matches!(&dim.kind, hyd_syntax::tree::ExprKind::Ref(r) if names_boolean(r)) {
            return Ok(2);
        }
        let value = self.evaluate(dim, scope, &Env::default())?;
        let size = match &value {
            Value::Integer(size) => Some(*size),
            // An enumeration as a size: one element per literal.
            Value::Array(items) if items.iter().all(|v| matches!(v, Value::Enumeration(..))) => {
                Some(items.len() as i64)
            }
            Value::Enumeration(..)
            | Value::Boolean(_)
            | Value::Real(_)
            | Value::Text(_)
            | Value::Object(_)
            | Value::Array(_)
            | Value::Record(_) => None,
        };
        match size {
            Some(size) if size >= 0 && (size as usize) <= MAX_ELEMENTS => Ok(size as usize),
            Some(size) => {
                let limit =
                    if size < 0 { "negative".into() } else { format!("above the limit of {MAX_ELEMENTS} elements") };
                let message = format!("the size of `{name}` is {size}, which is {limit}");
                let code = if size < 0 { Code::ArrayShape } else { Code::Limit };
                Err(self.error(code, dim.span, message))
            }
            None => {
                let message = format!("the size of `{name}` must be an Integer, not {}", value.type_name());
                Err(self.error(Code::TypeMismatch, dim.span, message))
            }
        }
    }

    /// Sizes that short class definitions add (`type Vector = Real[3]`), each read where it is written.
    pub(crate) fn alias_sizes(&mut self, local: &LocalClass, shape: &Rc<Shape>) -> Result<Vec<usize>, Reported> {
        let mut sizes = Vec::new();
        for (frame, part) in shape.frames.iter().enumerate() {
            let def = self.table.class(part.class).def.clone();
            if let ClassBody::Short { dims, .. } = &def.body
                && !dims.is_empty()
            {
                let scope = Scope { inst: self.package_of(local)?, frame: frame as u32 };
                sizes.extend(self.sizes(dims, scope, &Vec::new(), &def.name.name)?);
            }
        }
        Ok(sizes)
    }

    /// Sizes that the type of a variable of a function adds to those of its declaration.
    pub(crate) fn sizes_of_type(&mut self, component: &Component, scope: Scope) -> Result<Vec<usize>, Reported> {
        match self.type_of(scope, &component.class)? {
            TypeOf::Class(local, shape) => self.alias_sizes(&local, &shape),
            TypeOf::Scalar(_) => Ok(Vec::new()),
        }
    }

    pub(crate) fn check_size(&mut self, inst: InstId) -> Result<(), Reported> {
        let dims = crate::instantiation::instance::full_dims(&self.instances, inst);
        let total = dims.iter().try_fold(1usize, |product, &d| product.checked_mul(d)).unwrap_or(usize::MAX);
        if total > MAX_ELEMENTS {
            let (name, span) = (self.instances[inst].name.clone(), self.instances[inst].span);
            let message = format!("`{name}` has more than {MAX_ELEMENTS} elements");
            return Err(self.error(Code::Limit, span, message));
        }
        Ok(())
    }
}

/// `Boolean` as a size or range: `false`, then `true` (Modelica 3.6, section 10.5).
pub fn names_boolean(reference: &ComponentRef) -> bool {
    matches!(reference.parts.as_slice(), [only] if only.name.name.as_ref() == "Boolean" && only.subscripts.is_empty())
}
