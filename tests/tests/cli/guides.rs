//! The guides of `docs/guides` typed through: their texts become files, their commands are run, what they show must be seen.
//!
//! In a folder of its own that holds the repository's `models`: a block ```` ```modelica NAME ````, or one of `shell` or `toml`, is written to
//! that file; each line of a
//! ```` ```sh ```` block is a command of the program, or `sh` with such a file, that must succeed (```` ```sh fails ````: must not); each line of a ```` ```text ````
//! block must stand in what the last block of commands printed.  Pictures and tables that a command names must exist and hold
//! something.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hyd_frames::{Cells, Frame};
use hyd_tests::models::root;

/// What a command printed, and whether it succeeded.
struct Outcome {
    text: String,
    succeeded: bool,
}

/// Words of a command line; double quotes keep blanks together.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    for c in line.trim().chars() {
        match c {
            '"' => quoted = !quoted,
            ' ' if !quoted => words.push(String::new()),
            c => words.last_mut().expect("there is one").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

fn run(folder: &Path, line: &str) -> Outcome {
    let words = words(line);
    let program = match words[0].strip_prefix("./") {
        Some(own) => folder.join(own),
        None if words[0] == "sh" => PathBuf::from("sh"),
        None => PathBuf::from(env!("CARGO_BIN_EXE_hyd-under-test")),
    };
    assert!(
        words[0] == "hyd" || words[0] == "sh" || words[0].starts_with("./"),
        "`{line}` is not a command of the program"
    );
    let mut command = Command::new(program);
    command.env("HYD_LAUNCHER", env!("CARGO_BIN_EXE_hyd-launcher-under-test"));
    command.env("HYD_UNIT", crate::unit_client::library());
    let command = command
        .args(&words[1..])
        .current_dir(folder)
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH")
        .env("NO_COLOR", "1");
    let output = command.output().unwrap_or_else(|error| panic!("`{line}`: {error}"));
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    // The outputs of a linear model are variables.
    let files: &[&str] = match words.get(1).map(String::as_str) {
        Some("linearize") => &["--result"],
        _ => &["--plot", "--result", "--output", "--html"],
    };
    for pair in words.windows(2).filter(|pair| files.contains(&pair[0].as_str())) {
        let size = fs::metadata(folder.join(&pair[1])).map_or(0, |data| data.len());
        assert!(size > 1000, "`{line}` leaves {size} bytes in {}\n{text}", pair[1]);
    }
    Outcome { text, succeeded: output.status.success() }
}

/// The texts of a folder, with those of its folders.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("readable") {
        let (source, name) = entry.map(|entry| (entry.path(), entry.file_name())).expect("listed");
        if source.is_dir() {
            copy(&source, &to.join(name));
        } else if source.extension().is_some_and(|extension| extension == "hyd") {
            fs::copy(&source, to.join(name)).expect("copied");
        }
    }
}

/// Types a guide through; the folder stays for what the caller wants to look at.
fn type_through(guide: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("hyd-guide-{guide}-{}", std::process::id()));
    copy(&root().join("models"), &folder.join("models"));
    let text = fs::read_to_string(root().join(format!("docs/guides/{guide}.md"))).expect("the guide");
    let mut shown = String::new();
    let mut block: Option<(String, String)> = None;
    let mut commands = 0;
    for line in text.lines() {
        match (&mut block, line.strip_prefix("```")) {
            (None, Some(kind)) => block = Some((kind.trim().to_string(), String::new())),
            (None, None) => {}
            (Some((_, content)), None) => *content += &format!("{line}\n"),
            (Some((kind, content)), Some(_)) => {
                let named = ["modelica ", "shell ", "toml "].iter().find_map(|language| kind.strip_prefix(language));
                if let Some(name) = named {
                    let path = folder.join(name);
                    fs::create_dir_all(path.parent().expect("it stands in the folder")).expect("made");
                    fs::write(path, content).expect("written");
                } else if kind.starts_with("sh") {
                    shown.clear();
                    for command in content.lines() {
                        let outcome = run(&folder, command);
                        let wanted = kind == "sh";
                        assert_eq!(outcome.succeeded, wanted, "{guide}: `{command}`\n{}", outcome.text);
                        shown += &outcome.text;
                        commands += 1;
                    }
                } else {
                    assert_eq!(kind, "text", "{guide}: an unknown kind of block");
                    let missing: Vec<&str> = content.lines().filter(|line| !shown.contains(line.trim())).collect();
                    assert!(missing.is_empty(), "{guide}: {missing:?} is not in\n{shown}");
                }
                block = None;
            }
        }
    }
    assert!(block.is_none() && commands >= 4, "{guide}: {commands} commands");
    folder
}

