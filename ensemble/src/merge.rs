//! The chunks of an ensemble joined: `members.parquet`, and `rows.parquet` where rows were kept.
//!
//! Chunks are read one at a time and written some together, so that row groups are large and memory does not grow with the ensemble.
//! Each chunk must hold exactly its own members, in their order; where row groups end depends on the number of columns alone, so that
//! the joined files are the same bytes however the members were parted into chunks.

use std::fmt;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use hyd_frames::{Cells, Frame, FrameWriter};
use hyd_results::WholeFile;

use crate::Folder;
use crate::chunk::DONE_AGAIN;

/// Values of a row group, about.
const GROUP: usize = 1 << 21;

/// Why the chunks cannot be joined.
#[derive(Debug)]
pub enum MergeError {
    /// Some are not there: how many of how many.
    Missing(usize, usize),
    /// The file of a chunk cannot be read or holds something else: what is wrong with it.
    Part(PathBuf, String),
    /// The joined file cannot be written.
    Io(PathBuf, io::Error),
}

impl fmt::Display for MergeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MergeError::Missing(missing, all) => {
                write!(f, "{missing} of {all} chunks have not been run; run the sweep (or its other shards) first")
            }
            MergeError::Part(path, reason) => {
                write!(f, "`{}`: {reason}; remove the file and run the sweep again", path.display())
            }
            MergeError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
        }
    }
}

impl std::error::Error for MergeError {}

/// Joins all chunks; gives the files that were written.
///
/// # Errors
/// Chunks that are missing, that cannot be read, or that do not hold their own members; a file that cannot be written.
pub fn merge(folder: &Folder) -> Result<Vec<PathBuf>, MergeError> {
    let chunks = folder.chunks();
    let mut done = vec![false; chunks];
    folder.mark_done(&mut done).map_err(|error| MergeError::Io(folder.joined().0, error))?;
    let missing = done.iter().filter(|&&done| !done).count();
    if missing > 0 {
        return Err(MergeError::Missing(missing, chunks));
    }
    let (members, rows) = folder.joined();
    let parts = (0..chunks).map(|chunk| (folder.members_file(chunk), folder.members_of(chunk)));
    let mut written = vec![join(&members, parts, is_each_once)?];
    if folder.rows_file(0).exists() {
        let parts = (0..chunks).map(|chunk| (folder.rows_file(chunk), folder.members_of(chunk)));
        written.push(join(&rows, parts, are_in_order)?);
    }
    Ok(written)
}

impl Folder {
    /// What is wrong with the file of a chunk that is there: it cannot be read, or holds other members than its own.
    pub fn damage(&self, chunk: usize) -> Option<String> {
        let path = self.members_file(chunk);
        match Frame::read_columns(&path, |name| name == "member") {
            Ok(frame) => (!holds(&frame, &self.members_of(chunk), is_each_once)).then(|| OTHER.to_string()),
            Err(error) => Some(error.to_string()),
        }
    }
}

const OTHER: &str = "it does not hold the members that it is named for";

/// Is each member of the range there once, in order?
fn is_each_once(members: &[i64], range: &Range<usize>) -> bool {
    members.len() == range.len() && members.iter().zip(range.clone()).all(|(&own, wanted)| own == wanted as i64)
}

/// Do the rows belong to members of the range, in order?  A member that failed at once has none.
fn are_in_order(members: &[i64], range: &Range<usize>) -> bool {
    members.is_sorted() && members.iter().all(|&own| usize::try_from(own).is_ok_and(|own| range.contains(&own)))
}

fn holds(frame: &Frame, range: &Range<usize>, check: fn(&[i64], &Range<usize>) -> bool) -> bool {
    matches!(frame.column("member"), Some(Cells::Wholes(members)) if check(members, range))
}

fn join(
    target: &Path,
    parts: impl Iterator<Item = (PathBuf, Range<usize>)>,
    check: fn(&[i64], &Range<usize>) -> bool,
) -> Result<PathBuf, MergeError> {
    let failed = |error| MergeError::Io(target.to_path_buf(), error);
    let whole = WholeFile::create(target).map_err(failed)?;
    let mut joined: Option<Joined> = None;
    for (part, range) in parts {
        let wrong = |reason: String| MergeError::Part(part.clone(), reason);
        let frame = Frame::read(&part).map_err(|error| wrong(error.to_string()))?;
        if !holds(&frame, &range, check) {
            return Err(wrong(OTHER.to_string()));
        }
        let joined = match &mut joined {
            Some(joined) => joined,
            none => {
                let file = whole.writer().map_err(failed)?;
                none.insert(Joined::new(file, &frame).map_err(failed)?)
            }
        };
        if !joined.append(frame) {
            return Err(wrong("it has other columns than the first chunk".to_string()));
        }
        while joined.rows() >= joined.group {
            joined.group(joined.group).map_err(failed)?;
        }
    }
    if let Some(mut joined) = joined {
        if joined.rows() > 0 || !joined.begun {
            joined.group(joined.rows()).map_err(failed)?;
        }
        joined.writer.finish().map_err(failed)?;
    }
    whole.finish().map_err(failed)
}

/// A joined file in the making.
struct Joined {
    writer: FrameWriter,
    names: Vec<String>,
    /// Cells that are not written yet.
    cells: Vec<Cells>,
    /// Rows of a row group.
    group: usize,
    /// There is a row group.
    begun: bool,
}

impl Joined {
    /// With the columns and the metadata of the first part.
    fn new(file: File, first: &Frame) -> io::Result<Self> {
        let columns = || first.columns.iter().map(|(name, cells)| (name.as_str(), cells.kind()));
        let metadata: Vec<_> = first.metadata.iter().filter(|(key, _)| key != DONE_AGAIN).cloned().collect();
        Ok(Self {
            writer: FrameWriter::new(file, columns(), &metadata)?,
            names: columns().map(|(name, _)| name.to_string()).collect(),
            cells: columns().map(|(_, kind)| Cells::new(kind)).collect(),
            group: (GROUP / first.columns.len().max(1)).max(1),
            begun: false,
        })
    }

    /// Takes the cells of a part; false if it has other columns.
    fn append(&mut self, part: Frame) -> bool {
        let alike = self.names.len() == part.columns.len()
            && self.names.iter().zip(&part.columns).all(|(name, (other, _))| name == other);
        alike && self.cells.iter_mut().zip(part.columns).all(|(cells, (_, own))| cells.append(own))
    }

    fn rows(&self) -> usize {
        self.cells.first().map_or(0, Cells::len)
    }

    /// Writes the first rows as a row group.
    fn group(&mut self, rows: usize) -> io::Result<()> {
        let first: Vec<Cells> = self.cells.iter_mut().map(|cells| cells.split_first(rows)).collect();
        self.begun = true;
        self.writer.group(&first)
    }
}
