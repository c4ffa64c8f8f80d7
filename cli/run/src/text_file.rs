//! Reading a text file: bounded in size, UTF-8, with messages that say what is wrong.

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Largest text that is read, in bytes.
pub const SIZE_LIMIT: u64 = 256 << 20;

/// Why a text cannot be had.
#[derive(Debug)]
pub enum TextError {
    /// The file cannot be opened or read.
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The path leads to a folder.
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// The file is larger than [`SIZE_LIMIT`].
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit in bytes.
        limit: u64,
    },
    /// A byte does not belong to UTF-8 text.
    NotUtf8 {
        /// The file.
        path: PathBuf,
        /// Its offset, from 0.
        offset: usize,
        /// Its line, from 1.
        line: usize,
        /// The byte.
        byte: u8,
    },
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TextError::Io { path, error } if error.kind() == io::ErrorKind::NotFound => {
                write!(f, "there is no file `{}`", path.display())
            }
            TextError::Io { path, error } => write!(f, "`{}` cannot be read: {error}", path.display()),
            TextError::Folder { path } => write!(f, "`{}` is a folder, not a file", path.display()),
            TextError::TooLarge { path, limit } => {
                write!(f, "`{}` is larger than {} MB", path.display(), limit >> 20)
            }
            TextError::NotUtf8 { path, offset, line, byte } => {
                write!(f, "`{}` is not UTF-8 text: byte {offset} (line {line}) is 0x{byte:02X}", path.display())
            }
        }
    }
}

impl std::error::Error for TextError {}

/// The text of a file, without a byte-order mark; from now on the file is not written over.
pub fn read_text(path: &Path) -> Result<String, TextError> {
    let failed = |error| TextError::Io { path: path.to_path_buf(), error };
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(TextError::Folder { path: path.to_path_buf() });
    }
    hyd_results::note_read(path);
    if metadata.len() > SIZE_LIMIT {
        return Err(TextError::TooLarge { path: path.to_path_buf(), limit: SIZE_LIMIT });
    }
    decode(path, read_to_limit(path, file)?)
}

/// All bytes of a source, which is named in messages; pipes and devices do not tell their length.
pub fn read_to_limit(path: &Path, source: impl Read) -> Result<Vec<u8>, TextError> {
    let mut bytes = Vec::new();
    let failed = |error| TextError::Io { path: path.to_path_buf(), error };
    source.take(SIZE_LIMIT + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > SIZE_LIMIT {
        return Err(TextError::TooLarge { path: path.to_path_buf(), limit: SIZE_LIMIT });
    }
    Ok(bytes)
}

/// Bytes as text, without a byte-order mark.
pub fn decode(path: &Path, bytes: Vec<u8>) -> Result<String, TextError> {
    let mut text = String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        TextError::NotUtf8 {
            path: path.to_path_buf(),
            offset,
            line: bytes[..offset].iter().filter(|&&b| b == b'\n').count() + 1,
            byte: bytes.get(offset).copied().unwrap_or(0),
        }
    })?;
    if text.starts_with('\u{FEFF}') {
        text.drain(..'\u{FEFF}'.len_utf8());
    }
    Ok(text)
}
