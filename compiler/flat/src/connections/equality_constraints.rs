//! Overdetermined records in connections: which there are in a connector, and the equations of connections that are broken.
//!
//! A record is overdetermined if its class declares a function `equalityConstraint` (Modelica 3.6, section 9.4.2): it has more
//! variables than degrees of freedom, and the function gives as many numbers as there are of these, zero where two of them are equal.

use std::rc::Rc;

use hyd_instance::{InstId, Scope};
use hyd_source::{Origin, Span};
use hyd_syntax::tree::{ClassKind, ComponentRef, Ident, Name, Path, RefPart};
use hyd_typed::{Call, Callee, Expr, Kind};

use crate::connections::virtual_graph::Node;
use crate::model::Section;
use crate::state::flattener::Flattener;
use crate::state::index::Affine;

/// The function that compares two records of a class, by the specification.
const EQUALITY_CONSTRAINT: &str = "equalityConstraint";

/// An overdetermined record of a connector.
pub(crate) struct Record {
    pub(crate) inst: InstId,
    /// Its path inside the connector.
    pub(crate) path: Name,
    /// Its elements for each element of the connector.
    pub(crate) count: u32,
}

impl Record {
    /// Whether a variable of the connector is part of the record.
    pub(crate) fn has(&self, variable: &Name) -> bool {
        variable.strip_prefix(&*self.path).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }
}

impl Flattener<'_, '_> {
    /// The overdetermined records of a connector, those of connectors in it included.
    pub(crate) fn overdetermined_records(&mut self, connector: InstId) -> Rc<[Record]> {
        if let Some(known) = self.records.get(&connector) {
            return known.clone();
        }
        let mut found = Vec::new();
        self.collect_records(connector, "", 1, &mut found);
        let found: Rc<[Record]> = found.into();
        self.records.insert(connector, found.clone());
        found
    }

    fn collect_records(&mut self, inst: InstId, path: &str, count: usize, found: &mut Vec<Record>) {
        for child in self.scopes.instances[inst].children.clone() {
            let instance = &self.scopes.instances[child];
            if instance.absent || instance.primitive.is_some() {
                continue;
            }
            let below = if path.is_empty() { instance.name.to_string() } else { format!("{path}.{}", instance.name) };
            let count = count * instance.dims.iter().product::<usize>();
            let declares = |shape: &hyd_instance::shape::Shape| shape.by_name.contains_key(EQUALITY_CONSTRAINT);
            if instance.kind == ClassKind::Record && instance.shape.as_deref().is_some_and(declares) {
                found.push(Record { inst: child, path: below.into(), count: count as u32 });
            } else {
                self.collect_records(child, &below, count, found);
            }
        }
    }

    /// The equations `equalityConstraint(a, b) = 0` of broken connections.
    pub(crate) fn equality_constraints(&mut self) {
        for (nodes, span) in self.graph.broken() {
            let root = self.tree.root;
            let start = self.context_of(Scope { inst: root, frame: 0 });
            self.with_loops(start, &mut |flat, cx| {
                let call = flat.constraint_call(nodes, span)?;
                let shape = flat.shape(&call, cx)?;
                if shape.iter().product::<usize>() == 0 {
                    return flat.call_for_checks(span, &call, cx, true);
                }
                let index: Vec<Affine> = shape.iter().map(|&size| cx.counter(size)).collect();
                cx.may_add_variables = true;
                let residue = flat.lower(&call, cx, &index)?;
                let zero = flat.model.templates.arena.constant(0.0);
                let origin = Origin { path: flat.path(root), span };
                flat.emit(Section::Continuous, zero, residue.node, &cx.loop_counts(), &origin);
                Ok(())
            });
        }
    }

    fn constraint_call(&mut self, nodes: [Node; 2], span: Span) -> Result<Expr, crate::state::context::Fail> {
        let name = Ident { name: EQUALITY_CONSTRAINT.into(), span };
        let path = Path { global: false, parts: vec![name.clone()], span };
        let function = self.scopes.find_class(Scope { inst: nodes[0].0, frame: 0 }, &path)?;
        let positional: Vec<Expr> = nodes.iter().map(|&node| self.record_at(node, span)).collect();
        let root = Scope { inst: self.tree.root, frame: 0 };
        let part = RefPart { name, subscripts: Vec::new() };
        let name = Rc::new(ComponentRef { global: false, parts: vec![part], span });
        let ty = self.elaborator(root, None).type_of_outputs(&function)?;
        let call = Call { function: Callee::Class(function), name, positional, named: Vec::new() };
        Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span })
    }

    /// One element of a record, seen from the model.
    fn record_at(&mut self, (inst, element): Node, span: Span) -> Expr {
        let mut rest = element as usize;
        let mut at: Vec<usize> = hyd_instance::instance::full_dims(&self.scopes.instances, inst);
        for size in at.iter_mut().rev() {
            let own = rest % *size;
            rest /= *size;
            *size = own;
        }
        let root = Scope { inst: self.tree.root, frame: 0 };
        self.elaborator(root, None).element(inst, &at, span)
    }
}
