//! Components whose two ends are joined to each other: a damper with both flanges at one mass, a resistance with both pins at one node.
//!
//! Nothing can differ between their ends, and most then do nothing: the model runs as if they were not there, without a word.  One warning each for
//! components of the user's own text; what a library joins inside its classes is its own matter.  What stores something (a wall between a room and itself, a
//! motor that is braked by a short circuit) acts all the same and is left alone.

use hyd_instance::InstId;
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassBody, ClassKind, ComponentRef};
use hyd_syntax::visit::{Role, Visitor};
use rustc_hash::FxHashMap;

use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// Warnings about components that have two connectors of a kind, and both in one set.
    pub(crate) fn check_short_circuits(&mut self) {
        let instances = &self.scopes.instances;
        let text = [self.scopes.table.main, Some(instances[self.tree.root].span.file)];
        let mut ends: FxHashMap<InstId, Vec<InstId>> = FxHashMap::default();
        for (inst, _) in self.connections.ranges() {
            let Some(owner) = instances[inst].parent.filter(|&parent| parent != self.tree.root) else { continue };
            let is_component = matches!(instances[owner].kind, ClassKind::Model | ClassKind::Block | ClassKind::Class);
            if is_component && text.contains(&Some(instances[owner].span.file)) {
                ends.entry(owner).or_default().push(inst);
            }
        }
        let mut found: Vec<(Span, String)> = Vec::new();
        for (owner, joined) in ends.into_iter().filter(|(_, joined)| joined.len() > 1) {
            let Some([one, other]) = self.alike_ends(owner) else { continue };
            // What another end is joined to may feel it: the flange of a piston whose two sides have one pressure.
            let feels = |end: &InstId| {
                *end != one
                    && *end != other
                    && self.leaves(*end).iter().any(|leaf| leaf.flow)
                    && self
                        .connections
                        .range(*end)
                        .is_some_and(|mut own| own.any(|element| !self.connections.is_open(element)))
            };
            if joined.iter().any(feels) {
                continue;
            }
            if self.has_rates(owner) {
                continue;
            }
            if joined.contains(&one) && joined.contains(&other) && self.meet(one, other) {
                let instances = &self.scopes.instances;
                let [name, one, other] = [owner, one, other].map(|inst| instances[inst].name.clone());
                let message = format!(
                    "`{name}.{one}` and `{name}.{other}` are connected to each other, so no difference between them acts on `{name}`"
                );
                found.push((instances[owner].span, message));
            }
        }
        found.sort_by_key(|(declared, _)| (declared.file, declared.start));
        for (declared, message) in found {
            let help = "connect one of the two elsewhere, or remove the component";
            self.report(Diagnostic::warning(Code::ShortCircuit, message).at(declared, "").help(help));
        }
    }

    /// Whether a rate stands in the equations of a component or of what it is made of.
    fn has_rates(&self, owner: InstId) -> bool {
        let mut rates = Rates::default();
        let mut open = vec![owner];
        while let Some(inst) = open.pop().filter(|_| !rates.found) {
            let instance = &self.scopes.instances[inst];
            open.extend(&instance.children);
            for frame in instance.shape.iter().flat_map(|shape| &shape.frames) {
                if let ClassBody::Long { equations, .. } = &self.scopes.table.class(frame.class).def.body {
                    equations.iter().flat_map(|section| &section.equations).for_each(|own| rates.equation(own));
                }
            }
        }
        rates.found
    }

    /// The two connectors of a component that have the same variables with a flow among them, if no third one has.
    fn alike_ends(&self, owner: InstId) -> Option<[InstId; 2]> {
        let instances = &self.scopes.instances;
        let is_end = |&child: &InstId| instances[child].kind == ClassKind::Connector && !instances[child].absent;
        let mut kinds: FxHashMap<Vec<(String, bool)>, Vec<InstId>> = FxHashMap::default();
        for &child in instances[owner].children.iter().filter(|child| is_end(child)) {
            let leaves = self.leaves(child);
            if leaves.iter().any(|leaf| leaf.flow) && leaves.iter().any(|leaf| !leaf.flow) {
                let kind = leaves.iter().map(|leaf| (leaf.path.to_string(), leaf.flow)).collect();
                kinds.entry(kind).or_default().push(child);
            }
        }
        // A port of heat may stand beside two pins; of two pairs (a transformer, a gear with a support) it is not known which one matters.
        let mut several = kinds.into_values().filter(|ends| ends.len() > 1);
        match (several.next().as_deref(), several.next()) {
            (Some(&[one, other]), None) => Some([one, other]),
            _ => None,
        }
    }

    /// Whether two connectors are in one set, seen from outside of their component.
    fn meet(&mut self, one: InstId, other: InstId) -> bool {
        match (self.connections.range(one), self.connections.range(other)) {
            // Elements of arrays may each be joined elsewhere.
            (Some(one), Some(other)) if one.len() == 1 && other.len() == 1 => {
                self.connections.are_joined(one.start, other.start)
            }
            _ => false,
        }
    }
}

/// Looks for `der`.
#[derive(Default)]
struct Rates {
    found: bool,
}

impl Visitor for Rates {
    fn reference(&mut self, reference: &ComponentRef, _: Role) {
        self.found |= matches!(&reference.parts[..], [only] if &*only.name.name == "der");
    }
}
