//! Vectors in tiles of four numbers.
//!
//! Systems of few unknowns spend much of their time at the ends of short loops.  A vector whose last tile is filled up
//! has no such end: a loop over tiles is a row of vector instructions.  What fills the last tile is 0, which linear
//! operations with finite numbers keep, or a weight, which then counts for nothing.

use std::ops::{Deref, DerefMut};

use hyd_system::wide;

/// Numbers of a tile.
pub(crate) const LANES: usize = 4;
/// Neighbouring numbers, or one number of each of several right-hand sides.
pub(crate) type Tile = [f64; LANES];

/// A vector in tiles; as a slice it has its own length.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Tiled {
    tiles: Vec<Tile>,
    len: usize,
}

impl Tiled {
    /// `len` zeros.
    pub(crate) fn zeros(len: usize) -> Self {
        Self { tiles: vec![[0.0; LANES]; len.div_ceil(LANES)], len }
    }

    /// True if no value is infinite or NaN.
    #[inline]
    pub(crate) fn is_finite(&self) -> bool {
        // 0*x is NaN exactly for the non-finite x; sums instead of a branch per value.
        sum_of(self.tiles.len(), |k| self.tiles[k].map(|value| 0.0 * value)) == 0.0
    }

    /// All tiles.
    pub(crate) fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// All tiles; what fills the last one has to stay as it is.
    pub(crate) fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }
}

impl Deref for Tiled {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.tiles.as_flattened()[..self.len]
    }
}

impl DerefMut for Tiled {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.tiles.as_flattened_mut()[..self.len]
    }
}

/// Loops over so few tiles gain nothing from wider instructions that the way to them does not cost.
const FEW: usize = 4;

/// Does `work`, a loop over `count` tiles, with the widest instructions where that pays; see [`wide`].
#[inline(always)]
pub(crate) fn over_tiles<R>(count: usize, work: impl FnOnce() -> R) -> R {
    if count <= FEW { work() } else { wide(work) }
}

/// The sum of a tile.
#[inline(always)]
pub(crate) fn sum(tile: Tile) -> f64 {
    (tile[0] + tile[2]) + (tile[1] + tile[3])
}

/// Sum over all positions of what `term` makes of a tile there, lane by lane: four sums that do not wait for each other.
#[inline(always)]
pub(crate) fn sum_of(count: usize, term: impl Fn(usize) -> Tile) -> f64 {
    let mut sums = [0.0; LANES];
    for k in 0..count {
        let own = term(k);
        for lane in 0..LANES {
            sums[lane] += own[lane];
        }
    }
    sum(sums)
}

/// The same over the pairs of two slices of one length.
#[inline(always)]
pub(crate) fn sum_of_pairs(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += term(a[lane], b[lane]);
        }
    }
    for (sum, (a, b)) in sums.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *sum += term(*a, *b);
    }
    sum(sums)
}

#[cfg(test)]
mod tests {
    use super::{Tiled, sum_of, sum_of_pairs};

    #[test]
    fn sums_are_those_of_all_numbers_whatever_the_length() {
        for len in 0..12 {
            let mut tiled = Tiled::zeros(len);
            for (k, value) in tiled.iter_mut().enumerate() {
                *value = (k + 1) as f64;
            }
            let expected: f64 = (1..=len).map(|k| (k * k) as f64).sum();
            assert_eq!(sum_of(tiled.tiles().len(), |k| tiled.tiles()[k].map(|v| v * v)), expected);
            assert_eq!(sum_of_pairs(&tiled, &tiled, |a, b| a * b), expected);
            assert!(tiled.is_finite());
            for k in 0..len {
                for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let value = std::mem::replace(&mut tiled[k], odd);
                    assert!(!tiled.is_finite());
                    tiled[k] = value;
                }
            }
        }
    }
}
