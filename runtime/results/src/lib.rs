//! Results of runs: where rows of a run go, how they are kept, written and read again.
//!
//! A solver hands rows to a [`Sink`]: a [`Trajectory`] keeps them in memory, a [`ResultFile`] streams them to disk,
//! [`Discard`] drops them.  Names, signs and places of values come from the system's [`hyd_system::Tables`]; the rows
//! themselves are plain numbers.  An event is two rows of equal time, the first before and the second after it, and
//! interpolation never looks across such a pair.  The crate knows no solver and draws no pictures.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod column;
mod csv_stream;
mod deviation;
mod interpolation;
mod line_limit;
mod mat5;
mod mat_columns;
mod mat_matrices;
mod mat_reader;
mod mat_stream;
mod matrices;
mod read_files;
mod result_file;
mod scratch_file;
mod sink;
mod table;
mod tracks;
mod trajectory;
mod whole_file;

#[cfg(test)]
mod tests;

pub use column::{Column, Keep, columns, described_columns, is_variable};
pub use csv_stream::{CsvStream, format_number};
pub use deviation::{Deviation, deviations};
pub use interpolation::{Side, interpolate};
pub use mat_columns::{MatColumns, mat_columns};
pub use mat_matrices::{NamedMatrix, mat_matrices};
pub use mat_stream::MatStream;
pub use matrices::Matrices;
pub use read_files::{forget_read, note_read, read_as, refuse_read};
pub use result_file::{Format, ResultFile, partial};
pub use scratch_file::ScratchFile;
pub use sink::{Discard, RowFile, RowKind, Sink, Tee};
pub use table::{ReadError, Table};
pub use tracks::{Origin, Tracks};
pub use trajectory::{Series, Trajectory};
pub use whole_file::{WholeFile, write_whole};
