//! What `--set` takes: values as the model would write them, literals and strings by their bare name; the last one
//! said, within limits.

use crate::process::{Scratch, assert_no_panic, run};

const MODEL: &str = "model M\n  type E = enumeration(a, b);\n  parameter E e = E.a;\n  parameter E size = E.a;\n  \
                     parameter E all[2] = {E.a, E.b};\n  parameter String pair[2] = {\"x\", \"y\"};\n  parameter String s = \"one\";\n  \
                     Real v[if size == E.a then 1 else 2];\n  Real x = if e == E.a then 10 else 20;\n  \
                     Real y = if s == \"one\" then 1 else 2;\n  Real z = if all[1] == E.a then 3 else 4;\n  Real u = if pair[1] == \"a,b\" then 5 else 6;\n  \
                     Real w = if size == E.a then 6 else 7;\n\
                     equation\n  v = fill(5, if size == E.a then 1 else 2);\nend M;\n";

fn last_row(set: &str) -> (String, String) {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    let outcome = run(folder.path(), &["simulate", "m.hyd", "--set", set, "--intervals", "1", "--result", "r.csv"]);
    assert_no_panic(&outcome);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{set}");
    let text = folder.read("r.csv");
    let lines: Vec<&str> = text.lines().collect();
    (lines[0].to_string(), lines[lines.len() - 1].to_string())
}

/// `x' = -x` from a start value that is set: the solution is that value times `exp(-1)`.
#[test]
fn start_values_are_set_by_the_name_of_the_variable() {
    let folder = Scratch::new();
    folder.write("m.hyd", "model M\n  model P\n    parameter Real s = 1;\n    Real x(start = s, fixed = true);\n    Real n;\n    Integer k(start = 1, fixed = true);\n  equation\n    der(x) = -x;\n    n = 2*x;\n    when time > 2 then\n      k = 2;\n    end when;\n  end P;\n  P p;\nend M;\n");
    let at_end = |set: &[&str]| {
        let mut arguments = vec!["simulate", "m.hyd", "--stop", "1", "--tolerance", "1e-9", "--result", "r.csv"];
        set.iter().for_each(|set| arguments.extend(["--set", set]));
        let outcome = run(folder.path(), &arguments);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{set:?}");
        let text = folder.read("r.csv");
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        let at = lines[0].iter().position(|name| *name == "p.x").unwrap();
        lines[lines.len() - 1][at].parse::<f64>().unwrap()
    };
    for (set, start) in
        [(&["p.x.start=-3"][..], -3.0), (&["p.s=2"], 2.0), (&["p.s=2", "p.x.start=5", "p.x.start=0.5"], 0.5)]
    {
        assert!((at_end(set) - start * (-1.0_f64).exp()).abs() < 1e-7, "{set:?}");
    }
    for (set, expected) in [
        ("p.x.start=a", "`p.x.start` cannot be set to `a`: it is not a number"),
        ("p.x.start=inf", "`p.x.start` cannot be set to `inf`: it is not a number"),
        ("p.k.start=3", "`p.k.start` cannot be set to `3`: only start values of type Real can be set"),
        ("p.n.start=3", "the model has no parameter `p.n.start`"),
        ("x.start=3", "the model has no parameter `x.start`"),
    ] {
        let outcome = run(folder.path(), &["simulate", "m.hyd", "--set", set]);
        assert!(
            outcome.code == Some(1) && outcome.stderr.contains(expected),
            "{set}: {:?} {}",
            outcome.code,
            outcome.stderr
        );
    }
}

#[test]
fn literals_and_strings_are_set_by_their_name() {
    let value = |set: &str, name: &str| {
        let (head, row) = last_row(set);
        let at = head.split(',').position(|column| column.trim_matches('"') == name);
        row.split(',').nth(at.unwrap()).unwrap().parse::<f64>().unwrap()
    };
    for set in ["e=b", "e=E.b"] {
        assert_eq!(value(set, "x"), 20.0, "{set}");
    }
    for set in ["s=two", "s=\"two\""] {
        assert_eq!(value(set, "y"), 2.0, "{set}");
    }
    assert_eq!(value("s=one", "y"), 1.0);
    assert_eq!(value("all={b, b}", "z"), 4.0);
    assert_eq!(value("all[1]=E.b", "z"), 4.0);
    // What decides a size is read before translation.
    for set in ["size=b", "size=E.b"] {
        assert_eq!((value(set, "v[2]"), value(set, "w")), (5.0, 7.0), "{set}");
    }
}

/// Of a parameter that is set twice, whether it is read before translation or afterwards.
#[test]
fn what_is_said_last_holds() {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    for (first, last, head) in [("e=a", "e=b", "x 20"), ("size=b", "size=a", "v[1] 5 x 10")] {
        let outcome = run(folder.path(), &["simulate", "m.hyd", "--set", first, "--set", last]);
        let (_, values) = outcome.stdout.split_once("values at 1 s").unwrap();
        let values = values.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(values.contains(head) && !values.contains("v[2]"), "{first}, {last}: {values}");
    }
}

