//! Steps of the sensitivities: the one-step method on linear equations whose coefficients are known along the solution.
//!
//! Stage i solves `(F_y + c F_y') S_i = c F_y' P_i - F_p` with `P_i = s_n + h sum_{j<i} a_ij R_j`, `c = 1/(h gamma)` and
//! `R_i = c (S_i - P_i)`, the tableau being that of [`crate::esdirk`].  The equations are as rough as the model is: where a contact closes
//! without an event, `s'` jumps although `y'` does not.  Steps end before such a [break](super::breaks) and begin anew behind it; they
//! are the sensitivities' own, chosen by their own error (not without end, see `BURST`), and the method has no past that a
//! jump would spoil.  The error estimate is the difference of the two results over differential unknowns, relative to the largest
//! derivative so far, the worst direction counting; where breaks are not located, the combination that sees kinks counts too.  With delays
//! steps end where the pieces of the past end which they read (see [`end_on`](crate::delay::end_on)), or else where steps of the solution do.
//!
//! Directions are handled in tiles, side by side for each unknown, so that one load of a matrix entry serves all.

use super::breaks::Breaks;
use super::linear::Matrices;
use super::trail::Trail;
use crate::esdirk::tableau::{A, C, GAMMA, STAGES, dense, difference, kink};
use crate::linear::FactorError;
use crate::problem::Problem;
use crate::tiled::{LANES, Tile};
use hyd_system::math::{fourth_root, pow};
use hyd_system::wide;

/// Accepted error, in tolerances of the solution: at 1e-6 smaller ones change no derivative of a drive by more than the
/// solution's own error does, because errors of the solution at contacts grow in its derivatives.
const FORGIVEN: f64 = 10.0;
/// Below this tolerance the accepted error falls as its power 4/5: the estimate is one of order 3, `h^4`, the result one of order 4
/// with an error of `h^5`, which so falls as the tolerance does.
const TIGHT: f64 = 1e-6;
/// Attempts after which a step is taken as it is: closer to a jump of the coefficients nothing is gained.
const MOST_ATTEMPTS: u32 = 10;
/// With delays the past is rough by the errors of earlier steps, which no step resolves, however short; each pass
/// through a delay would ask for shorter steps than the one before, without end.  Who has taken so many more attempts
/// than [`RATIO`] for each step of the solution takes steps of the part [`SHORTEST`] of the solution's own as they are,
/// until that is made up for.
const BURST: f64 = 1000.0;
/// The same without delays, where a direction may be rough by the rounding of the equations that it moves.
const ENDLESS: f64 = 20_000.0;
/// The second number is for tolerances below [`TIGHT`], where jumps that have not died out yet ask for more.
const SHORTEST: (f64, f64) = (0.5, 0.125);
const RATIO: (f64, f64) = (4.0, 16.0);
/// Aim below the accepted error.
const SAFETY: f64 = 0.85;
/// A step may become so many times as long to end on a limit.
const STRETCH: f64 = 1.05;
/// Growth and shrinking of steps.
const MOST_GROWTH: f64 = 4.0;
const LEAST: f64 = 0.15;
/// Change of the step where an attempt has no value.
const RETREAT: f64 = 0.1;

/// Derivatives at the newest point, the last step, and the step to try next.
pub(super) struct Steps {
    /// Number of directions, and of tiles that hold them.
    count: usize,
    tiles: usize,
    last: LastStep,
    attempt: Attempt,
    /// Step wanted next (s).
    h: f64,
    /// Attempts beyond those that the steps of the solution account for.
    spent: f64,
    /// The next step is the first after a restart or a break.
    fresh: bool,
    tolerance: f64,
    /// Largest derivatives so far, and the least that counts.
    largest: Vec<Tile>,
}

/// The last step, in tiles.
struct LastStep {
    /// Its ends, and its length, which is 0 before the first (s).
    from: f64,
    to: f64,
    h: f64,
    /// It was the first after a restart or a break.
    first: bool,
    /// Derivatives at its beginning and at its end.
    start: Vec<Tile>,
    s: Vec<Tile>,
    /// Rates of its stages, the last being those at its end; an attempt at the next step writes its own over them.
    rates: [Vec<Tile>; STAGES],
}

