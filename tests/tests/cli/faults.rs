//! Faults from outside: a disk that fills up, a kill, little memory, folders that contain themselves, texts of a million lines.
//!
//! A disk that fills up is a limit on the size of files: a write beyond it fails as on a full disk, in the middle of the file.

use std::fs;
use std::os::unix::fs::symlink;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use crate::process::{Scratch, assert_no_panic, command, run, wait};

const DECAY: &str = "model Decay\n  parameter Real k = 1;\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -k*x;\n\
                     end Decay;\n";

/// Runs the program under limits that the shell sets first.
fn limited(folder: &Scratch, limits: &str, arguments: &[&str]) -> Output {
    let program = command(folder.path(), arguments);
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("{limits}; exec \"$@\""), "sh"]).arg(program.get_program()).args(arguments);
    shell
        .current_dir(folder.path())
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH")
        .env("NO_COLOR", "1")
        .stdin(Stdio::null());
    shell.output().unwrap()
}

/// No file may grow beyond 4 kB.
const FULL: &str = "trap '' XFSZ; ulimit -f 8";

#[test]
fn a_disk_that_fills_up_leaves_no_half_files() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let cases: [(&[&str], &str); 8] = [
        (&["simulate", "decay.hyd", "--result", "r.csv"], "r.csv"),
        (&["simulate", "decay.hyd", "--result", "r.mat"], "r.mat"),
        (&["simulate", "decay.hyd", "--result", "r.parquet"], "r.parquet"),
        (&["simulate", "decay.hyd", "--plot", "p.svg"], "p.svg"),
        (&["simulate", "decay.hyd", "--plot", "p.png"], "p.png"),
        (&["equations", "decay.hyd", "--html", "e.html"], "e.html"),
        (&["doc", "--no-pictures", "--output", "d.html"], "d.html"),
        (&["sweep", "decay.hyd", "--vary", "k=1:2:40", "--rows", "--result", "runs"], "results"),
    ];
    for (arguments, name) in cases {
        let outcome = limited(&folder, FULL, arguments);
        let said = String::from_utf8_lossy(&outcome.stderr).into_owned();
        assert!(!said.contains("panicked"), "{arguments:?}: {said}");
        assert_eq!(outcome.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(said.contains(name) && said.contains("too large"), "{arguments:?}: {said}");
        let left: Vec<String> = folder.names().into_iter().filter(|left| left != "decay.hyd").collect();
        assert!(left.is_empty() || left == ["runs"], "{arguments:?} leaves {left:?}");
    }
}

#[test]
fn a_text_is_never_half_formatted() {
    let folder = Scratch::new();
    let long = format!("model M\n{}end M;\n", "Real x;\n".repeat(2_000).replace("x;", "x_long_name;"));
    folder.write("long.hyd", &long);
    let outcome = limited(&folder, FULL, &["fmt", "long.hyd"]);
    assert_eq!(outcome.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&outcome.stderr).contains("`long.hyd` cannot be written"));
    assert_eq!((folder.read("long.hyd"), folder.names()), (long, vec!["long.hyd".to_string()]));
}

#[test]
fn a_killed_run_leaves_the_older_result_and_the_next_run_succeeds() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    folder.write("r.csv", "older results\n");
    let arguments = ["simulate", "decay.hyd", "--stop", "1e3", "--intervals", "100000000", "--result", "r.csv"];
    let mut child = command(folder.path(), &arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let part = || folder.names().into_iter().any(|name| name.ends_with(".part"));
    while !part() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    wait(&mut child, &arguments);
    assert_eq!(folder.read("r.csv"), "older results\n");
    let next = run(folder.path(), &["simulate", "decay.hyd", "--result", "r.csv"]);
    assert_eq!(next.code, Some(0), "{}", next.stderr);
    assert!(folder.read("r.csv").starts_with("time,x"));
}

