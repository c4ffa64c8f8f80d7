//! Error weights and the norm in which errors and Newton corrections are measured.
//!
//! `w_i = 1 / (tolerance * (|y_i| + size_i))` and the root mean square of `v_i w_i`: a norm of 1 is an error as large
//! as the tolerance allows.  The size is the nominal value, or learned.  Source: Brenan, Campbell, Petzold 1996, section 5.2.

use hyd_system::LearnedSize;
use hyd_system::math::square;

use crate::sizes::LearnedSizes;
use crate::tiled::{LANES, Tile, Tiled, over_tiles, sum, sum_of, sum_of_pairs};

/// Weights of all unknowns, and of those that the error test looks at.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct Weights {
    /// Weight of each unknown [1/unit of y_i].
    pub(crate) all: Tiled,
    /// The same, 0 for unknowns left out of the error test.
    pub(crate) tested: Tiled,
    /// Nominal value of each unknown [unit of y_i].
    pub(crate) nominals: Tiled,
    /// Its nominal value, or what was learned of it [unit of y_i].
    pub(crate) sizes: Tiled,
    learned: LearnedSizes,
    included: Vec<bool>,
    /// Their number.
    included_count: usize,
    differential: Vec<bool>,
    tolerance: f64,
    tested_count: usize,
    /// Inverse of the number of unknowns.
    per_unknown: f64,
}

impl Weights {
    /// Room for n unknowns.
    pub(crate) fn new(n: usize) -> Self {
        // What fills the last tiles has a weight like all others, of a value that is 0.
        let mut ones = Tiled::zeros(n);
        ones.tiles_mut().fill([1.0; LANES]);
        Self {
            all: ones.clone(),
            tested: ones.clone(),
            nominals: ones.clone(),
            sizes: ones,
            learned: LearnedSizes::default(),
            included: vec![true; n],
            included_count: n,
            differential: vec![true; n],
            tolerance: 1e-6,
            tested_count: n,
            per_unknown: (n.max(1) as f64).recip(),
        }
    }

    /// Sets the tolerance and which unknowns the error test looks at.  Nominal values stand in `nominals`; what is not a
    /// positive number there counts as 1.
    pub(crate) fn configure(&mut self, tolerance: f64, included: impl Iterator<Item = bool>) {
        self.tolerance = tolerance;
        for (slot, value) in self.included.iter_mut().zip(included) {
            *slot = value;
        }
        self.included_count = self.included.iter().filter(|&&included| included).count();
        for nominal in self.nominals.iter_mut() {
            *nominal = nominal.abs();
            if !(*nominal > 0.0 && nominal.is_finite()) {
                *nominal = 1.0;
            }
        }
        self.sizes.clone_from(&self.nominals);
        self.learned.clear();
    }

    /// From here on the sizes of these unknowns are learned, as far as their nominal value is the usual one of 1.
    pub(crate) fn learn(&mut self, wanted: &[LearnedSize]) {
        self.learned.begin(wanted, self.tolerance, &mut self.sizes);
    }

    /// The tolerance behind the weights.
    pub(crate) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Which unknowns occur with their derivatives.
    pub(crate) fn set_differential(&mut self, differential: &[bool]) {
        self.differential.copy_from_slice(differential);
    }

    /// Leaves algebraic unknowns out of the error test until the next update.  They follow from the others, and where they amplify
    /// them, or jump, no smaller step makes their corrections small.
    pub(crate) fn forgive_algebraic(&mut self) {
        let kept = self.included.iter().zip(&self.differential).filter(|&(&included, &own)| included && own).count();
        if kept > 0 {
            let algebraic = self.tested.iter_mut().zip(&self.differential).filter(|(_, differential)| !**differential);
            algebraic.for_each(|(weight, _)| *weight = 0.0);
            self.tested_count = kept;
        }
    }

    /// Recomputes the weights at `y`.
    #[inline(always)]
    pub(crate) fn update(&mut self, y: &[f64]) {
        self.tested_count = self.included_count;
        self.learned.see(y, &mut self.sizes);
        let tolerance = self.tolerance;
        let (tiles, rest) = y.as_chunks::<LANES>();
        let set = |(weight, (value, nominal)): (&mut Tile, (&Tile, &Tile))| {
            let (value, nominal) = (*value, *nominal);
            *weight = std::array::from_fn(|lane| 1.0 / (tolerance * (value[lane].abs() + nominal[lane])));
        };
        let sizes = self.sizes.tiles();
        self.all.tiles_mut().iter_mut().zip(tiles.iter().zip(sizes)).for_each(set);
        let filled = y.len() - rest.len();
        for ((weight, value), nominal) in self.all[filled..].iter_mut().zip(rest).zip(&self.sizes[filled..]) {
            *weight = 1.0 / (tolerance * (value.abs() + nominal));
        }
        for (tested, weight) in self.tested.tiles_mut().iter_mut().zip(self.all.tiles()) {
            *tested = *weight;
        }
        if self.included_count < self.included.len() {
            let left_out = self.tested.iter_mut().zip(&self.included).filter(|(_, included)| !**included);
            left_out.for_each(|(weight, _)| *weight = 0.0);
        }
    }

