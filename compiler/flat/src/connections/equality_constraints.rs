//! Overdetermined records in connections: which there are in a connector, and the equations of connections that are broken.
//!
//! A record is overdetermined if its class declares a function `equalityConstraint` (Modelica 3.6, section 9.4.2): it has more
//! variables than degrees of freedom, and the function gives as many numbers as there are of these, zero where two of them are equal.

use std::rc::Rc;

use hyd_instance::{InstId, LocalClass, Scope};
use hyd_source::{Origin, Span};
use hyd_syntax::tree::{ClassKind, ComponentRef, Direction, Ident, Name, Path, RefPart};
use hyd_typed::{Call, Callee, Expr, Kind, Type};

use crate::connections::virtual_graph::Node;
use crate::model::Section;
use crate::state::context::Fail;
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
            if instance.absent || instance.primitive.is_some() && !self.is_overdetermined_type(child) {
                continue;
            }
            let instance = &self.scopes.instances[child];
            let below = if path.is_empty() { instance.name.to_string() } else { format!("{path}.{}", instance.name) };
            let count = count * instance.dims.iter().product::<usize>();
            let declares = |shape: &hyd_instance::shape::Shape| shape.by_name.contains_key(EQUALITY_CONSTRAINT);
            let is_record = instance.kind == ClassKind::Record && instance.shape.as_deref().is_some_and(declares);
            if is_record || instance.primitive.is_some() {
                found.push(Record { inst: child, path: below.into(), count: count as u32 });
            } else {
                self.collect_records(child, &below, count, found);
            }
        }
    }

    /// A variable whose type declares the function: `type Angle extends Real; function equalityConstraint ...`
    fn is_overdetermined_type(&mut self, inst: InstId) -> bool {
        let Some(class) = self.scopes.instances[inst].class else { return false };
        let shape = self.scopes.quietly(|scopes| scopes.table.shape(class));
        shape.is_ok_and(|shape| shape.by_name.contains_key(EQUALITY_CONSTRAINT))
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

    fn constraint_call(&mut self, nodes: [Node; 2], span: Span) -> Result<Expr, Fail> {
        let name = Ident { name: EQUALITY_CONSTRAINT.into(), span };
        let path = Path { global: false, parts: vec![name.clone()], span };
        let instance = &self.scopes.instances[nodes[0].0];
        let of_type = instance.class.filter(|_| instance.primitive.is_some());
        let function = match (of_type, instance.context) {
            (Some(class), context) => {
                let class = self.scopes.table.descend(class, &path.parts)?;
                LocalClass { class, mods: Vec::new(), context }
            }
            (None, _) => self.scopes.find_class(Scope { inst: nodes[0].0, frame: 0 }, &path)?,
        };
        let mut positional: Vec<Expr> = nodes.iter().map(|&node| self.record_at(node, span)).collect();
        if of_type.is_some() && self.takes_arrays(&function)? {
            for one in &mut positional {
                let ty = Type { rank: one.ty.rank + 1, ..one.ty.clone() };
                *one = Expr { kind: Kind::Array(vec![one.clone()]), ty, span };
            }
        }
        let root = Scope { inst: self.tree.root, frame: 0 };
        let part = RefPart { name, subscripts: Vec::new() };
        let name = Rc::new(ComponentRef { global: false, parts: vec![part], span });
        let ty = self.elaborator(root, None).type_of_outputs(&function)?;
        let call = Call { function: Callee::Class(function), name, positional, named: Vec::new() };
        Ok(Expr { kind: Kind::Call(Box::new(call)), ty, span })
    }

    /// The function of a type that stands for whole arrays of its variables.
    fn takes_arrays(&mut self, function: &LocalClass) -> Result<bool, Fail> {
        let shape = self.scopes.table.shape(function.class)?;
        let inst = self.scopes.package_of(function)?;
        let components = self.scopes.function_components(inst, &shape)?;
        let input = components.iter().find(|own| own.component.direction == Some(Direction::Input));
        Ok(input.is_some_and(|own| !own.component.dims.is_empty()))
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
