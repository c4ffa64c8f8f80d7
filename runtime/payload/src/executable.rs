//! Executables: a launcher, a payload on a page boundary behind it, and a trailer that tells where the payload is.
//!
//! The launcher is a prebuilt program, so no linker is needed; so is the library of units for other tools, whose payload stands beside it.  Trailer: 8 bytes of magic, position and length of the payload.

use std::io::{self, Read, Seek, SeekFrom};

use crate::codec::{Input, Stored};
use crate::format::{FormatError, VERSION};

/// Last bytes but 16 of every executable.
const MAGIC: [u8; 8] = *b"hyd exec";
/// Length of the trailer.
const TRAILER: usize = 24;
/// Payloads begin at multiples of this, so that files can be mapped.
const PAGE: usize = 4096;

/// Begins the text by which a launcher tells which payloads it reads; in two parts, so that no other program holds it.
const MARK: [&[u8]; 2] = [b"hyd launcher, ", b"reads payloads of format "];

/// What a launcher has to hold somewhere, so that [`is_launcher`] knows it: the mark and the version in decimal, then a full stop.
pub const LAUNCHER_MARK: &[u8] = b"hyd launcher, reads payloads of format 12.";

/// The same for the library of a unit: it begins otherwise.
const LIBRARY: &[u8] = b"hyd library, ";
/// What the library of a unit has to hold somewhere, so that [`is_library`] knows it.
pub const LIBRARY_MARK: &[u8] = b"hyd library, reads payloads of format 12.";

/// True if the bytes are a launcher that reads payloads of this format.
pub fn is_launcher(program: &[u8]) -> bool {
    holds_mark(program, MARK[0])
}

/// True if the bytes are the library of a unit that reads payloads of this format.
pub fn is_library(program: &[u8]) -> bool {
    holds_mark(program, LIBRARY)
}

fn holds_mark(program: &[u8], begin: &[u8]) -> bool {
    let mark = [begin, MARK[1], format!("{VERSION}.").as_bytes()].concat();
    // Searching for the first byte alone is many times faster than comparing everywhere.
    let mut rest = program;
    while let Some(position) = rest.iter().position(|&byte| byte == mark[0]) {
        rest = &rest[position..];
        if rest.starts_with(&mark) {
            return true;
        }
        rest = &rest[1..];
    }
    false
}

/// The executable of a launcher and a payload.
pub fn join(launcher: &[u8], payload: &[u8]) -> Vec<u8> {
    let position = launcher.len().next_multiple_of(PAGE);
    let mut out = Vec::with_capacity(position + payload.len() + TRAILER);
    out.extend_from_slice(launcher);
    out.resize(position, 0);
    out.extend_from_slice(payload);
    out.extend_from_slice(&MAGIC);
    (position as u64).put(&mut out);
    (payload.len() as u64).put(&mut out);
    out
}

/// The payload of an executable; the launcher before it is not read.
///
/// # Errors
/// What the system says; then [`FormatError::Foreign`] for a program without payload, [`FormatError::Length`] for one that was cut off.
pub fn payload(program: &mut (impl Read + Seek)) -> io::Result<Result<Vec<u8>, FormatError>> {
    let end = program.seek(SeekFrom::End(0))?;
    let Some(begin) = end.checked_sub(TRAILER as u64) else { return Ok(Err(FormatError::Foreign)) };
    program.seek(SeekFrom::Start(begin))?;
    let mut trailer = [0; TRAILER];
    program.read_exact(&mut trailer)?;
    if trailer[..8] != MAGIC {
        return Ok(Err(FormatError::Foreign));
    }
    let mut input = Input(&trailer[8..]);
    let (Ok(position), Ok(length)) = (u64::get(&mut input), u64::get(&mut input)) else {
        return Ok(Err(FormatError::Damaged));
    };
    let found = begin.saturating_sub(position);
    if found != length {
        return Ok(Err(FormatError::Length { wanted: length, found }));
    }
    program.seek(SeekFrom::Start(position))?;
    let mut payload = vec![0; found as usize];
    program.read_exact(&mut payload)?;
    Ok(Ok(payload))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_payload_is_found_again_and_a_cut_is_seen() {
        let payload = |program: &[u8]| payload(&mut io::Cursor::new(program)).expect("in memory");
        let program = join(b"launcher", b"payload");
        assert_eq!(payload(&program), Ok(b"payload".to_vec()));
        assert_eq!(payload(b"launcher"), Err(FormatError::Foreign));
        assert_eq!(payload(b"launcher of some length"), Err(FormatError::Foreign));
        assert_eq!(payload(&program[..program.len() - 1]), Err(FormatError::Foreign));
        let mut moved = program.clone();
        moved.remove(3);
        assert_eq!(payload(&moved), Err(FormatError::Length { wanted: 7, found: 6 }));
    }

    #[test]
    fn a_launcher_is_known_by_its_mark() {
        assert!(is_launcher(&[b"xhyd launhyd", LAUNCHER_MARK, b"y"].concat()));
        assert!(!is_launcher(b"hyd launcher, reads payloads of format 0."));
        assert!(is_library(LIBRARY_MARK) && !is_library(LAUNCHER_MARK) && !is_launcher(LIBRARY_MARK));
    }
}
