//! Every rule of unit checking, on models that keep it and models that break it.

use super::support::{check, check_text};

const SI: &str = "  Real x(unit = \"m\"); Real y(unit = \"m\"); Real t(unit = \"s\"); Real v(unit = \"m/s\");
  Real a(unit = \"m/s2\"); Real m(unit = \"kg\"); Real f(unit = \"N\"); Real r(unit = \"1\"); Real w(unit = \"rad/s\");
  Real phi(unit = \"rad\"); Real A(unit = \"m2\"); Real p(unit = \"Pa\"); Real free; Real mm(unit = \"mm\");
  Real tc(unit = \"degC\"); Real tk(unit = \"K\"); Real bar(unit = \"bar\"); Integer n; Boolean b;\nequation\n";

#[test]
fn what_fits_is_accepted() {
    let table = [
        "x = y + 1",
        "x = 0.3",
        "x = 2*y",
        "x = y/3",
        "x = 0.5*y",
        "x = 3.141592653589793*y/4",
        "f = m*a",
        "f = m*der(v)",
        "v = der(x)",
        "x = v*time",
        "A = x*y",
        "x = sqrt(A)",
        "A = x^2",
        "A = x^3/y",
        "p = f/A",
        "r = sin(phi)",
        "phi = w*t",
        "r = exp(-t*w)",
        "r = exp(-time/t)",
        "phi = atan2(x, y)",
        "x = abs(y)",
        "x = max(0, y)",
        "x = min(x, y + 1)",
        "r = sign(x)",
        "x = if x > y then 2*y else 0",
        "b = x > 1",
        "r = (x/y)^r",
        "r = 2^r",
        "r = x/y + 1",
        "f = 20.37*x",
        "f = 0.0254*x",
        "x = n*y",
        "x = if b then x else y",
        "x = mod(y, 0.2)",
        "x = v*t*1.5",
        "mm = 1000*x",
        "x = mm/1000",
        "x = mm*0.001",
        "p = 100000*bar",
        "bar = p/100000",
        "x = mm/1000 + y",
        "x = (mm + 3*mm)/1000",
        "mm = mm",
        "tk = tc + 273.15",
        "tc = tk - 273.15",
        "tc = 0.5*(tc + tc)",
        "tk = tc - tc",
        "tc = tc + tk",
        "der(tc) = tk/t",
        "A = x*(y + 0)",
        "x = smooth(0, noEvent(if x > y then x else y))",
        "assert(x > y, \"text\")",
        "r = tanh(v/0.1)",
        "x^1.5 = sqrt(A*x)",
        "r = cos(2*3.141592653589793*t*w)",
    ];
    for equation in table {
        let checked = check(&format!("{SI}  {equation};"));
        assert!(checked.report.diagnostics.is_empty(), "{equation}: {:?}", checked.messages());
    }
}

#[test]
fn what_does_not_fit_is_named_with_both_units() {
    let table = [
        ("x = t", "units do not fit: `x` is m, but `t` is s"),
        ("f = m*v", "units do not fit: `f` is N, but `m*v` is kg.m/s"),
        ("x = x + y + t", "units do not fit: `x + y` is m, but `t` is s"),
        ("r = x - m", "units do not fit: `x` is m, but `m` is kg"),
        ("f = 2*x", "units do not fit: `f` is N, but `2*x` is m"),
        ("f = m*der(x)", "units do not fit: `f` is N, but `m*der(x)` is kg.m/s"),
        ("r = sin(x)", "`sin` needs a number without unit, but `x` is m"),
        ("r = exp(t)", "`exp` needs a number without unit, but `t` is s"),
        ("x = sin(phi)", "units do not fit: `x` is m, but `sin(phi)` is 1"),
        ("x = sqrt(x)", "units do not fit: `x` is m, but `sqrt(x)` is m(1/2)"),
        ("x = y^2", "units do not fit: `x` is m, but `y*y` is m2"),
        ("r = x^r", "a power with a variable exponent needs a base without unit, but `x` is m"),
        ("r = 2^x", "an exponent must have no unit, but `x` is m"),
        ("phi = atan2(x, t)", "units of the arguments of `atan2` do not fit: `x` is m, but `t` is s"),
        ("x = max(x, t)", "units of the arguments of `max` do not fit: `x` is m, but `t` is s"),
        ("x = if b then y else t", "units of the branches do not fit: `y` is m, but `t` is s"),
        ("b = x > t", "units of a relation do not fit: `x` is m, but `t` is s"),
        ("assert(x > t, \"text\")", "units of a relation do not fit: `x` is m, but `t` is s"),
        ("x = time", "units do not fit: `x` is m, but `time` is s"),
        ("x = mm", "units do not fit: `x` is m, but `mm` is mm"),
        ("mm = x/1000", "units do not fit: `mm` is mm, but `x/1000` is m"),
        ("p = f/A + bar", "units do not fit: `f/A` is Pa, but `bar` is bar"),
        ("tk = tc", "units do not fit: `tk` is K, but `tc` is degC"),
        ("x = -t", "units do not fit: `x` is m, but `t` is s"),
        ("x = pre(n)*t", "units do not fit: `x` is m, but `pre(n)*t` is s"),
    ];
    for (equation, message) in table {
        let checked = check(&format!("{SI}  {equation};"));
        assert_eq!(checked.messages(), [message], "{equation}");
    }
}

#[test]
fn factors_and_zero_points_come_with_the_conversion() {
    let help = |equation: &str| check(&format!("{SI}  {equation};")).report.diagnostics[0].notes[0].clone();
    assert_eq!(help("mm = x"), "a value in mm times 0.001 is one in m: the dimension is the same");
    assert_eq!(help("p = bar"), "a value in Pa times 1e-5 is one in bar: the dimension is the same");
    assert_eq!(help("tc = tk"), "a value in degC plus 273.15 is one in K");
}

#[test]
fn operands_are_marked_where_they_stand() {
    let body =
        "  Real total(unit = \"m\"); Real reach(unit = \"m\"); Real x(unit = \"m\");\n  Real load(unit = \"kg\");
equation\n  total = reach + x\n    + load;";
    let checked = check(body);
    assert_eq!(checked.messages(), ["units do not fit: `reach + x` is m, but `load` is kg"]);
    let labels = checked.labels();
    assert_eq!(labels[..2], [("load", "this is kg"), ("reach + x", "this is m")]);
    assert!(labels.iter().any(|l| l.1 == "`load` is declared in kg"), "{labels:?}");
}

#[test]
fn units_of_undeclared_variables_are_found() {
    let checked = check(&format!(
        "  Real k; Real u; Real q; Real s; Real g; Real h; Real lone; parameter Real c = 3;\n{SI}
  f = k*x; u = der(v); q = time; s = 0.3 + x; g*h = A; g/h = r; der(lone) = -lone; free = c*f;"
    ));
    assert!(checked.report.diagnostics.is_empty(), "{:?}", checked.messages());
    let expected = [
        ("k", Some("N/m")),
        ("u", Some("m/s2")),
        ("q", Some("s")),
        ("s", Some("m")),
        ("g", Some("m")),
        ("h", Some("m")),
        ("lone", None),
    ];
    for (name, unit) in expected {
        assert_eq!(checked.inferred(name), unit, "{name}");
    }
    let undecided: Vec<&str> = checked.report.undecided.iter().map(|u| u.name.as_str()).collect();
    assert_eq!(undecided, ["lone", "c", "free"]);
    assert_eq!(checked.report.undecided_scalars(), 3);
}

#[test]
fn contradictions_through_undeclared_variables_are_found() {
    let through = check(&format!("  Real u;\n{SI}  u = x;\n  t = u;"));
    assert_eq!(through.messages(), ["units do not fit: `t` is s, but `u` is m"]);
    assert!(through.labels().contains(&("u = x", "from here `u` gets m")), "{:?}", through.labels());
    let coupled = check(&format!("  Real u; Real z;\n{SI}  u*z = x; u/z = t; u*u = m*x;"));
    assert_eq!(coupled.messages().len(), 1);
    let rate = check(&format!("  Real u;\n{SI}  der(u) = x - u;"));
    assert_eq!(rate.messages().len(), 1, "a rate is not a quantity");
    // A model without units says nothing.
    let silent = check("  Real u(start = 1); Real z;\nequation\n  der(u) = -u; z = sin(time) + u;");
    assert!(silent.report.diagnostics.is_empty(), "{:?}", silent.messages());
}

#[test]
fn arrays_may_mix_units_but_agree_if_they_can() {
    let mixed = check(&format!("  Real z[2];\n{SI}  z[1] = x; z[2] = t;"));
    assert!(mixed.report.diagnostics.is_empty(), "{:?}", mixed.messages());
    assert_eq!((mixed.inferred("z[1]"), mixed.inferred("z[2]")), (Some("m"), Some("s")));
    let uniform = check(&format!("  Real z[3];\n{SI}  z[1] = x; z[2] = y;"));
    assert_eq!((uniform.inferred("z[1]"), uniform.report.inferred[0].count), (Some("m"), 3));
    let once = check(
        "  Real q[50](each unit = \"m\"); Real s[50](each unit = \"s\");\nequation\n  for k in 1:50 loop\n    q[k] = k*s[k];\n  end for;",
    );
    assert_eq!(once.messages().len(), 1);
}

#[test]
fn bindings_starts_and_connections_are_checked() {
    let binding = check("  parameter Real d(unit = \"m\") = 0.3; parameter Real A(unit = \"m2\") = d;");
    assert_eq!(binding.messages(), ["units do not fit: `A` is m2, but `d` is m"]);
    let start =
        check("  parameter Real d(unit = \"m\") = 0.3; Real t(unit = \"s\", start = d);\nequation\n  der(t) = 1;");
    assert_eq!(start.messages(), ["units do not fit: `t.start` is s, but `d` is m"]);
    let text = "package P
  connector In = input Real; connector Out = output Real;
  block S Out y(unit = \"m\"); equation y = 1; end S;
  block T In u(unit = \"N\"); end T;
  model M S s; T t; equation connect(s.y, t.u); end M;
end P;";
    let connection = check_text(text);
    assert_eq!(connection.messages(), ["units do not fit in this connection: `s.y` is m, but `t.u` is N"]);
    assert_eq!(connection.labels()[0].0, "t.u");
}

#[test]
fn mistakes_in_a_class_are_told_once() {
    let text = "package P
  model C Real x(unit = \"m\"); Real f(unit = \"N\"); equation f = x; x = 1; end C;
  model M C a; C b; C c[3]; end M;
end P;";
    let checked = check_text(text);
    assert_eq!(checked.messages(), ["units do not fit: `f` is N, but `x` is m"]);
    assert_eq!(checked.report.diagnostics[0].notes.last().map(String::as_str), Some("in the component `a`"));
}

#[test]
fn constants_put_in_by_value_are_not_taken_for_numbers() {
    let text = "package P
  constant Real p_atm(unit = \"Pa\") = 101325;
  model M Real f(unit = \"N\"); Real A(unit = \"m2\") = 1; equation f = A*p_atm; end M;
end P;";
    assert!(check_text(text).report.diagnostics.is_empty());
    let written = check("  Real f(unit = \"N\"); Real A(unit = \"m2\") = 1;\nequation\n  f = A*101325;");
    assert_eq!(written.messages(), ["units do not fit: `f` is N, but `101325*A` is m2"]);
}

#[test]
fn unreadable_units_are_told_at_the_declaration() {
    let checked = check("  Real p(unit = \"Pascal\") = 1; Real q(unit = \"m\", displayUnit = \"s\") = 1;");
    let expected = [
        "the unit \"Pascal\" of `p` has the symbol `Pascal`, which is not a unit",
        "`q` has the unit m, but shall be shown in s",
    ];
    assert_eq!(checked.messages(), expected);
    assert_eq!(checked.report.diagnostics[0].notes, ["did you mean `Pa`?"]);
}

#[test]
fn equations_without_units_are_looked_at_in_near_linear_time() {
    // An unknown unit for each of 20,000 elements, passed on from one to the next, found from the last; then a contradiction.
    let body = "  Real z[20000]; Real x(unit = \"m\") = 1; Real t(unit = \"s\") = 1;
equation\n  for k in 1:19998 loop\n    z[k] = z[k + 1];\n  end for;\n  z[19999] = x; z[20000] = t;";
    let begin = std::time::Instant::now();
    let checked = check(body);
    assert!(checked.report.diagnostics.is_empty(), "{:?}", checked.messages());
    assert_eq!((checked.inferred("z[1]"), checked.inferred("z[20000]")), (Some("m"), Some("s")));
    assert!(begin.elapsed().as_secs_f64() < 5.0, "{:?}", begin.elapsed());
}
