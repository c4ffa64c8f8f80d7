//! Digits reached against tolerance on the reference problems: prints the table of `docs/performance.md`.
//!
//! Run with `cargo bench -p hyd-tests --bench work_precision`.  Per problem and tolerance: significant correct digits
//! of the worst variable at the end, accepted steps and CPU milliseconds of the run; last the slope of a straight line
//! through the digits over those of the tolerance.  With `-- --best NAME...` those problems only, at 1e-4 to 1e-8, a
//! line each: name, tolerance, CPU seconds of the best of several runs, steps, error.

use hyd_tests::numerics::problems;

const TOLERANCES: [f64; 8] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];

/// Runs of which the best counts, and the CPU time after which no more are made (s).
const REPEATS: usize = 50;
const ENOUGH: f64 = 1.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if let Some(("--best", names)) = arguments.split_first().map(|(first, names)| (first.as_str(), names)) {
        return best(names);
    }
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

fn best(names: &[String]) {
    for problem in problems().iter().filter(|problem| names.contains(&problem.name)) {
        let compilation = problem.translate().expect("translated");
        for tolerance in &TOLERANCES[1..6] {
            let (mut best, mut spent, mut runs, mut last) = (f64::MAX, 0.0, 0, None);
            while runs < REPEATS && spent < ENOUGH {
                let run = problem.run(&compilation, *tolerance).expect("the problem runs");
                (best, spent, runs) = (run.seconds.min(best), spent + run.seconds, runs + 1);
                last = Some((run.statistics.steps, 10f64.powf(-run.digits)));
            }
            let (steps, error) = last.expect("at least one run");
            println!("{} {tolerance:e} {best:.9} {steps} {error:e}", problem.name);
        }
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
