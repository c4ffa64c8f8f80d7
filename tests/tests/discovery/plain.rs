//! Models of plain equations without a word about places: their balances and channels are found, and what is hidden there is named.
//!
//! The truth is integrated here by the classical method of Runge and Kutta with steps far below every time constant.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::{Draws, folder, hyd, json};

/// States, inputs of a shot, to rates.
pub(crate) type Rates = fn(&[f64], &[f64]) -> Vec<f64>;

/// A bench of one plain model.
pub(crate) struct Bench {
    pub(crate) name: &'static str,
    pub(crate) model: &'static str,
    /// Name of the class.
    pub(crate) class: &'static str,
    /// Column, variable, noise.
    pub(crate) channels: &'static [(&'static str, &'static str, f64)],
    /// Start values of the states come first.
    pub(crate) conditions: &'static [&'static str],
    pub(crate) nuisances: &'static [&'static str],
    pub(crate) shots: &'static [&'static [f64]],
    /// State that each channel shows, changed by the measuring chain.
    pub(crate) shown: fn(usize, f64) -> f64,
    /// What the recorder makes of a number with its noise.
    pub(crate) recorded: fn(usize, f64) -> f64,
    pub(crate) rates: Rates,
    /// Effects that are left out.
    pub(crate) without: &'static [&'static str],
    /// Length of a shot (s).
    pub(crate) stop: f64,
}

const SAMPLES: usize = 400;
const STEPS: usize = 100;

/// States at the samples.
fn integrate(bench: &Bench, shot: &[f64]) -> Vec<Vec<f64>> {
    let step = bench.stop / (SAMPLES * STEPS) as f64;
    let mut state: Vec<f64> = shot[..bench.channels.len()].to_vec();
    state.resize((bench.rates)(&[state.clone(), vec![0.0; 2]].concat(), shot).len(), 0.0);
    let mut rows = vec![state.clone()];
    for _ in 0..SAMPLES {
        for _ in 0..STEPS {
            let at = |rates: &[f64], h: f64| -> Vec<f64> { state.iter().zip(rates).map(|(x, r)| x + h * r).collect() };
            let a = (bench.rates)(&state, shot);
            let b = (bench.rates)(&at(&a, step / 2.0), shot);
            let c = (bench.rates)(&at(&b, step / 2.0), shot);
            let d = (bench.rates)(&at(&c, step), shot);
            let mean: Vec<f64> = (0..a.len()).map(|k| (a[k] + 2.0 * b[k] + 2.0 * c[k] + d[k]) / 6.0).collect();
            state = at(&mean, step);
        }
        rows.push(state.clone());
    }
    rows
}

pub(crate) fn write(folder: &Path, bench: &Bench) {
    let mut draws = Draws(23);
    fs::write(folder.join("plain.mo"), bench.model).expect("written");
    let mut study = format!("file = \"plain.mo\"\nwithout = {:?}\n", bench.without);
    let _ = write!(study, "[models]\ndefault = \"{}\"\n[channels]\n", bench.class);
    for (column, variable, noise) in bench.channels {
        let _ = writeln!(study, "{column} = {{ variable = \"{variable}\", noise = {noise} }}");
    }
    let same = |names: &[&str]| names.iter().map(|name| format!("{name} = \"{name}\"\n")).collect::<String>();
    let _ = write!(study, "[conditions]\n{}[nuisances]\n{}", same(bench.conditions), same(bench.nuisances));
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut experiments = Vec::new();
    for (k, shot) in bench.shots.iter().enumerate() {
        let columns: Vec<&str> = bench.channels.iter().map(|channel| channel.0).collect();
        let mut text = format!("time_s,{}\n", columns.join(","));
        for (row, state) in integrate(bench, shot).iter().enumerate() {
            let _ = write!(text, "{:.7}", bench.stop * row as f64 / SAMPLES as f64);
            for (channel, (value, (_, _, noise))) in state.iter().zip(bench.channels).enumerate() {
                let _ = write!(
                    text,
                    ",{:.9e}",
                    (bench.recorded)(channel, (bench.shown)(channel, *value) + noise * draws.normal())
                );
            }
            text.push('\n');
        }
        fs::write(folder.join(format!("s{k}.csv")), text).expect("written");
        let own = bench.conditions.iter().zip(*shot).map(|(name, value)| format!(", \"{name}\": {value:e}"));
        experiments.push(format!("{{\"file\": \"s{k}.csv\"{}}}", own.collect::<String>()));
    }
    let tolerances: Vec<String> = bench.nuisances.iter().map(|name| format!("\"{name}\": 0.02")).collect();
    let set = format!(
        "{{\"parameter_tolerance_1sigma\": {{{}}}, \"experiments\": [{}]}}",
        tolerances.join(", "),
        experiments.join(", ")
    );
    fs::write(folder.join("set.json"), set).expect("written");
}

