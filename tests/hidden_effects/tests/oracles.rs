//! The hand-written drive against reference trajectories that others computed (DOP853 and a fixed-step code of their own), within
//! the limits stated with them.  The line's reference carries a step of its own, so it is held to a few percent of Z Q.

use hidden_effects::machine::{Line, Machine};
use hidden_effects::{drive::Shot, shot};
use std::path::Path;

/// Columns of a reference file by name.
fn reference(name: &str, columns: &[&str]) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/reference").join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let places: Vec<usize> =
        columns.iter().map(|name| header.iter().position(|found| found == name).expect("the column")).collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|field| field.parse().expect("a number")).collect()).collect();
    places.iter().map(|&place| rows.iter().map(|row| row[place]).collect()).collect()
}

const CHANNELS: [&str; 7] = ["time_s", "u_C_V", "i_A", "x_m", "y_m", "pR_Pa", "p0_Pa"];

fn shot_at(p_0: f64) -> Shot {
    Shot { p_0, u_0: 24.0, capacity: 1e-3, pulse: 0.01, trigger: 0.0 }
}

/// Largest difference of each channel between a run and a reference.
fn differences(machine: &Machine, p_0: f64, name: &str, until: f64) -> [f64; 6] {
    let wanted = reference(name, if name.starts_with("RM") { &CHANNELS[..4] } else { &CHANNELS });
    let rows = shot::run(machine, &shot_at(p_0), &wanted[0], shot::TOLERANCE).expect("runs");
    let mut largest = [0.0f64; 6];
    for (row, &time) in rows.iter().zip(&wanted[0]) {
        for channel in 0..wanted.len() - 1 {
            let column = &wanted[channel + 1];
            let sample = (time / 50e-6).round() as usize;
            if time <= until {
                largest[channel] = largest[channel].max((row[channel] - column[sample]).abs());
            }
        }
    }
    largest
}

fn within(found: [f64; 6], limits: [f64; 6]) {
    println!("largest differences {found:?}");
    assert!(found.iter().zip(limits).all(|(found, limit)| *found <= limit), "{found:?} against {limits:?}");
}

/// u_C 1e-5 V, x 2e-8 m, y 1e-7 m, p_R 5e3 Pa (1e4 after an impact).
const LIMITS: [f64; 6] = [1e-5, 2e-5, 2e-8, 1e-7, 1e4, 0.0];

#[test]
fn nominal_drive() {
    within(differences(&Machine::nominal(), 10e6, "drive_nominal_10MPa.csv", 1.0), LIMITS);
    within(differences(&Machine::nominal(), 15e6, "drive_nominal_15MPa.csv", 1.0), LIMITS);
}

#[test]
fn pump_off() {
    within(differences(&Machine::nominal(), 1e5, "RM_energy_force.csv", 1.0), LIMITS);
}

#[test]
fn leakage_and_incomplete_filling() {
    let mut machine = Machine::nominal();
    machine.hidden.leakage = Some(1e-11);
    machine.hidden.filling = Some(0.92);
    within(differences(&machine, 10e6, "drive_leak_wyp_10MPa.csv", 1.0), LIMITS);
}

#[test]
fn supply_line() {
    let mut machine = Machine::nominal();
    machine.hidden.line = Some(Line {
        length: 1.5,
        diameter: 0.012,
        wave: 1250.0,
        gas: 3e-4,
        exponent: 1.3,
        inlet: 3e-6,
        nu: 40e-6,
        friction: 0.03,
        grid: 2.5e-6,
    });
    within(differences(&machine, 10e6, "drive_line_moc_10MPa.csv", 1.0), [1e-3, 1e-3, 2e-6, 2e-6, 1e5, 1e5]);
}
