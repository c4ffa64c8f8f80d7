//! Models of N equal parts (texts in `tests/scale`), and chains whose components are declared one by one.
//!
//! Shared by the tests that what is translated once does not grow with N and by the benchmark that fits how the rest grows.

use std::fmt::Write;

use hyd::LibraryPath;
use hyd::clock::cpu_seconds;
use hyd_compiler::{Compilation, Goal, Options, compile};

use crate::models::{messages, root, text_of};

/// The models of N parts.
pub const MODELS: [&str; 6] = ["Loops", "Components", "Tree", "Star", "Folds", "Chain"];

/// A model of the benchmark.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// What it is called in tables.
    pub name: &'static str,
    /// Scalar variables for each part, about.
    pub variables: usize,
    source: Source,
}

#[derive(Clone, Copy, Debug)]
enum Source {
    /// A class of a file in `tests/scale`.
    Class(&'static str, &'static str),
    /// Drives of `models/single_acting_drive`.
    Drives,
    /// A class of `tests/scale/chain.hyd` whose components are declared one by one.
    ByHand,
}

/// What the benchmark translates: oscillators, heat conduction, a line with friction and a tree, each as equations in loops and
/// as arrays of components; valve drives on a rail; a chain of orifices and volumes, as arrays and declared one by one.
pub const CASES: [Case; 11] = [
    Case { name: "oscillators, for", variables: 2, source: Source::Class("scale", "Scale.Loops") },
    Case { name: "oscillators, array", variables: 10, source: Source::Class("scale", "Scale.Components") },
    Case { name: "heat, for", variables: 2, source: Source::Class("parts", "Parts.HeatFor") },
    Case { name: "heat, array", variables: 9, source: Source::Class("parts", "Parts.HeatArray") },
    Case { name: "line, for", variables: 2, source: Source::Class("parts", "Parts.LineFor") },
    Case { name: "line, array", variables: 13, source: Source::Class("parts", "Parts.LineArray") },
    Case { name: "tree, for", variables: 4, source: Source::Class("parts", "Parts.TreeFor") },
    Case { name: "tree, array", variables: 21, source: Source::Class("parts", "Parts.TreeArray") },
    Case { name: "drives on a rail", variables: 340, source: Source::Drives },
    Case { name: "chain, array", variables: 15, source: Source::Class("chain", "Chain.Array") },
    Case { name: "chain, by hand", variables: 15, source: Source::ByHand },
];

impl Case {
    /// The case of a name.
    pub fn find(name: &str) -> Option<Self> {
        CASES.into_iter().find(|case| case.name == name)
    }

    /// Text, file and class of the model with N parts; made outside the time that is measured.
    pub fn text(&self, parts: usize) -> CaseText {
        let set = vec![("N".to_string(), parts.to_string())];
        match self.source {
            Source::Class(file, class) => {
                let file = format!("tests/scale/{file}.hyd");
                CaseText { text: text_of(&file), file, class: Some(class.to_string()), set }
            }
            Source::Drives => CaseText {
                text: text_of("tests/scale/drives.hyd"),
                file: "models/single_acting_drive/rail/drivesonarail.hyd".to_string(),
                class: None,
                set,
            },
            Source::ByHand => {
                let text = chain_by_hand(&text_of("tests/scale/chain.hyd"), parts);
                CaseText { text, file: "chain.hyd".to_string(), class: None, set: Vec::new() }
            }
        }
    }
}

/// What is translated.
pub struct CaseText {
    text: String,
    file: String,
    class: Option<String>,
    set: Vec<(String, String)>,
}

impl CaseText {
    /// Translates to code; panics with the messages if there are errors.
    pub fn translate(&self) -> Compilation {
        let mut library = LibraryPath::new();
        library.add_main_file(&root().join(&self.file), &self.text);
        let options = Options { model: self.class.clone(), set: self.set.clone(), goal: Goal::Run, clock: cpu_seconds };
        let compilation = compile(&mut library, &self.file, &self.text, &options);
        assert!(!compilation.has_errors(), "{}", messages(&compilation));
        compilation
    }
}

/// The chain with every component declared and connected by a line of its own.
fn chain_by_hand(library: &str, parts: usize) -> String {
    let array = library.find("  model Array").expect("the array comes last");
    let mut text = library[..array].to_string();
    text.push_str("  model ByHand\n    Source source;\n    Plug plug;\n");
    for k in 1..=parts {
        let _ = writeln!(text, "    Orifice o{k};\n    Volume v{k};");
    }
    text.push_str("  equation\n    connect(source.a, o1.a);\n");
    for k in 1..=parts {
        let _ = writeln!(text, "    connect(o{k}.b, v{k}.a);");
        if k < parts {
            let _ = writeln!(text, "    connect(v{k}.b, o{}.a);", k + 1);
        }
    }
    let _ = writeln!(text, "    connect(v{parts}.b, plug.a);\n  end ByHand;\nend Chain;");
    text
}

/// Translates one of [`MODELS`] to code; panics with the messages if it has errors.
pub fn translate(model: &str, parts: usize) -> Compilation {
    translate_to(model, parts, Goal::Run)
}

/// The same up to a goal.
pub fn translate_to(model: &str, parts: usize, goal: Goal) -> Compilation {
    let (text, class, set) = match model {
        "Chain" => (chain(parts), None, Vec::new()),
        _ => {
            let set = vec![("N".to_string(), parts.to_string())];
            (text_of("tests/scale/scale.hyd"), Some(format!("Scale.{model}")), set)
        }
    };
    let options = Options { model: class, set, goal, clock: cpu_seconds };
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
