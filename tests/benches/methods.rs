//! Work and error of the integration methods on models of the repository.
//!
//! `cargo bench -p hyd-tests --bench methods -- [MODEL] [TOLERANCE] [METHOD] [CELLS]`: model `drive`, `scaled` (the drive that peers run, too), `line` or `all`, method `bdf`,
//! `esdirk`, `auto` or `all`.  One line per run: CPU seconds (best of several), counters, error.  The error is the largest
//! difference from a run of the other method at 1e-11 over 100 points, divided by the largest value, worst of the variables shown.

use hyd::clock::cpu_seconds;
use hyd_results::Trajectory;
use hyd_runtime::{MethodPhase, Options, Simulator, Solver};
use hyd_system::DaeSystem;
use hyd_tests::runs::{instance, on_grid, translated};

/// A model with what is compared.
struct Case {
    name: &'static str,
    file: &'static str,
    stop: f64,
    variables: &'static [&'static str],
}

const CASES: [Case; 3] = [
    Case {
        name: "drive",
        file: "models/single_acting_drive/drive.hyd",
        stop: 0.05,
        variables: &["x", "v", "y", "w", "p_R", "i"],
    },
    Case {
        name: "scaled",
        file: "benchmarks/peers/models/drive.hyd",
        stop: 0.08,
        variables: &["x", "v", "p", "y", "w", "i"],
    },
    Case { name: "line", file: "models/hydraulic_line/line.hyd", stop: 0.1, variables: &["q[1]", "p_end"] },
];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let get = |k: usize, default: &str| arguments.get(k).cloned().unwrap_or_else(|| default.to_string());
    let (model, tolerance, method, cells) = (get(0, "all"), get(1, "all"), get(2, "all"), get(3, "1000"));
    let tolerances: Vec<f64> = match tolerance.as_str() {
        "all" => vec![1e-4, 1e-6, 1e-8],
        text => text.split(',').map(|t| t.parse().expect("a tolerance")).collect(),
    };
    for case in CASES.iter().filter(|case| model == "all" || model == case.name) {
        let set: Vec<(&str, &str)> = if case.name == "line" { vec![("N", cells.as_str())] } else { Vec::new() };
        let compilation = translated(case.file, &set);
        let mut system = instance(&compilation, &set);
        let mut reference = Vec::new();
        for (name, solver) in [("bdf", Solver::Bdf), ("esdirk", Solver::Esdirk), ("auto", Solver::Auto)] {
            if method != "all" && method != name {
                continue;
            }
            for &tolerance in &tolerances {
                if reference.is_empty() {
                    let options = Options { solver: Solver::Esdirk, max_step: None, ..on_grid(case.stop, 100, 1e-11) };
                    reference = run(&mut system, &options, case).0;
                }
                let options = Options { solver, ..on_grid(case.stop, 100, tolerance) };
                report(case.name, name, tolerance, run(&mut system, &options, case), &reference);
            }
        }
    }
}

type Outcome = (Vec<Vec<f64>>, f64, hyd_runtime::Statistics, Vec<MethodPhase>);

fn run(system: &mut dyn DaeSystem, options: &Options, case: &Case) -> Outcome {
    let mut simulator = Simulator::new(system.structure());
    let (mut best, mut spent, mut repeats) = (f64::INFINITY, 0.0, 0);
    let mut rows = Trajectory::new();
    while repeats == 0 || (spent < 0.3 && repeats < 20) {
        let start = cpu_seconds();
        simulator.run(system, options, &mut rows, &|| false).unwrap_or_else(|error| panic!("{error}"));
        let seconds = cpu_seconds() - start;
        best = best.min(seconds);
        spent += seconds;
        repeats += 1;
    }
    let series = case.variables.iter().map(|name| rows.series(name).expect("recorded").values()).collect();
    (series, best, *simulator.statistics(), simulator.phases().to_vec())
}

fn report(case: &str, method: &str, tolerance: f64, (series, seconds, s, phases): Outcome, reference: &[Vec<f64>]) {
    let error = |(ours, exact): (&Vec<f64>, &Vec<f64>)| {
        let size = exact.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        ours.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
    };
    let errors: Vec<String> = series.iter().zip(reference).map(|pair| format!("{:.0e}", error(pair))).collect();
    let [a, b, c, d, e] = s.steps_by_order;
    println!(
        "{case:6} {method:6} {tolerance:.0e} {:9.3} ms  steps {} ({a} {b} {c} {d} {e} | {}) rej {} fail {} res {} newton {} fact {} events {}+{}  err {}",
        1e3 * seconds,
        s.steps,
        s.one_step_steps,
        s.error_rejections,
        s.convergence_failures,
        s.residuals,
        s.newton_iterations,
        s.factorisations,
        s.state_events,
        s.time_events,
        errors.join(" "),
    );
    for phase in phases.iter().skip(1) {
        println!("       from {:.5} s {}: {}", phase.from, phase.method.name(), phase.reason);
    }
}
