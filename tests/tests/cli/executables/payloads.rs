//! Payloads as bytes: read back they are the same, and whatever is damaged, cut off or foreign is refused with a message.

use std::fs;

use hyd_compiler::Goal;
use hyd_payload::format::{self, FormatError};
use hyd_tests::models::{compile_file, model_files};

use super::scratch::{Scratch, messages};

fn payload() -> Vec<u8> {
    let compilation = compile_file("models/single_acting_drive/drive.hyd", &[], Goal::Run);
    format::write(compilation.model.unwrap().payload())
}

#[test]
fn what_is_read_is_written_again_to_the_byte() {
    for file in model_files().iter().step_by(5) {
        let compilation = compile_file(file, &[], Goal::Run);
        let Some(model) = compilation.model else { continue };
        let bytes = format::write(model.payload());
        assert!(format::write(&format::read(&bytes, true).unwrap()) == bytes, "{file}");
    }
}

#[test]
fn every_damaged_byte_and_every_cut_is_noticed() {
    let bytes = payload();
    // A prime step, so that all kinds of fields are hit.
    for position in (0..bytes.len()).step_by(211) {
        let mut damaged = bytes.clone();
        damaged[position] ^= 1 << (position % 8);
        assert!(format::read(&damaged, true).is_err(), "byte {position}");
        assert!(format::read(&bytes[..position], true).is_err(), "cut at {position}");
    }
    assert!(format::read(&[&bytes[..], b"x"].concat(), true).is_err());
    let changed = |position: usize, value: u32| {
        let mut bytes = bytes.clone();
        bytes[position..position + 4].copy_from_slice(&value.to_le_bytes());
        format::read(&bytes, true).unwrap_err()
    };
    assert_eq!(changed(8, 99), FormatError::Version(99));
    assert_eq!(changed(0, 0), FormatError::Foreign);
    assert_eq!(changed(12, 77), FormatError::Damaged);
}

#[test]
fn executables_say_what_is_wrong_with_them() {
    let scratch = Scratch::new();
    fs::write(scratch.file("m.hyd"), "model M\n  Real x = time;\nend M;\n").unwrap();
    assert!(scratch.hyd(&["build", "m.hyd", "-o", "m"]).status.success());
    assert_eq!(scratch.bare("m", &[]).status.code(), Some(0));
    let whole = fs::read(scratch.file("m")).unwrap();
    let mut damaged = whole.clone();
    let middle = damaged.len() - 300;
    damaged[middle] ^= 4;
    let cases = [
        (damaged, "error: `m` cannot run: its model is damaged"),
        (
            whole[..whole.len() - 40].to_vec(),
            "error: this is the launcher of hyd and holds no model, or the file was cut off",
        ),
        ([&whole[..100_000], &whole[100_001..]].concat(), "error: `m` cannot run: it was cut off or extended"),
    ];
    for (k, (bytes, message)) in cases.into_iter().enumerate() {
        // The last one breaks the program itself on some systems; then it does not run at all, which is as good.
        fs::write(scratch.file("m"), bytes).unwrap();
        let output = scratch.bare("m", &[]);
        assert!(!output.status.success());
        assert!(k == 2 || messages(&output).starts_with(message), "{}", messages(&output));
    }
}
