//! The folder of an ensemble: which sweep it holds, and which chunks are done.
//!
//! `sweep.json` says what the sweep is; `parts/members-N.parquet` and `parts/rows-N.parquet` are the chunks.  The members' file of a
//! chunk is written last and appears whole, so its existence means that the chunk is done.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hyd_results::write_whole;
use serde::{Deserialize, Serialize};

/// What `sweep.json` holds.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
struct Card {
    /// Tells sweeps apart: the plan and the model.
    identity: String,
    members: usize,
    chunk: usize,
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

impl Folder {
    /// Opens a folder for a sweep, new or begun before; `identity` must be the same text then.
    pub fn open(root: &Path, identity: &str, members: usize) -> Result<Self, FolderError> {
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |error| FolderError::Io(path, error)
        };
        let parts = root.join("parts");
        fs::create_dir_all(&parts).map_err(failed(&parts))?;
        let mut card = Card { identity: identity.to_string(), members, chunk: chunk_size(members) };
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
    pub(crate) fn chunks(&self) -> usize {
        self.card.members.div_ceil(self.card.chunk.max(1))
    }

    /// Numbers of the members of a chunk.
    pub(crate) fn members_of(&self, chunk: usize) -> std::ops::Range<usize> {
        let first = chunk * self.card.chunk;
        first..(first + self.card.chunk).min(self.card.members)
    }

    /// Number of members.
    pub fn members(&self) -> usize {
        self.card.members
    }

    /// File with a row per member.
    pub(crate) fn members_file(&self, chunk: usize) -> PathBuf {
        self.root.join("parts").join(format!("members-{chunk:06}.parquet"))
    }

    /// File with the rows of all members.
    pub(crate) fn rows_file(&self, chunk: usize) -> PathBuf {
        self.root.join("parts").join(format!("rows-{chunk:06}.parquet"))
    }

    /// Is the chunk done?
    pub(crate) fn is_done(&self, chunk: usize) -> bool {
        self.members_file(chunk).exists()
    }

    /// The joined files: a row per member, and all rows.
    pub fn joined(&self) -> (PathBuf, PathBuf) {
        (self.root.join("members.parquet"), self.root.join("rows.parquet"))
    }
}