/// A column of a table that a command wrote, over time.
fn column(folder: &Path, file: &str, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(folder.join(file)).expect("a table");
    let place = reader.headers().expect("names").iter().position(|header| header == name).expect("the column");
    reader.records().map(|record| record.expect("a row")[place].parse().expect("a number")).collect()
}

#[test]
fn first_drive() {
    let folder = type_through("first_drive");
    let largest = |file: &str| column(&folder, file, "y").into_iter().fold(0.0, f64::max);
    let (low, high) = (largest("low.csv"), largest("high.csv"));
    assert!(low > 8e-3 && high > low, "the valve opens by {low} and {high} m");
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn new_variant() {
    let folder = type_through("new_variant");
    // Between rigid stops the spool never leaves its travel by more than the event's tolerance.
    let x = column(&folder, "light.csv", "x");
    assert!(x.iter().all(|&x| (-1e-7..0.45e-3 + 1e-7).contains(&x)));
    let arrives = |file: &str| {
        let (x, t) = (column(&folder, file, "x"), column(&folder, file, "time"));
        t[x.iter().position(|&x| x > 0.4e-3).expect("the spool opens")]
    };
    assert!(arrives("light.csv") < arrives("drive.csv"), "the light spool is not earlier");
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn write_an_effect() {
    let folder = type_through("write_an_effect");
    let (base, zero, probe) =
        (column(&folder, "base.csv", "y"), column(&folder, "zero.csv", "y"), column(&folder, "probe.csv", "y"));
    assert_eq!(base.len(), zero.len());
    let off = |other: &[f64]| base.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(&zero) < 1e-6, "at zero the lift is off by {} m", off(&zero));
    assert!(off(&probe) > 50e-6, "at its probe the effect moves the lift by {} m", off(&probe));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn command_lines_are_split() {
    assert_eq!(
        words("hyd plot a.csv  --variables \"^(a|b) c$\""),
        ["hyd", "plot", "a.csv", "--variables", "^(a|b) c$"]
    );
}

#[test]
fn executables() {
    let folder = type_through("executables");
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn see_the_equations() {
    type_through("see_the_equations");
}

#[test]
fn your_bench() {
    let folder = type_through("your_bench");
    let report = fs::read_to_string(folder.join("report/report.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["effects"][0]["id"], "piston_friction");
    let force = report["effects"][0]["parameters"]["F_c"]["value"].as_f64().expect("a size");
    assert!((force - 45.0).abs() < 0.5, "{force} N");
    // The bench has a sliding force of 45 N, and Lift is in m: the table is what the model has simulated but for the noise.
    let (lift, exact) = (column(&folder, "bench/shot_05.csv", "Lift"), column(&folder, "run05.csv", "y"));
    let top = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    assert!((top(&lift) / top(&exact) - 1.0).abs() < 5e-3, "{} and {} m", top(&lift), top(&exact));
    assert!(fs::metadata(folder.join("bench.html")).is_ok_and(|data| data.len() > 100_000));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn many_runs() {
    let folder = type_through("many_runs");
    for file in ["grid/rows.parquet", "draws/members.parquet", "pieces/members.parquet"] {
        assert!(Frame::read(&folder.join(file)).is_ok_and(|frame| frame.rows() >= 8), "{file}");
    }
    let measured = Frame::read(&folder.join("measured/members.parquet")).expect("readable");
    let Some(Cells::Numbers(lifts)) = measured.column("max(y)") else { panic!("no column") };
    assert!(lifts.len() == 7 && lifts.iter().all(|lift| *lift > 4e-3), "{lifts:?}");
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn fmu() {
    let folder = type_through("fmu");
    for unit in ["drive.fmu", "drive2.fmu", "mass.fmu", "heavy.fmu"] {
        assert!(fs::metadata(folder.join(unit)).expect("made").len() > 100_000, "{unit}");
    }
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn view() {
    let folder = type_through("view");
    let page = fs::read_to_string(folder.join("compared.html")).expect("the page");
    assert!(page.contains("\"label\":\"low\""), "the run beside is in the page");
    fs::remove_dir_all(folder).expect("removed");
}
