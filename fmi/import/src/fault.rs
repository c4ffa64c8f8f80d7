//! Why a unit cannot be used: a sentence for its user.

use std::fmt;

/// A sentence that names the unit and what is wrong with it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Fault(String);

impl Fault {
    pub(crate) fn new(sentence: impl Into<String>) -> Self {
        Self(sentence.into())
    }

    /// The same said of a file.
    pub(crate) fn of(file: &str, sentence: impl fmt::Display) -> Self {
        Self(format!("`{file}`: {sentence}"))
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Fault {}