/// Vectors of a stage.
struct Attempt {
    base: Vec<Tile>,
    column: Vec<Tile>,
    /// Tangent of F with unknowns held, as the system gives it.
    forcing: Vec<f64>,
    y: Vec<f64>,
    yp: Vec<f64>,
}

impl Steps {
    /// Work space for n unknowns and this many directions.
    pub(super) fn new(n: usize, count: usize) -> Self {
        let tiles = count.div_ceil(LANES);
        let tiled = || vec![[0.0; LANES]; tiles * n];
        Self {
            count,
            tiles,
            last: LastStep {
                from: 0.0,
                to: 0.0,
                h: 0.0,
                first: true,
                start: tiled(),
                s: tiled(),
                rates: std::array::from_fn(|_| tiled()),
            },
            attempt: Attempt {
                base: tiled(),
                column: tiled(),
                forcing: vec![0.0; n * (count + 1)],
                y: vec![0.0; n],
                yp: vec![0.0; n],
            },
            h: f64::INFINITY,
            spent: 0.0,
            fresh: true,
            tolerance: 1e-6,
            largest: tiled(),
        }
    }

    /// The start of a run: `least` gives the smallest derivative of an unknown by a direction that counts.
    pub(super) fn begin(&mut self, tolerance: f64, least: impl Fn(usize, usize) -> f64) {
        self.spent = 0.0;
        self.tolerance = FORGIVEN * tolerance * pow(TIGHT / tolerance, 0.2).max(1.0);
        let width = self.tiles * LANES;
        for (at, value) in self.largest.iter_mut().flatten().enumerate() {
            let (k, direction) = (at / width, at % width);
            *value = if direction < self.count { least(k, direction) } else { 1.0 };
        }
    }

    /// Forgets the past: blocks of `width` derivatives and rates hold at `t` (s).
    pub(super) fn restart(&mut self, t: f64, s: &[f64], sp: &[f64], width: usize) {
        (self.last.to, self.last.from, self.last.h, self.h) = (t, t, 0.0, f64::INFINITY);
        self.fresh = true;
        load(&mut self.last.s, self.tiles, s, width, self.count);
        load(&mut self.last.rates[STAGES - 1], self.tiles, sp, width, self.count);
        self.measure();
    }

    /// Time of the newest point (s).
    pub(super) fn newest(&self) -> f64 {
        self.last.to
    }

    /// Time before the last step (s).
    pub(super) fn before(&self) -> f64 {
        self.last.from
    }

    /// True if the next step, at most as long as the shortest delay, lies within the trail, or a break cuts it short.
    pub(super) fn fits(&self, trail: &Trail, breaks: &Breaks, shortest: Option<f64>) -> bool {
        let rest = trail.end() - self.last.to;
        let wanted = self.h.min(shortest.unwrap_or(f64::INFINITY));
        rest > 0.0 && (!wanted.is_finite() || wanted <= rest || breaks.next().is_some())
    }

    /// Goes over a break, if the newest point stands before one: rates begin anew behind it.
    pub(super) fn cross(
        &mut self,
        problem: &mut Problem<'_>,
        matrices: &mut Matrices,
        (trail, breaks): (&mut Trail, &mut Breaks),
        differential: &[bool],
    ) {
        let Some((_, behind)) = breaks.next().filter(|(before, _)| *before <= self.last.to) else { return };
        breaks.pass();
        let t = behind.max(self.last.to);
        trail.values(t, &mut self.attempt.y, &mut self.attempt.yp);
        let point = (self.attempt.y.as_slice(), self.attempt.yp.as_slice());
        if matrices.select_along(problem, t, point, differential, &mut self.attempt.forcing).is_err() {
            // The step that follows has the same trouble, and says so.
            return;
        }
        take_forcing(&mut self.attempt.column, self.tiles, &self.attempt.forcing, self.count);
        matrices.subtract_state_product(&self.last.s, differential, &mut self.attempt.column, self.tiles);
        matrices.solve_tiles(&mut self.attempt.column, self.tiles);
        for (k, &differential) in differential.iter().enumerate() {
            let range = k * self.tiles..(k + 1) * self.tiles;
            let target = if differential { &mut self.last.rates[STAGES - 1] } else { &mut self.last.s };
            target[range.clone()].copy_from_slice(&self.attempt.column[range]);
        }
        (self.last.to, self.last.from, self.last.h) = (t, t, 0.0);
        self.fresh = true;
        trail.drop_before(t);
    }

