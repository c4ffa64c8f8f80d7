//! What sensitivities of the drive to ten parameters cost, and how exact they are: prints a table, from which
//! `docs/sensitivities.md` quotes.
//!
//! Run with `cargo bench -p hyd-tests --bench sensitivities`.  Times are CPU seconds of the process, medians over alternating
//! runs with and without derivatives.  Deviations are those of the states' derivatives from a run at a tolerance of 1e-11, at
//! 501 instants, as a part of the range of each: the largest, and the one that 99 of 100 values keep to.

use std::path::Path;

use hyd::LibraryPath;
use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Instance, compile};
use hyd_results::Trajectory;
use hyd_runtime::{Options, Simulator};
use hyd_system::DaeSystem;
use hyd_tests::models::{root, text_of};
use hyd_tests::runs::on_grid;

const DRIVE: &str = "models/single_acting_drive/drive.hyd";
const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
const REFERENCE: f64 = 1e-11;
const REPEATS: usize = 15;

/// Parameters of the drive whose derivatives are timed.
const VARIED: [&str; 10] = [
    "p0",
    "C",
    "ro.rlc.r_fw.R",
    "ro.rlc.r.R",
    "ro.su.mass.m",
    "ro.su.spring.F_0",
    "hy.qz.mu",
    "sh.mass.m",
    "sh.stop.k",
    "sh.piston.p_b",
];

fn main() {
    println!("\n## Sensitivities of the drive to ten parameters\n");
    println!(
        "| tolerance | steps | of the sensitivities | plain, CPU ms | with, CPU ms | ratio | 99 % within | largest deviation |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    let compilation = translate(DRIVE);
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    let names: Vec<String> = VARIED.iter().map(|name| name.to_string()).collect();
    let mut simulator = Simulator::new(system.structure());
    let reference = run(&mut simulator, &mut system, &with(REFERENCE, &names)).0;
    for tolerance in TOLERANCES {
        let options = [Options { event_rows: false, ..on_grid(0.05, 500, tolerance) }, with(tolerance, &names)];
        let mut seconds = [Vec::new(), Vec::new()];
        let mut last = None;
        for _ in 0..REPEATS {
            for (options, seconds) in options.iter().zip(&mut seconds) {
                let start = cpu_seconds();
                let result = run(&mut simulator, &mut system, options);
                seconds.push(cpu_seconds() - start);
                last = Some(result);
            }
        }
        let (rows, steps, own) = last.expect("at least one run");
        let [plain, with] = seconds.map(median);
        let (most, worst) = deviations(&rows, &reference, &names);
        println!(
            "| {tolerance:.0e} | {steps} | {own} | {:.2} | {:.2} | {:.1} | {most:.1e} | {worst:.1e} |",
            1e3 * plain,
            1e3 * with,
            with / plain
        );
    }
}

fn with(tolerance: f64, names: &[String]) -> Options {
    Options { sensitivity: names.to_vec(), event_rows: false, ..on_grid(0.05, 500, tolerance) }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn translate(file: &str) -> Compilation {
    let text = text_of(file);
    let mut library = LibraryPath::new();
    library.add_main_file(&root().join(Path::new(file)), &text);
    let options = hyd_compiler::Options { model: None, set: Vec::new(), goal: Goal::Run, clock: cpu_seconds };
    compile(&mut library, file, &text, &options)
}

/// Rows, steps of the solution and of the sensitivities.
fn run(simulator: &mut Simulator, system: &mut Instance, options: &Options) -> (Trajectory, u64, u64) {
    let mut rows = Trajectory::new();
    let summary = simulator.run(system, options, &mut rows, &|| false).expect("the drive runs");
    (rows, summary.statistics.steps, summary.statistics.sensitivity_steps)
}

/// Deviation that 99 of 100 values keep to, and the largest.
fn deviations(rows: &Trajectory, reference: &Trajectory, names: &[String]) -> (f64, f64) {
    let tables = rows.tables();
    let mut all = Vec::new();
    for k in 0..tables.unknowns.len() {
        for name in names {
            let name = format!("d({})/d({name})", tables.unknown_name(k));
            let (Some(found), Some(exact)) = (rows.series(&name), reference.series(&name)) else { continue };
            let (found, exact) = (found.values(), exact.values());
            let range = exact.iter().fold((0.0f64, 0.0f64), |(low, high), &v| (low.min(v), high.max(v)));
            let range = range.1 - range.0;
            if range > 0.0 {
                all.extend(found.iter().zip(&exact).map(|(a, b)| (a - b).abs() / range));
            }
        }
    }
    all.sort_by(f64::total_cmp);
    (all[all.len() * 99 / 100], all[all.len() - 1])
}
