//! Sizes of expressions (Modelica 3.6, chapter 10).

use hyd_instance::{InstId, Value, sizes_text};
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::BinaryOp;
use hyd_typed::{Expr, Kind};

use crate::expressions::builtin_call::BuiltinCall;
use crate::expressions::range::Range;
use crate::expressions::reference::Subscript;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;

impl Flattener<'_, '_> {
    /// Sizes of an expression.
    pub(crate) fn shape(&mut self, expr: &Expr, cx: &mut Context) -> Result<Vec<usize>, Fail> {
        match &expr.kind {
            Kind::Variable(variable) => self.steps_shape(&variable.steps, cx),
            Kind::Local(local) => {
                let (local, subscripts) = self.leaf_of_path(local, cx)?;
                let sizes = match local {
                    Local::Array(_, sizes) | Local::Records(_, sizes) => sizes,
                    Local::Value(value) => value.shape(),
                    _ => return Ok(Vec::new()),
                };
                self.kept_sizes(&sizes, &subscripts, cx)
            }
            Kind::Unary(_, a) => self.shape(a, cx),
            Kind::Binary(op, a, b) => self.shape_of_binary(expr.span, *op, a, b, cx),
            Kind::If(branches, otherwise) => match self.branch_by_sizes(branches, otherwise, cx)? {
                Some(chosen) => self.shape(chosen, cx),
                None => self.shape(otherwise, cx),
            },
            Kind::Range(start, step, stop) => Ok(vec![self.steps_of(start, step.as_deref(), stop, cx)?.count()]),
            Kind::Array(items) => {
                let mut shape = vec![items.len()];
                if let Some(first) = items.first() {
                    let inner = self.shape(first, cx)?;
                    for item in &items[1..] {
                        let other = self.shape(item, cx)?;
                        self.check_same_sizes("the elements of this array", item.span, &other, &inner)?;
                    }
                    shape.extend(inner);
                }
                Ok(shape)
            }
            Kind::ArrayFor(body, iterators) => {
                let mark = cx.names.len();
                let mut shape = Vec::new();
                // The last iterator is the outermost (10.4.1).
                for iterator in iterators.iter().rev() {
                    let range = self.range(iterator, cx)?;
                    shape.push(range.count());
                    let local = match range {
                        Range::Steps { start, .. } => Local::Index(start),
                        Range::Values(values) => values.first().map_or(Local::Index(Affine::constant(0)), |v| {
                            crate::expressions::value::local_of(v.clone())
                        }),
                        Range::Nodes(nodes) => {
                            nodes.first().map_or(Local::Index(Affine::constant(0)), |v| Local::Node(v.clone()))
                        }
                    };
                    cx.names.push((iterator.name.name.clone(), local));
                }
                let inner = self.shape(body, cx);
                cx.names.truncate(mark);
                shape.extend(inner?);
                Ok(shape)
            }
            Kind::Field(record, name) => Ok(match self.field_value(record, name, cx)? {
                Local::Array(_, shape) | Local::Records(_, shape) => shape,
                _ => Vec::new(),
            }),
            Kind::Matrix(rows) => self.shape_of_matrix(rows, cx),
            Kind::Builtin(builtin, list) => {
                builtin.sizes(&mut BuiltinCall { flat: self, builtin: *builtin, span: expr.span, list, cx })
            }
            Kind::Call(call) => self.shape_of_user_call(expr, call, cx),
            Kind::Failed(said, _) => Err(self.say(said)),
            Kind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.shape(only, cx),
                _ => Ok(Vec::new()),
            },
            _ => Ok(Vec::new()),
        }
    }

    /// The branch of an `if` whose branches have different sizes: the one that is taken, which must be known before the run.  `None` where
    /// the sizes are the same.
    pub(crate) fn branch_by_sizes<'e>(
        &mut self,
        branches: &'e [(Expr, Expr)],
        otherwise: &'e Expr,
        cx: &mut Context,
    ) -> Result<Option<&'e Expr>, Fail> {
        let ranks = branches.iter().map(|(_, value)| value.ty.rank).chain([otherwise.ty.rank]);
        if ranks.max() == Some(0) {
            return Ok(None);
        }
        let last = self.quietly(|flat| flat.shape(otherwise, cx));
        let different = branches.iter().find(|(_, value)| self.quietly(|flat| flat.shape(value, cx)) != last);
        let Some((_, different)) = different else { return self.shape(otherwise, cx).map(|_| None) };
        if !branches.iter().all(|(condition, _)| self.known_before_run(condition)) {
            let (other, last) = (self.shape(different, cx)?, self.shape(otherwise, cx)?);
            self.check_same_sizes("the branches", different.span, &other, &last)?;
            return Ok(None);
        }
        let (env, complete) = cx.env();
        for (condition, value) in branches {
            if !complete && cx.has_counter_in(condition) {
                return Err(Fail::NeedsExpansion);
            }
            match self.scopes.evaluate(&condition.evaluable(), cx.scope, &env)? {
                Value::Boolean(true) => return Ok(Some(value)),
                _ => continue,
            }
        }
        Ok(Some(otherwise))
    }

    /// The sizes of one array that its subscripts keep.
    pub(crate) fn kept_sizes(
        &mut self,
        sizes: &[usize],
        subscripts: &[Expr],
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let mut kept = Vec::new();
        for (k, &size) in sizes.iter().enumerate() {
            match subscripts.get(k) {
                None => kept.push(size),
                // A number computed in the run: one element.
                Some(expr) if self.in_body(cx) && self.is_computed(expr, size, cx)? => {}
                Some(expr) if !self.in_body(cx) && self.is_of_the_run(expr, cx) => {}
                Some(expr) => match self.subscript(expr, size, cx)? {
                    Subscript::At(_) => {}
                    Subscript::All => kept.push(size),
                    Subscript::Slice { count, .. } => kept.push(count),
                    Subscript::List(list) => kept.push(list.len()),
                },
            }
        }
        Ok(kept)
    }

    /// Sizes that a reference keeps.
    pub(crate) fn steps_shape(&mut self, steps: &[(InstId, Vec<Expr>)], cx: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut shape = Vec::new();
        for (inst, subscripts) in steps {
            let dims = self.scopes.instances[*inst].dims.clone();
            shape.extend(self.kept_sizes(&dims, subscripts, cx)?);
        }
        Ok(shape)
    }

    pub(crate) fn shape_of_binary(
        &mut self,
        span: Span,
        op: BinaryOp,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let (left, right) = (self.shape(a, cx)?, self.shape(b, cx)?);
        if left.is_empty() && right.is_empty() {
            return Ok(left);
        }
        let mismatch = |flat: &mut Self| {
            let message = format!(
                "the operands have sizes that do not go together: {} and {}",
                sizes_text(&left),
                sizes_text(&right)
            );
            let one_scalar = left.is_empty() != right.is_empty();
            let element = match op {
                BinaryOp::Add => Some(".+"),
                BinaryOp::Sub => Some(".-"),
                BinaryOp::Div => Some("./"),
                BinaryOp::Pow => Some(".^"),
                _ => None,
            };
            let help = element
                .filter(|_| one_scalar || left == right)
                .map(|sign| format!("`{sign}` works element by element"));
            flat.report(Diagnostic::error(Code::ArrayShape, message).at(span, "").maybe_help(help));
            Err(Fail::Reported)
        };
        match op {
            BinaryOp::Add | BinaryOp::Sub => {
                if left == right {
                    Ok(left)
                } else {
                    mismatch(self)
                }
            }
            BinaryOp::Mul if !left.is_empty() && !right.is_empty() => {
                if left.len() > 2 || right.len() > 2 || left[left.len() - 1] != right[0] {
                    return mismatch(self);
                }
                let mut shape = left[..left.len() - 1].to_vec();
                shape.extend(&right[1..]);
                Ok(shape)
            }
            BinaryOp::Div if !right.is_empty() => mismatch(self),
            BinaryOp::Pow if matches!(left.as_slice(), [n, m] if n == m) && right.is_empty() => Ok(left),
            BinaryOp::Pow => mismatch(self),
            _ if left.is_empty() => Ok(right),
            _ if right.is_empty() || left == right => Ok(left),
            _ => mismatch(self),
        }
    }

    /// Sizes of `[a, b; c, d]`: parts side by side, rows below each other, a vector being a column.
    pub(crate) fn shape_of_matrix(&mut self, rows: &[Vec<Expr>], cx: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut whole = [0, 0];
        for (k, row) in rows.iter().enumerate() {
            let mut own = [0, 0];
            for (j, part) in row.iter().enumerate() {
                let [high, wide] = self.shape_in_matrix(part, cx)?;
                if j > 0 && high != own[0] {
                    self.check_same_sizes("the parts of this row", part.span, &[high, wide], &[own[0], wide])?;
                }
                own = [high, own[1] + wide];
            }
            if k > 0 && own[1] != whole[1] {
                let span = row.first().map_or(rows[0][0].span, |first| first.span.to(row[row.len() - 1].span));
                self.check_same_sizes("the rows of this matrix", span, &own, &[own[0], whole[1]])?;
            }
            whole = [whole[0] + own[0], own[1]];
        }
        Ok(whole.to_vec())
    }

    /// Height and width of a part of a matrix.
    pub(crate) fn shape_in_matrix(&mut self, part: &Expr, cx: &mut Context) -> Result<[usize; 2], Fail> {
        let shape = self.shape(part, cx)?;
        match shape.as_slice() {
            [] => Ok([1, 1]),
            &[n] => Ok([n, 1]),
            &[n, m] => Ok([n, m]),
            _ => {
                let message = format!("the part of a matrix has {} dimensions; at most 2 are possible", shape.len());
                Err(self.error(Code::ArrayShape, part.span, message))
            }
        }
    }
}
