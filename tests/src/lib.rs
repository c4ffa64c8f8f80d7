//! What the tests of the whole path share: models found by listing, runs on a grid, reference data, an independent drive.
//!
//! `models` finds and compiles the models of the repository through the façade of the compiler, `runs` simulates them,
//! `numerics` holds problems with published end values, `reference` reads the stored solutions and compares with them.
//! `dormand_prince`, `drive_equations`, `other_drives` and `least_squares` are
//! written for the tests alone and use no crate of the product, so that agreement with them means something.

pub mod dormand_prince;
pub mod drive_equations;
pub mod least_squares;
pub mod models;
pub mod numerics;
pub mod other_drives;
pub mod queue;
pub mod reference;
pub mod runs;
pub mod scale;
