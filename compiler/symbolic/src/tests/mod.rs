//! Properties of expressions drawn at random.

mod properties;
