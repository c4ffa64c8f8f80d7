//! What a unit warns of reaches the user of `hyd simulate`, whatever way the unit is run.

use crate::foreign_units::build;
use crate::process::{Scratch, run};

/// Grows past its limit after ln 2 s; before that a second limit is passed for 9 ms.
const GROWTH: &str = "model Growth
  parameter Real limit = 2;
  output Real x(start = 1, fixed = true);
  Real wave = sin(10*time);
equation
  der(x) = x;
  assert(x < limit, \"beyond the limit\", AssertionLevel.warning);
  assert(wave > -0.999, \"the wave is low\", AssertionLevel.warning);
  annotation(experiment(StopTime = 1, Tolerance = 1e-8));
end Growth;
";

/// A ball that bounces five times, with an assertion that is checked at every communication point on the way to a bounce.
const BALL: &str = "model Ball
  output Real h(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(h) = v;
  der(v) = -9.81;
  when h < 0 then
    reinit(v, -0.7*pre(v));
  end when;
  assert(h < 2, \"beyond the roof\", AssertionLevel.warning);
  annotation(experiment(StopTime = 2, Tolerance = 1e-8));
end Ball;
";

/// Checks between an event that is found and one that has happened leave it alone.
#[test]
fn checks_at_communication_points_change_nothing() {
    // Flights last 2 e^k sqrt(2/g) with e = 0.7.
    let (g, e) = (9.81, 0.7f64);
    let (mut from, mut speed) = (f64::sqrt(2.0 / g), f64::sqrt(2.0 * g) * e);
    while from + 2.0 * speed / g < 2.0 {
        (from, speed) = (from + 2.0 * speed / g, speed * e);
    }
    let flown = 2.0 - from;
    let wanted = speed * flown - 0.5 * g * flown * flown;
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, BALL, version);
        for step in ["0.001", "0.01", "0.5"] {
            let arguments = ["simulate", "case.fmu", "--as", "co-simulation", "--step", step, "--result", "r.csv"];
            let outcome = run(scratch.path(), &arguments);
            assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{version} {step}");
            let text = scratch.read("r.csv");
            let column = text.lines().next().unwrap().split(',').position(|name| name.starts_with('h')).unwrap();
            let h: f64 = text.lines().last().unwrap().split(',').nth(column).unwrap().parse().unwrap();
            assert!((h - wanted).abs() < 1e-5, "{version} {step}: {h} and not {wanted}");
        }
    }
}

/// Lines of warnings with their times.
fn warnings(stderr: &str) -> Vec<(f64, String)> {
    let lines = stderr.lines().filter_map(|line| line.strip_prefix("warning: at t = "));
    lines.filter_map(|line| line.split_once(" s: ")).map(|(t, text)| (t.parse().unwrap(), text.to_string())).collect()
}

#[test]
fn a_unit_that_warns_is_heard() {
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, GROWTH, version);
        let blocks = run(scratch.path(), &["unit", "case.fmu", "-o", "block.hyd"]);
        assert_eq!(blocks.code, Some(0), "{}", blocks.stderr);
        let plant = "model Plant\n  Growth part;\n  annotation(experiment(StopTime = 1));\nend Plant;\n";
        scratch.write("plant.hyd", scratch.read("block.hyd") + plant);
        let ways: [&[&str]; 4] = [
            &["case.fmu", "--as", "model-exchange"],
            &["case.fmu", "--as", "co-simulation"],
            // The solver's own steps are much longer, and what they come to is still ahead of most of these points.
            &["case.fmu", "--as", "co-simulation", "--step", "0.0005"],
            &["plant.hyd", "--model", "Plant"],
        ];
        for way in ways {
            let arguments = [&["simulate"], way, &["--result", "r.csv"]].concat();
            let outcome = run(scratch.path(), &arguments);
            assert_eq!(outcome.code, Some(0), "{way:?}: {}", outcome.stderr);
            let found = warnings(&outcome.stderr);
            let of = |text: &str| found.iter().filter(|(_, line)| line.contains(text)).collect::<Vec<_>>();
            let (limit, wave) = (of("beyond the limit"), of("the wave is low"));
            let says = |(_, line): &&(f64, String)| line.starts_with("`case.fmu` says: case.hyd:");
            assert!(limit.iter().chain(&wave).all(says), "{version} {way:?}: {}", outcome.stderr);
            // A unit for model exchange checks at the steps, which may pass over the low wave; one for co-simulation at communication points, too.
            let late = if way.contains(&"co-simulation") { 0.002 } else { 0.1 };
            let after = |(time, _): &(f64, String), event: f64| (event..event + late + 1e-9).contains(time);
            assert!(limit.len() == 1 && after(limit[0], f64::ln(2.0)), "{version} {way:?}: {}", outcome.stderr);
            if way.contains(&"co-simulation") {
                let low = 0.1 * (1.5 * std::f64::consts::PI - f64::acos(0.999));
                assert!(wave.len() == 1 && after(wave[0], low), "{version} {way:?}: {}", outcome.stderr);
            }
        }
        // What does not happen is not told, and one run says nothing of the one before.
        let arguments = ["simulate", "case.fmu", "--set", "limit=3", "--stop", "0.4", "--result", "r.csv"];
        let outcome = run(scratch.path(), &arguments);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{version}");
    }
}
