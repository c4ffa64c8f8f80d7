//! A file that appears under its name when it is whole.
//!
//! It is written beside its place under a temporary name and renamed at the end; dropping it before removes it.  What stood
//! there keeps its rights and its links: a symbolic link still leads to it, and where the file has several names all of them show
//! what is new.  A file that may only be read is not replaced, nor is one that the process has read (`read_files`).  What
//! exists and is not an ordinary file (a pipe, a device) is written directly.

use std::ffi::OsString;
use std::fs::{self, File, Metadata};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::read_files::refuse_read;

/// Links that are followed to a file that is not there yet.
const MOST_LINKS: usize = 40;
/// Bytes of a file's name that leave room for what a temporary name adds.
const LONGEST_NAME: usize = 200;

/// A file in the making.
#[derive(Debug)]
pub struct WholeFile {
    file: File,
    path: PathBuf,
    temporary: Option<PathBuf>,
    /// It may replace a file that was read.
    own: bool,
}

impl WholeFile {
    /// Opens a temporary file in the folder of `path`; fails if nothing can be written there, or where the process has read
    /// the file that would be replaced.
    pub fn create(path: &Path) -> io::Result<Self> {
        refuse_read(path)?;
        Self::open(path, false)
    }

    /// The same for what replaces a file by what was made of it.
    pub fn rewrite(path: &Path) -> io::Result<Self> {
        Self::open(path, true)
    }

    fn open(path: &Path, own: bool) -> io::Result<Self> {
        if let Ok(metadata) = fs::metadata(path) {
            if metadata.is_dir() {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
            }
            if !metadata.is_file() {
                let file = File::options().write(true).open(path)?;
                return Ok(Self { file, path: path.to_path_buf(), temporary: None, own });
            }
            refuse_read_only(&metadata)?;
        }
        let (file, temporary) = temporary(&target(path)?)?;
        Ok(Self { file, path: path.to_path_buf(), temporary: Some(temporary), own })
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
        let Some(made) = self.temporary.clone() else { return Ok(path.to_path_buf()) };
        if !self.own {
            refuse_read(path)?;
        }
        self.file.sync_all()?;
        let target = target(path)?;
        match fs::metadata(&target) {
            Ok(old) => {
                refuse_read_only(&old)?;
                if names_of(&old) > 1 {
                    // All names of the file show what is new; the temporary file goes only when it has been copied.
                    copy_into(&made, &target)?;
                    return Ok(path.to_path_buf());
                }
                self.file.set_permissions(old.permissions())?;
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
        match fs::rename(&made, &target) {
            Err(error) if error.kind() == io::ErrorKind::CrossesDevices => {
                // The other name is a link that leads to another device.
                let (file, beside) = temporary(&target)?;
                let copied = fs::copy(&made, &beside).and_then(|_| file.sync_all());
                if let Err(error) = copied.and_then(|()| fs::rename(&beside, &target)) {
                    // What is left behind is ours; the error that is reported says more.
                    let _ = fs::remove_file(&beside);
                    return Err(error);
                }
            }
            Err(error) => return Err(error),
            Ok(()) => self.temporary = None,
        }
        Ok(path.to_path_buf())
    }
}

/// Where the bytes go: behind symbolic links, even if they lead to a file that is still to be made.
pub(crate) fn target(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&path) {
            // A relative link begins in the folder of the link.
            Ok(next) => path = path.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "its links form a cycle"))
}

/// A new file beside `target` that is hidden from most listings.
pub(crate) fn temporary(target: &Path) -> io::Result<(File, PathBuf)> {
    let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "it is not a file name");
    let name = target.file_name().ok_or_else(no_name)?;
    for attempt in 0..u32::MAX {
        let mut hidden = OsString::from(".");
        hidden.push(if name.len() > LONGEST_NAME { "hyd".as_ref() } else { name });
        hidden.push(match attempt {
            0 => format!(".{}.part", std::process::id()),
            more => format!(".{}-{more}.part", std::process::id()),
        });
        let path = target.with_file_name(hidden);
        match File::create_new(&path) {
            // Left behind by a process of the same number, or made by another thread.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|file| (file, path)),
        }
    }
    Err(no_name())
}

fn refuse_read_only(old: &Metadata) -> io::Result<()> {
    match old.permissions().readonly() {
        true => Err(io::Error::new(io::ErrorKind::PermissionDenied, "it is read-only")),
        false => Ok(()),
    }
}

#[cfg(unix)]
fn names_of(file: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(file)
}

#[cfg(not(unix))]
fn names_of(_file: &Metadata) -> u64 {
    1
}

fn copy_into(made: &Path, target: &Path) -> io::Result<()> {
    let mut to = File::options().write(true).truncate(true).open(target)?;
    io::copy(&mut File::open(made)?, &mut to)?;
    to.sync_all()
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

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("hyd-whole-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn nothing_is_seen_before_the_end() {
        let folder = folder("unseen");
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

    #[cfg(unix)]
    #[test]
    fn rights_and_links_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = folder("links");
        let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
        fs::create_dir_all(folder.join("far")).unwrap();
        let (far, soft, hard) = (folder.join("far/a.csv"), folder.join("soft.csv"), folder.join("hard.csv"));
        write_whole(&far, b"old").unwrap();
        fs::set_permissions(&far, fs::Permissions::from_mode(0o640)).unwrap();
        symlink("far/a.csv", &soft).unwrap();

        write_whole(&soft, b"new").unwrap();
        assert!(fs::symlink_metadata(&soft).unwrap().is_symlink());
        assert_eq!(
            (read("far/a.csv").as_str(), fs::metadata(&far).unwrap().permissions().mode() & 0o777),
            ("new", 0o640)
        );

        fs::hard_link(&far, &hard).unwrap();
        write_whole(&hard, b"newest").unwrap();
        assert_eq!((read("far/a.csv").as_str(), read("hard.csv").as_str()), ("newest", "newest"));

        // A link to what is not there yet.
        symlink("far/b.csv", folder.join("early.csv")).unwrap();
        write_whole(&folder.join("early.csv"), b"b").unwrap();
        assert_eq!(read("far/b.csv"), "b");
        symlink("loop.csv", folder.join("loop.csv")).unwrap();
        assert!(write_whole(&folder.join("loop.csv"), b"").is_err());

        fs::set_permissions(&far, fs::Permissions::from_mode(0o440)).unwrap();
        assert_eq!(write_whole(&far, b"no").unwrap_err().to_string(), "it is read-only");
        let long = folder.join("n".repeat(250));
        write_whole(&long, b"long").unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 6, "far, four links and the long name; nothing temporary");
        fs::remove_dir_all(&folder).unwrap();
    }
}
