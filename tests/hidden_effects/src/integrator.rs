//! One explicit integrator: Dormand-Prince 5(4) (J. Comp. Appl. Math. 6, 1980) with error control in fixed scales, and kinks of the
//! right-hand side located by bisection on the step length (Hairer, Norsett, Wanner, Solving ODEs I, II.6), so that no step
//! straddles one by more than `KINK` seconds.  Jumps (a switch) are the caller's: it ends a run there and starts the next.
//! The fastest rate of the drive is about 1e6 1/s, so an explicit method takes some ten thousand steps for a stroke.

/// Number of states; unused ones stay at zero.
pub const N: usize = 16;
/// The states of the machine.
pub type State = [f64; N];
/// How far past a kink a step may end, s.
const KINK: f64 = 1e-10;
/// The smallest step before a run is given up, s.
const SMALLEST: f64 = 1e-14;

/// A right-hand side.
pub trait System {
    /// dy/dt.
    fn slope(&self, t: f64, y: &State) -> State;
    /// Functions whose change of sign is a kink.
    fn kinks(&self, y: &State) -> [bool; 6];
}

/// Why an integration ended early.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Failure {
    /// Time of the failure, s.
    pub time: f64,
}

/// The integrator's memory between calls.
#[derive(Clone, Debug)]
pub struct Integrator {
    /// Time reached, s.
    pub time: f64,
    /// States reached.
    pub state: State,
    /// Steps taken.
    pub steps: usize,
    length: f64,
    tolerance: f64,
    scale: State,
}

const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
const C: [f64; 6] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

impl Integrator {
    /// Starts at `time` from `state`; `tolerance` is the error of a step in units of `scale`.
    pub fn new(time: f64, state: State, tolerance: f64, scale: State) -> Integrator {
        Integrator { time, state, steps: 0, length: 1e-7, tolerance, scale }
    }

    /// Runs to `end` exactly.
    pub fn advance(&mut self, system: &impl System, end: f64) -> Result<(), Failure> {
        let mut slope = system.slope(self.time, &self.state);
        let mut signs = system.kinks(&self.state);
        while end - self.time > SMALLEST {
            let left = end - self.time;
            let wanted = self.length;
            let h = if wanted >= left { left } else { wanted.min(0.5 * left) };
            let (mut next, mut last, error) = self.step(system, &slope, h);
            if error > 1.0 || !error.is_finite() {
                self.length = h * if error.is_finite() { (0.9 * error.powf(-0.2)).max(0.2) } else { 0.2 };
                if self.length < SMALLEST {
                    return Err(Failure { time: self.time });
                }
                continue;
            }
            let mut taken = h;
            if system.kinks(&next) != signs {
                (taken, next, last) = self.to_kink(system, &slope, &signs, h, (next, last));
            }
            self.steps += 1;
            self.time = if taken == left { end } else { self.time + taken };
            self.state = next;
            slope = last;
            signs = system.kinks(&next);
            let growth = if error > 0.0 { (0.9 * error.powf(-0.2)).clamp(0.2, 5.0) } else { 5.0 };
            self.length = if taken < wanted { wanted.max(h * growth) } else { h * growth };
        }
        self.time = end;
        Ok(())
    }

    /// The shortest step, within `KINK`, after which a sign has changed.
    fn to_kink(
        &self,
        system: &impl System,
        slope: &State,
        signs: &[bool; 6],
        whole: f64,
        end: (State, State),
    ) -> (f64, State, State) {
        let (mut low, mut high, mut result) = (0.0, whole, end);
        while high - low > KINK {
            let middle = 0.5 * (low + high);
            let (next, last, _) = self.step(system, slope, middle);
            if system.kinks(&next) == *signs {
                low = middle;
            } else {
                (high, result) = (middle, (next, last));
            }
        }
        (high, result.0, result.1)
    }

    /// One step of length `h`: new state, slope there, error in units of the tolerance.
    fn step(&self, system: &impl System, slope: &State, h: f64) -> (State, State, f64) {
        let mut k = [[0.0; N]; 7];
        k[0] = *slope;
        let mut y = self.state;
        for stage in 0..6 {
            for i in 0..N {
                let sum: f64 = (0..=stage).map(|j| A[stage][j] * k[j][i]).sum();
                y[i] = self.state[i] + h * sum;
            }
            k[stage + 1] = system.slope(self.time + C[stage] * h, &y);
        }
        let error = (0..N)
            .map(|i| {
                let sum: f64 = (0..7).map(|j| E[j] * k[j][i]).sum();
                (h * sum).abs() / (self.tolerance * self.scale[i])
            })
            .fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) });
        (y, k[6], error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball on a linear spring floor: free fall above, oscillation below.
    struct Ball;
    impl System for Ball {
        fn slope(&self, _: f64, y: &State) -> State {
            let mut slope = [0.0; N];
            slope[0] = y[1];
            slope[1] = -9.81 - 1e4 * y[0].min(0.0);
            slope
        }
        fn kinks(&self, y: &State) -> [bool; 6] {
            [y[0] > 0.0, false, false, false, false, false]
        }
    }

    #[test]
    fn energy_is_kept_across_kinks() {
        let mut state = [0.0; N];
        state[0] = 1.0;
        let mut run = Integrator::new(0.0, state, 1e-10, [1.0; N]);
        run.advance(&Ball, 5.0).expect("runs");
        let [y, v, ..] = run.state;
        let energy = 9.81 * y + 0.5 * v * v + 0.5 * 1e4 * y.min(0.0).powi(2);
        assert!((energy / 9.81 - 1.0).abs() < 1e-8, "{energy}");
    }
}
