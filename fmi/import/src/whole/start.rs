//! The start of a text with units in it.
//!
//! A unit finds its start by itself, from its parameters and from what it is given.  What it is given at the start is looked up in the text
//! first, so that a unit that hangs at the end of a chain starts once; where it depends on what the unit computes, it is looked up again
//! until it stays.  The initial equations of the text are solved together with what is read and given, with the states of the units as
//! they started.

use hyd_system::{DaeSystem, EvalFailure};

use super::{Whole, give};

/// Attempts at what units are given at their start.
const MOST_STARTS: usize = 5;
/// Two values that differ by less than this part of their size are one.
const SAME: f64 = 1e-9;

impl Whole {
    /// Parameters and start of the text and the units.
    pub(super) fn bind_all(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.instants = hyd_system::Instants::of_run(t0);
        let mut unknowns = vec![0.0; self.structure.unknowns];
        for part in &self.parts {
            unknowns[part.w.clone()].copy_from_slice(&part.defaults);
        }
        self.tell_text(&unknowns);
        self.text.bind(t0)?;
        self.hand_parameters();
        // What a text cannot say before it knows the units is left at its default.
        if self.look_up(t0).is_ok() {
            self.take_given(&mut unknowns);
        }
        for _ in 0..MOST_STARTS {
            self.start_units(t0, &unknowns)?;
            self.read_units(t0, &mut unknowns);
            self.tell_text(&unknowns);
            self.text.bind(t0)?;
            if self.look_up(t0).is_err() || !self.take_given(&mut unknowns) {
                break;
            }
        }
        self.started.clone_from(&unknowns);
        Ok(())
    }

    /// Hands over the values that the text has for parameters of the units.
    fn hand_parameters(&mut self) {
        let own = self.text.parameters();
        for part in &mut self.parts {
            let value_of = |source: hyd_system::Source| {
                let value = match source.place {
                    hyd_system::Place::Parameter(at) => own[at as usize],
                    hyd_system::Place::Constant(value) => value,
                    hyd_system::Place::Output(_) => return None,
                };
                Some(if source.negated { -value } else { value })
            };
            for &(source, index, is_declared) in &part.parameters {
                if let Some(value) = value_of(source) {
                    let is_set =
                        matches!(source.place, hyd_system::Place::Parameter(at) if self.set.contains(&(at as usize)));
                    // A value that is not finite leaves the unit its own; bind has checked the text's.
                    part.unit.hand_parameter(index, value, is_set || !is_declared);
                }
            }
            for &(source, position) in &part.starts {
                if let Some(value) = value_of(source) {
                    part.unit.set_start(position, value);
                }
            }
        }
    }

    /// The row of results of the text at its start as far as it is known.
    fn look_up(&mut self, t0: f64) -> Result<(), EvalFailure> {
        let m = self.sizes.initial;
        let mut guess = vec![0.0; m];
        self.text.initial_guess(t0, &mut guess)?;
        self.initial_row(t0, &guess)
    }

    /// The row of results of the text for unknowns of its initial system.
    pub(super) fn initial_row(&mut self, t0: f64, z: &[f64]) -> Result<(), EvalFailure> {
        let n = self.sizes.unknowns;
        let (mut y, mut yp) = (vec![0.0; n], vec![0.0; n]);
        self.text.initial_store(t0, z, &mut y, &mut yp)?;
        self.text_row(t0, &y, &yp);
        Ok(())
    }

    /// Takes what the units are given from the row of the text; true if it is not what they had.
    fn take_given(&mut self, unknowns: &mut [f64]) -> bool {
        let mut is_other = false;
        for part in &self.parts {
            for (&(source, _, _), at) in part.gives.iter().zip(part.w.clone()) {
                let value = self.given(source, &self.row);
                if value.is_finite() && differs(value, unknowns[at]) {
                    (unknowns[at], is_other) = (value, true);
                }
            }
        }
        is_other
    }

    /// Starts the units with what they are given.
    fn start_units(&mut self, t0: f64, unknowns: &[f64]) -> Result<(), EvalFailure> {
        for part in &mut self.parts {
            part.settled.copy_from_slice(&unknowns[part.w.clone()]);
            give(&mut part.unit, &part.gives, &part.settled);
            part.unit.bind(t0)?;
        }
        Ok(())
    }

    /// States of the units, and what is read of them.
    fn read_units(&mut self, t0: f64, unknowns: &mut [f64]) {
        for part in &mut self.parts {
            unknowns[part.x.clone()].copy_from_slice(part.unit.start());
            part.watch(t0, unknowns);
            for (&(_, place), at) in part.reads.iter().zip(part.y.clone()) {
                unknowns[at] = part.watched[place];
            }
        }
    }

    /// Tells the text what is read, of unknowns of the initial system, and the units what they are given.
    pub(super) fn tell_initial(&mut self, z: &[f64]) {
        let (first, m) = (self.sizes.first, self.sizes.initial);
        let mut unknowns = std::mem::take(&mut self.started);
        unknowns[first..].copy_from_slice(&z[m..]);
        self.tell_text(&unknowns);
        self.parts.iter_mut().for_each(|part| part.tell(&unknowns));
        self.started = unknowns;
    }

    /// Residual of the initial system.
    pub(super) fn initial_rows(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        let (first, m) = (self.sizes.first, self.sizes.initial);
        self.tell_initial(z);
        self.text.initial_residual(t0, &z[..m], &mut out[..m])?;
        self.initial_row(t0, &z[..m])?;
        let unknowns = self.started.clone();
        for part in &mut self.parts {
            part.watch(t0, &unknowns);
            for (&(_, place), at) in part.reads.iter().zip(part.y.clone()) {
                out[at - first + m] = unknowns[at] - part.watched[place];
            }
        }
        for part in &self.parts {
            for (&(source, _, _), at) in part.gives.iter().zip(part.w.clone()) {
                out[at - first + m] = unknowns[at] - self.given(source, &self.row);
            }
        }
        Ok(())
    }

    /// All unknowns and their rates at the start.
    pub(super) fn store(&mut self, t0: f64, z: &[f64], y: &mut [f64], yp: &mut [f64]) -> Result<(), EvalFailure> {
        let (n, m, first) = (self.sizes.unknowns, self.sizes.initial, self.sizes.first);
        self.tell_initial(z);
        self.text.initial_store(t0, &z[..m], &mut y[..n], &mut yp[..n])?;
        y[first..].copy_from_slice(&z[m..]);
        yp[n..].fill(0.0);
        let is_other = |part: &super::Part| {
            let now = &y[part.w.clone()];
            now.iter().zip(&part.settled).any(|(now, then)| differs(*now, *then))
        };
        if self.parts.iter().any(is_other) {
            self.start_units(t0, y)?;
        }
        for part in &mut self.parts {
            y[part.x.clone()].copy_from_slice(part.unit.start());
            part.watch(t0, y);
            yp[part.x.clone()].copy_from_slice(&part.rates);
        }
        Ok(())
    }
}

/// Two values are not one.
pub(super) fn differs(a: f64, b: f64) -> bool {
    let size = a.abs().max(b.abs());
    // What is not a number is another value.
    (a - b).abs() > SAME * size || a.is_nan() || b.is_nan()
}
