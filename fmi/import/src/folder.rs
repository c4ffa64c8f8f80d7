//! A folder for the files of one unit, removed with the last value that refers to it.

use std::fs::DirBuilder;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// What names of these folders begin with.
const BEGIN: &str = "hyd-unit";
/// A folder that nobody removed is lost after this time: the number of its process may mean another one in a container beside.
const LOST: Duration = Duration::from_secs(24 * 3600);
/// Names that are tried before giving up.
const ATTEMPTS: u32 = 100;

/// The folder.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// The library in it is the one that this program puts into units; filled where that is asked.
    pub(crate) is_own: OnceLock<bool>,
}

impl Folder {
    /// Makes one below the folder of temporary files that only this user can enter.
    pub(crate) fn new() -> io::Result<Self> {
        let all = std::env::temp_dir();
        remove_lost(&all);
        let path = unused(&all, BEGIN, |path| {
            let mut builder = DirBuilder::new();
            #[cfg(unix)]
            std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
            builder.create(path)
        })?;
        Ok(Self { path: path.0, is_own: OnceLock::new() })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Removes the folders of processes that were killed before they could do so.
fn remove_lost(all: &Path) {
    for entry in std::fs::read_dir(all).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let parts = name.to_str().and_then(|name| name.strip_prefix(BEGIN)?.strip_prefix('-')?.split('-').next());
        let Some(process) = parts.and_then(|number| number.parse::<i32>().ok()) else { continue };
        let age = entry.metadata().and_then(|found| found.modified()).ok().and_then(|made| made.elapsed().ok());
        if age.is_some_and(|age| age > LOST) && !is_alive(process) {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(unix)]
fn is_alive(process: i32) -> bool {
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(process), None) != Err(nix::errno::Errno::ESRCH)
}

#[cfg(not(unix))]
fn is_alive(_process: i32) -> bool {
    true
}

/// Makes something under a name that nothing has; gives the name and what was made.
pub(crate) fn unused<T>(folder: &Path, begin: &str, make: impl Fn(&Path) -> io::Result<T>) -> io::Result<(PathBuf, T)> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let clock = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.subsec_nanos());
    for _ in 0..ATTEMPTS {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!("{begin}-{}-{count}-{clock}", std::process::id()));
        match make(&path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|made| (path, made)),
        }
    }
    Err(io::Error::other("no name for a temporary file is free"))
}
