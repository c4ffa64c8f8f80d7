//! Arrays of components made element by element (see `parts`).

use std::rc::Rc;

use hyd_source::{Code, Reported};
use hyd_syntax::tree::{ClassKind, Component};

use crate::classes::modifier::Mods;
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, Instance, LocalClass, path};
use crate::instantiation::scopes::Scopes;

/// Most elements of an array that is made in parts.
const MAX_PARTS: usize = 100_000;

impl Scopes<'_> {
    /// True if this array of components is to be made element by element; arrays of records are values, which have one type.
    pub(crate) fn is_made_apart(&self, inst: InstId, local: &LocalClass) -> bool {
        !self.apart.is_empty()
            && !self.instances[inst].dims.is_empty()
            && self.table.class(local.class).def.kind != ClassKind::Record
            && self.apart.contains(&path(&self.instances, inst))
    }

    /// Makes the elements of the array, each an instance.
    pub(crate) fn make_parts(
        &mut self,
        array: InstId,
        local: &LocalClass,
        shape: &Rc<Shape>,
        mods: &Mods,
        declaration: &Component,
    ) -> Result<(), Reported> {
        let Some(parent) = self.instances[array].parent else { return Ok(()) };
        let dims = self.instances[array].dims.clone();
        let count: usize = dims.iter().product();
        let (name, span) = (self.instances[array].name.clone(), self.instances[array].span);
        if count > MAX_PARTS {
            let message = format!("the elements of `{name}` differ in structure, and there are more than {MAX_PARTS}");
            return Err(self.error(Code::Limit, span, message));
        }
        self.instances.edit(array).shape = Some(shape.clone());
        self.instances.edit(array).class = Some(local.class);
        self.instances.edit(array).kind = self.table.class(local.class).def.kind;
        self.instances.edit(parent).children.retain(|&child| child != array);
        let protected = self.instances[array].protected;
        let mut result = Ok(());
        for k in 0..count {
            let at = subscripts_of(k, &dims);
            let text: Vec<String> = at.iter().map(|k| (k + 1).to_string()).collect();
            let part =
                self.instances.add(Instance::new(format!("{name}[{}]", text.join(",")).into(), Some(parent), span));
            self.fill(part, parent, declaration);
            self.instances.edit(part).protected = protected;
            self.instances.edit(part).part_of = Some((array, at));
            self.instances.edit(array).parts.push(part);
            self.instances.edit(parent).children.push(part);
            if self.make_component(part, local.clone(), shape.clone(), mods.clone(), declaration).is_err() {
                result = Err(Reported);
            }
        }
        result
    }
}

/// Subscripts from 0 of element `k`, the last one fastest.
fn subscripts_of(k: usize, dims: &[usize]) -> Vec<usize> {
    let mut rest = k;
    let mut at: Vec<usize> = dims
        .iter()
        .rev()
        .map(|&size| {
            let own = rest % size;
            rest /= size;
            own
        })
        .collect();
    at.reverse();
    at
}
