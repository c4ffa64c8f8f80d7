//! A further effect that fitted shots ask for and shots held out refute: a carriage that coasts to rest slowly in the shots that are fitted,
//! and begins three times as fast in those held out.
//!
//! The force grows a little faster than the speed where shots are fitted and is proportional to it again above, which no effect of the
//! library does.  A drag with the square of the speed imitates the first and is far off in the second.  The truth is
//! the equation of motion by the classical Runge-Kutta method in steps of 1 ms.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use super::{Draws, folder, hyd, json};

/// Mass (kg), force per speed (N.s/m), force per square of the speed where the library is right (N.s2/m2), noise (m).
const M: f64 = 0.5;
const D: f64 = 0.4;
const C: f64 = 0.05;
const NOISE: f64 = 2e-4;
/// Speeds at the start (m/s); the last two are held out.
const SPEEDS: [f64; 7] = [1.2, 1.6, 2.0, 1.4, 1.8, 5.0, 6.0];

/// What brakes the carriage at a speed.
fn bends(v: f64) -> f64 {
    D * v * (1.0 + (v / 3.6).powi(2) / (1.0 + (v / 2.5).powi(4)))
}

/// The same as the library has it.
fn two_drags(v: f64) -> f64 {
    D * v + C * v * v.abs()
}

/// Places at 250 samples a second.
fn coast(force: fn(f64) -> f64, speed: f64) -> Vec<f64> {
    const STEP: f64 = 1e-3;
    let rate = |v: f64| -force(v) / M;
    let (mut x, mut v, mut places) = (0.0, speed, vec![0.0]);
    for _ in 1..500 {
        for _ in 0..4 {
            let a0 = rate(v);
            let a1 = rate(v + 0.5 * STEP * a0);
            let a2 = rate(v + 0.5 * STEP * a1);
            let a3 = rate(v + STEP * a2);
            x += STEP * v + STEP * STEP / 6.0 * (a0 + a1 + a2);
            v += STEP / 6.0 * (a0 + 2.0 * (a1 + a2) + a3);
        }
        places.push(x);
    }
    places
}