/// What is found; the written model is checked.
pub(crate) fn answer(bench: &Bench) -> Value {
    let (report, folder) = answer_in(bench);
    let _ = fs::remove_dir_all(&folder);
    report
}

/// The same, and the folder with study, set and report.
pub(crate) fn answer_in(bench: &Bench) -> (Value, PathBuf) {
    let folder = folder(&format!("plain-{}", bench.name));
    write(&folder, bench);
    (found_in(&folder, &[]), folder)
}

/// What is found in a folder with study and set; the written model is checked.
pub(crate) fn found_in(folder: &Path, further: &[&str]) -> Value {
    let arguments = [&["discover", "study.toml", "--bench", "set.json", "--report", "report"], further].concat();
    let found = hyd(folder, &arguments);
    assert_eq!(found.code, Some(0), "{}{}", found.stdout, found.stderr);
    let report = json(&fs::read_to_string(folder.join("report/report.json")).expect("written"));
    if report["effects"].as_array().is_some_and(|effects| !effects.is_empty()) {
        let checked = hyd(&folder.join("report"), &["simulate", "discovered.hyd", "--result", "run.csv"]);
        assert_eq!(checked.code, Some(0), "{}", checked.stderr);
    }
    report
}

/// The one effect named, with sizes within four standard errors of the truth.
pub(crate) fn names(bench: &Bench, status: &str, id: &str, place: &str, sizes: &[(&str, f64)]) {
    check_names(&answer(bench), (bench.name, status, id, place), sizes);
}

/// The same of a report.
pub(crate) fn check_names(report: &Value, (name, status, id, place): (&str, &str, &str, &str), sizes: &[(&str, f64)]) {
    let effects = report["effects"].as_array().expect("a list");
    assert_eq!(report["status"], status, "{name}: {report:#}");
    assert!(effects.len() == 1 && effects[0]["id"] == id && effects[0]["component"] == place, "{effects:#?}");
    for (name, truth) in sizes {
        let number = |key: &str| effects[0]["parameters"][name][key].as_f64().expect("a number");
        let (value, error) = (number("value"), number("stderr"));
        assert!((value - truth).abs() < 4.0 * error && error < 0.1 * truth.abs(), "{name}: {value} +- {error}");
    }
}

pub(crate) const SWING: Bench = Bench {
    name: "swing",
    model: "model Swing \"mass, spring and damper\"
  parameter Real m = 2;
  parameter Real k = 80;
  parameter Real d = 0.6;
  parameter Real x0 = 0.5;
  Real x(start = x0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  m*der(v) = -k*x - d*v;
end Swing;
",
    class: "Swing",
    channels: &[("x_m", "x", 1e-3), ("v_ms", "v", 5e-3)],
    conditions: &["x0"],
    nuisances: &["m", "k", "d"],
    shots: &[&[0.3, 0.0], &[0.6, 0.0], &[0.9, 0.0], &[0.45, 0.0], &[0.75, 0.0]],
    shown: |_, value| value,
    rates: |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1]) / 2.0],
    recorded: |_, value| value,
    without: &[],
    stop: 4.0,
};

#[test]
fn a_plain_mass_that_rubs() {
    let friction: Rates = |x, _| vec![x[1], (-80.0 * x[0] - 0.6 * x[1] - 1.5 * (x[1] / 1e-3).tanh()) / 2.0];
    let bench = Bench { name: "rubs", rates: friction, ..SWING };
    names(&bench, "named", "coulomb_friction", "v", &[("F_c", 1.5)]);
}

#[test]
fn a_plain_mass_that_lacks_nothing() {
    let report = answer(&SWING);
    assert_eq!(report["status"], "adequate", "{report:#}");
    let tried: Vec<&str> =
        report["candidates"].as_array().expect("a list").iter().filter_map(|own| own["effect"].as_str()).collect();
    // One balance and two channels.
    for wanted in ["coulomb_friction of v", "upper_stop of v", "lag of x_m", "clipping of v_ms"] {
        assert!(tried.contains(&wanted), "{tried:?}");
    }
    // The speed is the rate of the position, so that neither could be told to hear the other.
    assert!(tried.iter().all(|own| own.ends_with(" of v") || own.ends_with(" of x_m") || own.ends_with(" of v_ms")));
}

