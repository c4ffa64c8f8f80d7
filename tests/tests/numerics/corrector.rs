//! Newton's method where parts of its first change cancel: a product of two unknowns at a resonance.
//!
//! A series circuit of 0.1 Ohm, 1/(2 pi) H and 1/(2 pi) F at 1 V, whose frequency sweeps from 0 to twice its resonance, as complex numbers: the
//! current follows from the frequency alone.

use hyd_tests::runs::{on_grid, run};

const MODEL: &str = "tests/language/equations_for_if_when/series_resonance.hyd";

#[test]
fn a_sweep_through_a_resonance_ends_at_every_tolerance() {
    for k in 0..=24 {
        let tolerance = 1e-4 * 10_f64.powf(-f64::from(k) / 6.0);
        let run = run(MODEL, &[], &on_grid(1.0, 100, tolerance));
        let currents = run.values("a");
        assert_eq!(currents.len(), 101);
        for (k, current) in currents.into_iter().enumerate() {
            let time = k as f64 / 100.0;
            let r = 2.0 * time + 0.01 / std::f64::consts::TAU;
            let exact = 1.0 / (1.0 + 100.0 * (1.0 - r * r).powi(2) / (r * r));
            // The current follows from the time alone, and rows are solved for: whatever the tolerance, it is exact.
            let error = (current - exact).abs();
            assert!(error < 1e-10, "{current} instead of {exact} at {time} s, {tolerance:e}");
        }
    }
}
