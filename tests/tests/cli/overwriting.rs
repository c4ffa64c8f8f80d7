//! No verb writes over a file that it reads, whatever it is called; a run that ends early leaves the older results alone.
#![cfg(unix)]

use std::os::unix::fs::symlink;
use std::time::Duration;

use crate::process::{Scratch, command, run, wait};

const READER: &str = "model M
  function column
    input String file;
    input String name;
    output Real values[:];
  external \"hyd\" values = csvColumn(file, name);
  end column;
  parameter Real a[:] = column(\"data.csv\", \"p\");
  Real x = a[1]*time;
end M;
";
const DATA: &str = "time,p\n0,1\n1,2\n";

fn folder() -> Scratch {
    let folder = Scratch::new();
    folder.write("m.hyd", READER);
    folder.write("data.csv", DATA);
    folder.write("set.txt", "p = 1\n");
    let path = folder.path();
    std::fs::create_dir(path.join("sub")).unwrap();
    symlink("m.hyd", path.join("page.html")).unwrap();
    symlink("../data.csv", path.join("sub/soft.csv")).unwrap();
    std::fs::hard_link(path.join("data.csv"), path.join("hard.csv")).unwrap();
    std::fs::hard_link(path.join("m.hyd"), path.join("exe")).unwrap();
    symlink("data.csv", path.join("picture.svg")).unwrap();
    folder
}

#[test]
fn no_verb_writes_over_what_it_reads() {
    let folder = folder();
    // What is run, and both names of the file.
    let cases: [(&[&str], &str, &str); 12] = [
        (&["equations", "m.hyd", "--html", "m.hyd"], "m.hyd", "m.hyd"),
        (&["equations", "m.hyd", "--html", "page.html"], "page.html", "m.hyd"),
        (&["equations", "m.hyd", "--html", "data.csv"], "data.csv", "data.csv"),
        (&["simulate", "m.hyd", "--result", "data.csv"], "data.csv", "data.csv"),
        (&["simulate", "m.hyd", "--result", "sub/../data.csv"], "sub/../data.csv", "data.csv"),
        (&["simulate", "m.hyd", "--result", "sub/soft.csv"], "sub/soft.csv", "data.csv"),
        (&["simulate", "m.hyd", "--result", "hard.csv"], "hard.csv", "data.csv"),
        (&["simulate", "m.hyd", "--plot", "picture.svg"], "picture.svg", "data.csv"),
        (&["simulate", "m.hyd", "--result", "exe"], "exe", "m.hyd"),
        (&["plot", "data.csv", "--output", "picture.svg"], "picture.svg", "data.csv"),
        (&["build", "m.hyd", "-o", "exe"], "exe", "m.hyd"),
        (&["doc", ".", "--no-pictures", "--output", "exe"], "exe", "m.hyd"),
    ];
    for (arguments, written, read) in cases {
        let outcome = run(folder.path(), arguments);
        assert!(matches!(outcome.code, Some(1 | 2)), "{arguments:?}: {:?} {}", outcome.code, outcome.stderr);
        let said = outcome.stderr;
        assert!(said.contains(&format!("`{written}`")), "{arguments:?}: {said}");
        // The file is named as the reader found it, perhaps by its folder.
        assert!(said.contains(&format!("{read}`, which this command reads")), "{arguments:?}: {said}");
        assert_eq!((folder.read("m.hyd").as_str(), folder.read("data.csv").as_str()), (READER, DATA), "{arguments:?}");
        assert!(folder.names().iter().all(|name| !name.ends_with(".part")), "{arguments:?}");
    }
    // Source texts that are not read are not replaced by anything else, either.
    folder.write("other.hyd", READER);
    for arguments in [
        &["equations", "m.hyd", "--html", "other.hyd"][..],
        &["doc", "sub", "--no-pictures", "--output", "other.hyd"],
        &["simulate", "m.hyd", "--result", "other.hyd"],
        &["build", "m.hyd", "-o", "other.hyd"],
    ] {
        let outcome = run(folder.path(), arguments);
        assert!(matches!(outcome.code, Some(1 | 2)), "{arguments:?}: {}", outcome.stderr);
        assert_eq!(folder.read("other.hyd"), READER, "{arguments:?}");
    }
    // The one writing over what was read that is meant.
    folder.write("untidy.hyd", "model   U end U;");
    assert_eq!(run(folder.path(), &["fmt", "untidy.hyd"]).code, Some(0));
    assert_eq!(folder.read("untidy.hyd"), "model U\nend U;\n");
}

#[test]
fn an_interrupted_run_leaves_the_older_results() {
    let folder = Scratch::new();
    folder
        .write("decay.hyd", "model Decay\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\nend Decay;\n");
    folder.write("r.csv", "older results\n");
    folder.write("r.svg", "older picture\n");
    let arguments =
        ["simulate", "decay.hyd", "--stop", "1e3", "--intervals", "100000000", "--result", "r.csv", "--plot", "r.svg"];
    let mut child = command(folder.path(), &arguments)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    while !folder.names().iter().any(|name| name.ends_with(".part")) {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(wait(&mut child, &arguments).code(), Some(3));
    assert_eq!((folder.read("r.csv").as_str(), folder.read("r.svg").as_str()), ("older results\n", "older picture\n"));
    assert_eq!(folder.names(), ["decay.hyd", "r.csv", "r.partial.csv", "r.partial.svg", "r.svg"]);
}

/// A part of a run is not the run, nor is a result without one of its variables.
#[test]
fn a_part_differs_from_the_whole() {
    let folder = Scratch::new();
    folder.write("whole.csv", "time,x,y\n0,0,1\n1,1,1\n2,2,1\n");
    folder.write("part.csv", "time,x,y\n0,0,1\n1,1,1\n");
    folder.write("late.csv", "time,x,y\n1,1,1\n2,2,1\n");
    folder.write("lacking.csv", "time,x\n0,0\n1,1\n2,2\n");
    folder.write("other.csv", "time,x,y\n0,0,1\n1,1.5,1\n2,2,1\n");
    folder.write("nearly.csv", "time,x,y\n0,0,1\n1,1,1\n1.99999,2,1\n");
    let code = |arguments: &[&str]| run(folder.path(), &[&["compare", "whole.csv"], arguments].concat()).code;
    for file in ["part.csv", "late.csv", "lacking.csv"] {
        assert_eq!(code(&[file]), Some(1), "{file}");
        assert_eq!(code(&[file, "--json"]), Some(1), "{file}");
        assert_eq!(code(&[file, "--common"]), Some(0), "{file}");
    }
    assert_eq!(
        (code(&["whole.csv"]), code(&["nearly.csv"]), code(&["other.csv", "--common"])),
        (Some(0), Some(0), Some(1))
    );
    // What is not asked for is not a difference.
    assert_eq!(code(&["lacking.csv", "--variables", "x"]), Some(0));
    let said = run(folder.path(), &["compare", "whole.csv", "part.csv"]).stdout;
    assert!(said.contains("part.csv covers 0 to 1 s") && said.contains("--common"), "{said}");
    let said = run(folder.path(), &["compare", "whole.csv", "lacking.csv", "--json"]).stdout;
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!((said["status"].as_str(), said["only_first"][0].as_str()), (Some("different"), Some("y")));
}
