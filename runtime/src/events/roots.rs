//! State events: the first change of a root function's sign within a step.
//!
//! The sign of each root function is compared with the held truth of its relation (`value > 0` is true).  A change is
//! located on the dense output by the Illinois variant of regula falsi with bisection as a guard (Dowell, Jarratt, BIT
//! 11 (1971) 168) until the bracket is a few units in the last place of t; the event is the right end, where the new
//! truth holds.  Every point tried is made consistent first, so that roots of algebraic unknowns see the values that
//! the event will see.  A relation that changes and changes back within a step is looked for at points between, no
//! farther apart than the output points, and at the bottom of the parabola through three of them where it comes close
//! to zero, or where lines through them meet below it.  Relations of time alone are known in advance instead
//! ([`hyd_system::DaeSystem::unchanged_until`]).

use hyd_system::Structure;

use crate::events::effect::Effect;
use crate::events::rounding::rounding_of_roots;
use crate::initial::consistent::Consistency;
use crate::integrator::Integrator;
use crate::problem::Problem;
use crate::weights::Weights;

/// Width of the final bracket: units in the last place of t, and a part of the step.
const TIME_ULPS: f64 = 4.0;
const STEP_PART: f64 = 1e-13;
/// A bracket is halved at least once in this many evaluations.
const HALVING: u32 = 4;

/// Intervals into which a step is divided at most.
const MOST_PARTS: usize = 24;
/// A parabola whose bottom is below this part of its ends is looked at there.
const NEAR_ZERO: f64 = 0.4;
/// A part of a step in which a kink may reach zero is halved at most so often.
const MOST_HALVINGS: u32 = 40;
/// A line that comes down to this part of where it began may bend to zero.
const BENT: f64 = 0.25;
/// Values of a root function that begins at zero say nothing below this part of the value at the end of the step.
const NOISE: f64 = 1e-14;
/// Rounding is at most this part of the largest value that a root function has had: where its events have no effect, and where they have
/// a slight one.
const ROUNDING: f64 = 1e-9;
const FINE_ROUNDING: f64 = 1e-9;
/// After so many events that left a relation as it was its function is not believed between the ends of a step of the one-step method.
const FUTILE: u32 = 8;
/// An event that follows after such a part of the time since the one before comes at once.
const AT_ONCE: f64 = 1e-3;
/// A root function that has never been larger may have been nothing but rounding all the time.
const SMALL: f64 = 1e-4;
/// Relations that turn back within this many final brackets after an event belong to the same instant.
const SAME_INSTANT: f64 = 16.0;

/// A part of a step, of which a root function may reach zero inside: times (s) and distances from zero at both ends, and the slopes with
/// which it comes and goes (1/s; 0 where they are not known).
#[derive(Clone, Copy)]
struct Dip {
    l: (f64, f64),
    r: (f64, f64),
    slopes: (f64, f64),
}

/// Watches the root functions over a run.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct RootWatch {
    held: Vec<bool>,
    /// The value was exactly zero on the wrong side just after the last event: zero is not a change until it has moved.
    resting: Vec<bool>,
    /// Time of the last event or the start (s): nothing happens before it, also where a step's begin is rounded to before it.
    from: f64,
    /// Time between the last two events (s).
    gap: f64,
    /// Sizes below which a sign is rounding, for functions that begin the step at zero: a mass that leaves its stop is not beyond it by
    /// 1e-41 m on the way.
    noise: Vec<f64>,
    /// Sizes below which a sign has been seen to be rounding ([`RootWatch::ignore_rounding`]).
    rounding: Vec<f64>,
    /// Truths before the last event.
    before: Vec<bool>,
    /// Events that left a relation as it was or took back at once what the one before had done, less those that did not.
    futile: Vec<u32>,
    /// The largest values so far.
    largest: Vec<f64>,
    left: Vec<f64>,
    right: Vec<f64>,
    trial: Vec<f64>,
    /// Values at the last three points between.
    samples: [Vec<f64>; 3],
    /// Relations that change at the event found last.
    pub(crate) fired: Vec<bool>,
    /// Values at the event found last, or at the last point tried.
    pub(crate) y: Vec<f64>,
    pub(crate) yp: Vec<f64>,
    trial_y: Vec<f64>,
    trial_yp: Vec<f64>,
}

