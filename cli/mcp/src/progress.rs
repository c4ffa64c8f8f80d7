//! How far a call has come, told to a client that asked for it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::protocol::Outgoing;

/// Shortest time between two notifications of parts that are done.
const PERIOD: Duration = Duration::from_millis(200);
/// After so long without a word a call says that it is still at work.
const SILENCE: Duration = Duration::from_secs(5);
/// What a notification goes beyond the one before at least (s): progress must increase.
const LEAST: f64 = 1e-3;

/// The progress of one call.
pub(crate) struct Progress {
    /// By which the client knows the call; none: it did not ask.
    token: Option<Value>,
    outgoing: Arc<Outgoing>,
    begin: Instant,
    state: Mutex<State>,
}

struct State {
    last: f64,
    told: Instant,
    /// Progress is a number of parts, of which a life sign knows nothing.
    counts: bool,
    ended: bool,
}

impl Progress {
    pub(crate) fn new(token: Option<Value>, outgoing: Arc<Outgoing>) -> Self {
        let now = Instant::now();
        let state = State { last: 0.0, told: now, counts: false, ended: false };
        Self { token, outgoing, begin: now, state: Mutex::new(state) }
    }

    /// Something happened.
    pub(crate) fn step(&self, message: &str) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let seconds = self.begin.elapsed().as_secs_f64();
        self.tell(&mut state, seconds, None, message);
    }

    /// So many of all parts are done.
    pub(crate) fn part(&self, done: usize, all: usize) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.counts && (done as f64 <= state.last || state.told.elapsed() < PERIOD && done < all) {
            return;
        }
        state.counts = true;
        self.tell(&mut state, done as f64, Some(all), &format!("{done} of {all} runs"));
    }

    /// A sign of life after a long silence.
    pub(crate) fn beat(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.counts || state.told.elapsed() < SILENCE {
            return;
        }
        let seconds = self.begin.elapsed().as_secs_f64();
        self.tell(&mut state, seconds, None, &format!("at work for {seconds:.0} s"));
    }

    /// Tells nothing from now on.
    pub(crate) fn end(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).ended = true;
    }

    fn tell(&self, state: &mut State, progress: f64, total: Option<usize>, message: &str) {
        let Some(token) = self.token.as_ref().filter(|_| !state.ended) else { return };
        (state.last, state.told) = (progress.max(state.last + LEAST), Instant::now());
        let mut params = json!({"progressToken": token, "progress": state.last, "message": message});
        if let Some(total) = total {
            params["total"] = json!(total);
        }
        self.outgoing.send(&json!({"jsonrpc": "2.0", "method": "notifications/progress", "params": params}));
    }
}
