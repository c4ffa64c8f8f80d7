//! Recording an accepted step: the sources as polynomials over parts of the step.
//!
//! A part is halved until the highest of five differences is small enough that the error of the polynomial is a tenth of
//! the tolerance.  With equally spaced points that error is at most `2.96e-5 h^5 u'''''` and the difference `h^4 u''''/256`,
//! so that for an oscillation of any frequency `error = 0.030 difference^1.25`, both relative to its size (error of
//! interpolation: Stoer, Bulirsch 2002, section 2.1.4).

use super::polynomial::{NODES, highest};
use crate::initial::consistent::Consistency;
use crate::integrator::Integrator;
use crate::problem::Problem;
use crate::weights::Weights;
use hyd_system::math;

/// The part of the tolerance that the recorded past may be wrong by.
const PART_OF_TOLERANCE: f64 = 0.1;
const ERROR_CONSTANT: f64 = 0.030;

/// What a step is recorded from.
pub(crate) struct Recorder<'r, 'p> {
    pub(crate) problem: &'r mut Problem<'p>,
    pub(crate) past: &'r Integrator,
    pub(crate) consistency: &'r mut Consistency,
    pub(crate) weights: &'r Weights,
}

impl Recorder<'_, '_> {
    /// Records the last step of the integrator.  True if breaks have turned out to be smooth, so that the next time event
    /// may have moved.
    #[inline(always)]
    pub(crate) fn record_step(&mut self) -> bool {
        let work = &self.problem.system.work;
        !work.sites.is_empty() && work.recording && self.past.t() > self.past.t_before() && self.record()
    }

    fn record(&mut self) -> bool {
        let (from, to) = (self.past.t_before(), self.past.t());
        let system = &mut self.problem.system;
        let n = system.work.sites.len();
        // The last correction of the step was small, and what it moved has not been evaluated before.
        system.work.step.accepted = true;
        system.sources_at(to, self.past.y(), self.past.yp());
        system.work.step.anchor = Some(to);
        system.work.step.anchor_values.copy_from_slice(&system.work.asked.sources);
        let mut levels = std::mem::take(&mut system.work.record.levels);
        levels[0][4 * n..].copy_from_slice(&system.work.step.anchor_values);
        for k in 0..4 {
            let t = from + (to - from) * k as f64 / 4.0;
            self.sample(t, &mut levels[0][k * n..(k + 1) * n]);
        }
        self.part((from, to), &mut levels);
        let work = &mut *self.problem.system.work;
        work.record.levels = levels;
        (work.step.anchor, work.step.accepted) = (None, false);
        work.read.cached = None;
        work.read.sources.copy_from_slice(&work.step.anchor_values);
        let reach = work.lags.bounds.iter().copied().fold(0.0, f64::max);
        // Output points and events within the step are still to come, and so are derivatives that lag behind.
        work.past.drop_before(from.min(work.kept_from) - reach, work.breaks.oldest_read());
        work.breaks.drop_before(work.past.oldest());
        work.forget_laid();
        work.breaks.decide(&work.past, &work.lags.times, &work.accuracy.limits)
    }

    /// The sources at a time within the step.
    fn sample(&mut self, t: f64, out: &mut [f64]) {
        let record = &mut self.problem.system.work.record;
        let (mut y, mut yp) = (std::mem::take(&mut record.y), std::mem::take(&mut record.yp));
        self.past.at(t, &mut y, &mut yp);
        // Interpolated algebraic unknowns amplify what is rough in the past that they follow, pass after pass.
        self.consistency.refine(self.problem, (t, self.past.step_size()), self.weights, &mut y, &mut yp);
        self.problem.system.sources_at(t, &y, &yp);
        let work = &mut *self.problem.system.work;
        out.copy_from_slice(&work.asked.sources);
        (work.record.y, work.record.yp) = (y, yp);
    }

    /// Adds a part of the step whose nodes stand in `levels[0]`, or its halves.
    fn part(&mut self, (from, to): (f64, f64), levels: &mut [Vec<f64>]) {
        let work = &mut *self.problem.system.work;
        let n = work.sites.len();
        let [nodes, rest @ ..] = levels else { return };
        let limit = math::pow(PART_OF_TOLERANCE / ERROR_CONSTANT * work.accuracy.tolerance, 0.8);
        for k in 0..NODES {
            work.widen(&nodes[k * n..(k + 1) * n]);
        }
        let fine = |site: usize| {
            let difference = highest(&std::array::from_fn(|k| nodes[k * n + site]));
            difference.abs() <= limit * work.accuracy.scale[site] || !difference.is_finite()
        };
        if rest.is_empty() || (0..n).all(fine) {
            work.past.push(from, to, nodes);
            return;
        }
        let middle = 0.5 * (from + to);
        for (half, (begin, end)) in [(from, middle), (middle, to)].into_iter().enumerate() {
            for k in 0..NODES {
                let to = k * n..(k + 1) * n;
                if k % 2 == 0 {
                    let old = 2 * half + k / 2;
                    rest[0][to].copy_from_slice(&nodes[old * n..(old + 1) * n]);
                } else {
                    let t = begin + (end - begin) * k as f64 / 4.0;
                    self.sample(t, &mut rest[0][to]);
                }
            }
            self.part((begin, end), rest);
        }
    }
}
