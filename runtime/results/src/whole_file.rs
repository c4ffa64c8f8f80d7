//! A file that appears under its name when it is whole.
//!
//! It is written beside its place under a temporary name and renamed at the end; dropping it before removes it.  What exists
//! and is no ordinary file (a pipe, a device) is written directly.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file in the making.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
}

impl WholeFile {
    /// Opens a temporary file in the folder of `path`; fails if nothing can be written there.
    pub fn create(path: &Path) -> io::Result<Self> {
        let special = match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
            }
            Ok(metadata) => !metadata.is_file(),
            Err(_) => false,
        };
        if special {
            let file = File::options().write(true).open(path)?;
            return Ok(Self { file, path: path.to_path_buf(), temporary: None });
        }
        let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "it is no file name");
        let mut hidden = OsString::from(".");
        hidden.push(path.file_name().ok_or_else(no_name)?);
        hidden.push(format!(".{}.part", std::process::id()));
        let temporary = path.with_file_name(hidden);
        let file = File::create(&temporary)?;
        Ok(Self { file, path: path.to_path_buf(), temporary: Some(temporary) })
    }

    /// Another handle to write through.
    pub fn writer(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// Gives the file its name; an older file of that name is replaced.
    pub fn finish(self) -> io::Result<PathBuf> {
        let path = self.path.clone();
        self.finish_as(&path)
    }

    /// Gives the file another name in the same folder.
    pub fn finish_as(mut self, path: &Path) -> io::Result<PathBuf> {
        if let Some(temporary) = &self.temporary {
            self.file.sync_all()?;
            fs::rename(temporary, path)?;
            self.temporary = None;
        }
        Ok(path.to_path_buf())
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some(temporary) = &self.temporary {
            // It is ours and of no use to anybody; if it cannot be removed, nothing depends on it.
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Writes a whole file at once.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let file = WholeFile::create(path)?;
    file.writer()?.write_all(bytes)?;
    file.finish().map(|_| ())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_seen_before_the_end() {
        let folder = std::env::temp_dir().join(format!("hyd-whole-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.csv");
        let names = || fs::read_dir(&folder).unwrap().count();
        write_whole(&path, b"old").unwrap();

        let dropped = WholeFile::create(&path).unwrap();
        dropped.writer().unwrap().write_all(b"half").unwrap();
        assert_eq!((fs::read(&path).unwrap(), names()), (b"old".to_vec(), 2));
        drop(dropped);
        assert_eq!((fs::read(&path).unwrap(), names()), (b"old".to_vec(), 1));

        write_whole(&path, b"new").unwrap();
        assert_eq!((fs::read(&path).unwrap(), names()), (b"new".to_vec(), 1));
        assert!(WholeFile::create(&folder).is_err());
        fs::remove_dir_all(&folder).unwrap();
    }
}
