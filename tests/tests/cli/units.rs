//! Units for other tools (`hyd build --fmu`): their archives, and their C functions called as an importer does.
//!
//! Solutions are closed forms.  What other importers make of units is checked in `tests/outside`.

use std::ffi::{CString, c_void};
use std::fs;

use hyd_unit::{fmi2, fmi3};

use crate::unit_client::{DISCARD, ERROR, OK, begin, hyd, make, step};

const BALL: &str = "model Ball \"A ball\"
    parameter Real e(min = 0, max = 1) = 0.5;
    parameter Real g(unit = \"m/s2\") = 10;
    Real h(unit = \"m\", start = 5, fixed = true) \"height\";
    Real v(unit = \"m/s\", displayUnit = \"km/h\");
    output Real twice = 2*h;
  equation
    der(h) = v;
    der(v) = -g;
    when h < 0 then reinit(v, -e*pre(v)); end when;
  initial equation
    v = 0;
    annotation(experiment(StopTime = 1.5));
  end Ball;";

/// Height of the ball with the default values before the second contact.
fn height(t: f64) -> f64 {
    if t < 1.0 { 5.0 - 5.0 * t * t } else { 5.0 * (t - 1.0) - 5.0 * (t - 1.0) * (t - 1.0) }
}

#[test]
fn the_archive_has_what_the_interface_asks_for() {
    for (version, folder) in [("2.0", "linux64"), ("3.0", "x86_64-linux")] {
        let unit = make("archive", version, BALL);
        for file in ["modelDescription.xml", "resources/model.hyd"] {
            assert!(unit.files.iter().any(|found| found == file), "{file} is not among {:?}", unit.files);
        }
        if cfg!(all(target_os = "linux", target_arch = "x86_64")) {
            assert!(unit.files.contains(&format!("binaries/{folder}/Ball.so")), "{:?}", unit.files);
        }
        assert_eq!(unit.attribute("<fmiModelDescription", "fmiVersion"), version);
        assert_eq!(unit.attribute("<fmiModelDescription", "modelName"), "Ball");
        assert_eq!(unit.attribute("<DefaultExperiment", "stopTime"), "1.5");
        assert!(unit.description.contains("<DisplayUnit name=\"km/h\" factor=\"3.6"), "{}", unit.description);
        let again = hyd(&unit.folder, &["build", "case.hyd", "--fmu", version, "-o", "again.fmu"]);
        assert!(again.status.success());
        let read = |name: &str| fs::read(unit.folder.join(name)).expect("written");
        assert!(read("case.fmu") == read("again.fmu"), "the same model gives other bytes");
    }
}

const PLANT: &str = "connector Bus \"signals\"
    input Real u(unit = \"N\", start = 1);
    output Real y(unit = \"m\");
  end Bus;
  connector Port
    Real p;
    flow Real q;
  end Port;
  model Vessel
    Port port;
    Real v;
  equation
    der(v) = port.q;
    port.p = v;
  end Vessel;
  model Plant
    Bus bus \"what others see\";
    Vessel a(v(start = 1, fixed = true));
    Vessel b;
    parameter Real m(unit = \"kg\") = 2;
  protected
    Real v(unit = \"m/s\", start = 0, fixed = true);
    Vessel hidden;
  equation
    der(bus.y) = v;
    m*der(v) = bus.u;
    connect(a.port, b.port);
    connect(b.port, hidden.port);
  initial equation
    bus.y = 3;
  end Plant;";

/// Connectors of the model are terminals that others connect; those of components say only what belongs together.
#[test]
fn connectors_become_terminals() {
    for version in ["2.0", "3.0"] {
        let unit = make("terminals", version, PLANT);
        let text = fs::read_to_string(unit.folder.join("terminalsAndIcons/terminalsAndIcons.xml")).expect("written");
        // In 3.0 equal variables have one entry, that of the state.
        let [p, shared] = if version == "2.0" { ["a.port.p", "b.port.p"] } else { ["a.v", "a.v"] };
        let wanted = format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiTerminalsAndIcons fmiVersion="3.0">
  <Terminals>
    <Terminal name="bus" matchingRule="plug" terminalKind="Bus" description="what others see">
      <TerminalMemberVariable variableName="bus.u" memberName="u" variableKind="signal"/>
      <TerminalMemberVariable variableName="bus.y" memberName="y" variableKind="signal"/>
    </Terminal>
    <Terminal name="a.port" matchingRule="none" terminalKind="Port">
      <TerminalMemberVariable variableName="{p}" memberName="p" variableKind="_hyd_potential"/>
      <TerminalMemberVariable variableName="a.port.q" memberName="q" variableKind="_hyd_inflow"/>
    </Terminal>
    <Terminal name="b.port" matchingRule="none" terminalKind="Port">
      <TerminalMemberVariable variableName="{shared}" memberName="p" variableKind="_hyd_potential"/>
      <TerminalMemberVariable variableName="b.port.q" memberName="q" variableKind="_hyd_inflow"/>
    </Terminal>
  </Terminals>
</fmiTerminalsAndIcons>
"#
        );
        assert_eq!(text, wanted, "{version}");
        // Two kilograms under a force of 4 N: y = 3 + t^2.
        if version == "3.0" {
            let instance = unit.stepping();
            assert_eq!(unit.set(instance, "bus.u", 4.0), OK);
            begin(instance, 1.5);
            assert_eq!(step(instance, 0.0, 1.5).0, OK);
            let y = unit.get(instance, "bus.y");
            assert!((y - 5.25).abs() < 1e-6, "{y}");
            fmi3::fmi3FreeInstance(instance);
        }
    }
}

#[test]
fn a_model_without_connectors_has_no_terminals() {
    let unit = make("no terminals", "3.0", BALL);
    assert!(unit.files.iter().all(|name| !name.starts_with("terminalsAndIcons")), "{:?}", unit.files);
}

#[test]
fn steps_of_any_length_lead_to_the_closed_form_and_states_can_be_taken_back() {
    let unit = make("steps", "3.0", BALL);
    let ball = unit.stepping();
    begin(ball, 1.5);
    let mut t = 0.0;
    for length in [0.25, 0.0, 0.5, 0.1875, 0.125, 0.25] {
        assert_eq!(step(ball, t, length), (OK, false, false, false, t + length));
        t += length;
        assert!((unit.get(ball, "h") - height(t)).abs() < 1e-6, "{} at {t}", unit.get(ball, "h"));
        assert_eq!(unit.get(ball, "twice"), 2.0 * unit.get(ball, "h"));
    }
    let mut kept = std::ptr::null_mut();
    assert_eq!(fmi3::fmi3GetFMUState(ball, &mut kept), OK);
    assert_eq!(step(ball, t, 0.1).0, OK);
    let first = unit.get(ball, "h").to_bits();
    assert_eq!(fmi3::fmi3SetFMUState(ball, kept), OK);
    assert_eq!(step(ball, t, 0.1).0, OK);
    assert_eq!(unit.get(ball, "h").to_bits(), first);
    assert_eq!(fmi3::fmi3FreeFMUState(ball, &mut kept), OK);
    assert!(kept.is_null());
    fmi3::fmi3FreeInstance(ball);
}

#[test]
fn events_are_told_to_who_wants_to_handle_them() {
    let unit = make("told", "3.0", BALL);
    let ball = unit.stepping_with(true);
    begin(ball, 1.5);
    let flags = || (false, 0.0f64);
    let update = |unit| {
        let ((mut a, mut time), mut b, mut c, mut d, mut e) = (flags(), false, false, false, false);
        fmi3::fmi3UpdateDiscreteStates(unit, &mut a, &mut b, &mut c, &mut d, &mut e, &mut time)
    };
    assert_eq!(update(ball), OK);
    assert_eq!(fmi3::fmi3EnterStepMode(ball), OK);
    let (status, event, end, early, last) = step(ball, 0.0, 1.25);
    assert_eq!((status, event, end, early), (OK, true, false, true));
    assert!((last - 1.0).abs() < 1e-9, "{last}");
    assert!(unit.get(ball, "v") < -9.9);
    assert_eq!(fmi3::fmi3EnterEventMode(ball), OK);
    assert_eq!(update(ball), OK);
    assert!((unit.get(ball, "v") - 5.0).abs() < 1e-6);
    assert_eq!(fmi3::fmi3EnterStepMode(ball), OK);
    assert_eq!(step(ball, last, 1.25 - last).0, OK);
    assert!((unit.get(ball, "h") - height(1.25)).abs() < 1e-6);
    fmi3::fmi3FreeInstance(ball);
}

#[test]
fn rates_indicators_and_derivatives_are_those_of_the_equations_whatever_was_tried_before() {
    let unit = make(
        "rates",
        "3.0",
        "model Loop
           parameter Real a = 0.5;
           input Real u(start = 0.25);
           Real x(start = 1, fixed = true);
           Real z(start = 1);
           output Real y = x*z + u;
         equation
           der(x) + a*sin(der(x)) + z = u;
           z^3 + z = 2*x;
         end Loop;",
    );
    let it = unit.exchange();
    begin(it, 1.0);
    let null = std::ptr::null_mut();
    let updated = fmi3::fmi3UpdateDiscreteStates(it, null, null, null, null, null, std::ptr::null_mut());
    assert_eq!(updated, OK);
    assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
    let rate = |x: f64| {
        let mut out = f64::NAN;
        assert_eq!(fmi3::fmi3SetContinuousStates(it, &x, 1), OK);
        assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(it, &mut out, 1), OK);
        out
    };
    // z = 1 at x = 1, z = 2 at x = 5.
    for (x, z) in [(1.0, 1.0), (5.0, 2.0)] {
        let dx = rate(x);
        assert!((dx + 0.5 * dx.sin() + z - 0.25).abs() < 1e-11, "{dx} at {x}");
    }
    let first = rate(1.3).to_bits();
    for x in [4.0, -2.0, 1.0, 30.0] {
        rate(x);
    }
    assert_eq!(rate(1.3).to_bits(), first, "a value depends on what was tried before");
    // By hand: dz/dx = 2/(3 z^2 + 1), dx'/dx = -dz/dx / (1 + a cos x'), dy/dx = z + x dz/dx.
    let dx = rate(5.0);
    let slope = 2.0 / 13.0;
    let gain = 1.0 + 0.5 * dx.cos();
    let unknowns = [unit.reference("der(x)"), unit.reference("y")];
    let cases = [("x", [-slope / gain, 2.0 + 5.0 * slope]), ("u", [1.0 / gain, 1.0])];
    for (known, expected) in cases {
        let (known, seed, mut found) = (unit.reference(known), 1.0, [f64::NAN; 2]);
        let status =
            fmi3::fmi3GetDirectionalDerivative(it, unknowns.as_ptr(), 2, &known, 1, &seed, 1, found.as_mut_ptr(), 2);
        assert_eq!(status, OK);
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-7, "{found}, not {expected}");
        }
    }
    assert_eq!(unit.set(it, "u", 0.75), OK);
    let dx = rate(1.0);
    // A rate is exact to 1e-12 of its state in a thousandth of the run.
    assert!((dx + 0.5 * dx.sin() + 1.0 - 0.75).abs() < 2e-9);
    // A state that is not a number is refused, and the unit goes on.
    assert_eq!(fmi3::fmi3SetContinuousStates(it, &f64::NAN, 1), DISCARD);
    rate(1.0);
    fmi3::fmi3FreeInstance(it);
}

/// A rate that decides a branch without an event has the slope of a linear one on both sides; it is solved for all the same, from whatever point.
#[test]
fn what_a_rate_decides_without_an_event_is_what_it_decides_at_the_solution() {
    let unit = make(
        "decides",
        "3.0",
        "model Switched
           Real x(start = 0, fixed = true);
         equation
           der(x) = x - (if noEvent(der(x) > 1) then 1 else 0);
         end Switched;",
    );
    let it = unit.exchange();
    begin(it, 1.0);
    let none = std::ptr::null_mut();
    assert_eq!(fmi3::fmi3UpdateDiscreteStates(it, none, none, none, none, none, std::ptr::null_mut()), OK);
    assert_eq!(fmi3::fmi3EnterContinuousTimeMode(it), OK);
    for (x, wanted) in [(3.0, 2.0), (0.5, 0.5), (7.0, 6.0), (-1.0, -1.0)] {
        let mut rate = f64::NAN;
        assert_eq!(fmi3::fmi3SetContinuousStates(it, &x, 1), OK);
        assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(it, &mut rate, 1), OK);
        assert!((rate - wanted).abs() < 1e-12, "{rate} and not {wanted} at {x}");
    }
    fmi3::fmi3FreeInstance(it);
}

/// What does not hold at the start ends the start of both kinds, and a parameter with which it holds lets them begin.
#[test]
fn an_assertion_that_fails_at_the_start_refuses_the_start() {
    let unit = make(
        "assertion",
        "3.0",
        "model Tank
           parameter Real h_0(unit = \"m\") = 3;
           Real h(unit = \"m\", start = h_0, fixed = true);
         equation
           der(h) = -0.1;
           assert(h < 2, \"the tank runs over\");
         end Tank;",
    );
    for it in [unit.exchange(), unit.stepping()] {
        assert_eq!(fmi3::fmi3EnterInitializationMode(it, true, 1e-8, 0.0, true, 1.0), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(it), ERROR);
        // Still before the start: neither a step nor an event.
        assert_eq!(step(it, 0.0, 0.1).0, ERROR);
        assert_eq!(fmi3::fmi3EnterEventMode(it), ERROR);
        assert_eq!(unit.set(it, "h_0", 1.5), OK);
        assert_eq!(fmi3::fmi3ExitInitializationMode(it), OK);
        assert_eq!(unit.get(it, "h"), 1.5);
        fmi3::fmi3FreeInstance(it);
    }
}

#[test]
fn wrong_calls_end_in_an_error_and_harm_nothing() {
    let unit = make("wrong", "3.0", BALL);
    let ball = unit.stepping();
    assert_eq!(step(ball, 0.0, 0.1).0, ERROR);
    assert_eq!(fmi3::fmi3ExitInitializationMode(ball), ERROR);
    // Its start follows from an equation.
    assert_eq!(unit.set(ball, "v", 3.0), ERROR);
    assert_eq!(unit.set(ball, "g", f64::NAN), ERROR);
    let mut value = 0.0;
    assert_eq!(fmi3::fmi3GetFloat64(ball, &u32::MAX, 1, &mut value, 1), ERROR);
    assert_eq!(fmi3::fmi3GetFloat64(ball, std::ptr::null(), 1, &mut value, 1), ERROR);
    assert_eq!(fmi3::fmi3GetFloat64(ball, &unit.reference("g"), 1, std::ptr::null_mut(), 1), ERROR);
    assert_eq!(fmi3::fmi3GetFloat64(ball, &unit.reference("g"), 1, &mut value, 2), ERROR);
    assert_eq!(fmi3::fmi3SetTime(ball, 0.0), ERROR);
    assert_eq!(fmi3::fmi3Terminate(std::ptr::null_mut()), ERROR);
    assert_eq!(unit.set(ball, "g", 2.5), OK);
    begin(ball, 1.5);
    assert_eq!(step(ball, 0.5, 0.1).0, ERROR);
    assert_eq!(step(ball, 0.0, -0.1).0, ERROR);
    assert_eq!(step(ball, 0.0, 0.5).0, OK);
    assert!((unit.get(ball, "h") - (5.0 - 1.25 * 0.25)).abs() < 1e-7);
    assert_eq!(unit.set(ball, "g", 10.0), ERROR, "a fixed parameter changes during the run");
    assert_eq!(fmi3::fmi3Reset(ball), OK);
    begin(ball, 1.5);
    assert_eq!(step(ball, 0.0, 0.5).0, OK);
    assert!((unit.get(ball, "h") - height(0.5)).abs() < 1e-7);
    fmi3::fmi3FreeInstance(ball);
}

#[test]
fn a_foreign_token_damaged_resources_and_a_missing_folder_give_no_instance() {
    let unit = make("foreign", "2.0", BALL);
    let instance = |token: &CString, resources: &str| {
        let (name, resources) = (CString::default(), CString::new(resources).expect("a text"));
        let made = fmi2::fmi2Instantiate(name.as_ptr(), 1, token.as_ptr(), resources.as_ptr(), std::ptr::null(), 0, 0);
        let made_one = !made.is_null();
        fmi2::fmi2FreeInstance(made);
        made_one
    };
    let folder = unit.folder.join("resources");
    let uri = format!("file://{}", folder.display().to_string().replace(' ', "%20"));
    assert!(instance(&unit.token(), &uri));
    assert!(!instance(&CString::new("{other}").expect("a text"), &uri));
    assert!(!instance(&unit.token(), "file:///nowhere"));
    assert!(!instance(&unit.token(), "http://x/y"));
    let mut dice = Dice(0x2545_f491_4f6c_dd1d);
    let bytes = fs::read(folder.join("model.hyd")).expect("the payload");
    for _ in 0..500 {
        let mut damaged = bytes.clone();
        let at = dice.roll(damaged.len());
        match dice.roll(3) {
            0 => damaged.truncate(at),
            1 => damaged.insert(at, 0),
            _ => damaged[at] ^= 1 << dice.roll(8),
        }
        fs::write(folder.join("model.hyd"), damaged).expect("written");
        assert!(!instance(&unit.token(), &uri), "a damage at byte {at} goes unnoticed");
    }
    fs::write(folder.join("model.hyd"), bytes).expect("written");
    assert!(instance(&unit.token(), &uri));
    fs::write(folder.join("inputs.hyd"), [0; 7]).expect("written");
    assert!(!instance(&unit.token(), &uri));
}

#[test]
fn what_a_unit_cannot_be_is_said_when_it_is_made() {
    let folder = std::env::temp_dir().join(format!("hyd unit said {}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    let build = |text: &str| {
        fs::write(folder.join("case.hyd"), text).expect("written");
        let output = hyd(&folder, &["build", "case.hyd", "--fmu", "3.0", "-o", "case.fmu"]);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, text) = build("model M input Real u; Real y; equation y = der(u); end M;");
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("need the derivative of the input `u`"), "{text}");
    let (code, text) = build("model M Real x(start = 1, fixed = true); equation der(x) = -delay(x, 0.5); end M;");
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("co-simulation only"), "{text}");
    fs::remove_dir_all(folder).expect("removed");
}

/// Numbers that look like chance and are the same in every run (Marsaglia 2003, "Xorshift RNGs").
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % sides as u64) as usize
    }

    fn number(&mut self) -> f64 {
        [0.0, 0.1, 0.5, 1.0, 1.2, 5.0, -1.0, 1e-300, 1e300, f64::NAN, f64::INFINITY][self.roll(11)]
    }
}

/// A call that may or may not fit; returns its status.
fn any_call(unit: *mut c_void, dice: &mut Dice, references: &[u32], kept: &mut [*mut c_void; 2]) -> i32 {
    let (mut a, mut b, mut c, mut d, mut e, mut t) = (false, false, false, false, false, 0.0);
    let (mut out, given) = ([0.0; 2], [dice.number(), dice.number()]);
    // There are two states, one indicator, and scalars.
    let count = [0, 1, 2][dice.roll(3)];
    let (reference, other) = (references[dice.roll(references.len())], references[dice.roll(references.len())]);
    let state = &mut kept[dice.roll(2)];
    match dice.roll(24) {
        0 | 1 => fmi3::fmi3EnterInitializationMode(unit, true, 1e-6, 0.0, true, 1.5),
        2 => fmi3::fmi3EnterInitializationMode(unit, true, given[0], given[1], true, dice.number()),
        3 | 4 => fmi3::fmi3ExitInitializationMode(unit),
        5 => fmi3::fmi3EnterEventMode(unit),
        6 => fmi3::fmi3UpdateDiscreteStates(unit, &mut a, &mut b, &mut c, &mut d, &mut e, &mut t),
        7 => fmi3::fmi3EnterContinuousTimeMode(unit),
        8 => fmi3::fmi3EnterStepMode(unit),
        9 => fmi3::fmi3CompletedIntegratorStep(unit, true, &mut a, &mut b),
        10 => fmi3::fmi3SetTime(unit, given[0]),
        11 => fmi3::fmi3SetContinuousStates(unit, given.as_ptr(), count),
        12 => fmi3::fmi3GetContinuousStates(unit, out.as_mut_ptr(), count),
        13 => fmi3::fmi3GetContinuousStateDerivatives(unit, out.as_mut_ptr(), count),
        14 => fmi3::fmi3GetEventIndicators(unit, out.as_mut_ptr(), count),
        15 => fmi3::fmi3GetNominalsOfContinuousStates(unit, out.as_mut_ptr(), count),
        16 => fmi3::fmi3GetFloat64(unit, &reference, 1, out.as_mut_ptr(), count),
        17 => fmi3::fmi3SetFloat64(unit, &reference, 1, given.as_ptr(), 1),
        18 => {
            fmi3::fmi3GetDirectionalDerivative(unit, &reference, 1, &other, 1, given.as_ptr(), 1, out.as_mut_ptr(), 1)
        }
        19 => step(unit, given[0], given[1]).0,
        20 => step(unit, 0.0, 0.5).0,
        21 => fmi3::fmi3GetFMUState(unit, state),
        22 => fmi3::fmi3SetFMUState(unit, *state),
        _ => fmi3::fmi3Terminate(unit),
    }
}

#[test]
fn calls_in_any_order_end_in_a_status_and_a_reset_makes_everything_new() {
    let unit = make("any order", "3.0", BALL);
    // The time, what has a name, an indicator, what names nothing.
    let references: Vec<u32> = (0..24).chain([u32::MAX]).collect();
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    let mut seen = [0usize; 4];
    for kind in 0..4 {
        let it = match kind {
            0 | 1 => unit.stepping_with(kind == 1),
            _ => unit.exchange(),
        };
        let mut kept = [std::ptr::null_mut(); 2];
        for _ in 0..500 {
            for _ in 0..12 {
                let status = any_call(it, &mut dice, &references, &mut kept);
                seen[usize::try_from(status).expect("a status")] += 1;
            }
            assert_eq!(fmi3::fmi3Reset(it), OK);
        }
        for state in &mut kept {
            assert_eq!(fmi3::fmi3FreeFMUState(it, state), OK);
        }
        begin(it, 1.5);
        match kind {
            0 => {
                assert_eq!(step(it, 0.0, 0.5).0, OK);
                assert!((unit.get(it, "h") - height(0.5)).abs() < 1e-7);
            }
            1 => assert_eq!(fmi3::fmi3EnterStepMode(it), OK),
            _ => {
                let mut rates = [f64::NAN; 2];
                assert_eq!(fmi3::fmi3GetContinuousStateDerivatives(it, rates.as_mut_ptr(), 2), OK);
                assert_eq!(rates, [0.0, -10.0]);
            }
        }
        fmi3::fmi3FreeInstance(it);
    }
    // Both happen often, so that the run has tried something.
    assert!(seen[0] > 2000 && seen[3] > 2000, "{seen:?}");
}
