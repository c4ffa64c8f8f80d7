//! The model that a search writes is the fitted one: alone in another folder its runs are the curves of the report.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::process::{Scratch, run};
use crate::view::{Viewer, data};

/// A vessel that is fed by a recorded flow, with a second flow from a table of its own and a condition of the shot.
const RIG: &str = "partial block PartialWall
  parameter Real s(min = 0) = 1 \"share of the wall that is wet\";
  input Real h;
  output Real q;
end PartialWall;
block Tight
  extends PartialWall;
equation
  q = 0;
end Tight;
model Rig
  parameter Real k(min = 0) = 0.8 \"outlet\";
  parameter Real h0 = 1 \"level at the begin\";
  parameter Real f = 0 \"steady flow\";
  parameter Integer n = 1;
  input Real u;
  Real h(start = h0, fixed = true);
  replaceable Tight wall constrainedby PartialWall(h = h) annotation(__hyd(place(id = \"wall\")));
  Hyd.Signals.Sources.CsvSignal wind(file = \"data/wind.csv\", column = \"w\", t_column = \"t\");
equation
  der(h) = n*(f + u + wind.y) - k*h - wall.q;
end Rig;
";
const EFFECTS: &str = "within;
package Extras
  block Seep \"seeps through the wall\"
    extends PartialWall;
    parameter Real c = 0.1;
  equation
    q = s*c*h*h*h;
    annotation(__hyd(effect(id = \"seeping\", kind = \"physics\", at = {\"wall\"}, adds = c, zero = 0, probe = 0.05,
      prior = \"lognormal(0.05, 1)\", rivals = {})));
  end Seep;
  block Pour \"rain over the wall\"
    extends PartialWall;
    parameter Real c = 0.1;
  equation
    q = -c*h*h;
    annotation(__hyd(effect(id = \"pouring\", kind = \"physics\", at = {\"wall\"}, adds = c, zero = 0, probe = 0.05,
      prior = \"lognormal(0.05, 1)\")));
  end Pour;
end Extras;
";
const STUDY: &str = "without = [\"Hyd.Effects\"]\nfile = \"rig.hyd\"\n[models]\ndefault = \"Rig\"\n[channels]\n\
    h_mm = { variable = \"h\", scale = 1e3, unit = \"mm\" }\n[inputs]\nu = { column = \"u_l\", scale = 1e3, lag = 0.01 }\n\
    [conditions]\nf = \"feed\"\nh0 = \"level\"\nn = \"pumps\"\n[nuisances]\nk = { parameter = \"k\", relative = 0.1 }\n\
    h0 = { parameter = \"h0\", absolute = 0.05, per_shot = true }\ns = { parameter = \"wall.s\", relative = 0.05 }\n[shots]\ntime = \"t\"\n";
const SET: &str = "{\"noise_std\": {\"h_mm\": 1}, \"sensor_offset_1sigma\": {\"h_mm\": 3}, \"sensor_gain_1sigma\": 0.002,\n\"experiments\": [";
/// Conditions of the shots, by how much the level differs from what was noted, and their first and last samples.
const SHOTS: [(f64, f64, f64, i32, i32); 4] =
    [(0.5, 1.0, 0.03, 0, 200), (1.0, 1.5, -0.04, 0, 200), (1.5, 0.5, 0.05, -20, 200), (2.0, 2.0, -0.02, 0, 160)];
const STEP: f64 = 0.02;

/// Numbers between -1 and 1 (Park, Miller 1988), summed to what is all but normal.
struct Draws(u64);

impl Draws {
    fn normal(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0 * 48_271 % 2_147_483_647;
            sum += self.0 as f64 / 2_147_483_647.0;
        }
        sum - 6.0
    }
}

fn wind(t: f64) -> f64 {
    0.3 * (1.0 + (1.7 * t).sin())
}

fn input(shot: usize, t: f64) -> f64 {
    0.4 * ((2.0 + shot as f64) * t).cos()
}

/// The level by the equation with the true numbers.
fn level(shot: usize, k: i32) -> f64 {
    level_of(shot, k, (0.85, 0.06, SHOTS[shot].2))
}

/// The same with an outlet, what seeps, and how far the level is from what was noted, integrated here (Runge and Kutta's classical method).
fn level_of(shot: usize, k: i32, (outlet, seeps, off): (f64, f64, f64)) -> f64 {
    let (feed, noted, _, first, _) = SHOTS[shot];
    let begin = STEP * f64::from(first);
    // The record of the input begins with the first sample and acts later; its table is read as a polygon of this step.
    let polygon = |f: &dyn Fn(f64) -> f64, t: f64| {
        let cell = (t / STEP).floor() * STEP;
        f(cell) + (f(cell + STEP) - f(cell)) * (t - cell) / STEP
    };
    let acting = |t: f64| polygon(&|t| input(shot, t), (t - 0.01).max(begin));
    let rate = |t: f64, h: f64| feed + acting(t) + polygon(&wind, t.max(0.0)) - outlet * h - seeps * h * h * h;
    let (mut t, mut h, dt) = (begin, noted + off, STEP / 10.0);
    while t < STEP * f64::from(k) - 0.5 * dt {
        let a = rate(t, h);
        let b = rate(t + dt / 2.0, h + dt / 2.0 * a);
        let c = rate(t + dt / 2.0, h + dt / 2.0 * b);
        let d = rate(t + dt, h + dt * c);
        h += dt / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        t += dt;
    }
    h
}

fn rig() -> Scratch {
    let folder = Scratch::new();
    for name in ["lab/Extras", "lab/data"] {
        std::fs::create_dir_all(folder.path().join(name)).unwrap();
    }
    folder.write("lab/rig.hyd", RIG);
    folder.write("lab/Extras/package.hyd", EFFECTS);
    let rows: String = (0..=250).map(|k| format!("{},{}\n", STEP * f64::from(k), wind(STEP * f64::from(k)))).collect();
    folder.write("lab/data/wind.csv", format!("t,w\n{rows}"));
    folder.write("lab/study.toml", STUDY);
    let mut draws = Draws(5);
    let mut experiments = Vec::new();
    for (shot, &(feed, noted, _, first, last)) in SHOTS.iter().enumerate() {
        let mut table = String::from("t,h_mm,u_l\n");
        for k in first..=last {
            let t = STEP * f64::from(k);
            let shown = 1e3 * 1.001 * level(shot, k) + 2.0 + draws.normal();
            writeln!(table, "{t},{shown},{}", 1e3 * input(shot, t)).unwrap();
        }
        folder.write(&format!("s{shot}.csv"), table);
        experiments.push(format!("{{\"file\": \"s{shot}.csv\", \"feed\": {feed}, \"level\": {noted}, \"pumps\": 1}}"));
    }
    folder.write("set.json", format!("{SET}{}]}}", experiments.join(", ")));
    folder
}

fn discover(folder: &Scratch) -> (Value, String) {
    let arguments = ["discover", "lab/study.toml", "--bench", "set.json", "--library", "lab", "--report", "my report"];
    let found = run(folder.path(), &arguments);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    (serde_json::from_str(&folder.read("my report/report.json")).unwrap(), found.stdout)
}

/// Copies a folder with what is in it.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// The columns time and `h` of a result.
fn curve(text: &str) -> Vec<(f64, f64)> {
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let place = header.iter().position(|name| *name == "h").unwrap();
    let row = |line: &str| {
        let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
        (fields[0], fields[place])
    };
    text.lines().skip(1).map(row).collect()
}

fn at(curve: &[(f64, f64)], t: f64) -> f64 {
    let next = curve.iter().position(|(time, _)| *time >= t - 1e-12).unwrap().max(1);
    let ((a, x), (b, y)) = (curve[next - 1], curve[next]);
    if b > a { x + (y - x) * (t - a) / (b - a) } else { y }
}

#[test]
fn runs_of_the_written_model_are_the_curves_of_the_report() {
    let folder = rig();
    let (report, stdout) = discover(&folder);
    assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"named".into(), &"seeping".into()), "{stdout}");
    let text = folder.read("my report/discovered.hyd");
    let own = &text[text.find("\nmodel Discovered").unwrap()..];
    let stated = |name: &str| {
        let place = [' ', '('].into_iter().find_map(|before| own.find(&format!("{before}{name} = ")));
        let rest = &own[place? + name.len() + 4..];
        rest[..rest.find([',', ')'])?].parse::<f64>().ok()
    };
    // The share of the wall is a number of the component that the effect has replaced; what the two make together is known.
    let [Some(k), Some(c), Some(s), None, None] = ["k", "c", "s", "h0", "f"].map(stated) else { panic!("{own}") };
    assert!((k / 0.85 - 1.0).abs() < 0.03 && (s * c / 0.06 - 1.0).abs() < 0.2, "{own}");
    // Entries of all lists have both the id and the name with its place.
    for list in ["effects", "candidates", "power", "location"] {
        let entries = report[list].as_array().unwrap().iter().filter(|own| own["effect"].is_string());
        let entries: Vec<&Value> = entries.filter(|own| !own["effect"].as_str().unwrap().contains(" in `")).collect();
        assert!(list == "power" || !entries.is_empty(), "{list}");
        assert!(entries.iter().all(|own| own["id"] == own["effect"]), "{list}: {entries:#?}");
    }
    let pouring = report["candidates"].as_array().unwrap().iter().find(|own| own["id"] == "pouring").unwrap();
    let wanted = "the residuals are the opposite of what it does: its size would have to be negative";
    assert_eq!((&pouring["pass"], &pouring["verdict"]), (&1.into(), &wanted.into()));
    // Nothing but the report is there.
    let alone = Scratch::new();
    copy(&folder.path().join("my report"), &alone.path().join("alone"));
    let place = alone.path().join("alone");
    let gain = |name: &str| {
        report["parameters"].as_array().unwrap().iter().find(|own| own["name"] == name).unwrap()["after"]["value"]
            .as_f64()
            .unwrap()
    };
    let (gain, offset) = (gain("gain of h_mm"), gain("offset of h_mm"));
    let mut curves: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
    for line in folder.read("my report/trajectories.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |k: usize| fields[k].parse::<f64>().unwrap();
        curves.entry(fields[0].parse().unwrap()).or_default().push((number(2), number(5)));
    }
    let shots = report["run"]["shots"].as_array().unwrap();
    assert_eq!((shots.len(), curves.len()), (4, 4));
    for (shot, (number, wanted)) in shots.iter().zip(&curves) {
        assert_eq!(shot["shot"].as_u64(), Some(*number));
        let text = |key: &str| shot[key].as_str().unwrap();
        let mut arguments =
            vec!["simulate", "discovered.hyd", "--parameters", text("parameters"), "--input", text("inputs")];
        arguments.extend(text("options").split_whitespace());
        arguments.extend(["--result", "run.csv", "--variables", "^h$", "--intervals", "4000", "--tolerance", "1e-9"]);
        let simulated = run(&place, &arguments);
        assert_eq!((simulated.code, simulated.stderr.as_str()), (Some(0), ""), "{arguments:?}");
        let found = curve(&std::fs::read_to_string(place.join("run.csv")).unwrap());
        for &(time, wanted) in wanted {
            // Between output points the report follows a cubic, also across the corners of the input: a tenth of the noise.
            let shown = 1e3 * (gain * at(&found, time) + offset);
            assert!((shown - wanted).abs() < 0.1, "shot {number} at {time} s: {shown} instead of {wanted}");
        }
        // The file says the same of the measuring chain.
        let file = std::fs::read_to_string(place.join(text("parameters"))).unwrap();
        assert!(
            file.contains("\"h0\" = ")
                && file.contains("\"f\" = ")
                && file.contains("\"n\" = 1\n")
                && !file.contains("\"k\" ="),
            "{file}"
        );
        let factor = file.split_once("h_mm = 1000.0*(").and_then(|(_, rest)| rest.split_once("*(h) ")).unwrap().0;
        // Reading JSON may round the last digit.
        assert!((factor.parse::<f64>().unwrap() / gain - 1.0).abs() < 1e-15, "{gain:?}: {file}");
    }
    // The last line is a command that works where it was said.
    let command = stdout.lines().last().unwrap();
    let begin = "to run it: hyd simulate 'my report/discovered.hyd' --parameters 'my report/shots/shot_";
    assert!(command.starts_with(begin) && command.contains(" --input 'my report/shots/shot_"), "{command}");
    shots_stand_beside_the_written_model(&place, &report, &curves);
    // With the folder alone comes the report, with a link to the model.
    std::fs::write(place.join("next.html"), "<!DOCTYPE html><html><body><h1>The next shot</h1></body></html>").unwrap();
    let viewer = Viewer::start(&place, &["."]);
    assert!(viewer.page_at("/").contains("<a href=\"/model?token="), "a link to the model");
    assert!(viewer.page_at("/").contains("<a href=\"/next?token="), "a link to the map of the next shot");
    assert!(viewer.page_at("/next").contains("<a href=\"/report?token="), "and back");
    assert!(viewer.page_at("/model").contains("<a href=\"/report?token="), "a link to the report");
    // Options that say nothing of a report are refused, and files outside of its folder.
    let refused = run(&place, &["view", ".", "--bench", "set.json"]);
    assert!(
        refused.code == Some(2) && refused.stderr.contains("--bench says nothing of a report"),
        "{}",
        refused.stderr
    );
    let refused = run(&place, &["view", "discovered.hyd", ".", "--model", "Rig", "--output", "page.html"]);
    let said = "note: the shots of this report stand beside `Discovered`, the model that its search has written\n";
    assert_eq!((refused.code, refused.stderr.as_str()), (Some(0), said));
    assert_eq!(data(&std::fs::read_to_string(place.join("page.html")).unwrap())["shots"], Value::Null);
    let json = std::fs::read_to_string(place.join("report.json")).unwrap();
    std::fs::write(place.join("report.json"), json.replace("\"shots/shot_1.toml\"", "\"../shot_1.toml\"")).unwrap();
    let refused = run(&place, &["view", "discovered.hyd", ".", "--output", "page.html"]);
    assert!(refused.code == Some(1) && refused.stderr.contains("is not a file of its folder"), "{}", refused.stderr);
    std::fs::write(place.join("report.json"), json).unwrap();
    // A model that was edited is shown with a warning, and is as far from the shots as it has become.
    let text = std::fs::read_to_string(place.join("discovered.hyd")).unwrap();
    std::fs::write(place.join("discovered.hyd"), text.replace("q = s*c*h*h*h;", "q = 0;")).unwrap();
    let edited = run(&place, &["view", "discovered.hyd", ".", "--output", "page.html"]);
    assert!(
        edited.code == Some(0) && edited.stderr.contains("is not as the report has written it"),
        "{}",
        edited.stderr
    );
    let page = data(&std::fs::read_to_string(place.join("page.html")).unwrap());
    assert!(
        page["shots"]["all"][3]["deviations"][0].as_f64().unwrap() > 3.0,
        "{}",
        page["shots"]["all"][3]["deviations"]
    );
    std::fs::write(place.join("discovered.hyd"), text).unwrap();
    // Without the model a report has nothing that could be set.
    std::fs::rename(place.join("discovered.hyd"), place.join("elsewhere.hyd")).unwrap();
    let refused = run(&place, &["view", ".", "--set", "k=1"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("no model beside it"), "{}", refused.stderr);
    std::fs::rename(place.join("elsewhere.hyd"), place.join("discovered.hyd")).unwrap();
    // A report whose curves are cut off is refused with the line.
    let table = std::fs::read_to_string(place.join("trajectories.csv")).unwrap();
    let cut: String = table.lines().take(100).map(|line| format!("{line}\n")).collect();
    std::fs::write(place.join("trajectories.csv"), cut).unwrap();
    let refused = run(&place, &["view", "discovered.hyd", ".", "--output", "page.html"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert!(refused.stderr.contains("it has the curves of 1 shots, and `report.json` 4"), "{}", refused.stderr);
}

/// The page of the written model: curves of the report, and how far they are from what was measured, whatever the size of what was found.
fn shots_stand_beside_the_written_model(place: &Path, report: &Value, curves: &BTreeMap<u64, Vec<(f64, f64)>>) {
    let numbers = |own: &Value| -> Vec<f64> {
        own.as_array().unwrap().iter().map(|own| own.as_f64().unwrap_or(f64::NAN)).collect()
    };
    let viewer = Viewer::start(place, &["discovered.hyd", "."]);
    let page = data(&viewer.page_at("/"));
    let shots = page["shots"]["all"].as_array().unwrap();
    let found = report["effects"][0]["parameters"]["c"].clone();
    assert_eq!(found["parameters"], json!(["wall.c"]));
    assert_eq!(page["shots"]["sizes"], json!([{"name": "wall.c", "words": "seeps through the wall"}]));
    for (shot, (number, wanted)) in shots.iter().zip(curves) {
        assert_eq!(shot["number"].as_u64(), Some(*number));
        let trace = &shot["traces"][0];
        let (measured, now) = (numbers(&trace["measured"]), numbers(&trace["now"]));
        let far = now.iter().zip(wanted).map(|(now, (_, wanted))| (now - wanted).abs()).fold(0.0, f64::max);
        // What a chain adds is taken from the curves of the report.
        assert!(now.len() == wanted.len() && far < 1e-6, "shot {number}: {far} mm away from the report");
        let squares: f64 = measured.iter().zip(&now).map(|(measured, now)| (measured - now).powi(2)).sum();
        let away = (squares / measured.len() as f64).sqrt();
        let said = shot["deviations"][0].as_f64().unwrap();
        assert!((said - away).abs() < 1e-9 && (0.8..1.2).contains(&said), "shot {number}: {said}, not {away}");
        assert!(trace["before"].as_f64().unwrap() > 1.5 * said, "{trace}");
    }
    // Half of what seeps is missing again: by the equation, with the numbers that were fitted.
    let (header, columns) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 2, "set": {"wall.c": "0"}}));
    assert_eq!(header["status"], "done", "{header}");
    let whole = numbers(&shots[2]["traces"][0]["now"]);
    let less: Vec<f64> = columns[0].iter().map(|value| f64::from(*value)).collect();
    assert!(less.iter().zip(&whole).skip(50).all(|(less, whole)| less > whole), "without the leak the level is higher");
    for (shot, deviations) in shots.iter().zip(header["deviations"].as_array().unwrap()) {
        assert!(deviations[0].as_f64().unwrap() > 3.0 * shot["deviations"][0].as_f64().unwrap(), "{header}");
    }
    // What belongs to shots alone is changed in the chosen one.
    let (changed, _) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 1, "set": {"h0": "0.1"}}));
    for (k, (shot, now)) in shots.iter().zip(changed["deviations"].as_array().unwrap()).enumerate() {
        assert_eq!(now[0] != shot["deviations"][0], k == 1, "{changed}");
    }
    let (refused, _) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 0, "set": {"wall.s": "-1"}}));
    assert!(refused["status"] == "refused" && refused["message"].as_str().unwrap().contains("wall.s"), "{refused}");
    // The model itself needs the record of a shot.
    let (refused, _) = viewer.numbers("/run", &json!({"reading": 1, "set": {}, "columns": []}));
    assert!(refused["message"].as_str().unwrap().contains("choose a shot"), "{refused}");
    let h = page["variables"].as_array().unwrap().iter().find(|own| own["n"] == "h").unwrap()["o"][0].clone();
    let (ran, columns) = viewer.numbers("/run", &json!({"reading": 1, "set": {}, "shot": 3, "columns": [h]}));
    assert_eq!(ran["status"], "done", "{ran}");
    let last = f64::from(*columns[0].last().unwrap());
    assert!((last - level(3, SHOTS[3].4)).abs() < 0.02, "{last}");
}

/// Takes the number of a shot, its curve, and the true outlet.
type Compare<'a> = dyn Fn(usize, &[f64], f64) + 'a;

/// What the study and the set say that may be off, as numbers that are moved: what is shown then is computed here.
fn what_may_be_off_moves_the_shots(viewer: &Viewer, page: &Value, compare: &Compare<'_>) {
    let slack = page["shots"]["slack"].as_array().unwrap();
    let names: Vec<&str> = slack.iter().map(|own| own["name"].as_str().unwrap()).collect();
    let alone = ["h0 (shot 1)", "h0 (shot 2)", "h0 (shot 3)", "h0 (shot 4)"];
    assert_eq!(names, [&alone[..], &["k", "s", "offset of h_mm", "gain of h_mm"]].concat());
    let of = |name: &str| slack.iter().find(|own| own["name"] == name).unwrap();
    let near = |own: &Value, wanted: f64| assert!((own.as_f64().unwrap() - wanted).abs() < 1e-9, "{own} {wanted}");
    // One that a parameter alone says, in its unit; three standard deviations to each side, as far as its limits allow.
    let k = of("k");
    assert_eq!((&k["plain"], &k["kind"], &k["shot"]), (&json!("k"), &json!("factor"), &Value::Null));
    near(&k["expected"], 0.8);
    near(&k["tolerance"], 0.08);
    near(&k["range"][0], 0.56);
    near(&k["range"][1], 1.04);
    near(&k["limits"][0], 0.0);
    // One of a shot alone, and a measuring chain, in the unit of the table.
    let begin = of("h0 (shot 2)");
    assert_eq!((&begin["plain"], &begin["shot"], &begin["kind"]), (&Value::Null, &json!(1), &json!("value")));
    near(&begin["expected"], SHOTS[1].1);
    near(&begin["range"][1], SHOTS[1].1 + 0.15);
    let offset = of("offset of h_mm");
    assert_eq!((&offset["unit"], &offset["channel"]), (&json!("mm"), &json!("h_mm")));
    near(&offset["range"][1], 9.0);
    let shown = |off: &Value, set: &Value| {
        let (header, columns) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 1, "set": set, "off": off}));
        assert_eq!(header["status"], "done", "{header}");
        columns[0].iter().map(|value| f64::from(*value)).collect::<Vec<f64>>()
    };
    let moved = shown(
        &json!({"h0 (shot 2)": SHOTS[1].1 + 0.1, "h0 (shot 1)": 0.6, "gain of h_mm": 1.02, "offset of h_mm": 7.0}),
        &json!({"k": "0.9"}),
    );
    for (sample, shown) in (SHOTS[1].3..=SHOTS[1].4).zip(&moved) {
        let wanted = 1.02 * 1e3 * level_of(1, sample, (0.9, 0.0, 0.1)) + 7.0;
        assert!((shown - wanted).abs() < 0.5, "sample {sample}: {shown} instead of {wanted}");
    }
    compare(1, &shown(&json!({"h0 (shot 1)": 0.6}), &json!({})), 0.8);
    // The run of the diagram has the same conditions.
    let all = page["variables"].as_array().unwrap();
    let column = all.iter().find(|own| own["n"] == "h").unwrap()["o"][0].as_u64().unwrap();
    let body =
        json!({"reading": 1, "shot": 1, "set": {}, "off": {"h0 (shot 2)": SHOTS[1].1 + 0.1}, "columns": [column]});
    let (header, columns) = viewer.numbers("/run", &body);
    assert_eq!(header["status"], "done", "{header}");
    assert!((f64::from(columns[0][0]) - SHOTS[1].1 - 0.1).abs() < 1e-6, "{}", columns[0][0]);
    for (off, words) in [(json!({"k": -0.1}), "`k` cannot be -0.1"), (json!({"kk": 1}), "no number `kk`")] {
        let (refused, _) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 1, "set": {}, "off": off}));
        assert!(refused["message"].as_str().is_some_and(|own| own.contains(words)), "{refused}");
    }
}

