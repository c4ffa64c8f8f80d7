//! What the values of a unit say, and when: outputs without a value, failures ahead of a step, inputs that are looked at before they are final,
//! what depends on what.
//!
//! Solutions are closed forms.

use std::ffi::CString;
use std::fs;
use std::io::{Cursor, Read, Write};

use hyd_unit::{fmi2, fmi3};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use crate::process::Scratch;
use crate::unit_client::{DISCARD, ERROR, OK, begin, hyd, make, step};

/// An output that a parameter or a constant decides changes with nothing; one that is a state with the other sign changes with that.
#[test]
fn outputs_that_are_parameters_have_derivatives() {
    let unit = make(
        "output of parameter",
        "3.0",
        "model Gain
           parameter Real k = 2;
           input Real u(start = 1);
           Real x(start = 1, fixed = true);
           output Real of_k = k;
           output Real of_one = 1;
           output Real y = 3*x;
           output Real against = -x;
         equation
           der(x) = -k*x + u;
         end Gain;",
    );
    let it = unit.exchange();
    begin(it, 1.0);
    let none = std::ptr::null_mut();
    assert_eq!(fmi3::fmi3UpdateDiscreteStates(it, none, none, none, none, none, std::ptr::null_mut()), OK);
    assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
    let unknowns = ["of_k", "y", "of_one", "der(x)"].map(|name| unit.reference(name));
    for (known, expected) in
        [("x", [0.0, 3.0, 0.0, -2.0]), ("against", [0.0, -3.0, 0.0, 2.0]), ("u", [0.0, 0.0, 0.0, 1.0])]
    {
        let (known, seed, mut found) = (unit.reference(known), 1.0, [f64::NAN; 4]);
        let status =
            fmi3::fmi3GetDirectionalDerivative(it, unknowns.as_ptr(), 4, &known, 1, &seed, 1, found.as_mut_ptr(), 4);
        assert_eq!(status, OK);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-7, "{found}, not {expected}");
        }
    }
    fmi3::fmi3FreeInstance(it);
}

