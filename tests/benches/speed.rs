//! Translation and simulation of the models in the repository, with counters: prints the tables of `docs/performance.md`.
//!
//! Run with `cargo bench -p hyd-tests --bench speed`.  Times are CPU seconds of the process, medians over repeated runs.
//! The error of the drive is the largest difference from the stored reference solution over all samples.

use std::path::Path;

use hyd::LibraryPath;
use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_results::Trajectory;
use hyd_runtime::{Summary, simulate};
use hyd_system::DaeSystem;
use hyd_tests::models::{root, text_of};
use hyd_tests::reference::Reference;
use hyd_tests::runs::on_grid;

const DRIVE: &str = "models/single_acting_drive/drive.hyd";
const LINE: &str = "models/hydraulic_line/line.hyd";

fn main() {
    drive_translation();
    drive_simulation();
    drive_sensitivities();
    line();
    equations();
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn translate(file: &str, set: &[(&str, &str)]) -> Compilation {
    let text = text_of(file);
    let mut library = LibraryPath::new();
    library.add_main_file(&root().join(Path::new(file)), &text);
    let set = set.iter().map(|&(name, value)| (name.to_string(), value.to_string())).collect();
    compile(&mut library, file, &text, &Options { model: None, set, goal: Goal::Run, clock: cpu_seconds })
}

/// Seconds per stage, in order.
fn drive_translation() {
    let runs: Vec<Compilation> = (0..21).map(|_| translate(DRIVE, &[])).collect();
    println!("\n## Translation of the drive\n\n| stage | ms |\n|---|---:|");
    let mut total = 0.0;
    for (k, stage) in runs[0].times.iter().enumerate() {
        let seconds = median(runs.iter().map(|run| run.times[k].seconds).collect());
        total += seconds;
        println!("| {} | {:.2} |", stage.name, 1e3 * seconds);
    }
    println!("| **all** | **{:.1}** |", 1e3 * total);
}

fn drive_simulation() {
    println!("\n## Simulation of the drive\n");
    println!(
        "| tolerance | steps | rejected | residuals | Jacobians | factorisations | CPU ms | error y [m] | error p_R [Pa] |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    let reference = Reference::read("drive_nominal_10MPa");
    let compilation = translate(DRIVE, &[]);
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let options = on_grid(reference.stop(), reference.intervals(), tolerance);
        let mut times = Vec::new();
        let mut last = None;
        for _ in 0..21 {
            let mut rows = Trajectory::new();
            let start = cpu_seconds();
            let summary = simulate(&mut system, &options, &mut rows, &|| false).expect("the drive runs");
            times.push(cpu_seconds() - start);
            last = Some((rows, summary));
        }
        let (rows, summary): (Trajectory, Summary) = last.expect("ran");
        let error = |variable: &str, column: &str| {
            let values = rows.series(variable).expect("recorded").values();
            let pairs = values.iter().zip(reference.column(column));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let s = summary.statistics;
        println!(
            "| {tolerance:.0e} | {} | {} | {} | {} | {} | {:.2} | {:.1e} | {:.1e} |",
            s.steps,
            s.error_rejections,
            s.residuals,
            s.jacobians,
            s.factorisations,
            1e3 * median(times),
            error("y", "y_m"),
            error("p_R", "pR_Pa"),
        );
    }
}

/// Ten parameters, each from another part of the drive.
const VARIED: [&str; 10] = [
    "p0",
    "ro.rlc.U0",
    "ro.rlc.C",
    "ro.rlc.r.R",
    "ro.su.mass.m",
    "ro.su.spring.F_0",
    "hy.qz.mu",
    "sh.mass.m",
    "sh.stop.k",
    "sh.piston.p_b",
];

/// What sensitivities cost, in runs without.
fn drive_sensitivities() {
    println!("\n## Sensitivities of the drive to ten parameters\n");
    println!(
        "| tolerance | steps | steps of the sensitivities | plain run, CPU ms | with sensitivities, CPU ms | ratio |"
    );
    println!("|---|---:|---:|---:|---:|---:|");
    let compilation = translate(DRIVE, &[]);
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    let known = |name: &&str| system.tables().find(name).is_some();
    let names: Vec<String> = VARIED.iter().filter(|name| known(name)).map(|name| name.to_string()).collect();
    assert_eq!(names.len(), VARIED.len(), "parameters of the drive: {names:?}");
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let plain = on_grid(0.05, 500, tolerance);
        let mut seconds = [Vec::new(), Vec::new()];
        let mut steps = (0, 0);
        let with = hyd_runtime::Options { sensitivity: names.clone(), ..plain.clone() };
        let mut simulator = hyd_runtime::Simulator::new(system.structure());
        for _ in 0..11 {
            for (options, seconds) in [&plain, &with].into_iter().zip(&mut seconds) {
                let mut rows = Trajectory::new();
                let start = cpu_seconds();
                let summary = simulator.run(&mut system, options, &mut rows, &|| false).expect("the drive runs");
                seconds.push(cpu_seconds() - start);
                steps = (summary.statistics.steps, summary.statistics.sensitivity_steps);
            }
        }
        let [plain, with] = seconds.map(median);
        let ratio = with / plain;
        println!(
            "| {tolerance:.0e} | {} | {} | {:.2} | {:.2} | {ratio:.1} |",
            steps.0,
            steps.1,
            1e3 * plain,
            1e3 * with
        );
    }
}

/// A line of N cells: what grows with N and what does not.
fn line() {
    println!("\n## A line of N cells\n");
    println!("| N | states | templates | bytes of code | translation s | 1 ms simulated, CPU s | steps |");
    println!("|---:|---:|---:|---:|---:|---:|---:|");
    for cells in [1_000, 10_000, 100_000] {
        let start = cpu_seconds();
        let compilation = translate(LINE, &[("N", &cells.to_string())]);
        let translation = cpu_seconds() - start;
        let model = compilation.model.as_ref().expect("translated");
        let statistics = model.statistics();
        let mut system = model.instantiate();
        let mut rows = Trajectory::new();
        let start = cpu_seconds();
        let summary = simulate(&mut system, &on_grid(1e-3, 10, 1e-6), &mut rows, &|| false).expect("the line runs");
        println!(
            "| {cells} | {} | {} | {} | {translation:.2} | {:.2} | {} |",
            2 * cells,
            statistics.templates,
            statistics.code_bytes,
            cpu_seconds() - start,
            summary.statistics.steps,
        );
    }
}

/// Time that one equation of the line takes in a residual and in a Jacobian.
fn equations() {
    println!("\n## Equations of the line\n");
    println!("| N | residual, ns per equation | Jacobian, ns per equation |\n|---:|---:|---:|");
    for cells in [100, 1_000, 10_000] {
        let compilation = translate(LINE, &[("N", &cells.to_string())]);
        let mut system = compilation.model.as_ref().expect("translated").instantiate();
        system.bind(0.0).expect("parameters with values");
        let structure = system.structure();
        let n = structure.differential.len();
        let (states, rates) = (structure.state_pattern.entries(), structure.rate_pattern.entries());
        let mut y = vec![0.0; n];
        system.nominals(&mut y);
        let (yp, mut out) = (vec![0.0; n], vec![0.0; n]);
        let (mut state, mut rate) = (vec![0.0; states], vec![0.0; rates]);
        let rounds = 20_000_000 / n;
        let per_equation = |seconds: f64| 1e9 * seconds / (rounds * n) as f64;
        let start = cpu_seconds();
        (0..rounds).for_each(|_| system.residual(1e-3, &y, &yp, &mut out));
        let residual = per_equation(cpu_seconds() - start);
        let start = cpu_seconds();
        (0..rounds).for_each(|_| system.jacobian(1e-3, &y, &yp, &mut state, &mut rate));
        let jacobian = per_equation(cpu_seconds() - start);
        println!("| {cells} | {residual:.2} | {jacobian:.2} |");
    }
}
