//! Units of other tools in `hyd simulate`: what the two kinds of use give, and archives that are not what they should be.
//!
//! The units are our own here, given back; those of others are run by `tests/outside/units_import.py` and `tests/outside/reference_units`.
//! Two thousand archives of the drive's unit are changed at random: bytes of the archive, of its description, paths, lengths.  Most are
//! only opened, because that is where they must be refused; some dozens of those that can be opened are run by the program, with the real
//! library.

use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use hyd_fmi_import::Unit;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::process::{Outcome, Scratch, assert_no_panic, command, run};
use crate::unit_client::library;

/// A mass with a friction that a force moves: an input, parameters, an output, a state inside.
pub(crate) const MASS: &str = "model Mass
  parameter Real m(min = 1e-3) = 2;
  final parameter Real w = 3*m;
  input Real f(start = 1);
  output Real x(start = 0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  m*der(v) = f - 0.5*v;
  annotation(experiment(StopTime = 2, Tolerance = 1e-8));
end Mass;
";

/// Builds a unit of `case.hyd` as `case.fmu`.
pub(crate) fn build(scratch: &Scratch, text: &str, version: &str) {
    scratch.write("case.hyd", text);
    build_file(scratch, "case.hyd", version);
}

fn build_file(scratch: &Scratch, file: &str, version: &str) {
    let arguments = ["build", file, "--fmu", version, "-o", "case.fmu"];
    let output = command(scratch.path(), &arguments).env("HYD_UNIT", library()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The last row of a result as numbers by name.
fn last(scratch: &Scratch, file: &str) -> Vec<(String, f64)> {
    let text = scratch.read(file);
    let mut lines = text.lines();
    let header = lines.next().unwrap().split(',').map(str::to_string);
    let row = lines.last().unwrap().split(',').map(|field| match field {
        "true" => 1.0,
        "false" => 0.0,
        field => field.parse().unwrap(),
    });
    header.zip(row).collect()
}

fn value(row: &[(String, f64)], name: &str) -> f64 {
    row.iter().find(|(own, _)| own == name || own.starts_with(&format!("{name} "))).unwrap().1
}

fn done(outcome: &Outcome) {
    assert_no_panic(outcome);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
}

#[test]
fn a_unit_has_the_results_of_its_model() {
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, MASS, version);
        scratch.write("f.csv", "time,f\n0,1\n1,3\n2,3\n");
        // x'' = (f - v/2)/m with f = 1 + 2t up to 1 s and 3 behind: v = a + b t + c exp(-t/(2 m)) on each part.
        for (kind, allowed) in [("model-exchange", 1e-6), ("co-simulation", 1e-2)] {
            let arguments =
                ["simulate", "case.fmu", "--as", kind, "--input", "f.csv", "--set", "m=0.5", "--result", "r.csv"];
            let more = if kind == "co-simulation" { &["--step", "0.01"][..] } else { &["--tolerance", "1e-9"][..] };
            done(&run(scratch.path(), &[&arguments[..], more].concat()));
            let row = last(&scratch, "r.csv");
            // m = 1/2: v' = 2 f - v, so v = 4t - 2 + 2 exp(-t), then 6 + (v(1) - 6) exp(-(t - 1)).
            let at_one = 2.0 + 2.0 * f64::exp(-1.0);
            let wanted = 6.0 + (at_one - 6.0) * f64::exp(-1.0);
            let v = value(&row, "v");
            assert!((v - wanted).abs() < allowed, "{version} {kind}: {v} and not {wanted}");
        }
        // Without a table the input keeps a value that can be set like a parameter.
        done(&run(scratch.path(), &["simulate", "case.fmu", "--set", "f=2", "--set", "m=1", "--result", "r.csv"]));
        let wanted = 4.0 * (1.0 - f64::exp(-1.0));
        assert!((value(&last(&scratch, "r.csv"), "v") - wanted).abs() < 1e-6);
    }
}

#[test]
fn what_cannot_be_set_is_said() {
    let scratch = Scratch::new();
    build(&scratch, MASS, "3.0");
    for (set, said) in [
        ("mm=1", "no parameter `mm`; did you mean `m`?"),
        ("v=1", "`v` cannot be set: it is a variable, not a parameter"),
        ("w=1", "`w` cannot be set: it is final, or its value follows from other parameters"),
        ("m=0", "`m` is 0, below its `min` 0.001"),
        ("m=heavy", "`m=heavy`: it is a Real and needs a finite number"),
    ] {
        let outcome = run(scratch.path(), &["simulate", "case.fmu", "--set", set, "--result", "r.csv"]);
        assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(said), "`{said}` is not in {}", outcome.stderr);
        assert!(!scratch.path().join("r.csv").exists());
    }
}

