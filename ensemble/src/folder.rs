//! The folder of an ensemble: which sweep it holds, and which chunks are done.
//!
//! `sweep.json` says what the sweep is; `parts/members-N.parquet` and `parts/rows-N.parquet` are the chunks, in folders of a thousand
//! where there are more.  The members' file of a chunk is written last and appears whole, so its existence means that the chunk is done.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hyd_results::write_whole;
use serde::{Deserialize, Serialize};

/// Chunks of one folder: file systems of clusters slow down on folders of many more files.
const FOLDED: usize = 1000;
/// Most members of a chunk of a sweep that is shared out: a killed task loses no more than this of its work.
const MOST_SHARED: usize = 1000;
/// Most chunks of such a sweep, before which a chunk may be larger: servers of file names are what large clusters have too few of.
const MOST_CHUNKS: usize = 100_000;

/// What `sweep.json` holds.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
struct Card {
    /// Tells sweeps apart: the plan and the model.
    identity: String,
    members: usize,
    chunk: usize,
    /// Chunks stand in folders of a thousand.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    folded: bool,
}

/// A folder with the results of an ensemble.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    card: Card,
}

/// Why a folder cannot be used.
#[derive(Debug)]
pub enum FolderError {
    /// It cannot be made, read or written.
    Io(PathBuf, io::Error),
    /// It holds the results of another sweep.
    Other(PathBuf),
    /// It holds no sweep, or its card cannot be read.
    NoSweep(PathBuf),
}

impl fmt::Display for FolderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FolderError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
            FolderError::Other(path) => write!(
                f,
                "`{}` holds another sweep (other values, other options or another model); choose an empty folder",
                path.display()
            ),
            FolderError::NoSweep(path) => write!(f, "`{}` holds no sweep", path.display()),
        }
    }
}

impl std::error::Error for FolderError {}

/// Members per chunk: few enough that little is lost by a kill and no core waits long for another's last chunk, enough that a
/// large sweep does not leave thousands of small files.  A function of the sweep alone, so that shards on other machines agree.
fn chunk_size(members: usize) -> usize {
    (members / 100).clamp(1, 32)
}

/// Members per chunk of a sweep that is shared out to so many shards: a file for each shard, several for large ones.
fn shared_chunk_size(members: usize, shards: usize) -> usize {
    members.div_ceil(shards.max(1)).clamp(1, MOST_SHARED.max(members.div_ceil(MOST_CHUNKS)))
}

impl Folder {
    /// Opens a folder for a sweep, new or begun before; `identity` must be the same text then.
    pub fn open(root: &Path, identity: &str, members: usize) -> Result<Self, FolderError> {
        Self::begin(root, identity, members, chunk_size(members))
    }

    /// The same for a sweep that is shared out to so many shards.
    pub fn open_shared(root: &Path, identity: &str, members: usize, shards: usize) -> Result<Self, FolderError> {
        Self::begin(root, identity, members, shared_chunk_size(members, shards))
    }

