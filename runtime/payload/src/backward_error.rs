//! How well the equations that close torn loops hold, and how much rounding the way to them brings.
//!
//! The variables of a torn loop are computed one after the other, and the solver makes the last equations hold by changing the first
//! variables.  Where rounding errors grow on the way it cannot: the smallest change of the first ones moves the last equation by more
//! than it is off.  Two numbers say so, each by itself harmless: the residual beside the size of its terms, the componentwise backward
//! error (Oettli and Prager 1964, "Compatibility of approximate solution of linear equations with given error bounds for
//! coefficients and right-hand sides"), which is also large where the solver has stopped early or all terms are nearly zero; and the
//! bound of the rounding error that has come together in it (running error analysis, Higham 2002, *Accuracy and Stability of Numerical
//! Algorithms*, section 3.3), which is also large where the errors of the variables cancel.
//!
//! The size of terms is found by evaluating the expression over sizes: sums add them, products multiply them, functions take them
//! times their slope.  A variable is at least as large as its nominal value and as what
//! stands in its place in other equations of the same form.

use hyd_index::TypedIndex;
use hyd_symbolic::{Function, Node, NodeId, operate};
use hyd_system::LoopError;

use crate::instance::{Instance, Point};
use crate::memory::Memory;
use crate::program::{Address, Area, RoutineId};
use crate::vm::{Tape, Vm, place};

/// Part of its size by which an operand is moved to find the slope of a function.
const MOVED: f64 = 1.0 / (1u64 << 30) as f64;

/// What is known of a value.
#[derive(Clone, Copy, Default, Debug)]
struct Accuracy {
    /// Size of its terms.
    size: f64,
    /// Bound of its rounding error, in units of the relative rounding error of one operation.
    error: f64,
}

/// A result of a routine.
struct Stored {
    area: Area,
    index: u32,
    value: f64,
    accuracy: Accuracy,
}

/// Accuracy of what a routine reads, by area and position; the last argument is the value.
type Reads<'a> = &'a dyn Fn(Area, u32, f64) -> Accuracy;

