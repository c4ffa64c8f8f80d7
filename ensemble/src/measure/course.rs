//! The course of an expression during a run, and what is taken of it.
//!
//! Samples come at every step of the solver and some points within; between two samples the course is the polynomial of degree
//! three through these and their neighbours (Newton's form; of lower degree where an event or an end leaves fewer samples, and
//! never across an event).  Its extremes, its integral and the instants at which it passes zero are those of the polynomial, which
//! is as exact as the samples where the solver's own steps are.

use super::text::Reduction;

/// Samples that make a polynomial.
const SAMPLES: usize = 4;
/// An extreme between samples may exceed them by this part of the largest change from one sample to the next: a
/// polynomial that swings further is none of the course.
const SWING: f64 = 0.5;
/// Halvings that lead from an interval to an instant.
const HALVINGS: usize = 60;

/// Takes samples and gives one number.
#[derive(Clone, Debug)]
pub(crate) struct Course {
    reduction: Reduction,
    /// An instant is also one at which the course is zero.
    equal: bool,
    /// Time (s) and value of the last samples since the last event.
    window: Vec<(f64, f64)>,
    /// Intervals between them that have been looked at.
    done: usize,
    begin: Option<(f64, f64)>,
    last: (f64, f64),
    /// The extreme, the integral or the instant so far.
    found: Option<f64>,
}

impl Course {
    pub(crate) fn new(reduction: Reduction, equal: bool) -> Self {
        let (window, last) = (Vec::with_capacity(SAMPLES), (f64::NAN, f64::NAN));
        Self { reduction, equal, window, done: 0, begin: None, last, found: None }
    }

    /// The next sample.  Two of the same time are the sides of an event.
    pub(crate) fn sample(&mut self, t: f64, value: f64) {
        if self.begin.is_none() {
            self.begin = Some((t, value));
        } else if t == self.last.0 {
            self.end_segment();
        }
        let before = self.last.1;
        self.last = (t, value);
        if self.window.is_empty() {
            // The start, or the far side of an event.
            match self.reduction {
                Reduction::Max | Reduction::Min => self.extreme(value),
                Reduction::When if self.holds(value) && !self.holds(before) => self.instant(t),
                _ => {}
            }
        }
        if self.window.len() == SAMPLES {
            self.window.remove(0);
            self.done -= 1;
        }
        self.window.push((t, value));
        if self.window.len() == SAMPLES {
            // The neighbours of the interval in the middle are known.
            self.look_at(SAMPLES - 2);
        }
    }

    /// What was asked for; NaN where there is none.
    pub(crate) fn value(&mut self) -> f64 {
        self.end_segment();
        let Some(begin) = self.begin else { return f64::NAN };
        let integral = self.found.unwrap_or(0.0);
        let span = self.last.0 - begin.0;
        // At one instant the mean is the value.
        let mean = |value: f64| if span > 0.0 { integral / span } else { value };
        match self.reduction {
            Reduction::Start => begin.1,
            Reduction::Final => self.last.1,
            Reduction::Integral => integral,
            Reduction::Mean => mean(self.last.1),
            Reduction::Rms => mean(self.last.1).max(0.0).sqrt(),
            Reduction::Max | Reduction::Min | Reduction::When => self.found.unwrap_or(f64::NAN),
        }
    }

    fn holds(&self, value: f64) -> bool {
        value > 0.0 || self.equal && value == 0.0
    }

    fn end_segment(&mut self) {
        self.look_at(self.window.len().saturating_sub(1));
        self.window.clear();
        self.done = 0;
    }

