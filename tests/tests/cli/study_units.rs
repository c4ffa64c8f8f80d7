//! `hyd discover` on a study whose model is a unit of another tool, of which nobody sees the equations.
//!
//! The bench is computed here, by Runge-Kutta steps so small that their errors are far below the noise: a mass on a spring that a valve
//! moves and a further force comes upon, once as the unit has it, once with a position sensor that lags, with a valve that does, with a
//! force that comes late.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::process::{Scratch, command, run};
use crate::view::{Viewer, data};

const MODEL: &str = "model M
  parameter Real m(unit = \"kg\", min = 0.1) = 1;
  parameter Real k(unit = \"N/m\", min = 1) = 400;
  parameter Real d(unit = \"N.s/m\", min = 0) = 12;
  input Real u(unit = \"V\", start = 0);
  parameter Real t_on(unit = \"s\") = 0.1;
  output Real x(unit = \"m\", start = 0, fixed = true, nominal = 0.1);
  Real v(unit = \"m/s\", start = 0, fixed = true);
protected
  parameter Real K(unit = \"N/V\") = 20;
equation
  der(x) = v;
  m*der(v) = K*u - k*x - d*v + (if time > t_on then 40 else 0);
end M;
";
/// What is left out costs runs, and tells nothing here that other tests do not.
const STUDY: &str = "without = [\"Hyd.Effects.Sensing.Clipping\", \"Hyd.Effects.Sensing.AbsoluteValue\", \"Hyd.Effects.Sensing.WrongSign\",\n\
    \"Hyd.Effects.Sensing.SensorDeadZone\", \"Hyd.Effects.Sensing.Offset\", \"Hyd.Effects.Actuation.ActuatorHysteresis\",\n\
    \"Hyd.Effects.Actuation.ActuatorDeadZone\", \"Hyd.Effects.Actuation.ActuatorLimit\"]\nfile = \"m.fmu\"\n[models]\ndefault = \"M\"\n[channels]\nx_mm = { variable = \"x\", scale = 1e3, unit = \"mm\" }\n\
    v = { variable = \"v\", unit = \"m/s\" }\n[inputs]\nu = { column = \"volt\", hold = \"smooth\" }\n[nuisances]\n\
    m = { parameter = \"m\", relative = 0.02 }\nk = { parameter = \"k\", relative = 0.02 }\n[conditions]\nt_on = \"on_s\"\n[shots]\ntime = \"t\"\n\
    trigger_moves = [\"t_on\"]\n";
const SET: &str = "{\"noise_std\": {\"x_mm\": 0.2, \"v\": 4e-3}, \"experiments\": [{\"file\": \"s1.csv\", \"a\": 1, \"on_s\": 0.1},\n\
    {\"file\": \"s2.csv\", \"a\": 2, \"on_s\": 0.1}, {\"file\": \"s3.csv\", \"a\": 3, \"on_s\": 0.1}, {\"file\": \"s4.csv\", \"a\": 4, \"on_s\": 0.1}]}";
/// What the bench has in truth.
const MASS: f64 = 1.02;
const STIFFNESS: f64 = 396.0;
/// When a further force is to come (s).
const ON: f64 = 0.1;
/// Samples of a shot, their distance (s), and the steps between two.
const SAMPLES: usize = 81;
const STEP: f64 = 0.01;
const WITHIN: usize = 50;

/// Numbers between -1 and 1 (Park, Miller 1988).
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 1_073_741_823.5 - 1.0
    }

    /// The sum of twelve uniform numbers is all but normal; standard deviation 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() / 2.0
    }
}

/// Time constants of the valve and of the position's sensor, and how late the further force comes (s); 0: there is none.
#[derive(Clone, Copy)]
struct Hidden {
    valve: f64,
    sensor: f64,
    late: f64,
}

/// The table of a shot.
fn table(shot: usize, hidden: Hidden) -> String {
    let mut draws = Draws(1_717 + 31 * shot as u64);
    let (height, speed) = (shot as f64, 5.0 + 4.0 * shot as f64);
    let input = |t: f64| height * (speed * t).sin();
    let rates = |t: f64, [valve, x, v, shown]: [f64; 4], further: f64| {
        let (u, valve_rate) =
            if hidden.valve > 0.0 { (valve, (input(t) - valve) / hidden.valve) } else { (input(t), 0.0) };
        let shown_rate = if hidden.sensor > 0.0 { (x - shown) / hidden.sensor } else { v };
        [valve_rate, v, (20.0 * u + further - STIFFNESS * x - 12.0 * v) / MASS, shown_rate]
    };
    let mut state = [0.0; 4];
    let mut text = String::from("t,volt,x_mm,v\n");
    for k in 0..SAMPLES {
        let t = STEP * k as f64;
        let (x, v) = (1e3 * state[3] + 0.2 * draws.normal(), state[2] + 4e-3 * draws.normal());
        writeln!(text, "{t:.3},{:.9},{x:.5},{v:.6}", input(t)).unwrap();
        let h = STEP / WITHIN as f64;
        for n in 0..WITHIN {
            let t = t + h * n as f64;
            let along = |state: [f64; 4], rate: [f64; 4], h: f64| std::array::from_fn(|i| state[i] + h * rate[i]);
            // A step ends where the force comes.
            let further = if t + h / 2.0 > ON + hidden.late { 40.0 } else { 0.0 };
            let a = rates(t, state, further);
            let b = rates(t + h / 2.0, along(state, a, h / 2.0), further);
            let c = rates(t + h / 2.0, along(state, b, h / 2.0), further);
            let d = rates(t + h, along(state, c, h), further);
            state = std::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
    }
    text
}

/// A folder with the unit, the study, and the shots.
fn lab(hidden: Hidden) -> Scratch {
    let folder = Scratch::new();
    folder.write("m.hyd", MODEL);
    let build = ["build", "m.hyd", "--fmu", "3.0", "-o", "m.fmu"];
    let made = command(folder.path(), &build).env("HYD_UNIT", crate::unit_client::library()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    // Nothing but the unit tells what the model is.
    std::fs::remove_file(folder.path().join("m.hyd")).unwrap();
    folder.write("st.toml", STUDY);
    folder.write("set.json", SET);
    (1..=4).for_each(|shot| folder.write(&format!("s{shot}.csv"), table(shot, hidden)));
    folder
}

/// The report of a search, in a folder that holds all of it.
fn searched(hidden: Hidden) -> (Scratch, Value, String) {
    let folder = lab(hidden);
    let outcome =
        run(folder.path(), &["discover", "st.toml", "--bench", "set.json", "--report", "r", "--threads", "1"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let json = serde_json::from_str(&folder.read("r/report.json")).unwrap();
    (folder, json, outcome.stdout)
}

/// The only effect of a report: what it is, where, and its size.
fn found(json: &Value) -> (String, f64) {
    let effects = json["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1, "{effects:?}");
    let parameters = effects[0]["parameters"].as_object().unwrap();
    assert_eq!(parameters.len(), 1, "{effects:?}");
    let size = parameters.values().next().and_then(|own| own["value"].as_f64()).unwrap();
    (effects[0]["effect"].as_str().unwrap().to_string(), size)
}

/// The unit beside its shots: nobody sees its inside, but its parameters move, and what it computes stands in diagram and curves.
#[test]
fn the_shots_of_a_unit_can_be_looked_at() {
    let folder = lab(Hidden { valve: 0.0, sensor: 0.0, late: 0.0 });
    let viewer = Viewer::start(folder.path(), &["st.toml", "--bench", "set.json"]);
    let page = data(&viewer.page_at("/"));
    let shots = page["shots"]["all"].as_array().unwrap();
    assert_eq!(shots.len(), 4);
    let value = |name: &str| {
        let own = page["variables"].as_array().unwrap().iter().find(|own| own["n"] == name).unwrap();
        page["model"]["parameters"][own["p"][0].as_u64().unwrap() as usize].as_f64().unwrap()
    };
    assert_eq!((value("m"), value("k"), &page["model"]["unit"]), (1.0, 400.0, &json!(true)));
    let apart = |deviations: &Value, shot: usize| deviations[shot][0].as_f64().unwrap();
    let first: Vec<f64> = shots.iter().map(|shot| shot["deviations"][0].as_f64().unwrap()).collect();
    // The shots were made with another mass and stiffness than the unit says; with these the model is off by the noise alone.
    let set = json!({"m": MASS.to_string(), "k": STIFFNESS.to_string()});
    let (header, _) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 3, "set": set}));
    assert_eq!(header["status"], "done", "{header}");
    for (k, before) in first.iter().enumerate() {
        let now = apart(&header["deviations"], k);
        assert!((0.7..1.3).contains(&now) && now < *before, "shot {k}: {now}, before {before}");
    }
    let names: Vec<&str> =
        page["shots"]["slack"].as_array().unwrap().iter().map(|own| own["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["k", "m"], "what may be off of a unit");
    let all = page["variables"].as_array().unwrap();
    let column = all.iter().find(|own| own["n"] == "x").unwrap()["o"][0].as_u64().unwrap();
    let (header, columns) = viewer.numbers("/run", &json!({"reading": 1, "shot": 3, "set": set, "columns": [column]}));
    assert_eq!(header["status"], "done", "{header}");
    let farthest = columns[0].iter().fold(0.0_f32, |most, value| most.max(value.abs()));
    assert!(farthest > 0.05, "the mass moves by centimetres: {farthest}");
    // As a file, too.
    let outcome = run(folder.path(), &["view", "st.toml", "--bench", "set.json", "--output", "page.html"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
}

#[test]
fn a_bench_that_is_as_the_unit_says_lacks_nothing() {
    let (_, json, said) = searched(Hidden { valve: 0.0, sensor: 0.0, late: 0.0 });
    assert_eq!(json["status"], "adequate", "{said}");
    // That nobody has looked inside is said in both, once.
    assert_eq!(said.matches("the insides of `m.fmu` cannot be looked at").count(), 1, "{said}");
    assert_eq!(json["units"][0]["file"], "m.fmu");
    // Terms at equations have no `id`.
    assert!(json["location"].as_array().unwrap().iter().all(|own| own["id"].is_string()), "{}", json["location"]);
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_sensor_that_lags_behind_a_unit_is_named() {
    let (folder, json, said) = searched(Hidden { valve: 0.0, sensor: 0.02, late: 0.0 });
    assert_eq!(json["status"], "sensor", "{said}");
    let (effect, size) = found(&json);
    assert_eq!(effect, "lag of x_mm", "{said}");
    assert!((size / 0.02 - 1.0).abs() < 0.03, "{size}");
    // The written model runs where it was written, with a copy of the unit.
    let files =
        ["simulate", "r/discovered.hyd", "--parameters", "r/shots/shot_1.toml", "--input", "r/shots/shot_1_inputs.csv"];
    let again = run(folder.path(), &[&files[..], &["--result", "again.csv"]].concat());
    assert_eq!(again.code, Some(0), "{}", again.stderr);
    // The next shot is one that tells the time constant better.
    let next = ["next", "st.toml", "--bench", "set.json", "--vary", "on_s=0.05:0.3", "--threads", "1"];
    let next = run(folder.path(), &next);
    assert_eq!(next.code, Some(0), "{}", next.stderr);
    assert!(next.stdout.contains("lag.tau") && next.stdout.contains("on_s = "), "{}", next.stdout);
}

/// A study names what is given and shown at a connector as the unit does, dots and all, and is told that it does.
#[test]
fn connectors_of_a_unit_are_named_as_the_unit_has_them() {
    let folder = Scratch::new();
    folder.write(
        "m.hyd",
        "connector Bus\n  input Real u(start = 0);\n  output Real y(start = 0, fixed = true);\nend Bus;\n\
         model M\n  Bus bus;\n  parameter Real T = 0.5;\nequation\n  T*der(bus.y) = bus.u - bus.y;\nend M;\n",
    );
    let build = ["build", "m.hyd", "--model", "M", "--fmu", "3.0", "-o", "m.fmu"];
    let made = command(folder.path(), &build).env("HYD_UNIT", crate::unit_client::library()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    folder.write(
        "st.toml",
        "file = \"m.fmu\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"bus.y\" }\n[inputs]\n\"bus.u\" = { column = \"u\" }\n\
         [nuisances]\nT = { parameter = \"T\", relative = 0.2 }\n[shots]\ntime = \"t\"\n",
    );
    folder.write("set.json", r#"{"noise_std": {"y": 1e-3}, "experiments": [{"file": "s.csv"}]}"#);
    // The answer to a step of 1 with a time constant of 0.4 s.
    let rows = (0..41).map(|k| 0.05 * f64::from(k)).map(|t| format!("{t},1,{}\n", 1.0 - (-t / 0.4).exp()));
    folder.write("s.csv", String::from("t,u,y\n") + &rows.collect::<String>());
    let fit = run(folder.path(), &["fit", "st.toml", "--bench", "set.json", "--json"]);
    assert_eq!(fit.code, Some(0), "{}", fit.stderr);
    let json: Value = serde_json::from_str(&fit.stdout).unwrap();
    // The parameter is 0.5 in the unit.
    let found = 0.5 * json["unknowns"][0]["value"].as_f64().unwrap();
    assert!((found - 0.4).abs() < 1e-3, "{}", fit.stdout);
    assert!(
        fit.stderr.contains("`bus`: what comes in as `bus.u` and `bus.y`, which channel y shows"),
        "{}",
        fit.stderr
    );
}

/// Shots of a time constant of 0.48 s, seen through a lag of 0.1 s.
fn seen_through_a_lag(folder: &Scratch) {
    let (slow, lag) = (0.48, 0.1);
    let mut draws = Draws(1_717);
    let mut experiments = Vec::new();
    for (shot, height) in [1.0, 2.0, 1.5].into_iter().enumerate() {
        let mut text = String::from("t,y,v\n");
        for k in 0..61 {
            let t = 0.05 * f64::from(k);
            let y = height * (1.0 - (slow * (-t / slow).exp() - lag * (-t / lag).exp()) / (slow - lag));
            let v = height / slow * (-t / slow).exp();
            writeln!(text, "{t:.2},{:.6},{:.6}", y + 0.01 * draws.normal(), v + 0.01 * draws.normal()).unwrap();
        }
        folder.write(&format!("s{shot}.csv"), text);
        experiments.push(format!("{{\"file\": \"s{shot}.csv\", \"u_0\": {height}}}"));
    }
    let experiments = experiments.join(", ");
    folder.write(
        "set.json",
        format!("{{\"noise_std\": {{\"y\": 0.01, \"v\": 0.01}}, \"experiments\": [{experiments}]}}"),
    );
}

/// What is recorded of a linear system grows with the height of its step and noise does not, so the highest step tells most of a lag.
#[test]
fn the_shot_to_make_next_is_proposed_for_a_unit() {
    let folder = Scratch::new();
    folder.write(
        "m.hyd",
        "model M\n  parameter Real T(unit = \"s\", min = 0.01) = 0.5;\n  parameter Real u_0 = 1;\n  output Real y(start = 0, fixed = true);\n\
         Real v = (u_0 - y)/T;\nequation\n  der(y) = v;\nend M;\n",
    );
    let build = ["build", "m.hyd", "--fmu", "3.0", "-o", "m.fmu"];
    let made = command(folder.path(), &build).env("HYD_UNIT", crate::unit_client::library()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    std::fs::remove_file(folder.path().join("m.hyd")).unwrap();
    folder.write(
        "st.toml",
        "without = [\"Hyd.Effects.Sensing.Clipping\", \"Hyd.Effects.Sensing.AbsoluteValue\", \"Hyd.Effects.Sensing.WrongSign\",\n\
         \"Hyd.Effects.Sensing.SensorDeadZone\", \"Hyd.Effects.Sensing.CrossTalk\"]\nfile = \"m.fmu\"\n[models]\ndefault = \"M\"\n[channels]\n\
         y = { variable = \"y\" }\nv = { variable = \"v\" }\n[nuisances]\nT = { parameter = \"T\", relative = 0.2 }\n[conditions]\n\
         u_0 = \"u_0\"\n[shots]\ntime = \"t\"\n",
    );
    seen_through_a_lag(&folder);
    let next = ["next", "st.toml", "--bench", "set.json", "--vary", "u_0=0.5:4", "--threads", "1"];
    let proposed = run(folder.path(), &[&next[..], &["--report", "r"]].concat());
    assert_eq!(proposed.code, Some(0), "{}", proposed.stderr);
    let json: Value = serde_json::from_str(&folder.read("r/next.json")).unwrap();
    assert_eq!(json["status"], "sensor", "{}", proposed.stdout);
    assert_eq!(json["shots"][0]["conditions"]["u_0"].as_f64(), Some(4.0), "{json:#}");
    assert!(proposed.stdout.contains("the interval of lag.tau becomes"), "{}", proposed.stdout);
    // What the unit does not have as a condition is told before the search.
    let wrong = run(folder.path(), &["next", "st.toml", "--bench", "set.json", "--vary", "T=0.5:4"]);
    assert_eq!(wrong.code, Some(1), "{}", wrong.stderr);
    assert!(wrong.stderr.contains("no condition `T`"), "{}", wrong.stderr);
}

/// A text holds the unit as a block of another folder; what is found is written, checked and runs in the folder of the report.
#[test]
fn a_unit_in_the_folder_of_a_library_goes_with_the_report() {
    let folder = Scratch::new();
    folder.write(
        "u.hyd",
        "model U\n  parameter Real T(unit = \"s\", min = 0.01) = 0.5;\n  parameter Real u_0 = 1;\n  output Real y(start = 0, fixed = true);\n\
         equation\n  T*der(y) = u_0 - y;\nend U;\n",
    );
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    let build = ["build", "u.hyd", "--fmu", "3.0", "-o", "parts/u.fmu"];
    let made = command(folder.path(), &build).env("HYD_UNIT", crate::unit_client::library()).output().unwrap();
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let block = run(folder.path(), &["unit", "parts/u.fmu", "-o", "parts/u.hyd"]);
    assert_eq!(block.code, Some(0), "{}", block.stderr);
    std::fs::remove_file(folder.path().join("u.hyd")).unwrap();
    // What has the same name elsewhere is another one.
    folder.write("u.fmu", "no unit");
    folder.write(
        "machine.hyd",
        "model Machine\n  parameter Real T(unit = \"s\") = 0.5;\n  parameter Real u_0 = 1;\n  U unit(T = T, u_0 = u_0);\n\
         Real y = unit.y;\n  Real v(unit = \"1/s\") = (u_0 - unit.y)/T;\nend Machine;\n",
    );
    folder.write(
        "st.toml",
        "without = [\"Hyd.Effects.Sensing.Clipping\", \"Hyd.Effects.Sensing.AbsoluteValue\", \"Hyd.Effects.Sensing.WrongSign\",\n\
         \"Hyd.Effects.Sensing.SensorDeadZone\", \"Hyd.Effects.Sensing.CrossTalk\"]\nfile = \"machine.hyd\"\n[models]\ndefault = \"Machine\"\n[channels]\n\
         y = { variable = \"y\" }\nv = { variable = \"v\", unit = \"1/s\" }\n[nuisances]\nT = { parameter = \"T\", relative = 0.2 }\n[conditions]\n\
         u_0 = \"u_0\"\n[shots]\ntime = \"t\"\n",
    );
    seen_through_a_lag(&folder);
    let search =
        ["discover", "st.toml", "--bench", "set.json", "--library", "parts", "--report", "r", "--threads", "1"];
    let outcome = run(folder.path(), &search);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let json: Value = serde_json::from_str(&folder.read("r/report.json")).unwrap();
    let (effect, size) = found(&json);
    assert_eq!((json["status"].as_str(), effect.as_str()), (Some("sensor"), "lag of y"), "{}", outcome.stdout);
    assert!((size / 0.1 - 1.0).abs() < 0.05, "{size}");
    // By itself: what the text names stands beside it.
    std::fs::remove_dir_all(folder.path().join("parts")).unwrap();
    let again = ["simulate", "r/discovered.hyd", "--parameters", "r/shots/shot_1.toml", "--result", "again.csv"];
    let again = run(folder.path(), &again);
    assert_eq!(again.code, Some(0), "{}", again.stderr);
}

#[test]
fn what_a_unit_is_given_lags_and_is_named() {
    let (_, json, said) = searched(Hidden { valve: 0.03, sensor: 0.0, late: 0.0 });
    assert_eq!(json["status"], "named", "{said}");
    let (effect, size) = found(&json);
    assert_eq!(effect, "actuator_lag of u_given", "{said}");
    assert!((size / 0.03 - 1.0).abs() < 0.03, "{size}");
}

#[test]
#[ignore = "takes minutes; tests/long_searches runs it"]
fn a_trigger_of_a_unit_that_comes_late_is_named() {
    let (_, json, said) = searched(Hidden { valve: 0.0, sensor: 0.0, late: 0.012 });
    assert_eq!(json["status"], "sensor", "{said}");
    let (effect, size) = found(&json);
    assert_eq!(effect, "late_trigger of trigger", "{said}");
    assert!((size / 0.012 - 1.0).abs() < 0.03, "{size}");
}
