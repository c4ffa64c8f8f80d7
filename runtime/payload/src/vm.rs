//! Interpreter of programs: the reference for native code, the fallback where executable memory is refused, and the
//! tool that finds where a value stops being finite.
//!
//! Each kernel becomes a tape of operations in post-order whose operands are positions on the tape (Griewank and
//! Walther 2008, "Evaluating Derivatives", section 2.2).  Results agree with native code to the last bit: the operations
//! are those of IEEE 754 and the elementary functions are shared.

use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{Function, Machine, Node, NodeId, operate, post_order};
use rustc_hash::FxHashMap;

use crate::memory::{Extents, Memory};
use crate::program::{Address, Area, HOMOTOPY, INITIAL, Kernel, Program, RoutineId, TABLE_SIGN, TIME};

/// A program prepared for interpretation.
#[derive(Clone, Debug)]
pub struct Vm {
    pub(crate) routines: IndexVec<RoutineId, Vec<Tape>>,
    pub(crate) tables: Vec<u32>,
    extents: Extents,
    pub(crate) longest: usize,
    pub(crate) machine: Machine,
}

/// A kernel: operations whose operands are positions on the tape.
#[derive(Clone, Debug)]
pub(crate) struct Tape {
    pub(crate) count: u32,
    pub(crate) slots: Vec<Address>,
    pub(crate) operations: Vec<Node>,
    pub(crate) stores: Vec<(usize, Address)>,
}

/// The first value of a routine that is not finite.
#[derive(Clone, PartialEq, Debug)]
pub struct Fault {
    /// Where the value was to be stored.
    pub area: Area,
    /// Position there.
    pub index: u32,
    /// What happened, in words.
    pub reason: String,
    /// What was read for it.
    pub reads: Vec<Read>,
}

/// A value that was read.
#[derive(Clone, PartialEq, Debug)]
pub struct Read {
    /// Where it stands.
    pub area: Area,
    /// Position there.
    pub index: u32,
    /// The value.
    pub value: f64,
}

/// Working space of the interpreter.
#[derive(Clone, Debug, Default)]
pub struct Registers(pub(crate) Vec<f64>);

impl Vm {
    /// Prepares a program.
    ///
    /// # Errors
    /// A sentence, if the program is inconsistent (see [`Extents::of`]).
    pub fn new(program: &Program) -> Result<Self, String> {
        let extents = Extents::of(program)?;
        let tapes = |kernels: &[Kernel]| kernels.iter().map(|kernel| Tape::new(program, kernel)).collect();
        let routines =
            IndexVec::from_vec(program.routines.iter().map(|r| tapes(&r.kernels)).collect::<Vec<Vec<Tape>>>());
        let longest = routines.iter().flatten().map(|tape| tape.operations.len()).max().unwrap_or(0);
        let operations = routines.iter().flatten().flat_map(|tape| &tape.operations);
        let machine = Machine::of(&program.arena, operations);
        Ok(Self { tables: program.tables.clone(), extents, longest, machine, routines })
    }

    /// Working space large enough for every routine.
    pub fn registers(&self) -> Registers {
        Registers(vec![0.0; self.longest])
    }

    /// Runs a routine.  Panics when an area is shorter than the program's layout says.
    pub fn call(&self, routine: RoutineId, memory: &mut Memory<'_>, registers: &mut Registers) {
        self.run(routine, memory, registers, |_, _, _, _, _| {});
    }

    /// Runs a routine and reports the first stored value that is not finite.
    pub fn first_fault(&self, routine: RoutineId, memory: &mut Memory<'_>) -> Option<Fault> {
        let mut fault = None;
        let mut registers = self.registers();
        self.run(routine, memory, &mut registers, |tape, instance, values, position, (area, index)| {
            if fault.is_none() && !values[position].is_finite() {
                let reason = tape.reason(values, position, &self.machine);
                let reads = tape.reads(instance, &self.tables, (values, position));
                fault = Some(Fault { area, index, reason, reads });
            }
        });
        fault
    }

    fn run(
        &self,
        routine: RoutineId,
        memory: &mut Memory<'_>,
        registers: &mut Registers,
        mut watch: impl FnMut(&Tape, u32, &[f64], usize, (Area, u32)),
    ) {
        self.extents.check(routine, memory);
        if registers.0.len() < self.longest {
            registers.0.resize(self.longest, 0.0);
        }
        for tape in &self.routines[routine] {
            for instance in 0..tape.count {
                tape.evaluate(instance, (&self.tables, &self.machine), memory, &mut registers.0);
                for &(position, ref to) in &tape.stores {
                    let (area, index, _) = place(to, instance, &self.tables);
                    watch(tape, instance, &registers.0, position, (area, index));
                    memory.write(area, index, registers.0[position]);
                }
            }
        }
    }
}

impl Tape {
    fn new(program: &Program, kernel: &Kernel) -> Self {
        let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
        let order = post_order(&program.arena, &roots);
        let position: FxHashMap<NodeId, usize> = order.iter().enumerate().map(|(k, &id)| (id, k)).collect();
        let local = |id: NodeId| NodeId::new(position[&id]);
        Self {
            count: kernel.count,
            slots: kernel.slots.clone(),
            operations: order.iter().map(|&id| program.arena.node(id).map(local)).collect(),
            stores: kernel.stores.iter().map(|store| (position[&store.value], store.to)).collect(),
        }
    }