    fn begin(root: &Path, identity: &str, members: usize, chunk: usize) -> Result<Self, FolderError> {
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |error| FolderError::Io(path, error)
        };
        let parts = root.join("parts");
        fs::create_dir_all(&parts).map_err(failed(&parts))?;
        let folded = members.div_ceil(chunk) > FOLDED;
        let mut card = Card { identity: identity.to_string(), members, chunk, folded };
        let place = root.join("sweep.json");
        match fs::read_to_string(&place) {
            Ok(text) => match serde_json::from_str::<Card>(&text) {
                // A sweep keeps the chunks it was begun with.
                Ok(known) if known.identity == card.identity && known.members == card.members => card = known,
                _ => return Err(FolderError::Other(root.to_path_buf())),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let text = serde_json::to_string_pretty(&card).map_err(|error| failed(&place)(error.into()))?;
                write_whole(&place, text.as_bytes()).map_err(failed(&place))?;
            }
            Err(error) => return Err(failed(&place)(error)),
        }
        Ok(Self { root: root.to_path_buf(), card })
    }

    /// Opens a folder that holds a sweep.
    pub fn existing(root: &Path) -> Result<Self, FolderError> {
        let text = fs::read_to_string(root.join("sweep.json"));
        let card = text.ok().and_then(|text| serde_json::from_str(&text).ok());
        match card {
            Some(card) => Ok(Self { root: root.to_path_buf(), card }),
            None => Err(FolderError::NoSweep(root.to_path_buf())),
        }
    }

    /// Number of chunks.
    pub fn chunks(&self) -> usize {
        self.card.members.div_ceil(self.card.chunk.max(1))
    }

    /// Numbers of the members of a chunk.
    pub fn members_of(&self, chunk: usize) -> std::ops::Range<usize> {
        let first = chunk * self.card.chunk;
        first..(first + self.card.chunk).min(self.card.members)
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.card.members
    }

    /// Where the file of a chunk stands.
    fn place(&self, chunk: usize) -> PathBuf {
        let parts = self.root.join("parts");
        if self.card.folded { parts.join(format!("{:04}", chunk / FOLDED)) } else { parts }
    }

    /// Makes the folder of a chunk where that is not there yet.
    pub(crate) fn make_place(&self, chunk: usize) -> io::Result<()> {
        if self.card.folded { fs::create_dir_all(self.place(chunk)) } else { Ok(()) }
    }

    /// File with a row per member.
    pub(crate) fn members_file(&self, chunk: usize) -> PathBuf {
        self.place(chunk).join(members_name(chunk))
    }

    /// File with the rows of all members.
    pub(crate) fn rows_file(&self, chunk: usize) -> PathBuf {
        self.place(chunk).join(format!("rows-{chunk:06}.parquet"))
    }

    /// Is the chunk done?
    pub(crate) fn is_done(&self, chunk: usize) -> bool {
        self.members_file(chunk).exists()
    }

    /// Marks the chunks that are done, by lists of folders rather than by one question for each file; those that are marked already are
    /// not looked for.
    ///
    /// # Errors
    /// The system's, where a folder is there and cannot be listed.
    pub fn mark_done(&self, done: &mut [bool]) -> io::Result<()> {
        let step = if self.card.folded { FOLDED } else { done.len().max(1) };
        for first in (0..done.len()).step_by(step) {
            let last = (first + step).min(done.len());
            if done[first..last].iter().all(|&done| done) {
                continue;
            }
            let entries = match fs::read_dir(self.place(first)) {
                Ok(entries) => entries,
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => return Err(error),
            };
            for entry in entries {
                let name = entry?.file_name();
                let number = name.to_str().and_then(|name| name.strip_prefix("members-")?.strip_suffix(".parquet"));
                let Some(chunk) = number.and_then(|number| number.parse::<usize>().ok()) else { continue };
                if (first..last).contains(&chunk) && name.to_str() == Some(&members_name(chunk)) {
                    done[chunk] = true;
                }
            }
        }
        Ok(())
    }

    /// Takes a chunk that cannot be read out of the way, so that it is not done; what it held stays beside it under another name.
    ///
    /// # Errors
    /// The system's.
    pub fn set_aside(&self, chunk: usize) -> io::Result<PathBuf> {
        let path = self.members_file(chunk);
        let aside = path.with_extension("damaged");
        fs::rename(&path, &aside).map(|()| aside)
    }

    /// Removes temporary files of tasks that were killed.  To be called when all chunks are done; of a task that is still writing one again,
    /// the file is lost and not missed.
    pub fn sweep_out(&self) {
        let step = if self.card.folded { FOLDED } else { self.chunks().max(1) };
        for first in (0..self.chunks()).step_by(step) {
            let Ok(entries) = fs::read_dir(self.place(first)) else { continue };
            for entry in entries.flatten() {
                let name = entry.file_name();
                if name.to_str().is_some_and(|name| name.starts_with('.') && name.ends_with(".part")) {
                    // What stays behind takes room and nothing else.
                    let _ = fs::remove_file(entry.path());
                }
            }
        }
    }

    /// The joined files: a row per member, and all rows.
    pub fn joined(&self) -> (PathBuf, PathBuf) {
        (self.root.join("members.parquet"), self.root.join("rows.parquet"))
    }
}

fn members_name(chunk: usize) -> String {
    format!("members-{chunk:06}.parquet")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn chunks_of_large_shared_sweeps_stand_in_folders_of_a_thousand() {
        assert_eq!([10_000, 200].map(|shards| shared_chunk_size(10_000, shards)), [1, 50]);
        assert_eq!([1_000, 100_000].map(|shards| shared_chunk_size(1_000_000_000, shards)), [10_000, 10_000]);
        assert_eq!(shared_chunk_size(10_000_000, 1_000), 1000);
        let root = std::env::temp_dir().join(format!("hyd-folder-{}", std::process::id()));
        let folder = Folder::open_shared(&root, "a", 2500, 2500).unwrap();
        assert_eq!((folder.chunks(), folder.members_of(2499)), (2500, 2499..2500));
        assert!(folder.members_file(1234).ends_with("parts/0001/members-001234.parquet"));
        let mut done = vec![false; 2500];
        folder.mark_done(&mut done).unwrap();
        assert!(done.iter().all(|&done| !done));
        for chunk in [0, 999, 1000, 2499] {
            folder.make_place(chunk).unwrap();
            fs::write(folder.members_file(chunk), "").unwrap();
        }
        fs::write(folder.place(1).join(".members-001001.parquet.7.part"), "").unwrap();
        fs::write(folder.place(1).join("members-1002.parquet"), "").unwrap();
        folder.mark_done(&mut done).unwrap();
        let marked: Vec<usize> = (0..2500).filter(|&chunk| done[chunk]).collect();
        assert_eq!(marked, [0, 999, 1000, 2499]);
        folder.sweep_out();
        assert!(!folder.place(1).join(".members-001001.parquet.7.part").exists());
        assert!(folder.set_aside(999).unwrap().exists() && !folder.is_done(999));
        // Shards that open it find the chunks that it was begun with.
        assert_eq!(Folder::existing(&root).unwrap().chunks(), 2500);
        assert_eq!(Folder::open(&root, "a", 2500).unwrap().chunks(), 2500);
        assert!(matches!(Folder::open(&root, "b", 2500), Err(FolderError::Other(_))));
        fs::remove_dir_all(&root).unwrap();
    }
}
