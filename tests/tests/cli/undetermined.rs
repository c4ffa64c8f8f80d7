//! Unknowns that the equations leave undetermined: where the equations agree the run goes on and says so, where they do not it fails.

use crate::process::{Scratch, run};

fn pipe(equation: &str) -> Scratch {
    let folder = Scratch::new();
    let text = "model Pipe\n  parameter Real T_in = 3;\n  Real m = max(0, time - 0.5);\n  Real T(start = 2);\n\
                \x20 Real c(start = 0, fixed = true);\nequation\n";
    folder.write("pipe.mo", format!("{text}  {equation};\n  der(c) = m*T;\nend Pipe;\n"));
    folder
}

/// Without a flow no equation says what is in the pipe.
#[test]
fn what_no_equation_determines_keeps_its_value_and_is_said() {
    let folder = pipe("m*T = m*T_in");
    let ran =
        run(folder.path(), &["simulate", "pipe.mo", "--result", "r.csv", "--variables", "^[Tc]$", "--intervals", "4"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stderr.contains("from t = 0 s on the equations do not determine T: "), "{}", ran.stderr);
    // Nothing is left of the attempt before.
    assert_eq!(folder.names(), ["pipe.mo", "r.csv"]);
    let text = folder.read("r.csv");
    let rows: Vec<Vec<f64>> =
        text.lines().skip(1).map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
    assert_eq!((rows[0][1], rows[1][1]), (2.0, 2.0), "{text}");
    let [.., temperature, content] = rows[4][..] else { panic!("{text}") };
    assert!((temperature - 3.0).abs() < 1e-9 && (content - 0.375).abs() < 1e-5, "{text}");
}

#[test]
fn what_contradicts_itself_fails_as_ever() {
    let folder = pipe("m*T = 1");
    let ran = run(folder.path(), &["simulate", "pipe.mo"]);
    assert_eq!(ran.code, Some(3), "{}", ran.stdout);
    assert!(ran.stderr.contains("T is not determined (singular equations)"), "{}", ran.stderr);
    assert!(!ran.stderr.contains("every value fulfils them"), "{}", ran.stderr);
}
