//! Texts whose parts need each other in long chains or deep nests: each ends in an answer, none uses up the stack.
//!
//! Lengths are far beyond the limits that the language states, on a stack as large as the program's own main thread has.

use std::fmt::Write as _;

use hyd::LibraryPath;
use hyd_compiler::{Goal, Options, compile};

/// Codes of the errors and the first message of a text.
fn answer(text: String) -> (Vec<&'static str>, String) {
    let work = move || {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
        let compilation = compile(&mut LibraryPath::new(), "nest.hyd", &text, &options);
        let errors = compilation.diagnostics.iter().filter(|d| d.severity == hyd_compiler::Severity::Error);
        let codes = errors.clone().map(|d| d.code.number()).collect();
        (codes, errors.map(|d| d.message.clone()).next().unwrap_or_default())
    };
    let thread = std::thread::Builder::new().stack_size(8 << 20).spawn(work).expect("a thread");
    thread.join().expect("no panic")
}

/// `first`, then `next(i)` of the numbers from 1 on, one a line.
fn lines(first: &str, count: usize, next: impl Fn(usize) -> String) -> String {
    let mut text = format!("{first}\n");
    (1..count).for_each(|i| {
        let _ = writeln!(text, "{}", next(i));
    });
    text
}

fn is_refused(text: String, code: &str, words: &str) {
    let (codes, message) = answer(text);
    assert_eq!((codes.first().copied(), message.contains(words)), (Some(code), true), "{codes:?} {message}");
    assert!(codes.len() < 40, "one fault, {} messages", codes.len());
}

const DECAY: &str = "Real x(start = 1, fixed = true); equation der(x) = -x;";

#[test]
fn values_that_need_each_other() {
    const COUNT: usize = 20_000;
    for kind in ["constant Real", "final parameter Integer"] {
        let chain = lines(&format!("{kind} p0 = 1;"), COUNT, |i| format!("{kind} p{i} = p{} + 0;", i - 1));
        let sized = format!("Real x[integer(p{})]; equation for i in 1:1 loop der(x[i]) = 1; end for;", COUNT - 1);
        is_refused(format!("model A\n{chain}{sized} end A;"), "E0103", "values that need each other");
    }
    let packages = lines("package P0 constant Integer n = 1; end P0;", COUNT, |i| {
        format!("package P{i} constant Integer n = P{}.n; end P{i};", i - 1)
    });
    is_refused(format!("{packages} model A Real x[P19999.n]; equation x[1] = 1; end A;"), "E0103", "values that need");
    // What is computed at the start of a run may be as long as it likes.
    let chain = lines("parameter Real p0 = 1;", COUNT, |i| format!("parameter Real p{i} = p{} + 1;", i - 1));
    assert_eq!(answer(format!("model A\n{chain}{DECAY} end A;")).0, [""; 0]);
}

#[test]
fn classes_that_extend_each_other() {
    const COUNT: usize = 20_000;
    let long =
        lines(&format!("model M0 {DECAY} end M0;"), COUNT, |i| format!("model M{i} extends M{}; end M{i};", i - 1));
    is_refused(format!("{long} model A extends M{}; end A;", COUNT - 1), "E0103", "classes extend each other");
    let short = lines(&format!("model M0 {DECAY} end M0;"), COUNT, |i| format!("model M{i} = M{};", i - 1));
    is_refused(format!("{short} model A extends M{}; end A;", COUNT - 1), "E0103", "classes extend each other");
    let types = lines("type T0 = Real;", COUNT, |i| format!("type T{i} = T{};", i - 1));
    is_refused(
        format!("{types} model A T{} x; equation x = 1; end A;", COUNT - 1),
        "E0103",
        "classes extend each other",
    );
    // What people write is far below the limit.
    let some = lines(&format!("model M0 {DECAY} end M0;"), 90, |i| format!("model M{i} extends M{}; end M{i};", i - 1));
    assert_eq!(answer(format!("{some} model A extends M89; end A;")).0, [""; 0]);
}

/// The number that the language's reference states.
#[test]
fn brackets_within_brackets() {
    let model = |count: usize| format!("model A Real x = {}1{}; end A;", "(".repeat(count), ")".repeat(count));
    assert_eq!(answer(model(200)).0, [""; 0]);
    is_refused(model(201), "E0103", "more than 200 deep");
}

#[test]
fn functions_within_functions() {
    let nest = |inner: &str, name: &str| (0..190).fold(inner.to_string(), |text, _| format!("{name}({text})"));
    for (name, use_of) in
        [("sin", "Real x; equation der(x) = f61(x);"), ("cos", "constant Real c = f61(1); Real x = c;")]
    {
        let head = |i: usize| format!("function f{i} input Real u; output Real y; algorithm y :=");
        let chain = lines(&format!("{} {}; end f0;", head(0), nest("u", name)), 62, |i| {
            format!("{} {}; end f{i};", head(i), nest(&format!("f{}(u)", i - 1), name))
        });
        is_refused(format!("{chain} model A {use_of} end A;"), "E0103", "nested deeper");
    }
}

#[test]
fn derivatives_of_derivatives() {
    let chain = |count: usize| {
        let (unknowns, equations) =
            (lines("Real y0;", count, |i| format!("Real y{i};")), |i: usize| format!("y{i} = der(y{})/2;", i - 1));
        format!(
            "model A Real x(start = 1, fixed = true); {unknowns} equation der(x) = -x; {} end A;",
            lines("y0 = x*x;", count, equations)
        )
    };
    assert_eq!(answer(chain(10)).0, [""; 0]);
    // The derivatives of a product grow exponentially.
    is_refused(chain(30), "E0403", "grow too large");
    is_refused(chain(300), "E0403", "differentiated 299 times");
}