/// The message of an assertion that fails at the start comes out of the unit, whoever integrates.
#[test]
fn an_assertion_that_fails_at_the_start_is_told() {
    let text = "model Tank
  parameter Real h_0(unit = \"m\") = 3;
  Real h(unit = \"m\", start = h_0, fixed = true);
equation
  der(h) = -0.1;
  assert(h < 2, \"the tank runs over\");
  annotation(experiment(StopTime = 1));
end Tank;
";
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, text, version);
        for kind in ["model-exchange", "co-simulation"] {
            let arguments = ["simulate", "case.fmu", "--as", kind, "--result", "r.csv"];
            let outcome = run(scratch.path(), &arguments);
            assert_no_panic(&outcome);
            assert_eq!(outcome.code, Some(1), "{version} {kind}: {}", outcome.stderr);
            assert!(outcome.stderr.contains("the tank runs over"), "{version} {kind}: {}", outcome.stderr);
            done(&run(scratch.path(), &[&arguments[..], &["--set", "h_0=1.5"]].concat()));
        }
    }
}

#[test]
fn options_of_one_kind_are_refused_for_the_other() {
    let scratch = Scratch::new();
    build(&scratch, MASS, "2.0");
    scratch.write("text.hyd", MASS);
    for (file, options, said) in [
        ("case.fmu", &["--step", "0.1"][..], "--step is the distance of communication points"),
        ("case.fmu", &["--as", "co-simulation", "--solver", "bdf"], "the unit brings its own"),
        ("case.fmu", &["--as", "co-simulation", "--step", "-1"], "the step must be a positive number"),
        ("case.fmu", &["--sensitivity", "m"], "derivatives by parameters are not known"),
        ("case.fmu", &["--call-limit", "0"], "a positive number of seconds"),
        ("case.fmu", &["--backend", "vm"], "--backend is about texts of models"),
        ("text.hyd", &["--as", "co-simulation"], "--as is about units of other tools"),
    ] {
        let outcome = run(scratch.path(), &[&["simulate", file], options].concat());
        assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(said), "`{said}` is not in {}", outcome.stderr);
    }
    let outcome = run(scratch.path(), &["check", "case.fmu"]);
    assert_eq!((outcome.code, outcome.stderr.contains("is a unit of another tool")), (Some(2), true));
}

/// A generator of Lehmer's kind (Park, Miller 1988).
struct Draw(u64);

impl Draw {
    fn below(&mut self, below: usize) -> usize {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as usize % below.max(1)
    }
}

/// Entries of an archive.
fn entries(path: &Path) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let of = |k: usize, archive: &mut ZipArchive<fs::File>| {
        let mut entry = archive.by_index(k).unwrap();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        (entry.name().unwrap().into_owned(), bytes)
    };
    (0..archive.len()).map(|k| of(k, &mut archive)).collect()
}

