//! Connectors that nothing is connected to, and what libraries demand of connections.
//!
//! A connector left open has zero flow (Modelica 3.6, section 9.2), so a connection that was forgotten is simulated without a
//! word.  Components of the user's own text get one warning each that names their open connectors, unless an annotation
//! `__hyd(open = ...)` says that they may stay open, or they are free ends of rigid parts (`free_ends`).  What a library leaves open inside its own classes is its own matter; its
//! rules `mustBeConnected` and `mayOnlyConnectOnce` (section 18.5) hold everywhere.

use hyd_instance::connection_rules::{MUST_BE_CONNECTED, Open};
use hyd_instance::{ClassId, InstId};
use hyd_source::{Code, Diagnostic, Edit, FileId, Span, did_you_mean};
use hyd_syntax::tree::{ClassBody, ClassKind, ComponentRef, Name};
use hyd_syntax::visit::{Role, Visitor};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::connections::connect::Leaf;
use crate::state::flattener::Flattener;
use crate::variables::element_names::element_names;

/// At most so many connectors are named in one message.
const MOST_NAMED: usize = 8;

/// Connectors, as dotted names without subscripts, that the `connect` equations of a class name.
type Connects = FxHashMap<ClassId, FxHashSet<String>>;

/// A connector with the elements that nothing is connected to.
pub(super) struct OpenEnd {
    /// The component that has it.
    pub(super) owner: InstId,
    pub(super) connector: InstId,
    /// By element, arrays around it included.
    pub(super) open: Vec<bool>,
}

impl Flattener<'_, '_> {
    /// Warnings about connectors left open, and errors where rules of libraries are broken.
    pub(crate) fn check_ends(&mut self) {
        // What follows a mistake may only seem open.
        if self.has_errors() {
            return;
        }
        self.check_annotations();
        if self.has_errors() {
            return;
        }
        self.check_connection_rules();
        self.check_short_circuits();
        let mut ends = self.open_ends();
        let mut connects = Connects::default();
        let mut warnings: Vec<(Span, Vec<OpenEnd>)> = Vec::new();
        let mut known: FxHashMap<Span, usize> = FxHashMap::default();
        // Where no element is connected, a condition may be what keeps the `connect` from acting.
        ends.retain(|end| {
            !(self.is_ruled(end) || end.open.iter().all(|&open| open) && self.is_named(end, &mut connects))
        });
        let ends = self.without_free_ends(ends);
        let missing = self.missing_connections(&ends);
        for end in ends {
            let declared = self.scopes.instances[end.owner].span;
            let at = *known.entry(declared).or_insert(warnings.len());
            match warnings.get_mut(at) {
                Some((_, same)) => same.push(end),
                None => warnings.push((declared, vec![end])),
            }
        }
        warnings.sort_by_key(|(declared, _)| (declared.file, declared.start));
        for (declared, ends) in warnings {
            let mut warning = self.open_warning(declared, &ends);
            for (_, words, edit) in missing.iter().filter(|(of, ..)| ends.iter().any(|end| of.contains(&end.connector)))
            {
                warning = warning.propose(words.clone(), vec![edit.clone()]);
            }
            self.report(warning);
        }
    }

    fn has_errors(&self) -> bool {
        self.scopes.table.messages.has_errors()
    }

    /// Open connectors of components declared in the user's text, in the order of the instances.
    fn open_ends(&self) -> Vec<OpenEnd> {
        let instances = &self.scopes.instances;
        let text = [self.scopes.table.main, Some(instances[self.tree.root].span.file)];
        let own = |file: FileId| text.contains(&Some(file));
        let mut found = Vec::new();
        for (inst, elements) in self.connections.ranges() {
            let Some(owner) = instances[inst].parent.filter(|&parent| parent != self.tree.root) else { continue };
            let is_component = matches!(instances[owner].kind, ClassKind::Model | ClassKind::Block | ClassKind::Class);
            if is_component && own(instances[owner].span.file) && !self.is_hidden_in(owner, inst) {
                let open: Vec<bool> = elements.map(|element| self.connections.is_open(element)).collect();
                self.open_parts(owner, inst, open, &mut found);
            }
        }
        found.sort_by_key(|end| end.connector);
        found
    }

