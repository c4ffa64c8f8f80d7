//! Memory that two processes see: a file that both map, as words of eight bytes; or one that a single process asks itself by.
//!
//! Every access is atomic, so that nothing the other process does can break a rule of this one; ordering comes from the two numbers of
//! request and answer.  The other process may write what it likes: what is read here is data, and lengths are checked.

#![allow(unsafe_code)]

use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use memmap2::{MmapOptions, MmapRaw};

use crate::folder::unused;

/// Words of the head, in lines of the cache of their own where both sides wait for them.
pub(crate) const REQUEST: usize = 0;
pub(crate) const ANSWER: usize = 8;
pub(crate) const HOST_SLEEPS: usize = 16;
pub(crate) const WORKER_SLEEPS: usize = 24;
pub(crate) const OPERATION: usize = 32;
pub(crate) const STATUS: usize = 33;
/// The foreign function that runs now: its number, from 1.
pub(crate) const CALL: usize = 34;
/// Messages wait for being asked for.
pub(crate) const HEARD: usize = 35;
/// Where data begin.
pub(crate) const DATA: usize = 40;

/// Folder whose files lie in memory, where there is one.
const MEMORY: &str = "/dev/shm";

/// The memory.
pub(crate) struct Area {
    map: MmapRaw,
    words: usize,
}

impl Area {
    /// Makes one with room for so many words of data; the other process opens it by its path.
    pub(crate) fn create(data: usize) -> io::Result<(Self, PathBuf)> {
        let words = DATA + data;
        let folder = if Path::new(MEMORY).is_dir() { PathBuf::from(MEMORY) } else { std::env::temp_dir() };
        let (path, file) = unused(&folder, "hyd-area", |path| {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create_new(true);
            #[cfg(unix)]
            std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
            options.open(path)
        })?;
        let mapped = file.set_len(8 * words as u64).and_then(|()| MmapRaw::map_raw(&file));
        match mapped {
            Ok(map) => Ok((Self { map, words }, path)),
            Err(error) => {
                let _ = std::fs::remove_file(&path);
                Err(error)
            }
        }
    }

    /// One that nobody else sees.
    pub(crate) fn private(data: usize) -> io::Result<Self> {
        let words = DATA + data;
        let map = MmapOptions::new().len(8 * words).map_anon()?;
        Ok(Self { map: map.into(), words })
    }

    /// Opens one that the other process has made.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        let words = usize::try_from(file.metadata()?.len() / 8).unwrap_or(0);
        if words <= DATA {
            return Err(io::Error::other("the memory is too small"));
        }
        Ok(Self { map: MmapRaw::map_raw(&file)?, words })
    }

    /// Number of words of data.
    pub(crate) fn room(&self) -> usize {
        self.words - DATA
    }

    #[inline]
    pub(crate) fn word(&self, k: usize) -> &AtomicU64 {
        assert!(k < self.words, "a word outside of the memory");
        // SAFETY: the mapping holds `words` words, begins at a page, lives as long as `self`, and is only seen through atomics.
        unsafe { &*self.map.as_ptr().cast::<AtomicU64>().add(k) }
    }

    #[inline]
    pub(crate) fn get(&self, k: usize) -> u64 {
        self.word(k).load(Ordering::Relaxed)
    }

    #[inline]
    pub(crate) fn set(&self, k: usize, value: u64) {
        self.word(k).store(value, Ordering::Relaxed);
    }
}
