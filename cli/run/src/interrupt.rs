//! Ctrl-C: a flag that long work looks at.
//!
//! The first Ctrl-C asks for an orderly end, the second ends the process at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit code after a second Ctrl-C: 128 plus the number of the signal, as shells report it.
const KILLED: i32 = 130;

/// From now on Ctrl-C sets the flag.  Where no handler can be installed, Ctrl-C ends the process as usual.
pub fn listen() {
    listen_for(Arc::default());
}

/// The same for work that looks at a flag of its own.
pub fn listen_for(flag: Arc<AtomicBool>) {
    let _ = ctrlc::set_handler(move || {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(KILLED);
        }
        flag.store(true, Ordering::Relaxed);
    });
}

/// From now on Ctrl-C does nothing to this process, whose end is the matter of another one.
pub fn ignore() {
    let _ = ctrlc::set_handler(|| {});
}

/// True after Ctrl-C.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}
