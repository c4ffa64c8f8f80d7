//! Elements of what array functions give, from those of their arguments (Modelica 3.6, sections 10.3.3 to 10.3.5).
//!
//! Said once, for values before the run, whose subscripts are numbers, and for expressions, whose subscripts may be functions of loop
//! counters.

use super::{Builtin, SizesOf};

/// A subscript from 0.
pub trait Place: Clone {
    /// The subscript that is this number.
    fn at(position: usize) -> Self;

    /// Its number, where it has one.
    fn number(&self) -> Option<usize>;
}

impl Place for usize {
    fn at(position: usize) -> Self {
        position
    }

    fn number(&self) -> Option<usize> {
        Some(*self)
    }
}

/// An element: which arguments are named by their number, with the place in each.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Element<P> {
    /// 0 or 1.
    Number(i64),
    /// That of an argument.
    Of(usize, Vec<P>),
    /// That of the first argument with the other sign.
    Minus(Vec<P>),
    /// The product of one of the first argument and one of the second.
    Product(Vec<P>, Vec<P>),
    /// `a[j]*b[k] - a[k]*b[j]` of the two arguments.
    Minor(P, P),
}

impl Builtin {
    /// The element at `index` of what an array function or `identity` gives, whose sizes fit ([`Builtin::sizes`]); `None` where the
    /// numbers of the subscripts have to be known for that.
    ///
    /// # Errors
    /// When the sizes of an argument are not known; reported by `arguments`.
    pub fn element<A: SizesOf, P: Place>(self, arguments: &mut A, index: &[P]) -> Result<Option<Element<P>>, A::Fail> {
        use Builtin::{Cat, Matrix, OuterProduct, Scalar, Transpose, Vector};
        Ok(Some(match self {
            Vector | Matrix | Scalar => {
                let sizes = arguments.sizes(0)?;
                let mut at = vec![P::at(0); sizes.len()];
                let long = sizes.iter().position(|&size| size > 1).or(sizes.len().checked_sub(1));
                match (self, long) {
                    (Vector, Some(k)) => at[k] = index[0].clone(),
                    (Matrix, _) => at.iter_mut().zip(index).for_each(|(at, own)| *at = own.clone()),
                    _ => {}
                }
                Element::Of(0, at)
            }
            Transpose => {
                let mut turned = index.to_vec();
                turned.swap(0, 1);
                Element::Of(0, turned)
            }
            OuterProduct => Element::Product(vec![index[0].clone()], vec![index[1].clone()]),
            Cat => {
                let k = arguments.number(0)? - 1;
                let Some(mut position) = index[k].number() else { return Ok(None) };
                for part in 1..arguments.count() {
                    let size = arguments.sizes(part)?[k];
                    if position < size {
                        let mut at = index.to_vec();
                        at[k] = P::at(position);
                        return Ok(Some(Element::Of(part, at)));
                    }
                    position -= size;
                }
                return Ok(None);
            }
            _ => {
                let Some(numbers) = index.iter().map(P::number).collect::<Option<Vec<_>>>() else { return Ok(None) };
                self.element_at(&numbers)
            }
        }))
    }

    fn element_at<P: Place>(self, index: &[usize]) -> Element<P> {
        let places = |list: &[usize]| list.iter().map(|&k| P::at(k)).collect();
        match (self, index) {
            (Builtin::Identity, &[i, j]) => Element::Number(i64::from(i == j)),
            (Builtin::Diagonal, &[i, j]) if i == j => Element::Of(0, places(&[i])),
            (Builtin::Symmetric, &[i, j]) => Element::Of(0, places(&[i.min(j), i.max(j)])),
            (Builtin::Cross, &[i]) => Element::Minor(P::at((i + 1) % 3), P::at((i + 2) % 3)),
            // `skew(x)*y` is `cross(x, y)`.
            (Builtin::Skew, &[i, j]) if (i + 1) % 3 == j => Element::Minus(places(&[3 - i - j])),
            (Builtin::Skew, &[i, j]) if i != j => Element::Of(0, places(&[3 - i - j])),
            _ => Element::Number(0),
        }
    }
}
