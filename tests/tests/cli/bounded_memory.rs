//! Tables without sense are refused within the memory that they take themselves, and results with endless lines within less.
#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{BufWriter, Write};
use std::process::Command;

use crate::process::{Scratch, run};

/// Runs the program with so much address space (MB) and no more; exit code and standard error.
fn within(folder: &Scratch, space: u64, arguments: &[&str]) -> (Option<i32>, String) {
    let script = format!("ulimit -v {} && exec \"$0\" \"$@\"", space << 10);
    let mut command = Command::new("sh");
    command.args(["-c", &script, env!("CARGO_BIN_EXE_hyd-under-test")]).args(arguments);
    let output = command
        .current_dir(folder.path())
        .env_remove("HYD_LIBRARY")
        .env_remove("MODELICAPATH")
        .env("NO_COLOR", "1")
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A file of a header and then the same bytes until it has so many MB.
fn filled(folder: &Scratch, name: &str, header: &str, piece: &str, size: usize) {
    let mut file = BufWriter::new(File::create(folder.path().join(name)).unwrap());
    file.write_all(header.as_bytes()).unwrap();
    let block = piece.repeat((1 << 20) / piece.len());
    (0..size).for_each(|_| file.write_all(block.as_bytes()).unwrap());
}

/// 100 MB of a table of shots.
#[test]
fn tables_of_shots_are_refused_cheaply() {
    let folder = Scratch::new();
    assert_eq!(run(folder.path(), &["new", "drv"]).code, Some(0));
    let set = folder.read("drv/bench/set.json");
    let fit = ["fit", "drv/bench.toml", "--bench", "drv/bench/set.json"];
    for (header, piece, message) in [
        ("time,y,p\n", "\n", "`shot1.csv`: 0 rows are too few: a shot has at least 20"),
        ("time,y,p\n", "\r\n", "`shot1.csv`: 0 rows are too few: a shot has at least 20"),
        ("time,y,p", ",", "`shot1.csv`: line 1 is longer than 1 MB"),
        ("time,y,p\n0,1,2\n", "0", "`shot1.csv`: line 3 is longer than 1 MB"),
        ("time,y,p\n\"", "\n", "`shot1.csv`: line 2 has 1 field, and the header 3"),
    ] {
        filled(&folder, "drv/bench/shot1.csv", header, piece, 100);
        // The text itself, what one line of it may take, and the program.
        let (code, said) = within(&folder, 400, &fit);
        assert_eq!((code, said.lines().next()), (Some(1), Some(format!("error: {message}").as_str())), "{said}");
    }
    folder.write("drv/bench/set.json", set.replace('{', &format!("{}{{", " ".repeat(5 << 20))));
    let (code, said) = within(&folder, 400, &fit);
    assert_eq!((code, said.as_str()), (Some(1), "error: `drv/bench/set.json`: it is longer than 4 MB, as no set is\n"));
}

/// 300 MB of a result that is compared; ends of lines alone take nothing.
#[test]
fn results_with_endless_lines_are_refused_cheaply() {
    let folder = Scratch::new();
    for (header, piece, message) in [
        ("time,x", ",a", "`r.csv`: line 1 has more than 4194304 fields"),
        ("time,x\n0,1", "0", "`r.csv`: line 2 is longer than 256 MB"),
        ("time,x\n", "\n", "`r.csv` has no rows"),
    ] {
        filled(&folder, "r.csv", header, piece, 300);
        let (code, said) = within(&folder, 900, &["compare", "r.csv", "r.csv"]);
        assert_eq!((code, said), (Some(1), format!("error: {message}\n")));
    }
}
