//! Expressions to nodes: one element at a time.
//!
//! `lower(expr, cx, index)` gives the element of `expr` at `index` (affine subscripts from 0, one per dimension), so that
//! array expressions need no arrays of nodes and an equation inside loops is lowered once.  Types follow Modelica 3.6,
//! section 6.7 and chapter 10.

use hyd_instance::constructor::RecordField;
use hyd_instance::{InstId, ScalarType, Value};
use hyd_source::{Code, Diagnostic, Edit, Span};
use hyd_symbolic::{Relation, contains_time};
use hyd_syntax::tree::{BinaryOp, Expr as Text, UnaryOp};
use hyd_typed::{Declaration, Expr, Iterator, Kind, Type};

use crate::expressions::array::{at, constants};
use crate::expressions::builtin_call::BuiltinCall;
use crate::expressions::fold::Fold;
use crate::model::Section;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

/// Largest array inside a function.
const MAX_LOCAL: usize = 1 << 20;

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
            Kind::Integer(k) if !expr.ty.is_integer() => Ok(self.literal(*k as f64, ScalarType::Real)),
            Kind::Integer(k) => Ok(self.literal(*k as f64, ScalarType::Integer)),
            Kind::Real(x) => Ok(self.literal(*x, ScalarType::Real)),
            Kind::Boolean(b) => Ok(self.literal(f64::from(u8::from(*b)), ScalarType::Boolean)),
            Kind::Text(_) | Kind::Format(..) => {
                Err(self.error(Code::TypeMismatch, expr.span, "a String is not a value of an equation"))
            }
            Kind::Literal(enumeration, k, _) => {
                Ok(self.literal(f64::from(*k), ScalarType::Enumeration(enumeration.clone())))
            }
            Kind::Time if cx.depth > 0 => {
                let message = "`time` is not allowed inside a function: make it an input";
                Err(self.error(Code::Misplaced, expr.span, message))
            }
            Kind::Time => Ok(Typed::real(self.model.templates.arena.intern(hyd_symbolic::Node::Time))),
            Kind::Class(local, _) => {
                let name = self.scopes.table.full_name(local.class);
                Err(self.error(Code::TypeMismatch, expr.span, format!("the class `{name}` is not a value")))
            }
            Kind::Function(_) => {
                Err(self.error(Code::TypeMismatch, expr.span, "a function stands where a value is needed"))
            }
            Kind::Values(enumeration, _) => {
                let name = enumeration.as_ref().map_or("Boolean", |e| &e.name);
                Err(self.error(Code::TypeMismatch, expr.span, format!("the class `{name}` is not a value")))
            }
            Kind::Variable(variable) => self.lower_reference(expr, variable, cx, index),
            Kind::Local(local) => self.lower_local(expr.span, local, cx, index),
            Kind::Builtin(builtin, list) => {
                BuiltinCall { flat: self, builtin: *builtin, span: expr.span, list, cx }.element(index)
            }
            Kind::Reduction(builtin, body, iterators) => self.lower_reduction(expr.span, *builtin, body, iterators, cx),
            Kind::Call(_) | Kind::Record(_) => {
                let result = self.call(expr, cx)?;
                self.element_of_local(expr.span, &result, index)
            }
            Kind::Unary(op, a) => self.lower_unary(expr.span, *op, a, cx, index),
            Kind::Binary(op, a, b) => self.lower_binary(expr.span, *op, a, b, cx, index),
            Kind::If(branches, otherwise) => self.lower_if(expr.span, branches, otherwise, cx, index),
            Kind::Range(start, step, stop) => {
                let [position] = index else {
                    return Err(self.no_scalar(expr.span));
                };
                let local = self.steps_of(start, step.as_deref(), stop, cx)?.at(position)?;
                self.node_of_index(expr.span, &local)
            }
            Kind::Array(items) => {
                let (&k, rest) = self.first_constant(expr.span, index)?;
                let item = items.get(k as usize).ok_or(Fail::Reported)?;
                self.lower(item, cx, rest)
            }
            Kind::ArrayFor(body, iterators) => self.lower_comprehension(expr.span, body, iterators, cx, index),
            Kind::Matrix(rows) => self.lower_matrix(expr.span, rows, cx, index),
            Kind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.lower(only, cx, index),
                _ => Err(self.error(Code::TypeMismatch, expr.span, "a list of results is not a value")),
            },
            Kind::Field(record, name) => self.lower_field(record, name, cx, index),
            Kind::Colon => Err(self.error(Code::Misplaced, expr.span, "`:` is not a value")),
            Kind::End => match cx.ends.last() {
                Some(&size) => Ok(self.literal(size as f64, ScalarType::Integer)),
                None => Err(self.error(Code::Misplaced, expr.span, "`end` is allowed only in subscripts")),
            },
            Kind::Failed(said, _) => Err(self.say(said)),
        }
    }

    /// The first subscript as a number, and the others.
    fn first_constant<'a>(&mut self, span: Span, index: &'a [Affine]) -> Result<(&'a i64, &'a [Affine]), Fail> {
        let Some((first, rest)) = index.split_first() else {
            return Err(self.no_scalar(span));
        };
        if first.terms.is_empty() { Ok((&first.constant, rest)) } else { Err(Fail::NeedsExpansion) }
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
            let said = Diagnostic::error(Code::TypeMismatch, message).at(span, "");
            self.report(match literal_meant(&x, b).or_else(|| literal_meant(&y, a)) {
                Some((literal, edit)) => {
                    let help = format!("literals of an enumeration are no numbers: write `{literal}`");
                    said.help(help).propose(format!("write `{literal}`"), vec![edit])
                }
                None => said,
            });
            return Err(Fail::Reported);
        }
        let discrete = !matches!(x.scalar, ScalarType::Real) && !matches!(y.scalar, ScalarType::Real);
        let arena = &mut self.model.templates.arena;
        // A `when` is evaluated at its events.  With the time an event stays: at the crossing itself a comparison would be a matter of rounding.
        let is_timed = [x.node, y.node].into_iter().any(|side| contains_time(arena, side));
        let quiet = cx.no_event || cx.in_when && !is_timed;
        let literal = quiet || discrete || matches!(relation, Relation::Equal | Relation::NotEqual);
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

    fn lower_comprehension(
        &mut self,
        span: Span,
        body: &Expr,
        iterators: &[Iterator],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let mark = cx.names.len();
        let mut rest = index;
        // The last iterator is the outermost (10.4.1).
        for iterator in iterators.iter().rev() {
            let Some((first, others)) = rest.split_first() else {
                return Err(self.no_scalar(span));
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
    fn range_element(&mut self, iterator: &Iterator, cx: &mut Context, at: &Affine) -> Result<Local, Fail> {
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
        let declared = self.scopes.instances[inst].span;
        let what = if section == Section::Start { "the start value" } else { "the value" };
        let message = format!("{what} of `{name}` is {}, but `{name}` is {}", value.scalar.name(), to.name());
        let said = Diagnostic::error(Code::TypeMismatch, message)
            .at(span, value.scalar.name().to_string())
            .with(declared, "declared here");
        let whole = "`div(a, b)` is the quotient of integers without its remainder (`/` gives a Real), `integer(x)` the integer at or below x";
        let is_whole = *to == ScalarType::Integer && value.scalar == ScalarType::Real;
        self.report(if is_whole { said.help(whole) } else { said });
        Err(Fail::Reported)
    }

    /// Checks that both sides of an equation have the same sizes.
    pub(crate) fn check_same_shape(&mut self, span: Span, left: &[usize], right: &[usize]) -> Result<(), Fail> {
        self.check_same_sizes("the sides of this equation", span, left, right)
    }

    /// An expression as a local value: a node, an array of nodes or a record.
    pub(crate) fn local_value(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        if let Some(record) = self.as_record(expr, cx)? {
            return Ok(record);
        }
        if expr.ty.is_text() && expr.ty.rank > 0 {
            let (env, complete) = cx.env();
            if !complete && cx.has_counter_in(expr) {
                return Err(Fail::NeedsExpansion);
            }
            return Ok(Local::Value(self.scopes.evaluate(&expr.evaluable(), cx.scope, &env)?));
        }
        if expr.ty.is_text() {
            return Ok(Local::Value(Value::Text(self.text_value(expr, cx)?.into())));
        }
        if expr.ty.is_object() {
            let (env, _) = cx.env();
            return Ok(Local::Value(self.scopes.evaluate(&expr.evaluable(), cx.scope, &env)?));
        }
        if matches!(expr.kind, Kind::Call(_)) {
            let local = self.call(expr, cx)?;
            return Ok(self.known_integer(local));
        }
        let shape = self.shape(expr, cx)?;
        if shape.is_empty() {
            let value = self.lower(expr, cx, &[])?;
            return Ok(self.known_integer(Local::Node(value)));
        }
        Ok(Local::array(self.elements_of(expr, cx)?, shape))
    }

    /// Sizes of the first output.
    pub(crate) fn shape_of_user_call(
        &mut self,
        expr: &Expr,
        call: &hyd_typed::Call,
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        if expr.ty.rank == 0 {
            return Ok(Vec::new());
        }
        let function = self.callee(call, cx)?.function.clone();
        let plain = |v: &Declaration| v.dims.is_empty() && v.is_simple();
        if function.outputs().all(plain) && function.inputs().all(plain) {
            for argument in call.positional.iter().chain(call.named.iter().map(|(_, e)| e)) {
                if !argument.ty.is_text() {
                    let shape = self.shape(argument, cx)?;
                    if !shape.is_empty() {
                        return Ok(shape);
                    }
                }
            }
            return Ok(Vec::new());
        }
        // Whoever asks for the value next makes the same call.
        let met = self.draws_met.clone();
        let called = self.call(expr, cx);
        self.draws_met = met;
        Ok(match called? {
            Local::Array(_, shape) | Local::Records(_, shape) => shape,
            _ => Vec::new(),
        })
    }

    /// The value of a text that stands where the context says.
    pub(crate) fn value_of_text(&mut self, expr: &Text, cx: &mut Context) -> Result<Local, Fail> {
        let typed = self.elaborator(cx.scope, Some(cx)).expr(expr)?;
        self.local_value(&typed, cx)
    }

    /// The sizes of a field, whose text stands where the context says, and those that its type adds.
    pub(crate) fn sizes_of_field(&mut self, field: &RecordField, cx: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut dims = Vec::with_capacity(field.declaration.dims.len());
        for dim in &field.declaration.dims {
            dims.push(self.elaborator(cx.scope, Some(cx)).expr(dim)?);
        }
        let mut sizes = self.sizes_of_dims(&dims, cx)?;
        let of_type = self.elaborator(field.type_scope, None).dims_of_type(field.type_scope, &field.declaration);
        sizes.extend(self.sizes_of_dims(&of_type, cx)?);
        Ok(sizes)
    }

    pub(crate) fn sizes_of_dims(&mut self, dims: &[Expr], inner: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut sizes = Vec::with_capacity(dims.len());
        for dim in dims {
            let k = match &dim.kind {
                // One element per value (Modelica 3.6, section 10.5).
                Kind::Values(None, _) => 2,
                Kind::Values(Some(enumeration), _) => enumeration.literals.len() as i64,
                _ => self.affine(dim, inner)?.as_constant().ok_or(Fail::NeedsExpansion)?,
            };
            let size = usize::try_from(k).ok().filter(|&size| size <= MAX_LOCAL);
            sizes.push(size.ok_or_else(|| {
                self.error(Code::ArrayShape, dim.span, format!("the size {k} is negative or above {MAX_LOCAL}"))
            })?);
        }
        Ok(sizes)
    }

    pub(crate) fn local_sizes(&mut self, component: &Declaration, inner: &mut Context) -> Result<Vec<usize>, Fail> {
        self.sizes_of_dims(&component.dims, inner)
    }

    /// The first output of a function, or the record that a constructor makes.
    pub(crate) fn call(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        let outputs = (self.functions)(self, expr, cx)?;
        outputs.into_iter().next().map(|(_, local)| local).ok_or_else(|| {
            let name = match &expr.kind {
                Kind::Call(call) => call.name.parts[call.name.parts.len() - 1].name.name.clone(),
                _ => "this".into(),
            };
            self.error(Code::BadArguments, expr.span, format!("`{name}` gives no value"))
        })
    }

    /// `A^n` of a square matrix and an integer from 0: a product (10.6.7).
    pub(crate) fn lower_matrix_power(
        &mut self,
        span: Span,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let power = self.affine(b, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
        match power {
            0 => {
                let [i, j] = constants(index)?;
                Ok(self.literal(f64::from(u8::from(i == j)), ScalarType::Integer))
            }
            1 => self.lower(a, cx, index),
            2..=64 => {
                let expr = |kind, ty: &Type| Expr { kind, ty: ty.clone(), span };
                let less = expr(Kind::Integer(power - 1), &b.ty);
                let rest = expr(Kind::Binary(BinaryOp::Pow, Box::new(a.clone()), Box::new(less)), &a.ty);
                let product = expr(Kind::Binary(BinaryOp::Mul, Box::new(a.clone()), Box::new(rest)), &a.ty);
                self.lower(&product, cx, index)
            }
            _ => Err(self.error(Code::Value, b.span, "the exponent of a matrix is an integer from 0 to 64")),
        }
    }

    pub(crate) fn lower_matrix(
        &mut self,
        span: Span,
        rows: &[Vec<Expr>],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        if index.len() < 2 {
            return Err(self.no_scalar(span));
        }
        let [mut i, mut j] = constants(index)?;
        for row in rows {
            let high = match row.first() {
                Some(first) => self.shape_in_matrix(first, cx)?[0],
                None => 0,
            };
            if i >= high {
                i -= high;
                continue;
            }
            for part in row {
                let wide = self.shape_in_matrix(part, cx)?[1];
                if j < wide {
                    let rank = self.shape(part, cx)?.len();
                    return self.lower(part, cx, &at(&[i, j][..rank]));
                }
                j -= wide;
            }
        }
        Err(Fail::Reported)
    }
}

/// The literal that a number means which an enumeration is compared with, counted from 1, and the change to it.
fn literal_meant(value: &Typed, number: &Expr) -> Option<(String, Edit)> {
    let (ScalarType::Enumeration(e), Kind::Integer(k)) = (&value.scalar, &number.kind) else { return None };
    let literal = e.literals.get(usize::try_from(*k).ok()?.checked_sub(1)?)?;
    let text = format!("{}.{literal}", e.name);
    Some((text.clone(), Edit { span: number.span, text }))
}
