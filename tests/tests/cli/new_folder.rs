//! `hyd new`: the folder it makes, and its README typed through.

use std::fs;

use crate::process::{Scratch, assert_no_panic, run};

/// Words of a command line; double quotes keep blanks together.
fn words(line: &str) -> Vec<String> {
    line.split('"')
        .enumerate()
        .flat_map(|(k, part)| match k % 2 {
            0 => part.split_whitespace().map(str::to_string).collect::<Vec<_>>(),
            _ => vec![part.to_string()],
        })
        .collect()
}

#[test]
fn the_commands_of_its_readme_run() {
    let scratch = Scratch::new();
    let made = run(scratch.path(), &["new", "lift_valve"]);
    assert_eq!((made.code, made.stderr.as_str()), (Some(0), ""));
    let folder = scratch.path().join("lift_valve");
    let readme = fs::read_to_string(folder.join("README.md")).unwrap();
    let mut fitted = String::new();
    let mut count = 0;
    for line in readme.lines().filter_map(|line| line.strip_prefix("    hyd ")) {
        let words = words(line);
        let arguments: Vec<&str> = words.iter().map(String::as_str).collect();
        let outcome = run(&folder, &arguments);
        assert_no_panic(&outcome);
        assert_eq!(outcome.code, Some(0), "`hyd {line}`\n{}", outcome.stderr);
        // Nothing to complain about and nothing to format in a text that is made here.
        assert!(arguments[0] != "fmt" || outcome.stdout.is_empty(), "{}", outcome.stdout);
        assert!(arguments[0] != "check" || outcome.stderr.is_empty(), "{}", outcome.stderr);
        if arguments[0] == "fit" {
            fitted = outcome.stdout;
        }
        count += 1;
    }
    assert!(count >= 8, "{count} commands in\n{readme}");
    assert!(fs::metadata(folder.join("drive.svg")).unwrap().len() > 5_000);
    // The bench of the README has a spring of 27 kN/m in place of 25; the table shows the factor.
    let spring = fitted.lines().find(|line| line.trim_start().starts_with("k  ")).unwrap_or_else(|| panic!("{fitted}"));
    let values = spring.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
    assert!(values.into_iter().any(|value| (value / 1.08 - 1.0).abs() < 0.01), "{spring}");
}

/// The name stands in texts of three languages, and none of them may take it for more than a name.
#[cfg(unix)]
#[test]
fn a_name_with_quotes_and_backslashes_is_a_name() {
    let scratch = Scratch::new();
    let name = "a\"b\\c {quoted}";
    let made = run(scratch.path(), &["new", name]);
    assert_eq!((made.code, made.stderr.as_str()), (Some(0), ""));
    let folder = scratch.path().join(name);
    let checked = run(&folder, &["check", "drive.hyd"]);
    assert_eq!((checked.code, checked.stderr.as_str()), (Some(0), ""));
    for (p0, table) in [("p0=10e6", "bench/shot1.csv"), ("p0=14e6", "bench/shot2.csv")] {
        let shot = ["simulate", "drive.hyd", "--set", p0, "--variables", "^(y|p)$", "--result", table];
        assert_eq!(run(&folder, &shot).code, Some(0));
    }
    let fitted = run(&folder, &["fit", "bench.toml", "--bench", "bench/set.json"]);
    assert_eq!((fitted.code, fitted.stderr.as_str()), (Some(0), ""));
    assert!(fitted.stdout.starts_with(&format!("{name}: misfit ")), "{}", fitted.stdout);
    let readme = fs::read_to_string(folder.join("README.md")).unwrap();
    assert!(readme.starts_with(&format!("# {name}\n")), "{readme}");
}

#[test]
fn nothing_that_exists_is_touched() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.path().join("full")).unwrap();
    scratch.write("full/drive.hyd", "mine");
    scratch.write("file", "mine");
    for name in ["full", "file"] {
        let outcome = run(scratch.path(), &["new", name]);
        let said = format!("error: `{name}` exists already; nothing was written\n");
        assert_eq!((outcome.code, outcome.stderr), (Some(1), said));
    }
    assert_eq!((scratch.read("full/drive.hyd"), scratch.read("file")), ("mine".to_string(), "mine".to_string()));
    assert_eq!(scratch.names(), ["file", "full"]);
    for name in ["", "..", "_", "42"] {
        let outcome = run(scratch.path(), &["new", name]);
        assert_eq!(outcome.code, Some(2), "{name}: {}", outcome.stderr);
    }
    // An empty folder is as good as none.
    fs::create_dir(scratch.path().join("empty")).unwrap();
    assert_eq!(run(scratch.path(), &["new", "empty"]).code, Some(0));
}
