//! The effects for any machine: each is nothing at its zero, obeys its law, and says what a search needs to know.
//!
//! A law is run by itself with inputs that are functions of time; what it gives is compared with a closed form that is
//! written here without the rounding of corners.  Every class of the packages must have a case.

use std::f64::consts::PI;

use hyd::LibraryPath;
use hyd_compiler::{Goal, Options, compile};
use hyd_results::Trajectory;
use hyd_runtime::simulate;
use hyd_tests::models::{messages, root};
use hyd_tests::runs::{Run, instance, on_grid};

const STOP: f64 = 6.0;

/// One law with its inputs.
struct Case {
    class: &'static str,
    /// `SIZE` stands for its size.
    parameters: &'static str,
    size: f64,
    inputs: &'static [(&'static str, &'static str)],
    output: &'static str,
    law: fn(f64) -> f64,
    /// Differences up to this are those of rounded corners, and of the integration.
    allowed: f64,
    /// Times from which it must hold.
    from: f64,
}

const MOTION: &[(&str, &str)] = &[("s", "0.5*sin(time)"), ("v", "0.5*cos(time)"), ("a", "-0.5*sin(time)")];
const CURRENT: &[(&str, &str)] = &[("i", "2*sin(time)"), ("u_L", "2*cos(time)")];
const VOLTAGE: &[(&str, &str)] = &[("u", "time"), ("i_C", "1")];
const HEAT: &[(&str, &str)] = &[("T", "300 + 20*time"), ("Q_C", "20")];
const VESSEL: &[(&str, &str)] = &[("h", "time"), ("q_C", "1")];
const GIVEN: &[(&str, &str)] = &[("u", "3*sin(time)")];
const SHOWN: &[(&str, &str)] = &[("u", "3*sin(time)")];

const fn law(
    class: &'static str,
    parameters: &'static str,
    size: f64,
    (inputs, output): (&'static [(&'static str, &'static str)], &'static str),
    law: fn(f64) -> f64,
    allowed: f64,
) -> Case {
    Case { class, parameters, size, inputs, output, law, allowed, from: 0.0 }
}

const FORCE: (&[(&str, &str)], &str) = (MOTION, "F");
const LOOP: (&[(&str, &str)], &str) = (CURRENT, "u");
const NODE: (&[(&str, &str)], &str) = (VOLTAGE, "i");
const BODY: (&[(&str, &str)], &str) = (HEAT, "Q");
const TANK: (&[(&str, &str)], &str) = (VESSEL, "q");
const DRIVE: (&[(&str, &str)], &str) = (GIVEN, "y");
const CHAIN: (&[(&str, &str)], &str) = (SHOWN, "y");

const BETWEEN: (&[(&str, &str)], &str) = (&[("d", "2 + sin(time)")], "y");
const PAIR: (&[(&str, &str)], &str) = (&[("u", "3*sin(time)"), ("v", "time")], "y");

/// Position and speed of the motion.
fn motion(t: f64) -> (f64, f64) {
    (0.5 * t.sin(), 0.5 * t.cos())
}

