//! The start: parameters, initial equations by Newton's method, the first event.

use super::implicit::newton;
use super::machine::Machine;
use super::value::{Done, Dual};
use crate::model::{Id, Role, Start};

/// Nearer to a change no run can begin.
const TIE: f64 = 1e-6;

impl Machine<'_> {
    /// Values of parameters and start values, in the order of declarations; free ones keep theirs.
    pub(super) fn parameters(&mut self) -> Done<()> {
        let model = self.model;
        for (id, variable) in model.variables.iter().enumerate().filter(|(_, v)| !v.dropped) {
            if matches!(variable.role, Role::Constant | Role::Parameter | Role::Structural) {
                if let Some(e) = &variable.value {
                    let value = self.eval(e)?;
                    self.store(id, &value)?;
                }
            } else if let Some(e) = &variable.start_by {
                let value = self.number(e)?.v;
                if variable.fixed == Start::Fixed {
                    self.memory[id].fill(Dual::fixed(value));
                    self.pre[id].fill(Dual::fixed(value));
                }
            }
        }
        for (id, component) in model.components.iter().enumerate() {
            if let (true, Some(e)) = (component.parameter && !component.dropped, &component.value) {
                let super::value::Value::Record(fields) = self.eval(e)? else { return Err("no record".into()) };
                for (name, value) in fields {
                    let all = model.variables.iter().enumerate();
                    let field = all.into_iter().find(|(_, v)| v.owner == Some(id) && v.name == name);
                    self.store(field.ok_or("no field")?.0, &value)?;
                }
            }
        }
        Ok(())
    }

    /// What the initial equations determine.
    fn open(&self) -> Vec<(Id, usize)> {
        let mut list = Vec::new();
        for (id, variable) in self.model.variables.iter().enumerate().filter(|(_, v)| !v.dropped) {
            let free = variable.role == Role::Free || (variable.role == Role::State && variable.fixed != Start::Fixed);
            list.extend((0..self.memory[id].len()).filter(|_| free).map(|k| (id, k)));
        }
        list
    }

    /// Solves for the start and leaves everything computed at it.
    pub(super) fn start(&mut self) -> Done<()> {
        let open = self.open();
        let mut u: Vec<f64> = open.iter().map(|(id, k)| self.memory[*id][*k].v).collect();
        (self.starting, self.event, self.time, self.after) = (true, true, 0.0, true);
        let model = self.model;
        let mut first = None;
        let mut at = |machine: &mut Self, u: &[f64]| -> Done<Vec<f64>> {
            for ((id, k), value) in open.iter().zip(u) {
                machine.memory[*id][*k].v = *value;
            }
            machine.parameters()?;
            machine.evaluate()?;
            let held: Vec<f64> = machine.trace.answers.iter().map(|answer| answer.held).collect();
            if *first.get_or_insert_with(|| held.clone()) != held {
                return Err("unclear: the start decides relations".into());
            }
            let mut residuals = Vec::new();
            machine.quiet += 1;
            for (a, b) in &model.initial {
                residuals.push(machine.number(a)?.v - machine.number(b)?.v);
            }
            machine.quiet -= 1;
            Ok(residuals)
        };
        newton(&mut u, &mut |u| at(self, u))?;
        at(self, &u)?;
        if self.trace.answers.iter().any(|answer| !answer.timed && answer.gap.abs() < TIE) {
            return Err("unclear: a relation at its limit at the start".into());
        }
        self.starting = false;
        self.begin_past();
        self.before.clone_from(&self.conditions);
        // Discrete variables that `initial()` has set are those before the first event.
        self.pre.clone_from(&self.memory);
        Ok(())
    }

    fn begin_past(&mut self) {
        self.past.clear();
        for value in &self.sources {
            let mut past = super::past::Past::default();
            past.begin(*value);
            self.past.push(past);
        }
    }
}
