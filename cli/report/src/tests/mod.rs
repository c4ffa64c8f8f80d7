//! Whole pictures.

mod pictures;
