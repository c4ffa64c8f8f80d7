//! Expressions to nodes: one element at a time.
//!
//! `lower(expr, cx, index)` gives the element of `expr` at `index` (affine subscripts from 0, one per dimension), so that
//! array expressions need no arrays of nodes and an equation inside loops is lowered once.  Types follow Modelica 3.6,
//! section 6.7 and chapter 10.

use hyd_instance::value::LARGEST_INTEGER;
use hyd_instance::{ScalarType, Value};
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{NodeId, Relation};
use hyd_syntax::tree::{BinaryOp, Expr, ExprKind, UnaryOp};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::fold::Fold;
use crate::index::Affine;
use crate::model::Section;
use hyd_instance::InstId;
use hyd_instance::sizes_text;

/// A node with its type.
#[derive(Clone, Debug)]
pub(crate) struct Typed {
    /// The value.
    pub node: NodeId,
    /// Its type.
    pub scalar: ScalarType,
}

impl Typed {
    pub(crate) fn real(node: NodeId) -> Self {
        Self { node, scalar: ScalarType::Real }
    }

    pub(crate) fn boolean(node: NodeId) -> Self {
        Self { node, scalar: ScalarType::Boolean }
    }

    /// A number: Real or Integer.
    pub(crate) fn is_number(&self) -> bool {
        matches!(self.scalar, ScalarType::Real | ScalarType::Integer)
    }
}

/// Most terms of a sum that is written out.
pub(crate) const MAX_TERMS: usize = 1 << 20;

/// Deepest nesting of expressions, those of called functions within those of the caller: it takes stack.
const MAX_LOWERING: usize = 3000;

/// Most expressions that one equation may be written out to, some ten seconds: where subscripts or conditions make every turn of a
/// loop an equation of its own, one line could take for ever.
const MAX_LOWERED: u64 = 25_000_000;

impl Flattener<'_, '_> {
    /// The element of an expression.
    pub(crate) fn lower(&mut self, expr: &Expr, cx: &mut Context, index: &[Affine]) -> Result<Typed, Fail> {
        if self.lowering >= MAX_LOWERING {
            let message =
                format!("expressions with those of the functions they call are nested deeper than {MAX_LOWERING}");
            return Err(self.error(Code::Limit, expr.span, message));
        }
        self.lowered += 1;
        if self.lowered >= MAX_LOWERED {
            let message = format!("this is written out to more than {MAX_LOWERED} operations");
            let first = self.lowered == MAX_LOWERED;
            return Err(if first { self.error(Code::Limit, expr.span, message) } else { Fail::Reported });
        }
        self.lowering += 1;
        let lowered = self.lower_kind(expr, cx, index);
        self.lowering -= 1;
        lowered
    }

