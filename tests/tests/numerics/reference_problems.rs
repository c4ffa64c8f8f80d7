//! Reference problems reach the digits that the tolerance promises, and more digits at a tighter one.
//!
//! The promise is `-log10(tolerance) - 2` significant digits of the worst variable.  Where the problem itself costs more, the measure
//! is a program by others with the same kind of formulas, SciPy's BDF: not fewer digits than that but for a quarter of a digit.  Where steps
//! happen to fall moves the digits of a single run by up to one; of both programs the median over five tolerances within two percent counts.  The problems are data (`tests/numerics`); a problem that fails says why under
//! `open` and is checked to fail still.

use hyd_tests::numerics::{MOST_DIGITS, Problem, problems};

const TOLERANCES: [(f64, f64); 3] = [(1e-4, 4.0), (1e-6, 6.0), (1e-8, 8.0)];

/// What is left of chance in medians.
const CHANCE: f64 = 0.25;

/// Error accumulates over a run: so many digits less than the tolerance of one step are promised everywhere.
const ACCUMULATED: f64 = 2.0;

#[test]
fn published_values_are_reached() {
    let problems = problems();
    assert!(problems.len() >= 17, "problems are missing");
    let mut report = String::new();
    for problem in &problems {
        match (fault(problem), &problem.open) {
            (None, None) => {}
            (Some(fault), Some(reason)) => println!("{}: still open ({reason}): {fault}", problem.name),
            (None, Some(_)) => report += &format!("{}: reached now; take `open` out of its data\n", problem.name),
            (Some(fault), None) => report += &format!("{}: {fault}\n", problem.name),
        }
    }
    assert!(report.is_empty(), "\n{report}");
}

fn fault(problem: &Problem) -> Option<String> {
    let compilation = match problem.translate() {
        Ok(compilation) => compilation,
        Err(message) => return Some(message),
    };
    let mut reached = Vec::new();
    for (k, (tolerance, promised)) in TOLERANCES.into_iter().enumerate() {
        match problem.median(&compilation, tolerance) {
            Ok(outcome) => {
                println!("{:24} {tolerance:.0e} {:6.2} digits ({})", problem.name, outcome.digits, outcome.worst);
                let others = problem.others.as_ref().map_or(f64::INFINITY, |digits| digits[k] - CHANCE);
                let promised = (promised - ACCUMULATED).min(MOST_DIGITS).min(others);
                reached.push((tolerance, promised, outcome.digits));
            }
            Err(message) => return Some(format!("at {tolerance:.0e}: {message}")),
        }
    }
    if let Some((tolerance, promised, digits)) = reached.iter().find(|(_, promised, digits)| digits < promised) {
        return Some(format!("{digits:.2} digits at {tolerance:.0e}, {promised:.2} are promised"));
    }
    let pairs = reached.windows(2).map(|pair| (pair[0], pair[1]));
    let stuck = pairs.into_iter().find(|(before, after)| after.2 <= before.2 && before.2 < MOST_DIGITS);
    stuck.map(|(before, after)| format!("no more digits at {:.0e} than at {:.0e}", after.0, before.0))
}