    pub(crate) fn evaluate(
        &self,
        instance: u32,
        (tables, machine): (&[u32], &Machine),
        memory: &Memory<'_>,
        values: &mut [f64],
    ) {
        for (k, &node) in self.operations.iter().enumerate() {
            values[k] = match node {
                Node::Slot(slot) => {
                    let (area, index, negated) = place(&self.slots[slot.index()], instance, tables);
                    let value = memory.read(area, index);
                    if negated { -value } else { value }
                }
                Node::Time => memory.read(Area::Data, TIME),
                Node::Initial => memory.read(Area::Data, INITIAL),
                Node::Homotopy => memory.read(Area::Data, HOMOTOPY),
                Node::Apply(body, output, list) => machine.apply(&self.operations, values, (body, output, list)),
                _ => operate(node, |id| values[id.index()]),
            };
        }
    }

    /// Which operations the value at a position depends on.
    fn below(&self, values: &[f64], position: usize) -> Vec<bool> {
        let mut below = vec![false; position + 1];
        below[position] = true;
        for k in (0..=position).rev() {
            match self.operations[k] {
                _ if !below[k] => {}
                // The side not taken does no harm.
                Node::If(c, a, b) => {
                    let taken = if values[c.index()] != 0.0 { a } else { b };
                    [c, taken].iter().for_each(|operand| below[operand.index()] = true);
                }
                node => node.operands().for_each(|operand| below[operand.index()] = true),
            }
        }
        below
    }

    /// What the value at a position was computed from, each once.
    fn reads(&self, instance: u32, tables: &[u32], (values, position): (&[f64], usize)) -> Vec<Read> {
        let below = self.below(values, position);
        let mut found: Vec<Read> = Vec::new();
        for k in (0..=position).filter(|&k| below[k]) {
            let Node::Slot(slot) = self.operations[k] else { continue };
            let (area, index, negated) = place(&self.slots[slot.index()], instance, tables);
            if found.iter().all(|read| (read.area, read.index) != (area, index)) {
                let value = if negated { -values[k] } else { values[k] };
                found.push(Read { area, index, value });
            }
        }
        found
    }

    /// Why the value at a position is not finite, judged by the first operation below it that spoils finite operands.
    fn reason(&self, values: &[f64], position: usize, machine: &Machine) -> String {
        let below = self.below(values, position);
        let pair = |k: usize| matches!(self.operations[k], Node::Pair(..));
        let spoils = |k: &usize| below[*k] && !values[*k].is_finite() && !pair(*k);
        match (0..=position).find(spoils) {
            Some(k) => match self.operations[k] {
                Node::Apply(body, _, list) => machine
                    .failure(&self.operations[..=k], values, (body, list))
                    .unwrap_or_else(|| "a function returns no finite value".into()),
                // What a way through a function leaves without a value is the logarithm of this number.
                Node::Call1(Function::Log, of)
                    if matches!(self.operations[of.index()], Node::Const(_)) && values[of.index()] == -1.0 =>
                {
                    hyd_system::UNSET.into()
                }
                node => explain(node, &self.operations, values),
            },
            None => "not a number".into(),
        }
    }
}

/// Area, position and sign of an address in one instance.
pub fn place(address: &Address, instance: u32, tables: &[u32]) -> (Area, u32, bool) {
    match *address {
        Address::Fixed { area, index, negated } => (area, index, negated),
        Address::Affine { area, base, stride, negated } => {
            (area, (i64::from(base) + i64::from(stride) * i64::from(instance)) as u32, negated)
        }
        Address::Table { area, start, signed } => {
            let entry = tables[(start + instance) as usize];
            if signed { (area, entry & !TABLE_SIGN, entry & TABLE_SIGN != 0) } else { (area, entry, false) }
        }
    }
}

/// What an operation with finite operands did to give a value that is not finite, in the user's words.
fn explain(node: Node, operations: &[Node], values: &[f64]) -> String {
    // Tiny values in decimals would be a row of zeros.
    let number = |value: f64| match hyd_system::significant(value) {
        // The digits that put it outside of what an operation takes.
        short if value.abs() != 1.0 && short.trim_start_matches('-') == "1" => value.to_string(),
        short => short,
    };
    let v = |id: NodeId| values[id.index()];
    let n = |id: NodeId| number(v(id));
    let signed = |text: String| if text.starts_with('-') { format!("({text})") } else { text };
    match node {
        Node::Slot(_) => "a value it reads is not a number".into(),
        Node::Div(_, b) if v(b) == 0.0 => match operations[b.index()] {
            // What is divided by, where that is computed from several values.
            Node::Call1(function, a) => format!("division by zero ({}({}))", function.name(), n(a)),
            Node::Sub(a, b) => format!("division by zero ({} - {})", n(a), signed(n(b))),
            Node::Add(a, b) => format!("division by zero ({} + {})", n(a), signed(n(b))),
            _ => "division by zero".into(),
        },
        Node::Call1(Function::Log | Function::Log10, a) => format!("logarithm of {}", n(a)),
        Node::Call1(Function::Sqrt, a) => format!("square root of {}", n(a)),
        Node::Call1(function, a) => format!("{}({}) has no finite value", function.name(), n(a)),
        Node::Call2(Function::Pow, a, b) => format!("{}^({}) has no finite value", n(a), n(b)),
        Node::Call2(Function::Div | Function::Mod | Function::Rem, _, b) if v(b) == 0.0 => "division by zero".into(),
        Node::Call2(function, a, b) => format!("{}({}, {}) has no finite value", function.name(), n(a), n(b)),
        Node::Add(..) | Node::Sub(..) | Node::Mul(..) | Node::Div(..) => "overflow".into(),
        _ => "not a number".into(),
    }
}
