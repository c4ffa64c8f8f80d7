//! A line of cells against the exact solution of the one-dimensional water-hammer equations.
//!
//! The reference (`tests/data/reference/line_joukowsky.csv`) follows the characteristics: the outflow is stopped within 0.2 ms, the
//! pressure rises by Z dq = 2.85 MPa (Joukowsky) and the wave returns after 2 l/a = 2.4 ms.  Cells are of second order for smooth
//! waves, but disperse; a front with kinks is smooth by 3/2 of a derivative in the mean square, of which two thirds of the order
//! remain (Brenner, Thomee, Wahlbin, "Besov Spaces and Applications to Difference Methods", 1975): half the length, half the error.

use hyd_tests::reference::Reference;
use hyd_tests::runs::{on_grid, run};

/// Root of the mean square difference of a pressure over the first 6 ms (Pa), two and a half travels of the wave.
fn difference(cells: &str, variable: &str, column: &str) -> f64 {
    let reference = Reference::read("line_joukowsky");
    let options = on_grid(reference.stop(), reference.intervals(), 1e-7);
    let run = run("models/hydraulic_line/stoppedline.hyd", &[("N", cells)], &options);
    let last = reference.column("time_s").iter().take_while(|&&t| t <= 6e-3).count();
    let pairs = run.values(variable).into_iter().zip(reference.column(column).iter().copied()).take(last);
    let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
    (squares / last as f64).sqrt()
}

#[test]
fn cells_converge_to_the_exact_line() {
    for (variable, column) in [("p_end", "p_end_Pa"), ("p_mid", "p_mid_Pa")] {
        let errors = ["50", "100", "200", "400"].map(|cells| difference(cells, variable, column));
        // One per cent of the step.
        assert!(errors[3] < 2.85e4, "{variable}: {errors:?} Pa");
        for pair in errors.windows(2) {
            assert!((1.4..2.6).contains(&(pair[0] / pair[1])), "{variable}: {errors:?} Pa");
        }
    }
}

/// Joukowsky's rise at the closed end, in the middle of its plateau.
#[test]
fn pressure_rises_by_joukowskys_step() {
    let run = run("models/hydraulic_line/stoppedline.hyd", &[("N", "200")], &on_grid(4e-3, 400, 1e-7));
    let z = 860.0 * 1250.0 / (std::f64::consts::PI * 12e-3 * 12e-3 / 4.0);
    let rise = run.value("p_end", 2.3e-3) - 10e6;
    assert!((rise / (z * 3e-4) - 1.0).abs() < 2e-3, "{rise} Pa instead of {} Pa", z * 3e-4);
}
