//! What an instance remembers, as bytes: an instance of the same model goes on from them with the same bits.
//!
//! Parameters, discrete variables, relations, choices of states, the clock and the lines that inputs follow.  What every evaluation computes is
//! left out, and so are recorded samples, which whoever runs the model hands over.

use hyd_system::Instants;

use crate::clock::Clock;
use crate::codec::{Damage, Input, Stored, stored};
use crate::follower::Line;
use crate::instance::Instance;
use crate::selection::Choice;

stored! {
    Line { value, slope, from }
}

impl Instance {
    /// Appends what the instance remembers.
    pub fn save(&self, out: &mut Vec<u8>) {
        let memory = &self.memory;
        memory.data.put(out);
        memory.choices.put(out);
        let Clock { instants, right_of, announced } = memory.clock;
        instants.origin().put(out);
        right_of.put(out);
        announced.put(out);
        memory.reinit_waits.put(out);
        memory.repetitions.put(out);
        memory.inputs.iter().map(|follower| follower.line).collect::<Vec<_>>().put(out);
    }

    /// Remembers what was saved at the beginning of the bytes, and takes it from them.
    ///
    /// # Errors
    /// The bytes are not of an instance of this model; it is as before.
    pub fn restore(&mut self, bytes: &mut &[u8]) -> Result<(), Damage> {
        let mut input = Input(bytes);
        let data: Vec<f64> = Stored::get(&mut input)?;
        let choices: Vec<Choice> = Stored::get(&mut input)?;
        let instants = Instants::of_run(f64::get(&mut input)?);
        let clock = Clock { instants, right_of: Stored::get(&mut input)?, announced: Stored::get(&mut input)? };
        let (reinit_waits, repetitions) = (bool::get(&mut input)?, u32::get(&mut input)?);
        let lines: Vec<Option<Line>> = Stored::get(&mut input)?;
        let memory = &mut self.memory;
        let sets = &self.loaded.model.candidates;
        let suits =
            data.len() == memory.data.len() && lines.len() == memory.inputs.len() && choices.len() == sets.len();
        if !suits || !choices.iter().zip(sets).all(|(choice, set)| choice.suits(set)) {
            return Err(Damage);
        }
        *bytes = input.0;
        (memory.data, memory.choices, memory.clock) = (data, choices, clock);
        (memory.reinit_waits, memory.repetitions, memory.contradiction) = (reinit_waits, repetitions, None);
        memory.failed.clear();
        for (follower, line) in memory.inputs.iter_mut().zip(lines) {
            follower.line = line;
        }
        Ok(())
    }
}
