//! Reading and setting the variables of a body (see `body`): registers, and arrays at subscripts computed in the run.
//!
//! All values of an assignment are taken before any register changes.  A computed subscript reads or writes memory with a
//! check; with several dimensions each subscript is checked against its own size.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Node, NodeId, Step};
use hyd_syntax::tree::Name;
use hyd_typed::{Expr, Kind};

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    /// `target := value` on registers.
    pub(crate) fn assign_in_body(&mut self, target: &Expr, value: Local, cx: &mut Context) -> Result<(), Fail> {
        let Kind::Local(path) = &target.kind else {
            return Err(self.error(Code::Misplaced, target.span, "only variables can be assigned"));
        };
        let name = path.name();
        if cx.inputs.contains(name) {
            return Err(self.error(Code::Misplaced, target.span, format!("the input `{name}` cannot be assigned")));
        }
        if cx.local(name).is_none() {
            let message = format!("`{name}` is not declared in this function");
            return Err(self.error(Code::UnknownName, target.span, message));
        }
        let (whole, subscripts) = self.leaf_of_path(path, cx)?;
        match whole {
            Local::Array(items, shape) if !subscripts.is_empty() => {
                self.store(target.span, &items, &shape, &subscripts, value, cx)
            }
            Local::Records(fields, _) if !subscripts.is_empty() => {
                let value = self.held_local(value);
                self.store_records(target.span, &fields, &subscripts, value, cx)
            }
            _ => self.set_whole(target.span, &whole, value),
        }
    }

    /// `p[i] := record`: field by field, all values taken before.
    fn store_records(
        &mut self,
        span: Span,
        fields: &[(Name, Local)],
        subscripts: &[Expr],
        value: Local,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let values = self.fields_of(span, value)?;
        for (name, field) in fields {
            let Some((_, value)) = values.iter().find(|(n, _)| n == name).cloned() else {
                return Err(self.error(Code::TypeMismatch, span, format!("the value has no field `{name}`")));
            };
            match field {
                Local::Array(items, shape) => self.store(span, items, shape, subscripts, value, cx)?,
                Local::Records(inner, _) => self.store_records(span, inner, subscripts, value, cx)?,
                _ => return Err(Fail::Reported),
            }
        }
        Ok(())
    }

    /// A value in registers of its own.
    pub(crate) fn held_local(&mut self, value: Local) -> Local {
        let mut typed = |typed: Typed| Typed { node: self.held(typed.node), scalar: typed.scalar };
        match value {
            Local::Node(one) => Local::Node(typed(one)),
            Local::Array(items, shape) => Local::array(items.iter().cloned().map(typed).collect(), shape),
            Local::Record(fields) => Local::Record(fields.into_iter().map(|(n, f)| (n, self.held_local(f))).collect()),
            Local::Records(fields, shape) => {
                Local::Records(fields.into_iter().map(|(n, f)| (n, self.held_local(f))).collect(), shape)
            }
            other => other,
        }
    }

    fn set_whole(&mut self, span: Span, whole: &Local, value: Local) -> Result<(), Fail> {
        let mut pairs = Vec::new();
        self.pairs(span, whole, &value, &mut pairs)?;
        self.set_together(pairs);
        Ok(())
    }

    /// Registers and the values they take.
    fn pairs(&mut self, span: Span, whole: &Local, value: &Local, pairs: &mut Vec<(u32, NodeId)>) -> Result<(), Fail> {
        match (whole, value) {
            (Local::Array(items, shape), Local::Array(values, other)) => {
                self.check_same_sizes("the sides of this assignment", span, shape, other)?;
                for (item, value) in items.iter().zip(values.iter()) {
                    pairs.push((self.register_of(span, item)?, value.node));
                }
            }
            (Local::Record(fields), Local::Record(values)) | (Local::Records(fields, _), Local::Records(values, _)) => {
                for (name, field) in fields {
                    let Some((_, value)) = values.iter().find(|(n, _)| n == name) else {
                        return Err(self.error(Code::TypeMismatch, span, format!("the value has no field `{name}`")));
                    };
                    self.pairs(span, field, value, pairs)?;
                }
            }
            (Local::Node(item), value) => {
                let given = self.as_node(span, value)?;
                if matches!(item.scalar, ScalarType::Integer) && matches!(given.scalar, ScalarType::Real) {
                    let message = "a Real value is assigned to an Integer";
                    return Err(self.error(Code::TypeMismatch, span, message));
                }
                pairs.push((self.register_of(span, item)?, given.node));
            }
            _ => {
                let message = "the sides of this assignment have different sizes or types";
                return Err(self.error(Code::ArrayShape, span, message));
            }
        }
        Ok(())
    }

    fn register_of(&mut self, span: Span, item: &Typed) -> Result<u32, Fail> {
        match self.model.templates.arena.node(item.node) {
            Node::Slot(slot) => Ok(slot.0),
            _ => Err(self.error(Code::Misplaced, span, "only variables can be assigned")),
        }
    }

    /// All values are taken before any register changes.
    fn set_together(&mut self, mut pairs: Vec<(u32, NodeId)>) {
        if pairs.len() > 1 {
            for (_, node) in &mut pairs {
                if self.model.templates.arena.as_constant(*node).is_none() {
                    *node = self.held(*node);
                }
            }
        }
        pairs.into_iter().for_each(|(register, node)| self.step(Step::Set(register, node)));
    }

    /// `a[i] := value`, `a[i, :] := value`.
    fn store(
        &mut self,
        span: Span,
        items: &[Typed],
        shape: &[usize],
        subscripts: &[Expr],
        value: Local,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let mut offsets = vec![self.model.templates.arena.constant(0.0)];
        for (position, &size) in self.positions_in(shape, subscripts, cx)?.iter().zip(shape) {
            offsets = self.shifted(&offsets, position, size, shape.len() > 1);
        }
        let values = self.values_of(span, value)?;
        if values.len() != offsets.len() {
            let message = format!("{} values are given to {} elements", values.len(), offsets.len());
            return Err(self.error(Code::ArrayShape, span, message));
        }
        let Some(first) = items.first() else { return Ok(()) };
        let (first, count) = (self.register_of(span, first)?, items.len() as u32);
        let mut nodes: Vec<NodeId> = values.iter().map(|value| value.node).collect();
        if nodes.len() > 1 {
            nodes = nodes.into_iter().map(|node| self.held(node)).collect();
        }
        for (offset, value) in offsets.into_iter().zip(nodes) {
            match self.model.templates.arena.as_constant(offset) {
                Some(k) => self.step(Step::Set(first + k as u32, value)),
                None => self.step(Step::Store { first, count, index: offset, value }),
            }
        }
        Ok(())
    }
}