    /// One step along the trail, at most to the next break; the error says at which time the matrix has no solution.
    pub(super) fn step(
        &mut self,
        problem: &mut Problem<'_>,
        matrices: &mut Matrices,
        (trail, breaks): (&mut Trail, &mut Breaks),
        differential: &[bool],
    ) -> Result<(), (f64, FactorError)> {
        let limit = breaks.next().map_or(trail.end(), |(before, _)| before.min(trail.end()));
        // What a step reads of the past must be known.
        let shortest = problem.system.shortest_delay();
        let limit = shortest.map_or(limit, |shortest| limit.min(self.last.to + shortest));
        let (part, ratio) = match self.tolerance < FORGIVEN * TIGHT {
            true => (SHORTEST.1, RATIO.1),
            false => (SHORTEST.0, RATIO.0),
        };
        let most = if shortest.is_some() { BURST } else { ENDLESS };
        let least = if self.spent > most && !self.fresh { part * trail.step_over(self.last.to) } else { 0.0 };
        if limit <= self.last.to {
            // The next break is at hand, or the last one led to the end.
            return Ok(());
        }
        let wanted = self.h;
        // What an attempt reads of the last step; the rest it writes anew.
        std::mem::swap(&mut self.last.start, &mut self.last.s);
        self.last.rates.swap(0, STAGES - 1);
        let mut attempts = 0u32;
        loop {
            let target = self.target(problem, limit, trail, shortest.is_some());
            let h = target - self.last.to;
            attempts += 1;
            problem.statistics.sensitivity_steps += 1;
            let error = match self.stages(problem, matrices, trail, (h, target)) {
                Ok(()) => {
                    let error = self.error(h, differential, difference);
                    if breaks.located() { error } else { error.max(self.error(h, differential, kink)) }
                }
                Err(error) if attempts >= MOST_ATTEMPTS => return Err((target, error)),
                Err(_) => f64::NAN,
            };
            let tiny = h <= 64.0 * f64::EPSILON * self.last.to.abs();
            // The end of a step may have been moved to the limit.
            let short = h <= 1.06 * least;
            if error <= 1.0 || (error.is_finite() && (attempts >= MOST_ATTEMPTS || tiny || short)) {
                let growth = if attempts > 1 { 1.0 } else { MOST_GROWTH };
                self.h = h * (SAFETY / fourth_root(error.max(1e-8))).clamp(LEAST, growth);
                if attempts == 1 && wanted.is_finite() && target == limit {
                    // What was cut short says little about the next one.
                    self.h = self.h.max(wanted);
                }
                self.h = self.h.max(least);
                let due = ratio * trail.points_within(self.last.to, target) as f64;
                self.spent = (self.spent + f64::from(attempts) - due).max(0.0);
                (self.last.from, self.last.to, self.last.h) = (self.last.to, target, h);
                self.last.first = std::mem::take(&mut self.fresh);
                self.measure();
                return Ok(());
            }
            if attempts >= MOST_ATTEMPTS {
                // No value at any length: the matrix was solvable, the result is not.
                return Err((target, FactorError::NotFinite { row: 0, column: 0 }));
            }
            let shorter = if error.is_finite() { (SAFETY / fourth_root(error)).clamp(LEAST, 0.7) } else { RETREAT };
            self.h = (h * shorter).max(if error.is_finite() { least } else { 0.0 });
        }
    }

