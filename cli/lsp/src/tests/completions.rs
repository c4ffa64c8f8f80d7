//! What is proposed where.

use serde_json::{Value, json};

use super::desk::Desk;

const PARTS: &str = "package Lib
  type Mode = enumeration(slow, fast);
  type Pressure = Real(unit = \"Pa\");
  connector Pin
    Real v;
    flow Real i;
  end Pin;
  connector Signal = input Real;
  model Part
    Pin p;
    parameter Real R = 1;
    parameter Mode mode = Mode.slow;
    parameter Boolean on = true;
  end Part;
  model Two
    Part first;
    replaceable Part second;
    replaceable model Inside = Part;
    Signal u;
    Real y;
  end Two;
  model M
    Two two;
    Pin q;
    Real z[3];
    HERE
  end M;
end Lib;
";

/// What is proposed at `|` where a line of the model `M` is this.
fn items(desk: &mut Desk, line: &str) -> Vec<Value> {
    desk.write(&PARTS.replace("HERE", &line.replace('|', "")));
    let found = desk.ask("completion", line, json!({})).expect("an answer");
    found["items"].as_array().expect("a list").clone()
}

fn labels(desk: &mut Desk, line: &str) -> Vec<String> {
    let label = |item: &Value| item["label"].as_str().unwrap_or_default().to_string();
    items(desk, line).iter().map(label).collect()
}

/// An editor whose words begin behind a point must not write a unit twice.
#[test]
fn a_unit_takes_the_place_of_what_is_typed_of_it() {
    let mut desk = Desk::open("units", PARTS);
    let found = items(&mut desk, "Real x(unit = \"N.|\");");
    let torque = found.iter().find(|item| item["label"] == "N.m").expect("proposed");
    assert_eq!(desk.piece(&torque["textEdit"]["range"]), "N.", "{torque}");
    assert_eq!((&torque["textEdit"]["newText"], &torque["filterText"]), (&json!("N.m"), &json!("N.m")));
    let shown = labels(&mut desk, "Real x(unit = \"m3/s\", displayUnit = \"|\");");
    assert_eq!(shown, ["m3/s", "l/min"]);
    let shown = labels(&mut desk, "Pressure x(displayUnit = \"|\");");
    assert_eq!(shown, ["Pa", "bar"]);
}

#[test]
fn annotations_are_known() {
    let mut desk = Desk::open("annotations", PARTS);
    let mut has = |line: &str, wanted: &[&str], other: &str| {
        let found = labels(&mut desk, line);
        assert!(wanted.iter().all(|own| found.iter().any(|label| label == own)), "{line}: {found:?}");
        assert!(!found.iter().any(|label| label == other), "{line}: {found:?}");
    };
    has("annotation(Icon(|));", &["graphics", "coordinateSystem"], "z");
    has("annotation(Icon(graphics = {|}));", &["Rectangle", "Text"], "z");
    has("annotation(Icon(graphics = {Line(points = {{0, 0}}), Line(pattern = |)}));", &["LinePattern.Dash"], "z");
    has("annotation(Documentation(info = \"\", |));", &["figures"], "info");
    has("annotation(Documentation(figures = {Figure(|)}));", &["plots", "title"], "z");
    has(
        "annotation(Documentation(figures = {Figure(plots = {Plot(curves = {Curve(y = |)})})}));",
        &["z", "time"],
        "legend",
    );
    has("Real a annotation(Placement(|));", &["transformation"], "z");
    has("Real a annotation(|);", &["Placement", "Dialog"], "z");
}

#[test]
fn connections_take_connectors() {
    let mut desk = Desk::open("connections", PARTS);
    assert_eq!(labels(&mut desk, "equation connect(|"), ["two", "q"]);
    assert_eq!(labels(&mut desk, "equation connect(q, two.|"), ["first", "second", "u"]);
}

#[test]
fn loop_variables_are_proposed() {
    let mut desk = Desk::open("loops", PARTS);
    assert_eq!(labels(&mut desk, "equation for index in 1:3 loop z[index] = |")[0], "index");
    assert!(
        !labels(&mut desk, "equation for index in 1:3 loop z[index] = 1; end for; two.y = |").contains(&"index".into())
    );
}

#[test]
fn modifiers_and_their_values_are_proposed() {
    let mut desk = Desk::open("values", PARTS);
    let starts = |found: Vec<String>, wanted: &[&str]| assert_eq!(found[..wanted.len()], *wanted);
    starts(labels(&mut desk, "Real x(stateSelect = |);"), &["StateSelect.never", "StateSelect.avoid"]);
    starts(labels(&mut desk, "Real x(fixed = |);"), &["true", "false"]);
    starts(labels(&mut desk, "Part a(mode = |);"), &["Lib.Mode.slow", "Lib.Mode.fast"]);
    starts(labels(&mut desk, "Two a(first(on = |));"), &["true", "false"]);
    assert_eq!(labels(&mut desk, "Part a(R = 1, |, on = true);"), ["p", "mode", "redeclare", "each", "final"]);
    assert_eq!(labels(&mut desk, "Two a(redeclare Part |);"), ["second"]);
    assert_eq!(labels(&mut desk, "Two a(redeclare model |);"), ["Inside"]);
}

/// Functions of the language are called in the ways that it knows.
#[test]
fn calls_of_predefined_functions_are_told() {
    let mut desk = Desk::open("signatures", PARTS);
    let mut told = |line: &str| {
        desk.write(&PARTS.replace("HERE", &line.replace('|', "")));
        let help = desk.ask("signatureHelp", line, json!({})).expect("an answer");
        let shown = help["activeSignature"].as_u64().unwrap_or_default() as usize;
        format!("{} {}", help["signatures"][shown]["label"], help["activeParameter"])
    };
    assert_eq!(told("equation z[1] = sin(|"), "\"sin(angle in rad)\" 0");
    assert_eq!(told("equation z[1] = atan2(1, |"), "\"atan2(y, x)\" 1");
    assert_eq!(told("equation z[1] = delay(z[2], 1, |"), "\"delay(x, delayTime, delayMax)\" 2");
    assert_eq!(told("equation z = fill(1, 2, 3, |"), "\"fill(value, n, ...)\" 2");
}
