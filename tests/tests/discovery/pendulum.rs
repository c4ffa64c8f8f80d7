//! A precise record that moves all the time: a pendulum with dry friction that its base model lacks, swung in five shots.
//!
//! The truth is the equation of motion by the classical Runge-Kutta method in steps of 2e-5 s.  The noise of the angle is a thousandth of what a tenth of a sample period
//! makes of it at speed, so that nearly all samples count only where times are taken to be as good as they are; and the fit
//! without friction bends the beginnings of the shots, from where no law of friction is found.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;

use super::{Draws, folder, hyd, json};

/// Moment of inertia (kg.m2), torque of gravity (N.m), viscous friction (N.m.s), dry friction (N.m).
const J: f64 = 3.3e-3;
const M: f64 = 0.1476 * 0.1478 * 9.81;
const C: f64 = 1.7e-4;
const F: f64 = 4e-4;
/// Standard deviation of the noise (rad).
const NOISE: f64 = 8e-5;
const STEP: f64 = 2e-5;

/// Angles from the lower position, at 100 samples a second.
fn swing(angle: f64, speed: f64) -> Vec<f64> {
    let rate = |th: f64, w: f64| (w, (-M * th.sin() - C * w - F * (w / 2e-6).tanh()) / J);
    let (mut th, mut w, mut angles) = (angle, speed, vec![angle]);
    for _ in 1..900 {
        for _ in 0..500 {
            let (a0, b0) = rate(th, w);
            let (a1, b1) = rate(th + 0.5 * STEP * a0, w + 0.5 * STEP * b0);
            let (a2, b2) = rate(th + 0.5 * STEP * a1, w + 0.5 * STEP * b1);
            let (a3, b3) = rate(th + STEP * a2, w + STEP * b2);
            th += STEP / 6.0 * (a0 + 2.0 * (a1 + a2) + a3);
            w += STEP / 6.0 * (b0 + 2.0 * (b1 + b2) + b3);
        }
        angles.push(th);
    }
    angles
}

#[test]
fn dry_friction_of_a_pendulum_is_found_from_either_origin_of_the_angle() {
    // Small swings far from the origin of the angle: friction that grows with the angle looks like dry friction there.
    let cases =
        [("hanging", 0.0, "-", 1.0, NOISE), ("upright", PI, "", 1.0, NOISE), ("hardly", PI, "", 0.06, 5.0 * NOISE)];
    for (name, origin, sign, share, noise) in cases {
        let folder = folder(&format!("pendulum_{name}"));
        let model = format!(
            "model P\n  parameter Real J = 3.3e-3; parameter Real c(min = 0) = 2e-4;\n  Real th(start = 0, fixed = true);\n  \
             Real w(start = 0, fixed = true);\nequation\n  der(th) = w;\n  J*der(w) = {sign}{M}*sin(th) - c*w;\nend P;\n"
        );
        fs::write(folder.join("p.mo"), model).expect("written");
        let study = "file = \"p.mo\"\n[models]\ndefault = \"P\"\n[channels]\nth = { variable = \"th\", unit = \"rad\" }\n[initial]\n\
            th = { value = \"first_th\", absolute = 2e-4 }\nw = { value = \"w0\", absolute = 0.1 }\n[nuisances]\n\
            J = { parameter = \"J\", relative = 0.1 }\nc = { parameter = \"c\", relative = 0.5 }\n[shots]\ntime = \"t\"\n[run]\ntolerance = 1e-8\n";
        fs::write(folder.join("study.toml"), study).expect("written");
        let mut draws = Draws(7);
        let mut shots = Vec::new();
        for (shot, (angle, speed)) in
            [(1.6, -1.3), (-0.1, 9.1), (-0.87, 2.8), (-0.07, 5.7), (0.43, -2.8)].into_iter().enumerate()
        {
            let mut text = String::from("t,th\n");
            for (k, th) in swing(share * angle, share * speed).into_iter().enumerate() {
                writeln!(text, "{},{:.9}", 0.01 * k as f64, th + origin + noise * draws.normal()).expect("a String");
            }
            fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
            // What is known of the speed is off by a few hundredths.
            shots.push(format!("{{\"file\": \"s{shot}.csv\", \"w0\": {}}}", share * speed + 0.03 * draws.normal()));
        }
        let set = format!(
            "{{\"noise_std\": {{\"th\": {noise}}}, \"sensor_offset_1sigma\": {{\"th\": 5e-3}}, \"experiments\": [{}]}}",
            shots.join(", ")
        );
        fs::write(folder.join("set.json"), set).expect("written");
        let found = hyd(&folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
        assert_eq!(found.code, Some(0), "{}", found.stderr);
        // Small swings are slow against their noise.
        assert!(share < 1.0 || found.stderr.contains("note: these records move all the time"), "{}", found.stderr);
        let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
        let named: Vec<&str> =
            report["effects"].as_array().expect("a list").iter().filter_map(|own| own["id"].as_str()).collect();
        assert_eq!(
            (report["status"].as_str(), &named[..]),
            (Some("named"), &["coulomb_friction"][..]),
            "{name}: {}",
            found.stdout
        );
        // By itself the model begins as the first shot does.
        let written = fs::read_to_string(folder.join("report/discovered.hyd")).expect("written");
        let speed = written.split("'start of w' = ").nth(1).and_then(|rest| rest.split(' ').next()).expect("declared");
        let speed: f64 = speed.parse().expect("a number");
        assert!((speed + 1.3 * share).abs() < 0.1, "{written}");
        let size = report["effects"][0]["parameters"]["F_c"]["value"].as_f64().expect("a number");
        assert!((size / F - 1.0).abs() < if share < 1.0 { 0.1 } else { 0.02 }, "{name}: {size:e}");
        let _ = fs::remove_dir_all(&folder);
    }
}
