//! Steps of a function that is being compiled (`hyd_symbolic::Body`).

use hyd_instance::InstId;
use hyd_source::Span;
use hyd_symbolic::{BodyId, NodeId, SlotId, Step};
use hyd_syntax::tree::Name;

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::form::Form;

/// A body that is made or being made.
pub(crate) struct KnownBody {
    pub function: InstId,
    pub inputs: Vec<Form>,
    pub id: BodyId,
    pub outputs: Vec<(Name, Form)>,
    pub done: bool,
}

/// A body in the making.
pub(crate) struct Builder {
    /// Nesting of calls at which its statements are run.
    pub depth: usize,
    pub registers: u32,
    /// Lists of steps that are open, innermost last.
    pub blocks: Vec<Vec<Step>>,
    /// Calls made in this statement: their results can be used again.
    pub calls: Vec<Made>,
    /// Variables of type String that only messages read.  What the run makes of them is not followed: `...` stands for it.
    pub texts: Vec<Name>,
    /// Variables that are numbers known before the run.
    pub settled: Vec<Name>,
}

/// A call: the body, its arguments, its outputs.
pub(crate) type Made = (BodyId, Vec<NodeId>, Vec<(Name, Local)>);

/// Branches of an `if` that are written one within the other; more stand one after the other.
pub(crate) const DEEPEST: usize = 32;

impl Flattener<'_, '_> {
    /// True where statements become steps of a body.
    pub(crate) fn in_body(&self, cx: &Context) -> bool {
        self.builders.last().is_some_and(|builder| builder.depth == cx.depth)
    }

    /// True for a variable of the function being compiled that only messages read.
    pub(crate) fn is_text_for_messages(&self, name: &Name) -> bool {
        self.builders.last().is_some_and(|builder| builder.texts.contains(name))
    }

    /// True while the function is being compiled.
    pub(crate) fn is_being_built(&self, function: InstId) -> bool {
        self.bodies.iter().any(|body| body.function == function && !body.done)
    }

    /// Fresh registers in a row.
    pub(crate) fn registers(&mut self, count: usize) -> std::ops::Range<u32> {
        let builder = self.builders.last_mut().expect("invariant: asked for inside a body");
        let first = builder.registers;
        builder.registers = first.saturating_add(count as u32);
        first..builder.registers
    }

    /// A fresh register that holds the value of an expression.
    pub(crate) fn held(&mut self, node: NodeId) -> NodeId {
        let register = self.registers(1).start;
        self.step(Step::Set(register, node));
        self.model.templates.arena.slot(SlotId(register))
    }

    /// Adds a step.
    pub(crate) fn step(&mut self, step: Step) {
        let builder = self.builders.last_mut().expect("invariant: asked for inside a body");
        builder.blocks.last_mut().expect("invariant: a list of steps is open").push(step);
    }

    /// The function around must be compiled, because of this place.
    pub(crate) fn opaque<T>(&mut self, span: Span) -> Result<T, Fail> {
        self.opaque_at = span;
        Err(Fail::Opaque)
    }

    /// Steps that `body` adds, as a list of their own.
    pub(crate) fn block<T>(&mut self, body: impl FnOnce(&mut Self) -> Result<T, Fail>) -> Result<(Vec<Step>, T), Fail> {
        let builder = self.builders.last_mut().expect("invariant: asked for inside a body");
        builder.blocks.push(Vec::new());
        let (depth, calls) = (builder.blocks.len(), builder.calls.len());
        let result = body(self);
        let builder = self.builders.last_mut().expect("invariant: bodies are left in order");
        builder.calls.truncate(calls);
        builder.blocks.truncate(depth);
        let steps = builder.blocks.pop().unwrap_or_default();
        Ok((steps, result?))
    }

    /// A register that says whether a branch has been taken: not yet.
    pub(crate) fn open_flag(&mut self) -> u32 {
        let taken = self.registers(1).start;
        let zero = self.model.templates.arena.constant(0.0);
        self.step(Step::Set(taken, zero));
        taken
    }

    pub(crate) fn take(&mut self, taken: u32) -> Step {
        Step::Set(taken, self.model.templates.arena.constant(1.0))
    }

    pub(crate) fn step_unless(&mut self, taken: u32, steps: Vec<Step>) {
        if !steps.is_empty() {
            let taken = self.model.templates.arena.slot(SlotId(taken));
            self.step(Step::If(taken, Vec::new(), steps));
        }
    }
}
