//! Elements at subscripts that the run decides, and what is compiled for them.
//!
//! Inside a compiled function a computed subscript reads memory with a check; with several dimensions each subscript is checked against
//! its own size.  Outside of functions an element `a[k]` with `k` a variable of the run is a body of its own: the elements and the
//! subscripts go in, one element comes out.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyOutput, Node, NodeId, Relation, SlotId, Step};
use hyd_syntax::tree::{Name, Variability};
use hyd_typed::{Expr, Kind, Type, Variable};

use crate::expressions::reference::Subscript;
use crate::functions::rename::local_name;
use crate::functions::table_body;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::form::Form;
use crate::state::index::Affine;
use crate::state::node::Typed;
use crate::state::steps::Builder;

/// Constants of an array from which a function of their position is shorter than copying them for each element that is asked for.
const LONG_LIST: usize = 16;

/// One subscript inside a body.
pub(crate) enum Position {
    /// Elements named by position from 0.
    Known(Vec<usize>, bool),
    /// A number from 1, computed in the run.
    Computed(NodeId),
}

/// Name, form and value of an input of a body.
pub(crate) type Input = (Name, Form, Local);

impl Flattener<'_, '_> {
    /// The subscripts of an array, one per dimension.
    pub(crate) fn positions_in(
        &mut self,
        shape: &[usize],
        subscripts: &[Expr],
        cx: &mut Context,
    ) -> Result<Vec<Position>, Fail> {
        let mut list = Vec::with_capacity(shape.len());
        for (k, &size) in shape.iter().enumerate() {
            let Some(expr) = subscripts.get(k) else {
                list.push(Position::Known((0..size).collect(), true));
                continue;
            };
            if self.shape(expr, cx)?.is_empty() && !matches!(expr.kind, Kind::Colon) {
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
        if matches!(expr.kind, Kind::Colon | Kind::Range(..) | Kind::Integer(_) | Kind::End) {
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
                        return Err(self.no_scalar(span));
                    };
                    let k = k.as_constant().ok_or(Fail::NeedsExpansion)? as usize;
                    Position::Known(vec![list.get(k).copied().ok_or(Fail::Reported)?], false)
                }
                other => other,
            };
            offsets = self.shifted(&offsets, &position, size, shape.len() > 1);
        }
        let numbers: Option<Vec<f64>> =
            items.iter().map(|item| self.model.templates.arena.as_constant(item.node)).collect();
        if let Some(numbers) = numbers.filter(|numbers| numbers.len() >= LONG_LIST) {
            return Ok(self.element_of_list(&numbers, offsets[0], scalar));
        }
        let first = self.in_a_row(items);
        let to = self.registers(1).start;
        self.step(Step::Load { to, first, count: items.len() as u32, index: offsets[0] });
        Ok(Typed { node: self.model.templates.arena.slot(SlotId(to)), scalar })
    }

    /// An element of an array of constants, which takes no registers: a function of the position finds it by halves.
    fn element_of_list(&mut self, numbers: &[f64], index: NodeId, scalar: ScalarType) -> Typed {
        let bits: Vec<u64> = numbers.iter().map(|number| number.to_bits()).collect();
        let list = match self.lists_known.get(&bits) {
            Some(&known) => known,
            None => {
                let made = table_body::of_list(&mut self.model.templates.arena, "constants", numbers);
                self.lists_known.insert(bits, made);
                made
            }
        };
        let arena = &mut self.model.templates.arena;
        let (zero, count) = (arena.constant(0.0), arena.constant(numbers.len() as f64));
        let (from, to) =
            (arena.compare(Relation::GreaterEqual, index, zero), arena.compare(Relation::Less, index, count));
        let is_inside = arena.and(from, to);
        let text = format!("a subscript is outside of an array of {} elements", numbers.len());
        self.step(Step::Check(is_inside, text.into()));
        let to = self.registers(1).start;
        self.step(Step::Call { body: list, arguments: vec![index], results: vec![to] });
        Typed { node: self.model.templates.arena.slot(SlotId(to)), scalar }
    }

    /// Offsets after one more dimension; with several dimensions an index outside its own becomes one outside of all.
    pub(crate) fn shifted(
        &mut self,
        offsets: &[NodeId],
        position: &Position,
        size: usize,
        several: bool,
    ) -> Vec<NodeId> {
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
    pub(crate) fn in_a_row(&mut self, items: &[Typed]) -> u32 {
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

    /// An element at subscripts of which some are known in the run only; `index` goes to those that keep a dimension.
    pub(crate) fn element_at_run(
        &mut self,
        expr: &Expr,
        variable: &Variable,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let whole = without_last_subscripts(expr);
        let subscripts = &variable.steps[variable.steps.len() - 1].1;
        let Local::Array(items, shape) = self.local_value(&whole, cx)? else {
            return Err(self.error(Code::ArrayShape, expr.span, "this takes no subscripts"));
        };
        if subscripts.len() != shape.len() {
            let (has, written) = (shape.len(), subscripts.len());
            let message = format!("an array of {has} dimensions needs {has} subscripts here, not {written}");
            return Err(self.error(Code::ArrayShape, expr.span, message));
        }
        let scalar = items.first().map_or(ScalarType::Real, |item| item.scalar.clone());
        let array: Name = hyd_syntax::print_reference(&variable.reference).into();
        let mut inputs: Vec<Input> =
            vec![(array.clone(), Form::Array(scalar.clone(), shape.clone()), Local::Array(items, shape.clone()))];
        let mut inner_subscripts = Vec::new();
        let mut kept = index.iter();
        for (subscript, &size) in subscripts.iter().zip(&shape) {
            let span = subscript.span;
            let position = if self.is_of_the_run(subscript, cx) {
                cx.ends.push(size);
                let value = self.lower(subscript, cx, &[]);
                cx.ends.pop();
                let value = value?;
                if matches!(value.scalar, ScalarType::Real) {
                    let message = "an Integer is needed here, not Real";
                    return Err(self.error(Code::TypeMismatch, span, message));
                }
                let name: Name = format!("subscript {}", inputs.len()).into();
                inputs.push((name.clone(), Form::Scalar(value.scalar.clone()), Local::Node(value)));
                local_name(name, Vec::new(), subscript)
            } else {
                let k = self.known_position(span, subscript, size, &mut kept, cx)?;
                Expr { kind: Kind::Integer(k + 1), ty: Type::scalar(ScalarType::Integer), span }
            };
            inner_subscripts.push(position);
        }
        let element = local_name(array.clone(), inner_subscripts, expr);
        let nodes = self.own_body(&array, expr.span, &inputs, cx, |flat, inner| {
            let value = flat.lower(&element, inner, &[])?;
            let register = flat.registers(1).start;
            flat.step(Step::Set(register, value.node));
            Ok(vec![register])
        })?;
        Ok(Typed { node: nodes[0], scalar })
    }

    /// True for a scalar subscript with variables of the run in it.
    pub(crate) fn is_of_the_run(&mut self, expr: &Expr, cx: &Context) -> bool {
        if matches!(expr.kind, Kind::Colon | Kind::Range(..) | Kind::Array(_) | Kind::Integer(_)) {
            return false;
        }
        hyd_typed::any_variable(expr, &mut |variable| self.scopes.variability(variable.last()) > Variability::Parameter)
            || cx.depth == 0 && hyd_typed::any(expr, &mut |part| matches!(part.kind, Kind::Time))
    }

    /// A body of its own around what `build` makes, and its call.
    pub(crate) fn own_body(
        &mut self,
        name: &str,
        span: Span,
        inputs: &[Input],
        cx: &Context,
        build: impl FnOnce(&mut Self, &mut Context) -> Result<Vec<u32>, Fail>,
    ) -> Result<Vec<NodeId>, Fail> {
        let mut arguments = Vec::new();
        for (_, form, local) in inputs {
            self.nodes_of(span, form, local, &mut arguments)?;
        }
        let scalars = inputs.iter().flat_map(|(_, form, _)| form.scalars());
        let real_inputs: Vec<bool> = scalars.map(|scalar| matches!(scalar, ScalarType::Real)).collect();
        let name: Name = name.into();
        let count = real_inputs.len() as u32;
        let id = self.model.templates.arena.reserve_body(name.clone(), real_inputs.clone());
        let depth = cx.depth + 1;
        self.builders.push(Builder {
            depth,
            registers: count,
            blocks: vec![Vec::new()],
            calls: Vec::new(),
            texts: Vec::new(),
            settled: Vec::new(),
        });
        let outer = std::mem::take(&mut self.slots);
        let mut inner = Context { depth, no_event: true, ..Context::new(cx.scope) };
        let mut next = 0;
        for (name, form, _) in inputs {
            let own = next..next + form.scalars().len() as u32;
            next = own.end;
            inner.names.push((name.clone(), self.over_registers(form, own)));
        }
        let outputs = build(self, &mut inner);
        let inside = std::mem::replace(&mut self.slots, outer);
        let mut builder = self.builders.pop().ok_or(Fail::Reported)?;
        let registers = match outputs {
            Err(Fail::Opaque) => {
                let message = "an integer that is known before the run is needed here";
                return Err(self.error(Code::NotStructural, self.opaque_at, message));
            }
            other => other?,
        };
        if !inside.keys.is_empty() {
            let message =
                "a derivative or a component of a component cannot be named in a loop that only the run decides";
            return Err(self.error(Code::OutsideProfile, span, message));
        }
        let output = |(k, &register): (usize, &u32)| BodyOutput {
            name: format!("{name} {}", k + 1).into(),
            register,
            zero: false,
        };
        let outputs: Vec<BodyOutput> = registers.iter().enumerate().map(output).collect();
        let steps = builder.blocks.pop().unwrap_or_default();
        let registers = builder.registers;
        let body = Body { name, inputs: count, real_inputs, registers, steps, outputs, derivatives: Vec::new() };
        let arena = &mut self.model.templates.arena;
        let count = body.outputs.len() as u32;
        arena.set_body(id, body);
        let list = arena.argument_list(&arguments);
        Ok((0..count).map(|k| arena.apply(id, k, list)).collect())
    }

    /// A local value over registers in a row.
    pub(crate) fn over_registers(&mut self, form: &Form, registers: std::ops::Range<u32>) -> Local {
        let slots: Vec<NodeId> = registers.map(|r| self.model.templates.arena.slot(SlotId(r))).collect();
        form.local(&mut slots.into_iter())
    }

    /// A position from 0 that is known, from the subscript or from the element asked for.
    pub(crate) fn known_position<'i>(
        &mut self,
        span: Span,
        expr: &Expr,
        size: usize,
        kept: &mut impl Iterator<Item = &'i Affine>,
        cx: &mut Context,
    ) -> Result<i64, Fail> {
        use crate::expressions::reference::Subscript;
        let mut wanted = |flat: &mut Self| match kept.next() {
            Some(at) => at.as_constant().ok_or(Fail::NeedsExpansion),
            None => Err(flat.no_scalar(span)),
        };
        let position = match self.subscript(expr, size, cx)? {
            Subscript::At(at) => at.as_constant().ok_or(Fail::NeedsExpansion)?,
            Subscript::All => wanted(self)?,
            Subscript::Slice { start, step, .. } => {
                start.as_constant().ok_or(Fail::NeedsExpansion)? + step * wanted(self)?
            }
            Subscript::List(list) => {
                let k = wanted(self)?;
                list.get(k as usize).copied().ok_or(Fail::Reported)?
            }
        };
        if position < 0 || position as usize >= size {
            return Err(self.outside(span, "", position + 1, size));
        }
        Ok(position)
    }
}

/// The array that a reference with subscripts at its end names an element of.
pub(crate) fn without_last_subscripts(expr: &Expr) -> Expr {
    let mut whole = expr.clone();
    let (dropped, reference) = match &mut whole.kind {
        Kind::Variable(variable) => {
            let last = variable.steps.last_mut().map(|(_, subscripts)| std::mem::take(subscripts));
            (last, &mut variable.reference)
        }
        Kind::Local(local) => {
            let last = local.parts.last_mut().map(|(_, subscripts)| std::mem::take(subscripts));
            (last, &mut local.reference)
        }
        _ => return whole,
    };
    let mut text = hyd_syntax::tree::ComponentRef::clone(reference);
    if let Some(part) = text.parts.last_mut() {
        part.subscripts.clear();
    }
    *reference = text.into();
    let scalars = dropped.iter().flatten().filter(|subscript| subscript.ty.rank == 0).count();
    whole.ty = whole.ty.with_rank(whole.ty.rank + scalars);
    whole
}
