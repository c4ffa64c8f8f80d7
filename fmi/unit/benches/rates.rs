//! What a call of rates of a unit for model exchange costs, beside one residual of the same equations at the same points.
//!
//! `cargo bench -p hyd-unit -- FOLDER STEP STEPS`: the folder of an unpacked unit of FMI 3.0, and the steps (s, number) that are taken of it.
//! The C functions are called at the points of classical Runge-Kutta steps from the start of the model, four rates a step, each step completed,
//! with no event on the way; what setting time and states and what completing steps costs is told apart.  The residual is that of the
//! compiled model in this process, without any solver.  The same steps are also taken one after the other, each with the rates of the one before, as an
//! integrator does: by the unit, with the calls that set time and states, and by the residual alone.  The least of several rounds, by the wall clock.

use std::ffi::{CString, c_void};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use hyd_payload::{Backend, Instance, Loaded, format};
use hyd_runtime::Exchange;
use hyd_system::DaeSystem;
use hyd_unit::fmi3;

const TOLERANCE: f64 = 1e-6;
const STOP: f64 = 1.0;
const ROUNDS: usize = 15;
/// Room for the rates of a model.
const MOST_STATES: usize = 1000;
/// A rate by which the factors of rates are found.
const FAR: f64 = 1e12;

/// A point that an integrator asks for, and whether it goes on from it.
struct Asked {
    t: f64,
    x: Vec<f64>,
    accepted: bool,
}

/// Time, unknowns and rates of a point.
type Solved = (f64, Vec<f64>, Vec<f64>);

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let parsed = match arguments.as_slice() {
        [folder, step, steps] => step.parse().ok().zip(steps.parse().ok()).map(|steps| (Path::new(folder), steps)),
        _ => None,
    };
    match parsed {
        Some((folder, steps)) => measure(folder, steps),
        None => println!("usage: rates FOLDER_OF_AN_UNPACKED_UNIT STEP STEPS"),
    }
}

fn measure(folder: &Path, steps: (f64, usize)) {
    let payload = std::fs::read(folder.join("resources/model.hyd")).expect("the payload of an unpacked unit");
    let model = format::read(&payload, true).expect("a payload");
    let mut system = Loaded::new(model, Backend::Native).map(Arc::new).expect("loaded").instantiate();
    let mut own = Exchange::new(system.structure(), system.is_affine());
    own.begin(&mut system, (0.0, Some(STOP)), TOLERANCE).expect("a start");
    own.event(&mut system).expect("settled");
    let before = *own.statistics();
    let (asked, solved) = walk(&mut own, &mut system, steps);
    let calls = asked.len() as f64;
    let a_call = |count: u64, before: u64| (count - before) as f64 / calls;
    let statistics = own.statistics();
    println!(
        "{}: {} states, {calls} calls of rates, for each {:.2} residuals and {:.2} matrices",
        system.tables().model,
        own.states(),
        a_call(statistics.residuals, before.residuals),
        a_call(statistics.factorisations, before.factorisations)
    );

    let mut out = vec![0.0; system.structure().unknowns];
    let mut residuals = |solved: &[Solved]| solved.iter().for_each(|(t, y, yp)| system.residual(*t, y, yp, &mut out));
    let unit = Unit::new(folder);
    // In turns, because the rate of a machine that others share drifts.
    let mut least = [f64::INFINITY; 5];
    for _ in 0..ROUNDS {
        let mut completed = 0.0;
        let rounds = [
            seconds(|| residuals(&solved)),
            seconds(|| asked.iter().for_each(|own| unit.set(own))),
            seconds(|| completed = asked.iter().map(|own| unit.ask(own)).sum()),
            completed,
            seconds(|| {
                (0..steps.1).for_each(|_| {
                    std::hint::black_box(Instant::now().elapsed());
                })
            }),
        ];
        least.iter_mut().zip(rounds).for_each(|(least, own)| *least = least.min(own));
    }
    let [residual, set, all, completed, clock] = least.map(|seconds| 1e9 * seconds);
    // The clock costs as much as some of what it is to time; half of that lies between its two readings.
    let rates = all - set - completed - clock / 2.0;
    println!("  one residual {:.0} ns; time and states set {:.0} ns", residual / calls, set / calls);
    println!("  rates {:.0} ns, {:.2} residuals", rates / calls, rates / residual);
    println!("  a step completed {:.0} ns", (completed - clock / 2.0) / steps.1 as f64);
    in_a_row(&unit, &mut system, &solved[0], steps);
}

