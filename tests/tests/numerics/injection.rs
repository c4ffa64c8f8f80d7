//! Terms injected into equations: found by path and line, zero until set, checked against closed forms.

use hyd_compiler::{
    Code, Compilation, Goal, Injection, InjectionSite, Instance, Options as CompilerOptions, TermShape, compile_with,
    injection_sites,
};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options, simulate};
use hyd_system::{DaeSystem, Place};
use hyd_tests::models::{messages, root, text_of};

const OSCILLATOR: &str = "model Oscillator
  model Mass
    parameter Real m = 2;
    Real x(start = 1, fixed = true, unit = \"m\");
    Real v(start = 0, fixed = true, unit = \"m/s\");
    Real f(unit = \"N\");
  equation
    der(x) = v;
    m*der(v) = f;
  end Mass;
  Mass a;
  parameter Real k(unit = \"N/m\") = 8;
equation
  a.f = -k*a.x;
end Oscillator;";

const CHOICES: CompilerOptions = CompilerOptions { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };

fn term(path: &str, line: u32, shape: TermShape) -> Injection {
    Injection { path: path.to_string(), file: None, line, name: "extra".to_string(), shape }
}

fn translate(text: &str, terms: &[Injection]) -> Compilation {
    compile_with(&mut hyd::LibraryPath::new(), "case.hyd", text, &CHOICES, terms)
}

fn system(compilation: &Compilation) -> Instance {
    assert!(!compilation.has_errors(), "{}", messages(compilation));
    compilation.model.as_ref().expect("translated").instantiate()
}

fn set(system: &mut Instance, name: &str, value: f64) {
    let tables = system.tables().clone();
    let (variable, element) = tables.find(name).unwrap_or_else(|| panic!("no `{name}`"));
    let Place::Parameter(index) = variable.sources[element].place else { panic!("`{name}` is not a parameter") };
    system.set_parameter(index as usize, value).expect("settable");
}

fn run(system: &mut Instance, sensitivity: &[&str]) -> Trajectory {
    let sensitivity = sensitivity.iter().map(|name| name.to_string()).collect();
    let options = Options { intervals: 100, sensitivity, ..Options::new(0.0, 1.0).with_tolerance(1e-10) };
    let mut rows = Trajectory::new();
    simulate(system, &options, &mut rows, &|| false).unwrap_or_else(|error| panic!("{error}"));
    rows
}

fn value(rows: &Trajectory, name: &str, t: f64) -> f64 {
    rows.series(name).unwrap_or_else(|| panic!("no `{name}`")).value(t, Side::After)
}

#[test]
fn a_constant_force_moves_the_rest_position() {
    // 2 x'' = -8 x + c: x = c/8 + (1 - c/8) cos 2t, so dx/dc = (1 - cos 2t)/8.
    let compilation = translate(OSCILLATOR, &[term("", 14, TermShape::Constant)]);
    let mut system = system(&compilation);
    let plain = run(&mut system, &["extra"]);
    for t in [0.0, 0.3, 0.9] {
        assert!((value(&plain, "a.x", t) - (2.0 * t).cos()).abs() < 1e-8);
        let expected = (1.0 - (2.0 * t).cos()) / 8.0;
        assert!((value(&plain, "d(a.x)/d(extra)", t) - expected).abs() < 1e-8);
    }
    set(&mut system, "extra", 4.0);
    let pushed = run(&mut system, &[]);
    assert!((value(&pushed, "a.x", 0.9) - (0.5 + 0.5 * 1.8f64.cos())).abs() < 1e-8);
}

#[test]
fn an_expression_is_read_in_the_scope_of_the_component() {
    // Inside the mass: m v' = f - d v with the names of the mass.
    let shape = TermShape::Expression("-v".to_string());
    let compilation = translate(OSCILLATOR, &[term("a", 9, shape)]);
    let mut system = system(&compilation);
    let d = 1.0;
    set(&mut system, "extra", d);
    let rows = run(&mut system, &[]);
    let (damping, w) = (d / 4.0, (4.0f64 - d * d / 16.0).sqrt());
    for t in [0.2f64, 0.7, 1.0] {
        let x = (-damping * t).exp() * ((w * t).cos() + damping / w * (w * t).sin());
        assert!((value(&rows, "a.x", t) - x).abs() < 1e-8, "{} not {x} at {t}", value(&rows, "a.x", t));
    }
}

#[test]
fn nodes_over_time_are_parameters() {
    // x' = p(t) with p through (0.2, 0), (0.4, 1), (0.8, 3): areas of triangles and trapezoids.
    let text = "model M\n  Real x(start = 0, fixed = true);\nequation\n  der(x) = 0;\nend M;";
    let compilation = translate(text, &[term("", 4, TermShape::PiecewiseLinear(vec![0.2, 0.4, 0.8]))]);
    let mut system = system(&compilation);
    set(&mut system, "extra[2]", 1.0);
    set(&mut system, "extra[3]", 3.0);
    let rows = run(&mut system, &["extra[2]", "extra[3]"]);
    assert!(value(&rows, "x", 0.2).abs() < 1e-8);
    assert!((value(&rows, "x", 0.4) - 0.1).abs() < 1e-8);
    assert!((value(&rows, "x", 0.8) - (0.1 + 0.8)).abs() < 1e-8);
    assert!((value(&rows, "d(x)/d(extra[2])", 0.8) - 0.3).abs() < 1e-8);
    assert!((value(&rows, "d(x)/d(extra[3])", 0.8) - 0.2).abs() < 1e-8);
}

const PENDULUM: &str = "model M
  Real x(start = 0.6, fixed = true); Real y(start = -0.8); Real vx(start = 0, fixed = true); Real vy; Real F;
equation
  der(x) = vx;
  der(y) = vy;
  der(vx) = -F*x;
  der(vy) = -F*y - 9.81;
  x^2 + y^2 = 1;
end M;";

fn refusal(text: &str, injection: Injection) -> String {
    let compilation = translate(text, &[injection]);
    let found = compilation.diagnostics.iter().find(|diagnostic| diagnostic.code == Code::Injection);
    assert!(found.is_some(), "{}", messages(&compilation));
    messages(&compilation)
}

#[test]
fn terms_without_a_place_are_refused_with_the_reason() {
    let text = refusal(PENDULUM, term("", 8, TermShape::Constant));
    assert!(text.contains("has to be differentiated") && text.contains("x^2 + y^2 = 1"), "{text}");
    let text = refusal(PENDULUM, term("", 1, TermShape::Constant));
    assert!(text.contains("none on line 1") && text.contains("4, 5, 6, 7, 8"), "{text}");
    let text = refusal(PENDULUM, term("arm", 4, TermShape::Constant));
    assert!(text.contains("`arm` has none on line 4"), "{text}");
    let text = refusal(PENDULUM, term("", 6, TermShape::PiecewiseLinear(vec![1.0, 1.0])));
    assert!(text.contains("ascending"), "{text}");
    let unknown = translate(PENDULUM, &[term("", 6, TermShape::Expression("nobody".to_string()))]);
    assert!(messages(&unknown).contains("nobody") && unknown.has_errors());
    for (shape, said) in [("1 +", "found the end of the file"), ("v; x", "found `;`"), ("", "expected an expression")] {
        let broken = translate(PENDULUM, &[term("", 6, TermShape::Expression(shape.to_string()))]);
        assert!(broken.has_errors() && messages(&broken).contains(said), "{shape}: {}", messages(&broken));
    }
}

#[test]
fn sites_say_what_is_there() {
    let (sites, _) = injection_sites(&mut hyd::LibraryPath::new(), "case.hyd", OSCILLATOR, &CHOICES);
    let listed: Vec<(&str, u32, &str, Option<&str>)> =
        sites.iter().map(|s| (s.path.as_ref(), s.line, s.text.as_str(), s.unit.as_deref())).collect();
    assert_eq!(
        listed,
        [("", 14, "a.f = -k*a.x", Some("N")), ("a", 8, "der(x) = v", Some("m/s")), ("a", 9, "m*der(v) = f", Some("N"))]
    );
    assert_eq!(sites[0].variables, ["a.f", "a.x"]);
    assert_eq!(sites[2].variables, ["der(a.v)", "a.f"]);
    let (sites, _) = injection_sites(&mut hyd::LibraryPath::new(), "case.hyd", PENDULUM, &CHOICES);
    let refused: Vec<u32> = sites.iter().filter(|site| site.refused.is_some()).map(|site| site.line).collect();
    assert!(refused.contains(&8) && !refused.contains(&6) && !refused.contains(&7), "{refused:?}");
}

#[test]
fn every_site_of_the_drive_takes_a_term() {
    let file = "models/single_acting_drive/drive.hyd";
    let text = text_of(file);
    let library = || {
        let mut library = hyd::LibraryPath::new();
        library.add_main_file(&root().join(file), &text);
        library
    };
    let (sites, _) = injection_sites(&mut library(), file, &text, &CHOICES);
    let open: Vec<&InjectionSite> = sites.iter().filter(|site| site.refused.is_none()).collect();
    println!(
        "{} sites, {} open, {} with unit",
        sites.len(),
        open.len(),
        open.iter().filter(|s| s.unit.is_some()).count()
    );
    assert!(open.len() > 50);
    assert!(open.iter().any(|s| &*s.path == "sh.mass" && s.unit.as_deref() == Some("N")), "{sites:#?}");
    let terms: Vec<Injection> = open
        .iter()
        .enumerate()
        .map(|(k, site)| Injection {
            path: site.path.to_string(),
            file: Some(site.file.to_string()),
            line: site.line,
            name: format!("term{k}"),
            shape: TermShape::Constant,
        })
        .collect();
    let with = compile_with(&mut library(), file, &text, &CHOICES, &terms);
    let without = compile_with(&mut library(), file, &text, &CHOICES, &[]);
    let options = Options { intervals: 50, event_rows: false, ..Options::new(0.0, 0.004).with_tolerance(1e-9) };
    let rows = [&with, &without].map(|compilation| {
        let mut rows = Trajectory::new();
        let result = simulate(&mut system(compilation), &options, &mut rows, &|| false);
        result.unwrap_or_else(|error| panic!("{error}"));
        rows
    });
    for name in ["y", "x", "p_R", "i"] {
        let Some(series) = rows[1].series(name) else { continue };
        let size = series.values().iter().fold(0.0f64, |most, v| most.max(v.abs()));
        let other = rows[0].series(name).expect("the same variables").values();
        for (a, b) in series.values().iter().zip(other) {
            assert!((a - b).abs() <= 1e-6 * size, "{name}: {a} and {b}");
        }
    }
}

#[test]
fn a_term_that_splits_a_loop_keeps_its_own_amplitude() {
    // The condition on the counter cuts the loop: what the first attempt has declared is taken back, while the delay comes after it.
    let text = "model M
  Real x[4](each start = 1, each fixed = true);
  Real y;
equation
  for k in 1:4 loop
    der(x[k]) = -x[k];
  end for;
  y = delay(x[1], 0.1);
end M;";
    let shape = TermShape::Expression("if k > 2 then x[k] else 2*x[k]".to_string());
    let compilation = translate(text, &[term("", 6, shape)]);
    let mut system = system(&compilation);
    let rows = run(&mut system, &[]);
    for name in ["x[1]", "x[2]", "x[3]", "x[4]"] {
        assert!(
            (value(&rows, name, 0.9) - (-0.9f64).exp()).abs() < 1e-8,
            "{name}: an amplitude of zero changes nothing"
        );
    }
    set(&mut system, "extra", 0.25);
    let rows = run(&mut system, &["extra"]);
    // x' = -x + 2 a x for the first two, x' = -x + a x for the others.
    for (name, factor) in [("x[1]", 2.0), ("x[2]", 2.0), ("x[3]", 1.0), ("x[4]", 1.0)] {
        let expected = ((-1.0 + 0.25 * factor) * 0.9f64).exp();
        assert!((value(&rows, name, 0.9) - expected).abs() < 1e-7, "{name}");
        let slope = format!("d({name})/d(extra)");
        assert!((value(&rows, &slope, 0.9) - 0.9 * factor * expected).abs() < 1e-6, "{slope}");
    }
    // Before the delay time y is x[1] at the start, after it x[1] a tenth of a second ago.
    assert!((value(&rows, "y", 0.9) - (-0.5 * 0.8f64).exp()).abs() < 1e-6);
}
