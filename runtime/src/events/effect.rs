//! Whether an event has any effect.
//!
//! A relation between two expressions that equations keep equal, as `abs(i) <= abs(v)*G` where `i = G*v`, changes with each rounding.  Its
//! event has no effect if integers, Booleans and all that changes at events only are as before, unknowns are within the
//! tolerance, and rates so near to what they were that they would not move an unknown beyond it within the whole run.

use hyd_system::{Place, ValueKind, Variability};

use crate::problem::Problem;
use crate::weights::Weights;

/// Part of the tolerance by which unknowns may differ.
const PART: f64 = 0.1;
/// Rates that move unknowns by less than so many tolerances within the run are nearly what they were.
const NEARLY: f64 = 1e3;
/// Both sides of a relation are equal but for rounding where their difference is smaller.
const ROUNDING: f64 = 1e-9;
/// Both sides of a relation are equal within the tolerance where their difference is less than so much of it.
const EQUAL: f64 = 0.5;

/// A value below this part of its size is zero but for rounding.
const NOTHING: f64 = 1e-20;

/// Makes those unknowns and rates zero that are so but for rounding: a speed of 1e-31 has no sign that a relation could go by, and with each
/// solution another one.  Rates are measured by the sizes of their unknowns in a second.
pub(crate) fn zero_what_is_rounding(weights: &Weights, y: &mut [f64], yp: &mut [f64]) {
    for values in [y, yp] {
        for (value, nominal) in values.iter_mut().zip(weights.nominals.iter()) {
            if value.abs() < NOTHING * nominal {
                *value = 0.0;
            }
        }
    }
}

/// What there was before an event or a pass of it.
pub(crate) struct Before {
    discrete: Vec<f64>,
    held: Vec<bool>,
    y: Vec<f64>,
    yp: Vec<f64>,
}

/// How much of an event is left.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Effect {
    /// Nothing is different.
    None,
    /// Unknowns are as before and rates nearly so, whatever has been switched.
    Slight,
    /// The solution goes on in another way.
    Full,
}

impl Before {
    /// Takes down what there is.
    pub(crate) fn new(problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64])) -> Self {
        let held = held(problem);
        Self { discrete: discrete_values(problem, t, (y, yp)), held, y: y.to_vec(), yp: yp.to_vec() }
    }

    /// What is different now, in a run of the length `span` (s).
    pub(crate) fn effect(
        &self,
        problem: &mut Problem<'_>,
        weights: &Weights,
        (t, span): (f64, f64),
        (y, yp): (&[f64], &[f64]),
    ) -> Effect {
        let mut states = problem.system.structure().differential.clone();
        problem.system.states(&mut states);
        let (mut moved, mut drift) = (0.0_f64, 0.0_f64);
        for k in 0..y.len() {
            moved = moved.max((y[k] - self.y[k]).abs() * weights.all[k]);
            let turned = (yp[k] - self.yp[k]).abs();
            if states[k] && turned > 0.0 {
                drift = drift.max(turned * span * weights.all[k]);
            }
        }
        match (moved, drift) {
            (moved, _) if moved > PART => Effect::Full,
            (_, drift) if drift <= PART && self.discrete == discrete_values(problem, t, (y, yp)) => Effect::None,
            (_, drift) if drift <= NEARLY => Effect::Slight,
            _ => Effect::Full,
        }
    }

    /// True if nothing is different now but the truth of relations whose sides are equal but for rounding.
    pub(crate) fn differs_by_rounding(
        &self,
        problem: &mut Problem<'_>,
        weights: &Weights,
        (t, span): (f64, f64),
        (y, yp): (&[f64], &[f64]),
    ) -> bool {
        self.switched_within(ROUNDING, problem, t, (y, yp))
            && self.effect(problem, weights, (t, span), (y, yp)) == Effect::None
    }

    /// True if relations and discrete variables are what they were two passes ago (`earlier`), and the pass in between has neither moved the
    /// unknowns beyond the tolerance nor changed their rates noticeably.  The sides of the relations that switch to and fro are equal within the
    /// tolerance, and either truth gives the same solution: whether a switch without a current conducts does not matter.
    pub(crate) fn alternates(
        &self,
        earlier: &Before,
        problem: &mut Problem<'_>,
        weights: &Weights,
        (t, span): (f64, f64),
        (y, yp): (&[f64], &[f64]),
    ) -> bool {
        earlier.held == held(problem)
            && earlier.discrete == discrete_values(problem, t, (y, yp))
            && self.switched_within(EQUAL * weights.tolerance(), problem, t, (y, yp))
            && self.effect(problem, weights, (t, span), (y, yp)) != Effect::Full
    }

    /// True if relations have switched whose sides are equal within the tolerance, and nothing else: unknowns are within it where they were,
    /// discrete variables as they were, and rates nearly so.
    pub(crate) fn switches_what_is_equal(
        &self,
        problem: &mut Problem<'_>,
        weights: &Weights,
        (t, span): (f64, f64),
        (y, yp): (&[f64], &[f64]),
    ) -> bool {
        self.discrete == discrete_values(problem, t, (y, yp))
            && self.switched_within(EQUAL * weights.tolerance(), problem, t, (y, yp))
            && self.effect(problem, weights, (t, span), (y, yp)) != Effect::Full
    }

    /// True if relations have switched, and the sides of each of them are no further apart.
    fn switched_within(&self, apart: f64, problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64])) -> bool {
        let held = held(problem);
        let mut roots = vec![0.0; held.len()];
        problem.system.roots(t, y, yp, &mut roots);
        let mut switched = (0..held.len()).filter(|&k| held[k] != self.held[k]).peekable();
        switched.peek().is_some() && switched.all(|k| roots[k].abs() <= apart)
    }
}

fn held(problem: &Problem<'_>) -> Vec<bool> {
    let mut held = vec![false; problem.system.structure().roots];
    problem.system.held(&mut held);
    held
}

/// Values of all variables that change at events only.
fn discrete_values(problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64])) -> Vec<f64> {
    let mut values = vec![0.0; problem.system.structure().outputs];
    problem.system.outputs(t, y, yp, &mut values);
    let tables = problem.system.tables().clone();
    let steps = tables
        .variables
        .iter()
        .filter(|variable| variable.variability == Variability::Discrete || !matches!(variable.kind, ValueKind::Real));
    let places = steps.flat_map(|variable| &variable.sources).filter_map(|source| match source.place {
        Place::Output(place) => Some(values[place as usize]),
        _ => None,
    });
    places.collect()
}
