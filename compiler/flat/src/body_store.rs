//! Reading and setting the variables of a body (see `body`): registers, and arrays at subscripts computed in the run.
//!
//! All values of an assignment are taken before any register changes.  A computed subscript reads or writes memory with a
//! check; with several dimensions each subscript is checked against its own size.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Node, NodeId, Relation, SlotId, Step};
use hyd_syntax::tree::{ComponentRef, Expr, ExprKind, Name};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;
use crate::reference::Subscript;

/// One subscript inside a body.
enum Position {
    /// Elements named by position from 0.
    Known(Vec<usize>, bool),
    /// A number from 1, computed in the run.
    Computed(NodeId),
}

impl Flattener<'_, '_> {
    /// `target := value` on registers.
    pub(crate) fn assign_in_body(&mut self, target: &ComponentRef, value: Local, cx: &mut Context) -> Result<(), Fail> {
        let name = &target.parts[0].name.name;
        if cx.inputs.contains(name) {
            return Err(self.error(Code::Misplaced, target.span, format!("the input `{name}` cannot be assigned")));
        }
        if cx.local(name).is_none() {
            let message = format!("`{name}` is not declared in this function");
            return Err(self.error(Code::UnknownName, target.span, message));
        }
        let (whole, subscripts) = self.leaf_of_path(target, cx)?;
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
    fn held_local(&mut self, value: Local) -> Local {
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

    /// The subscripts of an array, one per dimension.
    fn positions_in(&mut self, shape: &[usize], subscripts: &[Expr], cx: &mut Context) -> Result<Vec<Position>, Fail> {
        let mut list = Vec::with_capacity(shape.len());
        for (k, &size) in shape.iter().enumerate() {
            let Some(expr) = subscripts.get(k) else {
                list.push(Position::Known((0..size).collect(), true));
                continue;
            };
            if self.shape(expr, cx)?.is_empty() && !matches!(expr.kind, ExprKind::Colon) {
                cx.ends.push(size);
                let value = self.lower(expr, cx, &[]);
                cx.ends.pop();
                let value = value?;
                if self.model.templates.arena.as_constant(value.node).is_none() {
                    let arena = &mut self.model.templates.arena;
                    let shift = arena.constant(f64::from(u8::from(matches!(value.scalar, ScalarType::Boolean))));
                    list.push(Position::Computed(arena.add(value.node, shift)));
                    continue;
                }
            }
            let positions: Vec<i64> = match self.subscript(expr, size, cx)? {
                Subscript::At(at) => {
                    let at = at.as_constant().ok_or(Fail::NeedsExpansion)?;
                    if at < 0 || at as usize >= size {
                        return Err(self.outside(expr.span, "", at + 1, size));
                    }
                    list.push(Position::Known(vec![at as usize], false));
                    continue;
                }
                Subscript::All => (0..size as i64).collect(),
                Subscript::Slice { start, step, count } => {
                    let start = start.as_constant().ok_or(Fail::NeedsExpansion)?;
                    (0..count as i64).map(|k| start + step * k).collect()
                }
                Subscript::List(list) => list,
            };
            if let Some(&k) = positions.iter().find(|&&k| k < 0 || k as usize >= size) {
                return Err(self.outside(expr.span, "", k + 1, size));
            }
            list.push(Position::Known(positions.into_iter().map(|k| k as usize).collect(), true));
        }
        Ok(list)
    }

    /// True if a subscript of an array of a function is computed in the run; then the function must be a body.
    pub(crate) fn computed_subscripts(
        &mut self,
        shape: &[usize],
        subscripts: &[Expr],
        cx: &mut Context,
    ) -> Result<bool, Fail> {
        for (expr, &size) in subscripts.iter().zip(shape) {
            if self.is_computed(expr, size, cx)? {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// True in a body if the subscript is a number that is not known before the run.
    pub(crate) fn is_computed(&mut self, expr: &Expr, size: usize, cx: &mut Context) -> Result<bool, Fail> {
        if matches!(expr.kind, ExprKind::Colon | ExprKind::Range(..) | ExprKind::Integer(_) | ExprKind::End) {
            return Ok(false);
        }
        match self.subscript(expr, size, cx) {
            Err(Fail::Opaque) if self.in_body(cx) => Ok(true),
            Err(fail) => Err(fail),
            Ok(_) => Ok(false),
        }
    }

    /// The element at computed subscripts; `index` says which of those that slices keep.
    pub(crate) fn load_element(
        &mut self,
        span: Span,
        items: &[Typed],
        shape: &[usize],
        subscripts: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let Some(scalar) = items.first().map(|item| item.scalar.clone()) else {
            return Err(self.error(Code::ArrayShape, span, "an empty array has no elements"));
        };
        let mut kept = index.iter();
        let mut offsets = vec![self.model.templates.arena.constant(0.0)];
        for (position, &size) in self.positions_in(shape, subscripts, cx)?.into_iter().zip(shape) {
            let position = match position {
                Position::Known(list, true) => {
                    let Some(k) = kept.next() else {
                        return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
                    };
                    let k = k.as_constant().ok_or(Fail::NeedsExpansion)? as usize;
                    Position::Known(vec![list.get(k).copied().ok_or(Fail::Reported)?], false)
                }
                other => other,
            };
            offsets = self.shifted(&offsets, &position, size, shape.len() > 1);
        }
        let first = self.in_a_row(items);
        let to = self.registers(1).start;
        self.step(Step::Load { to, first, count: items.len() as u32, index: offsets[0] });
        Ok(Typed { node: self.model.templates.arena.slot(SlotId(to)), scalar })
    }

    /// Offsets after one more dimension; with several dimensions an index outside its own becomes one outside of all.
    fn shifted(&mut self, offsets: &[NodeId], position: &Position, size: usize, several: bool) -> Vec<NodeId> {
        let arena = &mut self.model.templates.arena;
        let (width, one) = (arena.constant(size as f64), arena.constant(1.0));
        let steps: Vec<NodeId> = match position {
            Position::Known(list, _) => list.iter().map(|&k| arena.constant(k as f64)).collect(),
            Position::Computed(node) => {
                let from_zero = arena.sub(*node, one);
                if several {
                    let zero = arena.constant(0.0);
                    let low = arena.compare(Relation::GreaterEqual, from_zero, zero);
                    let high = arena.compare(Relation::Less, from_zero, width);
                    let inside = arena.and(low, high);
                    let far = arena.constant(f64::NEG_INFINITY);
                    vec![arena.select(inside, from_zero, far)]
                } else {
                    vec![from_zero]
                }
            }
        };
        let mut all = Vec::with_capacity(offsets.len() * steps.len());
        for &offset in offsets {
            let row = arena.mul(offset, width);
            for &step in &steps {
                all.push(arena.add(row, step));
            }
        }
        all
    }

    /// The first of registers in a row that hold the elements; they are copied if they do not stand so.
    fn in_a_row(&mut self, items: &[Typed]) -> u32 {
        let slot = |flat: &Self, item: &Typed| match flat.model.templates.arena.node(item.node) {
            Node::Slot(slot) => Some(slot.0),
            _ => None,
        };
        if let Some(first) = slot(self, &items[0])
            && items.iter().zip(first..).all(|(item, r)| slot(self, item) == Some(r))
        {
            return first;
        }
        let registers = self.registers(items.len());
        for (register, item) in registers.clone().zip(items) {
            self.step(Step::Set(register, item.node));
        }
        registers.start
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
