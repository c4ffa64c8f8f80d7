//! Where the rows of a run go.
//!
//! A sink is told once what the rows mean (`begin`) and then gets row after row in the order of time.  It does not learn
//! how the run ended: whoever owns the sink decides whether what was collected is kept, so that an aborted run never
//! looks like a complete one by accident.

use std::io;
use std::sync::Arc;

use hyd_system::Tables;

/// What a row stands for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RowKind {
    /// An output point between events.
    Normal,
    /// The last values before an event.
    BeforeEvent,
    /// The first values after an event, at the same time.
    AfterEvent,
    /// A point on the way that nobody asked to be shown: only runs that are measured have them.
    Within,
}

/// A receiver of rows.
pub trait Sink {
    /// Starts a run; earlier content is dropped.  `parameters` are the values after binding, as the tables address them.
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()>;

    /// Takes the values of all recorded variables at time `t` (s).
    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()>;
}

/// A sink that ends up in a file.
pub trait RowFile: Sink {
    /// Writes out what is buffered and whatever the format wants at the end; no rows may follow.
    fn finish(&mut self) -> io::Result<()>;
}

/// A sink that keeps nothing.
#[derive(Clone, Copy, Default, Debug)]
pub struct Discard;

impl Sink for Discard {
    fn begin(&mut self, _tables: &Arc<Tables>, _parameters: &[f64]) -> io::Result<()> {
        Ok(())
    }

    fn row(&mut self, _t: f64, _values: &[f64], _kind: RowKind) -> io::Result<()> {
        Ok(())
    }
}

/// Two sinks that get the same rows.
pub struct Tee<'a>(pub &'a mut dyn Sink, pub &'a mut dyn Sink);

impl Sink for Tee<'_> {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.0.begin(tables, parameters)?;
        self.1.begin(tables, parameters)
    }

    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()> {
        self.0.row(t, values, kind)?;
        self.1.row(t, values, kind)
    }
}
