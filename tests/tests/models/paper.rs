//! The numbers that the paper prints, recovered from the model.
//!
//! Paper: Szydlowski, Smoczynski, Archives of Automotive Engineering 62(4), 2013, 63-76: inductance 16.00 mH at the
//! open and 10.06 mH at the closed spool, travel 0.45 mm, A_e = 4.91, B_e = 0.39, L_0 = 4.46 (mH mm, mm, mH), x_0 =
//! 0.035 mm, equations 10 and 11. With these rounded constants equation 10 gives 16.0129 and 10.0714 mH: neither rounds
//! to what is printed.  So the tests do not ask for the printed digits from the printed constants; they ask for them
//! from constants that *round to* the printed ones, and show how far the printed ones are off.

use hyd_tests::least_squares::fit;
use hyd_tests::reference::Reference;
use hyd_tests::runs::{Run, on_grid, run};

const TABLES: &str = "models/single_acting_drive/statictables.hyd";
const PRINTED_OPEN: f64 = 16.00;
const PRINTED_CLOSED: f64 = 10.06;

/// Positions (mm) and inductances (mH) of the model over the travel.
fn table(set: &[(&str, &str)]) -> Vec<(f64, f64)> {
    let run = run(TABLES, set, &on_grid(0.45, 45, 1e-8));
    run.values("x").iter().zip(run.values("L")).map(|(x, l)| (x * 1e3, l * 1e3)).collect()
}

/// Gap (mm) that belongs to an inductance (mH): equation 10 solved for x_e.
fn gap(l: f64) -> f64 {
    4.91 / (l - 4.46) - 0.39
}

fn rounded(value: f64, digits: i32) -> f64 {
    (value * 10f64.powi(digits)).round() / 10f64.powi(digits)
}

#[test]
fn inductance_at_both_ends_from_the_printed_constants() {
    let table = table(&[]);
    let (closed, open) = (table[0], table[45]);
    assert!((open.0 - 0.45).abs() < 1e-12 && closed.0 == 0.0, "travel {} mm", open.0 - closed.0);
    assert!((open.1 - (4.91 / 0.425 + 4.46)).abs() < 1e-11, "{}", open.1);
    assert!((closed.1 - (4.91 / 0.875 + 4.46)).abs() < 1e-11, "{}", closed.1);
    // 16.0129 and 10.0714: off by less than what the last digit of A_e and L_0 leaves open (0.012 + 0.005 mH), but more than
    // the printed digits of the inductance claim.
    for (model, printed) in [(open.1, PRINTED_OPEN), (closed.1, PRINTED_CLOSED)] {
        let off = model - printed;
        assert!(off > 0.005 && off < 0.015, "{model} mH against {printed} mH");
    }
    assert_eq!((rounded(open.1, 2), rounded(closed.1, 2)), (16.01, 10.07));
}

#[test]
fn printed_inductances_from_constants_that_round_to_the_printed_ones() {
    let (a, l_0) = (4.9051, 4.4551);
    assert_eq!((rounded(a, 2), rounded(l_0, 2)), (4.91, 4.46));
    let table = table(&[("lc.A_e", "4.9051e-6"), ("lc.L_0", "4.4551e-3")]);
    assert_eq!((rounded(table[45].1, 2), rounded(table[0].1, 2)), (PRINTED_OPEN, PRINTED_CLOSED));
}

#[test]
fn constants_of_equation_10_by_least_squares() {
    let table = table(&[]);
    let residuals =
        |a: f64, b: f64, l_0: f64| -> Vec<f64> { table.iter().map(|&(x, l)| a / (b + 0.485 - x) + l_0 - l).collect() };
    let [a, b] = fit(|p: &[f64; 2]| residuals(p[0], p[1], 4.46), [2.0, 1.0]);
    assert!((a - 4.91).abs() < 1e-8 && (b - 0.39).abs() < 1e-8, "A_e {a}, B_e {b}");
    let [a, b, l_0] = fit(|p: &[f64; 3]| residuals(p[0], p[1], p[2]), [4.0, 0.5, 4.0]);
    let off = (a - 4.91).abs().max((b - 0.39).abs()).max((l_0 - 4.46).abs());
    assert!(off < 1e-6, "A_e {a}, B_e {b}, L_0 {l_0}");
}

