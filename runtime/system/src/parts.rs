//! What only some systems have, each a contract of its own that [`crate::DaeSystem`] hands out.
//!
//! No method of them has a body: a system says what it has, and then answers for all of it.

use std::sync::Arc;

use crate::dae::{EvalFailure, InputError, LoopError, StateChoice};
use crate::series::Series;

/// Initial equations with simplified forms of expressions (`homotopy`).
pub trait Homotopy {
    /// Lets the initial system be the simplified one (0), the actual one (1, after `bind`), or one between.
    fn set_homotopy(&mut self, share: f64);
}

/// Loops of equations whose variables are computed one after the other, all but a few.
pub trait TornLoops {
    /// The worst of the equations that close these loops, at a solution; none where nothing can be said.  Where neither of its numbers is
    /// near the rounding of numbers, rounding errors grow on the way.
    fn loop_error(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<LoopError>;

    /// The same for a solution of the initial system.
    fn initial_loop_error(&mut self, t0: f64, z: &[f64]) -> Option<LoopError>;
}

/// Relations, and discrete variables that may depend on them.
pub trait Switches {
    /// Finds truths and discrete values again at a point, for the same `pre`; true if they are not what they were, or do not come to rest.
    fn switch(&mut self, t: f64, y: &[f64], yp: &[f64]) -> bool;

    /// All truths and discrete values.
    fn switched(&mut self) -> Vec<f64>;

    /// Puts all truths and discrete values back.
    fn switch_back(&mut self, kept: &[f64]);
}

/// Unknowns of which some are states at a time, the others following from constraints.
pub trait StateChoices {
    /// Which unknowns are states at present: those of [`crate::Structure::differential`] but for the candidates that are not.
    fn states(&mut self, out: &mut [bool]);

    /// Judges the choice of states at consistent values, and changes it where another one is clearly better.  Values
    /// stay consistent and every unknown stays as smooth as it was, so that the past of an integrator keeps its worth;
    /// matrices do not.
    fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice;
}

/// Values that equations read of the past, one per delay site.
pub trait Delays {
    /// Upper bounds of the delay times in s (the delay time itself where it is fixed).
    fn delay_bounds(&mut self, out: &mut [f64]);

    /// What each delay site delays, and its delay time in s, at a point.
    fn delay_points(&mut self, t: f64, y: &[f64], yp: &[f64], sources: &mut [f64], times: &mut [f64]);

    /// Hands over the values and rates of the sources at the delayed times, and the delay times (s) that they belong to; they
    /// hold until the next call.  The solver calls this before every evaluation of which they are a part.  `initial_store`
    /// sets the values itself: at the start they are those of the sources, with rate 0.
    fn set_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]);
}

/// Inputs that follow recorded samples.
pub trait Inputs {
    /// Lets an input (position in [`crate::Structure::inputs`]) follow a series in the following runs; takes effect with `bind`.
    ///
    /// # Errors
    /// Why it cannot.
    fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError>;

    /// Lets an input (position in [`crate::Structure::inputs`]) have a value from now on, at every time until the next one is given.  That is
    /// no event: who gives values at will takes care of what jumps.
    ///
    /// # Errors
    /// There is no such input.
    fn give_input(&mut self, input: usize, value: f64) -> Result<(), InputError>;

    /// How far a step from `t` may lead (s) so that no feature of the inputs is stepped over.
    fn input_reach(&mut self, t: f64) -> f64;

    /// How many samples of the input with the most have passed at `t` (s).
    fn samples_passed(&mut self, t: f64) -> u64;
}

/// A system that follows every step of the solver, because it keeps a past of its own or decides about events there.
pub trait Steps {
    /// The solver has accepted a step to `t` (s) with these unknowns, has written all rows up to there, and asks for nothing before it
    /// any more.  True: an event happens at `t`.
    ///
    /// # Errors
    /// What failed; the run ends.
    fn completed(&mut self, t: f64, y: &[f64]) -> Result<bool, EvalFailure>;
}