#[test]
fn limits_hold_for_literals() {
    let folder = Scratch::new();
    let text = MODEL.replace("E e =", "E e(max = E.a) =").replace("E size =", "E size(max = E.a) =");
    folder.write("m.hyd", text);
    for set in ["e=b", "e=E.b", "size=b"] {
        let outcome = run(folder.path(), &["check", "m.hyd", "--set", set]);
        let name = set.split('=').next().unwrap();
        let message = format!("error[E0217]: `{name}` is `b`, above its `max` `a`\n");
        assert!(outcome.code == Some(1) && outcome.stderr.starts_with(&message), "{set}: {}", outcome.stderr);
        assert_eq!(run(folder.path(), &["check", "m.hyd", "--set", &format!("{name}=a")]).code, Some(0));
    }
}

#[test]
fn what_is_no_literal_is_refused_with_those_there_are() {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    for set in ["e=c", "e=2", "size=c", "size=2"] {
        let outcome = run(folder.path(), &["check", "m.hyd", "--set", set]);
        assert_eq!(outcome.code, Some(1), "{set}");
        let (name, value) = set.split_once('=').unwrap();
        let message = format!("error[E0217]: `{name}` cannot be set to `{value}`: it is one of a, b");
        assert!(outcome.stderr.starts_with(&message), "{set}: {}", outcome.stderr);
    }
}

/// At translation (strings, sizes) and behind it a list is one only if it has the sizes of what it is for.
#[test]
fn lists_have_the_sizes_of_what_they_are_for() {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    for (set, reason) in [
        ("all={{{a,b}", "its braces do not match"),
        ("all={a,b}}", "`}` follows its end"),
        ("all={a}", "it has 2 elements, not 1"),
        ("all={{a,b}}", "it has 2 elements, not 1 by 2"),
        ("e={a}", "it is not an array"),
        ("size={a}", "it is not an array"),
        ("s={x}", "it is not an array"),
        ("s=\"two", "its quotes do not match"),
        ("pair={p}", "it has 2 elements, not 1"),
        ("pair={p, q, r}", "it has 2 elements, not 3"),
    ] {
        let outcome = run(folder.path(), &["check", "m.hyd", "--set", set]);
        let (name, value) = set.split_once('=').unwrap();
        let message = format!("error[E0217]: `{name}` cannot be set to `{value}`: {reason}\n");
        assert!(outcome.code == Some(1) && outcome.stderr.starts_with(&message), "{set}: {}", outcome.stderr);
    }
    let (head, row) = last_row("pair={\"a,b\", c}");
    let at = head.split(',').position(|column| column == "u").unwrap();
    assert_eq!(row.split(',').nth(at).unwrap().parse(), Ok(5.0));
}