fn cases() -> Vec<Case> {
    vec![
        law("Mechanics.CoulombFriction", "F_c = SIZE, w = 1e-9", 3.0, FORCE, |t| -3.0 * motion(t).1.signum(), 1e-9),
        law(
            "Mechanics.StribeckFriction",
            "F_c = SIZE, e = 0.5, v_s = 0.2, w = 1e-9",
            3.0,
            FORCE,
            |t| -3.0 * (1.0 + 0.5 * (-(motion(t).1 / 0.2).powi(2)).exp()) * motion(t).1.signum(),
            1e-9,
        ),
        // 5 towards larger positions, 3 back: the difference is 2, the mean 4.
        law(
            "Mechanics.AsymmetricFriction",
            "F_d = SIZE, r = 2, w = 1e-9",
            2.0,
            FORCE,
            |t| if motion(t).1 > 0.0 { -5.0 } else { 3.0 },
            1e-9,
        ),
        law(
            "Mechanics.LoadFriction",
            "c = SIZE, s_0 = 0.1, w_s = 1e-7, w = 1e-9",
            4.0,
            FORCE,
            |t| -4.0 * (motion(t).0 - 0.1).abs() * motion(t).1.signum(),
            1e-6,
        ),
        // A spring of 10 that begins to act 0.2 from the middle: what is missing is its force up to there.
        law(
            "Mechanics.Backlash",
            "g = SIZE, k = 10, s_0 = 0.05",
            0.2,
            FORCE,
            |t| 10.0 * (motion(t).0 - 0.05).clamp(-0.2, 0.2),
            0.06,
        ),
        law(
            "Mechanics.UpperStop",
            "k = SIZE, s_e = 0.3, w_s = 1e-7",
            50.0,
            FORCE,
            |t| -50.0 * (motion(t).0 - 0.3).max(0.0),
            1e-5,
        ),
        law(
            "Mechanics.LowerStop",
            "k = SIZE, s_e = -0.3, w_s = 1e-7",
            50.0,
            FORCE,
            |t| 50.0 * (-0.3 - motion(t).0).max(0.0),
            1e-5,
        ),
        law("Mechanics.CubicStiffness", "k_3 = SIZE", 7.0, FORCE, |t| -7.0 * motion(t).0.powi(3), 1e-9),
        law(
            "Mechanics.BilinearStiffness",
            "k = SIZE, s_k = 0.1, w_s = 1e-7",
            -4.0,
            FORCE,
            |t| 4.0 * (motion(t).0 - 0.1).max(0.0),
            1e-6,
        ),
        law("Mechanics.LinearDrag", "d = SIZE", 2.0, FORCE, |t| -2.0 * motion(t).1, 1e-9),
        law("Mechanics.QuadraticDrag", "c = SIZE", 2.0, FORCE, |t| -2.0 * motion(t).1 * motion(t).1.abs(), 1e-9),
        law("Mechanics.AddedMass", "m = SIZE", 2.0, FORCE, |t| t.sin(), 1e-9),
        law("Mechanics.OffsetForce", "F_0 = SIZE", 2.0, FORCE, |_| 2.0, 1e-12),
        law("Electricity.SeriesResistance", "R = SIZE", 5.0, LOOP, |t| -10.0 * t.sin(), 1e-9),
        // With the inductance L/(1 + k i^2) the voltage that changes the current is that of L less what the effect gives.
        law(
            "Electricity.InductorSaturation",
            "k = SIZE",
            0.5,
            LOOP,
            |t| 2.0 * t.cos() * (1.0 - 1.0 / (1.0 + 2.0 * t.sin().powi(2))),
            1e-9,
        ),
        // The loop of one time constant lets pass cos: z = (cos + tau sin - exp(-t/tau))/(1 + tau^2).
        law(
            "Electricity.EddyCurrentLoop",
            "kappa = SIZE, tau = 0.5",
            0.4,
            LOOP,
            |t| 0.8 * (t.cos() - (t.cos() + 0.5 * t.sin() - (-2.0 * t).exp()) / 1.25),
            1e-6,
        ),
        // The integral of 4 sin^2 is 2 t - sin 2t.
        law(
            "Electricity.SelfHeating",
            "c = SIZE",
            0.5,
            LOOP,
            |t| -0.5 * (2.0 * t - (2.0 * t).sin()) * 2.0 * t.sin(),
            1e-5,
        ),
        law("Electricity.OffsetVoltage", "u_0 = SIZE", 0.5, LOOP, |_| 0.5, 1e-12),
        law("Electricity.ShuntResistance", "G = SIZE", 0.5, NODE, |t| -0.5 * t, 1e-9),
        law(
            "Electricity.DielectricAbsorption",
            "G = SIZE, tau = 2",
            0.5,
            NODE,
            |t| -0.5 * 2.0 * (1.0 - (-t / 2.0).exp()),
            1e-6,
        ),
        law("Electricity.OffsetCurrent", "i_0 = SIZE", 0.5, NODE, |_| 0.5, 1e-12),
        law("Heat.HeatLeak", "k = SIZE", 0.3, BODY, |t| -0.3 * 20.0 * t, 1e-6),
        law("Heat.Convection", "k = SIZE, T_r = 40", 0.3, BODY, |t| -0.3 * 20.0 * t * (t / 2.0).powf(0.25), 1e-6),
        law(
            "Heat.Radiation",
            "k = SIZE",
            1e-8,
            BODY,
            |t| -1e-8 * ((300.0 + 20.0 * t).powi(4) - 300.0_f64.powi(4)),
            1e-6,
        ),
        law("Heat.HeatStorage", "k = SIZE, tau = 2", 0.3, BODY, |t| -0.3 * 40.0 * (1.0 - (-t / 2.0).exp()), 1e-4),
        law("Heat.OffsetHeat", "Q_0 = SIZE", 0.5, BODY, |_| 0.5, 1e-12),
        law("Fluids.LinearLeak", "k = SIZE", 0.5, TANK, |t| -0.5 * t, 1e-9),
        Case {
            from: 0.5,
            ..law("Fluids.TorricelliLeak", "k = SIZE, h_r = 4", 2.0, TANK, |t| -2.0 * (t / 4.0).sqrt(), 2e-3)
        },
        law("Fluids.Overflow", "k = SIZE, h_e = 2, w = 1e-7", 5.0, TANK, |t| -5.0 * (t - 2.0).max(0.0), 1e-6),
        law("Fluids.TrappedAir", "k = SIZE, h_a = 2", 0.5, TANK, |t| -0.5 / (1.0 + t / 2.0).powi(2), 1e-9),
        law("Fluids.OffsetFlow", "q_0 = SIZE", 0.5, TANK, |_| 0.5, 1e-12),
        law(
            "Actuation.ActuatorDeadZone",
            "g = SIZE",
            0.5,
            DRIVE,
            |t| (3.0 * t.sin()).signum() * ((3.0 * t.sin()).abs() - 0.5).max(0.0),
            0.01,
        ),
        // Play: up to the first turn it follows half a play behind, then it rests, and so on.
        law(
            "Actuation.ActuatorHysteresis",
            "g = SIZE, u_m = 3, t_m = 1e-3",
            0.5,
            DRIVE,
            |t| {
                let u = 3.0 * t.sin();
                let (rising, falling) = ((u - 0.5).max(0.0), (u + 0.5).min(2.5));
                if t < PI / 2.0 {
                    rising
                } else if t < 1.5 * PI {
                    falling
                } else {
                    (u - 0.5).max(-2.5)
                }
            },
            1e-3,
        ),
        law(
            "Actuation.ActuatorLag",
            "tau = SIZE",
            0.5,
            DRIVE,
            |t| 3.0 * (t.sin() - 0.5 * t.cos() + 0.5 * (-2.0 * t).exp()) / 1.25,
            1e-5,
        ),
        Case {
            from: 1.0,
            ..law("Actuation.ActuatorDeadTime", "tau = SIZE", 0.1, DRIVE, |t| 3.0 * (t - 0.1).sin(), 1e-5)
        },
        law("Actuation.ActuatorLimit", "c = SIZE, u_m = 3", 0.4, DRIVE, |t| (3.0 * t.sin()).clamp(-1.8, 1.8), 2e-3),
        law("Sensing.Offset", "b = SIZE", 0.5, CHAIN, |t| 3.0 * t.sin() + 0.5, 1e-9),
        law("Sensing.SensorGain", "e = SIZE", 0.2, CHAIN, |t| 3.6 * t.sin(), 1e-9),
        // A lag of sin: (sin - tau cos + tau exp(-t/tau))/(1 + tau^2).
        law(
            "Sensing.Lag",
            "tau = SIZE",
            0.5,
            CHAIN,
            |t| 3.0 * (t.sin() - 0.5 * t.cos() + 0.5 * (-2.0 * t).exp()) / 1.25,
            1e-5,
        ),
        Case { from: 1.0, ..law("Sensing.DeadTime", "tau = SIZE", 0.1, CHAIN, |t| 3.0 * (t - 0.1).sin(), 1e-5) },
        law("Sensing.Clipping", "c = SIZE, u_m = 3", 0.4, CHAIN, |t| (3.0 * t.sin()).clamp(-1.8, 1.8), 2e-3),
        law("Sensing.AbsoluteValue", "k = SIZE, w = 1e-6", 1.0, CHAIN, |t| (3.0 * t.sin()).abs(), 1e-5),
        law(
            "Sensing.SensorDeadZone",
            "g = SIZE",
            0.5,
            CHAIN,
            |t| (3.0 * t.sin()).signum() * ((3.0 * t.sin()).abs() - 0.5).max(0.0),
            0.02,
        ),
        law("Sensing.WrongSign", "k = SIZE", 1.0, CHAIN, |t| -3.0 * t.sin(), 1e-9),
        law("Heat.HeatBridge", "k = SIZE", 3.0, BETWEEN, |t| -3.0 * (2.0 + t.sin()), 1e-9),
        law("Fluids.LeakBetween", "k = SIZE", 3.0, BETWEEN, |t| -3.0 * (2.0 + t.sin()), 1e-9),
        law(
            "Fluids.OrificeBetween",
            "k = SIZE, d_r = 2",
            3.0,
            BETWEEN,
            |t| -3.0 * ((2.0 + t.sin()) / 2.0).sqrt(),
            5e-4,
        ),
        law("Mechanics.DampingBetween", "c = SIZE", 3.0, BETWEEN, |t| -3.0 * (2.0 + t.sin()), 1e-9),
        law("Electricity.ConductanceBetween", "G = SIZE", 3.0, BETWEEN, |t| -3.0 * (2.0 + t.sin()), 1e-9),
        law("Sensing.CrossTalk", "k = SIZE", 0.1, PAIR, |t| 3.0 * t.sin() + 0.1 * t, 1e-9),
    ]
}

