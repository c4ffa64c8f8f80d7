//! Texts that cannot be read, or hold nothing, or too much of it.

use crate::process::{Scratch, assert_no_panic, names, run};

/// Runs `hyd check NAME` and expects exit code 1 with this message.
#[track_caller]
fn refused(folder: &Scratch, name: &str, message: &str) {
    let outcome = run(folder.path(), &["check", name]);
    assert_no_panic(&outcome);
    assert_eq!(outcome.stderr.trim_end(), message);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(1), ""));
}

#[test]
fn files_that_cannot_be_read_are_named_with_the_reason() {
    let folder = Scratch::new();
    std::fs::create_dir(folder.path().join("folder.hyd")).unwrap();
    folder.write("latin.hyd", b"model M\n  Real x = 1; // \xFF\nend M;\n");
    folder.write("wide.hyd", b"\xFF\xFEm\0o\0d\0");
    folder.write("plain", "x");
    refused(&folder, "none.hyd", "error[E0105]: there is no file `none.hyd`");
    refused(&folder, "none/none.hyd", "error[E0105]: there is no file `none/none.hyd`");
    refused(&folder, "folder.hyd", "error[E0105]: `folder.hyd` is a folder, not a file");
    refused(&folder, "latin.hyd", "error[E0105]: `latin.hyd` is not UTF-8 text: byte 25 (line 2) is 0xFF");
    refused(&folder, "wide.hyd", "error[E0105]: `wide.hyd` is not UTF-8 text: byte 0 (line 1) is 0xFF");
    let outcome = run(folder.path(), &["check", "plain/x.hyd"]);
    assert!(outcome.stderr.starts_with("error[E0105]: `plain/x.hyd` cannot be read: "), "{}", outcome.stderr);
    assert_eq!(outcome.code, Some(1));
}

#[cfg(unix)]
#[test]
fn an_unreadable_file_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Scratch::new();
    folder.write("secret.hyd", "model M end M;");
    let path = folder.path().join("secret.hyd");
    std::fs::set_permissions(&path, PermissionsExt::from_mode(0o000)).unwrap();
    // Who may read everything cannot be refused.
    if std::fs::read(&path).is_err() {
        let outcome = run(folder.path(), &["check", "secret.hyd"]);
        assert!(outcome.stderr.starts_with("error[E0105]: `secret.hyd` cannot be read: "), "{}", outcome.stderr);
        assert_eq!(outcome.code, Some(1));
    }
}

#[test]
fn a_file_without_a_model_is_named() {
    let folder = Scratch::new();
    folder.write("empty.hyd", "");
    folder.write("byte_order_mark.hyd", "\u{FEFF}");
    folder.write("remark.hyd", "// nothing\n/* at all */\n");
    for name in ["empty.hyd", "byte_order_mark.hyd", "remark.hyd"] {
        refused(&folder, name, &format!("error[E0202]: `{name}` holds no model: it is empty"));
    }
}

#[test]
fn nesting_and_length_have_limits_and_no_stack_overflows() {
    let folder = Scratch::new();
    let deep = |n: usize| format!("model M\n  Real x = {}1{};\nend M;\n", "(".repeat(n), ")".repeat(n));
    let long = format!("model M\n  Real x = 1{};\nend M;\n", " + 1".repeat(100_000));
    let ifs = format!("model M\n  Real x = {}0;\nend M;\n", "if time > 1 then 1 else ".repeat(5000));
    let classes = format!("{}{}", "model M\n".repeat(5000), "end M;\n".repeat(5000));
    let blocks =
        format!("model M\nequation\n{}{}end M;\n", "for i in 1:2 loop\n".repeat(5000), "end for;\n".repeat(5000));
    let texts = [deep(100_000), long, ifs, classes, blocks, "(".repeat(1_000_000), "model M ".repeat(20_000)];
    for (k, text) in texts.iter().enumerate() {
        folder.write("deep.hyd", text);
        let outcome = run(folder.path(), &["check", "deep.hyd"]);
        assert_no_panic(&outcome);
        assert_eq!(outcome.code, Some(1), "text {k}: {}", outcome.stderr.chars().take(500).collect::<String>());
        assert!(outcome.stderr.starts_with("error[E0"), "text {k}");
    }
}