    /// Adds what is open of a connector; where its parts are connected by themselves, the parts that are not.
    fn open_parts(&self, owner: InstId, connector: InstId, open: Vec<bool>, found: &mut Vec<OpenEnd>) {
        if !open.contains(&true) {
            return;
        }
        let instances = &self.scopes.instances;
        let is_connector = |&part: &InstId| instances[part].kind == ClassKind::Connector;
        let parts = || instances[connector].children.iter().copied().filter(is_connector);
        if !parts().any(|part| self.is_connected_inside(part)) {
            if self.leaves(connector).iter().any(|leaf| leaf.flow) {
                found.push(OpenEnd { owner, connector, open });
            }
            return;
        }
        for part in parts() {
            let each = instances[part].dims.iter().product::<usize>();
            let own = self.connections.range(part);
            let free = |k: usize| own.as_ref().is_none_or(|own| self.connections.is_open(own.start + k as u32));
            let open = (0..open.len() * each).map(|k| open[k / each] && free(k)).collect();
            self.open_parts(owner, part, open, found);
        }
    }

    /// Connections of two open ends of the model's own components that are the only ones of their kind: which two, in words, and where
    /// the text gets them.  None where a component is absent or the model itself has such a connector, which may be meant, and none between
    /// equal ends of parts that are joined already: two loads of one source lack a return and no connection with each other.
    fn missing_connections(&mut self, ends: &[OpenEnd]) -> Vec<([InstId; 2], String, Edit)> {
        let Some(gaps) = self.model.gaps else { return Vec::new() };
        if ends.len() < 2 {
            return Vec::new();
        }
        let mut networks = self.networks();
        let instances = &self.scopes.instances;
        let parts = || instances[self.tree.root].children.iter().copied();
        if parts().any(|part| instances[part].absent) {
            return Vec::new();
        }
        let kinds: Vec<_> = ends.iter().map(|end| self.exact_kind_of(end.connector)).collect();
        let own: Vec<_> = parts()
            .filter(|&part| instances[part].kind == ClassKind::Connector)
            .map(|part| self.exact_kind_of(part))
            .collect();
        let is_own = |end: &OpenEnd| {
            let (owner, connector) = (&instances[end.owner], &instances[end.connector]);
            owner.parent == Some(self.tree.root)
                && connector.parent == Some(end.owner)
                && owner.dims.is_empty()
                && connector.dims.is_empty()
                && !self.scopes.is_added_inner(end.owner)
        };
        let name = |end: &OpenEnd| format!("{}.{}", instances[end.owner].name, instances[end.connector].name);
        let mut found = Vec::new();
        for (k, end) in ends.iter().enumerate().filter(|(k, _)| !own.contains(&kinds[*k])) {
            let mut others = (0..ends.len()).filter(|&other| other != k && kinds[other] == kinds[k]);
            let (Some(at), None) = (others.next(), others.next()) else { continue };
            let other = &ends[at];
            let is_joined = networks.find(end.owner) == networks.find(other.owner);
            let is_equal = instances[end.connector].name == instances[other.connector].name;
            if at > k && end.owner != other.owner && is_own(end) && is_own(other) && !(is_joined && is_equal) {
                let connection = format!("connect({}, {});", name(end), name(other));
                let span = Span { end: gaps.equation.start, ..gaps.equation };
                let edit = Edit { span, text: format!("{connection}\n  ") };
                found.push(([end.connector, other.connector], format!("add `{connection}`"), edit));
            }
        }
        found
    }

    /// The elements of a connector with all that decides what it fits: name, flow, type, sizes and unit.
    fn exact_kind_of(&self, connector: InstId) -> Vec<(Name, bool, String, Vec<usize>, String)> {
        let kind = |leaf: Leaf| {
            let own = &self.scopes.instances[leaf.inst];
            let unit = self.blocks.get(&leaf.inst).and_then(|&block| self.model.variables[block].unit.clone());
            let scalar = own.primitive.as_ref().map_or_else(String::new, |p| p.scalar.name().to_string());
            let sizes = if leaf.path.is_empty() { Vec::new() } else { own.dims.to_vec() };
            (leaf.path, leaf.flow, scalar, sizes, unit.map_or_else(String::new, |unit| unit.to_string()))
        };
        self.leaves(connector).into_iter().map(kind).collect()
    }

    /// Whether some `connect` names the connector, which is part of another one, or a part of it.
    fn is_connected_inside(&self, part: InstId) -> bool {
        let instance = &self.scopes.instances[part];
        let inside = || instance.children.iter().any(|&child| self.is_connected_inside(child));
        instance.kind == ClassKind::Connector && (self.connections.range(part).is_some() || inside())
    }

