//! Calls of tools: one after the other on a thread of their own, each of which can be ended.

use std::cell::OnceCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender};

use hyd_doc::Library;
use hyd_verbs::Libraries;
use serde_json::Value;

use crate::answer::Answer;
use crate::arguments::Given;
use crate::folder::Folder;
use crate::kept::Kept;
use crate::progress::Progress;
use crate::protocol::{Code, Fault, Outgoing, Request};
use crate::server::Event;
use crate::tools::Tool;

/// Where tools work.
pub(crate) struct Workplace {
    pub(crate) folder: Folder,
    pub(crate) libraries: Libraries,
    pub(crate) strict_units: bool,
    /// The classes that documentation is asked of, once somebody has asked.
    pub(crate) classes: OnceCell<Library>,
}

impl Workplace {
    pub(crate) fn new(folder: Folder, libraries: Libraries, strict_units: bool) -> Self {
        Self { folder, libraries, strict_units, classes: OnceCell::new() }
    }

    /// The libraries of the server with those that a call names.
    pub(crate) fn libraries(&self, given: &Given) -> Result<Libraries, String> {
        let mut libraries = self.libraries.clone();
        for name in given.texts("libraries") {
            libraries.folders.push(self.folder.library("libraries", &name)?);
        }
        Ok(libraries)
    }
}

/// What one call has at hand.
pub(crate) struct Call<'a> {
    pub(crate) workplace: &'a Workplace,
    pub(crate) given: Given,
    pub(crate) kept: Kept<'a>,
    pub(crate) progress: &'a Progress,
    stop: &'a Arc<AtomicBool>,
}

impl Call<'_> {
    /// True when the work is to end.
    pub(crate) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Set when the work is to end.
    pub(crate) fn stop(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }
}

/// How a call is ended from outside.
#[derive(Clone)]
pub(crate) struct Handle {
    /// The number of its request.
    pub(crate) id: Value,
    /// Work that asks ends at its next point of rest.
    pub(crate) stop: Arc<AtomicBool>,
    /// Nobody waits for the answer.
    pub(crate) taken_back: Arc<AtomicBool>,
    pub(crate) progress: Arc<Progress>,
}

impl Handle {
    /// The work is to end, and the answer is not wanted.
    pub(crate) fn take_back(&self) {
        self.taken_back.store(true, Ordering::Relaxed);
        self.progress.end();
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// A call that waits for its turn.
pub(crate) struct Job {
    pub(crate) request: Request,
    pub(crate) tool: &'static Tool,
    pub(crate) given: Given,
    pub(crate) handle: Handle,
}

/// Works calls off until there are no more; says so after each.
pub(crate) fn work(workplace: &Workplace, jobs: &Receiver<Job>, outgoing: &Outgoing, events: &Sender<Event>) {
    for job in jobs {
        let Job { request, tool, given, handle } = job;
        // Each call is a command of its own.
        hyd_results::forget_read();
        let kept = Kept::new(&handle.progress);
        let call = Call { workplace, given, kept, progress: &handle.progress, stop: &handle.stop };
        let result = match catch_unwind(AssertUnwindSafe(|| (tool.run)(&call))) {
            Ok(answer) => Ok(answer.unwrap_or_else(Answer::refused).result()),
            Err(_) => {
                let sentence = format!("`{}` has met a mistake of the program itself; the server goes on", tool.name);
                Err(Fault::new(Code::Internal, sentence))
            }
        };
        handle.progress.end();
        if !handle.taken_back.load(Ordering::Relaxed) {
            outgoing.send(&request.answer(result));
        }
        if events.send(Event::Done).is_err() {
            return;
        }
    }
}
