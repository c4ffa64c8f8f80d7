//! What a call can end in besides success.

use hyd_runtime::SolveError;

/// Status codes that both versions share.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(i32)]
pub(crate) enum Status {
    /// Done.
    Ok = 0,
    /// Not possible here, but perhaps with other values or a smaller step.
    Discard = 2,
    /// The instance is of no further use.
    Error = 3,
}

/// A call that was not done.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Fault {
    pub(crate) status: Status,
    pub(crate) message: String,
    /// The instance can go on all the same.
    pub(crate) harmless: bool,
}

impl Fault {
    /// A call that is wrong, such as one that does not fit the mode: nothing has changed.
    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self { status: Status::Error, message: message.into(), harmless: true }
    }

    /// The model cannot be solved on.
    pub(crate) fn end(error: &SolveError) -> Self {
        Self { status: Status::Error, message: error.to_string(), harmless: false }
    }

    /// The model cannot be solved here; the integrator may try other values.
    pub(crate) fn discard(error: &SolveError) -> Self {
        Self { status: Status::Discard, message: error.to_string(), harmless: true }
    }
}
