//! The chunks of an ensemble joined: `members.parquet`, and `rows.parquet` where rows were kept.
//!
//! Chunks are read one at a time and written some together, so that row groups are large and memory does not grow with the ensemble.

use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use hyd_frames::{Cells, Frame, FrameWriter};
use hyd_results::WholeFile;

use crate::Folder;

/// Values of a row group, after which the next one begins.
const GROUP: usize = 1 << 21;

/// Why the chunks cannot be joined.
#[derive(Debug)]
pub enum MergeError {
    /// Some are not there: how many of how many.
    Missing(usize, usize),
    /// One cannot be read, or the joined file cannot be written.
    Io(PathBuf, io::Error),
    /// One has other columns than the first.
    Unlike(PathBuf),
}

impl fmt::Display for MergeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MergeError::Missing(missing, all) => {
                write!(f, "{missing} of {all} chunks have not been run; run the sweep (or its other shards) first")
            }
            MergeError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
            MergeError::Unlike(path) => write!(f, "`{}` has other columns than the first chunk", path.display()),
        }
    }
}

impl std::error::Error for MergeError {}

/// Joins all chunks; gives the files that were written.
pub fn merge(folder: &Folder) -> Result<Vec<PathBuf>, MergeError> {
    let chunks = folder.chunks();
    let missing = (0..chunks).filter(|&chunk| !folder.is_done(chunk)).count();
    if missing > 0 {
        return Err(MergeError::Missing(missing, chunks));
    }
    let (members, rows) = folder.joined();
    let mut written = vec![join(&members, (0..chunks).map(|chunk| folder.members_file(chunk)))?];
    if folder.rows_file(0).exists() {
        written.push(join(&rows, (0..chunks).map(|chunk| folder.rows_file(chunk)))?);
    }
    Ok(written)
}

fn join(target: &Path, parts: impl Iterator<Item = PathBuf>) -> Result<PathBuf, MergeError> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |error| MergeError::Io(path, error)
    };
    let whole = WholeFile::create(target).map_err(failed(target))?;
    let mut joined: Option<Joined> = None;
    for part in parts {
        let frame = Frame::read(&part).map_err(failed(&part))?;
        let joined = match &mut joined {
            Some(joined) => joined,
            none => {
                let file = whole.writer().map_err(failed(target))?;
                none.insert(Joined::new(file, &frame).map_err(failed(target))?)
            }
        };
        if !joined.append(frame) {
            return Err(MergeError::Unlike(part));
        }
        if joined.values() >= GROUP {
            joined.group().map_err(failed(target))?;
        }
    }
    if let Some(mut joined) = joined {
        joined.group().map_err(failed(target))?;
        joined.writer.finish().map_err(failed(target))?;
    }
    whole.finish().map_err(failed(target))
}

/// A joined file in the making.
struct Joined {
    writer: FrameWriter,
    names: Vec<String>,
    /// Cells that are not written yet.
    cells: Vec<Cells>,
}

impl Joined {
    /// With the columns and the metadata of the first part.
    fn new(file: File, first: &Frame) -> io::Result<Self> {
        let columns = || first.columns.iter().map(|(name, cells)| (name.as_str(), cells.kind()));
        Ok(Self {
            writer: FrameWriter::new(file, columns(), &first.metadata)?,
            names: columns().map(|(name, _)| name.to_string()).collect(),
            cells: columns().map(|(_, kind)| Cells::new(kind)).collect(),
        })
    }

    /// Takes the cells of a part; false if it has other columns.
    fn append(&mut self, part: Frame) -> bool {
        let alike = self.names.len() == part.columns.len()
            && self.names.iter().zip(&part.columns).all(|(name, (other, _))| name == other);
        alike && self.cells.iter_mut().zip(part.columns).all(|(cells, (_, own))| cells.append(own))
    }

    fn values(&self) -> usize {
        self.cells.iter().map(Cells::len).sum()
    }

    /// Writes what there is as a row group.
    fn group(&mut self) -> io::Result<()> {
        self.writer.group(&self.cells)?;
        self.cells.iter_mut().for_each(|cells| *cells = Cells::new(cells.kind()));
        Ok(())
    }
}