fn pack(entries: &[(String, Vec<u8>)], packed: bool) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let method = if packed { CompressionMethod::Deflated } else { CompressionMethod::Stored };
    for (name, bytes) in entries {
        // What the writer itself refuses, such as a name twice, is another archive without that entry.
        if writer.start_file(name.as_str(), SimpleFileOptions::default().compression_method(method)).is_ok() {
            writer.write_all(bytes).unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

/// Pieces that descriptions are broken with.
const PIECES: [&str; 12] = [
    "<",
    ">",
    "\"",
    "&#0;",
    "&lt",
    "<!DOCTYPE a [<!ENTITY b \"c\">]>",
    "99999999999999999999",
    "-1",
    "NaN",
    "causality=\"input\"",
    "<Dimension start=\"4000000000\"/>",
    "\u{feff}",
];
/// Paths that no archive of a unit may have.
const PATHS: [&str; 8] = [
    "../out.txt",
    "/out.txt",
    "resources/../../out.txt",
    "..\\out.txt",
    "C:\\out.txt",
    "resources/",
    "modelDescription.xml/x",
    "a\0b",
];

/// One changed archive.
fn changed(original: &[(String, Vec<u8>)], whole: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut list = original.to_vec();
    match draw.below(5) {
        // The archive itself: cut, or bytes of it.
        0 => {
            let mut bytes = whole.to_vec();
            bytes.truncate(draw.below(bytes.len()));
            bytes
        }
        1 => {
            let mut bytes = whole.to_vec();
            for _ in 0..=draw.below(20) {
                let at = draw.below(bytes.len());
                bytes[at] = draw.below(256) as u8;
            }
            bytes
        }
        // The description: bits, pieces, parts that are missing.
        2 => {
            let text = &mut list.iter_mut().find(|(name, _)| name == "modelDescription.xml").unwrap().1;
            for _ in 0..=draw.below(4) {
                let at = draw.below(text.len());
                text[at] ^= 1 << draw.below(8);
            }
            pack(&list, true)
        }
        3 => {
            let text = &mut list.iter_mut().find(|(name, _)| name == "modelDescription.xml").unwrap().1;
            let at = draw.below(text.len());
            match draw.below(3) {
                0 => text.truncate(at),
                1 => drop(text.drain(at..(at + draw.below(200)).min(text.len()))),
                _ => drop(text.splice(at..at, PIECES[draw.below(PIECES.len())].bytes())),
            }
            pack(&list, true)
        }
        // Paths, and entries that are missing.
        _ => {
            let at = draw.below(list.len());
            match draw.below(3) {
                0 => drop(list.remove(at)),
                1 => list[at].0 = PATHS[draw.below(PATHS.len())].to_string(),
                _ => list.push((PATHS[draw.below(PATHS.len())].to_string(), b"x".to_vec())),
            }
            pack(&list, draw.below(2) == 0)
        }
    }
}

#[test]
fn changed_archives_are_read_or_refused() {
    const ARCHIVES: usize = 2000;
    const RUNS: usize = 12;
    let scratch = Scratch::new();
    let drive = hyd_tests::models::root().join("models/single_acting_drive/drive.hyd");
    build_file(&scratch, &drive.display().to_string(), "3.0");
    let original = entries(&scratch.path().join("case.fmu"));
    // A library of many megabytes would only be copied about.
    let small: Vec<(String, Vec<u8>)> = original
        .iter()
        .map(|(name, bytes)| {
            (name.clone(), if name.ends_with(".xml") { bytes.clone() } else { bytes[..bytes.len().min(100)].to_vec() })
        })
        .collect();
    let whole = pack(&small, true);
    let mut draw = Draw(20_261);
    let (mut refused, mut runs) = (0, 0);
    let path: PathBuf = scratch.path().join("changed.fmu");
    for _ in 0..ARCHIVES {
        let before = draw.0;
        let bytes = changed(&small, &whole, &mut draw);
        fs::write(&path, &bytes).unwrap();
        match Unit::open(&path) {
            Err(fault) => {
                refused += 1;
                let said = fault.to_string();
                assert!(said.contains("changed.fmu") && said.len() < 1000, "{said}");
            }
            Ok(_) if runs < RUNS => {
                // The same change once more, around the library.
                let description = changed_description(&bytes, &original);
                fs::write(&path, pack(&description, false)).unwrap();
                let arguments = ["simulate", "changed.fmu", "--stop", "1e-4", "--result", "r.csv"];
                let outcome = run(scratch.path(), &arguments);
                assert_no_panic(&outcome);
                assert!(matches!(outcome.code, Some(0..=3)), "seed {before}: {outcome:?}");
                assert!((outcome.code == Some(0)) == outcome.stderr.lines().all(|line| !line.starts_with("error")));
                runs += 1;
            }
            Ok(_) => {}
        }
        assert!(!scratch.path().parent().unwrap().join("out.txt").exists(), "seed {before}");
    }
    assert!(refused > ARCHIVES / 2 && runs == RUNS, "{refused} of {ARCHIVES} refused, {runs} runs");
}

/// The entries of the unit with the description of a changed archive.
fn changed_description(bytes: &[u8], original: &[(String, Vec<u8>)]) -> Vec<(String, Vec<u8>)> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut text = Vec::new();
    archive.by_name("modelDescription.xml").unwrap().read_to_end(&mut text).unwrap();
    let of = |(name, own): &(String, Vec<u8>)| match name == "modelDescription.xml" {
        true => (name.clone(), text.clone()),
        false => (name.clone(), own.clone()),
    };
    original.iter().map(of).collect()
}

/// A loop around the mass: with it as a text and as a unit.
const LOOP: &str = "model Loop
  parameter Real k = 8;
  Mass plant(m = 3);
  Real e = 1 - plant.x;
  Real s(start = 0, fixed = true);
equation
  der(s) = e;
  plant.f = k*e + 0.5*s;
  annotation(experiment(StopTime = 4, Tolerance = 1e-9));
end Loop;
";

/// The block that `hyd unit` writes of `case.fmu`.
fn block(scratch: &Scratch, more: &[&str]) -> String {
    let _ = fs::remove_file(scratch.path().join("block.hyd"));
    done(&run(scratch.path(), &[&["unit", "case.fmu", "-o", "block.hyd"], more].concat()));
    scratch.read("block.hyd")
}

#[test]
fn a_unit_is_a_block_in_a_loop() {
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, MASS, version);
        scratch.write("unit.hyd", block(&scratch, &["--read", "v"]) + LOOP);
        scratch.write("text.hyd", format!("{MASS}{LOOP}"));
        // Parameters of the unit are set as those of any block, in the text and on the command line.
        for set in [&["--set", "k=5"][..], &["--set", "plant.m=0.7"]] {
            for file in ["unit.hyd", "text.hyd"] {
                let more = ["--model", "Loop", "--result", "r.csv", "--intervals", "7"];
                done(&run(scratch.path(), &[&["simulate", file], set, &more].concat()));
                fs::rename(scratch.path().join("r.csv"), scratch.path().join(format!("{file}.csv"))).unwrap();
            }
            let (unit, text) = (last(&scratch, "unit.hyd.csv"), last(&scratch, "text.hyd.csv"));
            for name in ["plant.x", "plant.v", "plant.f", "e", "s"] {
                let (own, wanted) = (value(&unit, name), value(&text, name));
                assert!((own - wanted).abs() < 1e-6, "{version} {set:?} {name}: {own} and not {wanted}");
            }
        }
    }
}

