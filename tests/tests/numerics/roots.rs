//! Roots at zero, where they have no slope: vessels that run empty, and one that is filled from nothing.

use hyd::LibraryPath;
use hyd_compiler::{Goal, Options, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::simulate;
use hyd_tests::runs::{instance, on_grid};

/// `level' = -sqrt(level)` from 1 is `(1 - t/2)^2` and stays at 0 from 2 on; `h' = 1 - sqrt(h)` from 0 at `t = 1` fulfils
/// `t - 1 = -2 (sqrt(h) + ln(1 - sqrt(h)))`.
const TEXT: &str = "model Vessels
  Real level(start = 1, fixed = true), filled(start = 0, fixed = true), slow(start = 1, fixed = true);
equation
  der(level) = -sqrt(max(level, 0));
  der(filled) = (if time > 1 then 1 else 0) - sqrt(max(filled, 0));
  der(slow) = -max(slow, 0)^0.5;
end Vessels;
";

#[test]
fn vessels_run_empty_and_are_filled() {
    let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "vessels.mo", TEXT, &options);
    let mut system = instance(&compilation, &[]);
    let mut rows = Trajectory::new();
    for tolerance in [1e-4, 1e-6, 1e-8] {
        simulate(&mut system, &on_grid(4.0, 16, tolerance), &mut rows, &|| false).expect("runs");
        let at = |name: &str, time: f64| rows.series(name).expect("known").value(time, Side::After);
        for k in 0..=16 {
            let time = 0.25 * f64::from(k);
            let exact = (1.0 - 0.5 * time.min(2.0)).powi(2);
            for name in ["level", "slow"] {
                let error = (at(name, time) - exact).abs();
                assert!(error < 50.0 * tolerance, "{name} at {time}: off by {error}");
            }
            let root = at("filled", time).max(0.0).sqrt();
            let back = if time > 1.0 { 1.0 - 2.0 * (root + (1.0 - root).ln()) } else { time };
            assert!(
                (back - time).abs() < 2000.0 * tolerance && (time > 1.0 || root == 0.0),
                "filled at {time}: {back}"
            );
        }
    }
}
