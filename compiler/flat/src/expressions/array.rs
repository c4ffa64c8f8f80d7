//! Functions that rearrange arrays, one element at a time (Modelica 3.6, sections 10.3 and 10.4).
//!
//! Which element of which argument an element is says [`Builtin::element`]; where that depends on a loop counter in a way that is not
//! affine, the loops are run through.

use hyd_instance::{Element, Place, ScalarType};
use hyd_syntax::tree::BinaryOp;

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

impl Place for Affine {
    fn at(position: usize) -> Self {
        Affine::constant(position as i64)
    }

    fn number(&self) -> Option<usize> {
        self.as_constant().and_then(|k| usize::try_from(k).ok())
    }
}

impl BuiltinCall<'_, '_, '_> {
    /// The element of the result at `index`.
    pub(crate) fn lower_array_function(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list, builtin) = (self.span, self.list, self.builtin);
        let shape = builtin.sizes(self)?;
        if index.len() < shape.len() {
            return Err(self.flat.no_scalar(span));
        }
        let element = builtin.element(self, index)?.ok_or(Fail::NeedsExpansion)?;
        match element {
            Element::Number(k) => Ok(self.flat.literal(k as f64, ScalarType::Integer)),
            Element::Of(k, at) => self.flat.lower(&list[k], self.cx, &at),
            Element::Minus(at) => {
                let value = self.flat.lower(&list[0], self.cx, &at)?;
                Ok(Typed { node: self.flat.model.templates.arena.neg(value.node), ..value })
            }
            Element::Product(a, b) => self.product_of(&a, &b),
            Element::Minor(j, k) => {
                let first = self.product_of(std::slice::from_ref(&j), std::slice::from_ref(&k))?;
                let second = self.product_of(std::slice::from_ref(&k), std::slice::from_ref(&j))?;
                self.flat.combine(span, BinaryOp::Sub, first, second)
            }
        }
    }

    fn product_of(&mut self, a: &[Affine], b: &[Affine]) -> Result<Typed, Fail> {
        let (x, y) = (self.flat.lower(&self.list[0], self.cx, a)?, self.flat.lower(&self.list[1], self.cx, b)?);
        self.flat.combine(self.span, BinaryOp::Mul, x, y)
    }
}
