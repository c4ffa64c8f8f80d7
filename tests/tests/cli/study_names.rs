//! Names of the comparison's own do not meet those of a model, a library or a bench.

use std::fmt::Write as _;

use serde_json::Value;

use crate::process::{Scratch, run};

/// Uniform numbers (SplitMix64) and normal ones (Box and Muller).
struct Draws(u64);

impl Draws {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// `0.01 i' = a - i - 0.15 i^2` from 0: the quotient of the distances to its two equilibria is an exponential.
fn truth(a: f64, t: f64) -> f64 {
    let root = (1.0 + 0.6 * a).sqrt();
    let (high, low) = ((-1.0 + root) / 0.3, (-1.0 - root) / 0.3);
    let w = high / low * (-15.0 * (high - low) * t).exp();
    (high - low * w) / (1.0 - w)
}

fn discovered(folder: &Scratch, study: &str, rest: &[&str]) -> Value {
    let arguments = ["discover", study, "--bench", "set.json", "--report", "report"];
    let found = run(folder.path(), &[&arguments, rest].concat());
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    serde_json::from_str(&folder.read("report/report.json")).unwrap()
}

/// Tables of the circuit under these names, each from one `a`, and the set of them.
fn measure(folder: &Scratch, shots: [(&str, f64); 3]) {
    let mut draws = Draws(7);
    let mut told = Vec::new();
    for (name, a) in shots {
        let mut table = String::from("t,time,hyd_channel_0,i\n");
        for k in 0..=100 {
            let t = 5e-4 * f64::from(k);
            let i = truth(a, t);
            let [p, q, r] = [i, 2.0 * i, i].map(|value| value + 1e-3 * value.max(1.0) * 0.5 * draws.normal());
            writeln!(table, "{t:.4},{p:.6},{q:.6},{r:.6}").unwrap();
        }
        folder.write(name, table);
        told.push(format!("{{\"file\": \"{name}\", \"a\": {a}}}"));
    }
    folder.write("set.json", format!("{{\"experiments\": [{}]}}", told.join(", ")));
}

/// The circuit with further declarations and a further term, and its study.
fn model(folder: &Scratch, class: &str, more: &str, term: &str) {
    let own = "  parameter Real a = 2;\n  parameter Real c = 1;\n  Real i(start = 0, fixed = true);\nequation\n";
    folder.write("m.hyd", format!("model {class}\n{more}{own}  0.01*der(i) = a - c*i{term};\nend {class};\n"));
    let study = format!(
        "file = \"m.hyd\"\n[models]\ndefault = \"{class}\"\n[channels]\ntime = {{ variable = \"i\", noise = 1e-3 }}\n\
         hyd_channel_0 = {{ variable = \"2*i\", noise = 2e-3 }}\ni = {{ variable = \"i\", noise = 1e-3 }}\n\
         [conditions]\na = \"a\"\n[shots]\ntime = \"t\"\n"
    );
    folder.write("study.toml", study);
}

/// A variable at the top of the model is a channel, and is called like a loop's counter; columns are called like the comparison's own
/// variables and like the time, tables like effects; the model has variables and a parameter of the comparison's names, and the name that
/// the discovered model would have.  What is missing, `-0.15*i^2`, is found all the same.
#[test]
fn a_term_is_found_in_a_model_with_the_names_of_the_comparison() {
    let folder = Scratch::new();
    measure(&folder, [("piston_friction.csv", 2.0), ("Discovered.csv", 3.0), ("time.csv", 4.0)]);
    let theirs = "  Real hyd_channel_0 = 3*i;\n  Real hyd_channel2_1 = time;\n  parameter Real hyd_term_0 = 4;\n  Real HydMeasured = i;\n  \
                  Real HydPlaces = i;\n  Real Discovered2 = i;\n";
    for (class, more) in [("M", ""), ("Discovered", theirs)] {
        model(&folder, class, more, "");
        let report = discovered(&folder, "study.toml", &[]);
        let term = &report["law"]["terms"][0];
        assert_eq!((&report["status"], &term["shape"]), (&"law".into(), &"i*abs(i)".into()), "{class}: {report:#}");
        let number = |key: &str| term[key].as_f64().unwrap();
        let (value, error) = (number("coefficient"), number("stderr"));
        assert!((value + 0.15).abs() < 4.0 * error && error < 1e-3, "{class}: {value} +- {error} instead of -0.15");
    }
}

/// The text of a law gives way to what a later search says; a file of the user does not.
#[test]
fn the_law_of_an_earlier_report_gives_way_and_a_file_of_the_user_stays() {
    let folder = Scratch::new();
    measure(&folder, [("p.csv", 2.0), ("q.csv", 3.0), ("r.csv", 4.0)]);
    model(&folder, "M", "", "");
    assert_eq!(discovered(&folder, "study.toml", &[])["status"], "law");
    assert!(folder.read("report/Proposed.hyd").contains("id = \"proposed_law\""));
    model(&folder, "M", "", " - 0.15*i*abs(i)");
    assert_eq!(discovered(&folder, "study.toml", &[])["status"], "adequate");
    assert!(!folder.path().join("report/Proposed.hyd").exists());
    model(&folder, "M", "", "");
    folder.write("report/Proposed.hyd", "by hand");
    let arguments = ["discover", "study.toml", "--bench", "set.json", "--report", "report"];
    let found = run(folder.path(), &arguments);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    assert!(
        found.stderr.contains("Proposed.hyd` is not the law of an earlier report and is not replaced"),
        "{}",
        found.stderr
    );
    assert!(folder.read("report/discovered.hyd").contains("proposed_law"));
    assert_eq!(folder.read("report/Proposed.hyd"), "by hand");
    // Records of one operating point tell what is missing, and why it is not called a law.
    measure(&folder, [("p.csv", 3.0), ("q.csv", 3.0), ("r.csv", 3.0)]);
    folder.write("study.toml", format!("without = [\"Hyd.Effects\"]\n{}", folder.read("study.toml")));
    let report = discovered(&folder, "study.toml", &[]);
    let why = report["no_law"].as_str().unwrap_or_default();
    assert!(report["law"].is_null() && why.starts_with("all shots were made at one operating point"), "{report:#}");
}

/// A library of effects is called like the model that a search writes; that model is the base of the next study, in which nothing is
/// missing, with and without the library at hand.
#[test]
fn a_discovered_model_is_the_next_base() {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drv"]).code, Some(0));
    std::fs::rename(folder.path().join("drv/drive.hyd"), folder.path().join("drive.hyd")).unwrap();
    let note = "annotation(__hyd(effect(id = \"seeping\", kind = \"physics\", at = {\"leakage\"}, adds = k, zero = 0, probe = 1e-11, \
                prior = \"lognormal(1e-11, 0.8)\", words = \"oil that seeps\")));";
    std::fs::create_dir_all(folder.path().join("lib/Discovered")).unwrap();
    folder.write(
        "lib/Discovered/package.hyd",
        format!(
            "within;\npackage Discovered\n  model Seep\n    extends Hyd.Places.PartialLeakage;\n    \
             parameter Hyd.Units.HydraulicConductance k = 1e-11;\n  equation\n    q = k*dp;\n    {note}\n  end Seep;\nend Discovered;\n"
        ),
    );
    // Columns of a run of the drive with a leak, and noise as the set states it.
    let leak =
        "model Truth\n  extends Drv(redeclare Hyd.Effects.ChamberLeakage leakage(k_leak = 2e-11));\nend Truth;\n";
    folder.write("truth.hyd", folder.read("drive.hyd") + leak);
    let mut draws = Draws(3);
    let mut shots = Vec::new();
    for (k, p0) in ["10e6", "12e6", "14e6"].into_iter().enumerate() {
        let set = format!("p0={p0}");
        let shot =
            ["simulate", "truth.hyd", "--stop", "0.03", "--intervals", "300", "--set", &set, "--variables", "^(y|p)$"];
        assert_eq!(run(folder.path(), &[&shot[..], &["--result", "raw.csv"]].concat()).code, Some(0));
        let raw = folder.read("raw.csv");
        let mut table = String::from("time,y,p\n");
        for line in raw.lines().skip(1) {
            let row: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            writeln!(table, "{},{:.9},{:.1}", row[0], row[1] + 1.5e-5 * draws.normal(), row[2] + 4e4 * draws.normal())
                .unwrap();
        }
        folder.write(&format!("shot{k}.csv"), table);
        shots.push(format!("{{\"file\": \"shot{k}.csv\", \"shot\": {}, \"p0_Pa\": {p0}}}", k + 1));
    }
    assert!(folder.read("raw.csv").starts_with("time,y,p\n"));
    folder.write(
        "set.json",
        format!(
            "{{\"noise_std\": {{\"y\": 1.5e-5, \"p\": 4e4}}, \"parameter_tolerance_1sigma\": {{\"k\": 0.1, \"m\": 0.02, \"d\": 0.1}},\n\
             \"experiments\": [{}]}}",
            shots.join(", ")
        ),
    );
    let study = folder.read("drv/bench.toml").replace("file = ", "without = [\"Hyd.Effects\"]\nfile = ");
    folder.write("first.toml", &study);
    let report = discovered(&folder, "first.toml", &["--library", "lib"]);
    assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"named".into(), &"seeping".into()), "{report:#}");
    let size = &report["effects"][0]["parameters"]["k"];
    let (value, error) = (size["value"].as_f64().unwrap(), size["stderr"].as_f64().unwrap());
    assert!((value - 2e-11).abs() < 4.0 * error, "{value:e} +- {error:e}");
    let text = folder.read("report/discovered.hyd");
    assert!(text.contains("model Discovered2 ") && text.contains("redeclare Discovered.Seep leakage(k = "), "{text}");
    folder.write("base.hyd", text);
    assert_eq!(run(folder.path(), &["check", "base.hyd"]).code, Some(0));
    folder.write("next.toml", study.replace("drive.hyd", "base.hyd").replace("\"Drv\"", "\"Discovered2\""));
    for rest in [&["--library", "lib"][..], &[]] {
        let report = discovered(&folder, "next.toml", rest);
        assert_eq!((&report["status"], &report["model"]), (&"adequate".into(), &"Discovered2".into()), "{report:#}");
    }
}