/// A loop that becomes a recurrence whose errors grow is solved as a whole, and the user is told.
#[test]
fn a_loop_whose_errors_grow_is_solved_again() {
    let folder = Scratch::new();
    folder.write("late.hyd", hyd_tests::models::text_of("tests/cases/networks/late.hyd"));
    let outcome = run(folder.path(), &["simulate", "late.hyd", "--result", "r.csv", "--intervals", "2"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let said = format!("{}{}", outcome.stdout, outcome.stderr);
    assert!(
        said.contains("a loop of equations could not be solved one variable after the other; the run was done again"),
        "{said}"
    );
    let text = folder.read("r.csv");
    let column = |name: &str| text.lines().next().and_then(|head| head.split(',').position(|column| column == name));
    let last = |name: &str| -> f64 {
        let row = text.lines().last().expect("rows");
        row.split(',').nth(column(name).expect("a column")).expect("a cell").parse().expect("a number")
    };
    // In the middle of the chain, far from its ends, (2 + a)*x - 2*x = (a + 1)*u with a = 1000.
    assert!((last("x[31]") / last("u") - 1.001).abs() < 1e-9, "{} {}", last("x[31]"), last("u"));
}

/// The way to the point of a linear model likewise.
#[test]
fn a_point_behind_a_loop_whose_errors_grow_is_reached() {
    let folder = Scratch::new();
    folder.write("late.hyd", hyd_tests::models::text_of("tests/cases/networks/late.hyd"));
    let arguments = ["linearize", "late.hyd", "--at", "1", "--output", "x[31]", "--json"];
    let outcome = run(folder.path(), &arguments);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(
        outcome
            .stderr
            .contains("a loop of equations could not be solved one variable after the other; the run was done again")
    );
    let linear: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    // der(u) = -u, and x[31] = 1.001*u.
    let entry = |name: &str| linear[name][0][0].as_f64().unwrap_or_else(|| panic!("{linear:#}"));
    assert!((entry("A") + 1.0).abs() < 1e-6 && (entry("C") - 1.001).abs() < 1e-6, "{linear:#}");
}

/// A file of parameters is what `--set` would say of each, and what is said one by one overrides it.
#[test]
fn files_of_parameters_hold_for_every_verb_with_a_model() {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    folder.write("p.toml", "e = \"b\"\n\"all[1]\" = \"b\" # a comment\nsize = \"b\"\n");
    let simulate = ["simulate", "m.hyd", "--parameters", "p.toml", "--intervals", "1", "--result", "r.csv"];
    let row = |more: &[&str]| {
        let outcome = run(folder.path(), &[&simulate[..], more].concat());
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
        folder.read("r.csv").lines().next_back().unwrap().to_string()
    };
    // v[1], v[2] (a size that the file decides), x, y, z, u, w.
    assert!(row(&[]).ends_with("5,5,20,1,4,6,7"), "{}", row(&[]));
    assert!(row(&["--set", "e=a"]).ends_with("5,5,10,1,4,6,7"));
    assert_eq!(run(folder.path(), &["check", "m.hyd", "--parameters", "p.toml"]).code, Some(0));
    for (text, words) in [("e = [", "p.toml"), ("nobody = 1", "`nobody`"), ("e = 1979-05-27", "`e` is not a value")] {
        folder.write("p.toml", text);
        let outcome = run(folder.path(), &simulate);
        assert_no_panic(&outcome);
        assert!(outcome.code == Some(1) && outcome.stderr.contains(words), "{text}: {}", outcome.stderr);
    }
}

/// A run begins when it is told to, with the start values then.
#[test]
fn a_run_begins_elsewhere_than_the_model_says() {
    let folder = Scratch::new();
    let model = "model M\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -time*x;\n  annotation(experiment(StartTime = 0.5, StopTime = 2));\nend M;\n";
    folder.write("m.hyd", model);
    for start in [0.5_f64, -1.0, 1.5] {
        let text = format!("{start}");
        let arguments = ["simulate", "m.hyd", "--start", &text, "--result", "r.csv", "--intervals", "50"];
        assert_eq!(
            run(folder.path(), if start == 0.5 { &["simulate", "m.hyd", "--result", "r.csv"][..] } else { &arguments })
                .code,
            Some(0)
        );
        let rows = folder.read("r.csv");
        let row = |line: &str| line.split(',').map(|field| field.parse::<f64>().unwrap()).collect::<Vec<f64>>();
        let (first, last) = (row(rows.lines().nth(1).unwrap()), row(rows.lines().last().unwrap()));
        assert_eq!((first[0], first[1], last[0]), (start, 1.0, 2.0));
        let wanted = ((start * start - 4.0) / 2.0).exp();
        assert!((last[1] / wanted - 1.0).abs() < 1e-4, "{} instead of {wanted}", last[1]);
    }
    let late = run(folder.path(), &["simulate", "m.hyd", "--start", "3"]);
    assert!(late.code == Some(2) && late.stderr.starts_with("error: "), "{:?} {}", late.code, late.stderr);
}

/// Where a library gives a value outside a limit that a library states, the model runs, in sweeps, too; what the user gives is refused,
/// directly or through a binding of the library, however many warnings there are.
#[test]
fn limits_of_libraries_are_warnings_for_values_of_libraries() {
    let folder = Scratch::new();
    std::fs::create_dir(folder.path().join("lib")).expect("a folder");
    folder.write(
        "lib/L.mo",
        "package L\n  type Small = Real(max = 10);\n  model B\n    parameter Real p = 1;\n    parameter Small q = 2*p;\n    parameter Small r = 11;\n    \
         Real y = q + r;\n  end B;\nend L;\n",
    );
    let simulate = |text: &str, more: &[&str]| {
        folder.write("m.hyd", text);
        let mut arguments = vec!["simulate", "m.hyd", "--library", "lib", "--result", "r.csv"];
        arguments.extend(more);
        let outcome = run(folder.path(), &arguments);
        assert_no_panic(&outcome);
        (outcome.code, outcome.stderr)
    };
    let (code, said) = simulate("model M\n  L.B b[3];\nend M;\n", &[]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(said.matches("above its `max` 10").count(), 1, "{said}");
    assert!(said.contains("warning[E0217]") && said.contains("2 more with this value and this limit"), "{said}");
    for (text, more) in [
        ("model M\n  L.B b(p = 6);\nend M;\n", &[][..]),
        ("model M\n  L.B b(r = 12);\nend M;\n", &[]),
        ("model M\n  L.B b;\nend M;\n", &["--set", "b.p=7"]),
    ] {
        let (code, said) = simulate(text, more);
        assert!(code == Some(1) && said.contains("error[E0217]"), "{text}{said}");
    }
    folder.write("m.hyd", "model M\n  L.B b;\nend M;\n");
    let sweep = ["sweep", "m.hyd", "--library", "lib", "--vary", "b.p=1,2", "--result", "swept"];
    let outcome = run(folder.path(), &sweep);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
}
