//! Digits reached against tolerance on the reference problems: prints the table of `docs/performance.md`.
//!
//! Run with `cargo bench -p hyd-tests --bench work_precision`.  Per problem and tolerance: significant correct digits of the worst
//! variable at the end, accepted steps and CPU milliseconds of the run.

use hyd_tests::numerics::problems;

const TOLERANCES: [f64; 8] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];

fn main() {
    println!("\n## Reference problems: digits / steps / CPU ms\n");
    let head: Vec<String> = TOLERANCES.iter().map(|tolerance| format!("{tolerance:.0e}")).collect();
    println!("| problem | unknowns | {} |\n|---|---:|{}", head.join(" | "), "---:|".repeat(TOLERANCES.len()));
    for problem in problems() {
        let Ok(compilation) = problem.translate() else {
            println!("| {} | not translated |", problem.name);
            continue;
        };
        let unknowns = compilation.sorted.as_ref().map_or(0, |sorted| sorted.simulation.unknowns.len());
        let cells = TOLERANCES.iter().map(|&tolerance| match problem.run(&compilation, tolerance) {
            Ok(run) => format!("{:.1} / {} / {:.1}", run.digits, run.statistics.steps, 1e3 * run.seconds),
            Err(_) => "fails".to_string(),
        });
        println!("| {} | {unknowns} | {} |", problem.name.replace('_', " "), cells.collect::<Vec<_>>().join(" | "));
    }
}
