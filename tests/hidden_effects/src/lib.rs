//! Benches with hidden effects, and the evaluation of a tool that has to find them.  The drive is written a second time here, by
//! hand, in other states and with another integrator than the product's, so that what is judged and what judges share nothing.

pub mod contents;
pub mod diagram;
pub mod disturb;
pub mod draft;
pub mod drive;
pub mod effects;
pub mod evaluate;
pub mod files;
pub mod integrator;
pub mod known;
pub mod line;
pub mod machine;
pub mod matching;
pub mod measure;
pub mod plan;
pub mod power;
pub mod random;
pub mod rows;
pub mod shot;
pub mod statistics;
pub mod summary;
