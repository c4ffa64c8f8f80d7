//! Models at random, their texts, and what they compute, without the product.
//!
//! The generator makes a [`model::Model`]: small, well conditioned, over the whole profile of the language.  `print` writes
//! its text, in several forms that mean the same; `evaluate` computes it directly; `shrink` makes it smaller while something
//! remains true of it.  This package depends on no other: agreement of the product with it means something.

pub mod evaluate;
pub mod generate;
pub mod model;
pub mod print;
pub mod random;
pub mod shrink;
pub mod visit;
