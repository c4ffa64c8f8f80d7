//! Sizes of expressions (Modelica 3.6, chapter 10).

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use hyd_instance::sizes_text;
use hyd_instance::{InstId, Resolved};
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{BinaryOp, ComponentRef, Expr, ExprKind};

use crate::range::Range;
use crate::reference::Subscript;

impl Flattener<'_, '_> {
    /// Sizes of an expression.
    pub(crate) fn shape(&mut self, expr: &Expr, cx: &mut Context) -> Result<Vec<usize>, Fail> {
        match &expr.kind {
            ExprKind::Ref(reference) => self.shape_of_ref(reference, cx),
            ExprKind::Unary(_, a) => self.shape(a, cx),
            ExprKind::Binary(op, a, b) => self.shape_of_binary(expr.span, *op, a, b, cx),
            ExprKind::If(branches, otherwise) => {
                let shape = self.shape(otherwise, cx)?;
                for (_, value) in branches {
                    let other = self.shape(value, cx)?;
                    self.check_same_sizes("the branches", value.span, &other, &shape)?;
                }
                Ok(shape)
            }
            ExprKind::Range(start, step, stop) => Ok(vec![self.steps_of(start, step.as_deref(), stop, cx)?.count()]),
            ExprKind::Array(items) => {
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
            ExprKind::ArrayFor(body, iterators) => {
                let mark = cx.names.len();
                let mut shape = Vec::new();
                // The last iterator is the outermost (10.4.1).
                for iterator in iterators.iter().rev() {
                    let range = self.range(iterator, cx)?;
                    shape.push(range.count());
                    let local = match range {
                        Range::Steps { start, .. } => Local::Index(start),
                        Range::Values(values) => values
                            .first()
                            .map_or(Local::Index(Affine::constant(0)), |v| crate::lower::local_of(v.clone())),
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
            ExprKind::Field(record, name) => Ok(match self.field_value(record, name, cx)? {
                Local::Array(_, shape) | Local::Records(_, shape) => shape,
                _ => Vec::new(),
            }),
            ExprKind::Matrix(rows) => self.shape_of_matrix(rows, cx),
            ExprKind::Call(function, arguments) => self.shape_of_call(expr.span, function, arguments, cx),
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.shape(only, cx),
                _ => Ok(Vec::new()),
            },
            _ => Ok(Vec::new()),
        }
    }

    pub(crate) fn shape_of_ref(&mut self, reference: &ComponentRef, cx: &mut Context) -> Result<Vec<usize>, Fail> {
        if !reference.global && cx.local(&reference.parts[0].name.name).is_some() {
            let (local, subscripts) = self.leaf_of_path(reference, cx)?;
            let (Local::Array(_, sizes) | Local::Records(_, sizes)) = local else { return Ok(Vec::new()) };
            return self.kept_sizes(&sizes, &subscripts, cx);
        }
        let Resolved::Variable(steps) = self.tree.resolve(cx.scope, reference)? else { return Ok(Vec::new()) };
        self.steps_shape(&steps, cx)
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
    pub(crate) fn steps_shape(&mut self, steps: &[(InstId, &[Expr])], cx: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut shape = Vec::new();
        for &(inst, subscripts) in steps {
            let dims = self.tree.instances[inst].dims.clone();
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
}
