//! The rows of a row group until they are columns: in memory, and beyond a limit in a scratch file.
//!
//! A group should have thousands of rows, or its table of contents outweighs its values; rows of a large model do not fit into
//! memory in such numbers.  So blocks of rows are turned into columns and put aside, and a range of columns is read from all blocks
//! when the group is written.  Memory stays bounded by [`MEMORY`] for the rows and [`COLUMNS`] for the columns, twice.

use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use hyd_results::ScratchFile;

/// Bytes of rows that are kept in memory.
const MEMORY: usize = 32 << 20;
/// Bytes of columns that are looked at together.
const COLUMNS: usize = 16 << 20;
/// Rows that a group has at least where this takes no more than [`LARGEST`].
const FEWEST: usize = 8192;
/// Bytes of a group that is larger than memory.
const LARGEST: u64 = 1 << 30;
/// Columns that are filled together from rows: a few cache lines of each row.
const TILE: usize = 16;
/// Bytes of a number.
const BYTES: usize = size_of::<f64>();

/// Rows of equal width.
pub(crate) struct Rows {
    width: usize,
    /// The last ones, one after the other.
    recent: Vec<f64>,
    beside: PathBuf,
    scratch: Option<ScratchFile>,
    /// Rows of each block in the scratch file, which holds its columns one after the other.
    blocks: Vec<usize>,
    bytes: Vec<u8>,
}

impl Rows {
    /// No rows.  A scratch file, if there has to be one, stands in the folder of `beside`.
    pub(crate) fn new(width: usize, beside: &Path) -> Self {
        let beside = beside.to_path_buf();
        Self { width, recent: Vec::new(), beside, scratch: None, blocks: Vec::new(), bytes: Vec::new() }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.blocks.iter().sum::<usize>() + self.recent.len() / self.width
    }

    /// Appends a row, which `fill` writes; true if there are enough for a group.
    pub(crate) fn push(&mut self, fill: impl FnOnce(&mut Vec<f64>)) -> io::Result<bool> {
        fill(&mut self.recent);
        if (self.recent.len() + self.width) * BYTES <= MEMORY {
            return Ok(false);
        }
        let rows = self.len();
        if rows >= FEWEST || (rows * self.width * BYTES) as u64 >= LARGEST {
            return Ok(true);
        }
        self.put_aside()?;
        Ok(false)
    }

    /// How many columns [`Rows::columns`] gives at a time.
    pub(crate) fn columns_at_once(&self) -> usize {
        (COLUMNS / BYTES / self.len().max(1)).clamp(1, self.width)
    }

    /// The values of a range of columns, one column after the other.
    pub(crate) fn columns(&mut self, range: Range<usize>, out: &mut Vec<f64>) -> io::Result<()> {
        let all = self.len();
        out.clear();
        out.resize(range.len() * all, 0.0);
        let mut first = 0;
        if let Some(scratch) = &mut self.scratch {
            let file = scratch.file();
            for &rows in &self.blocks {
                let at = (first * self.width + range.start * rows) * BYTES;
                file.seek(SeekFrom::Start(at as u64))?;
                self.bytes.resize(range.len() * rows * BYTES, 0);
                file.read_exact(&mut self.bytes)?;
                for (bytes, column) in self.bytes.chunks_exact(rows * BYTES).zip(out.chunks_exact_mut(all)) {
                    let numbers =
                        bytes.chunks_exact(BYTES).map(|own| own.try_into().map_or(f64::NAN, f64::from_le_bytes));
                    column[first..first + rows].iter_mut().zip(numbers).for_each(|(value, number)| *value = number);
                }
                first += rows;
            }
        }
        turn(&self.recent, self.width, range, (&mut out[..], all, first));
        Ok(())
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        self.recent.clear();
        self.blocks.clear();
    }

    /// Writes the recent rows to the scratch file, as columns.
    fn put_aside(&mut self) -> io::Result<()> {
        let scratch = match &mut self.scratch {
            Some(scratch) => scratch,
            none => none.insert(ScratchFile::beside(&self.beside)?),
        };
        let before = self.blocks.iter().sum::<usize>() * self.width * BYTES;
        let file = scratch.file();
        file.seek(SeekFrom::Start(before as u64))?;
        let mut file = BufWriter::with_capacity(1 << 20, file);
        let rows = self.recent.len() / self.width;
        let mut columns = vec![0.0; TILE * rows];
        for first in (0..self.width).step_by(TILE) {
            let range = first..(first + TILE).min(self.width);
            let values = &mut columns[..range.len() * rows];
            turn(&self.recent, self.width, range, (&mut *values, rows, 0));
            for value in values.iter() {
                file.write_all(&value.to_le_bytes())?;
            }
        }
        file.flush()?;
        drop(file);
        self.blocks.push(rows);
        self.recent.clear();
        Ok(())
    }
}

/// A range of columns of rows to columns of the given length, from their position `first` on.
fn turn(rows: &[f64], width: usize, range: Range<usize>, (out, length, first): (&mut [f64], usize, usize)) {
    let tiles = range.clone().step_by(TILE).zip(out.chunks_mut(TILE * length));
    for (start, tile) in tiles {
        let count = TILE.min(range.end - start);
        for (k, row) in rows.chunks_exact(width).enumerate() {
            for (column, &value) in row[start..start + count].iter().enumerate() {
                tile[column * length + first + k] = value;
            }
        }
    }
}
