//! Loops over neighbouring numbers with the widest instructions that the processor has, and groups of four numbers on which the same is
//! done without a branch ([`crate::angles`], [`crate::powers`]).

/// Numbers of a group.
pub const LANES: usize = 4;

pub(crate) type Lanes = [f64; LANES];
pub(crate) type Masks = [u64; LANES];

/// What is added to a number and taken away again to round it: 1.5*2^52.  The last bits of the sum are those of the integer.
pub(crate) const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// Does `work` compiled twice, for the common baseline and for processors of level x86-64-v3, by what this one is.
///
/// `work` and what is to gain from it have to be `#[inline(always)]`.  The bits of the results are the same: the compiler never makes one
/// operation of a product and a sum.
#[inline(always)]
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

#[inline(always)]
pub(crate) fn each(value: impl Fn(usize) -> f64) -> Lanes {
    [value(0), value(1), value(2), value(3)]
}

#[inline(always)]
pub(crate) fn bits(value: impl Fn(usize) -> u64) -> Masks {
    [value(0), value(1), value(2), value(3)]
}

/// All bits where `holds`.
#[inline(always)]
pub(crate) fn masks(holds: impl Fn(usize) -> bool) -> Masks {
    bits(|k| if holds(k) { u64::MAX } else { 0 })
}

/// `a` where all bits of the mask are set, `b` where none is.
#[inline(always)]
pub(crate) fn choose(mask: u64, a: f64, b: f64) -> f64 {
    f64::from_bits((a.to_bits() & mask) | (b.to_bits() & !mask))
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_made_wide_has_the_same_bits() {
        let numbers: Vec<f64> = (0..1000).map(|k| (f64::from(k) * 0.7).sin() * 10f64.powi(k % 40 - 20)).collect();
        let work = |numbers: &[f64]| {
            let mut sums = [0.25; 4];
            for four in numbers.chunks_exact(4) {
                for (sum, number) in sums.iter_mut().zip(four) {
                    *sum += 1.1 * number;
                }
            }
            sums.map(f64::to_bits)
        };
        assert_eq!(
            super::wide(
                #[inline(always)]
                || work(&numbers)
            ),
            work(&numbers)
        );
    }
}
