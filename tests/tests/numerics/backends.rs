//! Random models run natively and interpreted: the same rows to the last bit, as scalars, in loops, with events and functions.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use hyd_compiler::{Goal, Options, compile};
use hyd_payload::{Backend, Loaded, format};
use hyd_results::Trajectory;
use hyd_runtime::simulate;
use hyd_system::DaeSystem;
use hyd_tests::models::messages;
use proptest::prelude::*;

/// An expression over `x[i]`, parameters and time.
#[derive(Clone, Debug)]
enum Term {
    Number(f64),
    State(usize),
    Time,
    Parameter,
    Unary(usize, Box<Term>),
    Binary(usize, Box<Term>, Box<Term>),
    Choice(Box<Term>, Box<Term>, Box<Term>),
}

const UNARY: [&str; 8] = ["sin", "cos", "tanh", "exp", "abs", "sign", "mean", "sqrt"];
const BINARY: [&str; 6] = ["+", "-", "*", "/", "min", "max"];

fn term() -> impl Strategy<Value = Term> {
    let leaf = prop_oneof![
        (-3.0..3.0f64).prop_map(Term::Number),
        (0usize..3).prop_map(Term::State),
        Just(Term::Time),
        Just(Term::Parameter),
    ];
    leaf.prop_recursive(4, 20, 3, |inner| {
        prop_oneof![
            (0..UNARY.len(), inner.clone()).prop_map(|(f, a)| Term::Unary(f, Box::new(a))),
            (0..BINARY.len(), inner.clone(), inner.clone()).prop_map(|(f, a, b)| Term::Binary(
                f,
                Box::new(a),
                Box::new(b)
            )),
            (inner.clone(), inner.clone(), inner).prop_map(|(c, a, b)| Term::Choice(
                Box::new(c),
                Box::new(a),
                Box::new(b)
            )),
        ]
    })
}

impl Term {
    /// Text that has a finite value everywhere.
    fn text(&self, state: &dyn Fn(usize) -> String) -> String {
        match self {
            Term::Number(value) => format!("({value})"),
            Term::State(k) => state(*k),
            Term::Time => "time".into(),
            Term::Parameter => "p".into(),
            Term::Unary(f, a) => match UNARY[*f] {
                "exp" => format!("exp(-abs({}))", a.text(state)),
                "sqrt" => format!("sqrt(1 + ({})^2)", a.text(state)),
                name => format!("{name}({})", a.text(state)),
            },
            Term::Binary(f, a, b) => {
                let (a, b) = (a.text(state), b.text(state));
                match BINARY[*f] {
                    "/" => format!("({a})/(1 + ({b})^2)"),
                    name @ ("min" | "max") => format!("{name}({a}, {b})"),
                    name => format!("(({a}) {name} ({b}))"),
                }
            }
            Term::Choice(c, a, b) => {
                let (c, a, b) = (c.text(state), a.text(state), b.text(state));
                format!("(if {c} > 0.3 then {a} else {b})")
            }
        }
    }
}

/// Three states, or three arrays of them in a loop; bounded, whatever the terms are.
fn model(terms: &[Term], algebraic: &Term, looped: bool) -> String {
    let mut text = "package P\n  function mean\n    input Real a;\n    output Real m;\n  algorithm\n    m := 0;\n    \
        for i in 1:4 loop\n      m := m + sin(i*a)/i;\n      if m > 0.9 then break; end if;\n    end for;\n  end mean;\n\
        model M\n  parameter Real p = 0.7;\n"
        .to_string();
    let (size, index) = if looped { ("[40]", "[i]") } else { ("", "") };
    let each = if looped { "each " } else { "" };
    for k in 0..3 {
        let _ = writeln!(text, "  Real x{k}{size}({each}start = 0.{k}, {each}fixed = true);");
    }
    let _ = writeln!(text, "  Real z{size};\n  discrete Real hits(start = 0, fixed = true);\nequation");
    let state = |k: usize| format!("x{k}{index}");
    if looped {
        text.push_str("for i in 1:40 loop\n");
    }
    for (k, term) in terms.iter().enumerate() {
        let _ = writeln!(text, "  der(x{k}{index}) = -x{k}{index} + tanh({}) + 0.1*z{index};", term.text(&state));
    }
    let _ = writeln!(text, "  z{index} + 0.2*tanh(z{index}) = tanh({});", algebraic.text(&state));
    if looped {
        text.push_str("end for;\n");
    }
    let first = if looped { "x0[1]" } else { "x0" };
    let _ = writeln!(
        text,
        "  when {{{first} > 0.2, sample(0.25, 0.25)}} then\n    hits = pre(hits) + {first};\n  end when;"
    );
    text.push_str("end M;\nend P;\n");
    text
}

fn rows(system: &mut dyn DaeSystem) -> (String, Vec<u64>) {
    let mut rows = Trajectory::new();
    let outcome = simulate(system, &hyd_runtime::Options::new(0.0, 1.0), &mut rows, &|| false);
    let bits = (0..rows.len()).flat_map(|k| rows.row(k).to_vec()).map(f64::to_bits).collect();
    (format!("{outcome:?}"), bits)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, ..ProptestConfig::default() })]
    #[test]
    fn native_code_and_interpreter_run_alike(
        terms in prop::collection::vec(term(), 3),
        algebraic in term(),
        looped in any::<bool>(),
    ) {
        let text = model(&terms, &algebraic, looped);
        let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
        let compilation = compile(&mut hyd::LibraryPath::new(), "p.hyd", &text, &options);
        let model = compilation.model.as_ref();
        let model = model.ok_or_else(|| TestCaseError::fail(format!("{text}\n{}", messages(&compilation))))?;
        let native = rows(&mut model.instantiate());
        let interpreted = rows(&mut model.on(Backend::Vm).unwrap().instantiate());
        prop_assert_eq!(&native, &interpreted, "{}", text);
        // The same out of bytes.
        let read = format::read(&format::write(model.payload()), true).unwrap();
        let loaded = std::sync::Arc::new(Loaded::new(read, Backend::Native).unwrap());
        prop_assert_eq!(&native, &rows(&mut loaded.instantiate()), "{}", text);
    }
}