#[test]
fn too_little_memory_is_said_and_leaves_no_result() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    let n = 3_000_000;
    folder.write(
        "large.hyd",
        format!(
            "model Large\n  Real x[{n}](each start = 1, each fixed = true);\nequation\n  for i in 1:{n} loop\n    \
             der(x[i]) = -x[i];\n  end for;\nend Large;\n"
        ),
    );
    // What the program itself takes, and no more than a model of one equation needs.
    let simulate = |megabytes: usize, model: &str| {
        limited(&folder, &format!("ulimit -v {}", megabytes << 10), &["simulate", model, "--result", "r.csv"])
    };
    let enough = (1..=64).map(|k| 16 * k).find(|&megabytes| simulate(megabytes, "decay.hyd").status.success());
    let enough = enough.expect("a gigabyte suffices for one equation");
    let before = folder.read("r.csv");
    let outcome = simulate(enough, "large.hyd");
    let said = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert!(!outcome.status.success() && said.contains("memory"), "{enough} MB: {:?} {said}", outcome.status);
    assert_eq!(folder.read("r.csv"), before);
}

#[test]
fn folders_that_contain_themselves_end_a_search() {
    let folder = Scratch::new();
    let library = folder.path().join("Lib");
    fs::create_dir(&library).unwrap();
    folder.write("Lib/package.hyd", "package Lib\nend Lib;\n");
    folder.write("Lib/Part.hyd", "within Lib;\nmodel Part\nend Part;\n");
    for name in ["Lib", "Again", "Twice"] {
        symlink(".", library.join(name)).unwrap();
    }
    symlink("nowhere", library.join("Broken.hyd")).unwrap();
    folder.write("m.hyd", "model M\n  Lib.Prat p;\nend M;\n");
    let outcome = run(folder.path(), &["check", "m.hyd", "--library", "."]);
    assert_no_panic(&outcome);
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("did you mean") && outcome.stderr.contains("Part"), "{}", outcome.stderr);
    assert_eq!(run(folder.path(), &["fmt", "--check", "Lib"]).code, Some(0));
    let page = run(folder.path(), &["doc", "Lib"]);
    assert_eq!((page.code, page.stdout.as_str()), (Some(0), "2 classes, 0 pictures of examples in library.html\n"));
}

#[test]
fn pictures_and_pages_are_not_written_over_folders() {
    let folder = Scratch::new();
    folder.write("decay.hyd", DECAY);
    fs::create_dir(folder.path().join("p.svg")).unwrap();
    let cases: [&[&str]; 3] = [
        &["simulate", "decay.hyd", "--plot", "p.svg"],
        &["equations", "decay.hyd", "--html", "p.svg"],
        &["doc", "--no-pictures", "--output", "p.svg"],
    ];
    for arguments in cases {
        let outcome = run(folder.path(), arguments);
        assert_no_panic(&outcome);
        assert_eq!(outcome.code, Some(1), "{arguments:?}: {}", outcome.stderr);
        assert!(
            outcome.stderr.contains("`p.svg` cannot be written: it is a folder"),
            "{arguments:?}: {}",
            outcome.stderr
        );
        assert_eq!(folder.names(), ["decay.hyd", "p.svg"], "{arguments:?}");
    }
}

#[test]
fn a_million_lines_are_read_and_formatted() {
    let folder = Scratch::new();
    let lines = 1_000_000;
    let text = format!("model Long\n{}  Real x = 1;\nend Long;\n", "  // a line\n".repeat(lines));
    folder.write("long.hyd", &text);
    let outcome = run(folder.path(), &["check", "long.hyd"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let outcome = run(folder.path(), &["fmt", "--check", "long.hyd"]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    // Beyond the limit of what is read the answer is a message.
    folder.write("long.hyd", format!("model Long\n{}end Long;\n", "  Real a_variable = 1.25e-3;\n".repeat(1_300_000)));
    for verb in ["check", "fmt"] {
        let outcome = run(folder.path(), &[verb, "long.hyd"]);
        assert_no_panic(&outcome);
        assert_eq!(outcome.code, Some(1));
        assert!(outcome.stderr.contains("bytes; at most"), "{}", outcome.stderr.chars().take(300).collect::<String>());
    }
}
