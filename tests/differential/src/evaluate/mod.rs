//! A model computed directly: statements one after the other, classic Runge-Kutta steps, events by bisection.
//!
//! Slow and plain on purpose; nothing of the product is used.  A run is made twice, the second time with half the steps,
//! so that a solution that the steps do not resolve is noticed.  What is not well defined, or too near to something else to be, is
//! *unclear*: two events almost at once, a relation that is almost touched, a loop without convergence.

mod builtin;
mod expression;
mod function;
mod implicit;
mod machine;
mod past;
mod run;
mod start;
mod trace;
mod value;

use machine::Machine;

use crate::model::{Expr, Model};

/// Values of all variables at the sampled instants.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The instants (s).
    pub times: Vec<f64>,
    /// Row by row the values of all variables, each as its elements.
    pub rows: Vec<Vec<Vec<f64>>>,
    /// Instants at which something happened (s).
    pub events: Vec<f64>,
}

/// Why there is no solution to compare with.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Trouble {
    /// The model is not clear enough; the generator makes another one.
    Unclear(String),
    /// The model makes no sense: a fault of the generator, or of a case that was made smaller.
    Wrong(String),
}

impl From<String> for Trouble {
    fn from(text: String) -> Self {
        match text.strip_prefix("unclear: ") {
            Some(reason) => Trouble::Unclear(reason.to_string()),
            None => Trouble::Wrong(text),
        }
    }
}

/// Steps in a second; time events fall on them.
const STEPS: usize = 128;
/// Largest relative difference of the two runs; the error of the finer one is a fifteenth of it where the solution is smooth.
const RESOLVED: f64 = 5e-6;
/// What is larger than this is not an answer of a stable model.
const BOUND: f64 = 1e4;

/// Computes a model at these instants; the stop time is one of them.
///
/// # Errors
/// When the model is not clear, or makes no sense.
pub fn evaluate(model: &Model, times: &[f64]) -> Result<Solution, Trouble> {
    let fine = Machine::new(model).run(times, STEPS)?;
    let coarse = Machine::new(model).run(times, STEPS / 2)?;
    if fine.events.len() != coarse.events.len() {
        return Err(Trouble::Unclear("the events depend on the steps".into()));
    }
    for ((t, a), b) in fine.times.iter().zip(&fine.rows).zip(&coarse.rows) {
        if fine.is_near_event(*t) {
            continue;
        }
        for ((id, a), b) in a.iter().enumerate().zip(b) {
            for (a, b) in a.iter().zip(b) {
                if model.variables[id].dropped {
                    continue;
                }
                let same = (a - b).abs() <= RESOLVED * (1.0 + a.abs());
                if !same || a.abs() > BOUND {
                    let name = &model.variables[id].name;
                    return Err(Trouble::Unclear(format!("`{name}` is {a} or {b} at {t} s")));
                }
            }
        }
    }
    Ok(fine)
}

impl Solution {
    /// Whether a value at this time may be one before or after an event, as rounding will have it.
    pub fn is_near_event(&self, time: f64) -> bool {
        self.events.iter().any(|event| (event - time).abs() < 1e-4 && time > 0.0)
    }
}

/// A number before the run: a value of a parameter of a model without free parameters.
///
/// # Errors
/// When the expression makes no sense.
pub fn number(model: &Model, e: &Expr) -> Result<f64, String> {
    let mut machine = Machine::new(model);
    machine.parameters()?;
    Ok(machine.number(e)?.v)
}
