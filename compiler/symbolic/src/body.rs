//! Bodies of functions that cannot be written as one expression: loops, branches, arrays with computed subscripts, recursion.
//!
//! A body is a list of steps over registers; the expressions in its steps are nodes whose slots are registers, so that
//! simplification, differentiation and code generation of expressions serve bodies too.  Arrays are registers in a row.
//! A call of a body is a [`Node::Apply`] in an expression, or a [`Step::Call`] in another body.

use std::sync::Arc;

use hyd_index::TypedIndex;

use crate::node::{Arena, BodyId, Node, NodeId};

/// A compiled function.  All registers are 0 before the first step; the first `inputs` hold the arguments.
#[derive(Clone, PartialEq, Debug)]
pub struct Body {
    /// Name of the function, for messages and listings.
    pub name: Arc<str>,
    /// Number of arguments.
    pub inputs: u32,
    /// Which arguments are Real and may have a derivative.
    pub real_inputs: Vec<bool>,
    /// Number of registers, those of the arguments included.
    pub registers: u32,
    /// What is done.
    pub steps: Vec<Step>,
    /// The results.
    pub outputs: Vec<BodyOutput>,
    /// Derivatives that the author of the function gives.
    pub derivatives: Vec<Derivative>,
}

/// A result of a body.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct BodyOutput {
    /// Its name.
    pub name: Arc<str>,
    /// Where it stands after the last step.
    pub register: u32,
    /// It is 0 whatever the arguments are (derivatives of integers).
    pub zero: bool,
}

/// A derivative given by the author (Modelica 3.6, section 12.7.1): a body that takes the arguments of the function and then
/// the derivatives of some of them.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Derivative {
    /// The body.
    pub body: BodyId,
    /// The arguments whose derivatives it takes, in their order.
    pub of: Vec<u32>,
    /// Arguments that must not vary for it to be valid.
    pub constant: Vec<u32>,
    /// It leaves out rates of arguments (`noDerivative`), which the model knows otherwise: it is valid along a solution only.
    pub along_time: bool,
    /// For a derivative of higher order: pairs of an argument and the one that is its derivative.
    pub chained: Vec<(u32, u32)>,
}

/// One step of a body.
#[derive(Clone, PartialEq, Debug)]
pub enum Step {
    /// A register takes the value of an expression.
    Set(u32, NodeId),
    /// `to := registers[first + index]`; the function fails if the index is outside `0..count`.
    Load {
        /// Register that takes the value.
        to: u32,
        /// First register of the array.
        first: u32,
        /// Number of elements.
        count: u32,
        /// Position from 0.
        index: NodeId,
    },
    /// `registers[first + index] := value`, with the same check.
    Store {
        /// First register of the array.
        first: u32,
        /// Number of elements.
        count: u32,
        /// Position from 0.
        index: NodeId,
        /// What is stored.
        value: NodeId,
    },
    /// Registers take the outputs of another body, or of this one.
    Call {
        /// The body.
        body: BodyId,
        /// Its arguments.
        arguments: Vec<NodeId>,
        /// Registers for its outputs, in their order.
        results: Vec<u32>,
    },
    /// One of two lists of steps.
    If(NodeId, Vec<Step>, Vec<Step>),
    /// Steps repeated until a [`Step::Break`].
    Loop(Vec<Step>),
    /// Leaves the innermost loop.
    Break,
    /// Leaves the function.
    Return,
    /// The function fails with this text unless the condition holds.
    Check(NodeId, Arc<str>),
}

impl Step {
    /// The expressions of this step, not of those inside it.
    pub fn expressions(&self) -> Vec<NodeId> {
        match self {
            Step::Set(_, node) | Step::Check(node, _) | Step::If(node, ..) => vec![*node],
            Step::Load { index, .. } => vec![*index],
            Step::Store { index, value, .. } => vec![*index, *value],
            Step::Call { arguments, .. } => arguments.clone(),
            Step::Loop(_) | Step::Break | Step::Return => Vec::new(),
        }
    }

    /// The lists of steps inside this one.
    pub fn inner(&self) -> Vec<&[Step]> {
        match self {
            Step::If(_, a, b) => vec![a, b],
            Step::Loop(steps) => vec![steps],
            _ => Vec::new(),
        }
    }
}

impl Body {
    /// Bytes of stack that a call counts for, see [`Limits`](crate::Limits).
    pub fn frame(&self) -> u64 {
        1024 + 8 * u64::from(self.registers)
    }

    /// For each register: it is an element of an array that is read or written at a computed place.
    pub fn in_memory(&self) -> Vec<bool> {
        let mut memory = vec![false; self.registers as usize];
        let mut todo: Vec<&[Step]> = vec![&self.steps];
        while let Some(steps) = todo.pop() {
            for step in steps {
                if let Step::Load { first, count, .. } | Step::Store { first, count, .. } = step {
                    memory[*first as usize..(*first + *count) as usize].fill(true);
                }
                todo.extend(step.inner());
            }
        }
        memory
    }
}

impl Arena {
    /// A body by its id.
    pub fn body(&self, id: BodyId) -> &Arc<Body> {
        &self.bodies[id]
    }

    /// Number of bodies; their ids count from 0.
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// Makes room for a body, so that it can call itself; see [`Arena::set_body`].
    pub fn reserve_body(&mut self, name: Arc<str>, real_inputs: Vec<bool>) -> BodyId {
        let inputs = real_inputs.len() as u32;
        self.bodies.push(Arc::new(Body {
            name,
            inputs,
            real_inputs,
            registers: inputs,
            steps: Vec::new(),
            outputs: Vec::new(),
            derivatives: Vec::new(),
        }))
    }

    /// Fills in a reserved body.
    pub fn set_body(&mut self, id: BodyId, body: Body) {
        self.bodies[id] = Arc::new(body);
    }

    /// Arguments as the operand of [`Node::Apply`]; at least one.
    pub fn argument_list(&mut self, arguments: &[NodeId]) -> NodeId {
        let mut reversed = arguments.iter().rev();
        let last = match reversed.next() {
            Some(&last) => last,
            None => self.constant(0.0),
        };
        reversed.fold(last, |rest, &first| self.intern(Node::Pair(first, rest)))
    }

    /// The arguments behind the operand of [`Node::Apply`].
    pub fn arguments(&self, list: NodeId) -> Vec<NodeId> {
        let mut arguments = Vec::new();
        let mut rest = list;
        while let Node::Pair(first, others) = self.node(rest) {
            arguments.push(first);
            rest = others;
        }
        arguments.push(rest);
        arguments
    }

    /// All bodies that the bodies given call, themselves included, in ascending order.
    pub fn reachable(&self, roots: &[BodyId]) -> Vec<BodyId> {
        let mut seen = vec![false; self.bodies.len()];
        let mut todo: Vec<BodyId> = roots.to_vec();
        while let Some(id) = todo.pop() {
            if std::mem::replace(&mut seen[id.index()], true) {
                continue;
            }
            let mut lists: Vec<&[Step]> = vec![&self.bodies[id].steps];
            while let Some(steps) = lists.pop() {
                for step in steps {
                    if let Step::Call { body, .. } = step {
                        todo.push(*body);
                    }
                    for root in step.expressions() {
                        todo.extend(crate::post_order(self, &[root]).into_iter().filter_map(
                            |id| match self.node(id) {
                                Node::Apply(body, ..) => Some(body),
                                _ => None,
                            },
                        ));
                    }
                    lists.extend(step.inner());
                }
            }
        }
        (0..seen.len()).filter(|&k| seen[k]).map(BodyId::new).collect()
    }
}
