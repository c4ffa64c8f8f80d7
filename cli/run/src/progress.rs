//! How far a run has come, on a terminal only.
//!
//! One line on standard error, rewritten at most ten times a second and wiped at the end; nothing in a pipe.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(100);
/// Runs shorter than this show nothing.
const PATIENCE: Duration = Duration::from_millis(500);

/// The line of progress.
pub(crate) struct Progress {
    shown: bool,
    last: Instant,
    active: bool,
}

impl Progress {
    /// Nothing is shown yet.
    pub(crate) fn new() -> Self {
        let active = io::stderr().is_terminal();
        Self { shown: false, last: Instant::now() + PATIENCE - PERIOD, active }
    }

    /// Shows that the time `t` between `start` and `stop` (s) has been reached.
    pub(crate) fn at(&mut self, t: f64, start: f64, stop: f64) {
        if !self.active {
            return;
        }
        let now = Instant::now();
        if now < self.last + PERIOD {
            return;
        }
        (self.shown, self.last) = (true, now);
        let percent = 100.0 * (t - start) / (stop - start);
        // A terminal that cannot be written to shows no progress; the run goes on.
        let _ = write!(io::stderr(), "\r\u{1b}[Kt = {t:.6} s  {percent:.0} %");
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.shown {
            let _ = write!(io::stderr(), "\r\u{1b}[K");
        }
    }
}
