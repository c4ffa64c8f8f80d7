//! The effects of the library on the drive: without their text, at their zero, switched on.
//!
//! An effect is put into the drive by a text of three lines, as a user would write it.  For each one: where it declares
//! a `zero`, the run there equals the base within ten times the tolerance of the stored solutions' limits; at its probe
//! the channel that it names moves by more than a bench's noise; and what it adds obeys its own equation, which is
//! written here once more by hand.  Ids and kinds are read from the annotations and compared with the catalogue.

use std::collections::BTreeMap;

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_results::Trajectory;
use hyd_runtime::simulate;
use hyd_tests::models::{messages, root};
use hyd_tests::runs::{Run, instance, on_grid};

const TOLERANCE: f64 = 1e-8;

/// Channels of the drive, and how far a run may be off at zero (ten times the limits of the stored solutions at 1e-8).
const CHANNELS: [(&str, f64); 5] = [("u_C", 1e-4), ("i", 2e-4), ("x", 2e-7), ("y", 1e-6), ("p_R", 1e5)];

/// A drive with one effect: base model, modification, output that must move, by how much (a bench's noise).
struct Case {
    id: &'static str,
    base: &'static str,
    /// With `SIZE` where the size of the effect stands.
    modification: &'static str,
    zero: Option<&'static str>,
    probe: &'static str,
    channel: &'static str,
    moves: f64,
}

const fn case(
    id: &'static str,
    modification: &'static str,
    zero: Option<&'static str>,
    probe: &'static str,
    channel: &'static str,
    moves: f64,
) -> Case {
    Case { id, base: "Drive", modification, zero, probe, channel, moves }
}

const CASES: [Case; 20] = [
    case("supply_line", "redeclare Hyd.Effects.SupplyLine supply(l = SIZE)", None, "1.5", "p_0", 5e4),
    case(
        "chamber_leakage",
        "hy(redeclare Hyd.Effects.ChamberLeakage leakage(k_leak = SIZE))",
        Some("0"),
        "1e-11",
        "p_R",
        5e4,
    ),
    case(
        "incomplete_filling",
        "hy(ra(redeclare Hyd.Effects.IncompleteFilling contents(void = SIZE)))",
        Some("0"),
        "0.05",
        "y",
        15e-6,
    ),
    case(
        "entrained_air",
        "hy(ra(redeclare Hyd.Effects.EntrainedAir contents(alpha = SIZE)))",
        Some("0"),
        "0.02",
        "p_R",
        5e4,
    ),
    // The nominal drive just stays above zero, so the bounce is made livelier by a seat of less damping.
    case(
        "cavitation",
        "sh(chi_seat = 0.2), hy(ra(redeclare Hyd.Effects.Cavitation contents(p_v = SIZE)))",
        None,
        "2e3",
        "p_R",
        5e4,
    ),
    case("piston_friction", "sh(redeclare Hyd.Effects.PistonFriction force(F_c = SIZE))", Some("0"), "60", "y", 15e-6),
    case(
        "spool_stiction",
        "ro(su(redeclare Hyd.Effects.SpoolStiction force(F_c = SIZE)))",
        Some("0"),
        "2.5",
        "x",
        1e-6,
    ),
    case("seat_cushion", "sh(redeclare Hyd.Effects.SeatCushion cushion(b_sq = SIZE))", Some("0"), "600", "y", 15e-6),
    case("eddy_currents", "ro(redeclare Hyd.Effects.EddyCurrents magnetics(g_e = SIZE))", Some("0"), "0.05", "i", 0.02),
    case(
        "magnetic_saturation",
        "ro(redeclare Hyd.Effects.MagneticSaturation iron(i_s = SIZE))",
        Some("0"),
        "0.6",
        "i",
        0.02,
    ),
    case("coil_heating", "ro(rlc(redeclare Hyd.Effects.CoilHeating coil(dT = SIZE)))", Some("0"), "30", "i", 0.02),
    Case {
        base: "DriveNoMotionalEmf",
        ..case("motional_emf", "ro(redeclare Hyd.Effects.MotionalEmf em(kappa = SIZE))", Some("0"), "1", "i", 0.02)
    },
    Case {
        base: "DriveConstantInductance",
        ..case(
            "variable_inductance",
            "ro(redeclare Hyd.Effects.VariableInductance lc(kappa = SIZE))",
            Some("0"),
            "1",
            "i",
            0.02,
        )
    },
    case(
        "spool_flow_force",
        "redeclare Hyd.Effects.SpoolFlowForce flow_force(k_ff = SIZE)",
        Some("0"),
        "0.5",
        "x",
        1e-6,
    ),
    case("connecting_pipe", "redeclare Hyd.Effects.ConnectingPipe passage(l = SIZE)", None, "0.3", "p_R", 5e4),
    case("oil_temperature", "sh(redeclare Hyd.Effects.OilTemperature damping(dT = SIZE))", Some("0"), "20", "y", 15e-6),
    case("stop_elasticity", "sh(redeclare Hyd.Effects.StopElasticity stop(c_2 = SIZE))", Some("0"), "2e-7", "y", 15e-6),
    case(
        "sensor_lag",
        "redeclare Hyd.Effects.SensorLag sensor_p_R(tau = SIZE)",
        Some("0"),
        "3e-4",
        "sensor_p_R.y",
        5e4,
    ),
    case(
        "sensor_offset",
        "redeclare Hyd.Effects.SensorOffset sensor_y(b = SIZE)",
        Some("0"),
        "80e-6",
        "sensor_y.y",
        15e-6,
    ),
    case(
        "trigger_delay",
        "ro(rlc(redeclare Hyd.Effects.TriggerDelay trigger(t_d = SIZE)))",
        Some("0"),
        "3e-4",
        "i",
        0.02,
    ),
];