fn run(case: &Case, size: f64) -> Run {
    let parameters = case.parameters.replace("SIZE", &format!("{size:e}"));
    let inputs: String = case.inputs.iter().map(|(name, text)| format!("  e.{name} = {text};\n")).collect();
    let text = format!("model Bench\n  Hyd.Effects.{} e({parameters});\nequation\n{inputs}end Bench;\n", case.class);
    let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "bench.hyd", &text, &options);
    assert!(!compilation.has_errors() && compilation.model.is_some(), "{text}\n{}", messages(&compilation));
    let mut system = instance(&compilation, &[]);
    let mut rows = Trajectory::new();
    let summary = simulate(&mut system, &on_grid(STOP, 600, 1e-9), &mut rows, &|| false);
    let summary = summary.unwrap_or_else(|error| panic!("{text}{error}"));
    Run { rows, summary }
}

/// Largest difference of what an effect gives from what it should give; turns of the direction count as either.
fn off(case: &Case, size: f64, law: &dyn Fn(f64) -> f64) -> f64 {
    let run = run(case, size);
    let given = run.values(&format!("e.{}", case.output));
    let mut largest = 0.0_f64;
    for (&t, value) in run.rows.times().iter().zip(given) {
        let turns = (t / PI - 0.5).fract().abs() * PI < 0.02 || (t / PI).fract() * PI < 0.02;
        if t >= case.from && !turns {
            largest = largest.max((value - law(t)).abs());
        }
    }
    largest
}

