//! Derivatives of everything that a system computes, along given directions: the contract for forward sensitivities.
//!
//! A *direction* is a parameter or a start value that is varied by one unit, or nothing at all (a direction for which the
//! caller alone brings derivatives, such as the passing of time).  For an evaluation `r = f(t, y, y', parameters, discrete
//! variables)` the tangent along direction `j` is `f_t dt_j + f_y dy_j + f_y' dy'_j + f_p dp_j + f_d dd_j`; the caller gives
//! `dt`, `dy`, `dy'`, the system keeps `dp` (through dependent parameters and the initial system) and `dd` (through
//! events).  Relations keep their truth, so their derivative is zero; the moving of an event is the caller's matter
//! (Feehery, Tolsma, Barton, Appl. Numer. Math. 25 (1997) 41; Galan, Feehery, Barton, Appl. Numer. Math. 31 (1999) 17).
//!
//! Blocks hold all directions of one value next to each other: entry `k*width + j` belongs to value `k` and direction `j`.

use crate::EventPhase;

/// What is varied.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Direction {
    /// A parameter: position in `DaeSystem::parameters`.
    Parameter(u32),
    /// The start value of a variable: index into `Tables::variables`, and element.
    Start(u32, u32),
    /// Nothing that the system knows of.
    None,
}

/// Why a direction is refused.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum DirectionError {
    /// The parameter is computed or fixed at translation, so it cannot be varied.
    NotSettable,
    /// The variable has no start value that enters the equations.
    NoStart,
    /// No derivatives are at hand: a sentence.
    Unsupported(String),
}

/// Derivatives of time, unknowns and rates that a tangent is taken along.
#[derive(Clone, Copy, Debug)]
pub struct Along<'a> {
    /// `width` derivatives of time.
    pub t: &'a [f64],
    /// n blocks, derivatives of `y`.
    pub y: &'a [f64],
    /// n blocks, derivatives of `y'`.
    pub yp: &'a [f64],
}

/// Tangents of the evaluations of a [`crate::DaeSystem`].  No method allocates but `set_directions`.
///
/// Each method belongs to the one of the same name without `_tangent` and is called at the same point, after it.
pub trait Tangents {
    /// Sets the directions for the following runs; the width of all blocks is their number.
    ///
    /// # Errors
    /// Position of the direction that is refused, and why.
    fn set_directions(&mut self, directions: &[Direction]) -> Result<(), (usize, DirectionError)>;

    /// Derivatives of dependent parameters, start values and discrete variables at the start; call after `bind`.
    fn bind_tangent(&mut self, t0: f64);

    /// Takes over the derivatives of the values that inputs were given ([`crate::Inputs::give_input`]), one block per input, for the
    /// calls that follow up to the next `bind_tangent`; all are zero before the first call.  `jacobian_tangent` holds inputs as it holds
    /// unknowns.
    fn set_input_tangents(&mut self, values: &[f64]);

    /// Tangent of G(z) with `z` held, as many blocks as rows.
    fn initial_residual_tangent(&mut self, t0: f64, z: &[f64], out: &mut [f64]);

    /// Tangents of `y`, `y'` and of the parameters and discrete variables solved for, from the derivatives `dz` of `z`.
    fn initial_store_tangent(&mut self, t0: f64, z: &[f64], dz: &[f64], dy: &mut [f64], dyp: &mut [f64]);

    /// Tangent of F(t, y, y'), n blocks.
    fn residual_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]);

    /// Jacobians as `DaeSystem::jacobian` gives them, dF/dy and dF/dy', and the tangent of F with time, `y` and `y'`
    /// held, n blocks.
    fn jacobian_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], jacobians: (&mut [f64], &mut [f64]), out: &mut [f64]);

    /// Number of branches without an event among the Jacobians.
    fn branches(&mut self) -> usize;

    /// The quantities whose sign decides these branches, such as `a - b` of `noEvent(a < b)`.
    fn branch_values(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]);

    /// Tangents of the root functions.
    fn roots_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]);

    /// Derivatives of the instant of the time event at `t`, one block; false if there is no such event.
    fn instant_tangent(&mut self, t: f64, out: &mut [f64]) -> bool;

    /// To be called before each `event_pass` with the same arguments and the total derivatives along the moving event:
    /// notes the derivatives of `pre` values.
    fn before_event_pass(&mut self, phase: EventPhase, t: f64, y: &[f64], yp: &[f64], along: Along<'_>);

    /// To be called after each `event_pass`, with `y` as it was before: derivatives of discrete variables, and of the
    /// unknowns that `reinit` wrote, which replace those in `dy`.  True if a derivative kept by the system changed.
    fn after_event_pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &[f64],
        yp: &[f64],
        along: Along<'_>,
        dy: &mut [f64],
    ) -> bool;

    /// Takes over the derivatives of all delayed values and of their rates, one block per delay site, at the delay
    /// times `times` (s), for the calls that follow.  That of a varying delay time through `rate * time` is not in
    /// them: the equations have it.
    fn set_delayed_tangents(&mut self, values: &[f64], rates: &[f64], times: &[f64]);

    /// Tangents of `delay_points`: of what the sites delay, and of their delay times.
    fn delay_points_tangent(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        along: Along<'_>,
        sources: &mut [f64],
        times: &mut [f64],
    );

    /// Outputs (positions in a row) whose tangents are looked at from now on, all if none are named; the others may have any value.
    fn select_outputs(&mut self, wanted: Option<&[u32]>);

    /// Tangents of the row of outputs.
    fn outputs_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]);

    /// Derivatives of all parameters, in the order of `DaeSystem::parameters`.
    fn parameters_tangent(&mut self, out: &mut [f64]);
}