/// Model, library, study and seven shots; the library may know a drag that grows faster, too.
fn write(folder: &Path, force: fn(f64) -> f64, knows_thick: bool) {
    let effect = |class: &str, id: &str, place: &str, number: &str, law: &str| {
        format!(
            "  block {class}\n    extends PartialForce;\n    parameter Real {number}(min = 0) = 0.1;\n  equation\n    F = -{law};\n    \
             annotation(__hyd(effect(id = \"{id}\", kind = \"physics\", at = {{\"{place}\"}}, adds = {number}, zero = 0, probe = 0.1,\n      \
             prior = \"lognormal(0.1, 1.2)\", range = {{1e-4, 30}}, words = \"drag\", signature = \"it slows down\", rivals = {{}})));\n  end {class};\n"
        )
    };
    fs::create_dir_all(folder.join("effects")).expect("made");
    let mut effects = vec![
        effect("Linear", "linear_drag", "oil", "d", "d*v"),
        effect("Quadratic", "quadratic_drag", "air", "c", "c*v*abs(v)"),
    ];
    if knows_thick {
        // Half of what the air does beside the oil.
        effects.push(effect("Thick", "thick_drag", "oil", "e", "e*(v + 0.06*v*abs(v))"));
    }
    let library = format!("within Coast;\npackage Effects\n{}end Effects;\n", effects.concat());
    fs::write(folder.join("effects/package.hyd"), library).expect("written");
    let model = "package Coast
  partial block PartialForce
    input Real v;
    output Real F;
  end PartialForce;
  block NoForce
    extends PartialForce;
  equation
    F = 0;
  end NoForce;
  model Carriage
    parameter Real m(min = 1e-3) = 0.5;
    parameter Real v0 = 1;
    Real x(start = 0, fixed = true);
    Real v(start = v0, fixed = true);
    replaceable NoForce bearing constrainedby PartialForce(v = v) annotation(__hyd(place(id = \"oil\")));
    replaceable NoForce around constrainedby PartialForce(v = v) annotation(__hyd(place(id = \"air\")));
  equation
    der(x) = v;
    m*der(v) = bearing.F + around.F;
  end Carriage;
end Coast;
";
    fs::write(folder.join("package.hyd"), model).expect("written");
    let study = format!(
        "file = \"package.hyd\"\nwithout = [\"Hyd.Effects\"]\n[models]\ndefault = \"Coast.Carriage\"\n[channels]\n\
         x = {{ variable = \"x\", noise = {NOISE} }}\n[conditions]\nv0 = \"v0\"\n[nuisances]\nm = \"m\"\n[shots]\ntime = \"t\"\nhold_out = [6, 7]\n"
    );
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut draws = Draws(5);
    let mut shots = Vec::new();
    for (shot, speed) in SPEEDS.into_iter().enumerate() {
        let mut text = String::from("t,x\n");
        for (k, x) in coast(force, speed).into_iter().enumerate() {
            writeln!(text, "{},{:.9}", 0.004 * k as f64, x + NOISE * draws.normal()).expect("a String");
        }
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\", \"v0\": {speed}}}"));
    }
    // Forces by mass are all that the records show: mass and drags that move together are hard to follow.
    let of_mass = if knows_thick { 1e-3 } else { 0.01 };
    let shots = shots.join(", ");
    let set = format!("{{\"parameter_tolerance_1sigma\": {{\"m\": {of_mass}}}, \"experiments\": [{shots}]}}");
    fs::write(folder.join("set.json"), set).expect("written");
}

/// The answer, and the names in it.
fn answer(folder: &Path) -> (String, serde_json::Value, Vec<String>) {
    let found = hyd(folder, &["discover", "study.toml", "--bench", "set.json", "--report", "report"]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    assert_eq!(report["status"], "named", "{}", found.stdout);
    let effects = report["effects"].as_array().expect("a list").iter();
    let named = effects.map(|own| own["id"].as_str().expect("a name").to_string()).collect();
    (found.stdout, report, named)
}

#[test]
fn a_further_effect_that_shots_held_out_refute_is_taken_out_again() {
    let folder = folder("refuted");
    write(&folder, bends, false);
    let (stdout, report, named) = answer(&folder);
    assert_eq!(named, ["linear_drag"], "{stdout}");
    let refuted = &report["refuted"][0];
    assert_eq!(refuted["id"], "quadratic_drag", "{stdout}");
    assert!(refuted["gap_times"].as_f64().is_some_and(|times| times > 1.0), "{stdout}");
    assert!(stdout.contains("refuted by the shots held out: quadratic_drag (drag)"), "{stdout}");
    // What is left counts as an error of the model, and is said to be there.
    assert!(stdout.contains("what every model leaves in x is") && report["remaining"].is_object(), "{stdout}");
    let unseen = |when: &str| report["gap"]["heldout"][when].as_f64().expect("a number");
    assert!(unseen("after") < 0.1 * unseen("before"), "{stdout}");
    let _ = fs::remove_dir_all(&folder);
}

#[test]
fn a_further_effect_that_shots_held_out_confirm_stays() {
    let folder = folder("confirmed");
    write(&folder, two_drags, false);
    let (stdout, report, named) = answer(&folder);
    assert_eq!(named, ["linear_drag", "quadratic_drag"], "{stdout}");
    assert_eq!(report["refuted"], serde_json::json!([]), "{stdout}");
    let _ = fs::remove_dir_all(&folder);
}

/// Alone, the drag that holds a part of another one explains more; beside that other one it does not, and nothing tells the two apart.
#[test]
fn an_effect_that_could_stand_in_the_place_of_a_named_one_is_told() {
    let folder = folder("alike");
    write(&folder, two_drags, true);
    let (stdout, report, named) = answer(&folder);
    let (oil, other) = if named[0] == "thick_drag" { (0, "linear_drag") } else { (1, "thick_drag") };
    assert_eq!(named, [["thick_drag", "linear_drag"][oil], "quadratic_drag"], "{stdout}");
    let alike = report["alike"].as_array().expect("a list");
    assert_eq!(alike.len(), 1, "{stdout}");
    assert_eq!(alike[0]["id"], other, "{stdout}");
    assert!(alike[0]["behind"].as_f64().is_some_and(|behind| behind.abs() < 10.0), "{stdout}");
    assert!(stdout.contains(&format!("{other} (drag) would explain about as much")), "{stdout}");
    let _ = fs::remove_dir_all(&folder);
}