#[test]
fn shots_of_a_study_stand_beside_its_model() {
    let folder = rig();
    let arguments = ["lab/study.toml", "--bench", "set.json", "--library", "lab"];
    let viewer = Viewer::start(folder.path(), &arguments);
    let page = data(&viewer.page_at("/"));
    let shots = page["shots"]["all"].as_array().unwrap();
    assert_eq!((shots.len(), &page["finding"]), (4, &Value::Null));
    // Parameters have their values although an input was recorded.
    let own = page["variables"].as_array().unwrap().iter().find(|own| own["n"] == "k").unwrap();
    assert_eq!(page["model"]["parameters"][own["p"][0].as_u64().unwrap() as usize], 0.8);
    let compare = |k: usize, curve: &[f64], outlet: f64| {
        for (sample, shown) in (SHOTS[k].3..=SHOTS[k].4).zip(curve) {
            let wanted = 1e3 * level_of(k, sample, (outlet, 0.0, 0.0));
            assert!((shown - wanted).abs() < 0.5, "shot {k}, sample {sample}: {shown} instead of {wanted}");
        }
    };
    for (k, shot) in shots.iter().enumerate() {
        let now = shot["traces"][0]["now"].as_array().unwrap_or_else(|| panic!("{}", shot["message"]));
        let now: Vec<f64> = now.iter().map(|own| own.as_f64().unwrap()).collect();
        compare(k, &now, 0.8);
        assert!(shot["deviations"][0].as_f64().unwrap() > 3.0, "{shot}");
        assert_eq!(shot["traces"][0]["base"], Value::Null);
    }
    let (header, columns) = viewer.numbers("/shots", &json!({"reading": 1, "shot": 1, "set": {"k": "0.9"}}));
    assert_eq!(header["status"], "done", "{header}");
    let now: Vec<f64> = columns[0].iter().map(|value| f64::from(*value)).collect();
    compare(1, &now, 0.9);
    what_may_be_off_moves_the_shots(&viewer, &page, &compare);
    // Files and words that do not fit.
    for (files, words) in [
        (&["lab/study.toml", "--library", "lab"][..], "is a study: --bench SET.json names its set of shots"),
        (&["lab/rig.hyd", "--bench", "set.json"], "--bench belongs to a study"),
        (&["lab/rig.hyd", "lab/study.toml"], "only the first file may be a model or a study"),
    ] {
        let refused = run(folder.path(), &[&["view"], files].concat());
        assert!(refused.code == Some(2) && refused.stderr.contains(words), "{}", refused.stderr);
    }
    // As a file: the first shot with its record, and nothing that could be set.
    let outcome = run(folder.path(), &[&["view"], &arguments[..], &["--output", "page.html"]].concat());
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", outcome.stdout);
    assert_eq!(data(&folder.read("page.html"))["shots"]["all"].as_array().unwrap().len(), 4);
}