    /// Norm over all unknowns from the sum of squared weighted values.
    #[inline(always)]
    pub(crate) fn norm_of_squares(&self, squares: f64) -> f64 {
        (squares * self.per_unknown).sqrt()
    }

    /// Norm over all unknowns [dimensionless].
    pub(crate) fn norm(&self, v: &[f64]) -> f64 {
        root_mean_square(v, &self.all, v.len())
    }

    /// Norm over the unknowns of the error test.
    pub(crate) fn tested_norm(&self, v: &[f64]) -> f64 {
        root_mean_square(v, &self.tested, self.tested_count)
    }

    /// Norms of `a`, `a + b` and `a + b + c` over the unknowns of the error test.
    #[inline(always)]
    pub(crate) fn tested_norms(&self, a: &[Tile], b: &[Tile], c: &[Tile]) -> [f64; 3] {
        let weights = self.tested.tiles();
        let (a, b, c) = (&a[..weights.len()], &b[..weights.len()], &c[..weights.len()]);
        let sums = over_tiles(
            weights.len(),
            #[inline(always)]
            || {
                let mut sums = [[0.0; LANES]; 3];
                for (k, weight) in weights.iter().enumerate() {
                    for lane in 0..LANES {
                        let two = a[k][lane] + b[k][lane];
                        let three = two + c[k][lane];
                        for (sum, value) in sums.iter_mut().zip([a[k][lane], two, three]) {
                            let weighted = value * weight[lane];
                            sum[lane] += weighted * weighted;
                        }
                    }
                }
                sums
            },
        );
        let per_tested = (self.tested_count.max(1) as f64).recip();
        sums.map(|sums| (sum(sums) * per_tested).sqrt())
    }

    /// Norm of `a - b` over the unknowns of the error test.
    #[inline(always)]
    pub(crate) fn tested_norm_of_difference(&self, a: &[Tile], b: &[Tile]) -> f64 {
        let weights = self.tested.tiles();
        let (a, b) = (&a[..weights.len()], &b[..weights.len()]);
        let sum =
            sum_of(weights.len(), |k| std::array::from_fn(|lane| square((a[k][lane] - b[k][lane]) * weights[k][lane])));
        (sum / self.tested_count.max(1) as f64).sqrt()
    }

    /// Position of the largest weighted value, NaN first.
    pub(crate) fn worst(&self, v: &[f64]) -> Option<usize> {
        largest(v.iter().zip(self.all.iter()).map(|(v, w)| v * w))
    }
}

/// Position of the value of largest size; a NaN counts as largest.
pub(crate) fn largest(values: impl Iterator<Item = f64>) -> Option<usize> {
    let size = |v: f64| if v.is_nan() { f64::INFINITY } else { v.abs() };
    let mut best: Option<(usize, f64)> = None;
    for (k, value) in values.enumerate() {
        if best.is_none_or(|(_, b)| size(value) > b) {
            best = Some((k, size(value)));
        }
    }
    best.map(|(k, _)| k)
}

fn root_mean_square(v: &[f64], w: &[f64], count: usize) -> f64 {
    let sum = sum_of_pairs(v, w, |v, w| (v * w) * (v * w));
    (sum / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::Weights;
    use crate::tiled::Tiled;

    #[test]
    fn norms_over_tiles_are_those_over_values() {
        for n in 1..10 {
            let mut weights = Weights::new(n);
            weights.configure(1e-3, (0..n).map(|k| k % 3 != 2));
            let y: Vec<f64> = (0..n).map(|k| 1.0 + k as f64).collect();
            weights.update(&y);
            let vector = |factor: f64| {
                let mut own = Tiled::zeros(n);
                own.iter_mut().enumerate().for_each(|(k, value)| *value = (factor * (k + 1) as f64).sin());
                own
            };
            let (a, b, c) = (vector(0.7), vector(1.9), vector(2.3));
            let expected = |term: &dyn Fn(usize) -> f64| {
                let tested: Vec<usize> = (0..n).filter(|k| k % 3 != 2).collect();
                let weighted = |&k: &usize| term(k) / (1e-3 * (y[k] + 1.0));
                (tested.iter().map(weighted).map(|v| v * v).sum::<f64>() / tested.len() as f64).sqrt()
            };
            let close = |own: f64, expected: f64| assert!((own - expected).abs() <= 1e-12 * expected, "n {n}");
            let [one, two, three] = weights.tested_norms(a.tiles(), b.tiles(), c.tiles());
            close(one, expected(&|k| a[k]));
            close(two, expected(&|k| a[k] + b[k]));
            close(three, expected(&|k| a[k] + b[k] + c[k]));
            close(weights.tested_norm_of_difference(a.tiles(), b.tiles()), expected(&|k| a[k] - b[k]));
            close(weights.tested_norm(&a), expected(&|k| a[k]));
        }
    }
}