/// Steps of which each waits for the rates of the one before.
fn in_a_row(unit: &Unit, system: &mut Instance, start: &Solved, steps: (f64, usize)) {
    let y = &start.1;
    let n = y.len();
    let Some(places) = rows_of_rates(system, start) else { return };
    let (mut at, zeros, mut residual) = (y.clone(), vec![0.0; n], vec![0.0; n]);
    let mut least = [f64::INFINITY; 2];
    let mut ends = [0.0; 2];
    for _ in 0..ROUNDS {
        let rounds = [
            seconds(|| ends[0] = runge_kutta(y, steps, |t, x, out| unit.rates(t, x, out))),
            seconds(|| {
                ends[1] = runge_kutta(y, steps, |t, x, out| {
                    at.copy_from_slice(x);
                    system.residual(t, &at, &zeros, &mut residual);
                    for (rate, &(row, factor)) in out.iter_mut().zip(&places) {
                        *rate = -residual[row] * factor;
                    }
                });
            }),
        ];
        least.iter_mut().zip(rounds).for_each(|(least, own)| *least = least.min(own));
    }
    assert!((ends[0] - ends[1]).abs() <= 1e-9 * ends[0].abs(), "{ends:?}");
    let [by_unit, by_residual] = least.map(|seconds| 1e9 * seconds / (4 * steps.1) as f64);
    println!(
        "  one after the other: rates by the unit {by_unit:.0} ns, by the residual {by_residual:.0} ns, {:.2} times",
        by_unit / by_residual
    );
}

/// For each rate the row of the residual that says it explicitly, and one over its factor; none where the system is not of that kind.
fn rows_of_rates(system: &mut Instance, (t, y, _): &Solved) -> Option<Vec<(usize, f64)>> {
    let n = y.len();
    if !system.structure().differential.iter().all(|&differential| differential) {
        return None;
    }
    let mut yp = vec![0.0; n];
    let (mut before, mut after) = (vec![0.0; n], vec![0.0; n]);
    system.residual(*t, y, &yp, &mut before);
    let mut places = Vec::new();
    for k in 0..n {
        // Far above everything else in its row, so that the difference has all digits.
        yp[k] = FAR;
        system.residual(*t, y, &yp, &mut after);
        yp[k] = 0.0;
        let changed: Vec<usize> = (0..n).filter(|&row| before[row].to_bits() != after[row].to_bits()).collect();
        let &[row] = changed.as_slice() else { return None };
        places.push((row, FAR / (after[row] - before[row])));
    }
    Some(places)
}

/// Classical Runge-Kutta steps from the time 0; the sum of the last point.
#[inline(always)]
fn runge_kutta(start: &[f64], (h, steps): (f64, usize), mut rates: impl FnMut(f64, &[f64], &mut [f64])) -> f64 {
    let n = start.len();
    let (mut x, mut trial) = (start.to_vec(), start.to_vec());
    let mut k = [const { [0.0; MOST_STATES] }; 4];
    for step in 0..steps {
        let t = h * step as f64;
        for stage in 0..4 {
            let part = [0.0, 0.5, 0.5, 1.0][stage] * h;
            for i in 0..n {
                trial[i] = if stage == 0 { x[i] } else { x[i] + part * k[stage - 1][i] };
            }
            rates(t + part, &trial, &mut k[stage][..n]);
        }
        for i in 0..n {
            x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
        }
    }
    x.iter().sum()
}

fn seconds(work: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    work();
    begin.elapsed().as_secs_f64()
}

