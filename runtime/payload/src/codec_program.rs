//! How a program is written: nodes of its expressions, bodies of functions, kernels, slot tables.

use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{Arena, Body, BodyId, BodyOutput, Function, Node, NodeId, Number, Relation, SlotId, Step};

use crate::codec::{Damage, Input, Stored, choices, stored};
use crate::memory::Extents;
use crate::program::{Address, Kernel, Program, Routine, RoutineId, Store};
use crate::tangent::{Branch, Rows, Spaces, Stage, Term};

macro_rules! indices {
    ($($type:ident),*) => {$(
        impl Stored for $type {
            fn put(&self, out: &mut Vec<u8>) {
                self.0.put(out);
            }
            fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
                u32::get(input).map(Self)
            }
        }
    )*};
}
indices!(RoutineId, NodeId, SlotId, BodyId);

impl Stored for Number {
    fn put(&self, out: &mut Vec<u8>) {
        self.value().put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        f64::get(input).map(Self::new)
    }
}

impl Stored for Function {
    fn put(&self, out: &mut Vec<u8>) {
        out.push(*self as u8);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Function::ALL.get(usize::from(u8::get(input)?)).copied().ok_or(Damage)
    }
}

choices!(Relation { 0 => Less, 1 => LessEqual, 2 => Greater, 3 => GreaterEqual, 4 => Equal, 5 => NotEqual });
choices!(Node {
    0 => Const(number), 1 => Slot(slot), 2 => Time, 3 => Initial, 4 => Homotopy, 5 => Neg(a), 6 => Not(a), 7 => Add(a, b),
    8 => Sub(a, b), 9 => Mul(a, b), 10 => Div(a, b), 11 => And(a, b), 12 => Or(a, b), 13 => Compare(r, a, b),
    14 => Event(r, a, b), 15 => If(c, a, b), 16 => Call1(f, a), 17 => Call2(f, a, b), 18 => Pair(a, b),
    19 => Apply(body, output, a),
});

stored! {
    BodyOutput { name, register, zero }
    Extents { needed }
    Kernel { count, slots, stores }
    Store { value, to }
    Branch { always, entries }
    Rows { to, ends, terms }
    Spaces { starts, initial_unknown, initial_work, length }
    Stage { partials, coefficients, rows }
    Term { coefficient, from }
}

impl Stored for Step {
    fn put(&self, out: &mut Vec<u8>) {
        match self {
            Step::Set(to, node) => (0u8, (*to, *node)).put(out),
            Step::Load { to, first, count, index } => (1u8, ((*to, *first), (*count, *index))).put(out),
            Step::Store { first, count, index, value } => (2u8, ((*first, *count), (*index, *value))).put(out),
            Step::Call { body, arguments, results } => {
                (3u8, *body).put(out);
                arguments.put(out);
                results.put(out);
            }
            Step::If(condition, yes, no) => {
                (4u8, *condition).put(out);
                yes.put(out);
                no.put(out);
            }
            Step::Loop(steps) => {
                5u8.put(out);
                steps.put(out);
            }
            Step::Break => 6u8.put(out),
            Step::Return => 7u8.put(out),
            Step::Check(condition, text) => {
                (8u8, *condition).put(out);
                text.put(out);
            }
        }
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Ok(match u8::get(input)? {
            0 => Step::Set(u32::get(input)?, NodeId::get(input)?),
            1 => {
                let ((to, first), (count, index)) = Stored::get(input)?;
                Step::Load { to, first, count, index }
            }
            2 => {
                let ((first, count), (index, value)) = Stored::get(input)?;
                Step::Store { first, count, index, value }
            }
            3 => Step::Call { body: Stored::get(input)?, arguments: Stored::get(input)?, results: Stored::get(input)? },
            4 => Step::If(Stored::get(input)?, Stored::get(input)?, Stored::get(input)?),
            5 => Step::Loop(Stored::get(input)?),
            6 => Step::Break,
            7 => Step::Return,
            8 => Step::Check(Stored::get(input)?, Stored::get(input)?),
            _ => return Err(Damage),
        })
    }
}

