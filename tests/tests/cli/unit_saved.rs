//! States of a co-simulation as bytes: another instance goes on from them with the same bits.

use std::ffi::c_void;

use hyd_unit::fmi3;

use crate::unit_client::{ERROR, OK, Unpacked, begin, make, make_with, step};

/// Distance of communication points (s).
const STEP: f64 = 0.01;
const STEPS: usize = 90;

/// A mass that a force presses into a stiff contact, events at both of its ends.
const CONTACT: &str = "model Contact
  input Real u(start = 1);
  Real x(start = 0.02, fixed = true);
  Real v(start = 0, fixed = true);
  output Real F = if x < 0 then -1e5*x*(1 + 0.2*v) else 0;
equation
  der(x) = v;
  der(v) = F - 9.81*u;
end Contact;";

/// What was is fed back, and makes breaks that lead from one to the next.
const PAST: &str = "model Past
  input Real u(start = 1);
  output Real x(start = 1, fixed = true);
  Real w = delay(x, 0.137);
equation
  der(x) = u - 2*w + (if time > 0.2 then 1 else 0);
end Past;";

/// Loops of equations that are solved by iteration, a controller with samples of its own, a state that is set to another value.
const LOOPS: &str = "model Loops
  input Real u(start = 1);
  Real x(start = 0, fixed = true);
  Real y(start = 0.5);
  Real z(start = 0.5);
  discrete Real held(start = 0, fixed = true);
  Integer n(start = 0, fixed = true);
  output Real o = y + held;
equation
  y + 0.5*sin(z) + 0.1*y^3 = u + x;
  z + 0.3*cos(y) = x*x;
  der(x) = held - x + 0.2*y;
  when sample(0.03, 0.07) then
    held = pre(held) + 0.1*(u - x);
    n = pre(n) + 1;
  end when;
  when x > 0.3 then
    reinit(x, -0.2);
  end when;
end Loops;";

/// Too many states for dense factors.
const CHAIN: &str = "model Chain
  parameter Integer n = 120;
  input Real u(start = 1);
  Real x[n](each start = 0, each fixed = true);
  output Real o = x[n];
equation
  for i in 1:n loop
    der(x[i]) = 400*((if i == 1 then u else x[i - 1]) - x[i]) - x[i]^3;
  end for;
end Chain;";

/// Ends at 0.4 s.
const ENDS: &str = "model Ends
  input Real u(start = 1);
  output Real x(start = 0, fixed = true);
