//! Long equations written by hand or by a program: tables of branches and sums of thousands of terms.
//!
//! They are as deep as they are long, so that whoever walks them by recursion runs out of stack, and whoever looks at all of them
//! for each of them never ends.  Values follow from the text.

use hyd::LibraryPath;
use hyd_compiler::{Goal, Options, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::simulate;
use hyd_tests::runs::{instance, on_grid};

/// `y` at a time, on a stack as large as the program's own main thread has.
fn value(text: String, at: f64) -> f64 {
    let work = move || {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
        let compilation = compile(&mut LibraryPath::new(), "long.hyd", &text, &options);
        assert!(!compilation.has_errors(), "{:?}", compilation.diagnostics.first());
        let mut system = instance(&compilation, &[]);
        let mut rows = Trajectory::new();
        simulate(&mut system, &on_grid(at, 4, 1e-8), &mut rows, &|| false).expect("runs to its end");
        rows.series("y").expect("a `y`").value(at, Side::After)
    };
    let thread = std::thread::Builder::new().stack_size(8 << 20).spawn(work).expect("a thread");
    thread.join().expect("no panic")
}

fn is(text: String, at: f64, expected: f64) {
    let head: String = text.chars().take(200).collect();
    let found = value(text, at);
    assert!((found / expected - 1.0).abs() < 1e-9, "{found}, not {expected}: {head}");
}

const BRANCHES: usize = 20_000;

/// `if u < 1 then 1*u elseif u < 2 then 2*u ...` with what comes after `then`, and `last` behind `else`.
fn table(u: &str, then: impl Fn(String) -> String, last: &str) -> String {
    table_of(BRANCHES, u, then, last)
}

fn table_of(branches: usize, u: &str, then: impl Fn(String) -> String, last: &str) -> String {
    let branch =
        |k: usize| format!("{} {u} < {k} then {}\n", if k == 1 { "if" } else { "elseif" }, then(format!("{k}*{u}")));
    (1..branches).map(branch).collect::<String>() + "else " + last
}

#[test]
fn tables_as_expressions() {
    let text = table("time", |value| value, "0");
    is(format!("model M Real y = {text}; end M;"), 3.5, 4.0 * 3.5);
}

#[test]
fn tables_as_equations() {
    let text = table("time", |value| format!("z = time; y = {value};"), "y = 0; z = time;");
    is(format!("model M Real y; Real z; equation {text} end if; end M;"), 3.5, 4.0 * 3.5);
}

#[test]
fn tables_as_statements_of_models() {
    let text = table("time", |value| format!("y := {value};"), "y := 0;");
    is(format!("model M Real y; algorithm {text} end if; end M;"), 3.5, 4.0 * 3.5);
}

#[test]
fn tables_in_functions() {
    let text = table("u", |value| format!("y := {value};"), "y := 0;");
    let function = format!("function f input Real u; output Real y; algorithm {text} end if; end f;");
    is(format!("{function} model M Real y = f(time); end M;"), 3.5, 4.0 * 3.5);
}

/// A loop that the run ends makes steps of the table; each of its four turns adds `4*u`.
#[test]
fn tables_in_functions_with_loops() {
    let statements = table("u", |value| format!("y := y + {value};"), "y := 0;");
    // Each call in a branch takes registers, of which a function has 16384.
    let expression = table_of(2_000, "u", |value| format!("g(k, {value})"), "0");
    let inner = "function g input Integer k; input Real u; output Real y; algorithm y := 0; for i in 1:k loop y := y + u/k; end for; end g;";
    for body in [format!("{statements} end if;"), format!("y := y + ({expression});")] {
        let function = format!(
            "function f input Real u; output Real y; algorithm y := 0; for k in 1:integer(u + 1) loop {body} end for; end f;"
        );
        is(format!("{inner} {function} model M Real y = f(time); end M;"), 3.5, 4.0 * 4.0 * 3.5);
    }
}

#[test]
fn chains_of_when() {
    const EVENTS: usize = 4_000;
    let branch = |k: usize| format!("{} time > {k} then y = {k};\n", if k == 1 { "when" } else { "elsewhen" });
    let text: String = (1..EVENTS).map(branch).collect();
    is(format!("model M discrete Real y(start = 0, fixed = true); equation {text} end when; end M;"), 3.5, 3.0);
}

/// `x_k = k t`, so that the terms `k x_k` add up to `n(n + 1)(2n + 1)/6 t`, and those of `x_k^2` to as much times `t^2`.
#[test]
fn sums_of_many_terms() {
    const TERMS: usize = 16_000;
    let n = TERMS as f64;
    let squares = n * (n + 1.0) * (2.0 * n + 1.0) / 6.0;
    let model = |left: &str, terms: String, more: &str| {
        format!(
            "model M Real x[{TERMS}] = {{k*time for k in 1:{TERMS}}}; Real y{more}; equation {left} = {terms}; end M;"
        )
    };
    let sum = |term: &dyn Fn(usize) -> String| (1..=TERMS).map(|k| format!(" + {}", term(k))).collect::<String>();
    is(model("y", sum(&|k| format!("x[{k}]*{k}")), ""), 2.0, 2.0 * squares);
    is(model("y", sum(&|k| format!("x[{k}]^2")), ""), 2.0, 4.0 * squares);
    is(model("der(y)", sum(&|k| format!("{k}*der(x[{k}])")), "(start = 0, fixed = true)"), 2.0, 2.0 * squares);
    // Signs that alternate: 1 - 2 + 3 - ... - n = -n/2.
    let signs = (1..=TERMS).map(|k| format!(" {} x[{k}]", if k % 2 == 1 { '+' } else { '-' })).collect();
    is(model("y", signs, ""), 2.0, -n);
}
