//! Error weights and the norm in which errors and Newton corrections are measured.
//!
//! `w_i = 1 / (tolerance * (|y_i| + nominal_i))` and the root mean square of `v_i w_i`: a norm of 1 is an error as large
//! as the tolerance allows.  Source: Brenan, Campbell, Petzold 1996, section 5.2.

/// Weights of all unknowns, and of those that the error test looks at.
#[derive(Default)]
pub(crate) struct Weights {
    /// Weight of each unknown [1/unit of y_i].
    pub(crate) all: Vec<f64>,
    /// The same, 0 for unknowns left out of the error test.
    pub(crate) tested: Vec<f64>,
    /// Nominal value of each unknown [unit of y_i].
    pub(crate) nominals: Vec<f64>,
    included: Vec<bool>,
    /// Their number.
    included_count: usize,
    differential: Vec<bool>,
    tolerance: f64,
    tested_count: usize,
}

impl Weights {
    /// Room for n unknowns.
    pub(crate) fn new(n: usize) -> Self {
        Self {
            all: vec![1.0; n],
            tested: vec![1.0; n],
            nominals: vec![1.0; n],
            included: vec![true; n],
            included_count: n,
            differential: vec![true; n],
            tolerance: 1e-6,
            tested_count: n,
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
        for nominal in &mut self.nominals {
            *nominal = nominal.abs();
            if !(*nominal > 0.0 && nominal.is_finite()) {
                *nominal = 1.0;
            }
        }
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
    pub(crate) fn update(&mut self, y: &[f64]) {
        self.tested_count = self.included_count;
        for ((weight, value), nominal) in self.all.iter_mut().zip(y).zip(&self.nominals) {
            *weight = 1.0 / (self.tolerance * (value.abs() + nominal));
        }
        self.tested.copy_from_slice(&self.all);
        if self.included_count < self.included.len() {
            let left_out = self.tested.iter_mut().zip(&self.included).filter(|(_, included)| !**included);
            left_out.for_each(|(weight, _)| *weight = 0.0);
        }
    }

    /// Norm over all unknowns [dimensionless].
    pub(crate) fn norm(&self, v: &[f64]) -> f64 {
        root_mean_square(v, &self.all, v.len())
    }

    /// Norm over the unknowns of the error test.
    pub(crate) fn tested_norm(&self, v: &[f64]) -> f64 {
        root_mean_square(v, &self.tested, self.tested_count)
    }

    /// Norm of `a + b` over the unknowns of the error test.
    pub(crate) fn tested_norm_of_sum(&self, a: &[f64], b: &[f64], sign: f64) -> f64 {
        let sum: f64 = a.iter().zip(b).zip(&self.tested).map(|((a, b), w)| ((a + sign * b) * w).powi(2)).sum();
        (sum / self.tested_count.max(1) as f64).sqrt()
    }

    /// Position of the largest weighted value, NaN first.
    pub(crate) fn worst(&self, v: &[f64]) -> Option<usize> {
        largest(v.iter().zip(&self.all).map(|(v, w)| v * w))
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
    let sum: f64 = v.iter().zip(w).map(|(v, w)| (v * w).powi(2)).sum();
    (sum / count.max(1) as f64).sqrt()
}