    /// Looks at the intervals up to number `end` that have not been looked at.
    fn look_at(&mut self, end: usize) {
        for k in self.done..end {
            let ([(from, left), (to, right)], h) =
                ([self.window[k], self.window[k + 1]], self.window[k + 1].0 - self.window[k].0);
            match self.reduction {
                Reduction::Start | Reduction::Final => {}
                Reduction::Integral | Reduction::Mean | Reduction::Rms => {
                    let [c0, c1, c2, c3] = self.polynomial(k);
                    let part = h * (c0 + c1 / 2.0 + c2 / 3.0 + c3 / 4.0);
                    self.found = Some(self.found.unwrap_or(0.0) + part);
                }
                Reduction::Max | Reduction::Min => {
                    self.extreme(right);
                    if let Some((_, value)) = self.summit(k, if self.reduction == Reduction::Max { 1.0 } else { -1.0 })
                    {
                        self.extreme(value);
                    }
                }
                Reduction::When if self.found.is_some() || self.holds(left) => {}
                Reduction::When => {
                    // Where it comes true, or in between was true for a while.
                    let until = match self.holds(right) {
                        true => Some(1.0),
                        false => self.summit(k, 1.0).filter(|&(_, value)| self.holds(value)).map(|(s, _)| s),
                    };
                    if let Some(until) = until {
                        let t = from + h * self.crossing(self.polynomial(k), until);
                        self.instant(t.min(to));
                    }
                }
            }
        }
        self.done = self.done.max(end);
    }

    fn extreme(&mut self, value: f64) {
        let before = self.found.unwrap_or(value);
        self.found = Some(if self.reduction == Reduction::Max { before.max(value) } else { before.min(value) });
    }

    fn instant(&mut self, t: f64) {
        self.found.get_or_insert(t);
    }

    /// Coefficients of the polynomial through the samples, in the part of interval `k` that has passed.
    fn polynomial(&self, k: usize) -> [f64; SAMPLES] {
        let (from, h) = (self.window[k].0, self.window[k + 1].0 - self.window[k].0);
        let places: Vec<f64> = self.window.iter().map(|&(t, _)| (t - from) / h).collect();
        let mut differences: Vec<f64> = self.window.iter().map(|&(_, value)| value).collect();
        for order in 1..places.len() {
            for j in (order..places.len()).rev() {
                differences[j] = (differences[j] - differences[j - 1]) / (places[j] - places[j - order]);
            }
        }
        // Newton's form, multiplied out from the inside.
        let mut coefficients = [0.0; SAMPLES];
        for (difference, place) in differences.iter().zip(&places).rev() {
            for j in (0..SAMPLES).rev() {
                let lower = if j > 0 { coefficients[j - 1] } else { *difference };
                coefficients[j] = lower - place * coefficients[j];
            }
        }
        coefficients
    }

    /// The highest point (`sign` 1) or the lowest one (-1) of interval `k` between its ends, if it lies beyond them.
    fn summit(&self, k: usize, sign: f64) -> Option<(f64, f64)> {
        let polynomial @ [_, c1, c2, c3] = self.polynomial(k);
        let change = self.window.windows(2).fold(0.0f64, |most, pair| most.max((pair[1].1 - pair[0].1).abs()));
        let ends = (sign * self.window[k].1).max(sign * self.window[k + 1].1);
        // Zeros of c1 + 2 c2 s + 3 c3 s^2, by the formula that does not lose digits.
        let root = -(c2 + (c2 * c2 - 3.0 * c1 * c3).sqrt().copysign(c2));
        let candidates = [root / (3.0 * c3), c1 / root];
        let inside = candidates.into_iter().filter(|s| *s > 0.0 && *s < 1.0).map(|s| (s, at(polynomial, s)));
        let beyond = inside.filter(|&(_, value)| sign * value > ends && sign * value <= ends + SWING * change);
        beyond.reduce(|a, b| if sign * b.1 > sign * a.1 { b } else { a })
    }

    /// Where the polynomial comes to hold before `until`, at which it does.
    fn crossing(&self, polynomial: [f64; SAMPLES], until: f64) -> f64 {
        let (mut from, mut to) = (0.0, until);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (from + to);
            match self.holds(at(polynomial, middle)) {
                true => to = middle,
                false => from = middle,
            }
        }
        to
    }
}

