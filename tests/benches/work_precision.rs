//! Digits reached against tolerance on the reference problems: prints the table of `docs/performance.md`.
//!
//! Run with `cargo bench -p hyd-tests --bench work_precision`.  Per problem and tolerance: significant correct digits of the worst
//! variable at the end, accepted steps and CPU milliseconds of the run; last the slope of a straight line through the digits over those of
//! the tolerance.

use hyd_tests::numerics::problems;

const TOLERANCES: [f64; 8] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];

fn main() {
    println!("\n## Reference problems: digits / steps / CPU ms\n");
    let head: Vec<String> = TOLERANCES.iter().map(|tolerance| format!("{tolerance:.0e}")).collect();
    println!(
        "| problem | unknowns | {} | slope |\n|---|---:|{}",
        head.join(" | "),
        "---:|".repeat(TOLERANCES.len() + 1)
    );
    for problem in problems() {
        let Ok(compilation) = problem.translate() else {
            println!("| {} | not translated |", problem.name);
            continue;
        };
        let unknowns = compilation.sorted.as_ref().map_or(0, |sorted| sorted.simulation.unknowns.len());
        let runs: Vec<_> = TOLERANCES.iter().map(|&tolerance| problem.run(&compilation, tolerance)).collect();
        let cells = runs.iter().map(|run| match run {
            Ok(run) => format!("{:.1} / {} / {:.1}", run.digits, run.statistics.steps, 1e3 * run.seconds),
            Err(_) => "fails".to_string(),
        });
        let cells = cells.collect::<Vec<_>>().join(" | ");
        let points = TOLERANCES
            .iter()
            .zip(&runs)
            .filter_map(|(tolerance, run)| Some((-tolerance.log10(), run.as_ref().ok()?.digits)));
        let slope = slope(&points.collect::<Vec<_>>());
        println!("| {} | {unknowns} | {cells} | {slope:.2} |", problem.name.replace('_', " "));
    }
}

/// Slope of the line of least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (up, across) =
        points.iter().fold((0.0, 0.0), |(up, across), p| (up + (p.0 - x) * (p.1 - y), across + (p.0 - x).powi(2)));
    up / across
}
