//! Local values: what names of loops, functions and records stand for, and their parts.

use std::rc::Rc;

use hyd_instance::{ScalarType, Value};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::Name;

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, SlotKey};
use crate::state::node::Typed;

/// The fields of a record.
pub(crate) type Fields = Vec<(Name, Local)>;

impl Flattener<'_, '_> {
    pub(crate) fn as_node(&mut self, span: Span, local: &Local) -> Result<Typed, Fail> {
        match local {
            Local::Node(typed) => Ok(typed.clone()),
            Local::Index(affine) => {
                let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                Ok(self.literal(k as f64, ScalarType::Integer))
            }
            Local::Value(value) => self.constant_value(span, &value.clone()),
            Local::Function(_) => {
                Err(self.error(Code::TypeMismatch, span, "a function stands where a value is needed"))
            }
            _ => Err(self.error(Code::ArrayShape, span, "an array or record stands where a scalar is needed")),
        }
    }

    /// The elements of an array, or the one value there is.
    pub(crate) fn values_of(&mut self, span: Span, local: Local) -> Result<Rc<Vec<Typed>>, Fail> {
        match local {
            Local::Array(values, _) => Ok(values),
            single => Ok(Rc::new(vec![self.as_node(span, &single)?])),
        }
    }

    /// An element of a local value.
    pub(crate) fn element_of_local(&mut self, span: Span, local: &Local, index: &[Affine]) -> Result<Typed, Fail> {
        match local {
            Local::Node(typed) if index.is_empty() => Ok(typed.clone()),
            Local::Index(_) | Local::Value(_) if index.is_empty() => self.as_node(span, local),
            Local::Array(items, shape) if shape.len() == index.len() => {
                let mut position = 0;
                for (affine, &size) in index.iter().zip(shape) {
                    let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                    if k < 0 || k as usize >= size {
                        return Err(self.outside(span, "", k + 1, size));
                    }
                    position = position * size + k as usize;
                }
                items.get(position).cloned().ok_or(Fail::Reported)
            }
            Local::Array(..) => Err(self.no_scalar(span)),
            Local::Record(_) | Local::Records(..) => {
                Err(self.error(Code::TypeMismatch, span, "a record stands where a scalar is needed"))
            }
            Local::Function(_) => {
                Err(self.error(Code::TypeMismatch, span, "a function stands where a value is needed"))
            }
            _ => Err(self.error(Code::ArrayShape, span, "a scalar stands where an array is needed")),
        }
    }

    /// Integers known here may serve as sizes and subscripts.
    pub(crate) fn known_integer(&self, local: Local) -> Local {
        if let Local::Node(Typed { node, scalar: ScalarType::Integer }) = &local
            && let Some(k) = self.model.templates.arena.as_constant(*node)
        {
            return Local::Index(Affine::constant(k as i64));
        }
        local
    }

    /// The value of a loop variable, which may change with the counters.
    pub(crate) fn node_of_index(&mut self, span: Span, local: &Local) -> Result<Typed, Fail> {
        match local {
            Local::Index(affine) if affine.as_constant().is_none() => {
                let slot = self.slots.slot(SlotKey::Number(affine.clone()));
                Ok(Typed { node: self.model.templates.arena.slot(slot), scalar: ScalarType::Integer })
            }
            other => self.as_node(span, other),
        }
    }

    pub(crate) fn outside(&mut self, span: Span, of: &str, k: i64, size: usize) -> Fail {
        let message = format!("subscript {k}{of} is outside 1..{size}");
        let from_one = (k == 0).then(|| "arrays begin at 1".to_string());
        self.report(Diagnostic::error(Code::ArrayShape, message).at(span, "").maybe_help(from_one));
        Fail::Reported
    }

    pub(crate) fn join(&mut self, span: Span, test: NodeId, a: &Local, b: &Local) -> Result<Local, Fail> {
        match (a, b) {
            (Local::Index(x), Local::Index(y)) if x == y => Ok(a.clone()),
            // Inputs are not assigned.
            (Local::Function(_), Local::Function(_)) => Ok(a.clone()),
            (Local::Array(x, shape), Local::Array(y, other)) if shape == other => {
                if Rc::ptr_eq(x, y) {
                    return Ok(a.clone());
                }
                let mut items = Vec::with_capacity(x.len());
                for (p, q) in x.iter().zip(y.iter()) {
                    items.push(self.choose(span, test, p.clone(), q.clone())?);
                }
                Ok(Local::array(items, shape.clone()))
            }
            (Local::Record(x), Local::Record(y)) => {
                let mut fields = Vec::with_capacity(x.len());
                for ((name, p), (_, q)) in x.iter().zip(y) {
                    fields.push((name.clone(), self.join(span, test, p, q)?));
                }
                Ok(Local::Record(fields))
            }
            (Local::Records(x, shape), Local::Records(y, other)) if shape == other => {
                let mut fields = Vec::with_capacity(x.len());
                for ((name, p), (_, q)) in x.iter().zip(y) {
                    fields.push((name.clone(), self.join(span, test, p, q)?));
                }
                Ok(Local::Records(fields, shape.clone()))
            }
            (Local::Value(_), _) => Ok(a.clone()),
            _ => {
                let (x, y) = (self.as_node(span, a)?, self.as_node(span, b)?);
                Ok(Local::Node(self.choose(span, test, x, y)?))
            }
        }
    }

    /// The value a variable of the model has at this point of an algorithm.
    pub(crate) fn current(&mut self, v: crate::model::VarId, cx: &Context) -> Typed {
        let assigned = cx.assigned.iter().flatten().find(|(known, _)| *known == v);
        if let Some((_, typed)) = assigned {
            return typed.clone();
        }
        self.before_algorithm(v)
    }

