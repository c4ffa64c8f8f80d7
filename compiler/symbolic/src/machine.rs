//! Running bodies: the reference for generated code, and the tool for constants and for messages.
//!
//! Each expression of a step becomes a tape in post-order, as in [`eval`](crate::eval).  A call that cannot be carried
//! through (an endless loop, a recursion too deep, a subscript outside its array, a failed check) gives NaN for all its
//! outputs; [`Machine::call`] says why.  Limits are counted, not timed, so that a run repeats exactly.

use std::sync::Arc;

use hyd_index::TypedIndex;
use rustc_hash::FxHashMap;

use crate::body::{Body, Step};
use crate::eval::operate;
use crate::node::{Arena, BodyId, Node, NodeId};
use crate::order::post_order;

/// What one evaluation of a call in an expression may take.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Turns of loops and calls together.
    pub turns: u64,
    /// Bytes of stack of nested calls, see [`Body::frame`].
    pub stack: u64,
}

/// The limits that all engines obey.
pub const MACHINE_LIMITS: Limits = Limits { turns: 1_000_000, stack: 512 * 1024 };

/// Bodies prepared for execution.
#[derive(Clone, Default, Debug)]
pub struct Machine {
    bodies: FxHashMap<BodyId, Arc<Prepared>>,
}

#[derive(Debug)]
struct Prepared {
    body: Arc<Body>,
    steps: Vec<Op>,
}

/// A step with its expressions as tapes.
#[derive(Debug)]
enum Op {
    Set(u32, Tape),
    Load { to: u32, first: u32, count: u32, index: Tape },
    Store { first: u32, count: u32, index: Tape, value: Tape },
    Call { body: BodyId, arguments: Vec<Tape>, results: Vec<u32> },
    If(Tape, Vec<Op>, Vec<Op>),
    Loop(Vec<Op>),
    Break,
    Return,
    Check(Tape, Arc<str>),
}

/// An expression: operations in post-order, operands by their position.
#[derive(Debug)]
struct Tape(Vec<Node>);

/// How steps ended.
#[derive(PartialEq, Eq)]
enum Flow {
    Next,
    Break,
    Return,
    Failed,
}

/// What is left of the limits, and the first failure.
struct Account {
    left: Limits,
    failure: Option<String>,
}

impl Machine {
    /// Prepares the bodies and all that they call.
    pub fn new(arena: &Arena, roots: &[BodyId]) -> Self {
        let prepare = |id: BodyId| {
            let body = arena.body(id).clone();
            let steps = ops(arena, &body.steps);
            (id, Arc::new(Prepared { body, steps }))
        };
        Self { bodies: arena.reachable(roots).into_iter().map(prepare).collect() }
    }

    /// Prepares the bodies that operations call.
    pub fn of<'a>(arena: &Arena, operations: impl IntoIterator<Item = &'a Node>) -> Self {
        let called = |node: &Node| match node {
            Node::Apply(body, ..) => Some(*body),
            _ => None,
        };
        let roots: Vec<BodyId> = operations.into_iter().filter_map(called).collect();
        if roots.is_empty() { Self::default() } else { Self::new(arena, &roots) }
    }

    /// Takes over the bodies of another machine.
    pub fn extend(&mut self, other: Machine) {
        self.bodies.extend(other.bodies);
    }

    /// The outputs of a body.
    ///
    /// # Errors
    /// Why the call failed, in the user's words.
    pub fn call(&self, body: BodyId, arguments: &[f64]) -> Result<Vec<f64>, String> {
        let mut account = Account { left: MACHINE_LIMITS, failure: None };
        let results = self.run(body, arguments, &mut account);
        match account.failure {
            None => Ok(results),
            Some(reason) => Err(reason),
        }
    }

    /// The value of a [`Node::Apply`] on a tape whose operands are positions; NaN if the call fails.
    pub fn apply(&self, tape: &[Node], values: &[f64], (body, output, list): (BodyId, u32, NodeId)) -> f64 {
        let mut account = Account { left: MACHINE_LIMITS, failure: None };
        let results = self.run(body, &arguments_on(tape, values, list), &mut account);
        results.get(output as usize).copied().unwrap_or(f64::NAN)
    }

    /// Why a [`Node::Apply`] on a tape fails; none if it does not.
    pub fn failure(&self, tape: &[Node], values: &[f64], (body, list): (BodyId, NodeId)) -> Option<String> {
        self.call(body, &arguments_on(tape, values, list)).err()
    }

    fn run(&self, id: BodyId, arguments: &[f64], account: &mut Account) -> Vec<f64> {
        let prepared = &self.bodies[&id];
        let body = &prepared.body;
        let failed = || vec![f64::NAN; body.outputs.len()];
        let frame = body.frame();
        if account.left.turns == 0 || account.left.stack < frame {
            let text = if account.left.turns == 0 {
                turns_text(&body.name)
            } else {
                format!("{} calls itself too deeply", called(&body.name))
            };
            account.failure.get_or_insert(text);
            return failed();
        }
        account.left.turns -= 1;
        account.left.stack -= frame;
        let mut registers = vec![0.0; body.registers as usize];
        let count = arguments.len().min(body.inputs as usize);
        registers[..count].copy_from_slice(&arguments[..count]);
        let flow = self.steps(&prepared.steps, body, &mut registers, account);
        account.left.stack += frame;
        if flow == Flow::Failed {
            return failed();
        }
        body.outputs.iter().map(|output| registers[output.register as usize]).collect()
    }

    fn steps(&self, steps: &[Op], body: &Body, registers: &mut [f64], account: &mut Account) -> Flow {
        for op in steps {
            let flow = self.step(op, body, registers, account);
            if flow != Flow::Next {
                return flow;
            }
        }
        Flow::Next
    }

    fn step(&self, op: &Op, body: &Body, registers: &mut [f64], account: &mut Account) -> Flow {
        match op {
            Op::Set(to, tape) => registers[*to as usize] = self.value(tape, registers),
            Op::Load { to, first, count, index } => match place(self.value(index, registers), *first, *count) {
                Some(place) => registers[*to as usize] = registers[place],
                None => return outside(body, self.value(index, registers), *count, account),
            },
            Op::Store { first, count, index, value } => {
                let value = self.value(value, registers);
                match place(self.value(index, registers), *first, *count) {
                    Some(place) => registers[place] = value,
                    None => return outside(body, self.value(index, registers), *count, account),
                }
            }
            Op::Call { body: callee, arguments, results } => {
                let arguments: Vec<f64> = arguments.iter().map(|tape| self.value(tape, registers)).collect();
                let values = self.run(*callee, &arguments, account);
                for (&to, value) in results.iter().zip(values) {
                    registers[to as usize] = value;
                }
            }
            Op::If(condition, yes, no) => {
                let list = if self.value(condition, registers) != 0.0 { yes } else { no };
                return self.steps(list, body, registers, account);
            }
            Op::Loop(steps) => loop {
                if account.left.turns == 0 {
                    account.failure.get_or_insert(turns_text(&body.name));
                    return Flow::Failed;
                }
                account.left.turns -= 1;
                match self.steps(steps, body, registers, account) {
                    Flow::Next => {}
                    Flow::Break => break,
                    other => return other,
                }
            },
            Op::Break => return Flow::Break,
            Op::Return => return Flow::Return,
            Op::Check(condition, text) => {
                if self.value(condition, registers) == 0.0 {
                    account.failure.get_or_insert(format!("{} fails: {text}", called(&body.name)));
                    return Flow::Failed;
                }
            }
        }
        Flow::Next
    }

    fn value(&self, tape: &Tape, registers: &[f64]) -> f64 {
        // Most expressions are short; those of one node need no space.
        match tape.0.as_slice() {
            [Node::Const(number)] => return number.value(),
            [Node::Slot(slot)] => return registers[slot.index()],
            _ => {}
        }
        let mut values = Vec::with_capacity(tape.0.len());
        for &node in &tape.0 {
            let value = match node {
                Node::Slot(slot) => registers[slot.index()],
                Node::Apply(body, output, list) => self.apply(&tape.0, &values, (body, output, list)),
                _ => operate(node, |id| values[id.index()]),
            };
            values.push(value);
        }
        values.last().copied().unwrap_or(f64::NAN)
    }
}

