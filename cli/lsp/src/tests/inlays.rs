//! Hints beside the text.

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

/// Values of parameters as a text has them, and what arrays of equations and those at events determine.
#[test]
fn values_and_determined_variables_are_told() {
    let mut desk = Desk::open("inlays", TEXT);
    let hints = desk.ask_all("inlayHint");
    let hints: Vec<String> = hints
        .as_array()
        .expect("a list")
        .iter()
        .map(|hint| format!("{} {}", hint["position"]["line"], hint["label"].as_str().unwrap_or_default()))
        .filter(|hint| !hint.contains('['))
        .collect();
    assert_eq!(hints, ["3 = 6", "5 = true", "6 = fast", "13 → z", "15 → w", "18 → count", "20 → p"]);
}
