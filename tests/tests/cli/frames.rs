//! Parquet files: what is written is read back, in part, after a kill, and with a wrong byte.

use std::path::PathBuf;
use std::sync::Arc;

use hyd_frames::{Cells, Frame, FrameWriter, Kind, RunStream};
use hyd_results::{ResultFile, RowKind, Sink};
use hyd_system::{NamePattern, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("hyd-frames-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("made");
    folder
}

/// `x[count]` of outputs, `m[count]` their negatives, `same` an alias of `x[2]`, a parameter and a constant.
fn tables(count: u32) -> Arc<Tables> {
    let variable = |name: &str, sources: Vec<Source>| VariableInfo {
        name: NamePattern { parts: vec![(name.into(), vec![sources.len() as u32])], derivative: false },
        unit: "Pa".into(),
        display_unit: "".into(),
        description: "".into(),
        kind: ValueKind::Real,
        variability: Variability::Continuous,
        settable: Settable::No,
        protected: false,
        sources,
    };
    let outputs = |negated| (0..count).map(|k| Source { place: Place::Output(k), negated }).collect();
    let one = |place, negated| vec![Source { place, negated }];
    let variables = vec![
        variable("x", outputs(false)),
        variable("m", outputs(true)),
        variable("same", one(Place::Output(1), false)),
        variable("p", one(Place::Parameter(0), true)),
        variable("c", one(Place::Constant(2.5), false)),
    ];
    Arc::new(Tables { model: "M".into(), variables, ..Tables::default() })
}

/// The value of output `k` in a row; output 3 changes only late.
fn output(k: u32, row: u32) -> f64 {
    match k {
        3 => f64::from(row / 500),
        _ => f64::from(k) + (f64::from(row) * 0.01).sin(),
    }
}

fn numbers<'a>(frame: &'a Frame, name: &str) -> &'a [f64] {
    match frame.column(name) {
        Some(Cells::Numbers(values)) => values,
        other => panic!("{name}: {other:?}"),
    }
}

/// Columns of a few numbers are not compressed, others beside them and in other row groups are.
#[test]
fn columns_of_every_length_come_back() {
    let folder = scratch("lengths");
    let path = folder.join("l.parquet");
    let columns = [("x", Kind::Number), ("zero", Kind::Number), ("n", Kind::Whole), ("word", Kind::Text)];
    let group = |rows: usize| {
        let word = |k: usize| if k.is_multiple_of(7) { "a longer word ".repeat(9) } else { String::new() };
        [
            Cells::Numbers((0..rows).map(|k| (k as f64).sqrt()).collect()),
            Cells::Numbers(vec![0.0; rows]),
            Cells::Wholes((0..rows as i64).map(|k| k * k - 5).collect()),
            Cells::Texts((0..rows).map(word).collect()),
        ]
    };
    let lengths = [1, 31, 32, 33, 1000, 2, 200_000, 3];
    let mut writer =
        FrameWriter::new(std::fs::File::create(&path).expect("made"), columns.into_iter(), &[]).expect("begun");
    for rows in lengths {
        writer.group(&group(rows)).expect("written");
    }
    writer.finish().expect("finished");
    let frame = Frame::read(&path).expect("readable");
    let (x, mut from) = (numbers(&frame, "x"), 0);
    for rows in lengths {
        let [Cells::Numbers(expected), _, Cells::Wholes(whole), Cells::Texts(words)] = group(rows) else { panic!() };
        assert_eq!(x[from..from + rows], expected, "{rows}");
        let (Some(Cells::Wholes(own)), Some(Cells::Texts(texts))) = (frame.column("n"), frame.column("word")) else {
            panic!()
        };
        assert!(own[from..from + rows] == whole && texts[from..from + rows] == words, "{rows}");
        from += rows;
    }
    assert_eq!(x.len(), from);
    assert!(numbers(&frame, "zero").iter().all(|&zero| zero == 0.0));
    std::fs::remove_dir_all(&folder).expect("removed");
}

