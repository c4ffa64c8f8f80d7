//! The machines of `models` and the effects of the library, against what does not come from the compiler.
//!
//! `oracles` has stored solutions of another code, `drives`, `operating_points` and `effects` equations written by hand, `paper` printed
//! numbers, `books` and `energy` balances, `water_hammer` and `wave_lines` the theory of lines.

mod books;
mod drives;
mod effects;
mod energy;
mod generic_effects;
mod operating_points;
mod oracles;
mod paper;
mod water_hammer;
mod wave_lines;
