//! Models of N equal parts (`tests/scale/scale.hyd`), and a chain whose components are declared one by one.
//!
//! Shared by the test that what is translated once does not grow with N and by the benchmark that fits how the rest grows.

use std::fmt::Write;

use hyd::LibraryPath;
use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Options, compile};

use crate::models::{messages, text_of};

/// The models of N parts.
pub const MODELS: [&str; 6] = ["Loops", "Components", "Tree", "Star", "Folds", "Chain"];

/// Translates one of [`MODELS`] to code; panics with the messages if it has errors.
pub fn translate(model: &str, parts: usize) -> Compilation {
    let (text, class, set) = match model {
        "Chain" => (chain(parts), None, Vec::new()),
        _ => {
            let set = vec![("N".to_string(), parts.to_string())];
            (text_of("tests/scale/scale.hyd"), Some(format!("Scale.{model}")), set)
        }
    };
    let options = Options { model: class, set, goal: Goal::Run, clock: cpu_seconds };
    let compilation = compile(&mut LibraryPath::new(), "scale.hyd", &text, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    compilation
}

/// Volumes and orifices in a row, each declared and connected by a line of its own.
pub fn chain(parts: usize) -> String {
    let mut text = String::from(
        "package Chain\n\
         connector Port Real p(unit = \"Pa\", nominal = 1e5); flow Real q(unit = \"m3/s\"); end Port;\n\
         model Volume parameter Real V(unit = \"m3\") = 1e-3, E(unit = \"Pa\") = 1e9; Port a; Port b;\n\
         Real p(unit = \"Pa\", start = 1e5, fixed = true, nominal = 1e5);\n\
         equation a.p = p; b.p = p; V/E*der(p) = a.q + b.q; end Volume;\n\
         model Orifice parameter Real G(unit = \"m3/(s.Pa)\") = 1e-9; Port a; Port b;\n\
         equation a.q + b.q = 0; a.q = G*(a.p - b.p); end Orifice;\n\
         model Main\n",
    );
    for k in 1..=parts {
        let _ = writeln!(
            text,
            "  Volume v{k}(V = {}, p.start = {});\n  Orifice o{k};",
            1e-3 + 1e-6 * k as f64,
            1e5 + k as f64
        );
    }
    text.push_str("equation\n");
    for k in 1..=parts {
        let _ = writeln!(text, "  connect(v{k}.b, o{k}.a);");
        if k < parts {
            let _ = writeln!(text, "  connect(o{k}.b, v{}.a);", k + 1);
        }
    }
    text.push_str("end Main;\nend Chain;\n");
    text
}
