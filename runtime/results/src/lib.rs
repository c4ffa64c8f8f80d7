//! Results of runs: where rows of a run go, how they are kept, written and read again.
//!
//! A solver hands rows to a [`Sink`]: a [`Trajectory`] keeps them in memory, a [`CsvFile`] streams them to disk, [`Discard`]
//! drops them.  Names, signs and places of values come from the system's [`hyd_system::Tables`]; the rows themselves are plain
//! numbers.  An event is two rows of equal time, the first before and the second after it, and interpolation never
//! looks across such a pair.  The crate knows no solver and draws no pictures.

mod column;
mod csv_file;
mod interpolation;
mod sink;
mod table;
mod trajectory;

pub use column::{Column, columns, is_variable};
pub use csv_file::{CsvFile, CsvStream, format_number};
pub use interpolation::{Side, interpolate};
pub use sink::{Discard, RowKind, Sink, Tee};
pub use table::{ReadError, Table};
pub use trajectory::{Series, Trajectory};
