//! A lightly damped oscillator that a recorded input drives, whose mass is guessed twice too large.
//!
//! Over long records the fit of the base model runs out of steps far above its minimum.  Where the model lacks a spring that hardens and a
//! constant force, play, whose middle may lie anywhere, imitates the force as long as both are missing.  The truth is the equation of motion by
//! the classical Runge-Kutta method in sixteen steps a sample.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::{Draws, folder, hyd, json};

/// Mass (kg), damping (N.s/m), stiffness (N/m), force per cube of the deflection (N/m3), constant force (N), noise (m).
const M: f64 = 5.2e-6;
const D: f64 = 2.2e-4;
const K: f64 = 0.95;
const K_3: f64 = 3.8;
const F_0: f64 = -8e-3;
const NOISE: f64 = 8e-4;
/// Samples a second.
const RATE: f64 = 610.0;
/// Root mean squares of the driving force (N), shot by shot.
const DRIVEN: [f64; 4] = [0.04, 0.06, 0.05, 0.055];

/// The driving force at the samples: sines of random phase up to 200 Hz.
fn force(size: f64, samples: usize, draws: &mut Draws) -> Vec<f64> {
    let sines: Vec<(f64, f64)> =
        (0..80).map(|k| (2.5 * f64::from(k + 1), std::f64::consts::TAU * draws.uniform())).collect();
    let at = |t: f64| sines.iter().map(|(f, phase)| (std::f64::consts::TAU * f * t + phase).sin()).sum::<f64>();
    (0..samples).map(|k| size * (2.0 / 80.0_f64).sqrt() * at(k as f64 / RATE)).collect()
}

/// Deflections at the samples, from rest, with the stiffness of the cube and the constant force.
fn swing(force: &[f64], (cubic, constant): (f64, f64)) -> Vec<f64> {
    const STEPS: usize = 16;
    let h = 1.0 / (RATE * STEPS as f64);
    let rate = |y: f64, v: f64, f: f64| (v, (f + constant - D * v - K * y - cubic * y.powi(3)) / M);
    let (mut y, mut v, mut all) = (0.0, 0.0, vec![0.0]);
    for pair in force.windows(2) {
        let f = |share: f64| pair[0] + share * (pair[1] - pair[0]);
        for step in 0..STEPS {
            let at = |part: f64| f((step as f64 + part) / STEPS as f64);
            let (a0, b0) = rate(y, v, at(0.0));
            let (a1, b1) = rate(y + 0.5 * h * a0, v + 0.5 * h * b0, at(0.5));
            let (a2, b2) = rate(y + 0.5 * h * a1, v + 0.5 * h * b1, at(0.5));
            let (a3, b3) = rate(y + h * a2, v + h * b2, at(1.0));
            y += h / 6.0 * (a0 + 2.0 * (a1 + a2) + a3);
            v += h / 6.0 * (b0 + 2.0 * (b1 + b2) + b3);
        }
        all.push(y);
    }
    all
}

/// A machine, its records and what is known of them.
struct Bench {
    /// Stiffness of the cube and constant force.
    missing: (f64, f64),
    /// Samples of a record.
    samples: usize,
    /// Records; a single one is cut into six windows that begin at a speed nobody knows.
    records: usize,
    /// Noise as stated, in that of the records.
    stated: f64,
}

