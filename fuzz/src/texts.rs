//! What cases are made from: the repository's own texts, tables, studies, and files made from them.

use std::path::{Path, PathBuf};

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_frames::{Cells, FrameWriter, Kind};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Contents of the files below some folders whose names end so; large ones are left out.
fn files(folders: &[&str], ends: &[&str]) -> Vec<Vec<u8>> {
    let mut open: Vec<PathBuf> = folders.iter().map(|folder| root().join(folder)).collect();
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if ends.iter().any(|end| path.to_string_lossy().ends_with(end)) {
                found.push(path);
            }
        }
    }
    found.sort();
    let read = found.iter().filter_map(|path| std::fs::read(path).ok());
    read.filter(|content| content.len() < 20_000).collect()
}

pub(crate) fn models() -> Vec<Vec<u8>> {
    files(&["tests/language", "tests/numerics", "tests/cases", "tests/stdlib", "models", "stdlib"], &[".hyd"])
}

pub(crate) fn tables() -> Vec<Vec<u8>> {
    let mut texts = files(&["tests"], &[".csv", ".mat"]);
    texts.push(b"time,x,\"a[1,2].b\"\n0,1,2\n0.5,1e-3,nan\n1,,\n".to_vec());
    texts
}

pub(crate) fn studies() -> Vec<Vec<u8>> {
    // Templates of `hyd new` become texts as soon as their names are strings.
    let filled = |text: Vec<u8>| {
        String::from_utf8_lossy(&text).replace("{quoted}", "\"drive\"").replace("{Class}", "Drive").into_bytes()
    };
    let files = |folders: &[&str], ends: &[&str]| files(folders, ends).into_iter().map(filled).collect::<Vec<_>>();
    let studies = files(&["models", "cli/src/new"], &["bench.toml", "bench.toml.txt"]);
    let sets = files(&["tests/data/bench", "cli/src/new"], &[".json", "set.json.txt"]);
    let joined = studies.iter().flat_map(|study| sets.iter().map(|set| [study, b"\n-----\n".as_slice(), set].concat()));
    joined.collect()
}

/// Small tables with every kind of column.
pub(crate) fn frames() -> Vec<Vec<u8>> {
    let path = std::env::temp_dir().join(format!("hyd-fuzz-text-{}.parquet", std::process::id()));
    let columns = |rows: usize| {
        let numbers = (0..rows).map(|k| k as f64 * 0.5).collect();
        let texts = (0..rows).map(|k| format!("text {}", k % 3)).collect();
        [Cells::Numbers(numbers), Cells::Wholes((0..rows as i64).collect()), Cells::Texts(texts)]
    };
    let make = |rows: usize| {
        let file = std::fs::File::create(&path).ok()?;
        let names = [("time", Kind::Number), ("n", Kind::Whole), ("status", Kind::Text)];
        let metadata = [("model".to_string(), "M".to_string())];
        let mut writer = FrameWriter::new(file, names.into_iter(), &metadata).ok()?;
        for _ in 0..2 {
            writer.group(&columns(rows)).ok()?;
        }
        writer.finish().ok()?;
        std::fs::read(&path).ok()
    };
    let made = [1, 40, 1000].into_iter().filter_map(make).collect();
    let _ = std::fs::remove_file(&path);
    made
}

/// Models as `hyd build` stores them: with events, arrays, a delay.
pub(crate) fn payloads() -> Vec<Vec<u8>> {
    const MODELS: [&str; 3] = [
        "model A\n  parameter Real k(unit = \"1/s\", min = 0) = 1 \"Rate\";\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -k*x;\nend A;\n",
        "model B\n  parameter Integer n = 3;\n  Real x[n](each start = 1, each fixed = true);\n  discrete Real c(start = 0, fixed = true);\nequation\n  for i in 1:n loop\n    der(x[i]) = -i*x[i];\n  end for;\n  when x[1] < 0.5 then\n    c = pre(c) + 1;\n    reinit(x[2], 2);\n  end when;\n  assert(x[3] > -1, \"x is \" + String(x[3]));\nend B;\n",
        "model C\n  Real x(start = 1, fixed = true), y;\nequation\n  der(x) = -delay(x, 0.1);\n  exp(y) + y = x + 2;\nend C;\n",
    ];
    let made = |text: &&str| -> Option<Vec<u8>> {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
        let compilation: Compilation = compile(&mut LibraryPath::new(), "case.hyd", text, &options);
        Some(hyd_payload::format::write(compilation.model?.payload()))
    };
    MODELS.iter().filter_map(made).collect()
}
