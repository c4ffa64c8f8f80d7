//! Scalar values of expressions: nodes with their types, literals, what operators want, and how values are put together.

use hyd_instance::value::LARGEST_INTEGER;
use hyd_instance::{ScalarType, Value, sizes_text};
use hyd_source::{Code, Span};
use hyd_symbolic::{NodeId, contains_initial, contains_time, slots};
use hyd_syntax::tree::BinaryOp;
use hyd_system::Variability;

use crate::model::VarId;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    pub(crate) fn literal(&mut self, value: f64, scalar: ScalarType) -> Typed {
        Typed { node: self.model.templates.arena.constant(value), scalar }
    }

    /// An element of a value known at translation.
    pub(crate) fn element_of_value(&mut self, span: Span, value: &Value, index: &[Affine]) -> Result<Typed, Fail> {
        let mut subscripts = Vec::with_capacity(index.len());
        for affine in index {
            match affine.as_constant() {
                Some(k) => subscripts.push((k + 1) as usize),
                None => {
                    let Some(same) = value.uniform() else { return Err(Fail::NeedsExpansion) };
                    let same = same.clone();
                    return self.constant_value(span, &same);
                }
            }
        }
        match value.element(&subscripts) {
            Some(element) => {
                let element = element.clone();
                self.constant_value(span, &element)
            }
            None => Err(self.error(Code::ArrayShape, span, "a subscript is outside the array")),
        }
    }

    /// A value known at translation as a literal.
    pub(crate) fn constant_value(&mut self, span: Span, value: &Value) -> Result<Typed, Fail> {
        let scalar = match value {
            Value::Real(_) => ScalarType::Real,
            Value::Integer(_) => ScalarType::Integer,
            Value::Boolean(_) => ScalarType::Boolean,
            Value::Enumeration(e, _) => ScalarType::Enumeration(e.clone()),
            Value::Text(_) => {
                return Err(self.error(Code::TypeMismatch, span, "a String is not a value of an equation"));
            }
            Value::Object(_) => {
                return Err(self.error(Code::TypeMismatch, span, "an external object is not a value of an equation"));
            }
            Value::Array(_) | Value::Record(_) => {
                return Err(self.no_scalar(span));
            }
        };
        if matches!(value, Value::Integer(k) if k.unsigned_abs() > LARGEST_INTEGER as u64) {
            let message = format!("the Integer {} is beyond 2^53, from where on Integers are not exact", value.text());
            return Err(self.error(Code::Value, span, message));
        }
        let stored = value.as_stored().unwrap_or(0.0);
        Ok(self.literal(stored, scalar))
    }

    /// A number wanted by an operator.
    pub(crate) fn want_number(&mut self, span: Span, what: &str, value: &Typed) -> Result<(), Fail> {
        if value.is_number() {
            return Ok(());
        }
        let message = format!("{what} needs a Real or Integer, but this is {}", value.scalar.name());
        Err(self.error(Code::TypeMismatch, span, message))
    }

    pub(crate) fn want_boolean(&mut self, span: Span, what: &str, value: &Typed) -> Result<(), Fail> {
        if matches!(value.scalar, ScalarType::Boolean) {
            return Ok(());
        }
        let message = format!("{what} needs a Boolean, but this is {}", value.scalar.name());
        Err(self.error(Code::TypeMismatch, span, message))
    }

    pub(crate) fn combine(&mut self, span: Span, op: BinaryOp, x: Typed, y: Typed) -> Result<Typed, Fail> {
        use BinaryOp as Op;
        self.want_number(span, "this operator", &x)?;
        self.want_number(span, "this operator", &y)?;
        let both_integer = matches!((&x.scalar, &y.scalar), (ScalarType::Integer, ScalarType::Integer));
        let arena = &mut self.model.templates.arena;
        let (node, real) = match op {
            Op::Add | Op::ElementAdd => (arena.add(x.node, y.node), false),
            Op::Sub | Op::ElementSub => (arena.sub(x.node, y.node), false),
            Op::Mul | Op::ElementMul => (arena.mul(x.node, y.node), false),
            Op::Div | Op::ElementDiv => (arena.div(x.node, y.node), true),
            _ => (arena.pow(x.node, y.node), true),
        };
        let scalar = if both_integer && !real { ScalarType::Integer } else { ScalarType::Real };
        Ok(Typed { node, scalar })
    }

    /// A sum as a balanced tree, so that long sums stay shallow.
    pub(crate) fn sum(&mut self, mut terms: Vec<Typed>) -> Typed {
        if terms.is_empty() {
            return self.literal(0.0, ScalarType::Integer);
        }
        while terms.len() > 1 {
            let mut next = Vec::with_capacity(terms.len().div_ceil(2));
            for pair in terms.chunks(2) {
                next.push(match pair {
                    [x, y] => {
                        let integer = matches!((&x.scalar, &y.scalar), (ScalarType::Integer, ScalarType::Integer));
                        let node = self.model.templates.arena.add(x.node, y.node);
                        Typed { node, scalar: if integer { ScalarType::Integer } else { ScalarType::Real } }
                    }
                    single => single[0].clone(),
                });
            }
            terms = next;
        }
        terms.swap_remove(0)
    }

    /// `if test then chosen else other`, whose types must agree.
    pub(crate) fn choose(&mut self, span: Span, test: NodeId, chosen: Typed, other: Typed) -> Result<Typed, Fail> {
        let scalar = if chosen.scalar == other.scalar {
            chosen.scalar.clone()
        } else if chosen.is_number() && other.is_number() {
            ScalarType::Real
        } else {
            let message =
                format!("the branches have different types, {} and {}", chosen.scalar.name(), other.scalar.name());
            return Err(self.error(Code::TypeMismatch, span, message));
        };
        let node = self.model.templates.arena.select(test, chosen.node, other.node);
        Ok(Typed { node, scalar })
    }

    /// Lowers what is reached only where `test` is true.
    pub(crate) fn where_holds<T>(
        &mut self,
        test: NodeId,
        cx: &mut Context,
        lower: impl FnOnce(&mut Self, &mut Context) -> T,
    ) -> T {
        let around = cx.holds;
        let arena = &mut self.model.templates.arena;
        cx.holds = Some(around.map_or(test, |outer| arena.and(outer, test)));
        let result = lower(self, cx);
        cx.holds = around;
        result
    }

    /// Checks that `what` have the same sizes.
    pub(crate) fn check_same_sizes(
        &mut self,
        what: &str,
        span: Span,
        left: &[usize],
        right: &[usize],
    ) -> Result<(), Fail> {
        if left == right {
            return Ok(());
        }
        let message = format!("{what} have different sizes: {} and {}", sizes_text(left), sizes_text(right));
        Err(self.error(Code::ArrayShape, span, message))
    }

    /// True for a continuous variable.
    pub(crate) fn varies(&self, v: VarId) -> bool {
        self.variable_of(v).variability == Variability::Continuous
    }

    /// True if a value cannot change during the run.
    pub(crate) fn is_fixed(&self, node: NodeId) -> bool {
        let arena = &self.model.templates.arena;
        let fixed = |slot: &hyd_symbolic::SlotId| match &self.slots.keys[slot.0 as usize] {
            SlotKey::Number(_) | SlotKey::Quantity(_) => true,
            SlotKey::Variable(Kind::Start, ..) => true,
            SlotKey::Variable(Kind::Var, v, _) => self.variable_of(*v).variability <= Variability::Parameter,
            SlotKey::Variable(..) => false,
        };
        !contains_time(arena, node) && !contains_initial(arena, node) && slots(arena, &[node]).iter().all(fixed)
    }

    /// True if the value may change between events.
    pub(crate) fn changes_between_events(&self, node: NodeId) -> bool {
        let arena = &self.model.templates.arena;
        hyd_symbolic::contains_time(arena, node)
            || hyd_symbolic::slots(arena, &[node]).iter().any(|slot| match &self.slots.keys[slot.0 as usize] {
                SlotKey::Variable(Kind::Der, ..) => true,
                SlotKey::Variable(Kind::Var, v, _) => self.varies(*v),
                _ => false,
            })
    }
}
