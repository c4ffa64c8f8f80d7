//! Import clauses that lead nowhere, said once per class (Modelica 3.6, section 13.2.1).

use hyd_source::{Code, Diagnostic};
use hyd_syntax::tree::{Ident, Import, ImportKind, Name};

use crate::classes::class::{ClassId, ClassTable, imports};
use crate::classes::heir::Level;

impl ClassTable<'_> {
    /// True if an import clause around `from` should provide the name; then [`Self::check_imports`] has said why it does not.
    pub(crate) fn import_failed(&self, from: ClassId, name: &Name) -> bool {
        let mut current = Some(Level { members: from, text: from });
        while let Some(level) = current {
            let provides = |import: &Import| match &import.what {
                ImportKind::Qualified => import.path.parts.last().is_some_and(|p| p.name == *name),
                ImportKind::Renamed(alias) => alias.name == *name,
                ImportKind::Several(names) => names.iter().any(|n| n.name == *name),
                ImportKind::All => false,
            };
            if imports(&self.class(level.text).def).any(provides) {
                return true;
            }
            current = self.outwards(level);
        }
        false
    }

    /// Every import clause of a class must lead somewhere.
    pub(crate) fn check_imports(&mut self, class: ClassId) {
        let def = self.class(class).def.clone();
        for import in imports(&def) {
            let parts = &import.path.parts;
            let (package, names): (&[Ident], Vec<&Ident>) = match &import.what {
                ImportKind::All => (parts, Vec::new()),
                ImportKind::Several(names) => (parts, names.iter().collect()),
                _ => (&parts[..parts.len() - 1], parts.last().into_iter().collect()),
            };
            let Some((first, rest)) = package.split_first() else {
                for name in names.iter().filter(|n| self.top(&n.name).is_none()).copied().cloned().collect::<Vec<_>>() {
                    self.unknown_class(None, &[name]);
                }
                continue;
            };
            let Some(found) = self.top(&first.name) else {
                self.unknown_class(None, parts);
                continue;
            };
            let Ok(found) = self.descend(found, rest) else { continue };
            for name in names {
                if self.member_class(found, &name.name).is_some() {
                    continue;
                }
                let Ok(shape) = self.shape(found) else { continue };
                if !shape.by_name.contains_key(&name.name) {
                    let candidates = shape.elements.iter().map(|e| e.name.as_ref());
                    let message = format!("`{}` has no element `{}` to import", self.full_name(found), name.name);
                    let error = Diagnostic::error(Code::UnknownClass, message).at(name.span, "not found");
                    self.report(error.meant(name.span, &name.name, candidates));
                }
            }
        }
    }
}