equation
  der(x) = 1;
  assert(x < 0.4, \"it runs over\");
end Ends;";

/// The input over the points, with jumps.
fn input(k: usize) -> f64 {
    1.0 + (0.3 * (k / 3) as f64).sin()
}

/// Takes the steps between two points; the bits of what is shown at each of them.
fn run(unit: &Unpacked, it: *mut c_void, steps: std::ops::Range<usize>, shown: &[&str]) -> Vec<u64> {
    let mut bits = Vec::new();
    for k in steps {
        assert_eq!(unit.set(it, "u", input(k)), OK);
        if k % 5 == 0 {
            // Looked at before the step, where a jump of the input has acted.
            bits.push(unit.get(it, shown[0]).to_bits());
        }
        let (status, ..) = step(it, STEP * k as f64, STEP);
        assert_eq!(status, OK, "step {k}");
        bits.extend(shown.iter().map(|name| unit.get(it, name).to_bits()));
    }
    bits
}

/// The present state of an instance as bytes.
fn written(it: *mut c_void) -> Vec<u8> {
    let (mut state, mut size) = (std::ptr::null_mut(), 0);
    assert_eq!(fmi3::fmi3GetFMUState(it, &mut state), OK);
    assert_eq!(fmi3::fmi3SerializedFMUStateSize(it, state, &mut size), OK);
    let mut bytes = vec![0u8; size];
    assert_eq!(fmi3::fmi3SerializeFMUState(it, state, bytes.as_mut_ptr(), size), OK);
    assert_eq!(fmi3::fmi3FreeFMUState(it, &mut state), OK);
    bytes
}

/// Lets an instance go on from bytes.
fn read(it: *mut c_void, bytes: &[u8]) -> i32 {
    let mut state = std::ptr::null_mut();
    let status = fmi3::fmi3DeserializeFMUState(it, bytes.as_ptr(), bytes.len(), &mut state);
    if status == OK {
        assert_eq!(fmi3::fmi3SetFMUState(it, state), OK);
        assert_eq!(fmi3::fmi3FreeFMUState(it, &mut state), OK);
    }
    status
}

#[test]
fn another_instance_goes_on_with_the_same_bits() {
    let cases: [(&str, &str, &[&str]); 4] = [
        ("contact", CONTACT, &["x", "v", "F"]),
        ("past", PAST, &["x", "w"]),
        ("loops", LOOPS, &["x", "y", "z", "held", "o"]),
        ("chain", CHAIN, &["o"]),
    ];
    for (case, text, shown) in cases {
        let unit = make(&format!("saved {case}"), "3.0", text);
        // At the start, after a few steps, within a contact, near the end.
        for at in [0, 3, 7, 31, 66, STEPS - 1] {
            let one = unit.stepping();
            begin(one, 1.0);
            run(&unit, one, 0..at, shown);
            assert_eq!(unit.set(one, "u", 0.5), OK);
            // An input that has acted because somebody looked, and is set again before the step.
            let looked = unit.get(one, shown[0]);
            let bytes = written(one);
            let expected = run(&unit, one, at..STEPS, shown);
            // Nothing of this instance has been started.
            let other = unit.stepping();
            assert_eq!(read(other, &bytes), OK, "{case} at {at}");
            assert_eq!(unit.get(other, shown[0]).to_bits(), looked.to_bits(), "{case} at {at}");
            assert_eq!(run(&unit, other, at..STEPS, shown), expected, "{case} at {at}");
            // Back to where it was.
            assert_eq!(read(one, &bytes), OK);
            assert_eq!(run(&unit, one, at..STEPS, shown), expected, "{case} at {at}");
            fmi3::fmi3FreeInstance(one);
            fmi3::fmi3FreeInstance(other);
        }
    }
}

/// An instance that has failed refuses work, but not to be led back to where it was.
#[test]
fn a_failed_instance_goes_back_to_bytes() {
    let unit = make("saved failed", "3.0", ENDS);
    let it = unit.stepping();
    begin(it, 1.0);
    run(&unit, it, 0..30, &["x"]);
    let (mut state, mut size) = (std::ptr::null_mut(), 0);
    assert_eq!(fmi3::fmi3GetFMUState(it, &mut state), OK);
    let bytes = written(it);
    run(&unit, it, 30..39, &["x"]);
    assert_eq!(step(it, 0.39, 0.05).0, ERROR);
    assert_eq!(fmi3::fmi3SerializedFMUStateSize(it, state, &mut size), OK);
    assert_eq!(size, bytes.len());
    // It goes on to refuse everything else.
    assert_eq!(unit.set(it, "u", 2.0), ERROR);
    assert_eq!(read(it, &bytes), OK);
    assert_eq!(unit.set(it, "u", 2.0), OK);
    run(&unit, it, 30..39, &["x"]);
    fmi3::fmi3FreeInstance(it);
}

#[test]
fn damaged_states_are_refused() {
    let unit = make("saved damaged", "3.0", CONTACT);
    let it = unit.stepping();
    begin(it, 1.0);
    run(&unit, it, 0..9, &["x"]);
    let bytes = written(it);
    for at in (0..bytes.len()).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[at] ^= 1 << (at % 8);
        assert_eq!(read(it, &damaged), ERROR, "byte {at}");
    }
    for cut in [0, 7, 24, bytes.len() / 2, bytes.len() - 1] {
        assert_eq!(read(it, &bytes[..cut]), ERROR, "{cut} bytes");
    }
    // A state of the same text with another number in it is none of this one.
    let heavy = "model Heavy parameter Integer n(min = 1) = 1 annotation(Evaluate = true); Real x(start = 1, fixed = true); equation der(x) = -n*x; end Heavy;";
    let one = make("saved one", "3.0", heavy);
    let two = make_with("saved two", "3.0", heavy, &["--set", "n=2"]);
    let (left, right) = (one.stepping(), two.stepping());
    [left, right].into_iter().for_each(|it| begin(it, 1.0));
    assert_eq!(read(right, &written(left)), ERROR);
    [left, right].into_iter().for_each(|it| fmi3::fmi3FreeInstance(it));
    // A state of the other kind is none of this one.
    let exchange = unit.exchange();
    assert_eq!(read(exchange, &bytes), ERROR);
    fmi3::fmi3FreeInstance(exchange);
    // The instance goes on.
    run(&unit, it, 9..STEPS, &["x"]);
    fmi3::fmi3FreeInstance(it);
}
