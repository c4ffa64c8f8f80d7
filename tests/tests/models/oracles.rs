//! Every test stand and the drive against stored solutions of the same equations by another code.
//!
//! The stored solutions (`tests/data/reference/README.md`) are noise-free and good to a few nanometres, tens of pascals and
//! 1e-7 V.  Limits for runs at tolerance 1e-8: x 2e-8 m, y 1e-7 m, i 2e-5 A, u_C 1e-5 V, p_R 1e4 Pa; where motion is
//! prescribed 1e-5 of the range of each variable.  Speeds and forces have their own limits, explained where they stand.

use hyd_tests::reference::{Limit, Reference, limit};
use hyd_tests::runs::{on_grid, run};

const DRIVE: &str = "models/single_acting_drive";
const TOLERANCE: f64 = 1e-8;

/// Runs a model on the grid of a reference and compares.
fn check(file: &str, set: &[(&str, &str)], reference: &Reference, limits: &[Limit]) {
    let run = run(&format!("{DRIVE}/{file}"), set, &on_grid(reference.stop(), reference.intervals(), TOLERANCE));
    reference.compare(&run, limits);
}

fn circuit(set: &[(&str, &str)], name: &str) {
    let reference = Reference::read(name);
    // The force goes with the square of the current: 2 F/i times the limit of the current, at most 60 N/A here.
    let limits = [
        limit("u_C", "u_C_V", 1e-5),
        limit("i", "i_A", 2e-5),
        limit("x", "x_m", 1e-18),
        limit("L", "L_H", 1e-11),
        limit("lambda", "lambda_Wb", 2e-7),
        limit("F_e", "F_e_N", 1.2e-3),
    ];
    check("rlclocked.hyd", set, &reference, &limits);
}

#[test]
fn circuit_with_the_armature_held_closed() {
    circuit(&[], "RLC_locked_closed");
}

#[test]
fn circuit_with_the_armature_held_open() {
    circuit(&[("x_lock", "0.45e-3")], "RLC_locked_open");
}

/// The closed form of the circuit while the contact is closed: i = U0/(w L) exp(-a t) sin(w t).
#[test]
fn circuit_against_its_closed_form() {
    let run = run(&format!("{DRIVE}/rlclocked.hyd"), &[], &on_grid(9.9e-3, 99, TOLERANCE));
    let l = 4.91e-6 / 0.875e-3 + 4.46e-3;
    let a: f64 = 2.5 / (2.0 * l);
    let w = (1.0 / (l * 1e-3) - a * a).sqrt();
    for (t, i) in run.rows.times().iter().zip(run.values("i")) {
        let exact = 24.0 / (w * l) * (-a * t).exp() * (w * t).sin();
        assert!((i - exact).abs() < 2e-6, "at {t} s: {i} instead of {exact}");
    }
}

#[test]
fn spool_without_pump() {
    let reference = Reference::read("RM_energy_force");
    let limits = [
        limit("u_C", "u_C_V", 1e-5),
        limit("i", "i_A", 2e-5),
        limit("x", "x_m", 2e-8),
        limit("v", "v_m_per_s", 3e-4),
        limit("L", "L_H", 6e-7),
        limit("lambda", "lambda_Wb", 4e-7),
        limit("F_e", "F_e_N", 5e-3),
    ];
    check("rm.hyd", &[], &reference, &limits);
}

#[test]
fn spool_without_pump_as_printed() {
    let reference = Reference::read("RM_paper_force");
    let limits = [
        limit("u_C", "u_C_V", 1e-5),
        limit("i", "i_A", 2e-5),
        limit("x", "x_m", 2e-8),
        limit("v", "v_m_per_s", 3e-4),
        limit("L", "L_H", 6e-7),
        limit("lambda", "lambda_Wb", 4e-7),
        limit("F_e", "F_e_N", 0.02),
    ];
    check("rmpaper.hyd", &[], &reference, &limits);
}

/// Columns of the hydraulic part, whose motion is prescribed.
const HYDRAULIC: [(&str, &str); 9] = [
    ("x", "x_m"),
    ("y", "y_m"),
    ("w", "w_m_per_s"),
    ("p_R", "pR_Pa"),
    ("S_0", "S0_m2"),
    ("S_Z", "Sz_m2"),
    ("Q_0", "Q0_m3_per_s"),
    ("Q_z", "Qz_m3_per_s"),
    ("p_0", "p0_Pa"),
];

#[test]
fn chamber_with_prescribed_motion() {
    let reference = Reference::read("HY_prescribed");
    let mut limits = reference.fractions(&HYDRAULIC, 1e-5);
    limits.push(limit("V_void", "V_void_m3", 0.0));
    check("hyprescribed.hyd", &[], &reference, &limits);
}

#[test]
fn leaking_chamber_with_prescribed_motion() {
    let reference = Reference::read("HY_prescribed_leak_wyp");
    let mut limits = reference.fractions(&HYDRAULIC, 1e-5);
    limits.extend(reference.fractions(&[("V_void", "V_void_m3")], 1e-5));
    check("hyprescribedleakwyp.hyd", &[], &reference, &limits);
}

#[test]
fn valve_with_prescribed_pressure() {
    let reference = Reference::read("SH_prescribed");
    let limits = reference.fractions(&[("y", "y_m"), ("w", "w_m_per_s"), ("p_R", "pR_Pa")], 1e-5);
    check("shprescribed.hyd", &[], &reference, &limits);
}

#[test]
fn tables_over_the_travel() {
    let table = Reference::read("static_tables");
    let run = run(&format!("{DRIVE}/statictables.hyd"), &[], &on_grid(0.45, 45, TOLERANCE));
    let columns = [
        ("x", "x_m"),
        ("L", "L_H"),
        ("dL_dx", "dLdx_H_per_m"),
        ("F_e_energy", "F_e_energy_at_1A_N"),
        ("F_e_paper", "F_e_paper_at_1A_N"),
        ("S_0", "S0_m2"),
        ("S_Z", "Sz_m2"),
    ];
    for (variable, column) in columns {
        for (k, (is, should)) in run.values(variable).iter().zip(table.column(column)).enumerate() {
            // The table shows ten digits.
            let off = (is - should).abs();
            assert!(off <= 6e-10 * should.abs() + 1e-18, "{variable}, row {k}: {is:e} instead of {should:e}");
        }
    }
    assert_eq!(run.rows.len(), table.intervals() + 1);
}

fn drive_limits(speeds: bool) -> Vec<Limit> {
    let mut limits = vec![
        limit("u_C", "u_C_V", 1e-5),
        limit("i", "i_A", 2e-5),
        limit("x", "x_m", 2e-8),
        limit("y", "y_m", 1e-7),
        limit("p_R", "pR_Pa", 1e4),
        limit("p_0", "p0_Pa", 0.0),
    ];
    if speeds {
        // At a contact the speed turns within microseconds: a few 1e-9 m of position are up to 3e-4 m/s.
        limits.extend([limit("v", "v_m_per_s", 3e-4), limit("w", "w_m_per_s", 3e-4)]);
    }
    limits
}

#[test]
fn drive_at_10_mpa() {
    check("drive.hyd", &[], &Reference::read("drive_nominal_10MPa"), &drive_limits(true));
}

#[test]
fn drive_at_15_mpa() {
    check("drive.hyd", &[("p0", "15e6")], &Reference::read("drive_nominal_15MPa"), &drive_limits(true));
}

#[test]
fn leaking_drive_not_full_at_the_start() {
    check("driveleakwyp.hyd", &[], &Reference::read("drive_leak_wyp_10MPa"), &drive_limits(false));
}