fn translated(text: &str) -> Compilation {
    let path = root().join("models/single_acting_drive/variant.hyd");
    let mut library = LibraryPath::new();
    library.add_main_file(&path, text);
    let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, "variant.hyd", text, &options);
    assert!(!compilation.has_errors() && compilation.model.is_some(), "{text}\n{}", messages(&compilation));
    compilation
}

fn run(base: &str, modification: &str) -> Run {
    let text = format!("within SingleActingDrive;\nmodel Variant\n  extends {base}({modification});\nend Variant;\n");
    let mut system = instance(&translated(&text), &[]);
    let mut rows = Trajectory::new();
    // Waves are looked at closely elsewhere (`tests/tests/models/wave_lines.rs`).
    let tolerance = if modification.contains("SupplyLine") { 1e-6 } else { TOLERANCE };
    let summary = simulate(&mut system, &on_grid(0.05, 1000, tolerance), &mut rows, &|| false);
    let summary = summary.unwrap_or_else(|error| panic!("{text}{error}"));
    Run { rows, summary }
}

fn with(case: &Case, size: &str) -> Run {
    run(case.base, &case.modification.replace("SIZE", size))
}

/// Largest difference of a variable between two runs.
fn difference(a: &Run, b: &Run, name: &str) -> f64 {
    let pairs = a.values(name).into_iter().zip(b.values(name));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The run of a base, with what stands in the modification beside the effect.
fn base_of(case: &Case) -> Run {
    let beside = if case.id == "cavitation" { "sh(chi_seat = 0.2)" } else { "" };
    run(case.base, beside)
}

#[test]
fn a_drive_without_the_text_is_the_drive() {
    let compiled = |text: &str| {
        let mut system = instance(&translated(text), &[]);
        let mut rows = Trajectory::new();
        simulate(&mut system, &on_grid(0.05, 200, TOLERANCE), &mut rows, &|| false).expect("runs");
        CHANNELS.map(|(name, _)| rows.series(name).expect("a channel").values())
    };
    let drive = std::fs::read_to_string(root().join("models/single_acting_drive/drive.hyd")).expect("readable");
    let extended = "within SingleActingDrive;\nmodel Variant\n  extends Drive;\nend Variant;\n";
    assert_eq!(compiled(&drive), compiled(extended));
}

#[test]
fn effects_vanish_at_zero() {
    let mut bases: BTreeMap<&str, Run> = BTreeMap::new();
    let mut report = String::new();
    for case in &CASES {
        let Some(zero) = case.zero else { continue };
        let base = bases.entry(case.base).or_insert_with(|| run(case.base, ""));
        let at_zero = with(case, zero);
        let shown = [("sensor_p_R.y", 1e5), ("sensor_y.y", 1e-6)];
        for (channel, allowed) in CHANNELS.into_iter().chain(shown) {
            let off = difference(base, &at_zero, channel);
            if off.is_nan() || off > allowed {
                report += &format!("{}: {channel} is off by {off:.2e} at zero, {allowed:.0e} is allowed\n", case.id);
            }
        }
    }
    assert!(report.is_empty(), "{report}");
}

#[test]
fn effects_change_the_drive() {
    let mut report = String::new();
    for case in &CASES {
        let moved = difference(&base_of(case), &with(case, case.probe), case.channel);
        println!("{}: {} moves by {moved:.3e}", case.id, case.channel);
        if moved.is_nan() || moved < 3.0 * case.moves {
            report += &format!("{}: {} moves by {moved:.2e} only\n", case.id, case.channel);
        }
    }
    assert!(report.is_empty(), "{report}");
}

/// Checks at every output point that `is` equals `should`, both computed from variables of the run, to `share` of the largest.
fn obeys(run: &Run, is: &str, names: &[&str], share: f64, should: impl Fn(&[f64]) -> f64) {
    let columns: Vec<Vec<f64>> = names.iter().map(|name| run.values(name)).collect();
    let actual = run.values(is);
    let largest = actual.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(largest > 0.0, "{is} does nothing");
    for (k, &value) in actual.iter().enumerate() {
        let at: Vec<f64> = columns.iter().map(|column| column[k]).collect();
        let expected = should(&at);
        assert!((value - expected).abs() <= share * largest, "{is}, row {k}: {value} instead of {expected} at {at:?}");
    }
}

fn effect(id: &str) -> Run {
    let case = CASES.iter().find(|case| case.id == id).expect("a case");
    with(case, case.probe)
}

#[test]
fn forces_obey_their_laws() {
    let friction = |c: f64, s: f64, v_s: f64, v_r: f64| {
        move |v: &[f64]| -(c + (s - c) * (-(v[0] / v_s).powi(2)).exp()) * (v[0] / v_r).tanh()
    };
    obeys(&effect("piston_friction"), "sh.force.F", &["w"], 1e-12, friction(60.0, 84.0, 0.05, 5e-3));
    obeys(&effect("spool_stiction"), "ro.su.force.F", &["v"], 1e-12, friction(2.5, 6.25, 0.02, 1e-3));
    obeys(&effect("seat_cushion"), "sh.cushion.F", &["y", "w"], 1e-12, |v| {
        -600.0 * v[1] / (1.0 + v[0].max(0.0) / 5e-4).powi(3)
    });
    obeys(&effect("oil_temperature"), "sh.damping.F", &["w"], 1e-12, |v| -60.0 * (-0.6_f64).exp() * v[0]);
    let area = |x: f64| {
        let h = x.max(0.0) / 2.0_f64.sqrt();
        std::f64::consts::PI * h * (8e-3 - h / 2.0_f64.sqrt())
    };
    let jet = |v: &[f64]| -0.5 * 2.0 * 0.65 * 0.65 * area(v[0]) * (v[1] - v[2]) * 0.87_f64.cos();
    obeys(&effect("spool_flow_force"), "flow_force.F", &["x", "p_0", "p_R"], 1e-9, jet);
    let stop = |v: &[f64]| {
        let d = v[0] - 8e-3;
        let k = 8e6 * 5e6 / 13e6;
        if d > 0.0 { (k * d * (1.0 + 0.4 * v[1])).max(0.0) } else { 0.0 }
    };
    obeys(&effect("stop_elasticity"), "sh.stop.F_n", &["y", "w"], 1e-9, stop);
}

#[test]
fn circuits_obey_their_laws() {
    // W closed until 10 ms: e = (u_C - (R + R_w) i_m)/(1 + (R + R_w) g), and i = i_m + g e.
    let run = effect("eddy_currents");
    let mut jump = f64::NAN;
    for (k, &t) in run.rows.times().iter().enumerate() {
        let value = |name: &str| run.rows.series(name).expect("a variable").at(k);
        let i_m = value("ro.lc.lambda") / value("ro.lc.L_e");
        if t < 9.99e-3 {
            let e = (value("u_C") - 2.5 * i_m) / (1.0 + 2.5 * 0.05);
            assert!((value("i") - i_m - 0.05 * e).abs() < 1e-9, "at {t} s");
        }
        if k == 0 {
            jump = value("i");
        }
        let force = 0.5 * i_m * i_m * value("ro.lc.dL_dx");
        assert!((value("ro.lc.F_e") - force).abs() < 1e-9 * (1.0 + force), "at {t} s");
    }
    assert!((jump - 24.0 * 0.05 / 1.125).abs() < 1e-6, "the current jumps to {jump} A");
    let iron = |v: &[f64]| v[0] / v[1] + 0.6 * v[0].signum() * (v[0].abs() / 0.05).powi(7);
    obeys(&effect("magnetic_saturation"), "i", &["ro.lc.lambda", "ro.lc.L_e"], 1e-9, iron);
    obeys(&effect("coil_heating"), "ro.rlc.coil.v", &["i"], 1e-12, |v| 1.9 * 3.9e-3 * 30.0 * v[0]);
    obeys(&effect("variable_inductance"), "i", &["ro.lc.lambda", "ro.lc.L_e"], 1e-9, |v| v[0] / v[1]);
}

/// L di/dt = u - i L' v is d(L i)/dt = u: with the effect the reduced drive is the whole one.
#[test]
fn reduced_drives_become_the_whole_one() {
    let whole = run("Drive", "");
    for id in ["motional_emf", "variable_inductance"] {
        let repaired = effect(id);
        for (channel, allowed) in CHANNELS {
            let off = difference(&whole, &repaired, channel);
            assert!(off < allowed, "{id}: {channel} is off by {off:e}");
        }
    }
}

#[test]
fn oil_obeys_its_laws() {
    obeys(&effect("chamber_leakage"), "hy.leakage.q", &["p_R"], 1e-9, |v| 1e-11 * (v[0] - 1e5));
    // The two ways to say that the chamber is not full are one.
    let (effect_run, base) = (with(&CASES[2], "0.08"), run("Drive", "hy(wyp = 0.92)"));
    assert!(difference(&effect_run, &base, "y") < 1e-7 && difference(&effect_run, &base, "p_R") < 1e4);
    let modulus = |v: &[f64]| {
        let p = (v[0] + (v[0] * v[0] + 4e8).sqrt()) / 2.0;
        let r = 0.02 * (1e5 / p).powf(1.0 / 1.2);
        (1.0 + r) / (1.0 / 1.4e9 + r / (1.2 * p))
    };
    obeys(&effect("entrained_air"), "hy.ra.contents.K_eff", &["p_R"], 1e-9, modulus);
    let vapour = effect("cavitation");
    let (p, void) = (vapour.values("p_R"), vapour.values("hy.ra.contents.V_void"));
    assert!(p.iter().all(|&p| p >= 2e3 - 1e-3), "the pressure falls below that of vapour");
    assert!(void.iter().any(|&v| v > 1e-10), "the oil never tears");
    assert!(p.iter().zip(&void).all(|(&p, &v)| v < 1e-15 || (p - 2e3).abs() < 1e-3), "a void beside pressure");
    let base = run("Drive", "sh(chi_seat = 0.2)").values("p_R").into_iter().fold(f64::MAX, f64::min);
    assert!(base < 2e3, "the base stays at {base} Pa");
    // Without inertia and friction a pipe between two vessels is one vessel: a short and wide one comes close.
    let (short, joined) = (
        run(
            "Drive",
            "redeclare Hyd.Effects.ConnectingPipe passage(l = 1e-3, d = 30e-3, V_A = 1.5e-6), hy(V_0 = 1.5e-6)",
        ),
        run("Drive", ""),
    );
    let off = difference(&short, &joined, "y");
    assert!(off < 2e-5, "a short pipe moves the valve by {off} m");
}

#[test]
fn chains_of_measurement_obey_their_laws() {
    let delayed = effect("trigger_delay");
    let base = run("Drive", "");
    for channel in ["u_C", "i", "y"] {
        // 0.3 ms are six rows.
        let (late, early) = (delayed.values(channel), base.values(channel));
        let off = late[6..].iter().zip(&early).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let range = early.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        assert!(off < 1e-5 * range, "{channel} is not the same, later: {off:e}");
    }
    let offset = effect("sensor_offset");
    obeys(&offset, "sensor_y.y", &["y"], 1e-12, |v| v[0] + 80e-6);
    // tau ds/dt = p - s over the whole run: the integral of p - s is tau (s_end - s_start), by the trapezoidal rule.
    let lag = effect("sensor_lag");
    let (p, s, t) = (lag.values("p_R"), lag.values("sensor_p_R.s"), lag.rows.times());
    let integral: f64 = (1..t.len()).map(|k| (t[k] - t[k - 1]) * (p[k] - s[k] + p[k - 1] - s[k - 1]) / 2.0).sum();
    let (first, last) = (s[0], s[t.len() - 1]);
    assert!((integral - 3e-4 * (last - first)).abs() < 0.5, "{integral} Pa s instead of {}", 3e-4 * (last - first));
    assert!((first - 1e5).abs() < 1.0, "the sensor does not begin at rest");
}

/// Effects in one component do not hide each other: each obeys its law, and what they do adds up.
#[test]
fn effects_of_one_component_act_together() {
    let valve = run(
        "Drive",
        "sh(redeclare Hyd.Effects.PistonFriction force(F_c = 60), redeclare Hyd.Effects.SeatCushion cushion(b_sq = 600), \
         redeclare Hyd.Effects.StopElasticity stop(c_2 = 2e-7), redeclare Hyd.Effects.OilTemperature damping(dT = 20))",
    );
    obeys(&valve, "sh.force.F", &["w"], 1e-12, |v| {
        -(60.0 + 24.0 * (-(v[0] / 0.05).powi(2)).exp()) * (v[0] / 5e-3).tanh()
    });
    obeys(&valve, "sh.cushion.F", &["y", "w"], 1e-12, |v| -600.0 * v[1] / (1.0 + v[0].max(0.0) / 5e-4).powi(3));
    obeys(&valve, "sh.damping.F", &["w"], 1e-12, |v| -60.0 * (-0.6_f64).exp() * v[0]);
    // Newton's law for the valve, with everything that acts on it.
    let area = std::f64::consts::PI * 64e-6;
    let acting = ["p_R", "y", "sh.damping.F", "sh.force.F", "sh.cushion.F", "sh.seat.F_n", "sh.stop.F_n"];
    obeys(&valve, "sh.mass.a", &acting, 1e-9, |v| {
        (area * (v[0] - 1e5) - 250.0 - 25e3 * v[1] + v[2] + v[3] + v[4] + v[5] - v[6]) / 0.35
    });
    let coil = run(
        "Drive",
        "ro(redeclare Hyd.Effects.EddyCurrents magnetics(g_e = 0.05), redeclare Hyd.Effects.MagneticSaturation iron(i_s = 0.6), \
         rlc(redeclare Hyd.Effects.CoilHeating coil(dT = 30)), su(redeclare Hyd.Effects.SpoolStiction force(F_c = 2.5)))",
    );
    // The current is the magnetising one, that of the iron and that of the eddies, whose voltage is that on the flux.
    obeys(&coil, "i", &["ro.lc.lambda", "ro.lc.L_e", "ro.magnetics.v"], 1e-9, |v| {
        v[0] / v[1] + 0.6 * v[0].signum() * (v[0].abs() / 0.05).powi(7) + 0.05 * v[2]
    });
    obeys(&coil, "ro.rlc.coil.v", &["i"], 1e-12, |v| 1.9 * 3.9e-3 * 30.0 * v[0]);
    obeys(&coil, "ro.su.force.F", &["v"], 1e-12, |v| {
        -(2.5 + 3.75 * (-(v[0] / 0.02).powi(2)).exp()) * (v[0] / 1e-3).tanh()
    });
    let oil = run(
        "Drive",
        "hy(redeclare Hyd.Effects.ChamberLeakage leakage(k_leak = 1e-11), \
         ra(redeclare Hyd.Effects.EntrainedAir contents(alpha = 0.02))), redeclare Hyd.Effects.SpoolFlowForce flow_force(k_ff = 0.5), \
         redeclare Hyd.Effects.SensorOffset sensor_p_R(b = 1e4)",
    );
    obeys(&oil, "hy.leakage.q", &["p_R"], 1e-9, |v| 1e-11 * (v[0] - 1e5));
    obeys(&oil, "hy.ra.contents.K_eff", &["p_R"], 1e-9, |v| {
        let p = (v[0] + (v[0] * v[0] + 4e8).sqrt()) / 2.0;
        let r = 0.02 * (1e5 / p).powf(1.0 / 1.2);
        (1.0 + r) / (1.0 / 1.4e9 + r / (1.2 * p))
    });
    obeys(&oil, "sensor_p_R.y", &["p_R"], 1e-12, |v| v[0] + 1e4);
    assert!(difference(&oil, &effect("chamber_leakage"), "p_R") > 1e5);
}

/// The ids of the catalogue, and which of them belong to the measurement.
#[test]
fn ids_and_kinds_are_those_of_the_catalogue() {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(root().join("stdlib/Hyd/Effects")).expect("the folder exists") {
        let path = entry.expect("listed").path();
        // The effects for any machine, in folders of their own, have `generic_effects`.
        if path.is_dir() {
            continue;
        }
        let text = std::fs::read_to_string(path).expect("readable");
        let field = |name: &str| {
            let after = text.split_once(&format!("{name} = \""))?.1;
            Some(after.split_once('"')?.0.to_string())
        };
        let Some((_, annotation)) = text.split_once("__hyd(effect(id") else { continue };
        for needed in ["adds =", "probe =", "prior =", "range =", "words =", "signature =", "rivals ="] {
            assert!(annotation.contains(needed), "{needed} is missing in {text}");
        }
        found.insert(field("effect(id").expect("an id"), field("kind").expect("a kind"));
    }
    for case in &CASES {
        let kind = found.get(case.id).unwrap_or_else(|| panic!("no effect `{}`", case.id));
        let measured = ["sensor_lag", "sensor_offset", "trigger_delay"].contains(&case.id);
        assert_eq!(kind == "sensor", measured, "{}", case.id);
    }
}
