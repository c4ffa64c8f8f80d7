//! Counters of a run.
//!
//! Kept by every part of the solver and returned with every outcome, so that a slow run can be explained and a test can
//! bound the work.

use std::fmt;

/// What a run has cost.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Accepted steps by order, 1 to 5.
    pub steps_by_order: [u64; 5],
    /// Accepted steps of the one-step method, not among those by order.
    pub one_step_steps: u64,
    /// Evaluations of the residual.
    pub residuals: u64,
    /// Evaluations of the Jacobian.
    pub jacobians: u64,
    /// Factorisations.
    pub factorisations: u64,
    /// Newton iterations within steps.
    pub newton_iterations: u64,
    /// Steps rejected because the local error was too large.
    pub error_rejections: u64,
    /// Steps repeated because Newton's method did not converge.
    pub convergence_failures: u64,
    /// Events found where a relation changed.
    pub state_events: u64,
    /// Events at times known before.
    pub time_events: u64,
    /// Changes of the choice of states between events.
    pub state_choices: u64,
    /// Steps of the sensitivities, repeated ones included.
    pub sensitivity_steps: u64,
}

impl fmt::Display for Statistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d, e] = self.steps_by_order;
        writeln!(
            f,
            "steps                  {} (by order 1 to 5: {a} {b} {c} {d} {e}, one-step {})",
            self.steps, self.one_step_steps
        )?;
        writeln!(f, "residuals              {}", self.residuals)?;
        writeln!(f, "Jacobians              {}", self.jacobians)?;
        writeln!(f, "factorisations         {}", self.factorisations)?;
        writeln!(f, "Newton iterations      {}", self.newton_iterations)?;
        writeln!(f, "error rejections       {}", self.error_rejections)?;
        writeln!(f, "convergence failures   {}", self.convergence_failures)?;
        writeln!(f, "state events           {}", self.state_events)?;
        write!(f, "time events            {}", self.time_events)?;
        if self.state_choices > 0 {
            write!(f, "\nchanges of states      {}", self.state_choices)?;
        }
        match self.sensitivity_steps {
            0 => Ok(()),
            steps => write!(f, "\nsensitivity steps      {steps}"),
        }
    }
}
