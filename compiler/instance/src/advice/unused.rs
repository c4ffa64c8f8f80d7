//! Names that are declared and never used: imports, protected elements, variables inside functions.
//!
//! Public elements, inputs of functions (a derivative or a redeclaration must take them all) and loop variables are never
//! reported.  A protected element counts as used when its name occurs in its class or in any class with a base, since classes
//! that extend its class may use it.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Component, Element, Import, ImportKind, Name, Variability};

use super::mentions::Mentions;
use crate::classes::class::{elements, nested_classes};

/// The warnings about the classes of a text.
pub(super) fn unused(classes: &[Arc<ClassDef>]) -> Vec<Diagnostic> {
    let mut search = Search { found: Vec::new(), protected: Vec::new(), heirs: Mentions::default() };
    for def in classes {
        search.class(def);
    }
    let Search { mut found, protected, heirs } = search;
    for (what, name, span) in protected {
        if !heirs.has(&name) {
            found.push(warning(format!("the protected {what} `{name}` is not used"), span));
        }
    }
    found
}

struct Search {
    found: Vec<Diagnostic>,
    /// Protected elements that their class does not mention.
    protected: Vec<(&'static str, Name, Span)>,
    /// What classes with a base mention.
    heirs: Mentions,
}

impl Search {
    /// What a class mentions, with its nested classes.
    fn class(&mut self, def: &ClassDef) -> Mentions {
        let mut mentions = Mentions::default();
        mentions.add_class(def);
        for nested in nested_classes(def) {
            mentions.merge(&self.class(&nested.class));
        }
        let long = matches!(&def.body, ClassBody::Long { extends_from: None, .. });
        if !long || elements(def).iter().any(|e| matches!(e, Element::Extends(_))) {
            self.heirs.merge(&mentions);
        }
        for element in elements(def) {
            match element {
                Element::Import(import) => self.import(import, &mentions),
                Element::Component(component) if def.kind == ClassKind::Function => self.local(component, &mentions),
                Element::Component(component) => self.component(component, def, &mentions),
                Element::Class(nested) if plain(&nested.prefixes) && !def.partial => {
                    let name = &nested.class.name;
                    if !mentions.has(&name.name) {
                        self.protected.push(("class", name.name.clone(), name.span));
                    }
                }
                _ => {}
            }
        }
        mentions
    }

    fn import(&mut self, import: &Import, mentions: &Mentions) {
        let names = match &import.what {
            ImportKind::Qualified => import.path.parts.last().into_iter().collect(),
            ImportKind::Renamed(alias) => vec![alias],
            ImportKind::Several(names) => names.iter().collect(),
            ImportKind::All => Vec::new(),
        };
        for name in names {
            if mentions.of(&name.name).read == 0 {
                self.found.push(warning(format!("the import `{}` is not used", name.name), name.span));
            }
        }
    }

    /// A variable of a function that is neither input nor output.
    fn local(&mut self, component: &Component, mentions: &Mentions) {
        if component.direction.is_some() {
            return;
        }
        let uses = mentions.of(&component.name.name);
        let name = &component.name.name;
        if uses.read == 0 && uses.set == 0 {
            self.found.push(warning(format!("the variable `{name}` of the function is not used"), component.name.span));
        } else if uses.read == 0 {
            let message = format!("the variable `{name}` of the function is assigned and never read");
            self.found.push(warning(message, component.name.span));
        }
    }

    /// A protected parameter, constant or simple variable of a complete class.
    fn component(&mut self, component: &Component, def: &ClassDef, mentions: &Mentions) {
        if !plain(&component.prefixes) || def.partial || mentions.has(&component.name.name) {
            return;
        }
        let simple = match component.class.parts.as_slice() {
            [only] => matches!(only.name.as_ref(), "Real" | "Integer" | "Boolean" | "String"),
            _ => false,
        };
        let what = match component.variability {
            Variability::Constant => "constant",
            Variability::Parameter => "parameter",
            _ if simple => "variable",
            // A component of a model may act without being named.
            _ => return,
        };
        self.protected.push((what, component.name.name.clone(), component.name.span));
    }
}

/// Protected, and nothing that others reach by other ways.
fn plain(prefixes: &hyd_syntax::tree::ElementPrefixes) -> bool {
    prefixes.protected && !prefixes.redeclare && !prefixes.inner && !prefixes.outer && !prefixes.replaceable
}

fn warning(message: String, span: Span) -> Diagnostic {
    Diagnostic::warning(Code::Unused, message).at(span, "declared here")
}
