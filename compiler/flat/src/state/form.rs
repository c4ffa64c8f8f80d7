//! What the names of a compiled function hold, without their values: types, sizes, fields.
//!
//! Given values have forms of their own; those of locals and outputs follow from their declarations.  Where a declaration
//! says `v[:]`, the size is read off the value or the first assignment.

use std::rc::Rc;

use hyd_instance::{ScalarType, Value};
use hyd_source::Span;
use hyd_symbolic::NodeId;
use hyd_syntax::tree::Name;
use hyd_typed::Function;

use crate::state::context::{Closure, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, SlotKey};
use crate::state::node::Typed;

/// What a name of a function holds, without its value.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Form {
    Scalar(ScalarType),
    Array(ScalarType, Vec<usize>),
    Record(Vec<(Name, Form)>),
    /// An array of records: the sizes stand first in each field.
    Records(Vec<(Name, Form)>, Vec<usize>),
    /// A value fixed in the body.
    Fixed(Value),
    /// A function, fixed in the body, with the forms of the inputs that are given.
    Function(FixedFunction, Vec<(Name, Form)>),
}

/// A function that a body is made for; equal where it is the same one.
#[derive(Clone, Debug)]
pub(crate) struct FixedFunction(Rc<Function>);

impl PartialEq for FixedFunction {
    fn eq(&self, other: &Self) -> bool {
        self.0.inst == other.0.inst
    }
}

impl Form {
    /// The types of its registers in order.
    pub(crate) fn scalars(&self) -> Vec<ScalarType> {
        match self {
            Form::Scalar(scalar) => vec![scalar.clone()],
            Form::Array(scalar, shape) => vec![scalar.clone(); shape.iter().product()],
            Form::Record(fields) | Form::Records(fields, _) | Form::Function(_, fields) => {
                fields.iter().flat_map(|(_, form)| form.scalars()).collect()
            }
            Form::Fixed(_) => Vec::new(),
        }
    }

    /// An array of such values.
    pub(crate) fn repeated(self, sizes: &[usize]) -> Self {
        let longer = |shape: Vec<usize>| sizes.iter().copied().chain(shape).collect::<Vec<_>>();
        let fields = |list: Vec<(Name, Form)>| list.into_iter().map(|(n, form)| (n, form.repeated(sizes))).collect();
        match self {
            Form::Scalar(scalar) => Form::Array(scalar, sizes.to_vec()),
            Form::Array(scalar, shape) => Form::Array(scalar, longer(shape)),
            Form::Record(list) => Form::Records(fields(list), sizes.to_vec()),
            Form::Records(list, shape) => Form::Records(fields(list), longer(shape)),
            fixed => fixed,
        }
    }

    /// The local value over nodes in the order of [`Form::scalars`].
    pub(crate) fn local(&self, nodes: &mut dyn Iterator<Item = NodeId>) -> Local {
        let mut typed = |scalar: &ScalarType| {
            let node = nodes.next().expect("invariant: there is a node for every register of the form");
            Typed { node, scalar: scalar.clone() }
        };
        match self {
            Form::Scalar(scalar) => Local::Node(typed(scalar)),
            Form::Array(scalar, shape) => {
                let count: usize = shape.iter().product();
                Local::array((0..count).map(|_| typed(scalar)).collect(), shape.clone())
            }
            Form::Record(fields) => {
                Local::Record(fields.iter().map(|(name, form)| (name.clone(), form.local(nodes))).collect())
            }
            Form::Records(fields, shape) => {
                let fields = fields.iter().map(|(name, form)| (name.clone(), form.local(nodes))).collect();
                Local::Records(fields, shape.clone())
            }
            Form::Function(function, given) => {
                let given = given.iter().map(|(name, form)| (name.clone(), form.local(nodes))).collect();
                Local::Function(Rc::new(Closure { function: function.0.clone(), given }))
            }
            Form::Fixed(Value::Integer(k)) => Local::Index(Affine::constant(*k)),
            Form::Fixed(value) => Local::Value(value.clone()),
        }
    }
}

impl Flattener<'_, '_> {
    /// Type and sizes of an input and its value.
    pub(crate) fn form_of(&mut self, span: Span, real: bool, value: &Local, sizes: bool) -> Result<Form, Fail> {
        let declared = real.then_some(ScalarType::Real);
        let scalar = |given: &ScalarType| declared.clone().unwrap_or_else(|| given.clone());
        Ok(match value {
            Local::Value(value @ (Value::Text(_) | Value::Object(_))) => Form::Fixed(value.clone()),
            // An array of texts.
            Local::Value(value) if !value.shape().is_empty() => Form::Fixed(value.clone()),
            Local::Index(affine) if sizes => match affine.as_constant() {
                Some(k) => Form::Fixed(Value::Integer(k)),
                None => Form::Scalar(ScalarType::Integer),
            },
            Local::Index(_) => Form::Scalar(scalar(&ScalarType::Integer)),
            Local::Value(value @ Value::Boolean(_)) if sizes => Form::Fixed(value.clone()),
            Local::Value(value) => {
                let value = value.clone();
                Form::Scalar(scalar(&self.constant_value(span, &value)?.scalar))
            }
            Local::Node(typed) => Form::Scalar(scalar(&typed.scalar)),
            Local::Array(items, shape) => {
                Form::Array(items.first().map_or(ScalarType::Real, |item| scalar(&item.scalar)), shape.clone())
            }
            Local::Record(fields) => {
                let mut forms = Vec::with_capacity(fields.len());
                for (name, field) in fields {
                    forms.push((name.clone(), self.form_of(span, false, field, sizes)?));
                }
                Form::Record(forms)
            }
            Local::Records(fields, shape) => {
                let mut forms = Vec::with_capacity(fields.len());
                for (name, field) in fields {
                    forms.push((name.clone(), self.form_of(span, false, field, sizes)?));
                }
                Form::Records(forms, shape.clone())
            }
            Local::Function(closure) => {
                let mut forms = Vec::with_capacity(closure.given.len());
                for (name, given) in &closure.given {
                    let sizes = closure.function.decides_sizes(name);
                    forms.push((name.clone(), self.form_of(span, false, given, sizes)?));
                }
                Form::Function(FixedFunction(closure.function.clone()), forms)
            }
        })
    }

    /// The nodes of a value in the order of its form.
    pub(crate) fn nodes_of(
        &mut self,
        span: Span,
        form: &Form,
        value: &Local,
        nodes: &mut Vec<NodeId>,
    ) -> Result<(), Fail> {
        match (form, value) {
            (Form::Fixed(_), _) => {}
            (Form::Record(forms), Local::Record(fields)) | (Form::Records(forms, _), Local::Records(fields, _)) => {
                for ((_, form), (_, field)) in forms.iter().zip(fields) {
                    self.nodes_of(span, form, field, nodes)?;
                }
            }
            (Form::Function(_, forms), Local::Function(closure)) => {
                for ((_, form), (_, given)) in forms.iter().zip(&closure.given) {
                    self.nodes_of(span, form, given, nodes)?;
                }
            }
            (_, Local::Array(items, _)) => nodes.extend(items.iter().map(|item| item.node)),
            (_, Local::Index(affine)) if affine.as_constant().is_none() => {
                let slot = self.slots.slot(SlotKey::Number(affine.clone()));
                nodes.push(self.model.templates.arena.slot(slot));
            }
            (_, single) => nodes.push(self.as_node(span, single)?.node),
        }
        Ok(())
    }
}
