//! The thread that checks documents: the newest text wins, and documents that nobody types in wait until nobody types.

use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::check::{Checked, Watch, check};
use crate::documents::Documents;
use crate::session::{Session, Settings};

/// How long nobody must have typed before the other documents are checked again.
const PAUSE: Duration = Duration::from_millis(250);

/// What is known of each document.
pub(crate) type Results = Arc<Mutex<BTreeMap<PathBuf, Arc<Checked>>>>;

/// Takes what a check found, and what went wrong in the server itself.
pub(crate) trait Listener: Send {
    /// A check has ended, or (`whole` false) the class that is edited is known.
    fn checked(&self, checked: &Arc<Checked>, whole: bool);
    /// A fault of ours.
    fn fault(&self, sentence: String);
}

/// What the thread is to do.
#[derive(Default)]
struct Wishes {
    documents: Documents,
    settings: Arc<Settings>,
    /// Documents whose texts have changed, each with the byte of the change; the newest first.
    changed: VecDeque<(PathBuf, Option<usize>)>,
    /// Documents that may depend on those.
    others: VecDeque<PathBuf>,
    /// Counts all wishes.
    count: u64,
    over: bool,
}

/// The way to the thread.
#[derive(Clone, Default)]
pub(crate) struct Checker {
    shared: Arc<(Mutex<Wishes>, Condvar)>,
}

/// What a fault leaves is as good as what was there before: every field is written whole.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Checker {
    /// A document has this text now; `byte`: where it changed.
    pub(crate) fn changed(&self, documents: &Documents, settings: &Arc<Settings>, path: PathBuf, byte: Option<usize>) {
        self.wish(documents, settings, |wishes| {
            wishes.changed.retain(|(known, _)| *known != path);
            let others: Vec<PathBuf> = wishes.documents.iter().map(|document| document.path.clone()).collect();
            wishes.others = others.into_iter().filter(|other| *other != path).collect();
            wishes.changed.push_front((path, byte));
        });
    }

    /// Files or settings have changed: everything is checked again.
    pub(crate) fn all(&self, documents: &Documents, settings: &Arc<Settings>) {
        self.wish(documents, settings, |wishes| {
            wishes.others = wishes.documents.iter().map(|document| document.path.clone()).collect();
        });
    }

    /// Ends the thread.
    pub(crate) fn end(&self) {
        locked(&self.shared.0).over = true;
        self.shared.1.notify_all();
    }

    fn wish(&self, documents: &Documents, settings: &Arc<Settings>, wish: impl FnOnce(&mut Wishes)) {
        let mut wishes = locked(&self.shared.0);
        wishes.documents = documents.clone();
        wishes.settings = settings.clone();
        wish(&mut wishes);
        wishes.count += 1;
        self.shared.1.notify_all();
    }

    /// Works until the end.
    pub(crate) fn run(&self, results: &Results, listener: &dyn Listener) {
        let mut session = Session::new(Arc::default());
        while let Some((path, byte, count)) = self.next(&mut session) {
            let Some(document) = session.documents.iter().find(|document| document.path == path).cloned() else {
                locked(results).remove(&path);
                continue;
            };
            let go_on = || {
                let wishes = locked(&self.shared.0);
                let is_open = !wishes.over && wishes.documents.is_open(&path);
                is_open && (wishes.count == count || !wishes.changed.iter().any(|(known, _)| *known == path))
            };
            let before = locked(results).get(&path).cloned();
            let line = byte.map_or(0, |byte| document.lines.line_of(byte));
            let mut first = |checked: Checked, class: &str| {
                let checked = match &before {
                    Some(before) => checked.with_others(before, class, line),
                    None => checked,
                };
                listener.checked(&Arc::new(checked), false);
            };
            let mut watch = Watch { changed: byte, go_on: &go_on, first: &mut first };
            let done = catch_unwind(AssertUnwindSafe(|| check(&mut session, &document, &mut watch)));
            match done {
                Ok(Some(checked)) => {
                    let checked = Arc::new(checked);
                    locked(results).insert(path, checked.clone());
                    listener.checked(&checked, true);
                }
                Ok(None) => {}
                Err(_) => {
                    session.forget();
                    listener.fault(format!("a fault of the server while it checked `{}`", path.display()));
                }
            }
        }
    }

    /// The next document to check, with the state of everything then.
    fn next(&self, session: &mut Session) -> Option<(PathBuf, Option<usize>, u64)> {
        let mut wishes = locked(&self.shared.0);
        loop {
            if wishes.over {
                return None;
            }
            let mut chosen = wishes.changed.pop_front();
            if chosen.is_none() && !wishes.others.is_empty() {
                let count = wishes.count;
                let waited = self.shared.1.wait_timeout(wishes, PAUSE).unwrap_or_else(PoisonError::into_inner);
                wishes = waited.0;
                if wishes.count != count || wishes.over {
                    continue;
                }
                chosen = wishes.others.pop_front().map(|path| (path, None));
                // Those behind it need not wait again.
                while let Some(path) = wishes.others.pop_front() {
                    wishes.changed.push_back((path, None));
                }
            }
            if let Some((path, byte)) = chosen {
                session.documents = wishes.documents.clone();
                session.settings = wishes.settings.clone();
                return Some((path, byte, wishes.count));
            }
            wishes = self.shared.1.wait(wishes).unwrap_or_else(PoisonError::into_inner);
        }
    }
}
