//! Random draws of all real parameters of the valve drive within a factor of two: every run ends at its time or says why not.
//!
//! `cargo bench -p hyd-tests --bench robustness -- [N] [TOLERANCE] [SEED]` (default 300, 1e-6, 1).  Parameters are drawn as value
//! times `2^u` with u uniform in -1..1.  Prints how many runs ended how, the first message of each kind, the air gap that is left where
//! the spool meets its stop, and the steps of the longest run.  Exits with 1 if a run took more steps than the limit, which stands for
//! hanging.

use std::collections::BTreeMap;
use std::process::ExitCode;

use hyd::clock::cpu_seconds;
use hyd_results::Discard;
use hyd_runtime::{Options, Simulator, SolveError};
use hyd_system::{DaeSystem, Place, Settable, ValueKind};
use hyd_tests::runs::{instance, on_grid, translated};

/// Far more steps than any of these runs needs.
const MOST_STEPS: u64 = 2_000_000;

/// Marsaglia's xorshift (2003), uniform in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let number = |k: usize, default: f64| arguments.get(k).map_or(default, |text| text.parse().expect("a number"));
    let (runs, tolerance, seed) = (number(0, 300.0) as usize, number(1, 1e-6), number(2, 1.0) as u64);
    let compilation = translated("models/single_acting_drive/drive.hyd", &[]);
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).max(1));
    let mut simulator = Simulator::new(instance(&compilation, &[]).structure());
    let options = Options { max_steps: MOST_STEPS, ..on_grid(0.05, 500, tolerance) };
    let mut outcomes: BTreeMap<&'static str, (String, Vec<f64>)> = BTreeMap::new();
    let (mut longest, mut slowest) = (0, 0.0f64);
    for _ in 0..runs {
        let mut system = instance(&compilation, &[]);
        let drawn = draw(&mut system, &mut random);
        let begin = cpu_seconds();
        let outcome = simulator.run(&mut system, &options, &mut Discard, &|| false);
        slowest = slowest.max(cpu_seconds() - begin);
        longest = longest.max(simulator.statistics().steps);
        let text = outcome.as_ref().err().map_or_else(String::new, ToString::to_string);
        let entry = outcomes.entry(kind(outcome.err())).or_insert((text, Vec::new()));
        entry.1.push(gap_at_stop(&system));
        assert!(drawn > 0, "the drive has parameters");
    }
    println!("{runs} runs at {tolerance:e}: longest {longest} steps, slowest {slowest:.3} s of CPU time");
    for (kind, (text, gaps)) in &mut outcomes {
        gaps.sort_by(f64::total_cmp);
        let (count, closed) = (gaps.len(), gaps.iter().filter(|gap| **gap <= 0.0).count());
        let [first, last] = [gaps[0], gaps[count - 1]].map(|gap| 1e3 * gap);
        println!("{count:6} {kind}: gap at the stop {first:.3} to {last:.3} mm, closed before it in {closed}");
        text.lines().for_each(|line| println!("         {line}"));
    }
    if outcomes.contains_key("too many steps") { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

/// Multiplies every real parameter that can be set; gives their number.
fn draw(system: &mut dyn DaeSystem, random: &mut Random) -> usize {
    let _ = system.bind(0.0);
    let tables = system.tables().clone();
    let values = system.parameters().to_vec();
    let mut drawn = 0;
    for info in tables.variables.iter().filter(|v| v.settable == Settable::Yes && v.kind == ValueKind::Real) {
        for source in &info.sources {
            let Place::Parameter(index) = source.place else { continue };
            let value = values[index as usize] * 2f64.powf(2.0 * random.next() - 1.0);
            drawn += usize::from(system.set_parameter(index as usize, value).is_ok());
        }
    }
    drawn
}

/// What is left of the gap of the magnetic circuit, its iron included, where the spool meets its stop (m).
fn gap_at_stop(system: &dyn DaeSystem) -> f64 {
    let value = |name: &str| {
        let (info, element) = system.tables().find(name).expect("a parameter of the drive");
        let Place::Parameter(index) = info.sources[element].place else { panic!("{name} is not a parameter") };
        system.parameters()[index as usize]
    };
    value("ro.lc.B_e") + value("ro.lc.x_0") + value("ro.lc.x_mks") - value("ro.su.stop.s_stop")
}

fn kind(error: Option<SolveError>) -> &'static str {
    match error {
        None => "done",
        Some(SolveError::Option(_)) => "option",
        Some(SolveError::Evaluation { .. }) => "evaluation failed",
        Some(SolveError::Initial { .. }) => "no initial values",
        Some(SolveError::Inconsistent { .. }) => "no consistent values",
        Some(SolveError::StepTooSmall(_)) => "step too small",
        Some(SolveError::NoConvergence(_)) => "no convergence",
        Some(SolveError::NotFinite(_)) => "not finite",
        Some(SolveError::Singular(_)) => "singular",
        Some(SolveError::EventLoop { .. }) => "event loop",
        Some(SolveError::Chattering { .. }) => "chattering",
        Some(SolveError::Assertion { .. }) => "assertion",
        Some(SolveError::TooManySteps { .. }) => "too many steps",
        Some(_) => "other",
    }
}