    /// Where the next step ends: at the limit, and with delays where pieces of the past do that it reads, or steps of the solution.
    fn target(&self, problem: &Problem<'_>, limit: f64, trail: &Trail, has_delays: bool) -> f64 {
        let (from, h) = (self.last.to, self.h);
        if STRETCH * h >= limit - from {
            return limit;
        }
        if !has_delays {
            return from + h;
        }
        let steps = (h, STRETCH * h);
        let end = problem.system.end_of_derived_step(from, steps).filter(|end| *end < limit);
        end.or_else(|| trail.end_of_step(from, steps)).unwrap_or(from + h)
    }

    /// The stages of one attempt.
    fn stages(
        &mut self,
        problem: &mut Problem<'_>,
        matrices: &mut Matrices,
        trail: &Trail,
        (h, target): (f64, f64),
    ) -> Result<(), FactorError> {
        let (tiles, c) = (self.tiles, (h * GAMMA).recip());
        for i in 1..STAGES {
            let t = if i + 1 == STAGES { target } else { self.last.to + C[i] * h };
            trail.values(t, &mut self.attempt.y, &mut self.attempt.yp);
            matrices.factor_along(problem, (t, c), (&self.attempt.y, &self.attempt.yp), &mut self.attempt.forcing)?;
            let (done, rest) = self.last.rates.split_at_mut(i);
            combine(&mut self.attempt.base, Some(&self.last.start), done, &A[i].map(|a| h * a));
            take_forcing(&mut self.attempt.column, tiles, &self.attempt.forcing, self.count);
            matrices.add_rate_product(c, &self.attempt.base, &mut self.attempt.column, tiles);
            matrices.solve_tiles(&mut self.attempt.column, tiles);
            let rates = rest[0].as_flattened_mut().iter_mut();
            for ((rate, s), base) in rates.zip(self.attempt.column.as_flattened()).zip(self.attempt.base.as_flattened())
            {
                *rate = c * (s - base);
            }
        }
        std::mem::swap(&mut self.last.s, &mut self.attempt.column);
        Ok(())
    }

    /// Error of the attempt by a combination of its rates, in accepted ones.
    fn error(&mut self, h: f64, differential: &[bool], weight: fn(usize) -> f64) -> f64 {
        let count = differential.iter().filter(|differential| **differential).count().max(1) as f64;
        combine(
            &mut self.attempt.base,
            None,
            &self.last.rates,
            &std::array::from_fn::<f64, STAGES, _>(|i| h * weight(i)),
        );
        let mut worst = 0.0f64;
        for tile in 0..self.tiles {
            let mut sum = [0.0; LANES];
            for (k, _) in differential.iter().enumerate().filter(|(_, differential)| **differential) {
                let at = k * self.tiles + tile;
                let (error, largest, s) = (&self.attempt.base[at], &self.largest[at], &self.last.s[at]);
                for lane in 0..LANES {
                    let (largest, s) = (largest[lane], s[lane].abs());
                    let part = error[lane] / if s > largest { s } else { largest };
                    sum[lane] += part * part;
                }
            }
            for sum in sum {
                // Not a number must not get lost.
                worst = if sum.is_nan() { sum } else { worst.max(sum) };
                if worst.is_nan() {
                    return worst;
                }
            }
        }
        (worst / count).sqrt() / self.tolerance
    }

    /// Keeps the largest derivatives.
    fn measure(&mut self) {
        for (largest, s) in self.largest.as_flattened_mut().iter_mut().zip(self.last.s.as_flattened()) {
            let s = s.abs();
            *largest = if s > *largest { s } else { *largest };
        }
    }

