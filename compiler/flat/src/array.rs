//! Functions that make or rearrange arrays, one element at a time (Modelica 3.6, sections 10.3 and 10.4).
//!
//! Each says which element of which argument its element at an index is; where that depends on a loop counter in a way
//! that is not affine, the loops are run through.

use hyd_instance::{Builtin, ScalarType};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{BinaryOp, Expr, ExprKind};

use crate::call::List;
use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

/// The index as numbers from 0.
fn constants<const N: usize>(index: &[Affine]) -> Result<[usize; N], Fail> {
    let mut result = [0; N];
    for (k, slot) in result.iter_mut().enumerate() {
        let at = index.get(k).ok_or(Fail::Reported)?.as_constant().ok_or(Fail::NeedsExpansion)?;
        *slot = usize::try_from(at).map_err(|_| Fail::Reported)?;
    }
    Ok(result)
}

fn at(positions: &[usize]) -> Vec<Affine> {
    positions.iter().map(|&k| Affine::constant(k as i64)).collect()
}

impl Flattener<'_, '_> {
    /// The element of the result at `index`.
    pub(crate) fn lower_array_function(
        &mut self,
        span: Span,
        function: Builtin,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let shape = function.sizes(&mut List { flat: self, function, span, list, cx })?;
        if index.len() < shape.len() {
            return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
        }
        match function {
            Builtin::Diagonal => {
                let [i, j] = constants(index)?;
                if i == j { self.lower(&list[0], cx, &index[..1]) } else { Ok(self.literal(0.0, ScalarType::Integer)) }
            }
            Builtin::Cat => self.lower_cat(list, cx, index),
            Builtin::Vector => {
                let inner = self.shape(&list[0], cx)?;
                let long = inner.iter().position(|&size| size > 1);
                let mut position = at(&vec![0; inner.len()]);
                if let Some(k) = long.or(inner.len().checked_sub(1)) {
                    position[k] = index[0].clone();
                }
                self.lower(&list[0], cx, &position)
            }
            Builtin::Matrix => {
                let rank = self.shape(&list[0], cx)?.len();
                let mut position: Vec<Affine> = index[..rank.min(2)].to_vec();
                position.resize(rank, Affine::constant(0));
                self.lower(&list[0], cx, &position)
            }
            Builtin::Scalar => {
                let rank = self.shape(&list[0], cx)?.len();
                self.lower(&list[0], cx, &at(&vec![0; rank]))
            }
            Builtin::Transpose => {
                let mut turned = index.to_vec();
                turned.swap(0, 1);
                self.lower(&list[0], cx, &turned)
            }
            Builtin::Symmetric => {
                let [i, j] = constants(index)?;
                self.lower(&list[0], cx, &at(&[i.min(j), i.max(j)]))
            }
            Builtin::OuterProduct => {
                let (x, y) = (self.lower(&list[0], cx, &index[..1])?, self.lower(&list[1], cx, &index[1..2])?);
                self.combine(span, hyd_syntax::tree::BinaryOp::Mul, x, y)
            }
            Builtin::Cross => {
                let [i] = constants(index)?;
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let first = self.product_of(span, list, cx, [j, k])?;
                let second = self.product_of(span, list, cx, [k, j])?;
                self.combine(span, hyd_syntax::tree::BinaryOp::Sub, first, second)
            }
            _ => self.lower_skew(&list[0], cx, constants(index)?),
        }
    }

    fn product_of(&mut self, span: Span, list: &[Expr], cx: &mut Context, [i, j]: [usize; 2]) -> Result<Typed, Fail> {
        let (x, y) = (self.lower(&list[0], cx, &at(&[i]))?, self.lower(&list[1], cx, &at(&[j]))?);
        self.combine(span, hyd_syntax::tree::BinaryOp::Mul, x, y)
    }

    /// `skew(x)*y = cross(x, y)`
    fn lower_skew(&mut self, x: &Expr, cx: &mut Context, [i, j]: [usize; 2]) -> Result<Typed, Fail> {
        if i == j {
            return Ok(self.literal(0.0, ScalarType::Integer));
        }
        let mut value = self.lower(x, cx, &at(&[3 - i - j]))?;
        if (i + 1) % 3 == j {
            value.node = self.model.templates.arena.neg(value.node);
        }
        Ok(value)
    }

    fn lower_cat(&mut self, list: &[Expr], cx: &mut Context, index: &[Affine]) -> Result<Typed, Fail> {
        let k = self.affine(&list[0], cx)?.as_constant().ok_or(Fail::NeedsExpansion)? as usize - 1;
        let mut position = index[k].as_constant().ok_or(Fail::NeedsExpansion)?;
        for part in &list[1..] {
            let size = self.shape(part, cx)?[k] as i64;
            if position < size {
                let mut inner = index.to_vec();
                inner[k] = Affine::constant(position);
                return self.lower(part, cx, &inner);
            }
            position -= size;
        }
        Err(Fail::Reported)
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
                let expr = |kind| Expr { kind, span };
                let less = expr(ExprKind::Integer(power - 1));
                let rest = expr(ExprKind::Binary(BinaryOp::Pow, Box::new(a.clone()), Box::new(less)));
                let product = expr(ExprKind::Binary(BinaryOp::Mul, Box::new(a.clone()), Box::new(rest)));
                self.lower(&product, cx, index)
            }
            _ => Err(self.error(Code::Value, b.span, "the exponent of a matrix is an integer from 0 to 64")),
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
    fn shape_in_matrix(&mut self, part: &Expr, cx: &mut Context) -> Result<[usize; 2], Fail> {
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

    pub(crate) fn lower_matrix(
        &mut self,
        span: Span,
        rows: &[Vec<Expr>],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        if index.len() < 2 {
            return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
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
