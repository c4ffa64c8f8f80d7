//! Programs over intervals of time: what a routine of time and data alone computes while the time runs through an interval.

use hyd_index::TypedIndex;
use hyd_symbolic::Node;

use crate::interval::Enclosure;
use crate::program::{Area, HOMOTOPY, RoutineId, TIME};
use crate::vm::{Vm, place};

/// What stands in the areas of a routine, as intervals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Enclosures {
    /// Assigned variables.
    pub work: Vec<Enclosure>,
    /// Results.
    pub out: Vec<Enclosure>,
    registers: Vec<Enclosure>,
}

impl Vm {
    /// Encloses what a routine of time and data alone computes while the time runs through an interval (s), into `out` and `work`.
    pub(crate) fn enclose(&self, routine: RoutineId, (low, high): (f64, f64), data: &[f64], space: &mut Enclosures) {
        let Enclosures { work, registers, out } = space;
        registers.resize(self.longest, Enclosure::ALL);
        let time = Enclosure::time(low, high);
        for tape in &self.routines[routine] {
            for instance in 0..tape.count {
                for (k, &node) in tape.operations.iter().enumerate() {
                    registers[k] = match node {
                        Node::Slot(slot) => match place(&tape.slots[slot.index()], instance, &self.tables) {
                            (Area::Data, TIME, _) => time,
                            (Area::Data, index, true) => Enclosure::constant(-data[index as usize]),
                            (Area::Data, index, false) => Enclosure::constant(data[index as usize]),
                            (Area::Work, index, true) => work[index as usize].neg(),
                            (Area::Work, index, false) => work[index as usize],
                            _ => Enclosure::ALL,
                        },
                        Node::Time => time,
                        Node::Initial => Enclosure::constant(0.0),
                        Node::Homotopy => Enclosure::constant(data[HOMOTOPY as usize]),
                        _ => Enclosure::operate(node, |id| registers[id.index()]),
                    };
                }
                for &(position, ref to) in &tape.stores {
                    match place(to, instance, &self.tables) {
                        (Area::Work, index, _) => work[index as usize] = registers[position],
                        (Area::Out, index, _) => out[index as usize] = registers[position],
                        _ => {}
                    }
                }
            }
        }
    }
}