/// x = t reaches 0.8 within a step that the solver takes at once: what was before stays right, and the step that comes there fails.
#[test]
fn an_assertion_ends_the_step_in_which_it_stops_to_hold() {
    let unit = make(
        "assertion ahead",
        "3.0",
        "model Tank
           Real x(start = 0, fixed = true);
         equation
           der(x) = 1;
           assert(x < 0.8, \"the tank runs over\");
         end Tank;",
    );
    let tank = unit.stepping();
    begin(tank, 2.0);
    let mut t: f64 = 0.0;
    for _ in 0..79 {
        assert_eq!(step(tank, t, 0.01).0, OK, "at {t}");
        t += 0.01;
        assert!((unit.get(tank, "x") - t).abs() < 1e-9);
    }
    assert_eq!(step(tank, t, 0.02).0, ERROR);
    fmi3::fmi3FreeInstance(tank);
}

/// Two locked brakes share a load and nothing says how: what stands at its limit stays there from one step to the next.
#[test]
fn brakes_that_share_a_load_slip_when_both_are_at_their_limits() {
    let text = "language/events/two_brakes_share_a_load.mo";
    let unit = make("two brakes", "3.0", &fs::read_to_string(text).expect("read"));
    let brakes = unit.stepping();
    begin(brakes, 6.0);
    for k in 0..100 {
        assert_eq!(step(brakes, 0.05 * f64::from(k), 0.05).0, OK, "{k}");
    }
    // The load t passes what both hold at 3 s: v = (t - 3)^2/4.
    assert!((unit.get(brakes, "v") - 1.0).abs() < 1e-5, "{}", unit.get(brakes, "v"));
    fmi3::fmi3FreeInstance(brakes);
}

/// A square root of a negative number ends a run, whoever integrates.
#[test]
fn outputs_without_a_value_are_told() {
    let text = "model Root
           input Real u(start = 1);
           Real x(start = 1, fixed = true);
           output Real y = sqrt(x);
         equation
           der(x) = -u;
         end Root;";
    let unit = make("no value", "3.0", text);
    let root = unit.stepping();
    begin(root, 2.0);
    assert_eq!(step(root, 0.0, 0.75).0, OK);
    assert!((unit.get(root, "y") - 0.5).abs() < 1e-6);
    assert_eq!(step(root, 0.75, 0.75).0, OK);
    let (y, mut value) = (unit.reference("y"), f64::NAN);
    assert_eq!(fmi3::fmi3GetFloat64(root, &y, 1, &mut value, 1), ERROR);
    fmi3::fmi3FreeInstance(root);
    let it = unit.exchange();
    begin(it, 2.0);
    let none = std::ptr::null_mut();
    assert_eq!(fmi3::fmi3UpdateDiscreteStates(it, none, none, none, none, none, std::ptr::null_mut()), OK);
    assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
    assert_eq!(fmi3::fmi3SetContinuousStates(it, &-0.5, 1), OK);
    assert_eq!(fmi3::fmi3GetFloat64(it, &y, 1, &mut value, 1), DISCARD);
    assert_eq!(fmi3::fmi3SetContinuousStates(it, &0.25, 1), OK);
    assert_eq!(unit.get(it, "y"), 0.5);
    fmi3::fmi3FreeInstance(it);
    // As a unit that `hyd` steps.
    let run = hyd(&unit.folder, &["simulate", "case.fmu", "--as", "co-simulation", "--stop", "2", "--result", "r.csv"]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.code() == Some(1) && !unit.folder.join("r.csv").exists(), "{said}");
    assert!(said.contains("in the computation of y"), "{said}");
}

/// A master that iterates over the inputs of a point looks at it between them: only the last values have ever been.
#[test]
fn looking_at_a_point_causes_no_events() {
    let unit = make(
        "looking",
        "3.0",
        "model Counter
           input Real u(start = 0);
           Integer n(start = 0, fixed = true);
           Real x(start = 0, fixed = true);
           output Boolean b = u > 0.5;
           output Real shown = n + u;
         equation
           der(x) = u;
           when b then
             n = pre(n) + 1;
           end when;
         end Counter;",
    );
    let it = unit.stepping();
    begin(it, 2.0);
    assert_eq!(step(it, 0.0, 0.5).0, OK);
    for (u, shown) in [(1.0, 2.0), (0.0, 0.0), (1.0, 2.0), (0.25, 0.25), (0.0, 0.0)] {
        assert_eq!(unit.set(it, "u", u), OK);
        assert_eq!(unit.get(it, "shown"), shown, "with {u}");
    }
    assert_eq!(step(it, 0.5, 0.5).0, OK);
    assert_eq!(unit.get(it, "shown"), 0.0);
    assert_eq!(unit.set(it, "u", 1.0), OK);
    assert_eq!(unit.get(it, "shown"), 2.0);
    assert_eq!(step(it, 1.0, 0.5).0, OK);
    assert_eq!(unit.get(it, "shown"), 2.0);
    assert!((unit.get(it, "x") - 0.5).abs() < 1e-9);
    fmi3::fmi3FreeInstance(it);
}

/// In version 2.0 value and slope of an input are two calls, of which none has to be the first.
#[test]
fn value_and_slope_have_no_order() {
    let unit = make(
        "slope",
        "2.0",
        "model Integrator
           input Real u(start = 0);
           output Real x(start = 0, fixed = true);
         equation
           der(x) = u;
         end Integrator;",
    );
    let (token, resources) = (unit.token(), format!("file://{}", unit.folder.join("resources").display()));
    let resources = CString::new(resources.replace(' ', "%20")).expect("a text");
    let (u, x) = (unit.reference("u"), unit.reference("x"));
    for value_first in [true, false] {
        let name = CString::default();
        let it = fmi2::fmi2Instantiate(name.as_ptr(), 1, token.as_ptr(), resources.as_ptr(), std::ptr::null(), 0, 0);
        assert!(!it.is_null());
        assert_eq!(fmi2::fmi2SetupExperiment(it, 1, 1e-8, 0.0, 1, 1.0), OK);
        assert_eq!(fmi2::fmi2EnterInitializationMode(it), OK);
        assert_eq!(fmi2::fmi2ExitInitializationMode(it), OK);
        let value = || assert_eq!(fmi2::fmi2SetReal(it, &u, 1, &0.5), OK);
        let slope = || assert_eq!(fmi2::fmi2SetRealInputDerivatives(it, &u, 1, &1, &2.0), OK);
        if value_first {
            value();
            slope();
        } else {
            slope();
            value();
        }
        let mut found = f64::NAN;
        assert_eq!(fmi2::fmi2DoStep(it, 0.0, 0.1, 1), OK);
        assert_eq!(fmi2::fmi2GetReal(it, &x, 1, &mut found), OK);
        assert!((found - 0.06).abs() < 1e-9, "{found}");
        // A value of the next step alone is held.
        assert_eq!(fmi2::fmi2SetReal(it, &u, 1, &1.0), OK);
        assert_eq!(fmi2::fmi2DoStep(it, 0.1, 0.1, 1), OK);
        assert_eq!(fmi2::fmi2GetReal(it, &x, 1, &mut found), OK);
        assert!((found - 0.16).abs() < 1e-9, "{found}");
        fmi2::fmi2FreeInstance(it);
    }
}

/// A rate may depend on the time; an output that is a state depends on nothing else, so that a loop of two units is none of algebraic equations.
#[test]
fn the_structure_names_the_time_and_no_feedthrough_of_states() {
    let text = "model Mass
           input Real f(start = 0);
           output Real place(start = 0, fixed = true);
           output Real pushed = place + f;
           Real v(start = 0, fixed = true);
         equation
           der(place) = v;
           der(v) = f + sin(time);
         end Mass;";
    let unit = make("structure", "3.0", text);
    let list = |of: &[&str]| {
        let mut all: Vec<u32> = of.iter().map(|name| unit.reference(name)).collect();
        all.sort_unstable();
        all.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")
    };
    let depends = |element: &str, name: &str| {
        unit.attribute(&format!("<{element} valueReference=\"{}\"", unit.reference(name)), "dependencies")
    };
    assert_eq!(depends("Output", "place"), list(&["place"]));
    assert!(
        depends("ContinuousStateDerivative", "der(v)").split(' ').any(|own| own == unit.reference("time").to_string())
    );
    assert!(
        depends("ContinuousStateDerivative", "der(v)").split(' ').any(|own| own == unit.reference("f").to_string())
    );
    let two = make("structure", "2.0", text);
    let outputs = two.description.split("<Outputs>").nth(1).and_then(|rest| rest.split("</Outputs>").next());
    assert!(outputs.is_some_and(|own| own.contains("dependencies=\"")), "{outputs:?}");
}

/// What the translation has used cannot be set in the unit, which is said when it is made.
#[test]
fn parameters_that_decide_sizes_are_named() {
    let folder = Scratch::new();
    let text = "model M\n  parameter Integer n = 2;\n  parameter Real k = 1;\n  Real x[n](each start = 1, each fixed = true);\nequation\n  der(x) = -k*x;\nend M;\n";
    fs::write(folder.path().join("m.hyd"), text).expect("written");
    let run = hyd(folder.path(), &["build", "m.hyd", "--fmu", "3.0", "-o", "m.fmu"]);
    let said = String::from_utf8_lossy(&run.stderr);
    let note = "note: fixed in the unit, because they decide sizes or structure: `n`; `hyd build --set NAME=VALUE`";
    assert!(run.status.success() && said.contains(note), "{said}");
}

/// Of two entries of one name an archive's reader sees one: which one was meant nobody knows.
#[test]
fn an_entry_that_stands_twice_is_refused() {
    let unit = make("twice", "3.0", "model M\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\nend M;");
    let bytes = fs::read(unit.folder.join("case.fmu")).expect("the unit");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).expect("an archive");
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    for k in 0..archive.len() {
        let mut entry = archive.by_index(k).expect("an entry");
        let name = entry.name().expect("a name").into_owned();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).expect("read");
        writer.start_file(name, SimpleFileOptions::default()).expect("begun");
        writer.write_all(&content).expect("written");
    }
    // A writer refuses a name that it knows: the second one gets it afterwards.
    writer.start_file("modelDescription.xmL", SimpleFileOptions::default()).expect("begun");
    writer.write_all(b"<other/>").expect("written");
    let mut bytes = writer.finish().expect("finished").into_inner();
    let mut at = 0;
    while let Some(next) = bytes[at..].windows(20).position(|own| own == b"modelDescription.xmL") {
        bytes[at + next + 19] = b'l';
        at += next;
    }
    let folder = Scratch::new();
    fs::write(folder.path().join("twice.fmu"), bytes).expect("written");
    let run = hyd(folder.path(), &["simulate", "twice.fmu", "--result", "r.csv"]);
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.code() == Some(1) && said.contains("stands in the archive twice"), "{said}");
}

