//! Signals of the interpreter during long work: Ctrl-C ends a run at its next step, and everything else at its next point of rest.
//!
//! Python handles signals in its main thread, when it is asked to (`PyErr_CheckSignals`).  A run that goes on in the calling thread asks between
//! steps, about fifty times a second; work on several threads leaves the calling thread to ask.

use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// Time between two questions.
const PERIOD: Duration = Duration::from_millis(20);
/// Most steps between two looks at the clock.
const MOST_STEPS: u32 = 1 << 12;

/// Asks between steps.
pub(crate) struct Signals {
    asked: Cell<Instant>,
    looked: Cell<Instant>,
    steps: Cell<u32>,
    left: Cell<u32>,
    caught: RefCell<Option<PyErr>>,
}

impl Signals {
    pub(crate) fn new() -> Self {
        let now = Instant::now();
        let caught = RefCell::new(None);
        Self { asked: Cell::new(now), looked: Cell::new(now), steps: Cell::new(1), left: Cell::new(1), caught }
    }

    /// True when a handler of a signal has raised an exception.  Steps of small models are shorter than a look at the clock, so that the number of
    /// steps between two looks adapts itself.
    pub(crate) fn stop(&self) -> bool {
        if self.left.get() > 1 {
            self.left.set(self.left.get() - 1);
            return false;
        }
        let now = Instant::now();
        let (since, steps) = (now - self.looked.get(), self.steps.get());
        let steps = if since < PERIOD / 4 { (2 * steps).min(MOST_STEPS) } else { (steps / 2).max(1) };
        self.looked.set(now);
        self.steps.set(steps);
        self.left.set(steps);
        if now - self.asked.get() >= PERIOD && self.caught.borrow().is_none() {
            self.asked.set(now);
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.caught.replace(Some(error));
            }
        }
        self.caught.borrow().is_some()
    }

    /// The exception.
    pub(crate) fn caught(self) -> Option<PyErr> {
        self.caught.into_inner()
    }
}

/// Does work on a thread of its own, with the interpreter's lock released; `stop` is set when a signal has raised an exception, which is given
/// beside what the work gave.  `turn` is called now and then with the lock held.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    stop: &AtomicBool,
    work: impl FnOnce() -> T + Send,
    turn: &(dyn Fn(Python<'_>) -> PyResult<()> + Sync),
) -> PyResult<(T, Option<PyErr>)> {
    let (result, caught) = py.detach(|| {
        std::thread::scope(|scope| {
            let (done, ended) = mpsc::channel::<()>();
            let worker = scope.spawn(move || {
                let result = work();
                // Who waits has gone only if this thread has ended.
                let _ = done.send(());
                result
            });
            let mut caught = None;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(PERIOD) {
                if caught.is_none()
                    && let Err(error) = Python::attach(|py| py.check_signals().and_then(|()| turn(py)))
                {
                    stop.store(true, Ordering::Relaxed);
                    caught = Some(error);
                }
            }
            (worker.join(), caught)
        })
    });
    match result {
        Ok(result) => Ok((result, caught)),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}