#[test]
fn constants_of_equation_10_from_readings_of_two_decimals() {
    let readings: Vec<(f64, f64)> = table(&[]).into_iter().step_by(3).map(|(x, l)| (x, rounded(l, 2))).collect();
    let model = |a: f64, b: f64, x: f64| a / (b + 0.485 - x) + 4.46;
    let [a, b] = fit(|p: &[f64; 2]| readings.iter().map(|&(x, l)| model(p[0], p[1], x) - l).collect(), [2.0, 1.0]);
    assert_eq!((rounded(a, 2), rounded(b, 2)), (4.91, 0.39), "A_e {a}, B_e {b}");
}

#[test]
fn gaps_and_travel_from_the_two_printed_inductances() {
    let x_0 = gap(PRINTED_OPEN);
    let travel = gap(PRINTED_CLOSED) - x_0;
    assert_eq!(rounded(x_0, 3), 0.035, "x_0 {x_0} mm");
    assert_eq!(rounded(travel, 2), 0.45, "x_mks {travel} mm");
    let table = table(&[]);
    let (own_x_0, own_travel) = (gap(table[45].1), gap(table[0].1) - gap(table[45].1));
    assert!((own_x_0 - 0.035).abs() < 1e-9 && (own_travel - 0.45).abs() < 1e-9, "{own_x_0}, {own_travel}");
}

/// Time at which x first passes `level` (m) upwards, or downwards after 8 ms when the spool has come to rest at its stop; by
/// cubic interpolation of x and v.
fn passes(times: &[f64], x: &[f64], v: &[f64], level: f64, up: bool) -> f64 {
    let side = |x: f64| if up { x >= level } else { x < level };
    let begin = if up { 0.0 } else { 8e-3 };
    let k = (1..x.len())
        .filter(|&k| times[k] > begin)
        .find(|&k| side(x[k]))
        .unwrap_or_else(|| panic!("x never passes {level} m"));
    let h = times[k] - times[k - 1];
    let cubic = |s: f64| {
        let (p, q) = (1.0 - s, s);
        let values = (1.0 + 2.0 * q) * p * p * x[k - 1] + q * q * (3.0 - 2.0 * q) * x[k];
        values + h * (q * p * p * v[k - 1] - q * q * p * v[k])
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if side(cubic(middle)) { high = middle } else { low = middle }
    }
    times[k - 1] + h * (low + high) / 2.0
}

/// Opening and closing of the spool without pump: at 10 % and 90 % of the travel, where no contact is near, both ways.
#[test]
fn instants_of_opening_and_closing() {
    let reference = Reference::read("RM_energy_force");
    let run: Run = run("models/single_acting_drive/rm.hyd", &[], &on_grid(0.03, 600, 1e-8));
    let (x, v) = (run.values("x"), run.values("v"));
    let mut instants = Vec::new();
    for (share, up) in [(0.1, true), (0.9, true), (0.9, false), (0.1, false)] {
        let level = share * 0.45e-3;
        let is = passes(run.rows.times(), &x, &v, level, up);
        let (x, v) = (reference.column("x_m"), reference.column("v_m_per_s"));
        let should = passes(reference.column("time_s"), x, v, level, up);
        assert!((is - should).abs() < 0.2e-6, "{share} of the travel, opening {up}: {is} s instead of {should} s");
        instants.push(is * 1e3);
    }
    // "A few milliseconds": open by 2.6 ms, back on the seat at 12.0 ms.
    assert!((instants[1] - 2.6).abs() < 0.1 && (instants[3] - 12.0).abs() < 0.1, "{instants:?} ms");
}
