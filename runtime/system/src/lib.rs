//! The contract between who makes a system of equations and who solves it.
//!
//! A system is `F(t, y, y') = 0` with `n` unknowns `y`, of which some are differential (their derivative occurs) and the
//! others algebraic, plus root functions, discrete variables behind an event pass, parameters, start values and an
//! initial system of its own ([`DaeSystem`]).  Names, units and places in the text come along as plain data
//! ([`Tables`]).  The crate knows no solver and no compiler; compiled models and hand-written Rust implement the same trait.
//! The notation follows Brenan, Campbell, Petzold, "Numerical Solution of Initial-Value Problems in Differential-
//! Algebraic Equations" (SIAM 1996), chapter 5; events follow the Modelica language specification 3.6, section 8.6.

// Tests compare with the functions of the machine.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod angles;
pub mod by_part;
mod dae;
pub mod given;
mod instant;
mod lanes;
pub mod math;
mod parts;
pub mod powers;
pub mod random;
mod series;
mod tables;
mod tangents;
mod text;

pub use dae::{
    AssertionReport, CheckKind, Contradicted, DaeSystem, DelaySite, EvalFailure, EventChange, EventPhase, Excerpt,
    InitialStructure, InputError, InputSite, LearnedSize, LoopError, ParameterError, Pattern, Reading, StateChoice,
    Structure, TimeEvent, UNSET,
};
pub use instant::Instants;
pub use lanes::{LANES, wide};
pub use parts::{Delays, Homotopy, Inputs, StateChoices, Steps, Switches, TornLoops};
pub use series::{Gap, Hold, Sample, Series, SeriesError, fill_gaps};
pub use tables::{
    EquationInfo, LoopInfo, MemberKind, NamePattern, Place, RootInfo, Settable, Source, Tables, ValueKind, Variability,
    VariableInfo,
};
pub use tangents::{Along, Direction, DirectionError, Tangents};
pub use text::{TextFormat, as_known, significant, told_apart};