#[test]
fn effects_obey_their_laws() {
    let mut report = String::new();
    for case in &cases() {
        let off = off(case, case.size, &case.law);
        if off.is_nan() || off > case.allowed {
            report += &format!("{}: off by {off:.3e}, {:.0e} is allowed\n", case.class, case.allowed);
        }
    }
    assert!(report.is_empty(), "{report}");
}

#[test]
fn effects_are_nothing_at_zero() {
    let mut report = String::new();
    for case in &cases() {
        let plain: fn(f64) -> f64 =
            if case.inputs[0].0 == "u" && case.output == "y" { |t| 3.0 * t.sin() } else { |_| 0.0 };
        let off = off(case, 0.0, &plain);
        if off.is_nan() || off > 2e-6 {
            report += &format!("{}: {off:.3e} at zero\n", case.class);
        }
    }
    assert!(report.is_empty(), "{report}");
}

#[test]
fn every_effect_has_a_case_and_says_what_a_search_asks() {
    let mut missing = Vec::new();
    let mut count = 0;
    for package in ["Mechanics", "Electricity", "Heat", "Fluids", "Actuation", "Sensing"] {
        for entry in std::fs::read_dir(root().join("stdlib/Hyd/Effects").join(package)).expect("the folder exists") {
            let path = entry.expect("listed").path();
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            if name == "package" {
                continue;
            }
            count += 1;
            let text = std::fs::read_to_string(&path).expect("readable");
            for needed in ["adds =", "zero = 0", "probe =", "prior =", "range =", "words =", "signature =", "rivals ="]
            {
                assert!(text.contains(needed), "{needed} is missing in {name}");
            }
            if !cases().iter().any(|case| case.class == format!("{package}.{name}")) {
                missing.push(name);
            }
        }
    }
    assert!(missing.is_empty() && count == cases().len(), "{missing:?} of {count}");
}