/// Commands that are not real numbers: x' = (±a) n, and an edge is counted.
const COMMANDS: &str = "model Commands
  type Gear = enumeration(off \"No force\", slow, fast) \"What is engaged\";
  type Force = Real(quantity = \"Force\", unit = \"N\", min = 0);
  input Boolean open(start = true);
  input Integer n(start = 2);
  input Gear gear;
  input Boolean many[2];
  parameter Force f(max = 10) = 1;
  Real angle(quantity = \"Angle\", unit = \"rad\") = x;
  Real x(start = 0, fixed = true);
  discrete Integer count(start = 0, fixed = true);
  output Integer twice = 2*n;
  Gear told = gear;
equation
  der(x) = (if open then 1 else -1)*n + (if gear == Gear.fast then 100 else 0) + (if many[2] then 1000 else 0);
  when open then
    count = pre(count) + 1;
  end when;
end Commands;";

/// Inputs of type Boolean, Integer and enumeration are inputs of the unit, in either kind of use, and what they start.
#[test]
fn commands_are_inputs_and_cause_events() {
    let unit = make("commands", "3.0", COMMANDS);
    let element = |name: &str| unit.attribute(&format!("<{name}"), "causality");
    assert_eq!([element("Boolean name=\"open\""), element("Int64 name=\"n\"")], ["input", "input"]);
    assert_eq!(unit.attribute("<Enumeration name=\"gear\"", "start"), "1");
    assert_eq!(unit.attribute("<Boolean name=\"open\"", "variability"), "discrete");
    let [open, n, gear, many, count, twice] =
        ["open", "n", "gear", "many", "count", "twice"].map(|name| unit.reference(name));
    let it = unit.stepping();
    begin(it, 2.0);
    let integer = |reference: u32| {
        let mut value = i64::MIN;
        assert_eq!(fmi3::fmi3GetInt64(it, &reference, 1, &mut value, 1), OK);
        value
    };
    assert_eq!(step(it, 0.0, 0.5).0, OK);
    // Once at the start, which is no edge.
    assert_eq!((integer(count), integer(twice)), (0, 4));
    assert_eq!(fmi3::fmi3SetBoolean(it, &open, 1, &0, 1), OK);
    assert_eq!(step(it, 0.5, 0.5).0, OK);
    assert!(unit.get(it, "x").abs() < 1e-9);
    assert_eq!(fmi3::fmi3SetBoolean(it, &open, 1, &1, 1), OK);
    assert_eq!(fmi3::fmi3SetInt64(it, &n, 1, &3, 1), OK);
    assert_eq!(fmi3::fmi3SetInt64(it, &gear, 1, &3, 1), OK);
    assert_eq!(fmi3::fmi3SetBoolean(it, &many, 1, [0, 1].as_ptr(), 2), OK);
    assert_eq!(integer(twice), 6);
    assert_eq!(step(it, 1.0, 0.5).0, OK);
    assert!((unit.get(it, "x") - 551.5).abs() < 1e-6, "{}", unit.get(it, "x"));
    assert_eq!(integer(count), 1);
    // It is not a real number, so it has no slope.
    assert_eq!(fmi3::fmi3SetFloat64(it, &open, 1, &0.5, 1), ERROR);
    fmi3::fmi3FreeInstance(it);

    let it = unit.exchange();
    begin(it, 2.0);
    let none = std::ptr::null_mut();
    let settle = || fmi3::fmi3UpdateDiscreteStates(it, none, none, none, none, none, std::ptr::null_mut());
    let rate = || {
        let mut rate = f64::NAN;
        assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(it, &mut rate, 1), OK);
        rate
    };
    assert_eq!(settle(), OK);
    assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
    assert!((rate() - 2.0).abs() < 1e-12);
    for (value, expected) in [(0, -2.0), (1, 2.0)] {
        assert_eq!(fmi3::fmi3EnterEventMode(it), OK);
        assert_eq!(fmi3::fmi3SetBoolean(it, &open, 1, &value, 1), OK);
        assert_eq!(settle(), OK);
        assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
        assert!((rate() - expected).abs() < 1e-12);
    }
    let mut counted = -1;
    assert_eq!(fmi3::fmi3GetInt64(it, &count, 1, &mut counted, 1), OK);
    assert_eq!(counted, 1);
    fmi3::fmi3FreeInstance(it);
}

/// Types as they are declared, with quantities and what literals mean.
#[test]
fn declared_types_are_defined() {
    for (version, gear, force, items) in [
        ("2.0", "<SimpleType name=\"Commands.Gear\"", "<Real quantity=\"Force\"", "<Item name=\"off\""),
        (
            "3.0",
            "<EnumerationType name=\"Commands.Gear\"",
            "<Float64Type name=\"Commands.Force\"",
            "<Item name=\"off\"",
        ),
    ] {
        let unit = make("types", version, COMMANDS);
        unit.attribute(gear, "name");
        assert_eq!([unit.attribute(force, "unit"), unit.attribute(force, "min")], ["N", "0.0"], "{version}");
        assert_eq!(unit.attribute(items, "description"), "No force");
        assert_eq!(unit.attribute("<BaseUnit rad", "rad"), "1");
        let declared = unit.description.matches("declaredType=\"Commands.Gear\"").count();
        assert_eq!(declared, 2, "the input and the variable that follows it");
        let at = unit.description.find("name=\"angle\"").expect("listed");
        let rest = &unit.description[at..][..300];
        assert!(rest.contains("quantity=\"Angle\"") && !rest[..rest.find("rad").unwrap()].contains("declaredType"));
    }
}

/// A parameter outside its limits is refused as `hyd simulate` refuses it, and the unit goes on when it is put right.
#[test]
fn limits_of_parameters_hold() {
    let unit = make("limits", "3.0", COMMANDS);
    let f = unit.reference("f");
    for it in [unit.stepping(), unit.exchange()] {
        assert_eq!(fmi3::fmi3EnterInitializationMode(it, false, 0.0, 0.0, false, 0.0), OK);
        assert_eq!(fmi3::fmi3SetFloat64(it, &f, 1, &11.0, 1), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(it), ERROR);
        assert_eq!(fmi3::fmi3SetFloat64(it, &f, 1, &9.0, 1), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(it), OK);
        fmi3::fmi3FreeInstance(it);
    }
}

/// A state of the unit in model exchange is none of the unit in co-simulation.
#[test]
fn states_of_the_other_kind_are_refused() {
    let unit = make("kinds", "3.0", COMMANDS);
    let (steps, exchange) = (unit.stepping(), unit.exchange());
    let mut state = std::ptr::null_mut();
    begin(steps, 1.0);
    begin(exchange, 1.0);
    assert_eq!(fmi3::fmi3GetFMUState(steps, &mut state), OK);
    assert_eq!(fmi3::fmi3SetFMUState(exchange, state), ERROR);
    assert_eq!(fmi3::fmi3SetFMUState(steps, state), OK);
    assert_eq!(step(steps, 0.0, 0.25).0, OK);
    assert!((unit.get(steps, "x") - 0.5).abs() < 1e-9);
    assert_eq!(fmi3::fmi3FreeFMUState(steps, &mut state), OK);
    fmi3::fmi3FreeInstance(steps);
    fmi3::fmi3FreeInstance(exchange);
}

/// A start value that is a number and holds is set at the variable, before the start alone; one that follows from a parameter is set by that.
#[test]
fn start_values_of_states_can_be_set() {
    let text = "model Starts
      model Part Real h(start = 1, fixed = true); equation der(h) = -h; end Part;
      Part part;
      parameter Real z0 = 2;
      Real z(start = z0, fixed = true);
      Real x[3](start = {1, 2, 3}, each fixed = true);
      Real w(start = 4);
      output Real q(start = 5, fixed = true);
    initial equation
      w = 7;
    equation
      der(z) = -z; der(x) = -x; der(w) = -w; der(q) = -q;
    end Starts;";
    for version in ["2.0", "3.0"] {
        let unit = make("starts", version, text);
        let initial = |name: &str| unit.attribute(&format!("name=\"{name}\""), "initial");
        let states = ["part.h", "q", if version == "2.0" { "x[2]" } else { "x" }];
        assert_eq!(states.map(initial), ["exact"; 3].map(String::from), "{version}");
        assert_eq!(["z", "w"].map(initial), ["calculated"; 2].map(String::from), "{version}");
        assert!(!unit.description.contains("part.h.start"));
    }
    let unit = make("starts", "3.0", text);
    let [h, x] = ["part.h", "x"].map(|name| unit.reference(name));
    for it in [unit.stepping(), unit.exchange()] {
        assert_eq!(fmi3::fmi3SetFloat64(it, &h, 1, &3.0, 1), OK);
        assert_eq!(fmi3::fmi3EnterInitializationMode(it, true, 1e-8, 0.0, true, 1.0), OK);
        assert_eq!(fmi3::fmi3SetFloat64(it, &x, 1, [4.0, 5.0, 6.0].as_ptr(), 3), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(it), OK);
        assert_eq!([unit.get(it, "part.h"), unit.get(it, "q"), unit.get(it, "z")], [3.0, 5.0, 2.0]);
        let mut found = [0.0; 3];
        assert_eq!(fmi3::fmi3GetFloat64(it, &x, 1, found.as_mut_ptr(), 3), OK);
        assert_eq!(found, [4.0, 5.0, 6.0]);
        assert_eq!(fmi3::fmi3SetFloat64(it, &h, 1, &2.0, 1), ERROR, "after the start");
        fmi3::fmi3FreeInstance(it);
    }
    let it = unit.stepping();
    assert_eq!(fmi3::fmi3SetFloat64(it, &h, 1, &3.0, 1), OK);
    begin(it, 1.0);
    assert_eq!(step(it, 0.0, 1.0).0, OK);
    assert!((unit.get(it, "part.h") - 3.0 * (-1.0_f64).exp()).abs() < 1e-6);
    fmi3::fmi3FreeInstance(it);
    // Given back, the start is set by the name of the variable with `.start`, as that of a text is.
    for kind in ["model-exchange", "co-simulation"] {
        let run = |set: &str| {
            let arguments = ["simulate", "case.fmu", "--as", kind, "--set", set, "--stop", "1", "--result", "r.csv"];
            hyd(&unit.folder, &arguments)
        };
        assert!(run("part.h.start=3").status.success());
        let result = fs::read_to_string(unit.folder.join("r.csv")).expect("a result");
        let column = result.lines().next().expect("names").split(',').position(|name| name == "part.h");
        let last = result.lines().last().expect("rows").split(',').nth(column.expect("a column"));
        let last: f64 = last.expect("a value").parse().expect("a number");
        assert!((last - 3.0 * (-1.0_f64).exp()).abs() < 1e-5, "{kind}: {last}");
        let refused = run("part.h=3");
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && said.contains("`--set part.h.start=3` sets its start value"), "{said}");
        let refused = run("w.start=3");
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(!refused.status.success() && said.contains("finds the start of `w` by itself"), "{said}");
    }
}

/// Rates and outputs name the inputs that reach them: directly, through equations, by a relation or at an event, and no others.
#[test]
fn inputs_are_named_where_they_reach() {
    let text = "model Reach
      input Real u;
      input Real w;
      input Real level;
      input Boolean on;
      input Real far[2];
      Real x(start = 0, fixed = true);
      Real z(start = 0, fixed = true);
      Real slow(start = 0, fixed = true);
      Real a;
      Real b;
      discrete Real kept(start = 0, fixed = true);
      output Real through = 2*w + 1;
      output Real state = x;
      output Real mixed = a + z;
      output Real stored = kept;
      output Boolean high = level > 1;
      output Real quiet = noEvent(if far[2] > 0 then slow else 0);
    equation
      a + b = u;
      a - b = 3*x;
      der(x) = a - x;
      der(z) = if high then 1 else -z;
      der(slow) = if on then far[1] else 0;
      when on then
        kept = w;
      end when;
    end Reach;";
    for version in ["2.0", "3.0"] {
        let unit = make("reach", version, text);
        let arrays = version == "3.0";
        // By position in 2.0, by number in 3.0.
        let at = unit.description.find("<ModelVariables").expect("variables");
        let names: Vec<&str> =
            unit.description[at..].split("<").filter_map(|own| own.split(" name=\"").nth(1)).collect();
        let names: Vec<&str> = names.iter().map(|own| own.split('"').next().expect("a name")).collect();
        let number = |name: &str| match arrays {
            true => unit.reference(name).to_string(),
            false => (names.iter().position(|own| *own == name).expect(name) + 1).to_string(),
        };
        let structure = &unit.description[unit.description.find("<ModelStructure").expect("a structure")..];
        let depends = |list: &str, name: &str| -> Vec<String> {
            let part = if arrays { structure } else { structure.split(&format!("<{list}>")).nth(1).expect("a list") };
            let (word, attribute) = match (arrays, list) {
                (true, "Outputs") => ("<Output ", "valueReference"),
                (true, _) => ("<ContinuousStateDerivative ", "valueReference"),
                (false, _) => ("<Unknown ", "index"),
            };
            let begin = format!("{word}{attribute}=\"{}\"", number(name));
            let element = part.split(&begin).nth(1).expect(name).split("/>").next().expect("closed");
            let own = element.split("dependencies=\"").nth(1).expect("known").split('"').next().expect("closed");
            let mut own: Vec<String> = own.split_whitespace().map(String::from).collect();
            own.retain(|own| *own != number("time"));
            own.sort();
            own
        };
        let expected = |of: &[&str]| {
            let mut own: Vec<String> = of.iter().map(|name| number(name)).collect();
            own.sort();
            own
        };
        let (far1, far2) = if arrays { ("far", "far") } else { ("far[1]", "far[2]") };
        for (list, name, of) in [
            ("Outputs", "through", &["w"][..]),
            ("Outputs", "state", &["x"]),
            ("Outputs", "mixed", &["u", "x", "z"]),
            ("Outputs", "stored", &["on", "w"]),
            ("Outputs", "high", &["level"]),
            ("Outputs", "quiet", &["slow", far2]),
            ("Derivatives", "der(x)", &["u", "x"]),
            ("Derivatives", "der(z)", &["level", "z"]),
            ("Derivatives", "der(slow)", &["on", far1]),
        ] {
            assert_eq!(depends(list, name), expected(of), "{version}: {name}");
        }
    }
}
