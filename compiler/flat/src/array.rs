//! Functions that make or rearrange arrays, one element at a time (Modelica 3.6, sections 10.3 and 10.4).
//!
//! Each says which element of which argument its element at an index is; where that depends on a loop counter in a way
//! that is not affine, the loops are run through.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_syntax::tree::{BinaryOp, Expr, ExprKind};

use crate::context::{Context, Fail};
use crate::flatten::{Flattener, sizes_text};
use crate::index::Affine;
use crate::lower::Typed;

/// Names of the functions handled here.
pub(crate) const ARRAY_FUNCTIONS: &[&str] =
    &["diagonal", "cat", "vector", "matrix", "scalar", "transpose", "symmetric", "outerProduct", "cross", "skew"];

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
    /// Sizes of the result; reports arguments that do not fit.
    pub(crate) fn shape_of_array_function(
        &mut self,
        span: Span,
        name: &str,
        list: &[Expr],
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let count = if matches!(name, "outerProduct" | "cross") { 2 } else { 1 };
        if name == "cat" {
            return self.shape_of_cat(span, list, cx);
        }
        self.expect_arguments(span, name, list, count)?;
        let shape = self.shape(&list[0], cx)?;
        let wrong = |flat: &mut Self, wanted: &str, expr: &Expr, shape: &[usize]| {
            let message = format!("`{name}` takes {wanted}, but this has the sizes {}", sizes_text(shape));
            Err(flat.error(Code::ArrayShape, expr.span, message))
        };
        let long = shape.iter().filter(|&&size| size > 1).count();
        match name {
            "diagonal" if shape.len() == 1 => Ok(vec![shape[0]; 2]),
            "diagonal" => wrong(self, "a vector", &list[0], &shape),
            "vector" if long <= 1 => Ok(vec![shape.iter().product()]),
            "vector" => wrong(self, "an array with at most one size above 1", &list[0], &shape),
            "matrix" if shape.iter().skip(2).all(|&size| size == 1) => {
                Ok(vec![shape.first().copied().unwrap_or(1), shape.get(1).copied().unwrap_or(1)])
            }
            "matrix" => wrong(self, "an array whose third and further sizes are 1", &list[0], &shape),
            "scalar" if shape.iter().all(|&size| size == 1) => Ok(Vec::new()),
            "scalar" => wrong(self, "an array with one element", &list[0], &shape),
            "transpose" if shape.len() >= 2 => {
                let mut turned = shape;
                turned.swap(0, 1);
                Ok(turned)
            }
            "transpose" => wrong(self, "a matrix", &list[0], &shape),
            "symmetric" if shape.len() == 2 && shape[0] == shape[1] => Ok(shape),
            "symmetric" => wrong(self, "a square matrix", &list[0], &shape),
            "skew" if shape == [3] => Ok(vec![3, 3]),
            "skew" => wrong(self, "a vector of 3 elements", &list[0], &shape),
            "cross" | "outerProduct" => {
                let other = self.shape(&list[1], cx)?;
                for (expr, shape) in list.iter().zip([&shape, &other]) {
                    if name == "cross" && shape != &[3] {
                        return wrong(self, "vectors of 3 elements", expr, shape);
                    }
                    if shape.len() != 1 {
                        return wrong(self, "vectors", expr, shape);
                    }
                }
                Ok(if name == "cross" { shape } else { vec![shape[0], other[0]] })
            }
            _ => Ok(shape),
        }
    }

    /// `cat(k, a, b, ...)`: all sizes but the k-th agree.
    fn shape_of_cat(&mut self, span: Span, list: &[Expr], cx: &mut Context) -> Result<Vec<usize>, Fail> {
        let [along, first, rest @ ..] = list else {
            return Err(self.error(Code::BadArguments, span, "`cat` takes a dimension and at least one array"));
        };
        let k = self.affine(along, cx)?.as_constant().ok_or(Fail::NeedsExpansion)?;
        let mut shape = self.shape(first, cx)?;
        let Some(k) = usize::try_from(k - 1).ok().filter(|&k| k < shape.len()) else {
            let message = format!("`cat` along dimension {k} of arrays with {} dimensions", shape.len());
            return Err(self.error(Code::ArrayShape, along.span, message));
        };
        for part in rest {
            let other = self.shape(part, cx)?;
            let mut fitting = other.clone();
            if let Some(size) = fitting.get_mut(k) {
                *size = shape[k];
            }
            self.check_same_sizes("the arrays put together", part.span, &shape, &fitting)?;
            shape[k] += other[k];
        }
        Ok(shape)
    }

    /// The element of the result at `index`.
    pub(crate) fn lower_array_function(
        &mut self,
        span: Span,
        name: &str,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let shape = self.shape_of_array_function(span, name, list, cx)?;
        if index.len() < shape.len() {
            return Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
        }
        match name {
            "diagonal" => {
                let [i, j] = constants(index)?;
                if i == j { self.lower(&list[0], cx, &index[..1]) } else { Ok(self.literal(0.0, ScalarType::Integer)) }
            }
            "cat" => self.lower_cat(list, cx, index),
            "vector" => {
                let inner = self.shape(&list[0], cx)?;
                let long = inner.iter().position(|&size| size > 1);
                let mut position = at(&vec![0; inner.len()]);
                if let Some(k) = long.or(inner.len().checked_sub(1)) {
                    position[k] = index[0].clone();
                }
                self.lower(&list[0], cx, &position)
            }
            "matrix" => {
                let rank = self.shape(&list[0], cx)?.len();
                let mut position: Vec<Affine> = index[..rank.min(2)].to_vec();
                position.resize(rank, Affine::constant(0));
                self.lower(&list[0], cx, &position)
            }
            "scalar" => {
                let rank = self.shape(&list[0], cx)?.len();
                self.lower(&list[0], cx, &at(&vec![0; rank]))
            }
            "transpose" => {
                let mut turned = index.to_vec();
                turned.swap(0, 1);
                self.lower(&list[0], cx, &turned)
            }
            "symmetric" => {
                let [i, j] = constants(index)?;
                self.lower(&list[0], cx, &at(&[i.min(j), i.max(j)]))
            }
            "outerProduct" => {
                let (x, y) = (self.lower(&list[0], cx, &index[..1])?, self.lower(&list[1], cx, &index[1..2])?);
                self.combine(span, hyd_syntax::tree::BinaryOp::Mul, x, y)
            }
            "cross" => {
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
