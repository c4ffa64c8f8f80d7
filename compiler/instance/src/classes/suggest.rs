//! Names that were not found, and what may have been meant: what is visible there, then classes of the libraries by their
//! last name.

use hyd_source::{Code, Diagnostic, Edit, Severity, Span, closest, did_you_mean};
use hyd_syntax::tree::{ClassBody, ClassKind, ComponentRef, Element, Ident, ImportKind, Name};

use crate::classes::class::{ClassId, ClassTable, imports, nested_classes};
use crate::classes::heir::Level;
use crate::instantiation::instance::Scope;
use crate::instantiation::scopes::Scopes;

/// Most full names that a suggestion lists.
const MOST: usize = 3;

impl ClassTable<'_> {
    /// Names of all classes that `child` could find in `parent`: in its text, inherited, and as files of its folder.
    pub fn child_names(&mut self, parent: ClassId) -> Vec<Name> {
        let def = self.class(parent).def.clone();
        let mut names: Vec<Name> = nested_classes(&def).map(|n| n.class.name.name.clone()).collect();
        if !self.is_open(parent)
            && let Ok(shape) = self.shape(parent)
        {
            names.extend(shape.elements.iter().filter(|e| !e.component).map(|e| e.name.clone()));
        }
        let prefix = self.full_name(self.class(parent).original.unwrap_or(parent)) + ".";
        for full in self.library_names() {
            if let Some(inner) = full.strip_prefix(&prefix).filter(|inner| !inner.contains('.')) {
                names.push(inner.into());
            }
        }
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Classes of the libraries whose last name is, or is close to, `last`.
    fn suggest_library(&mut self, last: &str) -> Option<String> {
        let full = self.library_names();
        let ends: Vec<&str> = full.iter().map(|name| name.rsplit('.').next().unwrap_or(name)).collect();
        let close = match ends.contains(&last) {
            true => last.to_string(),
            false => did_you_mean(last, ends.iter().copied())?.split('`').nth(1)?.to_string(),
        };
        let mut fitting: Vec<&String> =
            full.iter().zip(&ends).filter(|(_, end)| **end == close).map(|(full, _)| full).collect();
        fitting.sort_unstable();
        fitting.dedup();
        let names: Vec<String> = fitting.iter().take(MOST).map(|name| format!("`{name}`")).collect();
        Some(format!("did you mean {}?", names.join(" or ")))
    }

    /// Constants of this name in the packages `Constants` of the libraries: nothing else has the names that people take
    /// for granted.
    fn suggest_constant(&mut self, name: &str) -> Option<String> {
        let mut packages = self.library_names();
        packages.retain(|full| full.rsplit('.').next() == Some("Constants"));
        packages.sort_unstable();
        packages.dedup();
        let mut fitting = Vec::new();
        for full in packages {
            let mut parts = full.split('.').map(Name::from);
            let top = parts.next().and_then(|first| self.top(&first));
            let package = parts.fold(top, |class, part| class.and_then(|class| self.child(class, &part)));
            if let Some(package) = package
                && let Ok(shape) = self.shape(package)
                && shape.elements.iter().any(|element| element.component && *element.name == *name)
            {
                fitting.push(format!("`{full}.{name}`"));
            }
        }
        fitting.truncate(MOST);
        (!fitting.is_empty()).then(|| format!("did you mean {}?", fitting.join(" or ")))
    }

    /// Adds to the message about a component that is declared nowhere the declaration that it may lack: that of a model of its name in a library which has the
    /// element that is asked for.  A text that lacks it in several places is changed once.
    fn with_declaration(&mut self, said: Diagnostic, class: ClassId, name: &str, element: &str) -> Diagnostic {
        let wanted = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_').replace('_', "").to_lowercase();
        let is_wanted = |full: &str| full.rsplit('.').next().is_some_and(|last| last.to_lowercase() == wanted);
        let mut fitting = self.library_names();
        fitting.retain(|full| is_wanted(full));
        fitting.sort_unstable();
        fitting.dedup();
        fitting.retain(|full| self.can_be_declared(full, element));
        if wanted.is_empty() || fitting.is_empty() {
            return said;
        }
        let declarations: Vec<String> = fitting.iter().take(MOST).map(|full| format!("`{full} {name};`")).collect();
        let said = said.help(format!("perhaps its declaration is missing: {}", declarations.join(" or ")));
        let def = self.class(class).def.clone();
        let ClassBody::Long { elements, .. } = &def.body else { return said };
        let first = elements.iter().find_map(|element| match element {
            Element::Component(component) if !component.prefixes.protected => Some(component.span),
            _ => None,
        });
        let (Some(first), [full]) = (first, fitting.as_slice()) else { return said };
        let edit = Edit { span: Span { end: first.start, ..first }, text: format!("{full} {name};\n  ") };
        let is_known = self.messages.iter().flat_map(|own| &own.proposals).any(|own| own.edits.contains(&edit));
        if is_known { said } else { said.propose(format!("declare `{name}` as a `{full}`"), vec![edit]) }
    }

    /// True if a class of a library may be that of a component, and has an element of this name.
    fn can_be_declared(&mut self, full: &str, element: &str) -> bool {
        let mut parts = full.split('.').map(Name::from);
        let top = parts.next().and_then(|first| self.top(&first));
        let class = parts.fold(top, |class, part| class.and_then(|class| self.child(class, &part)));
        let Some(class) = class else { return false };
        let def = self.class(class).def.clone();
        if !matches!(def.kind, ClassKind::Model | ClassKind::Block) || def.partial {
            return false;
        }
        let shape = self.shape(class);
        shape.is_ok_and(|shape| shape.elements.iter().any(|own| own.component && *own.name == *element))
    }

    /// Adds what may be meant by `part`, which `class` does not have, to the message about it: a class before anything else.
    pub(crate) fn meant_member(&mut self, said: Diagnostic, class: ClassId, part: &Ident, last: &str) -> Diagnostic {
        let names = self.child_names(class);
        let names = || names.iter().map(|name| name.as_ref());
        match closest(&part.name, names()) {
            Some(_) => said.meant(part.span, &part.name, names()),
            None => self.meant_inside(said, class, part, last),
        }
    }

    /// The same of anything that can be named there; `last` is the last name of the whole reference.
    pub(crate) fn meant_inside(&mut self, said: Diagnostic, class: ClassId, part: &Ident, last: &str) -> Diagnostic {
        let names = self.names_inside(class);
        let names = || names.iter().map(|name| name.as_ref());
        match closest(&part.name, names()) {
            Some(_) => said.meant(part.span, &part.name, names()),
            None => said.maybe_help(self.suggest_library(last)),
        }
    }

    /// What can be named behind the dot after a class, sorted.
    fn names_inside(&mut self, class: ClassId) -> Vec<Name> {
        let mut names = self.child_names(class);
        if !self.is_open(class)
            && let Ok(shape) = self.shape(class)
        {
            names.extend(shape.elements.iter().map(|e| e.name.clone()));
        }
        names.sort_unstable();
        names
    }

    /// Classes that can be named from inside `from`: those around and those imported.
    pub(crate) fn class_names_from(&mut self, from: Option<ClassId>) -> Vec<Name> {
        let mut names = self.top_names();
        let mut current = from.map(|class| Level { members: class, text: class });
        while let Some(level) = current {
            names.extend(self.child_names(level.members));
            names.extend(self.child_names(level.text));
            let def = self.class(level.text).def.clone();
            for import in imports(&def) {
                match &import.what {
                    ImportKind::Qualified => names.extend(import.path.parts.last().map(|p| p.name.clone())),
                    ImportKind::Renamed(alias) => names.push(alias.name.clone()),
                    ImportKind::Several(list) => names.extend(list.iter().map(|i| i.name.clone())),
                    ImportKind::All => {}
                }
            }
            current = self.outwards(level);
        }
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The message for a class name whose first part means nothing.
    pub(crate) fn unknown_class(&mut self, from: Option<ClassId>, parts: &[Ident]) {
        let (ident, last) = (&parts[0], &parts[parts.len() - 1].name);
        if self.is_unreadable(&ident.name) {
            return;
        }
        let message = format!("there is no class `{}` here", ident.name);
        if self.messages.is_repeated(&message, ident.span) {
            return;
        }
        // A misspelt keyword looks like a class.
        let words =
            ["Real", "Integer", "Boolean", "String", "equation", "algorithm", "parameter", "constant", "extends"];
        let mut names: Vec<Name> = words.map(Name::from).to_vec();
        names.extend(self.class_names_from(from));
        let constant = if parts.len() > 1 { self.suggest_constant(last) } else { None };
        let is_near = constant.is_none() && closest(&ident.name, names.iter().map(|n| n.as_ref())).is_some();
        let help = constant.or_else(|| if is_near { None } else { self.suggest_library(last) });
        let library = "other libraries are named with `--library FOLDER`";
        let help = help.or_else(|| (parts.len() > 1 && !is_near).then(|| library.to_string()));
        let mut error = Diagnostic::error(Code::UnknownClass, message).at(ident.span, "not found");
        if parts.len() > 1 && &*ident.name == "Modelica" {
            error = error.help(
                "the Modelica Standard Library is not loaded: name the folder that it stands in with `--library FOLDER` or in `MODELICAPATH`",
            );
            if help.as_deref() == Some(library) {
                self.report(error);
                return;
            }
        }
        if is_near {
            error = error.meant(ident.span, &ident.name, names.iter().map(|n| n.as_ref()));
        }
        self.report(error.maybe_help(help));
    }
}

impl Scopes<'_> {
    /// Components that can be named from a scope.
    fn names_from(&self, scope: Scope) -> Vec<Name> {
        let instance = &self.instances[scope.inst];
        let named = instance.by_name.iter().filter(|(_, inst)| {
            let is_own = self.instances[**inst].parent == Some(scope.inst);
            !(is_own && self.is_added_inner(**inst))
        });
        let mut names: Vec<Name> = named.map(|(name, _)| name.clone()).collect();
        if let Some(shape) = &instance.shape {
            names.extend(shape.elements.iter().filter(|e| e.component).map(|e| e.name.clone()));
        }
        names.push("time".into());
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The message for a reference whose first part means nothing.
    pub(crate) fn unknown_name(&mut self, scope: Scope, reference: &ComponentRef) {
        let (first, last) = (&reference.parts[0].name, &reference.parts[reference.parts.len() - 1].name);
        let name = &*first.name;
        let mut around = self.instances[scope.inst].shape.as_ref().map(|s| s.frames[scope.frame as usize].class);
        let own = around;
        let class = around.map(|c| self.table.full_name(c)).unwrap_or_default();
        let message = format!("unknown name `{name}` in `{class}`");
        if self.table.messages.is_repeated(&message, first.span) {
            return;
        }
        let mut names = self.names_from(scope);
        let said = |d: &Diagnostic| d.severity == Severity::Error && d.code == Code::UnknownClass;
        let failed = around.is_some_and(|from| self.table.import_failed(from, &Name::from(name)));
        if failed && self.table.messages.iter().any(said) {
            return;
        }
        let visible = |table: &ClassTable<'_>, class: ClassId| {
            table.class(class).parent.filter(|_| !table.class(class).def.encapsulated)
        };
        while let Some(outer) = around.and_then(|class| visible(&self.table, class)) {
            // Of what is around a class only constants can be named.
            if let Ok(shape) = self.table.shape(outer) {
                let package = self.table.class(outer).def.kind == hyd_syntax::tree::ClassKind::Package;
                names.extend(shape.elements.iter().filter(|e| package && e.component).map(|e| e.name.clone()));
            }
            around = Some(outer);
        }
        // `pi` is a slip of `p` less often than it is the constant.
        let constant = self.table.suggest_constant(&last.name);
        let diagnostic = Diagnostic::error(Code::UnknownName, message).at(first.span, "not declared");
        let added = self.instances[scope.inst].by_name.get(&first.name);
        if added.is_some_and(|&inst| self.is_added_inner(inst) && self.instances[inst].parent == Some(scope.inst)) {
            let help = format!(
                "the element `{name}` that is added for an `outer` one is not part of the text: declare it as `inner`"
            );
            self.table.report(diagnostic.help(help));
            return;
        }
        let names = || names.iter().map(|n| n.as_ref());
        let diagnostic = match (constant, own, closest(name, names())) {
            (Some(help), _, _) => diagnostic.help(help),
            (None, Some(class), None) if reference.parts.len() > 1 => {
                self.table.with_declaration(diagnostic, class, name, &reference.parts[1].name.name)
            }
            _ => diagnostic.meant(first.span, name, names()),
        };
        self.table.report(diagnostic);
    }

    /// Classes that a scope can name, for suggestions.
    pub fn visible_classes(&mut self, scope: Scope) -> Vec<Name> {
        let from = self.instances[scope.inst].shape.as_ref().map(|s| s.frames[scope.frame as usize].class);
        self.table.class_names_from(from)
    }
}