    fn lower_kind(&mut self, expr: &Expr, cx: &mut Context, index: &[Affine]) -> Result<Typed, Fail> {
        match &expr.kind {
            // Beyond the range of Integers it is a Real.
            ExprKind::Integer(k) if k.unsigned_abs() > LARGEST_INTEGER as u64 => {
                Ok(self.literal(*k as f64, ScalarType::Real))
            }
            ExprKind::Integer(k) => Ok(self.literal(*k as f64, ScalarType::Integer)),
            ExprKind::Real(x) => Ok(self.literal(*x, ScalarType::Real)),
            ExprKind::Boolean(b) => Ok(self.literal(f64::from(u8::from(*b)), ScalarType::Boolean)),
            ExprKind::Text(_) => {
                Err(self.error(Code::TypeMismatch, expr.span, "a String is not a value of an equation"))
            }
            ExprKind::Ref(reference) => self.lower_ref(reference, cx, index),
            ExprKind::Call(function, arguments) => self.lower_call(expr.span, function, arguments, cx, index),
            ExprKind::Unary(op, a) => self.lower_unary(expr.span, *op, a, cx, index),
            ExprKind::Binary(op, a, b) => self.lower_binary(expr.span, *op, a, b, cx, index),
            ExprKind::If(branches, otherwise) => self.lower_if(expr.span, branches, otherwise, cx, index),
            ExprKind::Range(start, step, stop) => {
                let [position] = index else {
                    return Err(self.error(Code::ArrayShape, expr.span, "an array stands where a scalar is needed"));
                };
                let local = self.steps_of(start, step.as_deref(), stop, cx)?.at(position)?;
                self.node_of_index(expr.span, &local)
            }
            ExprKind::Array(items) => {
                let (&k, rest) = self.first_constant(expr.span, index)?;
                let item = items.get(k as usize).ok_or(Fail::Reported)?;
                self.lower(item, cx, rest)
            }
            ExprKind::ArrayFor(body, iterators) => self.lower_comprehension(expr.span, body, iterators, cx, index),
            ExprKind::Matrix(rows) => self.lower_matrix(expr.span, rows, cx, index),
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.lower(only, cx, index),
                _ => Err(self.error(Code::TypeMismatch, expr.span, "a list of results is not a value")),
            },
            ExprKind::Field(record, name) => self.lower_field(record, name, cx, index),
            ExprKind::Colon => Err(self.error(Code::Misplaced, expr.span, "`:` is not a value")),
            ExprKind::End => match cx.ends.last() {
                Some(&size) => Ok(self.literal(size as f64, ScalarType::Integer)),
                None => Err(self.error(Code::Misplaced, expr.span, "`end` is allowed only in subscripts")),
            },
        }
    }

    pub(crate) fn literal(&mut self, value: f64, scalar: ScalarType) -> Typed {
        Typed { node: self.model.templates.arena.constant(value), scalar }
    }

    /// The first subscript as a number, and the others.
    fn first_constant<'a>(&mut self, span: Span, index: &'a [Affine]) -> Result<(&'a i64, &'a [Affine]), Fail> {
        let Some((first, rest)) = index.split_first() else {
            return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
        };
        if first.terms.is_empty() { Ok((&first.constant, rest)) } else { Err(Fail::NeedsExpansion) }
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
            Value::Array(_) | Value::Record(_) => {
                return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
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

    fn lower_unary(
        &mut self,
        span: Span,
        op: UnaryOp,
        a: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let value = self.lower(a, cx, index)?;
        let arena = &mut self.model.templates.arena;
        match op {
            UnaryOp::Not => {
                let node = arena.not(value.node);
                self.want_boolean(span, "`not`", &value)?;
                Ok(Typed::boolean(node))
            }
            UnaryOp::Minus => {
                let node = arena.neg(value.node);
                self.want_number(span, "`-`", &value)?;
                Ok(Typed { node, scalar: value.scalar })
            }
            UnaryOp::Plus => {
                self.want_number(span, "`+`", &value)?;
                Ok(value)
            }
        }
    }

    fn lower_binary(
        &mut self,
        span: Span,
        op: BinaryOp,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        use BinaryOp as Op;
        match op {
            Op::And | Op::Or if self.in_body(cx) => self.build_logic(op == Op::And, a, b, cx, index),
            Op::And | Op::Or => {
                let x = self.lower(a, cx, index)?;
                self.want_boolean(a.span, "a logical operator", &x)?;
                // The right side matters only where the left one does not decide.
                let open = if op == Op::And { x.node } else { self.model.templates.arena.not(x.node) };
                let y = self.where_holds(open, cx, |flat, cx| flat.lower(b, cx, index))?;
                self.want_boolean(b.span, "a logical operator", &y)?;
                let arena = &mut self.model.templates.arena;
                let node = if op == Op::And { arena.and(x.node, y.node) } else { arena.or(x.node, y.node) };
                Ok(Typed::boolean(node))
            }
            Op::Equal => self.lower_relation(span, Relation::Equal, a, b, cx),
            Op::NotEqual => self.lower_relation(span, Relation::NotEqual, a, b, cx),
            Op::Less => self.lower_relation(span, Relation::Less, a, b, cx),
            Op::LessEqual => self.lower_relation(span, Relation::LessEqual, a, b, cx),
            Op::Greater => self.lower_relation(span, Relation::Greater, a, b, cx),
            Op::GreaterEqual => self.lower_relation(span, Relation::GreaterEqual, a, b, cx),
            _ => self.lower_arithmetic(span, op, a, b, cx, index),
        }
    }

    fn lower_relation(
        &mut self,
        span: Span,
        relation: Relation,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
    ) -> Result<Typed, Fail> {
        if let Some(decided) = self.relate_texts(relation, a, b, cx)? {
            return Ok(decided);
        }
        let (x, y) = (self.lower(a, cx, &[])?, self.lower(b, cx, &[])?);
        let fits = x.is_number() && y.is_number() || x.scalar == y.scalar;
        if !fits {
            let message = format!("{} and {} cannot be compared", x.scalar.name(), y.scalar.name());
            return Err(self.error(Code::TypeMismatch, span, message));
        }
        let discrete = !matches!(x.scalar, ScalarType::Real) && !matches!(y.scalar, ScalarType::Real);
        let arena = &mut self.model.templates.arena;
        let literal = cx.no_event || discrete || matches!(relation, Relation::Equal | Relation::NotEqual);
        let node =
            if literal { arena.compare(relation, x.node, y.node) } else { arena.event(relation, x.node, y.node) };
        Ok(Typed::boolean(node))
    }

    fn lower_arithmetic(
        &mut self,
        span: Span,
        op: BinaryOp,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        use BinaryOp as Op;
        // Scalars, the usual case, need no look at the sizes of the operands but for products.
        if op == Op::Mul {
            let (left, right) = (self.shape(a, cx)?, self.shape(b, cx)?);
            if !left.is_empty() && !right.is_empty() {
                return self.lower_product(span, a, b, &left, &right, cx, index);
            }
            let x = self.lower(a, cx, if left.is_empty() { &[] } else { index })?;
            let y = self.lower(b, cx, if right.is_empty() { &[] } else { index })?;
            return self.combine_exactly(span, op, x, y, cx);
        }
        if index.is_empty() {
            let (x, y) = (self.lower(a, cx, &[])?, self.lower(b, cx, &[])?);
            return self.combine_exactly(span, op, x, y, cx);
        }
        if op == Op::Pow {
            return self.lower_matrix_power(span, a, b, cx, index);
        }
        let (left, right) = (self.shape(a, cx)?, self.shape(b, cx)?);
        let x = self.lower(a, cx, if left.is_empty() { &[] } else { index })?;
        let y = self.lower(b, cx, if right.is_empty() { &[] } else { index })?;
        self.combine_exactly(span, op, x, y, cx)
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

    /// Products of arrays: sums over the common dimension (Modelica 3.6, section 10.6.4).
    #[allow(clippy::too_many_arguments)]
    fn lower_product(
        &mut self,
        span: Span,
        a: &Expr,
        b: &Expr,
        left: &[usize],
        right: &[usize],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let inner = left[left.len() - 1];
        let (rows, columns) = index.split_at((left.len() - 1).min(index.len()));
        let mut term = |flat: &mut Self, cx: &mut Context, k: &Affine| {
            let mut at: Vec<Affine> = rows.to_vec();
            at.push(k.clone());
            let x = flat.lower(a, cx, &at)?;
            let mut at = vec![k.clone()];
            at.extend(columns.iter().take(right.len() - 1).cloned());
            let y = flat.lower(b, cx, &at)?;
            flat.combine_exactly(span, BinaryOp::Mul, x, y, cx)
        };
        if let Some(long) = self.long_fold(Fold::Sum, inner, (span, cx), &mut term)? {
            return Ok(long);
        }
        let mut terms = Vec::with_capacity(inner);
        for k in 0..inner as i64 {
            terms.push(term(self, cx, &Affine::constant(k))?);
        }
        Ok(self.sum(terms))
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

    fn lower_comprehension(
        &mut self,
        span: Span,
        body: &Expr,
        iterators: &[hyd_syntax::tree::Iterator],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let mark = cx.names.len();
        let mut rest = index;
        // The last iterator is the outermost (10.4.1).
        for iterator in iterators.iter().rev() {
            let Some((first, others)) = rest.split_first() else {
                return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
            };
            rest = others;
            let local = self.range_element(iterator, cx, first)?;
            cx.names.push((iterator.name.name.clone(), local));
        }
        let result = self.lower(body, cx, rest);
        cx.names.truncate(mark);
        result
    }

    /// The value of a loop variable at position `at` of its range.
    fn range_element(
        &mut self,
        iterator: &hyd_syntax::tree::Iterator,
        cx: &mut Context,
        at: &Affine,
    ) -> Result<Local, Fail> {
        self.range(iterator, cx)?.at(at)
    }

    /// Sum, product, smallest or largest over the elements of an expression or the values of iterators.
    pub(crate) fn elements_of(&mut self, expr: &Expr, cx: &mut Context) -> Result<Vec<Typed>, Fail> {
        let shape = self.shape(expr, cx)?;
        let total = shape.iter().fold(1usize, |product, &size| product.saturating_mul(size));
        if total > MAX_TERMS {
            return Err(self.error(Code::Limit, expr.span, format!("more than {MAX_TERMS} terms")));
        }
        let mut result = Vec::with_capacity(total);
        for k in 0..total {
            let mut rest = k;
            let mut at = vec![Affine::constant(0); shape.len()];
            for (position, &size) in shape.iter().enumerate().rev() {
                at[position] = Affine::constant((rest % size) as i64);
                rest /= size;
            }
            result.push(self.lower(expr, cx, &at)?);
        }
        Ok(result)
    }

    /// Checks that a value may be given to a variable.
    pub(crate) fn check_assignable(
        &mut self,
        to: &ScalarType,
        value: &Typed,
        span: Span,
        section: Section,
        inst: InstId,
    ) -> Result<(), Fail> {
        let fits = *to == value.scalar || matches!((to, &value.scalar), (ScalarType::Real, ScalarType::Integer));
        if fits {
            return Ok(());
        }
        let name = self.path(inst);
        let declared = self.tree.instances[inst].span;
        let what = if section == Section::Start { "the start value" } else { "the value" };
        let message = format!("{what} of `{name}` is {}, but `{name}` is {}", value.scalar.name(), to.name());
        self.report(
            Diagnostic::error(Code::TypeMismatch, message)
                .at(span, value.scalar.name().to_string())
                .with(declared, "declared here"),
        );
        Err(Fail::Reported)
    }

    /// Checks that both sides of an equation have the same sizes.
    pub(crate) fn check_same_shape(&mut self, span: Span, left: &[usize], right: &[usize]) -> Result<(), Fail> {
        self.check_same_sizes("the sides of this equation", span, left, right)
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
}

/// A loop variable's value as a local name.
pub(crate) fn local_of(value: Value) -> Local {
    match value {
        Value::Integer(k) => Local::Index(Affine::constant(k)),
        other => Local::Value(other),
    }
}
