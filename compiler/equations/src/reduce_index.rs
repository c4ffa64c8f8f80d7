//! Equation system to reduced system: the place of index reduction.
//!
//! Detects equations that constrain states (Pantelides 1988, "The consistent initialization of differential-algebraic
//! systems") and reports them.  Systems of index 1 and below pass through unchanged.  Differentiating the constraints and
//! choosing dummy derivatives is not done here yet.

use hyd_source::Outcome;

use crate::algebra::Algebra;
use crate::balance::{check_balance, high_index};
use crate::system::EquationSystem;

/// The system with index 1 or less; none if it is structurally at fault.
pub fn reduce_index(mut system: EquationSystem) -> Outcome<Option<EquationSystem>> {
    let mut algebra = Algebra::default();
    let fault = match check_balance(&mut system, &mut algebra) {
        Err(fault) => Some(fault),
        Ok(constraints) if !constraints.equations.is_empty() => Some(high_index(&system, &constraints)),
        Ok(_) => None,
    };
    match fault {
        Some(fault) => Outcome { value: None, diagnostics: vec![fault] },
        None => Outcome { value: Some(system), diagnostics: Vec::new() },
    }
}
