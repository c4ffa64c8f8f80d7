//! Expandable connectors (Modelica 3.6, section 9.1.3): buses whose elements come from what is connected to them.
//!
//! When all components are there, the `connect` equations are read once: an element that a bus does not declare is made like the connector at
//! the other end, and buses that are connected have the elements of both.  So later stages see connectors like any other.  An element
//! has no direction of its own; where nothing but buses is connected to one, nothing is said of it (the flattener gives it a value).

use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassBody, ClassKind, ComponentRef, Equation, EquationKind, Name};

use crate::instantiation::instance::{InstId, Instance, Primitive};
use crate::instantiation::scopes::Scopes;

/// A `connect` in a component.
struct Connect {
    inst: InstId,
    sides: [ComponentRef; 2],
}

/// What a side of a `connect` names.
enum Side {
    /// A component that exists, and how many of its dimensions have subscripts.
    Made(InstId, usize),
    /// An element that a bus does not have, and whether it has subscripts.
    Missing(InstId, Name, Span, bool),
    /// Something else: it is absent, or wrong, which is said elsewhere.
    Other,
}

impl Scopes<'_> {
    /// Adds what is connected to expandable connectors to them.
    pub(crate) fn expand_connectors(&mut self) {
        if !self.instances.tree().components.iter().any(|instance| instance.expandable) {
            return;
        }
        let connects = self.connects();
        // Each round adds elements, of which there are only so many names.
        let mut added = true;
        while added {
            added = false;
            for connect in &connects {
                added |= self.expand(connect);
            }
        }
        for connect in &connects {
            for side in &connect.sides {
                if let Side::Missing(bus, name, span, _) = self.side(connect.inst, side) {
                    let message = format!("nothing says what `{name}` is: no connector is connected to it");
                    let declared = self.instances[bus].span;
                    let diagnostic = Diagnostic::error(Code::ConnectorMismatch, message).at(span, "");
                    self.table.report(diagnostic.with(declared, "an element of this bus"));
                    self.broken(bus, &name, span);
                }
            }
        }
    }

    fn connects(&self) -> Vec<Connect> {
        let mut found = Vec::new();
        for inst in self.instances.tree().components.indices() {
            let instance = &self.instances[inst];
            if instance.kind == ClassKind::Package || instance.absent {
                continue;
            }
            let Some(shape) = &instance.shape else { continue };
            for frame in &shape.frames {
                let ClassBody::Long { equations, .. } = &self.table.class(frame.class).def.body else { continue };
                equations.iter().for_each(|section| collect(inst, &section.equations, &mut found));
            }
        }
        found
    }

    /// Adds what a `connect` says of the elements of buses; true if something was added.
    fn expand(&mut self, connect: &Connect) -> bool {
        let [left, right] = [0, 1].map(|k| self.side(connect.inst, &connect.sides[k]));
        match (left, right) {
            (Side::Missing(bus, name, span, indexed), Side::Made(of, subscripts))
            | (Side::Made(of, subscripts), Side::Missing(bus, name, span, indexed)) => {
                if indexed {
                    let message = format!("the sizes of `{name}` are not known: the bus has to declare it");
                    self.table.report(Diagnostic::error(Code::OutsideProfile, message).at(span, ""));
                    // One that is there is not asked for again.
                    self.broken(bus, &name, span);
                    return true;
                }
                let dims = self.instances[of].dims.get(subscripts..).unwrap_or(&[]).to_vec();
                self.copy_connector(of, bus, &name, dims);
                true
            }
            (Side::Made(a, _), Side::Made(b, _)) => self.unite(a, b),
            _ => false,
        }
    }

    /// Two buses that are connected have the same elements.
    fn unite(&mut self, a: InstId, b: InstId) -> bool {
        if !self.instances[a].expandable || !self.instances[b].expandable {
            return false;
        }
        let mut added = false;
        for (from, to) in [(a, b), (b, a)] {
            for child in self.instances[from].children.clone() {
                if self.instances[child].absent {
                    continue;
                }
                let name = self.instances[child].name.clone();
                match self.instances[to].by_name.get(&name).copied() {
                    None => {
                        let dims = self.instances[child].dims.clone();
                        self.copy_connector(child, to, &name, dims);
                        added = true;
                    }
                    Some(same) => added |= self.unite(child, same),
                }
            }
        }
        added
    }

    /// Makes an element of a bus like a connector.
    fn copy_connector(&mut self, of: InstId, parent: InstId, name: &Name, dims: Vec<usize>) {
        let span = self.instances[of].span;
        let copy = self.instances.add(Instance::new(name.clone(), Some(parent), span));
        let source = self.instances[of].clone();
        let target = self.instances.edit(copy);
        target.class = source.class;
        target.context = source.context;
        target.shape = source.shape;
        target.kind = source.kind;
        target.dims = dims;
        target.local_classes = source.local_classes;
        target.variability = source.variability;
        target.flow = source.flow;
        target.stream = source.stream;
        target.expandable = source.expandable;
        target.description = source.description;
        target.primitive = source.primitive.map(|primitive| Primitive { binding: None, is_final: false, ..primitive });
        self.instances.edit(parent).children.push(copy);
        self.instances.edit(parent).by_name.insert(name.clone(), copy);
        for child in source.children {
            if !self.instances[child].absent {
                let (name, dims) = (self.instances[child].name.clone(), self.instances[child].dims.clone());
                self.copy_connector(child, copy, &name, dims);
            }
        }
    }

    fn side(&self, scope: InstId, reference: &ComponentRef) -> Side {
        let mut at = scope;
        for (k, part) in reference.parts.iter().enumerate() {
            let name = &part.name.name;
            let Some(&next) = self.instances[at].by_name.get(name) else {
                let is_last = k + 1 == reference.parts.len();
                if is_last && k > 0 && self.instances[at].expandable {
                    return Side::Missing(at, name.clone(), part.name.span, !part.subscripts.is_empty());
                }
                return Side::Other;
            };
            if self.instances[next].absent {
                return Side::Other;
            }
            at = next;
        }
        let subscripts = reference.parts.last().map_or(0, |part| part.subscripts.len());
        if at == scope { Side::Other } else { Side::Made(at, subscripts) }
    }
}

/// The `connect` equations among these, those in loops and branches too.
fn collect(inst: InstId, equations: &[Equation], found: &mut Vec<Connect>) {
    for equation in equations {
        match &equation.kind {
            EquationKind::Connect(a, b) => found.push(Connect { inst, sides: [a.clone(), b.clone()] }),
            EquationKind::For(_, body) => collect(inst, body, found),
            EquationKind::If(branches) => branches.iter().for_each(|(_, body)| collect(inst, body, found)),
            _ => {}
        }
    }
}
