//! A search that several processes make together gives the report of one, whoever dies on the way.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::{Draws, OWN_LIBRARY, folder, json, study_with, thinned};

/// The report without what a clock says.
fn report(folder: &Path) -> Value {
    let mut report = json(&fs::read_to_string(folder.join("report.json")).expect("written"));
    assert!(report["seconds"].take().as_f64().is_some_and(|seconds| seconds > 0.0));
    report
}

/// Number of answers that members have found so far.
fn answers(report: &Path) -> usize {
    let folders = fs::read_dir(report.join("search")).into_iter().flatten().flatten();
    folders.map(|own| fs::read_dir(own.path().join("answers")).into_iter().flatten().count()).sum()
}

/// A search in a folder, with a queue at hand.
fn command(folder: &Path, queue: &Path, set: &str, rest: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    command.args(["discover", "study.toml", "--bench", set, "--library", "libraries"]).args(rest);
    let path = std::env::var("PATH").unwrap_or_default();
    command
        .env("PATH", format!("{}:{path}", queue.join("bin").display()))
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH");
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

#[track_caller]
fn well(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(unix)]
#[test]
fn a_search_of_several_processes_is_that_of_one_whoever_dies() {
    let folder = folder("shared");
    fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
    fs::write(folder.join("libraries/Workshop/package.hyd"), OWN_LIBRARY).expect("written");
    study_with(&folder, "without = [\"Hyd.Effects\"]", &[]);
    let set = thinned(&folder, "bench/B03", 4);
    let queue = folder.join("queue");
    hyd_tests::queue::make(&queue).expect("made");
    let command = |rest: &[&str]| command(&folder, &queue, &set, rest);
    let captured = |rest: &[&str]| command(rest).stdout(Stdio::piped()).stderr(Stdio::piped()).output().expect("runs");
    well(&captured(&["--report", "alone"]));
    let shared = ["--report", "report", "--on", "slurm", "--shards", "3", "--settle", "1"];
    let mut child = command(&shared).spawn().expect("runs");
    let begin = Instant::now();
    while answers(&folder.join("report")) < 3 {
        assert!(begin.elapsed() < Duration::from_secs(600), "no answer was found");
        assert!(child.try_wait().expect("asked").is_none(), "it ended before it could be killed");
        sleep(Duration::from_millis(5));
    }
    // The submitting command dies, and two of the three members; what they were at is missing.
    child.kill().expect("killed");
    child.wait().expect("ended");
    for member in ["0", "2"] {
        let group = fs::read_to_string(queue.join(format!("group.{member}"))).expect("begun");
        // Without the two dashes some versions of this program read a group as its first digit.
        let killed = Command::new("kill").args(["-9", "--", &format!("-{}", group.trim())]).status().expect("runs");
        assert!(killed.success());
    }
    assert!(!folder.join("report/report.json").exists());
    let found = captured(&shared);
    well(&found);
    let said = String::from_utf8_lossy(&found.stderr).into_owned();
    assert!(!said.contains("were made here"), "{said}");
    assert_eq!(report(&folder.join("report")), report(&folder.join("alone")));
    assert!(!folder.join("report/search").exists(), "a finished search needs no answers");

    let _ = fs::remove_dir_all(&folder);
}

/// A mass that a drag slows which its model lacks; `v = b v0 e/(b + c v0 (1 - e))` with `e = exp(-b t/m)`.
fn coast(folder: &Path) {
    let model = "model Coast\n  parameter Real m(unit = \"kg\") = 2;\n  parameter Real b(unit = \"N.s/m\") = 0.5;\n\
                 parameter Real v0(unit = \"m/s\") = 1;\n  Real v(unit = \"m/s\", start = v0, fixed = true);\n\
                 equation\n  m*der(v) = -b*v;\nend Coast;\n";
    let study = "file = \"coast.mo\"\n[models]\ndefault = \"Coast\"\n[channels]\nv = { variable = \"v\", noise = 2e-3 }\n\
                 [conditions]\nv0 = \"v0_m_s\"\n[nuisances]\nm = \"m\"\nb = \"b\"\n";
    let mut draws = Draws(5);
    let mut shots = Vec::new();
    for (k, v0) in [1.0, 1.06, 0.95, 1.02].into_iter().enumerate() {
        let mut text = "time_s,v\n".to_string();
        for t in (0..201).map(|k| 1e-3 * f64::from(k)) {
            let e = (-0.25 * t).exp();
            let v = 0.5 * v0 * e / (0.5 + 0.2 * v0 * (1.0 - e)) + 2e-3 * draws.normal();
            text += &format!("{t},{v}\n");
        }
        fs::write(folder.join(format!("s{k}.csv")), text).expect("written");
        shots.push(format!("{{\"file\": \"s{k}.csv\", \"v0_m_s\": {v0}}}"));
    }
    let tolerance = "{\"m\": 0.01, \"b\": 0.02}";
    let set = format!("{{\"parameter_tolerance_1sigma\": {tolerance}, \"experiments\": [{}]}}", shots.join(", "));
    for (name, text) in [("coast.mo", model), ("study.toml", study), ("set.json", &set)] {
        fs::write(folder.join(name), text).expect("written");
    }
}

#[cfg(unix)]
#[test]
fn processes_of_this_machine_end_with_the_command_and_say_what_is_wrong() {
    let folder = folder("here");
    coast(&folder);
    // Processes run in another folder, from which the files of a library are called otherwise.
    fs::create_dir_all(folder.join("libraries/Workshop")).expect("made");
    fs::write(folder.join("libraries/Workshop/package.hyd"), OWN_LIBRARY).expect("written");
    let queue = folder.join("queue");
    hyd_tests::queue::make(&queue).expect("made");
    let command = |rest: &[&str]| command(&folder, &queue, "set.json", rest);
    let captured = |rest: &[&str]| command(rest).stdout(Stdio::piped()).stderr(Stdio::piped()).output().expect("runs");
    well(&captured(&["--report", "alone"]));
    // An interrupt ends the processes.
    let here = ["--report", "here", "--on", "here", "--shards", "2", "--json"];
    let mut child = command(&here).stderr(Stdio::piped()).spawn().expect("runs");
    while answers(&folder.join("here")) < 3 {
        assert!(child.try_wait().expect("asked").is_none(), "it ended before it could be interrupted");
        sleep(Duration::from_millis(5));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().expect("runs").success());
    let ended = child.wait_with_output().expect("ended");
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(ended.status.code() == Some(3) && said.contains("the same command goes on with what was found"), "{said}");
    let before = answers(&folder.join("here"));
    sleep(Duration::from_secs(1));
    assert_eq!(answers(&folder.join("here")), before, "processes go on after the interrupt");
    let found = captured(&here);
    well(&found);
    assert!(!String::from_utf8_lossy(&found.stderr).contains("were made here"));
    assert_eq!(report(&folder.join("here")), report(&folder.join("alone")));

    // Members that always die are given up, in words, and what cannot be had is said before anything is made.
    for member in ["0", "1"] {
        fs::write(queue.join(format!("full.{member}")), "").expect("written");
    }
    let full = captured(&["--report", "full", "--on", "slurm", "--shards", "2", "--settle", "0.5"]);
    let said = String::from_utf8_lossy(&full.stderr).into_owned();
    let given = "all 2 processes of the search were given up; the same command goes on with what they have found; process 0: error: `";
    assert!(full.status.code() == Some(1) && said.contains(given) && said.contains("File too large"), "{said}");
    let many = captured(&["--report", "many", "--on", "slurm", "--shards", "102"]);
    let said = String::from_utf8_lossy(&many.stderr).into_owned();
    assert!(many.status.code() == Some(2) && said.contains("102 tasks are more than 101"), "{said}");
    let _ = fs::remove_dir_all(&folder);
}
