//! `hyd check` of a component by itself: what is connected to it is missing, and that is not a fault.

use crate::process::{Scratch, run};

#[test]
fn a_component_that_is_balanced_by_itself_passes() {
    let folder = Scratch::new();
    let two_pins = |name: &str, equations: &str| {
        let head = "connector Pin\n  Real v;\n  flow Real i;\nend Pin;\n";
        folder.write(
            &format!("{name}.hyd"),
            format!(
                "{head}model {name}\n  parameter Real R = 2;\n  Pin p;\n  Pin n;\nequation\n{equations}end {name};\n"
            ),
        );
        run(folder.path(), &["check", &format!("{name}.hyd")])
    };
    let resistor = two_pins("Resistor", "  p.i + n.i = 0;\n  p.v - n.v = R*p.i;\n");
    assert_eq!((resistor.code, resistor.stderr.as_str()), (Some(0), ""), "{}", resistor.stdout);
    let said = "balanced as a component: 2 equations, and `p`, `n` to be connected where it is used";
    assert!(resistor.stdout.contains(said), "{}", resistor.stdout);
    // One equation too few and one too many.
    assert_eq!(two_pins("Few", "  p.v - n.v = R*p.i;\n").code, Some(1));
    assert_eq!(two_pins("Many", "  p.i + n.i = 0;\n  p.v - n.v = R*p.i;\n  p.v = 1;\n").code, Some(1));
    // Alone it cannot be run.
    assert_eq!(run(folder.path(), &["simulate", "Resistor.hyd"]).code, Some(1));
}
