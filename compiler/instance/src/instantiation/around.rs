//! The scope around the text of a class: an instance that the class is an element of, or a package.

use hyd_source::Reported;
use hyd_syntax::tree::ClassBody;

use crate::classes::class::ClassId;
use crate::classes::heir::Level;
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// Where the names in the modification of a class or of an `extends` clause of it are looked up: a short definition is not a scope of its own
    /// (Modelica 3.6, section 4.5.1), so its modification belongs to what is around.
    pub(crate) fn scope_of_modifier(&mut self, inst: InstId, frame: u32) -> Scope {
        let own = Scope { inst, frame };
        let Some(shape) = self.instances[inst].shape.clone() else { return own };
        let class = shape.frames[frame as usize].class;
        match &self.table.class(class).def.body {
            ClassBody::Short { .. } => self.scope_around(inst, &shape, frame).ok().flatten().unwrap_or(own),
            _ => own,
        }
    }

    /// The scope that the class of a frame is written in; `None` at the top.
    pub(crate) fn scope_around(&mut self, inst: InstId, shape: &Shape, frame: u32) -> Result<Option<Scope>, Reported> {
        let text = shape.frames[frame as usize].class;
        let level = Level { members: if frame == 0 { text } else { shape.frames[0].class }, text };
        let Some(around) = self.table.outwards(level) else { return Ok(None) };
        if let Some(scope) = self.scope_of_level(inst, around) {
            return Ok(Some(scope));
        }
        let package = self.local_of(inst, around.members);
        let inst = self.package_of(&package)?;
        let shape = self.table.shape(around.members)?;
        let frame = shape.frames.iter().position(|f| f.class == around.text).unwrap_or(0);
        Ok(Some(Scope { inst, frame: frame as u32 }))
    }

    /// The instance that a level of lookup stands for, where the class of `inst` is an element of an instance, or one of its bases is.
    pub(crate) fn scope_of_level(&self, inst: InstId, level: Level) -> Option<Scope> {
        let mut open = self.contexts(inst);
        while let Some(around) = open.pop() {
            let shape = self.instances[around].shape.as_ref()?;
            if shape.frames[0].class == level.members || shape.frames.iter().any(|f| f.class == level.members) {
                let frame = shape.frames.iter().position(|f| f.class == level.text)?;
                return Some(Scope { inst: around, frame: frame as u32 });
            }
            open.extend(self.contexts(around));
        }
        None
    }

    /// A class that is named from an instance: an element of the instance around it whose text it is written in, if any.
    pub(crate) fn local_of(&self, inst: InstId, class: ClassId) -> LocalClass {
        let mut open = self.contexts(inst);
        while let Some(around) = open.pop() {
            if self.is_written_in(around, class) {
                return LocalClass { context: Some(around), ..LocalClass::plain(class) };
            }
            open.extend(self.contexts(around));
        }
        LocalClass::plain(class)
    }

    /// True if the text of a class stands in that of an instance's class, however deep: it reads constants of the instance.
    pub(crate) fn is_written_in(&self, inst: InstId, class: ClassId) -> bool {
        let Some(shape) = &self.instances[inst].shape else { return false };
        let mut level = self.table.outwards(Level { members: class, text: class });
        while let Some(around) = level {
            if shape.frames.iter().any(|frame| frame.class == around.members) {
                return true;
            }
            level = self.table.outwards(around);
        }
        false
    }

    /// The instances that the class of an instance and its bases are elements of, that of the class last.
    fn contexts(&self, inst: InstId) -> Vec<InstId> {
        let instance = &self.instances[inst];
        let of_bases = instance.class.and_then(|class| self.contexts_of_bases.get(&class));
        of_bases.into_iter().flatten().copied().chain(instance.context).collect()
    }
}
