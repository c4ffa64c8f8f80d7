//! Files of results: names, quoting, digits, and that nothing incomplete stands under a final name.
#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use hyd_system::{NamePattern, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

use crate::{CsvStream, ResultFile, RowFile, RowKind, Side, Sink, Table, Trajectory, format_number, is_variable};

fn variable(name: NamePattern, variability: Variability, places: &[(Place, bool)]) -> VariableInfo {
    VariableInfo {
        name,
        unit: "".into(),
        display_unit: "".into(),
        description: "".into(),
        kind: ValueKind::Real,
        variability,
        settable: Settable::No,
        protected: false,
        sources: places.iter().map(|&(place, negated)| Source { place, negated }).collect(),
    }
}

fn tables() -> Arc<Tables> {
    let array = NamePattern { parts: vec![("a".into(), vec![1]), (".b".into(), vec![1, 2])], derivative: false };
    let rate = NamePattern { derivative: true, ..NamePattern::scalar("x") };
    Arc::new(Tables {
        variables: vec![
            variable(array, Variability::Continuous, &[(Place::Output(0), false), (Place::Output(1), false)]),
            variable(rate, Variability::Continuous, &[(Place::Output(1), true)]),
            variable(NamePattern::scalar("p"), Variability::Parameter, &[(Place::Parameter(0), false)]),
            variable(NamePattern::scalar("c"), Variability::Continuous, &[(Place::Constant(2.5), false)]),
        ],
        ..Tables::default()
    })
}

fn fill(sink: &mut dyn Sink) {
    sink.begin(&tables(), &[7.0]).unwrap();
    sink.row(0.0, &[1.0, 0.1], RowKind::Normal).unwrap();
    sink.row(0.5, &[1e-7, 0.0], RowKind::BeforeEvent).unwrap();
    sink.row(0.5, &[1e300, 1.0 / 3.0], RowKind::AfterEvent).unwrap();
}

const TEXT: &str = "time,\"a[1].b[1,1]\",\"a[1].b[1,2]\",der(x),c\n\
                    0,1,0.1,-0.1,2.5\n0.5,1e-7,0,0,2.5\n0.5,1e300,0.3333333333333333,-0.3333333333333333,2.5\n";

#[test]
fn stream_writes_names_signs_and_shortest_digits() {
    let mut bytes = Vec::new();
    let mut stream = CsvStream::new(&mut bytes, is_variable);
    fill(&mut stream);
    stream.finish().unwrap();
    drop(stream);
    assert_eq!(String::from_utf8(bytes).unwrap(), TEXT);
}

