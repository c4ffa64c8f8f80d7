//! Derivatives by parameters through units of other tools: those of twins of a unit are those of its text, and those of whole runs.
//!
//! The same model is run as a text and as a unit in a block, with `--sensitivity`.  The derivatives of the text are exact ones along the
//! solution; differences of whole runs with the unit are those of `--set`, central ones over a thousandth of the parameter.

use std::io::{Cursor, Read, Write};

use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use crate::process::{Scratch, command, run};
use crate::unit_client::library;

/// Output intervals of a run.
const ROWS: usize = 40;

/// The table of a result: names without units, and the numbers of each row at an output point, behind events there.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let name = |field: &str| field.split(" [").next().unwrap_or(field).trim_matches('"').to_string();
    let header: Vec<String> = lines.next().unwrap().split(',').map(name).collect();
    let number = |field: &str| match field {
        "true" => 1.0,
        "false" => 0.0,
        field => field.parse().unwrap(),
    };
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
    // Events have rows of their own, a unit's others than a text's.
    let stop = rows.last().unwrap()[0];
    let at =
        |k: usize| rows.iter().rfind(|row| (row[0] - stop * k as f64 / ROWS as f64).abs() < 1e-12).unwrap().clone();
    (header, (0..=ROWS).map(at).collect())
}

/// A column of a table.
fn column((header, rows): &(Vec<String>, Vec<Vec<f64>>), name: &str) -> Vec<f64> {
    let at = header.iter().position(|own| own == name).unwrap_or_else(|| panic!("no {name} in {header:?}"));
    rows.iter().map(|row| row[at]).collect()
}

/// A case: a class `Part` that becomes a unit, a model `Around` that holds it as `part`, parameters, and variables.
struct Case {
    part: &'static str,
    around: &'static str,
    read: &'static [&'static str],
    by: &'static [(&'static str, f64)],
    of: &'static [&'static str],
    /// Largest deviations from the text's derivatives and from differences, beside the largest derivative of the variable.
    within: (f64, f64),
}

