//! The command as a user meets it: whole outputs, messages, exit codes, files.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// A folder for one test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str, files: &[(&str, &[u8])]) -> Self {
        let root = std::env::temp_dir().join(format!("hyd-command-{name}-{}", std::process::id()));
        fs::create_dir_all(&root).unwrap();
        for (path, bytes) in files {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, bytes).unwrap();
        }
        Self(root)
    }

    fn hyd(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
        command
            .args(arguments)
            .current_dir(&self.0)
            .env_remove("HYD_LIBRARY")
            .env_remove("MODELICAPATH")
            .stdin(Stdio::null());
        command
    }

    /// Exit code, standard output, standard error.
    fn run(&self, arguments: &[&str]) -> (i32, String, String) {
        let output = self.hyd(arguments).output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

const DECAY: &[u8] = b"model Decay
  parameter Real k = 2;
  parameter Integer n = 2;
  final parameter Real f = 1;
  Real x(start = 1, fixed = true, unit = \"m\");
  Real y[n];
equation
  der(x) = -k*x;
  for i in 1:n loop
    y[i] = i*x;
  end for;
end Decay;
";

const EXPLOSION: &[u8] =
    b"model Explosion\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = x*x;\nend Explosion;\n";

const FOREVER: &[u8] = b"model Forever\n  Real x(start = 0, fixed = true);\n  Real y(start = 1, fixed = true);\n\
    equation\n  der(x) = 1e3*y;\n  der(y) = -1e3*x;\nend Forever;\n";

#[test]
fn explanations_are_printed_whole() {
    let folder = Folder::new("explain", &[]);
    let expected = "E0104: the name after `end` differs\n\n\
        A class must end with its own name: `model Pump ... end Pump;`.\n";
    assert_eq!(folder.run(&["explain", "e0104"]), (0, expected.to_string(), String::new()));
    let error = "error: there is no code `nonsense`; `hyd explain` lists all codes\n";
    assert_eq!(folder.run(&["explain", "nonsense"]), (2, String::new(), error.to_string()));
    let (code, list, _) = folder.run(&["explain"]);
    assert_eq!((code, list.lines().next()), (0, Some("E0101  syntax error")));
}

#[test]
fn wrong_usage_is_exit_code_two() {
    let folder = Folder::new("usage", &[("decay.hyd", DECAY), ("r.csv", b"time,x\n0,1\n1,2\n")]);
    let cases: &[(&[&str], &str)] = &[
        (&["sweep", "decay.hyd", "--vary", "k=1"], "error: --result DIR is needed: the folder of the results\n"),
        (&["simulate", "decay.hyd", "--plot", "a.pdf"], "error: `a.pdf`: a picture ends in .svg or .png\n"),
        (&["plot", "r.csv", "-o", "a"], "error: `a`: a picture ends in .svg or .png\n"),
        (&["simulate", "decay.hyd", "--variables", "^q$"], "error: no variable of the model matches `^q$`\n"),
        (&["plot", "r.csv", "--variables", "q"], "error: no variable of these files matches\n"),
        (&["simulate", "decay.hyd", "--tolerance", "3"], "error: the tolerance 3 must lie between 1e-13 and 0.1\n"),
        (
            &["simulate", "decay.hyd", "--stop", "-1"],
            "error: the stop time -1 s must be a number no earlier than the start time 0 s\n",
        ),
    ];
    for (arguments, message) in cases {
        assert_eq!(folder.run(arguments), (2, String::new(), message.to_string()), "{arguments:?}");
    }
    let by_the_parser: &[&[&str]] = &[&[], &["simulte"], &["simulate"], &["check", "decay.hyd", "--set", "k"]];
    for arguments in by_the_parser {
        let (code, out, error) = folder.run(arguments);
        assert_eq!((code, out.as_str(), error.is_empty()), (2, "", false), "{arguments:?}");
    }
    assert_eq!(folder.names(), ["decay.hyd", "r.csv"]);
}

#[test]
fn variables_of_unknown_unit_are_listed_on_request() {
    let text = b"model Open
  Real a(unit = \"m\") = 2;
  Real b = a;
  Real p = 1;
  Real q[3] = fill(1, 3);
end Open;
";
    let folder = Folder::new("unknown_units", &[("open.hyd", text)]);
    let (code, counts, _) = folder.run(&["check", "open.hyd"]);
    let (_, listed, _) = folder.run(&["check", "open.hyd", "--unknown-units"]);
    // `b` has the unit of `a`; of the numbers `p` and `q` nothing says what they measure.
    assert!(code == 0 && counts.contains("variables of unknown unit           4\n"), "{counts}");
    assert_eq!(listed, counts + "unknown unit\n  p\n  q[1] and 2 more of its array\n");
}

#[test]
fn files_that_cannot_be_read_are_diagnostics() {
    let folder = Folder::new("unreadable", &[("bad.hyd", b"model A\n\xE4 end A;"), ("r.csv", b"time,x\n0,a\n")]);
    let cases: &[(&[&str], &str)] = &[
        (&["check", "no.hyd"], "error[E0105]: there is no file `no.hyd`\n\n"),
        (&["check", "."], "error[E0105]: `.` is a folder, not a file\n\n"),
        (&["check", "bad.hyd"], "error[E0105]: `bad.hyd` is not UTF-8 text: byte 8 (line 2) is 0xE4\n\n"),
        (
            &["check", "no.hyd", "--message-format", "json"],
            "{\"severity\":\"error\",\"code\":\"E0105\",\"message\":\"there is no file `no.hyd`\",\"labels\":[],\"notes\":[]}\n",
        ),
        (&["plot", "r.csv"], "error: `r.csv`: line 2, column `x`: `a` is not a number\n"),
    ];
    for (arguments, message) in cases {
        assert_eq!(folder.run(arguments), (1, String::new(), message.to_string()), "{arguments:?}");
    }
    let folder = Folder::new("nolibrary", &[("decay.hyd", DECAY)]);
    let error = "error[E0105]: there is no library folder `lib`\n\n".to_string();
    assert_eq!(folder.run(&["check", "decay.hyd", "--library", "lib"]), (1, String::new(), error));
}

#[test]
fn parameters_are_set_or_refused_with_the_reason() {
    let folder = Folder::new("set", &[("decay.hyd", DECAY)]);
    let last = |arguments: &[&str]| -> serde_json::Value {
        let (code, out, error) =
            folder.run(&[&["simulate", "decay.hyd", "--json", "--tolerance", "1e-9"], arguments].concat());
        assert_eq!((code, error.as_str()), (0, ""));
        serde_json::from_str(&out).unwrap()
    };
    // x = exp(-k t) at t = 1; the global error stays within a hundred tolerances.
    let plain = last(&[]);
    assert!((plain["final"]["x"].as_f64().unwrap() - (-2.0f64).exp()).abs() < 1e-7);
    let set = last(&["--set", "k=0.5", "--set", "n=3"]);
    assert!((set["final"]["y[3]"].as_f64().unwrap() - 3.0 * (-0.5f64).exp()).abs() < 3e-7);
    assert_eq!(plain["status"], "done");
    assert!(plain["final"].get("y[3]").is_none() && plain["counters"]["steps"].as_u64().unwrap() > 0);

    let refused: &[(&str, &str)] = &[
        ("kk=1", "error[E0215]: the model has no parameter `kk`\n = did you mean `k`?\n\n"),
        (
            "x=1",
            "error[E0215]: `x` cannot be set: it is a variable, not a parameter\n  ┌─ decay.hyd:5:8\n  │\n\
             5 │   Real x(start = 1, fixed = true, unit = \"m\");\n  │        - declared here\n\n",
        ),
        (
            "k=true",
            "error[E0217]: `k` cannot be set to `true`: it is a Real and needs a finite number\n  \
             ┌─ decay.hyd:2:18\n  │\n2 │   parameter Real k = 2;\n  │                  - declared here\n\n",
        ),
    ];
    for (set, message) in refused {
        let found = folder.run(&["simulate", "decay.hyd", "--set", set]);
        assert_eq!(found, (1, String::new(), message.to_string()));
    }
    let (code, _, error) = folder.run(&["simulate", "decay.hyd", "--set", "f=2"]);
    assert!(code == 1 && error.contains("`f`") && error.contains("final"), "{error}");
}

#[test]
fn results_and_pictures_are_written_and_drawn_again() {
    let folder = Folder::new("results", &[("decay.hyd", DECAY)]);
    let run = ["simulate", "decay.hyd", "--result", "a.csv", "--plot", "a.svg", "--intervals", "4"];
    let (code, out, error) = folder.run(&run);
    assert_eq!((code, error.as_str()), (0, ""));
    assert!(out.starts_with("Decay: 0 to 1 s, done\n  1 states") && out.contains("results in a.csv\n"), "{out}");
    let csv = fs::read_to_string(folder.0.join("a.csv")).unwrap();
    assert_eq!(csv.lines().next(), Some("time,x,y[1],y[2],der(x)"));
    let times: Vec<&str> = csv.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(times, ["0", "0.25", "0.5", "0.75", "1"]);
    let svg = fs::read_to_string(folder.0.join("a.svg")).unwrap();
    for text in [">x [m]<", ">y[1]<", ">time [s]<", ">Decay<"] {
        assert!(svg.contains(text), "{text} in {svg}");
    }

    let plot = ["plot", "a.csv", "a.csv", "--variables", "x", "--model-file", "decay.hyd", "-o", "b.png"];
    assert_eq!(folder.run(&plot), (0, "picture in b.png\n".to_string(), String::new()));
    assert!(fs::read(folder.0.join("b.png")).unwrap().starts_with(b"\x89PNG\r\n"));
    assert_eq!(folder.names(), ["a.csv", "a.svg", "b.png", "decay.hyd"]);

    let (code, _, error) = folder.run(&["simulate", "decay.hyd", "--result", "no/such/folder.csv"]);
    assert!(code == 1 && error.starts_with("error: `no/such/folder.csv` cannot be written: "), "{error}");
}

#[test]
fn a_solver_that_gives_up_is_exit_code_three() {
    let folder = Folder::new("failure", &[("explosion.hyd", EXPLOSION)]);
    // x = 1/(1 - t) has no value at t = 1.
    let (code, out, error) = folder.run(&["simulate", "explosion.hyd", "--stop", "2", "--result", "a.csv", "--json"]);
    assert_eq!(code, 3, "{error}");
    let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&summary["status"], &summary["result"]), (&"failed".into(), &"a.partial.csv".into()));
    assert!((summary["time"].as_f64().unwrap() - 1.0).abs() < 1e-3, "{out}");
    assert!(error.contains("= results up to there are in a.partial.csv\n"), "{error}");
    assert_eq!(folder.names(), ["a.partial.csv", "explosion.hyd"]);
}

#[test]
fn libraries_come_from_options_and_the_environment() {
    let part = |value: &str| format!("model Part\n  parameter Real v = {value};\nend Part;\n");
    let folder = Folder::new(
        "libraries",
        &[
            ("use.hyd", b"model Use\n  Lib.Part part;\nend Use;\n"),
            ("one/Lib/package.hyd", b"package Lib\nend Lib;\n"),
            ("one/Lib/part.hyd", format!("within Lib;\n{}", part("1")).as_bytes()),
            ("two/lib.mo", format!("package Lib\n{}end Lib;\n", part("2")).as_bytes()),
        ],
    );
    let flat = |library: &[&str], variable: Option<&str>| {
        let mut command = folder.hyd(&[&["equations", "use.hyd", "--stage", "flat"], library].concat());
        command.envs(variable.map(|value| ("HYD_LIBRARY", value)));
        let output = command.output().unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (one, two) = (flat(&["--library", "one"], None), flat(&["--library", "two"], None));
    assert!(one.0 == Some(0) && two.0 == Some(0) && one != two, "{one:?} {two:?}");
    assert_eq!(flat(&[], Some("two")), two);
    assert_eq!(flat(&["--library", "one"], Some("two")), one);
    assert_eq!(flat(&[], None).0, Some(1));
}

/// Libraries as other tools keep them: in `MODELICAPATH`, several versions beside each other, one in a file.
#[test]
fn libraries_have_versions_and_a_common_path() {
    let own = |version: &str, value: &str| {
        format!(
            "package Own annotation(version = \"{version}\");\n  model Part\n    parameter Real v = {value};\n  end Part;\nend Own;\n"
        )
    };
    let user = |version: &str| {
        format!("model Use\n  Own.Part part;\n  annotation(uses(Own(version = \"{version}\")));\nend Use;\n")
    };
    let folder = Folder::new(
        "versions",
        &[
            ("old.mo", user("1.2.0").as_bytes()),
            ("new.mo", user("3.0.0").as_bytes()),
            ("all/Own 1.2.0/package.mo", own("1.2.0", "1").as_bytes()),
            ("all/Own 2.1.0/package.mo", own("2.1.0", "2").as_bytes()),
            ("damaged/package.mo", b"package D \xe4 end D;"),
            ("foreign.mo", b"model M\n  Modelica.Blocks.Sources.Step s;\nend M;\n"),
        ],
    );
    let said = |arguments: &[&str], common: &str| {
        let mut command = folder.hyd(arguments);
        let output = command.env("MODELICAPATH", common).output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let flat = |file: &str| said(&["equations", file, "--stage", "flat"], "nowhere:all");
    let (code, printed, told) = flat("old.mo");
    assert!(code == Some(0) && printed.contains("part.v = 1") && !told.contains("W0203"), "{printed}{told}");
    let (code, printed, told) = flat("new.mo");
    assert!(code == Some(0) && printed.contains("part.v = 2"), "{printed}{told}");
    assert!(told.contains("warning[W0203]: `new.mo` uses `Own` 3.0.0, and 2.1.0 was found in"), "{told}");
    let (code, printed, _) =
        said(&["equations", "new.mo", "--stage", "flat", "--library", "all/Own 1.2.0/package.mo"], "");
    assert!(code == Some(0) && printed.contains("part.v = 1"), "{printed}");
    // A folder that another tool may read does not end a run, and is not passed over in silence.
    let (code, printed, told) = said(&["equations", "new.mo", "--stage", "flat"], "damaged:all");
    assert!(code == Some(0) && printed.contains("part.v = 2"), "{printed}{told}");
    assert!(told.contains("warning[E0105]") && told.contains("(named by `MODELICAPATH`)"), "{told}");
    let (code, _, told) = said(&["check", "foreign.mo"], "");
    assert!(code == Some(1) && told.contains("the Modelica Standard Library is not loaded"), "{told}");
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let folder = Folder::new("pipe", &[("decay.hyd", DECAY)]);
    let arguments = ["equations", "decay.hyd", "--stage", "flat", "--set", "n=20000"];
    let mut child = folder.hyd(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), String::from_utf8(output.stderr).unwrap()), (Some(0), String::new()));
}

#[cfg(unix)]
#[test]
fn control_c_leaves_what_was_computed() {
    let folder = Folder::new("interrupt", &[("forever.hyd", FOREVER)]);
    let arguments = ["simulate", "forever.hyd", "--stop", "1e6", "--result", "a.csv", "--intervals", "100000000"];
    let child = folder.hyd(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // Rows are on their way when the temporary file has grown.
    let growing = || {
        let sizes = fs::read_dir(&folder.0).unwrap().map(|e| e.unwrap()).filter(|e| e.file_name() != "forever.hyd");
        sizes.filter_map(|e| e.metadata().ok()).any(|m| m.len() > 0)
    };
    let start = std::time::Instant::now();
    while !growing() && start.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signal.success());
    let output = child.wait_with_output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{error}");
    assert!(error.contains("makes 100000001 rows") && error.contains("\nerror: interrupted at t = "), "{error}");
    let csv = fs::read_to_string(folder.0.join("a.partial.csv")).unwrap();
    assert!(csv.ends_with('\n') && csv.lines().count() > 2);
    assert_eq!(csv.lines().next(), Some("time,x,y,der(x),der(y)"));
    assert!(csv.lines().all(|line| line.split(',').count() == 5));
    assert_eq!(folder.names(), ["a.partial.csv", "forever.hyd"]);
}

#[test]
fn shells_and_man_learn_all_verbs() {
    let folder = Folder::new("shell", &[]);
    let (_, help, _) = folder.run(&["--help"]);
    let verbs = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let verbs: Vec<&str> =
        verbs.filter_map(|line| line.split_whitespace().next()).filter(|verb| *verb != "help").collect();
    assert!(verbs.len() > 15 && verbs.contains(&"simulate"), "{verbs:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (code, script, error) = folder.run(&["completions", shell]);
        assert_eq!((code, error.as_str()), (0, ""));
        assert!(verbs.iter().all(|verb| script.contains(verb)) && script.contains("tolerance"), "{shell}");
    }
    assert_eq!(folder.run(&["completions", "csh"]).0, 2);
    let (code, said, error) = folder.run(&["man", "-o", "pages"]);
    assert_eq!((code, error.as_str()), (0, ""), "{said}");
    for verb in verbs {
        let page = fs::read_to_string(folder.0.join(format!("pages/hyd-{verb}.1"))).unwrap();
        assert!(page.contains(".SH NAME") && page.contains(".SH OPTIONS"), "{verb}");
    }
}