    /// Whether a component declares the connector protected; what is inside a protected component counts as protected too.
    fn is_hidden_in(&self, owner: InstId, connector: InstId) -> bool {
        let instances = &self.scopes.instances;
        instances[connector].protected && (!instances[owner].protected || self.scopes.is_declared_protected(connector))
    }

    /// Whether the connector, what it is part of or the component says that it may stay open, or that it must not: that is an
    /// error of its own.
    fn is_ruled(&self, end: &OpenEnd) -> bool {
        let mut inner: Option<InstId> = None;
        let mut at = Some(end.connector);
        while let Some(inst) = at {
            let name = inner.map_or("", |inner| &self.scopes.instances[inner].name);
            let rules = self.tree.connection_rules.get(&inst);
            if rules.is_some_and(|rules| rules.leaves_open(name) || rules.must_connect.is_some()) {
                return true;
            }
            (inner, at) = (Some(inst), self.scopes.instances[inst].parent.filter(|_| inst != end.owner));
        }
        false
    }

    /// Whether some `connect` around the component names the connector.
    fn is_named(&self, end: &OpenEnd, connects: &mut Connects) -> bool {
        let instances = &self.scopes.instances;
        let mut path = instances[end.connector].name.to_string();
        let mut at = instances[end.connector].parent;
        while let Some(inst) = at {
            // A `connect` inside the component sees the other face of the connector.
            let around = !path.is_empty() && self.is_around(inst, end.owner);
            if let (true, Some(shape)) = (around, &instances[inst].shape) {
                let named = shape.frames.iter().any(|frame| {
                    let class = frame.class;
                    connects.entry(class).or_insert_with(|| self.connects_of(class)).contains(&path)
                });
                if named {
                    return true;
                }
            }
            path = format!("{}.{path}", instances[inst].name);
            at = instances[inst].parent;
        }
        false
    }

    /// Whether an instance is one that the component is declared in, or one around that.
    fn is_around(&self, inst: InstId, component: InstId) -> bool {
        let mut at = self.scopes.instances[component].parent;
        while let Some(above) = at {
            if above == inst {
                return true;
            }
            at = self.scopes.instances[above].parent;
        }
        false
    }

    pub(super) fn connects_of(&self, class: ClassId) -> FxHashSet<String> {
        let mut named = Named::default();
        if let ClassBody::Long { equations, .. } = &self.scopes.table.class(class).def.body {
            equations.iter().flat_map(|section| &section.equations).for_each(|equation| named.equation(equation));
        }
        named.0
    }

    /// One warning for a declaration: `nothing is connected to ...`.
    fn open_warning(&self, declared: Span, ends: &[OpenEnd]) -> Diagnostic {
        let mut names = Vec::new();
        for end in ends {
            names.extend(element_names(&self.scopes.instances, end.connector, &end.open));
        }
        let single = ends.iter().map(|end| end.open.iter().filter(|&&open| open).count()).sum::<usize>() == 1;
        let message = format!(
            "nothing is connected to {}, so nothing flows through {}",
            listed(&names),
            if single { "it" } else { "them" }
        );
        let mut connectors: Vec<String> = Vec::new();
        for end in ends {
            let name = format!("\"{}\"", self.outermost(end));
            if !connectors.contains(&name) {
                connectors.push(name);
            }
        }
        let open = match connectors.as_slice() {
            [only] => only.clone(),
            several => format!("{{{}}}", several.join(", ")),
        };
        let component = &self.scopes.instances[ends[0].owner].name;
        let (them, they) = if single { ("it", "it stays") } else { ("them", "they stay") };
        Diagnostic::warning(Code::OpenConnector, message).at(declared, "").help(format!(
            "connect {them} or, if {they} open on purpose, add `annotation(__hyd(open = {open}))` to the declaration of \
             `{component}`"
        ))
    }

    /// The name that the component gives the connector, or what it is part of.
    fn outermost(&self, end: &OpenEnd) -> &str {
        let mut at = end.connector;
        while let Some(above) = self.scopes.instances[at].parent.filter(|&above| above != end.owner) {
            at = above;
        }
        &self.scopes.instances[at].name
    }

