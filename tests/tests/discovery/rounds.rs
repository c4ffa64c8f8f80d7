//! A search that begins again, with what its best model leaves counted: what was named is not looked for from far away once more.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::fs;

use hyd_compiler::{Diagnostic, Files, Severity};
use hyd_verbs::discover::{SearchOptions, discover};
use hyd_verbs::study::{StudyFiles, open};
use hyd_verbs::{Libraries, Listener};

use crate::{Draws, folder, json};

const NOISE: f64 = 1e-3;
const R: f64 = 0.4;
const TAU: f64 = 0.23;

const MODEL: &str = "package Room
  partial model Path \"what a wall makes of a signal\"
    Real u;
    Real y;
  end Path;
  model Direct
    extends Path;
  equation
    y = u;
  end Direct;
  model Plain
    parameter Real b(unit = \"1/s\") = 6;
    parameter Real U0 = 1;
    replaceable Direct path constrainedby Path annotation(__hyd(place(id = \"path\")));
    Real u(start = 0, fixed = true);
  equation
    der(u) = b*(U0 - u);
    path.u = u;
  end Plain;
end Room;
";

const EFFECT: &str = "model Echo
  extends Room.Path;
  parameter Real r = 0.5 annotation(__hyd(prior = \"lognormal(0.5, 0.5)\", range = {0.05, 2}));
  parameter Real tau(unit = \"s\") = 0.2 annotation(__hyd(prior = \"lognormal(0.2, 0.5)\", range = {0.05, 0.8}));
equation
  y = u + r*delay(u, tau);
  annotation(__hyd(effect(id = \"echo\", kind = \"physics\", at = {\"path\"}, adds = tau, probe = 0.2, prior = \"lognormal(0.2, 0.5)\",
    range = {0.05, 0.8}, channels = {\"y\"}, words = \"an echo\", signature = \"the same once more\", rivals = {})));
end Echo;
";

/// What a search says that it does.
#[derive(Default)]
struct Heard(RefCell<Vec<String>>);

impl Listener for Heard {
    fn sentence(&self, _severity: Severity, _text: &str) {}

    fn diagnostics(&self, _files: &Files, diagnostics: &[Diagnostic]) {
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
    }

    fn progress(&self, _seconds: f64, text: &str) {
        self.0.borrow_mut().push(text.to_string());
    }
}

/// The record has an echo, and a wave of about the noise that no model has.
#[test]
fn what_was_named_is_not_looked_for_from_afar_again() {
    let folder = folder("rounds");
    let library = folder.join("library");
    fs::create_dir(&library).expect("made");
    fs::write(library.join("Echo.mo"), EFFECT).expect("written");
    fs::write(folder.join("room.mo"), MODEL).expect("written");
    let study = format!(
        "file = \"room.mo\"\nwithout = [\"Hyd.Effects\"]\n[models]\ndefault = \"Room.Plain\"\n[channels]\n\
         y = {{ variable = \"path.y\", noise = {NOISE} }}\n[conditions]\nU0 = \"U0\"\n[nuisances]\nb = \"b\"\n"
    );
    fs::write(folder.join("study.toml"), study).expect("written");
    let mut draws = Draws(5);
    let mut shots = Vec::new();
    for (shot, u0) in [1.0, 2.0, 1.5, 0.7].into_iter().enumerate() {
        let mut text = "time_s,y\n".to_string();
        for k in 0..=300 {
            let t = 5e-3 * f64::from(k);
            let u = |t: f64| if t > 0.0 { u0 * -(-6.0 * t).exp_m1() } else { 0.0 };
            let wave = 1.2 * NOISE * (9.0 * t + shot as f64).sin();
            let _ = writeln!(text, "{t:.6},{:.9e}", u(t) + R * u(t - TAU) + wave + NOISE * draws.normal());
        }
        fs::write(folder.join(format!("s{shot}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{shot}.csv\", \"U0\": {u0}}}"));
    }
    let set = format!("{{\"parameter_tolerance_1sigma\": {{\"b\": 0.02}}, \"experiments\": [{}]}}", shots.join(", "));
    fs::write(folder.join("set.json"), set).expect("written");
    let files = StudyFiles {
        study: folder.join("study.toml"),
        bench: folder.join("set.json"),
        libraries: Libraries { folders: vec![library], ..Libraries::default() },
        threads: None,
        host: None,
    };
    let options =
        SearchOptions { report: folder.join("report"), resume: false, calibrate: None, shared: None, seed: 1 };
    let heard = Heard::default();
    let opened = open(&files, &heard).unwrap_or_else(|failure| panic!("{failure:?}"));
    let found = discover(&files, &opened, &options, &heard).unwrap_or_else(|failure| panic!("{failure:?}"));
    let heard = heard.0.into_inner();
    let count = |wanted: &str| heard.iter().filter(|text| text.as_str() == wanted).count();
    assert!(count("found: echo") >= 2 && count("fitting echo from afar") == 1, "{heard:#?}");
    let report = json(&found.json);
    assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"named".into(), &"echo".into()), "{report:#}");
    let _ = fs::remove_dir_all(&folder);
}
