//! Ctrl-C: a flag that long work looks at.
//!
//! The first Ctrl-C asks for an orderly end, the second ends the process at once.

use std::sync::atomic::{AtomicBool, Ordering};

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Exit code after a second Ctrl-C: 128 plus the number of the signal, as shells report it.
const KILLED: i32 = 130;

/// From now on Ctrl-C sets the flag.  Where no handler can be installed, Ctrl-C ends the process as usual.
pub fn listen() {
    let _ = ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(KILLED);
        }
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
