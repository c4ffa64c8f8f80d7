//! The table of elementary functions that generated code calls through.
//!
//! One entry per [`Function`], in the order of [`Function::ALL`], each an `extern "C"` function on the same mathematics
//! as constant folding and interpretation, so that all of them agree to the last bit; then one for groups of sines and cosines.
//! Their positions are part of the format of built models ([`crate::format::VERSION`]).

use hyd_system::math::Function;

type Unary = extern "C" fn(f64) -> f64;
type Binary = extern "C" fn(f64, f64) -> f64;

extern "C" fn unary<const F: usize>(a: f64) -> f64 {
    Function::ALL[F].apply(a, 0.0)
}

extern "C" fn binary<const F: usize>(a: f64, b: f64) -> f64 {
    Function::ALL[F].apply(a, b)
}

macro_rules! addresses {
    ($($k:literal)*) => {
        [$(match Function::ALL[$k].arity() {
            1 => unary::<$k> as Unary as usize,
            _ => binary::<$k> as Binary as usize,
        }),*]
    };
}

/// Position of the function that fills in [`hyd_system::angles::Angles`], of which it takes a count and an address.
pub const SINES_AND_COSINES: usize = 24;

/// Position of the function that fills in [`hyd_system::powers::Powers`], likewise.
pub const POWERS: usize = SINES_AND_COSINES + 1;

/// Number of entries.
pub(crate) const COUNT: usize = POWERS + 1;

const _: () = assert!(Function::ALL.len() == SINES_AND_COSINES, "the table has one entry per function");

/// Addresses of the functions; `grouped` are those for groups, from [`SINES_AND_COSINES`] on.
pub(crate) fn table(grouped: [usize; COUNT - SINES_AND_COSINES]) -> [usize; COUNT] {
    let single = addresses!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23);
    std::array::from_fn(|k| if k < SINES_AND_COSINES { single[k] } else { grouped[k - SINES_AND_COSINES] })
}

/// Position of a function in the table.
pub fn position(function: Function) -> usize {
    function as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_follow_the_list() {
        for (k, &function) in Function::ALL.iter().enumerate() {
            assert_eq!(position(function), k);
        }
        assert!(table([1, 2]).iter().all(|&address| address != 0));
    }
}
