//! Arrays of equations stay arrays and loops stay loops: the code of a line of N cells does not grow with N.
//!
//! Equal equations share one template and one loop of machine code; the slots they work on are tables.  So 10^5 cells
//! (2*10^5 states) must need exactly as many templates, kernels and bytes of code as 10^3.  Nothing is timed here.

use hyd_compiler::CodeStatistics;
use hyd_system::DaeSystem;
use hyd_tests::runs::{instance, on_grid, run, translated};

const LINE: &str = "models/hydraulic_line/line.hyd";

/// Statistics of the code and number of unknowns of a line with that many cells.
fn line(cells: &str) -> (CodeStatistics, usize) {
    let compilation = translated(LINE, &[("N", cells)]);
    assert_eq!(compilation.set_at_translation, ["N"]);
    let statistics = compilation.model.as_ref().expect("translated").statistics();
    (statistics, instance(&compilation, &[]).structure().unknowns)
}

#[test]
fn code_does_not_grow_with_the_number_of_cells() {
    let (small, small_unknowns) = line("1000");
    let (large, large_unknowns) = line("100000");
    assert_eq!((small_unknowns, large_unknowns), (2_000, 200_000));
    assert_eq!(small, large);
    assert!(small.templates > 0 && small.templates < 30 && small.code_bytes > 0, "{small:?}");
}

fn code(file: &str, n: &str) -> CodeStatistics {
    translated(file, &[("n", n)]).model.as_ref().expect("translated").statistics()
}

/// Each variable of an algorithm section stands in the next one's equation as itself, as it does where equations are written.
#[test]
fn a_recurrence_in_an_algorithm_is_that_of_equations() {
    for n in ["20", "200"] {
        let algorithm = code("tests/cases/size/recurrence.hyd", n);
        let equations = code("tests/cases/size/recurrence_of_equations.hyd", n);
        assert_eq!((algorithm.templates, algorithm.kernels), (equations.templates, equations.kernels));
        // The order of the equations decides which expressions are shared.
        assert!(algorithm.code_bytes < 2 * equations.code_bytes, "{algorithm:?} {equations:?}");
    }
}

/// Turns that build on each other are a loop in the code, not one expression.
#[test]
fn the_code_of_a_long_loop_does_not_grow_with_its_turns() {
    assert_eq!(code("tests/cases/size/loop.hyd", "5000"), code("tests/cases/size/loop.hyd", "50000"));
}

/// The steady flow of the start stays until the valve moves; afterwards the pressure rises above that of the inlet and the
/// end is quieter than the peak.
#[test]
fn a_line_of_a_thousand_cells_runs() {
    let run = run(LINE, &[("N", "1000")], &on_grid(0.05, 100, 1e-6));
    let (times, p, q) = (run.rows.times(), run.values("p_end"), run.values("q_v"));
    for k in (0..times.len()).take_while(|&k| times[k] <= 10e-3) {
        assert!((p[k] - p[0]).abs() < 1e-3 * p[0], "the start is not steady: {} Pa at {} s", p[k], times[k]);
    }
    // Joukowsky: rho a q/A, here spread over 20 ms in which waves return (2 l/a = 31 ms): no reflection is back yet at its end,
    // so the pressure at the valve has risen by rho a (q_0 - q)/A less friction.
    let at = (0..times.len()).find(|&k| times[k] >= 30e-3).expect("30 ms are within the run");
    let area = std::f64::consts::PI * 12e-3 * 12e-3 / 4.0;
    let rise = 870.0 * 1300.0 * (q[0] - q[at]) / area;
    assert!(((p[at] - p[0]) / rise - 1.0).abs() < 0.1, "rise {} Pa, Joukowsky {rise} Pa", p[at] - p[0]);
}
