//! New names: what they would change is refused, and what stands in annotations is renamed with the rest.

use serde_json::{Value, json};

use super::desk::Desk;

const TEXT: &str = "package Sh
  constant Real c = 2;
  constant Real free = 3;
  type Mode = enumeration(on, off);
  function twice
    input Real u;
    output Real y = 2*u;
  end twice;
  model Base
    parameter Real R = 1;
  end Base;
  model Orifice
    extends Base;
    parameter Real k = R;
  end Orifice;
  model A
    Real x = 5;
    Real y = c*time;
    Real s = sum(i*c for i in 1:3);
    parameter Mode mode = Mode.on;
    Real zz = twice(x) + y;
    Base b(R = 2);
    annotation(Documentation(figures = {Figure(caption = \"see %{zz}\", plots = {Plot(curves = {Curve(x = b.R, y = zz)})})}));
  end A;
  model Other
    Real free = c;
  end Other;
end Sh;
";

fn rename(desk: &mut Desk, marked: &str, name: &str) -> Result<Value, String> {
    desk.ask("rename", marked, json!({ "newName": name }))
}

#[test]
fn names_that_would_change_the_model_are_refused() {
    let mut desk = Desk::open("renames", TEXT);
    for (marked, name, said) in [
        ("y = |c*time", "x", "`x` means the component `x` of `Sh.A` where `c` is used (m.hyd:18)"),
        ("y = |c*time", "i", "`i` means a loop variable where `c` is used (m.hyd:19)"),
        ("parameter Real |R = 1", "k", "`Sh.Orifice` inherits `R` and has an element `k` already"),
        ("model |Orifice", "Real", "`Real` is a predefined type"),
        ("model |Orifice", "Hyd", "`Hyd` is the name of a library"),
        ("model |Orifice", "sin", "`sin` is a function of the language"),
        ("function |twice", "time", "`time` is the independent variable"),
        (
            "Mode |mode =",
            "Mode",
            "`Mode` (m.hyd:20) means the type `Sh.Mode` and would mean the component `Mode` of `Sh.A`",
        ),
        ("Real |zz", "loop", "`loop` is not a name"),
        (
            "Real |s = sum",
            "sum",
            "means the function `sum` of the language and would mean the component `sum` of `Sh.A`",
        ),
    ] {
        let refused = rename(&mut desk, marked, name).expect_err(name);
        assert!(refused.contains(said), "{marked} {name}: {refused}");
    }
}

/// A name that is farther away than what is renamed, or hides nothing that is used, is no hindrance.
#[test]
fn names_that_change_nothing_are_taken() {
    let mut desk = Desk::open("renames-free", TEXT);
    for (marked, name) in [("Real |x = 5", "free"), ("constant Real |free", "s"), ("Real |s = sum", "size")] {
        rename(&mut desk, marked, name).expect(name);
    }
}

#[test]
fn names_in_figures_are_renamed() {
    let mut desk = Desk::open("renames-figures", TEXT);
    let lines = |edit: &Value| {
        let edits = edit["documentChanges"][0]["edits"].as_array().cloned().unwrap_or_default();
        edits.iter().map(|edit| edit["range"]["start"]["line"].as_u64().expect("a line")).collect::<Vec<_>>()
    };
    let edit = rename(&mut desk, "Real |zz", "speed").expect("a free name");
    assert_eq!(lines(&edit), [20, 22, 22], "{edit}");
    let edit = rename(&mut desk, "parameter Real |R = 1", "resistance").expect("a free name");
    assert_eq!(lines(&edit), [9, 13, 21, 22], "{edit}");
}