/// What is found.
fn found(folder: &Path, bench: &Bench) -> (String, serde_json::Value) {
    let model = "model Box
  parameter Real m(unit = \"kg\", min = 1e-8) = 1e-5;
  parameter Real d(unit = \"N.s/m\", min = 0) = 2e-4;
  parameter Real k(unit = \"N/m\", min = 1e-3) = 1;
  input Real F(unit = \"N\");
  Real y(unit = \"m\", start = 0, fixed = true);
  Real v(unit = \"m/s\", start = 0, fixed = true);
equation
  der(y) = v;
  m*der(v) = F - d*v - k*y;
end Box;
";
    fs::write(folder.join("box.mo"), model).expect("written");
    let study = "file = \"box.mo\"\n[models]\ndefault = \"Box\"\n[channels]\ny = { variable = \"y\", unit = \"m\" }\n[inputs]\n\
        F = { column = \"F\", unit = \"N\", hold = \"linear\" }\n[nuisances]\nm = { parameter = \"m\", relative = 0.3 }\n\
        d = { parameter = \"d\", relative = 0.5 }\nk = { parameter = \"k\", relative = 0.3 }\n[shots]\ntime = \"t\"\n";
    let windows =
        "windows = 6\n[initial]\ny = { value = \"first_y\", absolute = 3e-3 }\nv = { value = 0.0, absolute = 100 }\n";
    let study = [study, if bench.records == 1 { windows } else { "" }].concat();
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut draws = Draws(3);
    let mut shots = Vec::new();
    for (shot, size) in DRIVEN.into_iter().take(bench.records).enumerate() {
        let force = force(size, bench.samples, &mut draws);
        let mut text = String::from("t,F,y\n");
        for (k, (y, f)) in swing(&force, bench.missing).into_iter().zip(&force).enumerate() {
            writeln!(text, "{:.9},{f:.9},{:.9}", k as f64 / RATE, y + NOISE * draws.normal()).expect("a String");
        }
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\"}}"));
    }
    let set =
        format!("{{\"noise_std\": {{\"y\": {}}}, \"experiments\": [{}]}}", bench.stated * NOISE, shots.join(", "));
    fs::write(folder.join("set.json"), set).expect("written");
    let found = hyd(folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    (found.stdout, report)
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_spring_that_hardens_is_found_beside_a_constant_force() {
    let folder = folder("driven");
    let (stdout, report) = found(&folder, &Bench { missing: (K_3, F_0), samples: 400, records: 4, stated: 1.0 });
    let effects = report["effects"].as_array().expect("a list");
    let mut named: Vec<&str> = effects.iter().filter_map(|own| own["id"].as_str()).collect();
    named.sort_unstable();
    assert_eq!(named, ["cubic_stiffness", "offset_force"], "{stdout}");
    for (id, name, truth) in [("cubic_stiffness", "k_3", K_3), ("offset_force", "F_0", F_0)] {
        let own = effects.iter().find(|own| own["id"] == id).expect("named");
        let figure = |key: &str| own["parameters"][name][key].as_f64().expect("a number");
        let (value, error) = (figure("value"), figure("stderr"));
        assert!((value - truth).abs() < 4.0 * error && error < 0.05 * truth.abs(), "{id}: {value} +- {error}");
    }
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn a_base_fit_on_a_wrong_way_goes_another_one() {
    let folder = folder("driven-far");
    let (stdout, report) = found(&folder, &Bench { missing: (0.0, 0.0), samples: 9000, records: 1, stated: 1.0 });
    assert_eq!(report["status"], "adequate", "{stdout}");
    let attempts = report["attempts"][0].as_array().expect("a list");
    let misfit = |k: usize| attempts[k]["misfit"].as_f64().expect("a number");
    assert!(attempts.len() > 1 && misfit(0) > 10.0, "{attempts:?}");
    assert!(attempts[1]["start"] == "growing horizon from there" && (misfit(1) - 1.0).abs() < 0.1, "{attempts:?}");
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn noise_that_is_more_than_stated_is_counted_before_anything_is_tried() {
    let folder = folder("driven-loud");
    let (stdout, report) = found(&folder, &Bench { missing: (0.0, 0.0), samples: 400, records: 4, stated: 0.5 });
    assert_eq!(report["status"], "adequate", "{stdout}");
    assert!(stdout.contains("noise of y is 2.0 times what was stated"), "{stdout}");
    let attempts = report["attempts"][0].as_array().expect("a list");
    assert!(attempts.iter().any(|own| own["start"] == "from there, with noise as it is"), "{attempts:?}");
    let _ = fs::remove_dir_all(&folder);
}

/// What reads the input gets it late: a heater's power stands in the balance as it is recorded.
#[test]
fn a_recorded_input_that_balances_read_is_a_command() {
    const LAG: f64 = 20.0;
    let folder = folder("read-input");
    let model = "model Pot
  input Real u;
  parameter Real k = 3;
  parameter Real C = 200;
  parameter Real G = 2;
  parameter Real T_s = 300;
  Real T(start = T_s, fixed = true);
equation
  C*der(T) = k*u - G*(T - 300);
end Pot;
";
    fs::write(folder.join("pot.mo"), model).expect("written");
    let study = "file = \"pot.mo\"\n[models]\ndefault = \"Pot\"\n[channels]\nT_K = { variable = \"T\", noise = 0.05 }\n[inputs]\n\
        u = { column = \"u\", hold = \"zero\" }\n[conditions]\nT_s = \"T_s\"\n[nuisances]\nk = \"k\"\nC = \"C\"\nG = \"G\"\n[shots]\ntime = \"t\"\n";
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut draws = Draws(11);
    let mut shots = Vec::new();
    // Where it does not begin in equilibrium, a lag of the sensor would show at once.
    let told = [(300.0, 20, 150, 30.0), (340.0, 40, 200, 50.0), (320.0, 10, 90, 80.0), (310.0, 60, 220, 40.0)];
    for (shot, (start, begin, end, size)) in told.into_iter().enumerate() {
        let (mut power, mut temperature) = (0.0, start);
        let mut text = String::from("t,u,T_K\n");
        for k in 0..300 {
            let told = if (begin..end).contains(&k) { size } else { 0.0 };
            writeln!(text, "{k},{told},{:.4}", temperature + 0.05 * draws.normal()).expect("a String");
            // Exact for the power, which the temperature follows by the trapezoidal rule.
            for _ in 0..100 {
                let before = power;
                power = told + (power - told) * (-0.01 / LAG).exp();
                let rate = |power: f64, temperature: f64| (3.0 * power - 2.0 * (temperature - 300.0)) / 200.0;
                let first = rate(before, temperature);
                temperature += 0.005 * (first + rate(power, temperature + 0.01 * first));
            }
        }
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\", \"T_s\": {start}}}"));
    }
    fs::write(folder.join("set.json"), format!("{{\"experiments\": [{}]}}", shots.join(", "))).expect("written");
    let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    let effects = report["effects"].as_array().expect("a list");
    let named: Vec<&str> = effects.iter().filter_map(|own| own["id"].as_str()).collect();
    assert_eq!(named, ["actuator_lag"], "{}", found.stdout);
    let tau = &effects[0]["parameters"]["tau"];
    let figure = |key: &str| tau[key].as_f64().expect("a number");
    assert!((figure("value") - LAG).abs() < 4.0 * figure("stderr") && figure("stderr") < 1.0, "{tau}");
    let written = fs::read_to_string(folder.join("report/discovered.hyd")).expect("written");
    assert!(written.contains("k*given_u"), "{written}");
    let _ = fs::remove_dir_all(&folder);
}
