//! Which files this process has read, so that none of them is written over.
//!
//! Whoever reads what a user named says so ([`note_read`]); whoever writes asks ([`refuse_read`]), and [`crate::WholeFile`] does so
//! for all.  Files are told apart by what they are, not by their names: links and other spellings lead to the same file.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Names under which files were read, by what the files are.
static READ: Mutex<BTreeMap<Identity, PathBuf>> = Mutex::new(BTreeMap::new());

/// Device and number of a file.
#[cfg(unix)]
type Identity = (u64, u64);

/// Its canonical path.
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
fn identity(_path: &Path, metadata: &Metadata) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn identity(path: &Path, _metadata: &Metadata) -> Option<Identity> {
    path.canonicalize().ok()
}

/// What an ordinary file behind a name is; pipes, devices and folders are none.
fn of(path: &Path) -> Option<Identity> {
    let metadata = std::fs::metadata(path).ok().filter(Metadata::is_file)?;
    identity(path, &metadata)
}

/// The file was read, or is about to be: from now on it is not written over.
pub fn note_read(path: &Path) {
    if let Some(file) = of(path) {
        READ.lock().unwrap_or_else(PoisonError::into_inner).entry(file).or_insert_with(|| path.to_path_buf());
    }
}

/// Whoever goes on with other work forgets what the work before has read: a server between two requests, each of which is a command of its own.
pub fn forget_read() {
    READ.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// The name under which the file was read that a path leads to.
pub fn read_as(path: &Path) -> Option<PathBuf> {
    let file = of(path)?;
    let name = READ.lock().unwrap_or_else(PoisonError::into_inner).get(&file).cloned();
    // The number of a file that is gone may be that of another one by now.
    name.filter(|name| of(name) == Some(file))
}

/// Refuses a path that leads to a file that was read.
///
/// # Errors
/// The name under which it was read.
pub fn refuse_read(path: &Path) -> io::Result<()> {
    match read_as(path) {
        None => Ok(()),
        Some(name) => {
            let reason = format!("it is the file `{}`, which this command reads", name.display());
            Err(io::Error::new(io::ErrorKind::AlreadyExists, reason))
        }
    }
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn other_names_of_a_file_that_was_read_are_refused() {
        let folder = std::env::temp_dir().join(format!("hyd-read-{}", std::process::id()));
        fs::create_dir_all(folder.join("inner")).unwrap();
        let file = folder.join("data.csv");
        let (soft, hard, other) = (folder.join("soft.csv"), folder.join("hard.csv"), folder.join("other.csv"));
        fs::write(&file, "a").unwrap();
        fs::write(&other, "a").unwrap();
        std::os::unix::fs::symlink("data.csv", &soft).unwrap();
        fs::hard_link(&file, &hard).unwrap();
        assert!(refuse_read(&file).is_ok());
        note_read(&soft);
        let winding = folder.join("inner/../data.csv");
        for name in [&file, &soft, &hard, &winding] {
            let said = refuse_read(name).unwrap_err().to_string();
            assert!(said.contains(&format!("`{}`", soft.display())), "{said}");
            assert!(crate::write_whole(name, b"b").is_err());
        }
        assert!(refuse_read(&other).is_ok() && refuse_read(&folder.join("none.csv")).is_ok());
        assert_eq!(fs::read(&file).unwrap(), b"a");
        fs::remove_dir_all(&folder).unwrap();
    }
}
