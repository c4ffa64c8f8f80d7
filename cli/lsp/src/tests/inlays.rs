//! Hints beside the text.

use serde_json::Value;

use super::desk::Desk;

const TEXT: &str = "model M
  type Mode = enumeration(slow, fast);
  parameter Real m(unit = \"kg\") = 2;
  parameter Real c(unit = \"kg\") = m*3;
  parameter Real d(unit = \"kg\", start = 1) = 7;
  parameter Boolean heavy = m > 1;
  parameter Mode mode = if heavy then Mode.fast else Mode.slow;
  Real z[3];
  Real w[2];
  Integer count(start = 0, fixed = true);
  Real p;
  Real q;
equation
  z = {time, 2*time, 3*time};
  for i in 1:2 loop
    w[i] = i*time;
  end for;
  when time > 1 then
    count = pre(count) + 1;
  end when;
  p + q*q = time + 3;
  p - q*q*q = 1;
end M;
";

/// Line and label of each hint.
fn hints(desk: &mut Desk) -> Vec<String> {
    let hints = desk.ask_all("inlayHint");
    let shown = |hint: &Value| format!("{} {}", hint["position"]["line"], hint["label"].as_str().unwrap_or_default());
    hints.as_array().expect("a list").iter().map(shown).collect()
}

/// Values of parameters as a text has them, and what arrays of equations and those at events determine.
#[test]
fn values_and_determined_variables_are_told() {
    let mut desk = Desk::open("inlays", TEXT);
    let hints: Vec<String> = hints(&mut desk).into_iter().filter(|hint| !hint.contains('[')).collect();
    assert_eq!(hints, ["3 = 6", "5 = true", "6 = fast", "13 → z", "15 → w", "18 → count", "20 → p"]);
}

const CIRCUIT: &str = "connector Pin
  Real v(unit = \"V\");
  flow Real i(unit = \"A\");
end Pin;

model Source
  Pin p;
  Pin n;
equation
  p.v - n.v = 12*sin(time);
  p.i + n.i = 0;
end Source;

model Resistor
  parameter Real R(unit = \"Ohm\") = 10;
  Pin p;
  Pin n;
equation
  p.v - n.v = R*p.i;
  p.i + n.i = 0;
end Resistor;

model Capacitor
  Pin p;
  Pin n;
  Real u(start = 0, fixed = true, unit = \"V\");
equation
  u = p.v - n.v;
  p.i = 1e-6*der(u);
  p.i + n.i = 0;
end Capacitor;

model Ground
  Pin p;
equation
  p.v = 0;
end Ground;

model Circuit
  Source source;
  Resistor r;
  Capacitor c;
  Ground ground;
equation
  connect(source.p, r.p);
  connect(r.n, c.p);
  connect(c.n, ground.p);
  connect(source.n, ground.p);
end Circuit;
";

/// The source and the capacitor hold the potentials of their pins, the resistor is given both.
#[test]
fn the_causality_of_connectors_is_told() {
    let mut desk = Desk::open("causality", CIRCUIT);
    let hints: Vec<String> =
        hints(&mut desk).into_iter().filter(|hint| hint.contains("p.v") && !hint.starts_with("3 ")).collect();
    let components = CIRCUIT.lines().position(|line| line == "  Source source;").expect("a line");
    let told = |k: usize, text: &str| format!("{} {text}", components + k);
    let of_components: Vec<&String> =
        hints.iter().filter(|hint| (components..components + 4).any(|k| hint.starts_with(&format!("{k} ")))).collect();
    assert_eq!(of_components, [&told(0, "→ p.v"), &told(1, "← p.v, n.v"), &told(2, "→ p.v")], "{hints:?}");
}
