//! Assignments to the names of a function that is run symbolically.
//!
//! What is written where is found out first, with all names still there, as subscripts may read the array that is written to.  Then
//! the elements are written in place: filling an array in a loop costs as much as it has elements.

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyOutput, NodeId, Relation, SlotId, Step};
use hyd_typed::{Expr, Kind, Kind as Form, Local as Path, Variable};

use crate::expressions::record::{join_subscripts, rank};
use crate::model::{Section, VarId};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

/// One part of a local value and what it becomes.
struct Write {
    /// Positions of the fields on the way.
    fields: Vec<usize>,
    what: What,
}

enum What {
    Whole(Local),
    /// Elements of an array by position, and their values.
    Elements(Vec<usize>, Rc<Vec<Typed>>),
}

impl Write {
    fn apply(self, whole: &mut Local) {
        let place = self.fields.iter().try_fold(whole, |place, &k| match place {
            Local::Record(fields) | Local::Records(fields, _) => fields.get_mut(k).map(|(_, field)| field),
            _ => None,
        });
        match (place, self.what) {
            (Some(place), What::Whole(value)) => *place = value,
            (Some(Local::Array(items, _)), What::Elements(positions, values)) => {
                let items = Rc::make_mut(items);
                for (position, value) in positions.into_iter().zip(values.iter()) {
                    items[position] = value.clone();
                }
            }
            _ => {}
        }
    }
}

impl Flattener<'_, '_> {
    pub(crate) fn assign(&mut self, target: &Expr, value: Local, cx: &mut Context) -> Result<(), Fail> {
        let path = match &target.kind {
            Kind::Local(path) => path,
            Kind::Variable(variable) if cx.assigned.is_some() => {
                return match self.subscript_of_run(variable) {
                    Some(place) => self.assign_where_run_says(target, variable, place, value, cx),
                    None => self.assign_variable(target, variable, value, cx),
                };
            }
            _ => return Err(self.error(Code::Misplaced, target.span, "only variables can be assigned")),
        };
        let name = path.name().clone();
        let whole = path.parts.len() == 1;
        let value = if whole { self.claim_assigned(target.span, &name, value, cx) } else { value };
        if cx.inputs.contains(&name) {
            return Err(self.error(Code::Misplaced, target.span, format!("the input `{name}` cannot be assigned")));
        }
        if whole && path.parts[0].1.is_empty() {
            cx.names.retain(|(n, _)| *n != name);
            cx.names.push((name, value));
            return Ok(());
        }
        let Some(whole) = cx.local(&name).cloned() else {
            let message = format!("`{name}` is not declared in this function");
            return Err(self.error(Code::UnknownName, target.span, message));
        };
        let mut writes = Vec::new();
        self.writes_to(&whole, (path, target.span), value, cx, &mut writes)?;
        drop(whole);
        if let Some((_, whole)) = cx.names.iter_mut().rev().find(|(n, _)| *n == name) {
            writes.into_iter().for_each(|write| write.apply(whole));
        }
        Ok(())
    }

    /// What is written to the parts of `whole` that a path names.
    fn writes_to(
        &mut self,
        whole: &Local,
        (path, span): (&Path, Span),
        value: Local,
        cx: &mut Context,
        writes: &mut Vec<Write>,
    ) -> Result<(), Fail> {
        let (mut place, mut fields) = (whole, Vec::new());
        let mut subscripts = Vec::new();
        for (k, (part, _)) in path.parts.iter().enumerate() {
            if k > 0 {
                let next = match place {
                    Local::Record(all) | Local::Records(all, _) => {
                        all.iter().enumerate().find(|(_, (n, _))| *n == part.name)
                    }
                    _ => None,
                };
                let Some((position, (_, field))) = next else {
                    return Err(self.no_field(span, &part.name));
                };
                fields.push(position);
                place = field;
            }
            join_subscripts(&mut subscripts, rank(place), path, k);
        }
        if subscripts.is_empty() {
            writes.push(Write { fields, what: What::Whole(value) });
            return Ok(());
        }
        self.writes_to_elements(place, (path, span, &subscripts), value, cx, fields, writes)
    }

