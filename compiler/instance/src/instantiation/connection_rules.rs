//! What a declaration says of connections: annotations `mustBeConnected` and `mayOnlyConnectOnce` of connectors
//! (Modelica 3.6, section 18.5), and `__hyd(open = ...)` of connectors and of the components that have them.
//!
//! They are only read here; which connectors are connected is known when connections are made.

use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{Argument, ElementModification, Expr, ExprKind, Modification, Name};

use crate::instantiation::instance::InstId;
use crate::instantiation::scopes::Scopes;
use crate::instantiation::tree::Instances;

/// The name under which the annotations of this tool stand.
pub const VENDOR: &str = "__hyd";
/// The annotation of a connector that may not stay open.
pub const MUST_BE_CONNECTED: &str = "mustBeConnected";
/// The annotation of a connector that only one other may be connected to.
pub const MAY_ONLY_CONNECT_ONCE: &str = "mayOnlyConnectOnce";

/// What may stay open without a word.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum Open {
    /// Nothing is said.
    #[default]
    Unsaid,
    /// The connector itself, or all connectors of the component.
    All,
    /// Connectors of the component, each with the place where it is named.
    Named(Vec<(Name, Span)>),
}

/// Rules of one declaration.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct ConnectionRules {
    /// Why the connector must be connected.
    pub must_connect: Option<Name>,
    /// Why not more than one connector may be connected to it.
    pub only_once: Option<Name>,
    /// What may stay open.
    pub open: Open,
}

impl ConnectionRules {
    /// The rules of the language, by annotation, with their reasons.
    pub fn of_language(&self) -> impl Iterator<Item = (&'static str, &Name)> {
        let rules = [(MUST_BE_CONNECTED, &self.must_connect), (MAY_ONLY_CONNECT_ONCE, &self.only_once)];
        rules.into_iter().filter_map(|(annotation, reason)| Some((annotation, reason.as_ref()?)))
    }

    /// True where a component or connector says that its connector `name` may stay open.
    pub fn leaves_open(&self, name: &str) -> bool {
        match &self.open {
            Open::Unsaid => false,
            Open::All => true,
            Open::Named(names) => names.iter().any(|(own, _)| &**own == name),
        }
    }
}

impl Scopes<'_> {
    /// Keeps what the annotation of an instance's declaration says of connections.
    pub(crate) fn note_connection_rules(&mut self, inst: InstId, annotation: &Modification) {
        let mut rules = ConnectionRules::default();
        for entry in entries(annotation) {
            match name_of(entry) {
                Some(MUST_BE_CONNECTED) => rules.must_connect = self.reason(entry),
                Some(MAY_ONLY_CONNECT_ONCE) => rules.only_once = self.reason(entry),
                Some(VENDOR) => {
                    for inner in entries(&entry.modification).filter(|inner| name_of(inner) == Some("open")) {
                        rules.open = self.what_is_open(inner);
                    }
                }
                _ => {}
            }
        }
        // A constant of a package is connected to nothing.
        if rules != ConnectionRules::default() && !Instances::is_of_package(inst) {
            self.instances.tree_mut().connection_rules.insert(inst, rules);
        }
    }

    /// The text of a rule of the language, which may not be empty.
    fn reason(&mut self, entry: &ElementModification) -> Option<Name> {
        if let Some(text) = entry.modification.binding.as_ref().and_then(Expr::text)
            && !text.is_empty()
        {
            return Some(text.clone());
        }
        let message = format!("`{}` takes a string that gives the reason", name_of(entry).unwrap_or_default());
        self.table.report(Diagnostic::error(Code::TypeMismatch, message).at(entry.span, ""));
        None
    }

    fn what_is_open(&mut self, entry: &ElementModification) -> Open {
        let value = entry.modification.binding.as_ref();
        let named = |parts: &[Expr]| parts.iter().map(connector_name).collect::<Option<Vec<_>>>().map(Open::Named);
        let open = match value.map(|value| &value.kind) {
            Some(ExprKind::Boolean(true)) => Some(Open::All),
            Some(ExprKind::Boolean(false)) => Some(Open::Unsaid),
            Some(ExprKind::Array(parts)) => named(parts),
            _ => value.and_then(|value| named(std::slice::from_ref(value))),
        };
        open.unwrap_or_else(|| {
            let message = "`open` takes `true` or names of connectors, such as `\"port\"` or `{\"p\", \"n\"}`";
            self.table.report(Diagnostic::error(Code::TypeMismatch, message).at(entry.span, ""));
            Open::Unsaid
        })
    }
}

/// A name in quotes or as it is.
fn connector_name(value: &Expr) -> Option<(Name, Span)> {
    let name = match &value.kind {
        ExprKind::Text(text) => text.clone(),
        ExprKind::Ref(reference) => match reference.parts.as_slice() {
            [only] if only.subscripts.is_empty() => only.name.name.clone(),
            _ => return None,
        },
        _ => return None,
    };
    Some((name, value.span))
}

fn entries(modification: &Modification) -> impl Iterator<Item = &ElementModification> {
    modification.arguments.iter().filter_map(|argument| match argument {
        Argument::Modify(entry) => Some(entry),
        _ => None,
    })
}

fn name_of(entry: &ElementModification) -> Option<&str> {
    match entry.target.parts.as_slice() {
        [only] => Some(&only.name),
        _ => None,
    }
}
