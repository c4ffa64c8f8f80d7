//! Data frames: Parquet files of runs and of tables, written group by group and read again.
//!
//! A [`RunStream`] takes the rows of one run; a [`FrameWriter`] takes groups of equally long [`Cells`]; a [`Frame`] is a file read
//! back whole.  The only crate that knows the Parquet library; it is apart from `hyd-results` because that library is large.

mod cells;
mod page;
mod reader;
mod rows;
mod run_stream;
mod writer;

pub use cells::{Cells, Kind};
pub use reader::Frame;
pub use run_stream::RunStream;
pub use writer::{Chunk, FrameWriter, GroupWriter};

/// Whether the name of a file says that it is one of Parquet.
pub fn is_parquet(path: &std::path::Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet"))
}

/// The system's error where there is one behind it, so that a full disk is called one.
fn into_io(error: parquet::errors::ParquetError) -> std::io::Error {
    match error {
        parquet::errors::ParquetError::External(inner) => match inner.downcast::<std::io::Error>() {
            Ok(error) => *error,
            Err(other) => std::io::Error::other(other.to_string()),
        },
        other => std::io::Error::other(other.to_string()),
    }
}