impl RootWatch {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let (roots, n) = (structure.roots, structure.unknowns);
        Self {
            held: vec![false; roots],
            resting: vec![false; roots],
            from: f64::NEG_INFINITY,
            gap: 0.0,
            noise: vec![0.0; roots],
            rounding: vec![0.0; roots],
            before: vec![false; roots],
            futile: vec![0; roots],
            largest: vec![0.0; roots],
            left: vec![0.0; roots],
            right: vec![0.0; roots],
            trial: vec![0.0; roots],
            samples: std::array::from_fn(|_| vec![0.0; roots]),
            fired: vec![false; roots],
            y: vec![0.0; n],
            yp: vec![0.0; n],
            trial_y: vec![0.0; n],
            trial_yp: vec![0.0; n],
        }
    }

    /// Forgets what was seen in a run before.
    pub(crate) fn reset(&mut self) {
        (self.from, self.gap) = (f64::NEG_INFINITY, 0.0);
        self.futile.fill(0);
        for flags in [&mut self.held, &mut self.resting, &mut self.before, &mut self.fired] {
            flags.fill(false);
        }
        for sizes in [&mut self.noise, &mut self.rounding, &mut self.largest] {
            sizes.fill(0.0);
        }
    }

    /// Takes over held truths and values just after the start or an event.
    pub(crate) fn restart(&mut self, problem: &mut Problem<'_>, t: f64, y: &[f64], yp: &[f64]) {
        if self.held.is_empty() {
            return;
        }
        let gap = t - std::mem::replace(&mut self.from, t);
        let before = std::mem::replace(&mut self.gap, gap);
        let at_once = before.is_finite() && gap <= AT_ONCE * before;
        self.before.copy_from_slice(&self.held);
        problem.system.held(&mut self.held);
        problem.system.roots(t, y, yp, &mut self.left);
        for k in (0..self.held.len()).filter(|&k| self.fired[k]) {
            let futile = &mut self.futile[k];
            *futile = match self.before[k] == self.held[k] {
                true => futile.saturating_add(1),
                false if at_once => futile.saturating_add(2),
                false => futile.saturating_sub(1),
            };
        }
        for k in 0..self.held.len() {
            self.resting[k] = self.left[k] == 0.0 && self.held[k];
        }
    }

    /// True if a relation that fired last has again and again been left as it was, or been set back at once.  Where a fast motion is
    /// stepped over, a rate in it swings within the step: the polynomial of order four leaves the start and comes to the end as it should,
    /// but not on the way.
    pub(crate) fn is_futile(&self) -> bool {
        self.fired.iter().zip(&self.futile).any(|(&fired, &futile)| fired && futile >= FUTILE)
    }

    /// Measures at the point of the last event how much of the functions that fired is rounding; from now on they are heard beyond that.
    pub(crate) fn measure_rounding(
        &mut self,
        problem: &mut Problem<'_>,
        consistency: &mut Consistency,
        weights: &Weights,
        place: (f64, f64),
        values: (&[f64], &[f64]),
    ) {
        let sizes = rounding_of_roots(problem, consistency, weights, place, values, &self.left);
        for k in (0..self.held.len()).filter(|&k| self.fired[k]) {
            self.rounding[k] = self.rounding[k].max(sizes[k]);
        }
    }

    /// The relations that fired last come back at once, with this effect: their functions may be zero but for rounding, as
    /// `abs(i) - abs(v)*G` is where an equation says `i = G*v`, or as the current of an open switch.  From now on they are heard
    /// beyond twice the size that they have had, if that is rounding.
    pub(crate) fn ignore_rounding(&mut self, effect: Effect) {
        let part = match effect {
            Effect::None => ROUNDING,
            Effect::Slight => FINE_ROUNDING,
            Effect::Full => return,
        };
        for k in (0..self.held.len()).filter(|&k| self.fired[k]) {
            let size = self.left[k].abs().max(self.right[k].abs()).max(self.rounding[k]);
            if size <= part * self.largest[k].max(SMALL) {
                self.rounding[k] = 2.0 * size;
            }
        }
    }

    /// Time of the first change within the last step, with the values there in `y` and `yp`.  Changes that last longer than
    /// `spacing` (s) are never missed.
    pub(crate) fn check(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        spacing: f64,
    ) -> Option<f64> {
        if self.held.is_empty() {
            return None;
        }
        let (begin, end) = (past.t_before().max(self.from), past.t());
        problem.system.roots(end, past.y(), past.yp(), &mut self.right);
        for k in 0..self.held.len() {
            let right = self.right[k].abs();
            self.largest[k] = self.largest[k].max(right);
            let noise = if self.left[k] == 0.0 { NOISE * right } else { 0.0 };
            self.noise[k] = noise.max(self.rounding[k]);
        }
        let parts = (((end - begin) / spacing).ceil() as usize).clamp(past.parts(), MOST_PARTS);
        let part = (end - begin) / parts as f64;
        self.samples[2].copy_from_slice(&self.left);
        for j in 1..=parts {
            let t = if j < parts { begin + j as f64 * part } else { end };
            self.samples.rotate_left(1);
            if j < parts {
                past.at(t, &mut self.trial_y, &mut self.trial_yp);
                problem.system.roots(t, &self.trial_y, &self.trial_yp, &mut self.samples[2]);
            } else {
                self.samples[2].copy_from_slice(&self.right);
            }
            // A change that is undone before `t` comes first.
            let dip = if j > 1 { self.dip(problem, past, (t, part)) } else { None };
            let bottom = if j > 1 { self.bottom().map(|place| t + (place - 1.0) * part) } else { None };
            let flipped = mark(&self.samples[2], &self.held, (&self.resting, &self.noise), &mut self.fired);
            for suspect in [dip, bottom, flipped.then_some(t)].into_iter().flatten().filter(|&at| at > begin) {
                // The same point again, consistent this time.
                if self.confirmed(problem, past, consistency, weights, suspect) {
                    return Some(self.locate(problem, past, consistency, weights, (begin, suspect)));
                }
                if suspect == end {
                    self.right.copy_from_slice(&self.trial);
                }
            }
        }
        self.advance();
        None
    }

    /// Where the first parabola through the last three points (at -1, 0, 1) that comes near zero has its bottom.
    fn bottom(&self) -> Option<f64> {
        let [a, b, c] = &self.samples;
        let place = |k: usize| {
            let sign = if self.held[k] { 1.0 } else { -1.0 };
            let (a, b, c) = (sign * a[k], sign * b[k], sign * c[k]);
            let (slope, bend) = (0.5 * (c - a), a - 2.0 * b + c);
            let inside = bend > 0.0 && slope.abs() < bend;
            let lowest = b - 0.5 * slope * slope / bend;
            (inside && lowest < NEAR_ZERO * a.min(c)).then(|| -slope / bend)
        };
        (0..self.held.len()).filter_map(place).min_by(f64::total_cmp)
    }

    /// A time at which a relation has changed that is as before at the last three points, the newest at `t`.  A function
    /// with a kink (`abs(x) < 1e-3`) comes near zero on a line, so where the line through two of the points would cross zero
    /// before the third one, the part is halved towards the crossing.
    fn dip(&mut self, problem: &mut Problem<'_>, past: &Integrator, (t, part): (f64, f64)) -> Option<f64> {
        for k in 0..self.held.len() {
            let sign = if self.held[k] { 1.0 } else { -1.0 };
            let [a, b, c] = std::array::from_fn(|j| sign * self.samples[j][k]);
            if 2.0 * b < (1.0 + BENT) * a {
                let found =
                    self.descend(problem, past, k, Dip { l: (t - part, b), r: (t, c), slopes: (b - a, 0.0) }, part);
                if found.is_some() {
                    return found;
                }
            }
            if 2.0 * b < (1.0 + BENT) * c {
                let dip = Dip { l: (t - 2.0 * part, a), r: (t - part, b), slopes: (0.0, c - b) };
                let found = self.descend(problem, past, k, dip, part);
                if found.is_some() {
                    return found;
                }
            }
        }
        None
    }

    /// Follows a dip down to where it reaches zero, or is seen not to.
    fn descend(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        k: usize,
        mut dip: Dip,
        part: f64,
    ) -> Option<f64> {
        let sign = if self.held[k] { 1.0 } else { -1.0 };
        dip.slopes = (dip.slopes.0 / part, dip.slopes.1 / part);
        for _ in 0..MOST_HALVINGS {
            let ((l, left), (r, right), (falls, rises)) = (dip.l, dip.r, dip.slopes);
            let (middle, half) = (0.5 * (l + r), 0.5 * (r - l));
            past.at(middle, &mut self.trial_y, &mut self.trial_yp);
            problem.system.roots(middle, &self.trial_y, &self.trial_yp, &mut self.trial);
            if mark(&self.trial, &self.held, (&self.resting, &self.noise), &mut self.fired) {
                return Some(middle);
            }
            let (value, low) = (sign * self.trial[k], BENT * left.max(right));
            let (before, after) = ((value - left) / half, (right - value) / half);
            // How low lines from both sides come in either half.
            let first = (left + falls * half).min(value - after * half);
            let second = (value + before * half).min(right - rises * half);
            dip = if first < low && first <= second {
                Dip { l: dip.l, r: (middle, value), slopes: (falls, after) }
            } else if second < low {
                Dip { l: (middle, value), r: dip.r, slopes: (before, rises) }
            } else {
                return None;
            };
        }
        None
    }

    /// True if a relation has changed at time `t` on consistent values, which then stand in `right`, `y` and `yp`.
    fn confirmed(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        t: f64,
    ) -> bool {
        self.probe(problem, past, consistency, weights, t);
        let changed = mark(&self.trial, &self.held, (&self.resting, &self.noise), &mut self.fired);
        if changed {
            self.right.copy_from_slice(&self.trial);
            std::mem::swap(&mut self.y, &mut self.trial_y);
            std::mem::swap(&mut self.yp, &mut self.trial_yp);
        }
        changed
    }

    /// After an event at `t` with a `reinit`: moves `y` on by as much time as rounding leaves open, if a relation turns back within
    /// it (a ball just above its floor again).  Then that change belongs to the same instant.
    pub(crate) fn turn_back(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        (y, yp, states): (&mut [f64], &[f64], &[bool]),
    ) -> bool {
        if self.held.is_empty() {
            return false;
        }
        problem.system.held(&mut self.held);
        problem.system.roots(t, y, yp, &mut self.trial);
        self.resting.fill(false);
        self.noise.fill(0.0);
        if mark(&self.trial, &self.held, (&self.resting, &self.noise), &mut self.fired) {
            return false;
        }
        let ahead = SAME_INSTANT * (TIME_ULPS * f64::EPSILON * t.abs() + STEP_PART * h);
        for (k, value) in self.trial_y.iter_mut().enumerate() {
            *value = if states[k] { y[k] + ahead * yp[k] } else { y[k] };
        }
        problem.system.roots(t, &self.trial_y, yp, &mut self.trial);
        let turned = mark(&self.trial, &self.held, (&self.resting, &self.noise), &mut self.fired);
        if turned {
            y.copy_from_slice(&self.trial_y);
        }
        turned
    }

    fn advance(&mut self) {
        std::mem::swap(&mut self.left, &mut self.right);
        for (resting, value) in self.resting.iter_mut().zip(&self.left) {
            *resting &= *value == 0.0;
        }
    }

    /// Root functions at time `t` into `trial`, values into `trial_y`.
    fn probe(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        t: f64,
    ) {
        past.at(t, &mut self.trial_y, &mut self.trial_yp);
        consistency.refine(problem, (t, past.step_size()), weights, &mut self.trial_y, &mut self.trial_yp);
        problem.system.roots(t, &self.trial_y, &self.trial_yp, &mut self.trial);
    }

    /// Shrinks the bracket `(a, b)` around the first change; `right`, `fired`, `y`, `yp` belong to its right end.
    fn locate(
        &mut self,
        problem: &mut Problem<'_>,
        past: &Integrator,
        consistency: &mut Consistency,
        weights: &Weights,
        (mut a, mut b): (f64, f64),
    ) -> f64 {
        let width = TIME_ULPS * f64::EPSILON * a.abs().max(b.abs()) + STEP_PART * (b - a);
        let (mut weight_a, mut weight_b) = (1.0, 1.0);
        let mut last_right = None;
        let (mut evaluations, mut size_then) = (0, b - a);
        while b - a > width {
            evaluations += 1;
            let halve = evaluations % HALVING == 0 && b - a > 0.5 * size_then;
            if evaluations % HALVING == 0 {
                size_then = b - a;
            }
            let guess = if halve { 0.5 * (a + b) } else { self.secant(a, b, weight_a, weight_b) };
            let margin = 0.25 * width;
            let middle = guess.clamp(a + margin, b - margin);
            if middle <= a || middle >= b {
                break;
            }
            self.probe(problem, past, consistency, weights, middle);
            if mark(&self.trial, &self.held, (&self.resting, &self.noise), &mut self.fired) {
                b = middle;
                std::mem::swap(&mut self.right, &mut self.trial);
                std::mem::swap(&mut self.y, &mut self.trial_y);
                std::mem::swap(&mut self.yp, &mut self.trial_yp);
                (weight_a, weight_b) = if last_right == Some(true) { (0.5 * weight_a, 1.0) } else { (1.0, 1.0) };
                last_right = Some(true);
            } else {
                a = middle;
                std::mem::swap(&mut self.left, &mut self.trial);
                (weight_a, weight_b) = if last_right == Some(false) { (1.0, 0.5 * weight_b) } else { (1.0, 1.0) };
                last_right = Some(false);
            }
        }
        mark(&self.right, &self.held, (&self.resting, &self.noise), &mut self.fired);
        b
    }

    /// Earliest crossing of the chords of all relations that change within the bracket; the middle where a chord is no help.
    fn secant(&self, a: f64, b: f64, weight_a: f64, weight_b: f64) -> f64 {
        let mut earliest = b;
        for k in 0..self.held.len() {
            if !changed(self.right[k], self.held[k], self.resting[k]) {
                continue;
            }
            let (left, right) = (weight_a * self.left[k], weight_b * self.right[k]);
            let part = left / (left - right);
            let crossing = if (0.0..1.0).contains(&part) { a + part * (b - a) } else { 0.5 * (a + b) };
            earliest = earliest.min(crossing);
        }
        earliest
    }
}

fn changed(value: f64, held: bool, resting: bool) -> bool {
    (value > 0.0) != held && !(resting && value == 0.0)
}

/// Marks the relations that changed; true if there are any.
fn mark(values: &[f64], held: &[bool], (resting, noise): (&[bool], &[f64]), fired: &mut [bool]) -> bool {
    let mut any = false;
    for k in 0..values.len() {
        let beyond = noise[k] == 0.0 || values[k].abs() > noise[k];
        fired[k] = beyond && changed(values[k], held[k], resting[k]);
        any |= fired[k];
    }
    any
}
