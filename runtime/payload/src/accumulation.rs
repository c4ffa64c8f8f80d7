//! The chain rule through assignments as a list of multiply-adds over a scratch array.
//!
//! Code computes the local partial derivatives of each row; `s[to] += s[a]*s[b]` in the order of the rows makes of them
//! the Jacobian (forward accumulation on the extended Jacobian, Griewank and Walther 2008, "Evaluating Derivatives",
//! chapter 9).
//!
//! Scratch array: the number 1, the partials, the rows of assignments on their supports, entries of dF/dy, of dF/dy'.
//! A partial that is an entry by itself stands there from the beginning and needs no term.

/// Sign bit of `Term::a`: the product is subtracted.
pub const MINUS: u32 = 1 << 31;

/// `s[to] += s[a]*s[b]`
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Term {
    /// Where the product is added.
    pub to: u32,
    /// First factor, with [`MINUS`].
    pub a: u32,
    /// Second factor.
    pub b: u32,
}

/// The list of multiply-adds with the places of its results.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Accumulation {
    /// The list.
    pub terms: Vec<Term>,
    /// First position that accumulates.
    pub first: usize,
    /// Entries of dF/dy.
    pub state: usize,
    /// Entries of dF/dy'.
    pub rate: usize,
    /// Length of the scratch array.
    pub length: usize,
}

impl Accumulation {
    /// Makes `scratch` ready for the partials.
    pub fn begin(&self, scratch: &mut [f64]) {
        scratch[0] = 1.0;
        scratch[self.first..].fill(0.0);
    }

    /// Composes the partials that stand in `scratch` and copies the results out.
    pub fn run(&self, scratch: &mut [f64], state_values: &mut [f64], rate_values: &mut [f64]) {
        for term in &self.terms {
            let factor = scratch[(term.a & !MINUS) as usize];
            let factor = if term.a & MINUS == 0 { factor } else { -factor };
            scratch[term.to as usize] += factor * scratch[term.b as usize];
        }
        state_values.copy_from_slice(&scratch[self.state..self.rate]);
        rate_values.copy_from_slice(&scratch[self.rate..self.length]);
    }
}

/// The row that the number at a scratch position belongs to.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct PartialRows {
    /// Row of each position.
    pub rows: Vec<u32>,
}

impl PartialRows {
    /// Row of a partial derivative, by its position in the scratch array.
    pub fn row(&self, position: u32) -> Option<u32> {
        self.rows.get(position as usize).copied()
    }
}