    /// Before its first assignment a discrete variable has its value before the event, another its start value.
    pub(crate) fn before_algorithm(&mut self, v: crate::model::VarId) -> Typed {
        use crate::state::index::{Kind, SlotKey};
        let block = self.variable_of(v);
        let discrete = block.variability == hyd_system::Variability::Discrete;
        let scalar = match &block.kind {
            hyd_system::ValueKind::Integer => ScalarType::Integer,
            hyd_system::ValueKind::Boolean => ScalarType::Boolean,
            hyd_system::ValueKind::Enumeration(_) => self.enumeration_of(v),
            hyd_system::ValueKind::Real => ScalarType::Real,
        };
        let kind = if discrete { Kind::Pre } else { Kind::Start };
        let slot = self.slots.slot(SlotKey::Variable(kind, v, Affine::constant(0)));
        Typed { node: self.model.templates.arena.slot(slot), scalar }
    }

    /// The type of a variable that is an enumeration.
    fn enumeration_of(&self, v: crate::model::VarId) -> ScalarType {
        let holds = |block: &crate::model::BlockId| {
            let block = &self.model.variables[*block];
            (block.first.0..block.first.0 + block.count).contains(&v.0)
        };
        let inst = self.blocks.iter().find(|(_, block)| holds(block)).map(|(&inst, _)| inst);
        let primitive = inst.and_then(|inst| self.scopes.instances[inst].primitive.as_ref());
        primitive.map_or(ScalarType::Real, |primitive| primitive.scalar.clone())
    }

    pub(crate) fn no_field(&mut self, span: Span, name: &Name) -> Fail {
        self.error(Code::UnknownName, span, format!("there is no field `{name}`"))
    }

    /// The fields of a record or an array of them.
    pub(crate) fn fields_of(&mut self, span: Span, value: Local) -> Result<Fields, Fail> {
        match value {
            Local::Record(fields) | Local::Records(fields, _) => Ok(fields),
            _ => Err(self.error(Code::TypeMismatch, span, "a record is needed here")),
        }
    }

    /// The part of a value at subscripts from 1 of its first dimensions.
    pub(crate) fn part_of(&mut self, span: Span, value: Local, at: &[usize]) -> Result<Local, Fail> {
        if at.is_empty() {
            return Ok(value);
        }
        let offset = |shape: &[usize]| {
            let inside = at.len() <= shape.len() && at.iter().zip(shape).all(|(&k, &size)| k >= 1 && k <= size);
            inside.then(|| at.iter().zip(shape).fold(0, |all, (&k, &size)| all * size + k - 1))
        };
        match value {
            Local::Array(items, shape) if offset(&shape).is_some() => {
                let inner = shape[at.len()..].to_vec();
                let (count, first) = (inner.iter().product::<usize>(), offset(&shape).unwrap_or(0));
                let part = items[first * count..(first + 1) * count].to_vec();
                match (inner.is_empty(), part.first()) {
                    (true, Some(only)) => Ok(Local::Node(only.clone())),
                    _ => Ok(Local::array(part, inner)),
                }
            }
            Local::Records(fields, shape) if offset(&shape).is_some() => {
                let mut parts = Vec::with_capacity(fields.len());
                for (name, field) in fields {
                    parts.push((name, self.part_of(span, field, at)?));
                }
                let inner = shape[at.len()..].to_vec();
                Ok(if inner.is_empty() { Local::Record(parts) } else { Local::Records(parts, inner) })
            }
            _ => Err(self.error(Code::ArrayShape, span, "this gives too few elements to an array of records")),
        }
    }

    /// Values of one kind as an array with one dimension more.
    pub(crate) fn stacked(&mut self, span: Span, all: Vec<Local>) -> Result<Local, Fail> {
        let count = all.len();
        let longer = |shape: &[usize]| std::iter::once(count).chain(shape.iter().copied()).collect::<Vec<_>>();
        let Some(first) = all.first().cloned() else {
            return Err(self.error(Code::ArrayShape, span, "an array of records needs elements"));
        };
        match first {
            Local::Record(fields) => Ok(Local::Records(self.stacked_fields(span, &fields, &all)?, vec![count])),
            Local::Records(fields, shape) => {
                Ok(Local::Records(self.stacked_fields(span, &fields, &all)?, longer(&shape)))
            }
            Local::Array(_, shape) => {
                let mut items = Vec::new();
                for value in all {
                    match value {
                        Local::Array(own, other) if other == shape => items.extend(own.iter().cloned()),
                        _ => {
                            let message = "the elements of this array have different sizes";
                            return Err(self.error(Code::ArrayShape, span, message));
                        }
                    }
                }
                Ok(Local::array(items, longer(&shape)))
            }
            _ => {
                let mut items = Vec::with_capacity(count);
                for value in &all {
                    items.push(self.as_node(span, value)?);
                }
                Ok(Local::array(items, vec![count]))
            }
        }
    }

    pub(crate) fn stacked_fields(&mut self, span: Span, fields: &Fields, all: &[Local]) -> Result<Fields, Fail> {
        let mut result = Vec::with_capacity(fields.len());
        for (name, _) in fields {
            let mut column = Vec::with_capacity(all.len());
            for value in all {
                let own = self.fields_of(span, value.clone())?;
                let Some((_, field)) = own.into_iter().find(|(n, _)| n == name) else {
                    return Err(self.no_field(span, name));
                };
                column.push(field);
            }
            result.push((name.clone(), self.stacked(span, column)?));
        }
        Ok(result)
    }
}

/// A loop variable's value as a local name.
pub(crate) fn local_of(value: Value) -> Local {
    match value {
        Value::Integer(k) => Local::Index(Affine::constant(k)),
        other => Local::Value(other),
    }
}
