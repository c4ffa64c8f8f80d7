//! Equations that leave variables open, or whose solutions lie between kinks: what is said of them, and what is still refused.

use crate::process::{Scratch, run};

/// A pipe without flow until 1 s: nothing says which enthalpy it brings.
const PIPE: &str = "model Pipe\n  Real m = if time < 1 then 0 else 2;\n  Real h(start = 2);\n  Real t(start = 0, fixed = true);\n\
                    equation\n  der(t) = 1;\n  m*(h - 3) = ASKED;\nend Pipe;\n";

#[track_caller]
fn simulated(asked: &str) -> (Option<i32>, String) {
    let folder = Scratch::new();
    folder.write("pipe.hyd", PIPE.replace("ASKED", asked));
    let outcome = run(folder.path(), &["simulate", "pipe.hyd", "--stop", "2", "--result", "r.csv"]);
    (outcome.code, outcome.stderr)
}

#[test]
fn what_is_left_open_is_named_with_its_time() {
    let (code, said) = simulated("0");
    assert_eq!(code, Some(0), "{said}");
    let sentence = "`h` is not determined from t = 0 s to ";
    assert!(said.contains(sentence) && said.contains("those nearest to the ones before are taken"), "{said}");
}

#[test]
fn a_contradiction_is_refused_with_the_variable() {
    for asked in ["1", "t + 1", "1e-6"] {
        let (code, said) = simulated(asked);
        assert_eq!(code, Some(3), "{asked}: {said}");
        assert!(said.contains("h is not determined (singular equations)"), "{asked}: {said}");
    }
    // A rate of 1e9 beside it excuses nothing.
    let folder = Scratch::new();
    let beside = "model Pipe\n  Real p(start = 1e9, fixed = true);\n  Real m = if time < 1 then 2 else 0;\n  Real h(start = 2);\n\
                  equation\n  der(p) = -p;\n  m*(h - 3) = 0.002;\nend Pipe;\n";
    folder.write("pipe.hyd", beside);
    let outcome = run(folder.path(), &["simulate", "pipe.hyd", "--stop", "2"]);
    assert_eq!(outcome.code, Some(3), "{}", outcome.stderr);
    assert!(
        outcome.stderr.contains("the event at t = 1 s") && outcome.stderr.contains("h is not determined"),
        "{}",
        outcome.stderr
    );
    // It holds at the start and no longer.
    let (code, said) = simulated("t");
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("the equations are singular at t = ") && said.contains("h is not determined"), "{said}");
}

/// An amplifier of a huge gain with feedback: at either limit its equations do not say where it leaves it.
const AMPLIFIER: &str = "model Amplifier\n  parameter Real gain = 1e6;\n  Real v(start = 4);\n  Real out(start = 10);\n  Real u = cos(time);\n\
                         equation\n  out = smooth(0, noEvent(if gain*v > 15 then 15 else if gain*v < -15 then -15 else gain*v));\n  \
                         (-u - v)/1e3 + (-out - v)/2e3 = 0;\nend Amplifier;\n";

#[test]
fn an_amplifier_between_its_limits_is_found_piece_by_piece() {
    let folder = Scratch::new();
    folder.write("amplifier.hyd", AMPLIFIER);
    let outcome = run(folder.path(), &["simulate", "amplifier.hyd", "--json", "--variables", "^out$"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("they were found piece by piece"), "{}", outcome.stderr);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("a summary");
    let out = summary["final"]["out"].as_f64().expect("a value");
    // out = -2 u - 3 v, and v = out/gain.
    let right = -2.0 * 1.0_f64.cos() / (1.0 + 3e-6);
    assert!((out - right).abs() < 1e-8, "{out} instead of {right}");
}

#[test]
fn a_relation_that_changes_nothing_is_not_heard_again_and_again() {
    let folder = Scratch::new();
    folder.write("arc.mo", include_str!("../../language/events/arc_that_stays_quenched.mo"));
    let outcome = run(folder.path(), &["simulate", "arc.mo", "--stop", "2", "--json"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("a summary");
    let events = summary["counters"]["state_events"].as_u64().expect("a number");
    // Some thousand where the relation is heard by each rounding.
    assert!(events < 50, "{events} events");
}
