//! Loops over neighbouring numbers with the widest instructions that the processor has.

/// Does `work` compiled twice, for the common baseline and for processors of level x86-64-v3, by what this one is.
///
/// `work` and what is to gain from it have to be `#[inline(always)]`.  The bits of the results are the same: the compiler never makes one
/// operation of a product and a sum.
#[inline(always)]
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
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
