//! Classes found by name: lexically, through imports, along dotted names (Modelica 3.6, section 5.3).

use hyd_source::{Code, Diagnostic, Reported};
use hyd_syntax::tree::{Ident, Import, ImportKind, Name, Path};

use crate::classes::class::{ClassId, ClassTable, imports};
use crate::classes::heir::Level;

impl ClassTable<'_> {
    pub(crate) fn imported(&mut self, class: ClassId, name: &Name) -> Option<ClassId> {
        if !self.class(class).has_imports {
            return None;
        }
        let def = self.class(class).def.clone();
        let clauses: Vec<&Import> = imports(&def).collect();
        for import in clauses.iter().filter(|i| !matches!(i.what, ImportKind::All)) {
            let hit = match &import.what {
                ImportKind::Qualified => import.path.parts.last().is_some_and(|p| p.name == *name),
                ImportKind::Renamed(alias) => alias.name == *name,
                ImportKind::Several(names) => names.iter().any(|n| n.name == *name),
                ImportKind::All => false,
            };
            if hit {
                let package = self.absolute(&import.path.parts)?;
                return match &import.what {
                    ImportKind::Several(_) => self.member_class(package, name),
                    _ => Some(package),
                };
            }
        }
        for import in clauses.iter().filter(|i| matches!(i.what, ImportKind::All)) {
            let package = self.absolute(&import.path.parts)?;
            if let Some(found) = self.member_class(package, name) {
                return Some(found);
            }
        }
        None
    }

    /// The class with this full name.
    pub fn absolute(&mut self, parts: &[Ident]) -> Option<ClassId> {
        let mut class = self.top(&parts[0].name)?;
        for part in &parts[1..] {
            class = self.member_class(class, &part.name)?;
        }
        Some(class)
    }

    /// The class an identifier names from inside `from`, looking outwards.  `base`: for an `extends` clause of `from`
    /// itself, which cannot name an inherited class.
    pub fn find_first(&mut self, from: ClassId, name: &Name, base: bool) -> Option<ClassId> {
        let mut current = Some(Level { members: from, text: from });
        while let Some(level) = current {
            let own = if base && level.members == from { self.child(from, name) } else { self.seen(level, name) };
            let found = own.or_else(|| self.imported(level.text, name));
            if let Some(found) = found.or_else(|| self.class(level.text).meant_around(name)) {
                return Some(found);
            }
            current = self.outwards(level);
        }
        self.top(name)
    }

    /// The class a dotted name means from inside `from`; gives a message if there is none.
    pub fn find_class_static(&mut self, from: ClassId, path: &Path, base: bool) -> Result<ClassId, Reported> {
        let first = &path.parts[0];
        let found = if path.global { self.top(&first.name) } else { self.find_first(from, &first.name, base) };
        let Some(class) = found else {
            if !self.import_failed(from, &first.name) {
                self.unknown_class(Some(from), &path.parts);
            }
            return Err(Reported);
        };
        self.descend(class, &path.parts[1..])
    }

    /// Follows the rest of a dotted class name.
    pub fn descend(&mut self, mut class: ClassId, parts: &[Ident]) -> Result<ClassId, Reported> {
        for part in parts {
            match self.member_class(class, &part.name) {
                Some(next) => class = next,
                None => {
                    let message = format!("`{}` has no class `{}`", self.full_name(class), part.name);
                    let diagnostic = Diagnostic::error(Code::UnknownClass, message).at(part.span, "not found");
                    let diagnostic = self.meant_member(diagnostic, class, part, &parts[parts.len() - 1].name);
                    self.report(diagnostic);
                    return Err(Reported);
                }
            }
        }
        Ok(class)
    }
}
