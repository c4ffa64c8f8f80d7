//! The chunks of an ensemble joined: `members.parquet`, and `rows.parquet` where rows were kept.
//!
//! Chunks are read one at a time, so memory does not grow with the ensemble.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use hyd_frames::{Cells, Frame, FrameWriter, Kind};
use hyd_results::WholeFile;

use crate::Folder;

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
    let mut writer: Option<(FrameWriter, Vec<(String, Kind)>)> = None;
    for part in parts {
        let frame = Frame::read(&part).map_err(failed(&part))?;
        let head: Vec<(String, Kind)> =
            frame.columns.iter().map(|(name, cells)| (name.clone(), cells.kind())).collect();
        if writer.is_none() {
            let file = whole.writer().map_err(failed(target))?;
            let columns = head.iter().map(|(name, kind)| (name.as_str(), *kind));
            writer = Some((FrameWriter::new(file, columns, &[]).map_err(failed(target))?, head.clone()));
        }
        let Some((writer, expected)) = &mut writer else { break };
        if *expected != head {
            return Err(MergeError::Unlike(part));
        }
        let cells: Vec<Cells> = frame.columns.into_iter().map(|(_, cells)| cells).collect();
        writer.group(&cells).map_err(failed(target))?;
    }
    if let Some((writer, _)) = writer {
        writer.finish().map_err(failed(target))?;
    }
    whole.finish().map_err(failed(target))
}
