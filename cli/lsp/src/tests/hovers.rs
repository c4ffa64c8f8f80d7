//! What hovers say of elements that are redeclared and modified.

use serde_json::json;

use super::desk::Desk;

const REDECLARED: &str = "package Lib
  model Base
    parameter Real R = 1e9 \"resistance\";
  end Base;
  model Pipe
    extends Base;
  end Pipe;
  model Orifice
    extends Base;
    parameter Real k(min = 1e-6) = 1e-3;
  end Orifice;
  model Net
    replaceable Pipe pipe(R = 3e9) constrainedby Base;
    replaceable Pipe other(R = 4e9);
  end Net;
  model User
    extends Net(redeclare Orifice pipe(k(min = 1e-4) = 2e-3), redeclare Pipe other);
  end User;
  model Top
    extends User;
    Real x = pipe.R + other.R + pipe.k;
    Net net(pipe(R = 10e6));
    Real y = net.pipe.R;
  end Top;
end Lib;
";

fn said(desk: &mut Desk, marked: &str) -> String {
    let hover = desk.ask("hover", marked, json!({})).expect("an answer");
    hover["contents"]["value"].as_str().unwrap_or_default().to_string()
}

/// What a declaration says of what takes its place is what stands behind `constrainedby`, and all of it without that clause (Modelica
/// 3.6, section 7.3.2).
#[test]
fn a_redeclared_element_keeps_what_its_constraint_says() {
    let mut desk = Desk::open("redeclared", REDECLARED);
    let replaced = said(&mut desk, "x = pipe.|R");
    assert!(replaced.contains("value: `1e9`\n"), "{replaced}");
    let kept = said(&mut desk, "other.|R + ");
    assert!(kept.contains("value: `4e9`, modified in `Lib.Net` (m.hyd:14)"), "{kept}");
    let given = said(&mut desk, "+ pipe.|k");
    assert!(given.contains("value: `2e-3`, modified in `Lib.User` (m.hyd:17)"), "{given}");
    let modified = said(&mut desk, "net.pipe.|R");
    assert!(modified.contains("value: `10e6`, modified in `Lib.Top`"), "{modified}");
}

/// The redeclaration itself and the names of modifiers tell what they make.
#[test]
fn modifiers_tell_what_they_say() {
    let mut desk = Desk::open("modifiers", REDECLARED);
    let new = said(&mut desk, "redeclare Orifice |pipe");
    assert!(new.contains("Lib.Orifice pipe") && new.contains("redeclared in: `Lib.User`"), "{new}");
    let types = desk.ask("typeDefinition", "redeclare Orifice |pipe", json!({})).expect("an answer");
    assert_eq!(types[0]["range"]["start"]["line"], json!(7), "{types}");
    let value = said(&mut desk, "pipe(|k(min = 1e-4)");
    assert!(value.contains("value: `2e-3`"), "{value}");
    let attribute = said(&mut desk, "pipe(k(|min = 1e-4)");
    assert!(attribute.contains("attribute of Real") && attribute.contains("value: `1e-4`"), "{attribute}");
    let nested = said(&mut desk, "net(pipe(|R = 10e6))");
    assert!(nested.contains("value: `10e6`"), "{nested}");
}
