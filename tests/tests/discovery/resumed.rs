//! A search that was killed goes on where it was and ends with the same answer.

use std::fs;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::{OWN_LIBRARY, folder, hyd, json, study_with, thinned};

#[test]
fn a_search_that_was_killed_goes_on() {
    let folder = folder("resumed");
    fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
    fs::write(folder.join("libraries/Workshop/package.hyd"), OWN_LIBRARY).expect("written");
    study_with(&folder, "without = [\"Hyd.Effects\"]", &[]);
    let set = thinned(&folder, "bench/B03", 4);
    let arguments = ["discover", "study.toml", "--bench", &set, "--library", "libraries", "--report", "report"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    let command = command
        .args(arguments)
        .current_dir(&folder)
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH")
        .stdout(Stdio::null());
    let mut child = command.spawn().expect("runs");
    let fits = folder.join("report/fits.jsonl");
    let begin = Instant::now();
    // The fits of the base model and of the effect.
    while fs::read_to_string(&fits).map_or(0, |text| text.lines().count()) < 3 {
        assert!(begin.elapsed() < Duration::from_secs(600), "no fit was kept");
        assert!(child.try_wait().expect("asked").is_none(), "it ended before it could be killed");
        sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(!folder.join("report/report.json").exists());
    let mut torn = fs::read_to_string(&fits).expect("readable");
    torn.push_str("{\"fit\": \"candidate: torn");
    fs::write(&fits, torn).expect("written");
    let found = hyd(&folder, &[&arguments[..], &["--resume", "--json"]].concat());
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    let report = json(&found.stdout);
    assert_eq!((&report["status"], &report["effects"][0]["id"]), (&"named".into(), &"seeping".into()), "{report:#}");
    let size = &report["effects"][0]["parameters"]["k"];
    let (value, error) = (size["value"].as_f64().expect("a number"), size["stderr"].as_f64().expect("a number"));
    assert!((value - 1.2e-11).abs() < 4.0 * error, "{value:e} +- {error:e} instead of 1.2e-11");
    assert_eq!(report["attempts"][0][0]["start"], "the fit of the search that was ended", "{report:#}");
    assert!(!fits.exists(), "a finished search needs no fits");
    let _ = fs::remove_dir_all(&folder);
}
