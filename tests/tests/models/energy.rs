//! The books of energy of the spool without pump, from variables of the model alone.
//!
//! Stored energy (capacitor, field, motion, spring, contacts) plus what resistors, diode, friction and contacts take must
//! stay what it was at the start.  It does for the force that follows from the inductance, and it does not for force and
//! voltage of motion as printed (the paper's equation 9), so the books can tell the two apart.

use hyd_tests::runs::{Run, on_grid, run};

/// Largest imbalance over stored energy at the start.
fn imbalance(run: &Run) -> f64 {
    let start = run.values("E_start")[0];
    assert!((start - run.values("E_stored")[0]).abs() < 1e-12, "the books do not begin with what is stored");
    let largest = run.values("E_balance").iter().map(|e| e.abs()).fold(0.0, f64::max);
    largest / start
}

/// The terms of the books recomputed from the states, so that the books cannot close by leaving something out.
fn check_terms(run: &Run) {
    let value = |name: &str, k: usize| run.rows.series(name).unwrap_or_else(|| panic!("no `{name}`")).at(k);
    for k in (0..run.rows.len()).step_by(7) {
        let (x, v) = (value("x", k), value("v", k));
        let (below, above) = ((-x).max(0.0), (x - 0.45e-3).max(0.0));
        let contacts = 1e8 * (below * below + above * above) / 2.0;
        let electric = 1e-3 * value("u_C", k).powi(2) / 2.0;
        let magnetic = value("lambda", k).powi(2) / (2.0 * value("L", k));
        let mechanic = 0.02 * v * v / 2.0 + 22.0 * x + 20e3 * x * x / 2.0 + contacts;
        let sum = electric + magnetic + mechanic;
        assert!((sum - value("E_stored", k)).abs() < 1e-12, "row {k}: {sum} J instead of {}", value("E_stored", k));
    }
}

#[test]
fn books_close_for_the_force_of_the_inductance_only() {
    let options = on_grid(0.03, 600, 1e-9);
    let energy = run("models/single_acting_drive/rmenergybooks.hyd", &[], &options);
    check_terms(&energy);
    let lost = energy.values("E_loss");
    assert!(lost.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9), "losses are never given back");
    // 0.288 J at 24 V and 1 mF.
    assert!((energy.values("E_start")[0] - 0.288).abs() < 1e-4);
    let closed = imbalance(&energy);
    assert!(closed < 1e-6, "the books are open by {closed:e} of the stored energy");

    let printed = run("models/single_acting_drive/rmenergybookspaper.hyd", &[], &options);
    check_terms(&printed);
    let open = imbalance(&printed);
    assert!(open > 1e-3, "the books of the printed pair close to {open:e}");
}