/// The value of a polynomial.
fn at(coefficients: [f64; SAMPLES], s: f64) -> f64 {
    coefficients.into_iter().rev().fold(0.0, |sum, coefficient| sum * s + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(reduction: Reduction, samples: impl IntoIterator<Item = (f64, f64)>) -> f64 {
        let mut course = Course::new(reduction, false);
        samples.into_iter().for_each(|(t, value)| course.sample(t, value));
        course.value()
    }

    /// Samples of a function at steps that grow and shrink.
    fn uneven(f: impl Fn(f64) -> f64, count: usize) -> Vec<(f64, f64)> {
        let time = |k: usize| {
            k as f64 / count as f64 + 0.2 / count as f64 * (1.7 * k as f64).sin() * (k % count).min(1) as f64
        };
        (0..=count).map(|k| (time(k), f(time(k)))).collect()
    }

    /// Extremes, integrals and zeros of a cubic are exact; those of a sine converge with the fourth power.
    #[test]
    fn polynomials_are_measured_exactly_and_others_nearly() {
        let cubic = |t: f64| 4.0 * t * (1.0 - t) * (0.8 - t);
        // Derivative 12 t^2 - 14.4 t + 3.2 = 0.
        let top = (14.4 - (14.4f64 * 14.4 - 4.0 * 12.0 * 3.2).sqrt()) / 24.0;
        let samples = || uneven(cubic, 7);
        let near =
            |value: f64, expected: f64, error: f64| assert!((value - expected).abs() <= error, "{value} {expected}");
        near(taken(Reduction::Max, samples()), cubic(top), 1e-14);
        near(taken(Reduction::Integral, samples()), 4.0 * (0.25 - 1.8 / 3.0 + 0.4), 1e-14);
        near(taken(Reduction::When, samples().into_iter().map(|(t, v)| (t, -v))), 0.8, 1e-14);
        near(taken(Reduction::Start, samples()), 0.0, 0.0);
        let wave = |t: f64| (7.0 * t).sin();
        for (count, error) in [(20, 2e-3), (40, 1.3e-4), (80, 8e-6)] {
            near(taken(Reduction::Max, uneven(wave, count)), 1.0, error);
            near(taken(Reduction::Min, uneven(wave, count)), -1.0, error);
            near(taken(Reduction::Mean, uneven(wave, count)), (1.0 - 7.0f64.cos()) / 7.0, error);
            let half = uneven(|t| wave(t) - 0.5, count);
            near(taken(Reduction::When, half), std::f64::consts::FRAC_PI_6 / 7.0, error);
            let square = uneven(|t| wave(t) * wave(t), count);
            near(taken(Reduction::Rms, square), (0.5 - 14.0f64.sin() / 28.0).sqrt(), error);
        }
    }

    #[test]
    fn events_are_edges_and_nothing_is_drawn_across_them() {
        // 0 until 1, then 2 - t.
        let saw = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (1.5, 0.5), (2.0, 0.0)];
        assert_eq!(taken(Reduction::Max, saw), 1.0);
        assert_eq!(taken(Reduction::Min, saw), 0.0);
        assert_eq!(taken(Reduction::Integral, saw), 0.5);
        assert_eq!(taken(Reduction::When, saw), 1.0);
        assert_eq!(taken(Reduction::Final, saw), 0.0);
        // True from the start, true never, and no run at all.
        assert_eq!(taken(Reduction::When, [(3.0, 1.0), (4.0, 1.0)]), 3.0);
        assert!(taken(Reduction::When, [(3.0, 0.0), (4.0, 0.0)]).is_nan());
        assert!(taken(Reduction::Max, []).is_nan());
        assert_eq!(taken(Reduction::Mean, [(3.0, 5.0)]), 5.0);
    }

    /// A course that bends sharply is not taken beyond its samples further than it changes.
    #[test]
    fn kinks_do_not_make_extremes() {
        let kink = (0..10).map(|k| (f64::from(k), if k < 5 { 0.0 } else { 1.0 }));
        assert!(taken(Reduction::Max, kink) <= 1.0 + SWING);
    }

    /// A bump between two samples that both lie below: the crossing is where it begins.
    #[test]
    fn a_bump_between_samples_is_seen() {
        let bump = |t: f64| 0.2 - (t - 2.5) * (t - 2.5);
        let t = taken(Reduction::When, (0..6).map(|k| (f64::from(k), bump(f64::from(k)))));
        assert!((t - (2.5 - 0.2f64.sqrt())).abs() < 1e-12, "{t}");
    }
}