/// More rows than memory keeps, of a model so wide that a row group passes through a scratch file.
#[test]
fn wide_runs_pass_through_a_scratch_file_and_come_back() {
    let folder = scratch("wide");
    let (path, columns, rows) = (folder.join("r.parquet"), 7001u32, 700u32);
    let mut file =
        ResultFile::with(&path, |file| Ok(Box::new(RunStream::new(file, &path, |_, _| true)))).expect("made");
    file.begin(&tables(columns), &[7.0]).expect("begun");
    for row in 0..rows {
        let values: Vec<f64> = (0..columns).map(|k| output(k, row)).collect();
        file.row(f64::from(row), &values, RowKind::Normal).expect("written");
    }
    file.complete().expect("finished");
    assert_eq!(std::fs::read_dir(&folder).expect("listed").count(), 1, "nothing is left behind");
    let wanted = ["time", "x[1]", "x[4]", "x[7001]", "m[4]", "m[17]", "m[6999]", "same[1]", "p[1]", "c[1]"];
    let frame = Frame::read_columns(&path, |name| wanted.contains(&name)).expect("readable");
    assert_eq!(frame.columns.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), wanted);
    let expected = |name: &str, row: u32| match name {
        "time" => f64::from(row),
        "same[1]" => output(1, row),
        "p[1]" => -7.0,
        "c[1]" => 2.5,
        name => {
            let k: u32 = name[2..name.len() - 1].parse().expect("a subscript");
            if name.starts_with('m') { -output(k - 1, row) } else { output(k - 1, row) }
        }
    };
    for name in wanted {
        let values: Vec<f64> = (0..rows).map(|row| expected(name, row)).collect();
        assert!(numbers(&frame, name) == values, "{name}");
    }
    // 14,006 columns of 700 numbers, of whose bytes a third hardly changes.
    let size = std::fs::metadata(&path).expect("there").len();
    assert!(size < 8 * 14_006 * 700 * 3 / 4, "{size} bytes");
    std::fs::remove_dir_all(&folder).expect("removed");
}

/// A process that is killed leaves the row groups up to then.
#[test]
fn a_file_that_is_not_finished_is_readable() {
    let path = scratch("killed").join("r.parquet");
    let file = std::fs::File::create(&path).expect("made");
    let mut writer = FrameWriter::new(file, [("a", Kind::Number)].into_iter(), &[]).expect("begun");
    let group = |first: u32| Cells::Numbers((first..first + 1000).map(|k| f64::from(k).sqrt()).collect());
    for k in 0..3 {
        writer.group(&[group(1000 * k)]).expect("written");
        let frame = Frame::read(&path).expect("readable");
        assert_eq!(frame.rows(), 1000 * (k as usize + 1));
        assert_eq!(numbers(&frame, "a")[1000 * k as usize], f64::from(1000 * k).sqrt());
    }
    let before = std::fs::metadata(&path).expect("there").len();
    writer.finish().expect("finished");
    assert_eq!(std::fs::metadata(&path).expect("there").len(), before, "the table of contents stands there once");
    assert_eq!(Frame::read(&path).expect("readable").rows(), 3000);
    // Without any rows, too.
    let file = std::fs::File::create(&path).expect("made");
    let mut writer = FrameWriter::new(file, [("a", Kind::Text)].into_iter(), &[]).expect("begun");
    writer.group(&[Cells::Texts(Vec::new())]).expect("written");
    writer.finish().expect("finished");
    assert_eq!(Frame::read(&path).expect("readable").rows(), 0);
    std::fs::remove_dir_all(path.parent().expect("a folder")).expect("removed");
}

/// Whatever byte is wrong, the file is read or refused.
#[test]
fn a_wrong_byte_is_no_panic() {
    let path = std::env::temp_dir().join(format!("hyd-frame-{}.parquet", std::process::id()));
    let columns = [("time", Kind::Number), ("shot", Kind::Whole), ("note", Kind::Text)];
    let file = std::fs::File::create(&path).expect("made");
    let mut writer = FrameWriter::new(file, columns.into_iter(), &[("key".into(), "value".into())]).expect("begun");
    let cells = [
        Cells::Numbers(vec![0.0, 0.5, 1.0]),
        Cells::Wholes(vec![1, 2, 3]),
        Cells::Texts(["a", "", "long"].map(String::from).to_vec()),
    ];
    writer.group(&cells).expect("written");
    writer.finish().expect("written");
    assert_eq!(Frame::read(&path).expect("whole").column("shot"), Some(&cells[1]));
    let whole = std::fs::read(&path).expect("readable");
    let mut refused = 0;
    for at in 0..whole.len() {
        for wrong in [0, 0x7f, 0xff, whole[at] ^ 1] {
            let mut bytes = whole.clone();
            bytes[at] = wrong;
            std::fs::write(&path, bytes).expect("written");
            refused += usize::from(Frame::read(&path).is_err());
        }
    }
    assert!(refused > whole.len() / 2, "{refused} of {}", 4 * whole.len());
    std::fs::remove_file(&path).expect("removed");
}
