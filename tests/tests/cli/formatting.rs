//! `hyd fmt`: files in place, folders, standard input, what is left alone.

use std::fs;
use std::io::Write;
use std::process::Stdio;

use hyd_tests::models::root;

use crate::process::{Scratch, assert_no_panic, command, run};

const LOOSE: &str = "model M // a model\n Real x ; /* kept */\n\n\nequation\n x=1 ;\nend M;";
const NEAT: &str = "model M // a model\n  Real x; /* kept */\n\nequation\n  x = 1;\nend M;\n";

#[test]
fn files_are_formatted_in_place_and_named() {
    let folder = Scratch::new();
    folder.write("loose.hyd", LOOSE);
    folder.write("neat.hyd", NEAT);
    let check = run(folder.path(), &["fmt", "--check", "."]);
    assert_eq!((check.code, check.stdout.as_str(), check.stderr.as_str()), (Some(1), "./loose.hyd\n", ""));
    assert_eq!(folder.read("loose.hyd"), LOOSE);
    let format = run(folder.path(), &["fmt", "loose.hyd", "neat.hyd"]);
    assert_eq!((format.code, format.stdout.as_str(), format.stderr.as_str()), (Some(0), "loose.hyd\n", ""));
    assert_eq!(folder.read("loose.hyd"), NEAT);
    let again = run(folder.path(), &["fmt", "--check", "."]);
    assert_eq!((again.code, again.stdout.as_str()), (Some(0), ""));
    assert_eq!(folder.names(), ["loose.hyd", "neat.hyd"]);
}

#[test]
fn wrong_texts_stay_and_the_others_are_formatted() {
    let folder = Scratch::new();
    let wrong = "model W\n Real x\n y;\nend W;\n";
    fs::create_dir_all(folder.path().join("a/.hidden")).unwrap();
    folder.write("a/wrong.hyd", wrong);
    folder.write("a/loose.hyd", LOOSE);
    folder.write("a/latin.hyd", b"model L\n// \xE9\nend L;\n");
    folder.write("a/other.txt", LOOSE);
    folder.write("a/.hidden/x.hyd", LOOSE);
    let outcome = run(folder.path(), &["fmt", "a", "none.hyd"]);
    assert_no_panic(&outcome);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(1), "a/loose.hyd\n"));
    assert!(outcome.stderr.contains("error[E0101]") && outcome.stderr.contains("a/wrong.hyd:2"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("error[E0105]: `a/latin.hyd` is not UTF-8 text"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("error[E0105]: there is no file `none.hyd`"), "{}", outcome.stderr);
    assert_eq!((folder.read("a/wrong.hyd"), folder.read("a/loose.hyd")), (wrong.to_string(), NEAT.to_string()));
    assert_eq!((folder.read("a/other.txt"), folder.read("a/.hidden/x.hyd")), (LOOSE.to_string(), LOOSE.to_string()));
}

/// Libraries of others are written in `.mo`; a folder without a text of a model is not passed over in silence.
#[test]
fn folders_hold_both_endings_or_it_is_said() {
    let folder = Scratch::new();
    fs::create_dir_all(folder.path().join("lib")).unwrap();
    fs::create_dir_all(folder.path().join("notes")).unwrap();
    folder.write("lib/a.mo", LOOSE);
    folder.write("lib/b.hyd", LOOSE);
    folder.write("notes/other.txt", LOOSE);
    let outcome = run(folder.path(), &["fmt", "lib", "notes"]);
    let said = "warning: there is no .hyd or .mo file in `notes`\n";
    assert_eq!(
        (outcome.code, outcome.stdout.as_str(), outcome.stderr.as_str()),
        (Some(0), "lib/a.mo\nlib/b.hyd\n", said)
    );
    assert_eq!((folder.read("lib/a.mo"), folder.read("lib/b.hyd")), (NEAT.to_string(), NEAT.to_string()));
}

/// Exit code and standard output of `hyd fmt ... -` for a text on standard input.
fn filtered(arguments: &[&str], text: &str) -> (Option<i32>, String) {
    let folder = Scratch::new();
    let mut child = command(folder.path(), arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

#[test]
fn standard_input_goes_to_standard_output() {
    assert_eq!(filtered(&["fmt", "-"], LOOSE), (Some(0), NEAT.to_string()));
    assert_eq!(filtered(&["fmt", "-"], ""), (Some(0), String::new()));
    assert_eq!(filtered(&["fmt", "--check", "-"], NEAT), (Some(0), String::new()));
    assert_eq!(filtered(&["fmt", "--check", "-"], LOOSE), (Some(1), "<stdin>\n".to_string()));
    assert_eq!(filtered(&["fmt", "-"], "model"), (Some(1), String::new()));
    assert_eq!(filtered(&["fmt", "-", "a.hyd"], ""), (Some(2), String::new()));
}

#[cfg(unix)]
#[test]
fn rights_and_links_are_kept() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = Scratch::new();
    folder.write("real.hyd", LOOSE);
    fs::set_permissions(folder.path().join("real.hyd"), PermissionsExt::from_mode(0o640)).unwrap();
    symlink("real.hyd", folder.path().join("link.hyd")).unwrap();
    // A circle of folders must not be followed.
    symlink(".", folder.path().join("circle")).unwrap();
    let outcome = run(folder.path(), &["fmt", "link.hyd"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(0), "link.hyd\n"), "{}", outcome.stderr);
    assert_eq!(folder.read("real.hyd"), NEAT);
    assert!(fs::symlink_metadata(folder.path().join("link.hyd")).unwrap().is_symlink());
    let mode = fs::metadata(folder.path().join("real.hyd")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    let check = run(folder.path(), &["fmt", "--check", "."]);
    assert_eq!((check.code, check.stderr.as_str()), (Some(0), ""));
    // A file that may not be written is left alone, with the reason.
    folder.write("fixed.hyd", LOOSE);
    fs::set_permissions(folder.path().join("fixed.hyd"), PermissionsExt::from_mode(0o440)).unwrap();
    let outcome = run(folder.path(), &["fmt", "fixed.hyd"]);
    assert_eq!((outcome.code, outcome.stdout.as_str()), (Some(1), ""));
    assert_eq!(outcome.stderr.trim_end(), "error[E0105]: `fixed.hyd` cannot be written: it is read-only");
    assert_eq!(folder.read("fixed.hyd"), LOOSE);
}

#[test]
fn the_library_and_the_models_are_formatted() {
    let outcome = run(&root(), &["fmt", "--check", "stdlib", "models"]);
    assert_eq!((outcome.code, outcome.stdout.as_str(), outcome.stderr.as_str()), (Some(0), "", ""));
}