impl Vm {
    /// Runs a routine and hands its results on.
    fn with_accuracy(
        &self,
        routine: RoutineId,
        memory: &mut Memory<'_>,
        reads: Reads<'_>,
        take: &mut dyn FnMut(&mut Memory<'_>, Stored),
    ) {
        let mut values = self.registers().0;
        let (mut seen, mut own) = (vec![Accuracy::default(); values.len()], vec![Accuracy::default(); values.len()]);
        for tape in &self.routines[routine] {
            let largest = self.largest_reads(tape, memory);
            let mut stored = vec![None; tape.operations.len()];
            for (k, &(position, _)) in tape.stores.iter().enumerate() {
                stored[position] = Some(k);
            }
            for instance in 0..tape.count {
                tape.evaluate(instance, (&self.tables, &self.machine), memory, &mut values);
                for k in 0..tape.operations.len() {
                    own[k] = self.accuracy(tape, (k, instance), &mut values, &seen, (reads, &largest));
                    seen[k] = own[k];
                    // What reads an assigned variable sees its size, not that of what it was computed from; its error stays.
                    let store = stored[k].map(|store| place(&tape.stores[store].1, instance, &self.tables));
                    if let Some((area @ Area::Work, index, _)) = store {
                        seen[k].size = reads(area, index, values[k]).size;
                    }
                }
                for &(position, ref to) in &tape.stores {
                    let (area, index, _) = place(to, instance, &self.tables);
                    let (value, accuracy) = (values[position], own[position]);
                    take(memory, Stored { area, index, value, accuracy });
                }
            }
        }
    }

    /// The largest size of the variables that stand in each slot of a loop of code: forces at the unloaded end of a chain are
    /// differences of those at the other end.
    fn largest_reads(&self, tape: &Tape, memory: &Memory<'_>) -> Vec<f64> {
        let size = |slot: &Address, instance: u32| match place(slot, instance, &self.tables) {
            (area @ (Area::Unknown | Area::Work), index, _) => memory.read(area, index).abs(),
            _ => 0.0,
        };
        let largest = |slot: &Address| (0..tape.count).map(|k| size(slot, k)).fold(0.0, f64::max);
        tape.slots.iter().map(largest).collect()
    }

    /// Accuracy of an operation.
    fn accuracy(
        &self,
        tape: &Tape,
        (k, instance): (usize, u32),
        values: &mut [f64],
        seen: &[Accuracy],
        (reads, largest): (Reads<'_>, &[f64]),
    ) -> Accuracy {
        let at = |id: NodeId| (values[id.index()].abs(), seen[id.index()]);
        let value = values[k].abs();
        let found = match tape.operations[k] {
            Node::Slot(slot) => {
                let (area, index, _) = place(&tape.slots[slot.index()], instance, &self.tables);
                let read = reads(area, index, values[k]);
                Accuracy { size: read.size.max(largest[slot.index()]), ..read }
            }
            Node::Add(a, b) | Node::Sub(a, b) => {
                let ((_, a), (_, b)) = (at(a), at(b));
                Accuracy { size: a.size + b.size, error: a.error + b.error + value }
            }
            Node::Neg(a) => at(a).1,
            Node::Mul(a, b) => {
                let ((x, a), (y, b)) = (at(a), at(b));
                Accuracy { size: a.size * b.size, error: x * b.error + y * a.error + value }
            }
            Node::Div(a, b) => {
                let ((_, a), (y, b)) = (at(a), at(b));
                Accuracy { size: a.size * b.size / (y * y), error: (a.error + value * b.error) / y + value }
            }
            Node::If(c, a, b) => at(if values[c.index()] != 0.0 { a } else { b }).1,
            Node::Call1(function, _) | Node::Call2(function, ..) if !jumps(function) => {
                let operands: Vec<NodeId> = tape.operations[k].operands().collect();
                self.by_slopes(tape, k, &operands, values, seen)
            }
            Node::Apply(_, _, list) => {
                let mut arguments = Vec::new();
                let mut rest = list;
                while let Node::Pair(first, next) = tape.operations[rest.index()] {
                    arguments.push(first);
                    rest = next;
                }
                arguments.push(rest);
                self.by_slopes(tape, k, &arguments, values, seen)
            }
            _ => Accuracy { size: value, error: value },
        };
        Accuracy {
            size: if found.size.is_finite() { found.size.max(value) } else { value },
            error: if found.error.is_nan() { value } else { found.error },
        }
    }

    /// Accuracy of a function's value: how far it moves with each operand.
    fn by_slopes(&self, tape: &Tape, k: usize, operands: &[NodeId], values: &mut [f64], seen: &[Accuracy]) -> Accuracy {
        let (node, value) = (tape.operations[k], values[k]);
        let mut found = Accuracy { size: value.abs(), error: value.abs() };
        for operand in operands {
            let (kept, operand_seen) = (values[operand.index()], seen[operand.index()]);
            let step = MOVED * if operand_seen.size > 0.0 { operand_seen.size } else { 1.0 };
            values[operand.index()] = kept + step;
            let moved = match node {
                Node::Apply(body, output, list) => self.machine.apply(&tape.operations, values, (body, output, list)),
                node => operate(node, |id| values[id.index()]),
            };
            values[operand.index()] = kept;
            let slope = (moved - value).abs() / step;
            if slope.is_finite() {
                found.size += slope * operand_seen.size;
                found.error += slope * operand_seen.error;
            }
        }
        found
    }
}

fn jumps(function: Function) -> bool {
    use Function::{Ceil, Div, Floor, Mod, Rem, Sign};
    matches!(function, Floor | Ceil | Sign | Div | Mod | Rem)
}

impl Instance {
    /// See [`hyd_system::DaeSystem::loop_error`]; time has been set.
    pub(crate) fn worst_loop(&mut self, initial: bool, point: Point<'_>) -> Option<LoopError> {
        let loaded = self.loaded.clone();
        let routines = &loaded.model.routines;
        let (code, unknowns) = match initial {
            true => (&routines.initial, &loaded.model.initial_nominals),
            false => (&routines.simulation, &loaded.model.nominals),
        };
        if code.closing_rows.is_empty() {
            return None;
        }
        let mut out = vec![0.0; code.closing_rows.len()];
        let mut memory = Memory {
            data: &mut self.memory.data,
            unknown: point.unknown,
            rate: point.rate,
            work: &mut self.memory.work,
            out: &mut out,
            out2: &mut [],
        };
        let vm = loaded.engine.interpreter()?;
        let size = |area: Area, index: u32, value: f64| match area {
            Area::Unknown => value.abs() + unknowns[index as usize],
            Area::Work => value.abs() + code.assigned_nominals[index as usize],
            _ => value.abs(),
        };
        let errors = std::cell::RefCell::new(vec![0.0; code.assigned_nominals.len()]);
        let reads = |area: Area, index: u32, value: f64| Accuracy {
            size: size(area, index, value),
            error: if area == Area::Work { errors.borrow()[index as usize] } else { value.abs() },
        };
        vm.with_accuracy(code.assign, &mut memory, &reads, &mut |memory, stored| {
            if stored.area == Area::Work {
                errors.borrow_mut()[stored.index as usize] = stored.accuracy.error;
            }
            memory.write(stored.area, stored.index, stored.value);
        });
        let mut worst: Option<LoopError> = None;
        vm.with_accuracy(code.closing, &mut memory, &reads, &mut |_, stored| {
            let Accuracy { size, error } = stored.accuracy;
            let found = LoopError {
                row: code.closing_rows[stored.index as usize] as usize,
                residual: stored.value.abs() / size,
                rounding: f64::EPSILON * error / size,
            };
            // Not a number where the equation reads nothing but zeros.
            if !found.smaller().is_nan() && worst.is_none_or(|worst| found.smaller() > worst.smaller()) {
                worst = Some(found);
            }
        });
        worst
    }
}
