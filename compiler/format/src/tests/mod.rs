//! Whole texts: those of the repository and those drawn at random.

mod texts;