/// A block is called by the last part of its model's name, whatever the packages around it and the file that it is written to.
#[test]
fn a_block_has_a_plain_name() {
    let scratch = Scratch::new();
    scratch.write("case.hyd", format!("package Plant\npackage Parts\n{MASS}end Parts;\nend Plant;\n"));
    let arguments = ["build", "case.hyd", "--model", "Plant.Parts.Mass", "--fmu", "3.0", "-o", "case.fmu"];
    let output = command(scratch.path(), &arguments).env("HYD_UNIT", library()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = block(&scratch, &["--read", "v"]);
    assert!(text.starts_with("block Mass ") && text.ends_with("end Mass;\n"), "{text}");
    scratch.write("unit.hyd", text + LOOP);
    done(&run(scratch.path(), &["simulate", "unit.hyd", "--model", "Loop", "--result", "r.csv"]));
}

/// A parameter that the unit finds from another one follows it, unless the text says a value of its own.
#[test]
fn parameters_of_a_block_follow_those_that_they_come_of() {
    let scratch = Scratch::new();
    let model = "model Slope\n  parameter Real a = 1;\n  parameter Real b = 2*a;\n  parameter Real c[2] = {a, 3};\n  \
                 output Real x(start = 0, fixed = true);\nequation\n  der(x) = b + c[1];\nend Slope;\n";
    for version in ["2.0", "3.0"] {
        build(&scratch, model, version);
        let ramp = "model Ramp\n  Slope part;\n  annotation(experiment(StopTime = 1));\nend Ramp;\n";
        scratch.write("unit.hyd", block(&scratch, &[]) + ramp);
        for (set, wanted) in [
            (&[][..], 3.0),
            (&["part.a=3"], 9.0),
            (&["part.a=3", "part.b=5"], 8.0),
            (&["part.a=1"], 3.0),
            (&["part.a=3", "part.b=2"], 5.0),
        ] {
            let set: Vec<&str> = set.iter().flat_map(|value: &&str| ["--set", *value]).collect();
            let simulate = ["simulate", "unit.hyd", "--model", "Ramp", "--result", "r.csv"];
            done(&run(scratch.path(), &[&simulate[..], &set].concat()));
            let x = value(&last(&scratch, "r.csv"), "part.x");
            assert!((x - wanted).abs() < 1e-6, "{version} {set:?}: {x} and not {wanted}");
        }
        // What a modification says counts, although it is what the unit states: 2 for `b`.
        let said = "model Ramp\n  Slope part(a = 3, b = 2);\n  annotation(experiment(StopTime = 1));\nend Ramp;\n";
        scratch.write("unit.hyd", block(&scratch, &[]) + said);
        done(&run(scratch.path(), &["simulate", "unit.hyd", "--model", "Ramp", "--result", "r.csv"]));
        let x = value(&last(&scratch, "r.csv"), "part.x");
        assert!((x - 5.0).abs() < 1e-6, "{version}: {x}");
    }
}

/// A unit with a connector is a block with that connector.
#[test]
fn a_unit_is_connected_by_its_connector() {
    const PLANT: &str = "connector Bus
  input Real u(start = 0);
  output Real y(start = 0, fixed = true);
end Bus;
model Plant
  Bus bus;
equation
  der(bus.y) = bus.u - bus.y;
end Plant;
";
    const LOOP: &str = "model Control
  connector Bus
    output Real u;
    input Real y;
  end Bus;
  Bus bus;
equation
  bus.u = 1 - 3*bus.y;
end Control;
model Loop
  Plant plant;
  Control control;
equation
  connect(plant.bus, control.bus);
  annotation(experiment(StopTime = 0.5, Tolerance = 1e-9));
end Loop;
";
    for version in ["2.0", "3.0"] {
        let scratch = Scratch::new();
        build(&scratch, PLANT, version);
        let text = block(&scratch, &[]);
        assert!(text.contains("connector bus_variables"), "{text}");
        scratch.write("loop.hyd", text + LOOP);
        done(&run(scratch.path(), &["simulate", "loop.hyd", "--model", "Loop", "--result", "r.csv"]));
        // y' = 1 - 4 y.
        let (y, wanted) = (value(&last(&scratch, "r.csv"), "plant.bus.y"), 0.25 * (1.0 - f64::exp(-2.0)));
        assert!((y - wanted).abs() < 1e-7, "{version}: {y} and not {wanted}");
        let told = run(scratch.path(), &["unit", "case.fmu"]);
        assert!(told.stdout.contains("connectors\n  bus (Bus): bus.u (signal), bus.y (signal)"), "{}", told.stdout);
    }
}

/// A unit with the library of this program runs where the solver is, with the same bits as in a process of its own.
#[test]
fn our_own_code_gives_the_same_bits_here_and_there() {
    let scratch = Scratch::new();
    build(&scratch, MASS, "3.0");
    let arguments = ["simulate", "case.fmu", "--set", "m=0.7", "--json", "--result"];
    let results = ["here.csv", "there.csv"].map(|name| {
        let mut command = command(scratch.path(), &[&arguments[..], &[name]].concat());
        match name {
            "here.csv" => command.env("HYD_UNIT", library()),
            _ => command.env("HYD_UNIT", scratch.path().join("none")),
        };
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        (scratch.read(name), json["unit"]["own_process"].as_bool())
    });
    assert_eq!(results[0].0, results[1].0);
    assert_eq!(results.map(|(_, place)| place), [Some(false), Some(true)]);
}

/// Events go both ways: the ball bounces within the unit, and the text changes its weight while it flies.
#[test]
fn a_unit_in_a_model_has_events() {
    const BALL: &str = "model Ball
  parameter Real e = 0.8;
  input Real g(start = 9.81);
  output Real h(start = 1, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(h) = v;
  der(v) = -g;
  when h < 0 then
    reinit(v, -e*pre(v));
  end when;
end Ball;
";
    const AROUND: &str = "model Around
  Ball ball(e = 0.9);
  Real above(start = 0, fixed = true);
equation
  ball.g = if time < 0.7 then 8 else 16;
  der(above) = if ball.h > 0.25 then 1 else 0;
  annotation(experiment(StopTime = 0.9, Tolerance = 1e-10));
end Around;
";
    let scratch = Scratch::new();
    build(&scratch, BALL, "3.0");
    scratch.write("around.hyd", block(&scratch, &[]) + AROUND);
    done(&run(scratch.path(), &["simulate", "around.hyd", "--model", "Around", "--result", "r.csv"]));
    let row = last(&scratch, "r.csv");
    // From 1 m with 8 m/s2: on the floor at 0.5 s with 4 m/s, back with 3.6 m/s, and with 16 m/s2 from 0.7 s on.
    let (height, speed) = (3.6 * 0.2 - 4.0 * 0.2 * 0.2, 3.6 - 8.0 * 0.2);
    let wanted = height + speed * 0.2 - 8.0 * 0.2 * 0.2;
    assert!((value(&row, "ball.h") - wanted).abs() < 1e-7, "{row:?}");
    // Above 0.25 m until sqrt(2*0.75/8), and again from the smaller root of 3.6 s - 4 s2 = 0.25 on, until it falls through it.
    let (down, up) = (f64::sqrt(1.5 / 8.0), 0.5 + (3.6 - f64::sqrt(3.6 * 3.6 - 4.0)) / 8.0);
    let fall = 0.7 + (speed + f64::sqrt(speed * speed + 32.0 * (height - 0.25))) / 16.0;
    let wanted = down + fall.min(0.9) - up;
    assert!((value(&row, "above") - wanted).abs() < 1e-6, "{row:?} and not {wanted}");
}

#[test]
fn what_a_block_says_of_its_unit_is_checked() {
    let scratch = Scratch::new();
    build(&scratch, MASS, "3.0");
    let text = block(&scratch, &[]) + "model Top\n  Mass a;\nequation\n  a.f = 1;\nend Top;\n";
    for (old, new, said) in [
        (
            "variable = \"m\"",
            "variable = \"mm\"",
            "which has no parameter that can be set of that name; did you mean `m`?",
        ),
        (
            "output Real x annotation(__hyd(variable = \"x\"))",
            "output Real x annotation(__hyd(variable = \"y\"))",
            "`a.x` is said to be `y` of the unit",
        ),
        ("variable = \"f\"", "variable = \"x\"", "which has no input of that name"),
        ("file = \"case.fmu\"", "file = \"cases.fmu\"", "`cases.fmu`"),
        ("file = \"case.fmu\"", "file = 3", "the file of a unit is a string that is known at translation"),
        ("Mass a;", "Mass a(n = 3);", "a(n = 3)"),
        ("  Mass a;\nequation\n  a.f = 1;", "  Mass a[2](each f = 1);", "cannot be in an array of components"),
    ] {
        assert!(text.contains(old), "{old}");
        scratch.write("top.hyd", text.replacen(old, new, 1));
        let outcome =
            run(scratch.path(), &["simulate", "top.hyd", "--model", "Top", "--stop", "1", "--result", "r.csv"]);
        assert_eq!(outcome.code, Some(1), "{new}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(said), "`{said}` is not in {}", outcome.stderr);
    }
    scratch.write("top.hyd", &text);
    // What runs texts alone says so.
    for arguments in [
        &["linearize", "top.hyd", "--model", "Top", "--at", "1"][..],
        &["sweep", "top.hyd", "--model", "Top", "--vary", "a.m=1:2:3", "--result", "s"],
    ] {
        let outcome = run(scratch.path(), arguments);
        assert_eq!(outcome.code, Some(1), "{}", outcome.stderr);
        assert!(
            outcome.stderr.contains("the unit `case.fmu` of another tool, which cannot be run here"),
            "{}",
            outcome.stderr
        );
    }
    fs::create_dir(scratch.path().join("elsewhere")).unwrap();
    // A block that exists is not written over, and a text elsewhere does not find the unit.
    for (arguments, code, said) in [
        (["unit", "case.fmu", "-o", "block.hyd"], 1, "exists already"),
        (["unit", "case.fmu", "-o", "elsewhere/block.hyd"], 2, "a text names files of its own folder"),
        (["unit", "block.hyd", "-o", "b.hyd"], 2, "is not a unit"),
    ] {
        let outcome = run(scratch.path(), &arguments);
        assert_eq!((outcome.code, outcome.stderr.contains(said)), (Some(code), true), "{}", outcome.stderr);
    }
}

/// A library that is missing takes one kind of use away and not the other.
#[test]
fn one_library_is_enough() {
    let scratch = Scratch::new();
    build(&scratch, MASS, "2.0");
    let mut entries = entries(&scratch.path().join("case.fmu"));
    let description = entries.iter_mut().find(|(name, _)| name == "modelDescription.xml").unwrap();
    let text = String::from_utf8(std::mem::take(&mut description.1)).unwrap();
    let (before, after) = text.split_once("<CoSimulation modelIdentifier=\"Mass\"").unwrap();
    description.1 = format!("{before}<CoSimulation modelIdentifier=\"Other\"{after}").into_bytes();
    scratch.write("half.fmu", pack(&entries, true));
    done(&run(scratch.path(), &["simulate", "half.fmu", "--result", "r.csv"]));
    let told = run(scratch.path(), &["unit", "half.fmu"]);
    done(&told);
    assert!(told.stderr.contains("co-simulation, but its library `binaries/"), "{}", told.stderr);
    assert!(told.stdout.contains("\nmodel exchange\n"), "{}", told.stdout);
    let refused = run(scratch.path(), &["simulate", "half.fmu", "--as", "co-simulation"]);
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
}

/// What no block can run is no block, and results are not read from units.
#[test]
fn what_a_unit_is_not_for_is_said_at_once() {
    let scratch = Scratch::new();
    let text =
        "model Late input Real u; Real x(start = 1, fixed = true); equation der(x) = u - delay(x, 0.5); end Late;";
    build(&scratch, text, "3.0");
    let refused = run(scratch.path(), &["unit", "case.fmu", "-o", "block.hyd"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("for co-simulation alone"), "{}", refused.stderr);
    assert!(!scratch.path().join("block.hyd").exists());
    let refused = run(scratch.path(), &["plot", "case.fmu"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("holds no results; `hyd simulate case.fmu"), "{}", refused.stderr);
}

/// A model within packages has a name with dots, which is one name where its unit is shown.
#[test]
fn a_unit_of_a_model_within_packages_is_shown() {
    let scratch = Scratch::new();
    scratch.write("case.hyd", format!("package Plant\n{MASS}end Plant;\n"));
    let arguments = ["build", "case.hyd", "--model", "Plant.Mass", "--fmu", "3.0", "-o", "case.fmu"];
    let output = command(scratch.path(), &arguments).env("HYD_UNIT", library()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    done(&run(scratch.path(), &["view", "case.fmu", "--output", "page.html"]));
    assert!(scratch.read("page.html").contains("Plant.Mass"));
}