    /// Derivatives and rates at a time within the last step, into blocks of `width`.
    pub(super) fn at(&self, t: f64, differential: &[bool], (s, sp): (&mut [f64], &mut [f64]), width: usize) {
        let weights: [(f64, f64); STAGES] = if self.last.h > 0.0 && t != self.last.to {
            let theta = (t - self.last.from) / self.last.h;
            std::array::from_fn(|i| dense(i, theta))
        } else {
            return self.newest_into((s, sp), width);
        };
        let theta = (t - self.last.from) / self.last.h;
        for tile in 0..self.tiles {
            for (k, &differential) in differential.iter().enumerate() {
                let at = k * self.tiles + tile;
                for lane in 0..LANES.min(self.count - tile * LANES) {
                    let (mut value, mut rate) = (self.last.start[at][lane], 0.0);
                    if self.last.first && !differential {
                        // Stages start from a rate that an algebraic unknown does not have at a restart.
                        let (slope, end) =
                            ((self.last.s[at][lane] - value) / self.last.h, self.last.rates[STAGES - 1][at][lane]);
                        let begin = 2.0 * slope - end;
                        rate = begin + theta * (end - begin);
                        value += 0.5 * theta * self.last.h * (begin + rate);
                    } else {
                        for (rates, (b, slope)) in self.last.rates.iter().zip(weights) {
                            value += self.last.h * b * rates[at][lane];
                            rate += slope * rates[at][lane];
                        }
                    }
                    s[k * width + tile * LANES + lane] = value;
                    sp[k * width + tile * LANES + lane] = rate;
                }
            }
        }
    }

    fn newest_into(&self, (s, sp): (&mut [f64], &mut [f64]), width: usize) {
        let own = self.tiles * LANES;
        for (blocks, tiles) in [(s, &self.last.s), (sp, &self.last.rates[STAGES - 1])] {
            for (block, own) in blocks.chunks_exact_mut(width).zip(tiles.as_flattened().chunks_exact(own)) {
                block[..self.count].copy_from_slice(&own[..self.count]);
            }
        }
    }
}

/// `base := start + sum f_j R_j`, one pass for all rates.
fn combine(base: &mut [Tile], start: Option<&[Tile]>, rates: &[Vec<Tile>], factors: &[f64]) {
    wide(
        #[inline(always)]
        || match rates.len() {
            1 => add::<1>(base, start, rates, factors),
            2 => add::<2>(base, start, rates, factors),
            3 => add::<3>(base, start, rates, factors),
            4 => add::<4>(base, start, rates, factors),
            5 => add::<5>(base, start, rates, factors),
            _ => add::<STAGES>(base, start, rates, factors),
        },
    );
}

/// `base := start + sum f_j R_j` over the first `K` of them.
#[inline(always)]
fn add<const K: usize>(base: &mut [Tile], start: Option<&[Tile]>, rates: &[Vec<Tile>], factors: &[f64]) {
    let length = base.len();
    let rates: [&[Tile]; K] = std::array::from_fn(|j| &rates[j][..length]);
    let factors: [f64; K] = std::array::from_fn(|j| factors[j]);
    for (at, base) in base.iter_mut().enumerate() {
        let mut sum = start.map_or([0.0; LANES], |start| start[at]);
        for (rates, factor) in rates.iter().zip(factors) {
            for (sum, rate) in sum.iter_mut().zip(&rates[at]) {
                *sum += factor * rate;
            }
        }
        *base = sum;
    }
}

/// `column := -F_p`, from blocks with one further direction; lanes without a direction stay zero.
fn take_forcing(column: &mut [Tile], tiles: usize, forcing: &[f64], count: usize) {
    for (column, block) in column.chunks_exact_mut(tiles).zip(forcing.chunks_exact(count + 1)) {
        let (whole, rest) = block[..count].as_chunks::<LANES>();
        let (own, last) = column.split_at_mut(whole.len());
        for (own, forcing) in own.iter_mut().zip(whole) {
            *own = forcing.map(|value| -value);
        }
        if let Some(last) = last.first_mut() {
            *last = std::array::from_fn(|lane| rest.get(lane).map_or(0.0, |value| -value));
        }
    }
}

/// Blocks of `width` to tiles of the first `count` directions.
fn load(target: &mut [Tile], tiles: usize, blocks: &[f64], width: usize, count: usize) {
    let target = target.as_flattened_mut().chunks_exact_mut(tiles * LANES);
    for (own, block) in target.zip(blocks.chunks_exact(width)) {
        own[..count].copy_from_slice(&block[..count]);
        own[count..].fill(0.0);
    }
}