/// At the usual size of a drag this swing would be out of step after a few turns: only far smaller sizes show what it does.
#[test]
fn a_drag_far_smaller_than_usual() {
    let bench = Bench {
        name: "small-drag",
        model: "model Swing
  parameter Real m = 2;
  parameter Real k = 80;
  parameter Real d = 0.04;
  parameter Real x0 = 0.5;
  Real x(start = x0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  m*der(v) = -k*x - d*v;
end Swing;
",
        rates: |x, _| vec![x[1], (-80.0 * x[0] - 0.04 * x[1] - 0.01 * x[1] * x[1].abs()) / 2.0],
        stop: 40.0,
        ..SWING
    };
    names(&bench, "named", "quadratic_drag", "v", &[("c", 0.01)]);
}

/// Both effects are named, in any order.
fn names_both(bench: &Bench) {
    let report = answer(bench);
    assert_eq!(report["status"], "named", "{report:#}");
    let effects = report["effects"].as_array().expect("a list").iter();
    let mut ids: Vec<&str> = effects.filter_map(|own| own["id"].as_str()).collect();
    ids.sort_unstable();
    assert_eq!(ids, ["coulomb_friction", "cubic_stiffness"], "{report:#}");
}

const BOTH: Rates = |x, _| {
    let further = -1.5 * (x[1] / 1e-3).tanh() - 8.0 * x[0].powi(3);
    vec![x[1], (-80.0 * x[0] - 0.6 * x[1] + further) / 2.0]
};

#[test]
fn two_effects_at_one_balance() {
    names_both(&Bench { name: "both", rates: BOTH, ..SWING });
}

#[test]
fn two_effects_at_one_declared_place() {
    let model = "model Swing
  parameter Hyd.Units.Mass m = 2;
  parameter Hyd.Units.SpringConstant k = 80;
  parameter Hyd.Units.DampingConstant d = 0.6;
  parameter Hyd.Units.Position x0 = 0.5;
  Hyd.Translational.Components.Mass mass(m = m, s(start = x0, fixed = true), v(start = 0, fixed = true));
  Hyd.Translational.Components.HousingSpring spring(k = k);
  Hyd.Translational.Components.HousingDamper damper(d = d);
  replaceable Hyd.Places.NoForce further constrainedby Hyd.Places.PartialForce
    annotation(__hyd(place(id = \"force\", scale = \"mass.m*mass.a\")));
equation
  connect(spring.flange, mass.flange);
  connect(damper.flange, mass.flange);
  connect(further.flange, mass.flange);
end Swing;
";
    let channels = &[("x_m", "mass.s", 1e-3), ("v_ms", "mass.v", 5e-3)];
    names_both(&Bench { name: "declared", model, channels, rates: BOTH, ..SWING });
}

#[test]
fn a_valve_with_a_dead_zone() {
    let bench = Bench {
        name: "valve",
        model: "model Tank
  parameter Real A(unit = \"m2\") = 0.5;
  parameter Real c(unit = \"m2/s\") = 0.004;
  parameter Real q(unit = \"m3/s\") = 0.02;
  parameter Real h0(unit = \"m\") = 0.2;
  parameter Real U(unit = \"1\") = 0.5;
  parameter Real P(unit = \"s\") = 200;
  Real u(unit = \"1\") \"opening of the valve\";
  Real h(unit = \"m\", start = h0, fixed = true);
equation
  u = U*(1 + sin(6.283185307179586*time/P));
  A*der(h) = q*u - c*h;
end Tank;
",
        class: "Tank",
        channels: &[("h_m", "h", 2e-3)],
        conditions: &["h0", "U"],
        nuisances: &["A", "c"],
        shots: &[&[0.2, 0.5], &[1.5, 0.2], &[0.8, 0.6], &[0.5, 0.4], &[1.2, 0.3]],
        shown: |_, value| value,
        // The clock is a state that no channel shows.
        rates: |x, shot| {
            let opening = shot[1] * (1.0 + (std::f64::consts::TAU * x[1] / 200.0).sin());
            vec![(0.02 * (opening - 0.15).max(0.0) - 0.004 * x[0]) / 0.5, 1.0]
        },
        recorded: |_, value| value,
        without: &[],
        stop: 600.0,
    };
    names(&bench, "named", "actuator_dead_zone", "u", &[("g", 0.15)]);
}

#[test]
fn a_channel_that_is_clipped() {
    let clipped = |channel: usize, value: f64| if channel == 0 { value.clamp(-0.35, 0.35) } else { value };
    let bench = Bench { name: "clipped", shown: clipped, ..SWING };
    let report = answer(&bench);
    assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"sensor".into(), &"clipping".into()), "{report:#}");
    assert_eq!(report["effects"][0]["component"], "x_m");
}

/// A thermocouple that hears the voltage of the heater.
#[test]
fn a_channel_that_hears_another_one() {
    let bench = Bench {
        name: "cross-talk",
        model: "model Heater
  parameter Real R = 1000 \"of the supply\";
  parameter Real C = 1e-4 \"across the heater\";
  parameter Real U = 10;
  parameter Real W = 0.2 \"heat capacity\";
  parameter Real G = 1e-3 \"of the heater\";
  parameter Real h = 0.02 \"heat transfer\";
  parameter Real u0 = 0;
  parameter Real T0 = 20;
  Real u(start = u0, fixed = true);
  Real T(start = T0, fixed = true);
equation
  C*der(u) = (U - u)/R;
  W*der(T) = G*u*u - h*(T - 20);
end Heater;
",
        class: "Heater",
        channels: &[("u_V", "u", 5e-3), ("T_C", "T", 0.02)],
        conditions: &["u0", "T0", "U"],
        nuisances: &["R", "C", "W", "G", "h"],
        shots: &[&[0.0, 20.0, 10.0], &[0.0, 20.0, -8.0], &[0.0, 24.0, 4.0], &[0.0, 22.0, -12.0], &[0.0, 20.0, 6.0]],
        shown: |_, value| value,
        // The second state is what is shown of the temperature, which is the same without voltage.
        rates: |x, shot| {
            let (u, shown) = (x[0], x[1]);
            let rate = (shot[2] - u) / 0.1;
            vec![rate, (1e-3 * u * u - 0.02 * (shown - 0.05 * u - 20.0)) / 0.2 + 0.05 * rate]
        },
        recorded: |_, value| value,
        without: &[],
        stop: 5.0,
    };
    names(&bench, "sensor", "cross_talk", "T_C from u_V", &[("k", 0.05)]);
}

/// What is said of a bench on which nothing of the machine is missing.
pub(crate) fn said_of_adequate(bench: &Bench) -> (Value, String) {
    let report = answer(bench);
    assert_eq!(report["status"], "adequate", "{report:#}");
    let sentences = report["disturbed"]["sentences"].as_array().expect("a list").iter();
    let sentences: Vec<&str> = sentences.filter_map(Value::as_str).collect();
    (report["disturbed"].clone(), sentences.join("\n"))
}

const PUMPED: Bench = Bench {
    name: "pumped",
    model: "model Tank
  parameter Real A(unit = \"m2\") = 0.5;
  parameter Real c(unit = \"m2/s\") = 0.004;
  parameter Real q(unit = \"m3/s\") = 0.02;
  parameter Real h0(unit = \"m\") = 0.2;
  parameter Real U(unit = \"1\") = 0.5;
  Real u(unit = \"1\") \"pump\";
  Real h(unit = \"m\", start = h0, fixed = true);
equation
  u = U*(1 + sin(0.0628318530717958647*time));
  A*der(h) = q*u - c*h;
end Tank;
",
    class: "Tank",
    channels: &[("h_m", "h", 2e-3)],
    conditions: &["h0", "U"],
    nuisances: &["A", "c"],
    shots: &[&[0.2, 0.5], &[1.5, 0.2], &[0.8, 0.6], &[0.5, 0.4], &[1.2, 0.3]],
    shown: |_, value| value,
    rates: |x, shot| {
        let opening = shot[1] * (1.0 + (std::f64::consts::TAU * x[1] / 100.0).sin());
        vec![(0.02 * opening - 0.004 * x[0]) / 0.5, 1.0]
    },
    recorded: |_, value| value,
    without: &[],
    stop: 600.0,
};

/// A recorder whose clock is slow by 1 %: its second is 1.01 s.
#[test]
fn a_clock_that_is_slow() {
    let rates: Rates = |x, shot| (PUMPED.rates)(x, shot).into_iter().map(|rate| 1.01 * rate).collect();
    let (disturbed, said) = said_of_adequate(&Bench { name: "slow-clock", rates, ..PUMPED });
    let clock = disturbed["timing"][0]["clock"].as_f64().expect("a number");
    assert!((clock + 0.01).abs() < 5e-4, "{clock}: {said}");
    assert!(said.contains("the clock of the records runs slow by 1.0"), "{said}");
}

#[test]
fn a_channel_that_lags_although_no_effect_does() {
    // To first order in 5 ms, the exact lag of a swing whose speed is known.
    let late: Rates = |x, _| {
        let (x, v) = (x[0] + 0.005 * x[1], x[1]);
        let rate = (-80.0 * x - 0.6 * v) / 2.0;
        vec![v - 0.005 * rate, rate]
    };
    let (disturbed, said) = said_of_adequate(&Bench {
        name: "lag",
        rates: late,
        without: &["Hyd.Effects.Sensing.Lag", "Hyd.Effects.Sensing.DeadTime"],
        ..SWING
    });
    let seconds = disturbed["timing"][0]["seconds"].as_f64().expect("a number");
    assert!((seconds - 0.005).abs() < 3e-4 && said.contains("s late beside the other channels"), "{seconds}: {said}");
}

#[test]
fn the_range_of_a_sensor_that_ends() {
    let (disturbed, said) = said_of_adequate(&Bench { name: "range", recorded: |_, value| value.min(2.5), ..PUMPED });
    assert!(disturbed["clipped"][0]["value"] == 2.5 && said.contains("h_m shows nothing beyond 2.5"), "{said}");
}

#[test]
fn a_plain_tank_that_spills() {
    let bench = Bench {
        name: "tank",
        model: "model Tank
  parameter Real A(unit = \"m2\") = 0.5;
  parameter Real c(unit = \"m2/s\") = 0.004;
  parameter Real q0(unit = \"m3/s\") = 0.01;
  parameter Real h0(unit = \"m\") = 0.2;
  Real h(unit = \"m\", start = h0, fixed = true);
equation
  A*der(h) = q0 - c*h;
end Tank;
",
        class: "Tank",
        channels: &[("h_m", "h", 2e-3)],
        conditions: &["h0", "q0"],
        nuisances: &["A", "c"],
        shots: &[&[0.2, 0.01], &[1.5, 0.004], &[0.8, 0.012], &[0.5, 0.008], &[1.2, 0.006]],
        shown: |_, value| value,
        rates: |x, shot| vec![(shot[1] - 0.004 * x[0] - 0.2 * (x[0] - 1.1).max(0.0)) / 0.5],
        recorded: |_, value| value,
        without: &[],
        stop: 300.0,
    };
    names(&bench, "named", "overflow", "h", &[("k", 0.2), ("h_e", 1.1)]);
}

#[test]
fn a_plain_circuit_that_leaks() {
    let bench = Bench {
        name: "circuit",
        model: "model RC
  parameter Real R = 1000;
  parameter Real C = 1e-4;
  parameter Real U = 10;
  parameter Real u0 = 0;
  Real u(start = u0, fixed = true);
  Real i;
equation
  i = (U - u)/R;
  0 = i - C*der(u);
end RC;
",
        class: "RC",
        channels: &[("u_V", "u", 5e-3)],
        conditions: &["u0", "U"],
        nuisances: &["R", "C"],
        shots: &[&[0.0, 10.0], &[5.0, 0.0], &[2.0, 12.0], &[8.0, 3.0], &[0.0, 5.0]],
        shown: |_, value| value,
        rates: |x, shot| vec![((shot[1] - x[0]) / 1000.0 - 2e-4 * x[0]) / 1e-4],
        recorded: |_, value| value,
        without: &[],
        stop: 0.5,
    };
    names(&bench, "named", "shunt_resistance", "u", &[("G", 2e-4)]);
}

#[test]
fn a_heated_block_that_radiates() {
    let bench = Bench {
        name: "block",
        model: "model Block
  Hyd.Thermal.Components.HeatCapacitor body(C = C, T_start = T0);
  Hyd.Thermal.Sources.FixedHeatFlow heater(Q_flow = P);
  parameter Hyd.Units.HeatCapacity C = 200;
  parameter Hyd.Units.HeatFlowRate P = 50;
  parameter Hyd.Units.Temperature T0 = 295;
equation
  connect(heater.port, body.port);
end Block;
",
        class: "Block",
        channels: &[("T_K", "body.T", 0.2)],
        conditions: &["T0", "P"],
        nuisances: &["C"],
        shots: &[&[295.0, 50.0], &[295.0, 150.0], &[295.0, 100.0], &[295.0, 200.0], &[295.0, 80.0]],
        shown: |_, value| value,
        rates: |x, shot| vec![(shot[1] - 2e-9 * (x[0].powi(4) - shot[0].powi(4))) / 200.0],
        recorded: |_, value| value,
        without: &[],
        stop: 1500.0,
    };
    names(&bench, "named", "radiation", "body.T", &[("k", 2e-9)]);
}
