//! Sensitivities across events.
//!
//! The instant `t_e` of an event depends on the parameters: `g(t_e, y, y', p) = 0` gives `dt_e = -(g_p + g_y s + g_y' s') / g_t`
//! with the total time derivative `g_t` along the solution before the event; time events give their instant's derivative
//! themselves.  While the event is settled all derivatives are *total* ones along the moving instant,
//! `d y = s + y' dt_e`; they pass through discrete equations, `reinit` and the consistency solve like values do, and behind
//! the event `s = d y - y' dt_e` with the rates there.  This is the saltation formula (Aizerman and Gantmacher 1958; for
//! DAE with events Galan, Feehery, Barton, Appl. Numer. Math. 31 (1999) 17) with nothing special to any kind of event.
//! An event that the solution only grazes has no derivative; its instant is taken as fixed.
//!
//! Where a loop loses its solution (a fold, `F_z w = 0`), derivatives along time and with respect to parameters both grow beyond bounds
//! in the direction `w`, as `1/sqrt(t_e - t)`; there `z(t, p) = z(t_e(p)) - c sqrt(t_e(p) - t) + ...`, so their ratio tends to
//! `-dt_e`, read off just before the fold.

use hyd_system::EventPhase;

use super::Sensitivity;
use crate::error::{SolveError, Stage};
use crate::problem::Problem;

/// What makes an event happen when it does.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) enum EventSource {
    /// This root function crosses zero.
    Root(usize),
    /// An instant known before.
    Time,
    /// A solution of a loop vanishes, this unknown changing ever faster.
    Fold(usize),
}

impl Sensitivity {
    /// Derivatives at the event, before it, to which steps must have led ([`Sensitivity::reach`]): of unknowns and
    /// rates with respect to parameters, and along time.
    pub(crate) fn arrive(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        y: &[f64],
        yp: &[f64],
    ) -> Result<(), SolveError> {
        self.changed = false;
        self.steps.at(self.steps.newest(), &self.differential, (&mut self.at.s, &mut self.at.sp), self.width);
        let last = self.width - 1;
        for (k, block) in self.at.s.chunks_exact_mut(self.width).enumerate() {
            block[last] = yp[k];
        }
        self.at.dt.fill(0.0);
        self.at.dt[last] = 1.0;
        self.consistent(problem, (Stage::Event, t), y, yp)?;
        self.at.dt[last] = 0.0;
        Ok(())
    }

    /// From derivatives at fixed time to total derivatives along the moving event; call after [`Sensitivity::arrive`].
    pub(crate) fn shift(&mut self, problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64]), source: EventSource) {
        let (width, last) = (self.width, self.width - 1);
        self.at.dt.fill(0.0);
        match source {
            EventSource::Root(k) => {
                self.at.dt[last] = 1.0;
                let along = self.at.along();
                problem.system.roots_tangent(t, y, yp, along, &mut self.event.roots);
                let root = &self.event.roots[k * width..(k + 1) * width];
                let slope = root[last];
                self.at.dt[last] = 0.0;
                // A root function at rest is grazed, not crossed.
                if slope != 0.0 {
                    for (dt, change) in self.at.dt[..last].iter_mut().zip(root) {
                        *dt = -change / slope;
                    }
                }
            }
            EventSource::Fold(k) => {
                let block = if self.differential[k] { &self.at.sp } else { &self.at.s };
                let block = &block[k * width..(k + 1) * width];
                if block[last] != 0.0 {
                    for (dt, change) in self.at.dt[..last].iter_mut().zip(block) {
                        *dt = -change / block[last];
                    }
                }
            }
            EventSource::Time => {
                if problem.system.instant_tangent(t, &mut self.at.dt) {
                    self.at.dt[last] = 0.0;
                } else {
                    self.at.dt.fill(0.0);
                }
            }
        }
        self.at.instant.copy_from_slice(&self.at.dt[..last]);
        for block in self.at.s.chunks_exact_mut(width).chain(self.at.sp.chunks_exact_mut(width)) {
            let rate = std::mem::replace(&mut block[last], 0.0);
            for (value, dt) in block.iter_mut().zip(&self.at.dt) {
                *value += rate * dt;
            }
        }
    }

    /// Before a pass of the event iteration on `y`.
    pub(crate) fn before_pass(&mut self, problem: &mut Problem<'_>, phase: EventPhase, t: f64, y: &[f64], yp: &[f64]) {
        self.event.y_before.copy_from_slice(y);
        let along = self.at.along();
        problem.system.before_event_pass(phase, t, y, yp, along);
    }

    /// After it; true if a derivative of a discrete variable changed.
    pub(crate) fn after_pass(&mut self, problem: &mut Problem<'_>, phase: EventPhase, t: f64, yp: &[f64]) -> bool {
        self.event.base.copy_from_slice(&self.at.s);
        let along = self.at.along();
        let changed = problem.system.after_event_pass(phase, t, &self.event.y_before, yp, along, &mut self.event.base);
        std::mem::swap(&mut self.at.s, &mut self.event.base);
        self.changed |= changed;
        changed
    }

    /// Back to derivatives at fixed time, behind the event.
    pub(crate) fn depart(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        y: &[f64],
        yp: &[f64],
    ) -> Result<(), SolveError> {
        for (k, block) in self.at.s.chunks_exact_mut(self.width).enumerate() {
            for (value, dt) in block.iter_mut().zip(&self.at.dt) {
                *value -= yp[k] * dt;
            }
        }
        self.at.dt.fill(0.0);
        self.consistent(problem, (Stage::Event, t), y, yp)
    }
}