fn simulate(scratch: &Scratch, file: &str, more: &[&str], here: bool) -> Result<(Vec<String>, Vec<Vec<f64>>), String> {
    let _ = std::fs::remove_file(scratch.path().join("r.csv"));
    let rows = ROWS.to_string();
    let arguments = ["simulate", file, "--model", "Around", "--result", "r.csv", "--intervals", &rows];
    let mut command = command(scratch.path(), &[&arguments[..], more].concat());
    match here {
        true => command.env("HYD_UNIT", library()),
        false => command.env("HYD_UNIT", scratch.path().join("none")),
    };
    let output = command.output().unwrap();
    match output.status.success() {
        true => Ok(table(&scratch.read("r.csv"))),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

/// Builds the unit of a case in a folder with both texts.
fn built(case: &Case, version: &str) -> Scratch {
    let scratch = Scratch::new();
    scratch.write("part.hyd", case.part);
    let arguments = ["build", "part.hyd", "--model", "Part", "--fmu", version, "-o", "part.fmu"];
    let output = command(scratch.path(), &arguments).env("HYD_UNIT", library()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read: Vec<&str> = case.read.iter().flat_map(|name| ["--read", *name]).collect();
    let unit = run(scratch.path(), &[&["unit", "part.fmu", "-o", "block.hyd"][..], &read].concat());
    assert_eq!(unit.code, Some(0), "{}", unit.stderr);
    scratch.write("unit.hyd", scratch.read("block.hyd") + case.around);
    scratch.write("text.hyd", case.part.to_string() + case.around);
    scratch
}

fn check(case: &Case, version: &str, here: bool) {
    let scratch = built(case, version);
    let names: Vec<&str> = case.by.iter().map(|(name, _)| *name).collect();
    let sensitivity = ["--sensitivity", &names.join(",")];
    let [unit, text] = ["unit.hyd", "text.hyd"]
        .map(|file| simulate(&scratch, file, &sensitivity, here).unwrap_or_else(|e| panic!("{file}: {e}")));
    for &(by, value) in case.by {
        let away = 1e-3 * value.abs();
        let [left, right] = [value - away, value + away].map(|value| {
            let set = format!("{by}={value:e}");
            simulate(&scratch, "unit.hyd", &["--set", &set], here).unwrap()
        });
        for of in case.of {
            let name = format!("d({of})/d({by})");
            let (own, wanted) = (column(&unit, &name), column(&text, &name));
            let differences = column(&left, of).into_iter().zip(column(&right, of));
            let differences: Vec<f64> = differences.map(|(left, right)| (right - left) / (2.0 * away)).collect();
            let most = wanted.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            assert_eq!(own.len(), wanted.len(), "{name}");
            for (k, own) in own.iter().enumerate() {
                let words = format!(
                    "{version} {name}, row {k}: {own}; {} of the text, {} by differences",
                    wanted[k], differences[k]
                );
                assert!((own - wanted[k]).abs() <= case.within.0 * most.max(1e-12), "{words}");
                assert!((own - differences[k]).abs() <= case.within.1 * most.max(1e-9), "{words}");
            }
        }
    }
}

/// No events: a spring with damping, given a force that follows from what it computes.
const SMOOTH: Case = Case {
    part: "model Part
  parameter Real m = 2;
  parameter Real k = 30;
  parameter Real x_0 = 0.1;
  input Real f(start = 0);
  output Real x(start = x_0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  m*der(v) = f - k*x - 0.5*v*abs(v);
end Part;
",
    around: "model Around
  parameter Real g = 4;
  parameter Real T = 0.3;
  Part part(m = 1.5);
  Real a(start = 0, fixed = true);
  Real e = g*part.x + 0.1*part.v;
equation
  T*der(a) = e - a;
  part.f = 1 - a;
  annotation(experiment(StopTime = 2, Tolerance = 1e-8));
end Around;
",
    read: &["v"],
    by: &[("g", 4.0), ("T", 0.3), ("part.m", 1.5), ("part.k", 30.0), ("part.x_0", 0.1)],
    of: &["part.x", "part.v", "e", "a"],
    within: (1e-5, 3e-3),
};

/// Events in the unit: one whose instant is a parameter, one at a wall that turns the speed, and a counter that a rate follows.
const BOUNCING: Case = Case {
    part: "model Part
  parameter Real e = 0.8;
  parameter Real t_on = 0.31;
  parameter Real kick = 3;
  input Real g(start = 9.81);
  output Real h(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
  output Real w(start = 0, fixed = true);
  discrete Real last(start = 1, fixed = true);
equation
  der(h) = v;
  der(v) = -g + (if time > t_on then kick else 0);
  der(w) = last*h;
  when h < 0 then
    reinit(v, -e*pre(v));
    last = 2*v*pre(last);
  end when;
end Part;
",
    around: "model Around
  parameter Real weight = 8;
  Part part(e = 0.9);
  Real above(start = 0, fixed = true);
equation
  part.g = weight + above;
  der(above) = if part.h > 0.25 then 1 else 0.2;
  annotation(experiment(StopTime = 1.4, Tolerance = 1e-9));
end Around;
",
    read: &["v"],
    by: &[("weight", 8.0), ("part.e", 0.9), ("part.t_on", 0.31), ("part.kick", 3.0)],
    of: &["part.h", "part.v", "part.w", "above"],
    within: (1e-6, 1e-4),
};

/// A unit that begins at rest under what it is given.
const STEADY: Case = Case {
    part: "model Part
  parameter Real a = 2;
  input Real u(start = 1);
  output Real x(start = 0.5);
initial equation
  der(x) = 0;
equation
  der(x) = u - a*x^2;
end Part;
",
    around: "model Around
  parameter Real g = 4;
  Part part(a = 1.5);
equation
  part.u = g + sin(3*time);
  annotation(experiment(StopTime = 2, Tolerance = 1e-8));
end Around;
",
    read: &[],
    by: &[("g", 4.0), ("part.a", 1.5)],
    of: &["part.x"],
    within: (1e-5, 1e-4),
};

/// What is sampled in the unit is what the text gives it, and the text keeps at an event of its own what the unit computes.
const SAMPLED: Case = Case {
    part: "model Part
  parameter Real k = 2;
  input Real u(start = 1);
  output Real x(start = 0.5, fixed = true);
  discrete Real d(start = 0, fixed = true);
equation
  when sample(0.05, 0.13) then
    d = k*(u - x);
  end when;
  der(x) = d;
end Part;
",
    around: "model Around
  parameter Real g = 1.2;
  Part part(k = 1.5);
  Real c(start = 0, fixed = true);
  discrete Real h(start = 0, fixed = true);
equation
  part.u = g + 0.3*sin(3*time);
  when part.x > 0.8 then
    h = 3*part.x*g;
  end when;
  der(c) = h - c;
  annotation(experiment(StopTime = 1.9, Tolerance = 1e-9));
end Around;
",
    read: &[],
    by: &[("g", 1.2), ("part.k", 1.5)],
    of: &["part.x", "c"],
    within: (1e-5, 1e-4),
};

/// An event comes before the parameter of the text has moved what the unit is given by anything to speak of.  Rows between steps have what is
/// given by interpolation, so the tolerance is a narrow one.
const EARLY: Case = Case {
    part: "model Part
  input Real u(start = 1);
  output Real x(start = 0.1, fixed = true);
  output Real y = x^2 + u^2;
equation
  der(x) = u - x;
end Part;
",
    around: "model Around
  parameter Real g = 1;
  Part part;
  Real a(start = 0, fixed = true);
  Real b(start = 0, fixed = true);
equation
  der(a) = g;
  der(b) = if time > 0.002 then 1 else 0;
  part.u = 1 + a^3;
  annotation(experiment(StopTime = 2, Tolerance = 1e-10));
end Around;
",
    read: &[],
    by: &[("g", 1.0)],
    of: &["part.x", "part.y"],
    within: (1e-5, 1e-4),
};

#[test]
fn a_parameter_that_has_hardly_acted_at_an_event_has_its_derivatives() {
    check(&EARLY, "3.0", true);
}

/// A twin that refuses its parameter in the middle of a run ends the run with a message; the unit by itself runs.
#[test]
fn a_twin_that_fails_is_said_to() {
    let case = Case {
        part: "model Part
  parameter Real p = 2;
  output Real x(start = 0.1, fixed = true);
equation
  der(x) = p - x;
  assert(time < 0.5 or p < 2.0000001, \"p is too large\");
end Part;
",
        around: "model Around
  Part part(p = 2);
  annotation(experiment(StopTime = 1));
end Around;
",
        ..EARLY
    };
    let scratch = built(&case, "2.0");
    for here in [true, false] {
        let said = simulate(&scratch, "unit.hyd", &["--sensitivity", "part.p"], here).unwrap_err();
        assert!(said.starts_with("error") && said.contains("parameter"), "{said}");
        assert!(simulate(&scratch, "unit.hyd", &[], here).is_ok());
    }
}

#[test]
fn derivatives_through_a_smooth_unit_are_those_of_its_text() {
    check(&SMOOTH, "3.0", true);
    check(&SMOOTH, "2.0", false);
    check(&STEADY, "3.0", true);
}

#[test]
fn derivatives_go_through_the_events_of_a_unit() {
    check(&BOUNCING, "3.0", true);
    check(&BOUNCING, "2.0", false);
    check(&SAMPLED, "3.0", true);
}

/// What is not known of derivatives is said, and no number stands in its place.
#[test]
fn derivatives_that_a_unit_does_not_have_are_refused() {
    let scratch = built(&BOUNCING, "3.0");
    // What the text changes at the instant of the unit's own event happens before or after it as soon as a parameter moves the one.
    let text = scratch.read("unit.hyd").replace("if part.h > 0.25", "if time < 0.31");
    scratch.write("unit.hyd", text);
    let said = simulate(&scratch, "unit.hyd", &["--sensitivity", "part.t_on"], true).unwrap_err();
    assert!(said.contains("derivatives by parameters are not known: two events of the model that coincide"), "{said}");
    // Other parameters leave both where they are.
    assert!(simulate(&scratch, "unit.hyd", &["--sensitivity", "weight"], true).is_ok());
}

/// What a parameter of the text gives a unit is so steep that a millionth of it is far.
#[test]
fn a_step_that_moves_a_unit_too_far_is_refused() {
    let around = EARLY.around.replace("1 + a^3", "exp(5000*(g - 1))");
    let scratch = built(&EARLY, "3.0");
    scratch.write("unit.hyd", scratch.read("block.hyd") + &around);
    let said = simulate(&scratch, "unit.hyd", &["--sensitivity", "g"], true).unwrap_err();
    assert!(said.contains("a step of a parameter moves the unit too far"), "{said}");
}

/// A unit that remembers the steps it was told of, in a run without events: its likeness hears of other ones.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn a_unit_that_remembers_its_steps_has_no_derivatives() {
    let scratch = Scratch::new();
    scratch.write("remembers.c", include_str!("unit_sources/remembers.c"));
    let compiled = std::process::Command::new("cc")
        .args(["-std=c99", "-O1", "-shared", "-fPIC", "-o", "remembers.so", "remembers.c"])
        .current_dir(scratch.path())
        .output();
    let Ok(compiled) = compiled else {
        println!("no C compiler");
        return;
    };
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let library = std::fs::read(scratch.path().join("remembers.so")).unwrap();
    let description = include_bytes!("unit_sources/remembers.xml");
    for (name, bytes) in [("modelDescription.xml", &description[..]), ("binaries/linux64/remembers.so", &library[..])] {
        archive.start_file(name, SimpleFileOptions::default()).unwrap();
        archive.write_all(bytes).unwrap();
    }
    std::fs::write(scratch.path().join("part.fmu"), archive.finish().unwrap().into_inner()).unwrap();
    let unit = run(scratch.path(), &["unit", "part.fmu", "-o", "block.hyd"]);
    assert_eq!(unit.code, Some(0), "{}", unit.stderr);
    let around =
        "model Around\n  Part part(p = 2);\n  annotation(experiment(StopTime = 2, Tolerance = 1e-8));\nend Around;\n";
    scratch.write("unit.hyd", scratch.read("block.hyd") + around);
    assert!(simulate(&scratch, "unit.hyd", &[], true).is_ok());
    let said = simulate(&scratch, "unit.hyd", &["--sensitivity", "part.p"], true).unwrap_err();
    assert!(said.contains("the unit follows its steps"), "{said}");
}

/// A unit that ends the run by an event of its own leaves a last row without derivatives, which is said.
#[test]
fn rows_without_derivatives_are_told() {
    let case = Case {
        part: "model Part
  parameter Real p = 2;
  output Real x(start = 0, fixed = true);
equation
  der(x) = p - x;
  when x > 1 then
    terminate(\"far enough\");
  end when;
end Part;
",
        around: "model Around\n  Part part(p = 2);\n  annotation(experiment(StopTime = 2));\nend Around;\n",
        ..EARLY
    };
    let scratch = built(&case, "3.0");
    let run = |file: &str| {
        let arguments = ["simulate", file, "--model", "Around", "--result", "r.csv", "--sensitivity", "part.p"];
        let output = command(scratch.path(), &arguments).env("HYD_UNIT", library()).output().unwrap();
        let lost = scratch.read("r.csv").to_lowercase().contains("nan");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned(), lost)
    };
    for file in ["unit.hyd", "text.hyd"] {
        let (code, said, lost) = run(file);
        assert_eq!(
            (code, said.contains("derivatives by parameters are not known in")),
            (Some(0), lost),
            "{file}: {said}"
        );
    }
}

/// A unit of which a process can hold one instance only has no twins.
#[test]
fn a_unit_that_is_alone_in_its_process_has_no_derivatives() {
    let scratch = built(&SMOOTH, "3.0");
    let archive = std::fs::read(scratch.path().join("part.fmu")).unwrap();
    let alone = rewritten(&archive, |text| {
        text.replace("<ModelExchange ", "<ModelExchange canBeInstantiatedOnlyOncePerProcess=\"true\" ")
    });
    std::fs::write(scratch.path().join("part.fmu"), alone).unwrap();
    let said = simulate(&scratch, "unit.hyd", &["--sensitivity", "part.k"], true).unwrap_err();
    assert!(said.contains("no derivatives with respect to parameters"), "{said}");
    assert!(simulate(&scratch, "unit.hyd", &[], true).is_ok());
}

/// An archive of a unit with another description.
fn rewritten(archive: &[u8], change: impl Fn(String) -> String) -> Vec<u8> {
    let mut from = ZipArchive::new(Cursor::new(archive)).unwrap();
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    for k in 0..from.len() {
        let mut file = from.by_index(k).unwrap();
        let (name, mut bytes) = (file.name().unwrap().into_owned(), Vec::new());
        file.read_to_end(&mut bytes).unwrap();
        if name == "modelDescription.xml" {
            let before = String::from_utf8(bytes).unwrap();
            let after = change(before.clone());
            assert_ne!(before, after);
            bytes = after.into_bytes();
        }
        to.start_file(name, SimpleFileOptions::default()).unwrap();
        to.write_all(&bytes).unwrap();
    }
    to.finish().unwrap().into_inner()
}