    fn writes_to_elements(
        &mut self,
        place: &Local,
        (path, span, subscripts): (&Path, Span, &[Expr]),
        value: Local,
        cx: &mut Context,
        way: Vec<usize>,
        writes: &mut Vec<Write>,
    ) -> Result<(), Fail> {
        match place {
            Local::Array(_, shape) => {
                let (positions, values) = self.elements_written(span, shape, subscripts, value, cx)?;
                writes.push(Write { fields: way, what: What::Elements(positions, values) });
                Ok(())
            }
            Local::Records(fields, _) => {
                let values = self.fields_of(span, value)?;
                for (k, (name, field)) in fields.iter().enumerate() {
                    let Some((_, value)) = values.iter().find(|(n, _)| n == name) else {
                        return Err(self.no_field(span, name));
                    };
                    let inner = way.iter().copied().chain([k]).collect();
                    self.writes_to_elements(field, (path, span, subscripts), value.clone(), cx, inner, writes)?;
                }
                Ok(())
            }
            _ => {
                let name = &path.parts[path.parts.len() - 1].0.name;
                Err(self.error(Code::ArrayShape, span, format!("`{name}` is not an array here")))
            }
        }
    }

    /// `a[i] := e`, also `a[:] := ...` and `a[2:3] := ...`: positions and their values.
    fn elements_written(
        &mut self,
        span: Span,
        shape: &[usize],
        subscripts: &[Expr],
        value: Local,
        cx: &mut Context,
    ) -> Result<(Vec<usize>, Rc<Vec<Typed>>), Fail> {
        let mut positions: Vec<usize> = vec![0];
        for (k, &size) in shape.iter().enumerate() {
            let list = match subscripts.get(k) {
                Some(expr) => self.positions(expr, size, cx)?,
                None => (0..size).collect(),
            };
            positions = positions.iter().flat_map(|&p| list.iter().map(move |&q| p * size + q)).collect();
        }
        let values = self.values_of(span, value)?;
        if values.len() != positions.len() {
            let message = format!("{} values are given to {} elements", values.len(), positions.len());
            return Err(self.error(Code::ArrayShape, span, message));
        }
        Ok((positions, values))
    }

    /// Positions from 0 that a subscript with known value names.
    fn positions(&mut self, expr: &Expr, size: usize, cx: &mut Context) -> Result<Vec<usize>, Fail> {
        use crate::expressions::reference::Subscript;
        let list: Vec<i64> = match self.subscript(expr, size, cx)? {
            Subscript::At(at) => vec![at.as_constant().ok_or(Fail::NeedsExpansion)?],
            Subscript::All => (0..size as i64).collect(),
            Subscript::Slice { start, step, count } => {
                let start = start.as_constant().ok_or(Fail::NeedsExpansion)?;
                (0..count as i64).map(|k| start + step * k).collect()
            }
            Subscript::List(list) => list,
        };
        for &k in &list {
            if k < 0 || k as usize >= size {
                return Err(self.outside(expr.span, "", k + 1, size));
            }
        }
        Ok(list.into_iter().map(|k| k as usize).collect())
    }

    /// The first subscript of a variable itself that changes during the run.
    fn subscript_of_run(&mut self, variable: &Variable) -> Option<usize> {
        let (_, subscripts) = &variable.steps[variable.steps.len() - 1];
        let changes = |flat: &mut Self, expr: &Expr| {
            expr.ty.rank == 0 && !matches!(expr.kind, Kind::Colon | Kind::Range(..)) && !flat.made_of_parameters(expr)
        };
        subscripts.iter().position(|expr| changes(self, expr))
    }

    /// `a[i] := value` where the run says what `i` is: each element takes the value or stays as it is.
    fn assign_where_run_says(
        &mut self,
        target: &Expr,
        variable: &Variable,
        place: usize,
        value: Local,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let last = variable.steps.len() - 1;
        let (inst, subscripts) = &variable.steps[last];
        let subscript = subscripts[place].clone();
        let Some(&size) = self.scopes.instances[*inst].dims.get(place) else {
            return Err(self.error(Code::ArrayShape, target.span, "too many subscripts"));
        };
        let index = self.lower(&subscript, cx, &[])?;
        self.want_number(subscript.span, "a subscript", &index)?;
        let values = self.values_of(target.span, value)?;
        let checked = self.checked_subscript(index.node, size, (target.span, subscript.span));
        for k in 1..=size {
            let mut element = variable.clone();
            let literal = Kind::Integer(k as i64);
            element.steps[last].1[place] = Expr { kind: literal, ..subscript.clone() };
            let element = Expr { kind: Kind::Variable(element), ..target.clone() };
            let before = self.local_value(&element, cx)?;
            let before = self.values_of(target.span, before)?;
            let arena = &mut self.model.templates.arena;
            let number = arena.constant(k as f64);
            let here = arena.compare(Relation::Equal, index.node, number);
            // What fails is not a number, which the first element takes over.
            let nothing = (k == 1).then(|| arena.sub(checked, index.node));
            let mut after = Vec::with_capacity(values.len());
            for (new, old) in values.iter().zip(before.iter()) {
                let arena = &mut self.model.templates.arena;
                let old = nothing.map_or(old.node, |nothing| arena.add(old.node, nothing));
                after.push(Typed { node: arena.select(here, new.node, old), ..new.clone() });
            }
            let shape = self.shape(&element, cx)?;
            let after = match (shape.is_empty(), after.pop()) {
                (true, Some(only)) => Local::Node(only),
                (_, rest) => Local::array(after.into_iter().chain(rest).collect(), shape),
            };
            self.assign(&element, after, cx)?;
        }
        Ok(())
    }