/// What running a body needs; derivatives belong to the compiler.
impl Stored for Body {
    fn put(&self, out: &mut Vec<u8>) {
        self.name.put(out);
        self.real_inputs.put(out);
        self.registers.put(out);
        self.steps.put(out);
        self.outputs.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        let name = Stored::get(input)?;
        let real_inputs: Vec<bool> = Stored::get(input)?;
        Ok(Self {
            name,
            inputs: real_inputs.len() as u32,
            real_inputs,
            registers: Stored::get(input)?,
            steps: Stored::get(input)?,
            outputs: Stored::get(input)?,
            derivatives: Vec::new(),
        })
    }
}

impl Stored for Address {
    fn put(&self, out: &mut Vec<u8>) {
        match *self {
            Address::Fixed { area, index, negated } => (0u8, (area, (index, negated))).put(out),
            Address::Affine { area, base, stride, negated } => (1u8, ((area, base), (stride, negated))).put(out),
            Address::Table { area, start, signed } => (2u8, (area, (start, signed))).put(out),
        }
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Ok(match u8::get(input)? {
            0 => {
                let (area, (index, negated)) = Stored::get(input)?;
                Address::Fixed { area, index, negated }
            }
            1 => {
                let ((area, base), (stride, negated)) = Stored::get(input)?;
                Address::Affine { area, base, stride, negated }
            }
            2 => {
                let (area, (start, signed)) = Stored::get(input)?;
                Address::Table { area, start, signed }
            }
            _ => return Err(Damage),
        })
    }
}

/// Names of routines are for listings and stay behind.
impl Stored for Routine {
    fn put(&self, out: &mut Vec<u8>) {
        self.kernels.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Ok(Self { name: "", kernels: Stored::get(input)? })
    }
}

/// Of the expressions only those that routines and bodies need, in an order in which operands come first.
impl Stored for Program {
    fn put(&self, out: &mut Vec<u8>) {
        let (nodes, bodies) = needed(self);
        let mut number = vec![NodeId(u32::MAX); self.arena.len()];
        nodes.iter().enumerate().for_each(|(k, &node)| number[node.index()] = NodeId::new(k));
        nodes.len().put(out);
        nodes.iter().for_each(|&node| self.arena.node(node).map(|operand| number[operand.index()]).put(out));
        self.arena.body_count().put(out);
        bodies.len().put(out);
        for &body in &bodies {
            body.put(out);
            let mut renumbered = Body::clone(self.arena.body(body));
            renumber(&mut renumbered.steps, &number);
            renumbered.put(out);
        }
        let kernel = |kernel: &Kernel| {
            let stores = kernel.stores.iter().map(|store| Store { value: number[store.value.index()], to: store.to });
            Kernel { count: kernel.count, slots: kernel.slots.clone(), stores: stores.collect() }
        };
        let routine = |r: &Routine| Routine { name: r.name, kernels: r.kernels.iter().map(kernel).collect() };
        self.routines.iter().map(routine).collect::<Vec<Routine>>().put(out);
        self.tables.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        let mut arena = Arena::new();
        let count = usize::get(input)?;
        for k in 0..count {
            let node = Node::get(input)?;
            let ordered = node.operands().all(|operand| operand.index() < k);
            // Every operation stands once, so that numbers stay what they were.
            if !ordered || arena.intern(node).index() != k {
                return Err(Damage);
            }
        }
        read_bodies(&mut arena, input)?;
        let routines: Vec<Routine> = Stored::get(input)?;
        let values = routines.iter().flat_map(|r| &r.kernels).flat_map(|kernel| &kernel.stores);
        if values.clone().any(|store| store.value.index() >= count) || !is_closed(&arena) {
            return Err(Damage);
        }
        Ok(Self { arena, routines: IndexVec::from_vec(routines), tables: Stored::get(input)? })
    }
}

