//! The instants of a run: when two are one, and which comes next.
//!
//! An instant is computed (`start + k*interval`, `begin + delay`, the threshold of a relation between time and numbers),
//! so instants that are equal in the model differ by rounding.  Everybody who asks whether an instant has come asks here,
//! so that what one part of a run takes for past is never what another one still waits for: an instant either
//! [has come](Instants::has_come) at a time or [lies ahead](Instants::lies_ahead) of it.  Rounding grows with the times that
//! an instant is computed from, and these reach back to the start of the run: near zero a run that started at -1000 s
//! knows times no better than there.

/// Two instants closer than this part of the largest time they are computed from are one.  `start + k*interval` with numbers that
/// were rounded when they were read is wrong by at most three roundings of half an `EPSILON` each, `begin + delay` by
/// two, so two of them agree within three `EPSILON`; the rest is for thresholds that are computed in a few operations.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// The instants of a run.
#[derive(Clone, Copy, PartialEq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Instants {
    origin: f64,
}

impl Instants {
    /// Those of a run that starts at this time (s).
    pub fn of_run(start: f64) -> Self {
        Self { origin: start.abs() }
    }

    /// The largest time (s) that they are computed from, beside themselves.
    pub fn origin(&self) -> f64 {
        self.origin
    }

    /// How far two instants about `t` (s) may lie apart to be one (s).
    pub fn width(&self, t: f64) -> f64 {
        ROUNDING * t.abs().max(self.origin)
    }

    /// True if two instants differ by no more than rounding.
    pub fn same(&self, a: f64, b: f64) -> bool {
        a == b || (a - b).abs() <= self.width(a.abs().min(b.abs()))
    }

    /// True if the instant is now, at `t`, or was before.
    pub fn has_come(&self, instant: f64, t: f64) -> bool {
        instant <= t || self.same(instant, t)
    }

    /// True if the instant comes after `t`.
    pub fn lies_ahead(&self, instant: f64, t: f64) -> bool {
        instant > t && !self.same(instant, t)
    }
}

#[cfg(test)]
mod tests {
    use super::Instants;

    /// Every instant of samplers of the periods `factors[i] * base` is one with those that it equals, and with no other one.
    fn commensurate(start: f64, base: f64, factors: [u64; 2], turns: u64) {
        let instants = Instants::of_run(start);
        let [a, b] = factors;
        let at = |factor: u64, k: u64| start + k as f64 * (factor as f64 * base);
        let (mut k, mut l) = (0, 0);
        while k * a < turns {
            let (left, right) = (at(a, k), at(b, l));
            let told = (instants.same(left, right), instants.lies_ahead(left, right), instants.lies_ahead(right, left));
            let truth = (k * a == l * b, k * a > l * b, l * b > k * a);
            assert_eq!(told, truth, "{start} + {k}*{a}*{base} against {l}*{b}");
            if k * a <= l * b { k += 1 } else { l += 1 }
        }
    }

    #[test]
    fn instants_of_commensurate_periods_are_one_for_ten_million_turns() {
        commensurate(0.0, 0.1, [1, 2], 10_000_000);
        commensurate(0.0, 0.1, [2, 3], 10_000_000);
        commensurate(0.0, 1.0 / 3.0, [1, 3], 10_000_000);
        commensurate(-1000.0, 0.1, [1, 3], 10_000_000);
        commensurate(1e-3, 1e-4, [3, 7], 10_000_000);
    }

    #[test]
    fn instants_of_random_commensurate_periods() {
        // A generator of Lehmer's kind (Park, Miller 1988).
        let mut seed = 20_261u64;
        let mut draw = |below: u64| {
            seed = seed * 48_271 % 2_147_483_647;
            seed % below
        };
        for _ in 0..300 {
            let base = (1 + draw(9999)) as f64 / [1.0, 10.0, 1e3, 1e6, 3.0, 7.0][draw(6) as usize];
            let start = [0.0, base, -3.0 * base, -1e3 * base, 0.3][draw(5) as usize];
            commensurate(start, base, [1 + draw(12), 1 + draw(12)], 20_000 + draw(20_000));
        }
    }

    #[test]
    fn decimal_periods_coincide_where_their_numbers_do() {
        // 0.1*(3k), 0.3*k and the third of 0.9 are read from texts and rounded each on its own.
        let instants = Instants::of_run(0.0);
        for k in 0..10_000_000u32 {
            let k = f64::from(k);
            let (tenth, three, third) = (0.1 * (3.0 * k), 0.3 * k, (0.9 / 3.0) * k);
            assert!(instants.same(tenth, three) && instants.same(three, third) && instants.same(tenth, third), "{k}");
            // What delays give back.
            assert!(instants.same(three + 0.1, 0.1 * (3.0 * k + 1.0)), "{k}");
            assert!(!instants.same(three, three + 1e-7), "{k}");
        }
    }

    #[test]
    fn an_instant_has_come_or_lies_ahead() {
        let instants = Instants::of_run(0.0);
        let t = 0.3;
        let mut instant: f64 = t;
        for _ in 0..100 {
            assert_ne!(instants.has_come(instant, t), instants.lies_ahead(instant, t));
            assert_eq!(instants.same(instant, t), instants.same(t, instant));
            instant = instant.next_up();
        }
        assert!(instants.lies_ahead(instant, t));
        assert!(instants.lies_ahead(f64::INFINITY, t) && !instants.has_come(f64::NAN, t));
        assert!(!instants.lies_ahead(f64::NAN, t));
    }

    #[test]
    fn rounding_counts_from_the_start_of_the_run() {
        // 10 000 steps of 0.1 from -1000 s end at 0 within the rounding of numbers about 1000.
        let (from, h) = (-1000.0, 0.1);
        let reached = from + 10_001.0 * h;
        assert!(Instants::of_run(from).same(reached, h));
        assert!(!Instants::of_run(0.0).same(reached, h));
    }
}