#[test]
fn what_is_not_a_library_is_refused() {
    let folder = Scratch::new();
    folder.write("m.hyd", "model M\nend M;\n");
    let outcome = run(folder.path(), &["check", "m.hyd", "--library", "none"]);
    assert_eq!((outcome.code, outcome.stderr.trim_end()), (Some(1), "error[E0105]: there is no library folder `none`"));
    folder.write("notes.txt", "");
    let outcome = run(folder.path(), &["check", "m.hyd", "--library", "notes.txt"]);
    let expected = "error[E0105]: `notes.txt` is not a library: it is neither a folder nor a `.mo` or `.hyd` file";
    assert_eq!((outcome.code, outcome.stderr.trim_end()), (Some(1), expected));
}

#[test]
fn wrong_usage_is_told_from_a_wrong_model() {
    let folder = Scratch::new();
    folder.write("m.hyd", "model M\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -x;\nend M;\n");
    let cases: &[&[&str]] = &[
        &[],
        &["solve"],
        &["check"],
        &["check", ""],
        &["simulate", "m.hyd", "--stop", "soon"],
        &["simulate", "m.hyd", "--stop", "nan"],
        &["simulate", "m.hyd", "--stop", "-1"],
        &["simulate", "m.hyd", "--tolerance", "0"],
        &["simulate", "m.hyd", "--tolerance", "-1"],
        &["simulate", "m.hyd", "--intervals", "-3"],
        &["simulate", "m.hyd", "--intervals", "2", "--every-step"],
        &["simulate", "m.hyd", "--solver", "euler"],
        &["simulate", "m.hyd", "--variables", "["],
        &["simulate", "m.hyd", "--variables", "nothing"],
        &["simulate", "m.hyd", "--plot", "p.jpg"],
        &["compare", "m.hyd"],
        &["compare", "a.csv", "b.csv", "--tolerance", "-1"],
        &["simulate", "m.hyd", "--set", "x"],
        &["equations", "m.hyd", "--stage", "last"],
        &["explain", "E9999"],
    ];
    for arguments in cases {
        let outcome = run(folder.path(), arguments);
        assert_no_panic(&outcome);
        assert_eq!(outcome.code, Some(2), "{arguments:?}: {}", outcome.stderr);
        assert!(!outcome.stderr.is_empty(), "{arguments:?}");
        assert_eq!(outcome.stdout, "", "{arguments:?}");
    }
    assert_eq!(names(folder.path()), ["m.hyd"]);
}

/// A model that reads a matrix of a MAT file, size and all, with the external functions that the standard library declares.
const READS_MATRIX: &str = r#"model Reads
  function sizes
    input String file;
    input String name;
    output Integer dim[2];
  external "C" ModelicaIO_readMatrixSizes(file, name, dim);
  end sizes;
  function read
    input String file;
    input String name;
    input Integer rows;
    input Integer columns;
    output Real matrix[rows, columns];
  external "C" ModelicaIO_readRealMatrix(file, name, matrix, size(matrix, 1), size(matrix, 2), true);
  end read;
  final parameter Integer dim[2] = sizes("data.mat", "NAME");
  final parameter Real a[:, :] = read("data.mat", "NAME", dim[1], dim[2]);
  Real last = a[dim[1], dim[2]];
end Reads;
"#;

#[test]
fn matrices_of_mat_files_are_read() {
    let folder = Scratch::new();
    let mut file = hyd_results::Matrices::new();
    file.matrix("tab", &[vec![1.0, 0.1], vec![2.0, 1.0 / 3.0], vec![3.0, -2.5e-7]], 2);
    std::fs::write(folder.path().join("data.mat"), file.bytes()).expect("written");
    folder.write("reads.mo", READS_MATRIX.replace("NAME", "tab"));
    let outcome = run(folder.path(), &["simulate", "reads.mo", "--json"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let summary: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("a summary");
    assert_eq!(summary["final"]["last"].as_f64(), Some(-2.5e-7), "{summary}");
    folder.write("reads.mo", READS_MATRIX.replace("NAME", "table"));
    let outcome = run(folder.path(), &["simulate", "reads.mo"]);
    assert_eq!(outcome.code, Some(1));
    assert!(outcome.stderr.contains("there is no table `table`; its tables are tab"), "{}", outcome.stderr);
    std::fs::write(folder.path().join("data.mat"), "no numbers").expect("written");
    let outcome = run(folder.path(), &["simulate", "reads.mo"]);
    assert!(outcome.code == Some(1) && outcome.stderr.contains("data.mat"), "{}", outcome.stderr);
}
