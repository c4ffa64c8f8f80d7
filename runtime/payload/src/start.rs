//! What the start does with the data of an instance: relations at the guess, discrete variables that are known before the first solution,
//! start values of discrete variables, conditions that are only checked.

use std::sync::Arc;

use hyd_system::{Contradicted, EvalFailure};

use crate::instance::{Instance, Point};

/// A fixed start value may differ from what follows from others by this, relative to both or to 1.
const SAME_START: f64 = 1e-6;

/// Conditions that a message names.
const MOST_NAMED: usize = 3;

/// What a condition contradicts, in words, and the verb that follows.
fn against(others: Option<&[Arc<str>]>) -> (Contradicted, String, &'static str) {
    match others {
        Some([]) => (Contradicted::Model, "the equations of the model".to_string(), "give"),
        Some([only]) => (Contradicted::Named, only.to_string(), "gives"),
        Some(some) if some.len() <= MOST_NAMED => (Contradicted::Named, some.join(" and "), "give"),
        _ => (Contradicted::Others, "the other initial conditions".to_string(), "give"),
    }
}

impl Instance {
    /// Truth of the relations at the guess, so that the initial system starts on the likely branches.
    pub(crate) fn guess_relations(&mut self, z: &[f64]) {
        let (held, routine) = (self.loaded.model.area.held.clone(), self.loaded.model.routines.initial.extra);
        if held.is_empty() {
            return;
        }
        // A second round, because assigned variables may depend on relations.
        for _ in 0..2 {
            self.run_own(routine, Point { unknown: z, rate: &[] });
            for (k, index) in held.clone().enumerate() {
                let truth = self.memory.out[k];
                self.memory.data[index as usize] = if truth.is_finite() { truth } else { 0.0 };
            }
        }
    }

    /// Discrete variables that follow from what is known have their values before the initial system is solved (Modelica 3.6, section 8.6: all
    /// equations of the start are one system, and these come first in it); the others keep their start values until the event iteration.
    pub(crate) fn decide_known(&mut self, z: &[f64]) {
        let loaded = self.loaded.clone();
        let decided = &loaded.model.initial.decided;
        if decided.is_empty() {
            return;
        }
        let range = loaded.model.area.discrete.start as usize..loaded.model.area.discrete.end as usize;
        let n = loaded.model.structure.unknowns;
        let (mut y, mut yp) = (vec![0.0; n], vec![0.0; n]);
        // What follows from what was decided in a round is decided in the next one.
        for _ in 0..=decided.len() {
            self.run(loaded.model.routines.initial.assign, Point { unknown: z, rate: &[] }, &mut [], &mut []);
            self.take_over(z, &mut y, &mut yp);
            let point = Point { unknown: &y, rate: &yp };
            self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
            let mut values = self.memory.data[range.clone()].to_vec();
            self.run(loaded.model.routines.events.discrete, point, &mut [], &mut []);
            let mut changed = false;
            for &k in decided {
                let value = self.memory.data[range.start + k as usize];
                if value.is_finite() && value != values[k as usize] {
                    values[k as usize] = value;
                    changed = true;
                }
            }
            self.memory.data[range.clone()].copy_from_slice(&values);
            if !changed {
                return;
            }
            self.guess_relations(z);
        }
    }

    /// Unknowns of the simulation and their rates as the initial system has them, whose assigned variables stand in the work area.
    pub(crate) fn take_over(&self, z: &[f64], y: &mut [f64], yp: &mut [f64]) {
        let transfer = &self.loaded.model.initial;
        for (value, place) in y.iter_mut().zip(&transfer.states) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
        for (value, place) in yp.iter_mut().zip(&transfer.rates) {
            *value = place.map_or(0.0, |place| self.read(place, z));
        }
    }

    /// Initial conditions that follow from others must hold; the first one that does not.
    pub(crate) fn violated_condition(&mut self, z: &[f64]) -> Option<EvalFailure> {
        let loaded = self.loaded.clone();
        let checked = &loaded.model.initial.checked;
        if checked.is_empty() {
            return None;
        }
        self.run_own(loaded.model.routines.initial.extra, Point { unknown: z, rate: &[] });
        let sides = &self.memory.out[loaded.model.area.held.len()..];
        let violated = |side: &[f64]| {
            let [value, wanted] = [side[0], side[1]];
            let near = (value - wanted).abs() <= SAME_START * value.abs().max(wanted.abs()).max(1.0);
            (!near).then_some((value, wanted))
        };
        checked.iter().zip(sides.chunks_exact(2)).find_map(|(condition, sides)| {
            let (left, right) = violated(sides)?;
            let name = condition.start_of.map(|name| loaded.model.names.text(name));
            let [left, right] = hyd_system::told_apart(left, right);
            let (contradicts, others, give) = against(condition.others.as_deref());
            let reason = match name {
                Some(_) => format!("its fixed start value {right} contradicts {others}, which {give} {left}"),
                None => format!(
                    "the initial equation `{}` contradicts {others}, which {give} {left} on its left-hand and {right} on its right-hand \
                     side",
                    condition.text
                ),
            };
            let equation = Some(condition.equation).filter(|_| name.is_none());
            let contradicts = Some(contradicts);
            Some(EvalFailure { equation, variable: name, reason, contradicts, ..EvalFailure::default() })
        })
    }

    /// Discrete variables and their `pre` start at their start values.
    pub(crate) fn start_discrete(&mut self) {
        let loaded = self.loaded.clone();
        let layout = &loaded.model.area;
        self.start_pre();
        self.memory
            .data
            .copy_within(layout.pre.start as usize..layout.pre.end as usize, layout.discrete.start as usize);
    }

    /// `pre` of discrete variables during the start: their start values.
    fn start_pre(&mut self) {
        let loaded = self.loaded.clone();
        let layout = &loaded.model.area;
        for (k, start) in layout.discrete_starts.iter().enumerate() {
            let start = start.map_or(0.0, |index| self.memory.data[index as usize]);
            self.memory.data[layout.pre.start as usize + k] = start;
        }
    }

    /// Parameters and discrete variables that the initial system determines.
    pub(crate) fn take_values(&mut self, z: &[f64]) {
        let loaded = self.loaded.clone();
        for &(from, to) in &loaded.model.initial.values {
            self.memory.data[to as usize] = self.read(from, z);
        }
    }

    /// Start values of discrete variables that the solution of the initial system decides; the pass of the event iteration that
    /// follows gives the variables themselves.
    pub(crate) fn start_late(&mut self, z: &[f64]) -> Result<(), EvalFailure> {
        if !self.loaded.model.has_late_starts() {
            return Ok(());
        }
        let loaded = self.loaded.clone();
        let routine = loaded.model.routines.late_starts;
        let pre = loaded.model.area.pre.start as usize..loaded.model.area.pre.end as usize;
        let before = self.memory.data[pre.clone()].to_vec();
        let point = Point { unknown: z, rate: &[] };
        self.run(routine, point, &mut [], &mut []);
        if let Some(failure) = self.bind_failure(routine, point) {
            return Err(failure);
        }
        self.start_pre();
        // `pre` of what the solution gives is not a start value.
        self.take_values(z);
        // The initial system may have been solved with others.
        self.memory.late_changed |= before != self.memory.data[pre];
        Ok(())
    }
}
