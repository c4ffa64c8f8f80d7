//! Names to classes, as Modelica 3.6, section 5.3, looks them up: from the inside out, through imports and bases.

use std::collections::BTreeSet;
use std::rc::Rc;

use hyd_syntax::tree::{ClassBody, Element, ImportKind, Path};

use crate::library::{Library, elements};

/// Deepest chain of bases that is followed, as deep as models may be built.
pub(crate) const DEEPEST: usize = 100;

/// The bases of a class.
#[derive(Clone, Debug, Default)]
pub(crate) enum Bases {
    /// Nobody has asked for them.
    #[default]
    Unknown,
    /// They are being looked up: who needs them for that goes round in a circle and does without.
    Sought,
    Known(Rc<[usize]>),
}

impl Library {
    /// The class that `path` names when it stands in class `from`.
    pub(crate) fn find(&self, path: &Path, from: usize) -> Option<usize> {
        self.find_names(&names(path), path.global, from, 0)
    }

    fn find_names(&self, names: &[&str], global: bool, from: usize, depth: usize) -> Option<usize> {
        let (first, rest) = names.split_first()?;
        if depth > DEEPEST {
            return None;
        }
        let mut found = None;
        let mut scope = (!global).then_some(from);
        while let (Some(class), None) = (scope, found) {
            found = self.member(first, class, depth).or_else(|| self.imported(first, class, depth));
            scope = self.entries[class].parent;
        }
        let start = found.or_else(|| self.by_name.get(*first).copied())?;
        rest.iter().try_fold(start, |class, name| self.member(name, class, depth))
    }

    /// A class in a class or in its bases, each base once.
    fn member(&self, name: &str, class: usize, depth: usize) -> Option<usize> {
        let (mut open, mut seen) = (vec![class], BTreeSet::new());
        while let Some(class) = open.pop() {
            let own = self.entries[class].children.iter().find(|child| *self.entries[**child].class.name.name == *name);
            if own.is_some() {
                return own.copied();
            }
            if seen.insert(class) {
                open.extend(self.bases_within(class, depth + 1).iter().rev());
            }
        }
        None
    }

    fn imported(&self, name: &str, class: usize, depth: usize) -> Option<usize> {
        elements(&self.entries[class].class).iter().find_map(|element| {
            let Element::Import(import) = element else { return None };
            let mut path = names(&import.path);
            let fits = match &import.what {
                ImportKind::Qualified => path.last() == Some(&name),
                ImportKind::Renamed(alias) => *alias.name == *name,
                ImportKind::All => true,
                ImportKind::Several(list) => list.iter().any(|one| *one.name == *name),
            };
            if matches!(import.what, ImportKind::All | ImportKind::Several(_)) {
                path.push(name);
            }
            if fits { self.find_names(&path, true, class, depth + 1) } else { None }
        })
    }

    /// The classes that a class extends, or the one that a short class stands for.  A base is looked up outside of the
    /// class, so that looking it up does not need the bases.
    pub(crate) fn bases(&self, class: usize) -> Rc<[usize]> {
        self.bases_within(class, 0)
    }

    fn bases_within(&self, class: usize, depth: usize) -> Rc<[usize]> {
        if depth > DEEPEST {
            return Rc::default();
        }
        let known = std::mem::replace(&mut self.bases.borrow_mut()[class], Bases::Sought);
        let found = match known {
            Bases::Known(known) => known,
            Bases::Sought => return Rc::default(),
            Bases::Unknown => self.look_up_bases(class, depth),
        };
        self.bases.borrow_mut()[class] = Bases::Known(found.clone());
        found
    }

    fn look_up_bases(&self, class: usize, depth: usize) -> Rc<[usize]> {
        let entry = &self.entries[class];
        let paths: Vec<&Path> = match &entry.class.body {
            ClassBody::Long { elements, .. } => {
                let bases = elements.iter().filter_map(|element| match element {
                    Element::Extends(extends) => Some(&extends.base),
                    _ => None,
                });
                bases.collect()
            }
            ClassBody::Short { base, .. } => vec![base],
            _ => Vec::new(),
        };
        let outside = |path: &&Path| {
            let names = names(path);
            let nested = |child: &&usize| names.first() == Some(&&*self.entries[**child].class.name.name);
            let inner = entry.children.iter().find(nested).copied();
            let found = match inner {
                Some(inner) => names[1..].iter().try_fold(inner, |class, name| self.member(name, class, depth + 1)),
                None => self.imported(names[0], class, depth + 1).and_then(|start| {
                    names[1..].iter().try_fold(start, |class, name| self.member(name, class, depth + 1))
                }),
            };
            found.or_else(|| match entry.parent {
                Some(parent) => self.find_names(&names, path.global, parent, depth + 1),
                None => self.find_names(&names, true, class, depth + 1),
            })
        };
        paths.iter().filter_map(outside).filter(|base| *base != class).collect()
    }
}

fn names(path: &Path) -> Vec<&str> {
    path.parts.iter().map(|part| &*part.name).collect()
}