#[test]
fn files_of_the_user_stay_and_those_of_earlier_reports_go() {
    let folder = rig();
    std::fs::create_dir_all(folder.path().join("my report/data")).unwrap();
    folder.write("my report/data/wind.csv", "another file");
    let arguments = ["discover", "lab/study.toml", "--bench", "set.json", "--library", "lab", "--report", "my report"];
    let refused = run(folder.path(), &arguments);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert!(
        refused.stderr.contains("`my report/data/wind.csv` is another file than the model reads"),
        "{}",
        refused.stderr
    );
    assert_eq!(folder.read("my report/data/wind.csv"), "another file");
    // A copy of an earlier report gives way to that of a changed file, and files of shots to none.
    std::fs::remove_file(folder.path().join("my report/data/wind.csv")).unwrap();
    discover(&folder);
    let wind = folder.read("lab/data/wind.csv");
    assert_eq!(folder.read("my report/data/wind.csv"), wind);
    let changed = wind.replace("t,w\n", "t,w\n-1,0.3\n");
    folder.write("lab/data/wind.csv", &changed);
    folder.write("my report/shots/shot_1_notes.txt", "by hand");
    folder.write("lab/study.toml", STUDY.replace("without = [", "without = [\"Extras\", "));
    let (report, stdout) = discover(&folder);
    assert!(report["effects"].as_array().unwrap().is_empty() && !stdout.contains("to run it"), "{stdout}");
    let is_there = |name: &str| folder.path().join("my report").join(name).exists();
    assert!(!is_there("discovered.hyd") && !is_there("shots/shot_1.toml") && !is_there("shots/shot_1_inputs.csv"));
    assert!(is_there("shots/shot_1_notes.txt") && !is_there("data/wind.csv"));
    folder.write("lab/study.toml", STUDY);
    discover(&folder);
    assert_eq!(folder.read("my report/data/wind.csv"), changed);
    assert_eq!(folder.read("lab/data/wind.csv"), changed);
}