    /// Errors where `mustBeConnected` or `mayOnlyConnectOnce` is broken.
    fn check_connection_rules(&mut self) {
        let rules: Vec<(InstId, _)> = self.tree.connection_rules.iter().map(|(&i, rules)| (i, rules.clone())).collect();
        for (inst, rules) in rules {
            // The connectors of the model itself have no outside.
            let Some(owner) = self.scopes.instances[inst].parent.filter(|&owner| owner != self.tree.root) else {
                continue;
            };
            for (annotation, reason) in rules.of_language() {
                let must = annotation == MUST_BE_CONNECTED;
                let broken = self.elements_that_break(inst, must);
                if !broken.contains(&true) {
                    continue;
                }
                let names = listed(&element_names(&self.scopes.instances, inst, &broken));
                let demand = if must { "must be connected" } else { "may be connected to one connector only" };
                let mut error = Diagnostic::error(Code::ConnectionRule, format!("{names} {demand}: {reason}"));
                error = error.at(self.scopes.instances[owner].span, "");
                let elements = self.connections.range(inst).into_iter().flatten();
                let first = broken.iter().zip(elements).filter(|(broken, _)| **broken);
                if let Some(span) = first.filter_map(|(_, element)| self.connections.joined_at(element)).next() {
                    error = error.with(span, "connected here");
                }
                let declared = self.scopes.instances[inst].span;
                self.report(error.with(declared, format!("`{annotation}` stands here")));
            }
        }
    }

    /// The elements of a connector that are not connected (`must`), or to more than one other connector.
    fn elements_that_break(&self, inst: InstId, must: bool) -> Vec<bool> {
        let count: usize = hyd_instance::instance::full_dims(&self.scopes.instances, inst).iter().product();
        let own = self.connections.range(inst);
        let mut broken: Vec<bool> = (0..count as u32)
            .map(|k| match &own {
                Some(own) if must => self.connections.is_open(own.start + k),
                Some(own) => self.connections.partners(own.start + k) > 1,
                None => must,
            })
            .collect();
        // A part of a connector is connected with the whole, and the whole with any of its parts.
        let mut at = self.scopes.instances[inst].parent;
        while let Some(whole) = at.filter(|&whole| must && self.scopes.instances[whole].kind == ClassKind::Connector) {
            if let Some(range) = self.connections.range(whole) {
                let each = count / range.len().max(1);
                for (k, broken) in broken.iter_mut().enumerate() {
                    *broken &= self.connections.is_open(range.start + (k / each.max(1)) as u32);
                }
            }
            at = self.scopes.instances[whole].parent;
        }
        let inside = |&part: &InstId| self.is_connected_inside(part);
        if must && self.scopes.instances[inst].children.iter().any(inside) {
            broken.fill(false);
        }
        broken
    }

    /// Errors for annotations about connections that say nothing: `__hyd(open = {...})` with names that are not connectors of the
    /// component, and rules of the language at what is not a connector.
    fn check_annotations(&mut self) {
        let mut errors = Vec::new();
        for (&inst, rules) in &self.tree.connection_rules {
            let instance = &self.scopes.instances[inst];
            if instance.kind != ClassKind::Connector {
                errors.extend(rules.of_language().map(|(annotation, _)| {
                    let message = format!("`{annotation}` applies to connectors, and `{}` is not one", instance.name);
                    Diagnostic::error(Code::Misplaced, message).at(instance.span, "")
                }));
            }
            let Open::Named(names) = &rules.open else { continue };
            let connectors: Vec<&str> = instance
                .children
                .iter()
                .map(|&child| &self.scopes.instances[child])
                // The class of one that is absent is not looked at.
                .filter(|child| child.kind == ClassKind::Connector || child.absent)
                .map(|child| &*child.name)
                .collect();
            for (name, span) in names.iter().filter(|(name, _)| !connectors.contains(&&**name)) {
                let message = format!("`{}` has no connector `{name}`", instance.name);
                let help = did_you_mean(name, connectors.iter().copied());
                errors.push(Diagnostic::error(Code::UnknownName, message).at(*span, "").maybe_help(help));
            }
        }
        errors.into_iter().for_each(|error| self.report(error));
    }
}

/// Names in backquotes, the first few of them.
fn listed(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(MOST_NAMED).map(|name| format!("`{name}`")).collect();
    let more = names.len() - shown.len();
    let text = shown.join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// What connections name.
#[derive(Default)]
struct Named(FxHashSet<String>);

impl Visitor for Named {
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        if role == Role::Connected {
            let mut path = String::new();
            for part in &reference.parts {
                if !path.is_empty() {
                    path.push('.');
                }
                path.push_str(&part.name.name);
                self.0.insert(path.clone());
            }
        }
    }
}