    /// A subscript of the run, which must be one of `1:size` where it is computed; messages have the texts of what is assigned and of the
    /// subscript.
    fn checked_subscript(&mut self, index: NodeId, size: usize, (target, subscript): (Span, Span)) -> NodeId {
        let files = &self.scopes.table.files;
        let name: Arc<str> = files.snippet(target).into();
        let text = format!("the subscript `{}` is outside 1..{size}", files.snippet(subscript)).into();
        let arena = &mut self.model.templates.arena;
        let body = arena.reserve_body(name.clone(), vec![false]);
        let given = arena.slot(SlotId(0));
        let (low, high) = (arena.constant(1.0), arena.constant(size as f64));
        let above = arena.compare(Relation::GreaterEqual, given, low);
        let below = arena.compare(Relation::LessEqual, given, high);
        let inside = arena.and(above, below);
        let steps = vec![Step::Check(inside, text), Step::Set(1, given)];
        let outputs = vec![BodyOutput { name: "k".into(), register: 1, zero: false }];
        let real_inputs = vec![false];
        arena.set_body(
            body,
            Body { name, inputs: 1, real_inputs, registers: 2, steps, outputs, derivatives: Vec::new() },
        );
        let list = arena.argument_list(&[index]);
        arena.apply(body, 0, list)
    }

    /// `variable := value` in an algorithm section of a model.
    pub(crate) fn assign_variable(
        &mut self,
        target: &Expr,
        variable: &Variable,
        value: Local,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let last = variable.last();
        if let Local::Record(fields) | Local::Records(fields, _) = value {
            for (name, field) in fields {
                let Some(&child) = self.scopes.instances[last].by_name.get(&name) else {
                    return Err(self.no_field(target.span, &name));
                };
                let inner = self.component_of(target, variable, child);
                if let Form::Variable(variable) = &inner.kind {
                    self.assign_variable(&inner, variable, field, cx)?;
                }
            }
            return Ok(());
        }
        let shape = self.shape(target, cx)?;
        let values = self.values_of(target.span, value)?;
        if values.len() != shape.iter().product::<usize>() {
            let message = format!("{} values are given to {} elements", values.len(), shape.iter().product::<usize>());
            return Err(self.error(Code::ArrayShape, target.span, message));
        }
        let Some(&block) = self.blocks.get(&last) else { return Err(Fail::Reported) };
        let first = self.model.variables[block].first;
        for (k, value) in values.iter().cloned().enumerate() {
            let mut rest = k;
            let mut at = vec![Affine::constant(0); shape.len()];
            for (position, &size) in shape.iter().enumerate().rev() {
                at[position] = Affine::constant((rest % size) as i64);
                rest /= size;
            }
            let (offset, _) = self.position_of(target.span, &variable.steps, cx, &at)?;
            let v = VarId(first.0 + offset.as_constant().ok_or(Fail::NeedsExpansion)? as u32);
            if let Some(primitive) = &self.scopes.instances[last].primitive {
                let wanted = primitive.scalar.clone();
                self.check_assignable(&wanted, &value, target.span, Section::Continuous, last)?;
            }
            let assigned = cx.assigned.get_or_insert_default();
            match assigned.iter_mut().find(|(known, _)| *known == v) {
                Some((_, slot)) => *slot = value,
                None => assigned.push((v, value)),
            }
        }
        Ok(())
    }
}
