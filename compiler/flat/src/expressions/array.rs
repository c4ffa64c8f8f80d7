//! Functions that make or rearrange arrays, one element at a time (Modelica 3.6, sections 10.3 and 10.4).
//!
//! Each says which element of which argument its element at an index is; where that depends on a loop counter in a way
//! that is not affine, the loops are run through.

use hyd_instance::{Builtin, ScalarType};
use hyd_source::Code;

use crate::expressions::builtin_call::BuiltinCall;
use crate::state::context::Fail;
use crate::state::index::Affine;
use crate::state::node::Typed;

/// The index as numbers from 0.
pub(crate) fn constants<const N: usize>(index: &[Affine]) -> Result<[usize; N], Fail> {
    let mut result = [0; N];
    for (k, slot) in result.iter_mut().enumerate() {
        let at = index.get(k).ok_or(Fail::Reported)?.as_constant().ok_or(Fail::NeedsExpansion)?;
        *slot = usize::try_from(at).map_err(|_| Fail::Reported)?;
    }
    Ok(result)
}

pub(crate) fn at(positions: &[usize]) -> Vec<Affine> {
    positions.iter().map(|&k| Affine::constant(k as i64)).collect()
}

impl BuiltinCall<'_, '_, '_> {
    /// The element of the result at `index`.
    pub(crate) fn lower_array_function(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list, builtin) = (self.span, self.list, self.builtin);
        let shape = builtin.sizes(self)?;
        if index.len() < shape.len() {
            return Err(self.flat.error(Code::ArrayShape, span, "an array stands where a scalar is needed"));
        }
        match builtin {
            Builtin::Diagonal => {
                let [i, j] = constants(index)?;
                if i == j {
                    self.flat.lower(&list[0], self.cx, &index[..1])
                } else {
                    Ok(self.flat.literal(0.0, ScalarType::Integer))
                }
            }
            Builtin::Cat => self.lower_cat(index),
            Builtin::Vector => {
                let inner = self.flat.shape(&list[0], self.cx)?;
                let long = inner.iter().position(|&size| size > 1);
                let mut position = at(&vec![0; inner.len()]);
                if let Some(k) = long.or(inner.len().checked_sub(1)) {
                    position[k] = index[0].clone();
                }
                self.flat.lower(&list[0], self.cx, &position)
            }
            Builtin::Matrix => {
                let rank = self.flat.shape(&list[0], self.cx)?.len();
                let mut position: Vec<Affine> = index[..rank.min(2)].to_vec();
                position.resize(rank, Affine::constant(0));
                self.flat.lower(&list[0], self.cx, &position)
            }
            Builtin::Scalar => {
                let rank = self.flat.shape(&list[0], self.cx)?.len();
                self.flat.lower(&list[0], self.cx, &at(&vec![0; rank]))
            }
            Builtin::Transpose => {
                let mut turned = index.to_vec();
                turned.swap(0, 1);
                self.flat.lower(&list[0], self.cx, &turned)
            }
            Builtin::Symmetric => {
                let [i, j] = constants(index)?;
                self.flat.lower(&list[0], self.cx, &at(&[i.min(j), i.max(j)]))
            }
            Builtin::OuterProduct => {
                let (x, y) = (
                    self.flat.lower(&list[0], self.cx, &index[..1])?,
                    self.flat.lower(&list[1], self.cx, &index[1..2])?,
                );
                self.flat.combine(span, hyd_syntax::tree::BinaryOp::Mul, x, y)
            }
            Builtin::Cross => {
                let [i] = constants(index)?;
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let first = self.product_of([j, k])?;
                let second = self.product_of([k, j])?;
                self.flat.combine(span, hyd_syntax::tree::BinaryOp::Sub, first, second)
            }
            _ => self.lower_skew(constants(index)?),
        }
    }

    fn product_of(&mut self, [i, j]: [usize; 2]) -> Result<Typed, Fail> {
        let (span, list) = (self.span, self.list);
        let (x, y) = (self.flat.lower(&list[0], self.cx, &at(&[i]))?, self.flat.lower(&list[1], self.cx, &at(&[j]))?);
        self.flat.combine(span, hyd_syntax::tree::BinaryOp::Mul, x, y)
    }

    /// `skew(x)*y = cross(x, y)`
    fn lower_skew(&mut self, [i, j]: [usize; 2]) -> Result<Typed, Fail> {
        if i == j {
            return Ok(self.flat.literal(0.0, ScalarType::Integer));
        }
        let mut value = self.flat.lower(&self.list[0], self.cx, &at(&[3 - i - j]))?;
        if (i + 1) % 3 == j {
            value.node = self.flat.model.templates.arena.neg(value.node);
        }
        Ok(value)
    }

    fn lower_cat(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let list = self.list;
        let k = self.flat.affine(&list[0], self.cx)?.as_constant().ok_or(Fail::NeedsExpansion)? as usize - 1;
        let mut position = index[k].as_constant().ok_or(Fail::NeedsExpansion)?;
        for part in &list[1..] {
            let size = self.flat.shape(part, self.cx)?[k] as i64;
            if position < size {
                let mut inner = index.to_vec();
                inner[k] = Affine::constant(position);
                return self.flat.lower(part, self.cx, &inner);
            }
            position -= size;
        }
        Err(Fail::Reported)
    }
}
