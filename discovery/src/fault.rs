//! What ends the work on a study: a sentence for the user, with the file it is about.

use std::fmt;

/// A study, a set of measurements or a model that cannot be worked with.
#[derive(Clone, PartialEq, Debug)]
pub struct Fault {
    /// What is wrong and what to do.
    pub sentence: String,
    /// True when a run of the model failed, not the data or the text.
    pub solver: bool,
}

impl Fault {
    /// Something in a text or in the data.
    pub fn new(sentence: impl Into<String>) -> Self {
        Self { sentence: sentence.into(), solver: false }
    }

    /// A run that failed.
    pub fn run(sentence: impl Into<String>) -> Self {
        Self { sentence: sentence.into(), solver: true }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.sentence)
    }
}

impl std::error::Error for Fault {}