fn turns_text(name: &str) -> String {
    format!("{} takes more than {} turns of its loops and calls", called(name), MACHINE_LIMITS.turns)
}

/// A function by its name; statements of a model that became one have the name `algorithm`, and an element that is chosen during the run has its own text
/// (`x[k]`), which no function can have.
fn called(name: &str) -> String {
    match name {
        "algorithm" => "the algorithm".into(),
        element if element.contains('[') => format!("`{element}`"),
        function => format!("the function `{function}`"),
    }
}

fn outside(body: &Body, index: f64, count: u32, account: &mut Account) -> Flow {
    let text = format!("{} uses subscript {} of an array with {count} elements", called(&body.name), index + 1.0);
    account.failure.get_or_insert(text);
    Flow::Failed
}

/// The register of an element, if the index (from 0) is inside; NaN is outside.
fn place(index: f64, first: u32, count: u32) -> Option<usize> {
    (index >= 0.0 && index < f64::from(count)).then(|| first as usize + index as usize)
}

/// Values of the arguments of a call on a tape.
fn arguments_on(tape: &[Node], values: &[f64], list: NodeId) -> Vec<f64> {
    let mut arguments = Vec::new();
    let mut rest = list;
    while let Node::Pair(first, others) = tape[rest.index()] {
        arguments.push(values[first.index()]);
        rest = others;
    }
    arguments.push(values[rest.index()]);
    arguments
}

fn ops(arena: &Arena, steps: &[Step]) -> Vec<Op> {
    let tape = |root: NodeId| {
        let order = post_order(arena, &[root]);
        let position: FxHashMap<NodeId, usize> = order.iter().enumerate().map(|(k, &id)| (id, k)).collect();
        Tape(order.iter().map(|&id| arena.node(id).map(|operand| NodeId::new(position[&operand]))).collect())
    };
    let op = |step: &Step| match step {
        Step::Set(to, node) => Op::Set(*to, tape(*node)),
        Step::Load { to, first, count, index } => {
            Op::Load { to: *to, first: *first, count: *count, index: tape(*index) }
        }
        Step::Store { first, count, index, value } => {
            Op::Store { first: *first, count: *count, index: tape(*index), value: tape(*value) }
        }
        Step::Call { body, arguments, results } => Op::Call {
            body: *body,
            arguments: arguments.iter().map(|&argument| tape(argument)).collect(),
            results: results.clone(),
        },
        Step::If(condition, yes, no) => Op::If(tape(*condition), ops(arena, yes), ops(arena, no)),
        Step::Loop(steps) => Op::Loop(ops(arena, steps)),
        Step::Break => Op::Break,
        Step::Return => Op::Return,
        Step::Check(condition, text) => Op::Check(tape(*condition), text.clone()),
    };
    steps.iter().map(op).collect()
}