#[test]
fn file_appears_when_whole_and_not_before() {
    let folder = std::env::temp_dir().join(format!("hyd-results-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("run.csv");
    let mut dropped = ResultFile::create(&path, is_variable).unwrap();
    fill(&mut dropped);
    drop(dropped);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0, "an unfinished file leaves nothing");
    let mut file = ResultFile::create(&path, is_variable).unwrap();
    fill(&mut file);
    assert!(!path.exists());
    file.complete().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), TEXT);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    let table = Table::read(&path).unwrap();
    assert_eq!(table.column("der(x)"), Some(&[-0.1, 0.0, -1.0 / 3.0][..]));
    let mut failed = ResultFile::create(&path, is_variable).unwrap();
    fill(&mut failed);
    assert_eq!(failed.partial().unwrap(), Some(folder.join("run.partial.csv")));
    assert!(ResultFile::create(&path, is_variable).unwrap().complete().unwrap().is_none(), "no rows, no file");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn mat_files_read_back_with_signs_and_constants() {
    let folder = std::env::temp_dir().join(format!("hyd-mat-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("run.mat");
    let mut file = ResultFile::create(&path, |_, _| true).unwrap();
    fill(&mut file);
    file.complete().unwrap();
    let table = Table::read(&path).unwrap();
    assert_eq!(table.times, [0.0, 0.5, 0.5]);
    assert_eq!(table.names, ["a[1].b[1,1]", "a[1].b[1,2]", "der(x)"]);
    assert_eq!(table.column("der(x)"), Some(&[-0.1, 0.0, -1.0 / 3.0][..]));
    assert_eq!(table.constants, [("p".to_string(), 7.0), ("c".to_string(), 2.5)]);

    // Whatever is cut off or changed ends in a sentence, not in a wrong table.
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() {
        assert!(Table::from_mat(&whole[..length]).is_err(), "{length} bytes");
    }
    for place in 0..whole.len() {
        let mut broken = whole.clone();
        broken[place] ^= 0xff;
        let _ = Table::from_mat(&broken);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

/// A matrix without elements needs no bytes, whatever its header says of rows and columns.
#[test]
fn a_matrix_cannot_have_more_rows_or_columns_than_the_file_has_bytes() {
    for (rows, columns) in [(u32::MAX, 0), (0, u32::MAX)] {
        let words = [51, rows, columns, 0, 7];
        let mut file: Vec<u8> = words.iter().flat_map(|word: &u32| word.to_le_bytes()).collect();
        file.extend(b"Aclass\0");
        let refused = Table::from_mat(&file).unwrap_err().to_string();
        assert!(refused.contains("`Aclass`") && refused.contains("4294967295"), "{refused}");
    }
}

#[test]
fn a_mat_file_that_is_not_finished_is_readable() {
    let folder = std::env::temp_dir().join(format!("hyd-mat-killed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("run.mat");
    let mut file = ResultFile::create(&path, is_variable).unwrap();
    file.begin(&tables(), &[7.0]).unwrap();
    for k in 0..100_000 {
        file.row(f64::from(k), &[1.0, 2.0], RowKind::Normal).unwrap();
    }
    let temporary = std::fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
    std::fs::copy(&temporary, &path).unwrap();
    std::mem::forget(file);
    let rows = Table::read(&path).unwrap().times.len();
    assert!(rows > 90_000 && rows < 100_000, "{rows}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_full_disk_is_an_error() {
    let full = std::path::Path::new("/dev/full");
    if !full.exists() {
        return;
    }
    let file = std::fs::OpenOptions::new().write(true).open(full).unwrap();
    let mut stream = CsvStream::new(file, is_variable);
    fill(&mut stream);
    assert_eq!(stream.flush().unwrap_err().kind(), std::io::ErrorKind::StorageFull);
}

#[test]
fn trajectory_finds_outputs_aliases_parameters_and_constants() {
    let mut run = Trajectory::new();
    fill(&mut run);
    assert_eq!(run.series("der(x)").unwrap().values(), [-0.1, 0.0, -1.0 / 3.0]);
    assert!((run.series("a[1].b[1,1]").unwrap().value(0.25, Side::After) - 0.500_000_05).abs() < 1e-15);
    assert_eq!(run.series("a[1].b[1,1]").unwrap().value(0.5, Side::Before), 1e-7);
    assert_eq!((run.last("p"), run.last("c")), (Some(7.0), Some(2.5)));
    assert!(run.series("a[2].b[1,1]").is_none());
    assert_eq!(run.table(is_variable), Table::parse(TEXT.as_bytes()).unwrap());
}

proptest::proptest! {
    #[test]
    fn digits_read_back_to_the_same_number(value in proptest::num::f64::NORMAL | proptest::num::f64::SUBNORMAL) {
        digits(value)?;
    }

    /// Where the standard library changes from one notation to the other.
    #[test]
    fn digits_are_those_of_the_standard_library(value in -1.0..1.0f64, exponent in -8..20i32) {
        digits(value * 10f64.powi(exponent))?;
        digits((value * 1e3).round() * 10f64.powi(exponent))?;
    }

    /// Few binary digits, so that texts may be equally close.
    #[test]
    fn digits_halfway_are_those_of_the_standard_library(value in proptest::num::u64::ANY, bits in 1..53u32, halves in -12..1074i32) {
        digits((value >> (64 - bits)) as f64 * 2f64.powi(-halves))?;
    }
}

fn digits(value: f64) -> Result<(), proptest::test_runner::TestCaseError> {
    let mut text = String::new();
    format_number(value, &mut text);
    proptest::prop_assert_eq!(text.parse::<f64>().unwrap(), value);
    let plain = format!("{:?}", value + 0.0);
    proptest::prop_assert_eq!(text.as_str(), plain.strip_suffix(".0").unwrap_or(&plain));
    Ok(())
}

#[test]
fn numbers_out_of_the_ordinary_have_their_texts() {
    let text = |value| {
        let mut text = String::new();
        format_number(value, &mut text);
        text
    };
    assert_eq!(text(2f64.powi(-24)), "5.960464477539063e-8");
    let values = [0.0, -0.0, 1e-5, -1e-5, 9.9999e-5, 1e-4, 1e15, 1e16, -1e300, 5e-324, f64::NAN, f64::INFINITY];
    let texts = "0 0 1e-5 -1e-5 9.9999e-5 0.0001 1000000000000000 1e16 -1e300 5e-324 NaN inf";
    assert_eq!(values.map(text).join(" "), texts);
}