/// Runge-Kutta steps: all points that they ask for, and what is found there.
fn walk(own: &mut Exchange, system: &mut Instance, (h, steps): (f64, usize)) -> (Vec<Asked>, Vec<Solved>) {
    let n = own.states();
    let (mut asked, mut solved) = (Vec::new(), Vec::new());
    let mut x = vec![0.0; n];
    own.get_states(&mut x);
    let mut rates = |t: f64, x: Vec<f64>, accepted: bool| {
        let mut out = vec![0.0; n];
        own.set_time(t);
        own.set_states(&x);
        own.derivatives(system, &mut out).expect("rates");
        if accepted {
            own.accept(system).expect("accepted");
        }
        let (y, yp) = own.point();
        solved.push((t, y.to_vec(), yp.to_vec()));
        asked.push(Asked { t, x, accepted });
        out
    };
    let along = |x: &[f64], h: f64, k: &[f64]| x.iter().zip(k).map(|(x, k)| x + h * k).collect::<Vec<f64>>();
    for step in 0..steps {
        let t = h * step as f64;
        let a = rates(t, x.clone(), true);
        let b = rates(t + h / 2.0, along(&x, h / 2.0, &a), false);
        let c = rates(t + h / 2.0, along(&x, h / 2.0, &b), false);
        let d = rates(t + h, along(&x, h, &c), false);
        for k in 0..n {
            x[k] += h / 6.0 * (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]);
        }
    }
    (asked, solved)
}

/// A unit for model exchange between events.
struct Unit(*mut c_void);

impl Unit {
    fn new(folder: &Path) -> Self {
        let description = std::fs::read_to_string(folder.join("modelDescription.xml")).expect("a description");
        let token = description.split("instantiationToken=\"").nth(1).and_then(|rest| rest.split('"').next());
        let text = |text: &str| CString::new(text).expect("a text");
        let token = text(token.expect("a unit of version 3.0"));
        let place = text(&folder.join("resources").display().to_string());
        let (name, nowhere) = (CString::default(), std::ptr::null_mut());
        let unit = fmi3::fmi3InstantiateModelExchange(
            name.as_ptr(),
            token.as_ptr(),
            place.as_ptr(),
            false,
            false,
            nowhere,
            None,
        );
        assert!(!unit.is_null());
        assert_eq!(fmi3::fmi3EnterInitializationMode(unit, true, TOLERANCE, 0.0, true, STOP), 0);
        assert_eq!(fmi3::fmi3ExitInitializationMode(unit), 0);
        let none = std::ptr::null_mut();
        assert_eq!(fmi3::fmi3UpdateDiscreteStates(unit, none, none, none, none, none, std::ptr::null_mut()), 0);
        assert_eq!(fmi3::fmi3EnterContinuousTimeMode(unit), 0);
        Self(unit)
    }

    #[inline(always)]
    fn set(&self, own: &Asked) {
        fmi3::fmi3SetTime(self.0, own.t);
        fmi3::fmi3SetContinuousStates(self.0, own.x.as_ptr(), own.x.len());
    }

    #[inline(always)]
    fn rates(&self, t: f64, x: &[f64], out: &mut [f64]) {
        fmi3::fmi3SetTime(self.0, t);
        fmi3::fmi3SetContinuousStates(self.0, x.as_ptr(), x.len());
        assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(self.0, out.as_mut_ptr(), out.len()), 0);
    }

    /// Sets a point, asks for its rates, and completes the step where one ends; the seconds of the last part.
    #[inline(always)]
    fn ask(&self, own: &Asked) -> f64 {
        let mut rates = [std::mem::MaybeUninit::<f64>::uninit(); MOST_STATES];
        self.set(own);
        let status = fmi3::fmi3GetContinuousStateDerivatives(self.0, rates.as_mut_ptr().cast(), own.x.len());
        assert_eq!(status, 0);
        if !own.accepted {
            return 0.0;
        }
        let (mut event, mut end) = (false, false);
        let mut status = 0;
        let completed = seconds(|| status = fmi3::fmi3CompletedIntegratorStep(self.0, true, &mut event, &mut end));
        assert_eq!(status, 0);
        completed
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        fmi3::fmi3FreeInstance(self.0);
    }
}
