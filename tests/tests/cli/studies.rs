//! Studies: what a fit says, and what is said where study, model and effects do not fit together.

use crate::process::{Scratch, run};

/// The folder of a new project with the tables of its two shots.
fn project() -> Scratch {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drv"]).code, Some(0));
    let own = folder.path().join("drv");
    for (p0, table) in [("p0=10e6", "bench/shot1.csv"), ("p0=14e6", "bench/shot2.csv")] {
        let shot = ["simulate", "drive.hyd", "--set", p0, "--variables", "^(y|p)$", "--result", table];
        assert_eq!(run(&own, &shot).code, Some(0));
    }
    folder
}

/// Writes a study that is the project's but for one thing.
fn study(folder: &Scratch, from: &str, to: &str) {
    let text = folder.read("drv/bench.toml");
    assert!(text.contains(from), "{text}");
    folder.write("drv/other.toml", text.replace(from, to));
}

const FIT: [&str; 4] = ["fit", "other.toml", "--bench", "bench/set.json"];

#[test]
fn without_shots_held_out_there_is_no_gap_on_them() {
    let folder = project();
    study(&folder, "[shots]", "[shots]\nhold_out = []");
    let fitted = run(&folder.path().join("drv"), &FIT);
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.contains("gap (1.00 is noise)        fitted\n"), "{}", fitted.stdout);
    assert!(!fitted.stdout.contains("NaN") && !fitted.stdout.contains("held out"), "{}", fitted.stdout);
    let json = run(&folder.path().join("drv"), &[&FIT[..], &["--json"]].concat()).stdout;
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["gap"]["heldout"].is_null() && json["gap"]["train"]["all"].is_number(), "{json}");
}