fn read_bodies(arena: &mut Arena, input: &mut Input<'_>) -> Result<(), Damage> {
    let all = u64::get(input)?;
    if all > u64::from(u16::MAX) {
        return Err(Damage);
    }
    for _ in 0..all {
        arena.reserve_body("".into(), Vec::new());
    }
    for _ in 0..u64::get(input)? {
        let (id, body) = (BodyId::get(input)?, Body::get(input)?);
        if id.index() >= arena.body_count() {
            return Err(Damage);
        }
        arena.set_body(id, body);
    }
    Ok(())
}

/// True if what expressions and bodies name is there.
fn is_closed(arena: &Arena) -> bool {
    let called = |id: NodeId| match arena.node(id) {
        Node::Apply(body, output, _) => {
            body.index() < arena.body_count() && (output as usize) < arena.body(body).outputs.len()
        }
        _ => true,
    };
    let body = |id: BodyId| {
        let body = arena.body(id);
        let register = |r: u32| r < body.registers;
        let mut lists: Vec<&[Step]> = vec![&body.steps];
        let mut sound = body.inputs <= body.registers && body.outputs.iter().all(|output| register(output.register));
        while let Some(steps) = lists.pop() {
            for step in steps {
                sound &= step.expressions().iter().all(|node| node.index() < arena.len());
                sound &= match step {
                    Step::Set(to, _) => register(*to),
                    Step::Load { to, first, count, .. } => {
                        register(*to) && u64::from(*first) + u64::from(*count) <= u64::from(body.registers)
                    }
                    Step::Store { first, count, .. } => {
                        u64::from(*first) + u64::from(*count) <= u64::from(body.registers)
                    }
                    Step::Call { body: callee, results, .. } => {
                        callee.index() < arena.body_count() && results.iter().all(|&r| register(r))
                    }
                    _ => true,
                };
                lists.extend(step.inner());
            }
        }
        sound
    };
    (0..arena.len()).all(|k| called(NodeId::new(k))) && (0..arena.body_count()).all(|k| body(BodyId::new(k)))
}

/// Nodes and bodies that the routines need, ascending.
fn needed(program: &Program) -> (Vec<NodeId>, Vec<BodyId>) {
    let arena = &program.arena;
    let mut seen = vec![false; arena.len()];
    let stores = program.routines.iter().flat_map(|r| &r.kernels).flat_map(|kernel| &kernel.stores);
    stores.for_each(|store| seen[store.value.index()] = true);
    mark_operands(arena, &mut seen);
    let calls = (0..seen.len()).filter(|&k| seen[k]).filter_map(|k| match arena.node(NodeId::new(k)) {
        Node::Apply(body, ..) => Some(body),
        _ => None,
    });
    let bodies = arena.reachable(&calls.collect::<Vec<BodyId>>());
    for &body in &bodies {
        let mut lists: Vec<&[Step]> = vec![&arena.body(body).steps];
        while let Some(steps) = lists.pop() {
            for step in steps {
                step.expressions().iter().for_each(|node| seen[node.index()] = true);
                lists.extend(step.inner());
            }
        }
    }
    mark_operands(arena, &mut seen);
    ((0..seen.len()).filter(|&k| seen[k]).map(NodeId::new).collect(), bodies)
}

/// Operands come before their users, so one pass from the end finds all.
fn mark_operands(arena: &Arena, seen: &mut [bool]) {
    for k in (0..seen.len()).rev() {
        if seen[k] {
            arena.node(NodeId::new(k)).operands().for_each(|operand| seen[operand.index()] = true);
        }
    }
}

fn renumber(steps: &mut [Step], number: &[NodeId]) {
    let new = |node: &mut NodeId| *node = number[node.index()];
    for step in steps {
        match step {
            Step::Set(_, node) | Step::Check(node, _) => new(node),
            Step::Load { index, .. } => new(index),
            Step::Store { index, value, .. } => {
                new(index);
                new(value);
            }
            Step::Call { arguments, .. } => arguments.iter_mut().for_each(new),
            Step::If(condition, yes, no) => {
                new(condition);
                renumber(yes, number);
                renumber(no, number);
            }
            Step::Loop(steps) => renumber(steps, number),
            Step::Break | Step::Return => {}
        }
    }
}
