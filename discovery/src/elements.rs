//! Elements of arrays: their subscripts, and expressions of the size of the array.

/// An element of the variables that an opening makes: in a loop, in an array of components.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct At {
    /// Sizes of all arrays on the way; empty for a scalar.
    pub sizes: Vec<usize>,
    /// Subscripts, from 1.
    pub subscripts: Vec<usize>,
}

impl At {
    /// An expression of this size whose elements are what `value` says of their subscripts.
    pub fn array(&self, value: &dyn Fn(&[usize]) -> String) -> String {
        fn inner(sizes: &[usize], at: &mut Vec<usize>, value: &dyn Fn(&[usize]) -> String) -> String {
            let Some((size, rest)) = sizes.split_first() else { return value(at) };
            let part = |k: usize| {
                at.push(k);
                let text = inner(rest, at, value);
                at.pop();
                text
            };
            let parts: Vec<String> = (1..=*size).map(part).collect();
            format!("{{{}}}", parts.join(", "))
        }
        inner(&self.sizes, &mut Vec::new(), value)
    }
}

/// The largest subscripts of elements, which are the sizes of their array where all are there.
pub(crate) fn sizes<'s>(elements: impl Iterator<Item = &'s [usize]>) -> Vec<usize> {
    let mut sizes: Vec<usize> = Vec::new();
    for subscripts in elements {
        sizes.resize(sizes.len().max(subscripts.len()), 0);
        sizes.iter_mut().zip(subscripts).for_each(|(size, own)| *size = (*size).max(*own));
    }
    sizes
}
