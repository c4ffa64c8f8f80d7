//! Size of the first step after a start or an event.
//!
//! The first formula has order 1 and error about `h^2 |y''| / 4`.  `y''` is estimated by the change of consistent rates over a
//! small explicit Euler step; the same small step tells how fast the algebraic unknowns move, which the predictor needs.
//! Source: Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.4, carried over to
//! differential-algebraic systems.  Where the small step leads out of the domain the estimate is `0.5 / |y'|`.
//! Where nothing moves at the start only the length of the run says how far to look, and rates of a wave may be the same there by chance:
//! then they are looked at nearer by, too.

use crate::initial::consistent::Consistency;
use crate::problem::Problem;
use crate::weights::Weights;
use hyd_system::math::fourth_root;

/// Change, relative to values and nominals, of the small step.
const PROBE: f64 = 1e-4;
/// Error of the first step that is aimed at, in tolerances: little, because the steps of order 1 after every event are the
/// least accurate of a run, and growing out of them costs three steps more.
const AIM: f64 = 1e-4;
/// The same for the first step of order four, which is not followed by less accurate ones.
const AIM_FOURTH: f64 = 0.1;
/// Part of the way to a change of the size of the values that counts as time scale.
const TURNING: f64 = 0.03;
/// The first step is at most this part of the time to the next known stop.
const MOST_OF_REST: f64 = 0.01;

/// Parts of the way to a point as far away as the run lets it be where rates are looked at, too: odd powers of the golden section, so that
/// they hardly all fall on zeros of a wave.
const NEARER: [f64; 3] = [0.618_033_988_749_895, 0.236_067_977_499_79, 0.034_441_853_748_633];
/// The far point was deceiving where a nearer one shows so many times its curvature.
const DECEIVED: f64 = 4.0;

/// Work space of the estimate.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct FirstStep {
    y: Vec<f64>,
    yp: Vec<f64>,
    rates: Vec<f64>,
}

/// First steps (s) for formulas of order one and four.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct FirstSteps {
    pub(crate) first_order: f64,
    pub(crate) fourth_order: f64,
}

impl FirstSteps {
    fn equal(h: f64) -> Self {
        Self { first_order: h, fourth_order: h }
    }
}

/// First step of the one-step method, whose error estimate is about `1e-3 h^4 y`; `y` is taken for `y'' / tau^2` with the
/// time scale `tau = |y'| / |y''|`, at a turning point `sqrt(|y| / |y''|)`.
fn fourth_order(speed: f64, curvature: f64, tolerance: f64, most: f64) -> f64 {
    if curvature == 0.0 {
        return most;
    }
    let tau = (speed / curvature).max(TURNING * (tolerance * curvature).sqrt().recip());
    fourth_root(1e3 * AIM_FOURTH * tau * tau / curvature).min(most)
}

impl FirstStep {
    pub(crate) fn new(n: usize) -> Self {
        Self { y: vec![0.0; n], yp: vec![0.0; n], rates: vec![0.0; n] }
    }

    /// First step (s) from consistent `(t, y, yp)` when the next known stop is `rest` s away; `tolerance` is that of the
    /// weights, `smallest` the smallest sensible step (s).  Fills in the rates of algebraic unknowns in `yp`.
    pub(crate) fn estimate(
        &mut self,
        problem: &mut Problem<'_>,
        consistency: &mut Consistency,
        weights: &Weights,
        (t, rest, tolerance, smallest): (f64, f64, f64, f64),
        (y, yp, differential): (&[f64], &mut [f64], &[bool]),
    ) -> FirstSteps {
        for k in 0..y.len() {
            if !differential[k] {
                yp[k] = 0.0;
            }
        }
        let most = MOST_OF_REST * rest;
        let speed = weights.norm(yp);
        let probe = if speed > 0.0 { (PROBE / (tolerance * speed)).min(most) } else { most };
        let probe = probe.max(smallest).min(rest);
        for k in 0..y.len() {
            self.y[k] = y[k] + probe * yp[k];
        }
        self.yp.copy_from_slice(yp);
        let ahead = (t + probe, probe);
        let found = consistency.refine(problem, ahead, weights, &mut self.y, &mut self.yp)
            || consistency.solve(problem, ahead, weights, &mut self.y, &mut self.yp).is_ok();
        if !found {
            let h = if speed > 0.0 { 0.5 / speed } else { most };
            return FirstSteps::equal(h.min(most).max(smallest));
        }
        let mut fastest_algebraic = 0.0f64;
        for k in 0..y.len() {
            if differential[k] {
                self.rates[k] = (self.yp[k] - yp[k]) / probe;
            } else {
                self.rates[k] = 0.0;
                yp[k] = (self.y[k] - y[k]) / probe;
                fastest_algebraic = fastest_algebraic.max(yp[k].abs() * weights.all[k]);
            }
        }
        if !fastest_algebraic.is_finite() {
            return FirstSteps::equal((0.5 / speed).min(most).max(smallest));
        }
        let mut curvature = weights.norm(&self.rates);
        if probe == most {
            let nearer = self.nearer(problem, consistency, weights, (t, most), (y, yp, differential));
            curvature = if nearer > DECEIVED * curvature { nearer } else { curvature };
        }
        // Beyond the probed part of the solution nothing is known.
        let horizon = most.min(if speed > 0.0 { 1e2 * probe } else { most });
        let h = if curvature > 0.0 { (4.0 * AIM / curvature).sqrt() } else { most };
        let first_order = h.min(horizon).max(smallest);
        FirstSteps { first_order, fourth_order: fourth_order(speed, curvature, tolerance, most).max(smallest) }
    }
    /// The largest curvature that rates at nearer points show.
    fn nearer(
        &mut self,
        problem: &mut Problem<'_>,
        consistency: &mut Consistency,
        weights: &Weights,
        (t, most): (f64, f64),
        (y, yp, differential): (&[f64], &[f64], &[bool]),
    ) -> f64 {
        let mut largest = 0.0f64;
        for part in NEARER {
            let probe = part * most;
            for k in 0..y.len() {
                self.y[k] = y[k] + probe * yp[k];
            }
            self.yp.copy_from_slice(yp);
            if consistency.refine(problem, (t + probe, probe), weights, &mut self.y, &mut self.yp) {
                for k in (0..y.len()).filter(|&k| differential[k]) {
                    self.rates[k] = (self.yp[k] - yp[k]) / probe;
                }
                largest = largest.max(weights.norm(&self.rates));
            }
        }
        largest
    }
}
