//! Functions that cannot be run symbolically become bodies: registers, loops and branches (`hyd_symbolic::Body`).
//!
//! That is so for loops and branches decided by values of the run, subscripts computed in the run, recursion and assertions,
//! and for functions whose author gives the derivative.  The expressions inside are lowered as everywhere; the names of the
//! function stand for registers.  A body is made once per function and sizes of its arguments; Strings and integers
//! that size its arrays are fixed in it.  A call is a node over the nodes of the arguments.

use std::ops::Range;

use hyd_instance::{InstId, ScalarType};
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyId, BodyOutput, NodeId, SlotId, Step};
use hyd_syntax::tree::{Component, Direction, Name};

use crate::callee::Callee;
use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::form::Form;
use crate::function::sized_by_value;
use crate::index::Slots;

/// A body that is made or being made.
pub(crate) struct KnownBody {
    function: InstId,
    pub inputs: Vec<Form>,
    pub id: BodyId,
    outputs: Vec<(Name, Form)>,
    done: bool,
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
}

/// A call: the body, its arguments, its outputs.
type Made = (BodyId, Vec<NodeId>, Vec<(Name, Local)>);

/// Most registers of a body: its arrays together.
const MAX_REGISTERS: u32 = 1 << 14;

impl Flattener<'_, '_> {
    /// True where statements become steps of a body.
    pub(crate) fn in_body(&self, cx: &Context) -> bool {
        self.builders.last().is_some_and(|builder| builder.depth == cx.depth)
    }

    /// True while the function is being compiled.
    pub(crate) fn is_being_built(&self, function: InstId) -> bool {
        self.bodies.iter().any(|body| body.function == function && !body.done)
    }

    /// The function around must be compiled, because of this place.
    pub(crate) fn opaque<T>(&mut self, span: Span) -> Result<T, Fail> {
        self.opaque_at = span;
        Err(Fail::Opaque)
    }

    /// A call of the compiled function.
    pub(crate) fn call_compiled(
        &mut self,
        span: Span,
        callee: &Callee,
        values: Vec<Local>,
        cx: &mut Context,
    ) -> Result<Vec<(Name, Local)>, Fail> {
        let mut forms = Vec::with_capacity(values.len());
        let sizing = sizing_names(callee);
        for (input, value) in callee.inputs().iter().zip(&values) {
            forms.push(self.form_of(span, input, value, sizing.contains(&input.name.name))?);
        }
        let known = self.body_for(span, callee, forms.clone(), cx)?;
        let (id, outputs, done) = (self.bodies[known].id, self.bodies[known].outputs.clone(), self.bodies[known].done);
        let mut arguments = Vec::new();
        for (form, value) in forms.iter().zip(&values) {
            self.nodes_of(span, form, value, &mut arguments)?;
        }
        let _ = self.claim_inputs(span, callee, values, cx);
        let counts: Vec<(Name, u32)> =
            outputs.iter().map(|(name, form)| (name.clone(), form.scalars().len() as u32)).collect();
        self.note_results(callee, id, &counts);
        if self.in_body(cx) {
            return Ok(self.call_step(id, arguments, outputs));
        }
        if !done {
            // Only a body may call what is not finished: the function between must become one.
            return self.opaque(span);
        }
        let arena = &mut self.model.templates.arena;
        let list = arena.argument_list(&arguments);
        let count = arena.body(id).outputs.len() as u32;
        let mut nodes: Vec<NodeId> = Vec::with_capacity(count as usize);
        for k in 0..count {
            nodes.push(arena.apply(id, k, list));
        }
        let mut nodes = nodes.into_iter();
        Ok(outputs.into_iter().map(|(name, form)| (name, form.local(&mut nodes))).collect())
    }

    fn call_step(&mut self, id: BodyId, arguments: Vec<NodeId>, outputs: Vec<(Name, Form)>) -> Vec<(Name, Local)> {
        let builder = self.builders.last().expect("invariant: asked for inside a body");
        if let Some((.., results)) = builder.calls.iter().find(|(body, given, _)| *body == id && *given == arguments) {
            return results.clone();
        }
        let mut results = Vec::new();
        let mut registers = Vec::new();
        for (name, form) in outputs {
            let own = self.registers(form.scalars().len());
            let mut nodes =
                own.clone().map(|r| self.model.templates.arena.slot(SlotId(r))).collect::<Vec<_>>().into_iter();
            registers.extend(own);
            results.push((name, form.local(&mut nodes)));
        }
        self.step(Step::Call { body: id, arguments: arguments.clone(), results: registers });
        if let Some(builder) = self.builders.last_mut() {
            builder.calls.push((id, arguments, results.clone()));
        }
        results
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

    /// The body for arguments of these forms: position in the list of bodies.
    pub(crate) fn body_for(
        &mut self,
        span: Span,
        callee: &Callee,
        inputs: Vec<Form>,
        cx: &Context,
    ) -> Result<usize, Fail> {
        let same = |body: &KnownBody| body.function == callee.inst && body.inputs == inputs;
        if let Some(known) = self.bodies.iter().position(same) {
            return Ok(known);
        }
        let real: Vec<bool> =
            inputs.iter().flat_map(Form::scalars).map(|scalar| matches!(scalar, ScalarType::Real)).collect();
        let real = if real.is_empty() { vec![false] } else { real };
        let name = callee.def.name.name.clone();
        let id = self.model.templates.arena.reserve_body(name, real.clone());
        let builder =
            Builder { depth: cx.depth + 1, registers: real.len() as u32, blocks: vec![Vec::new()], calls: Vec::new() };
        self.builders.push(builder);
        let outer = std::mem::take(&mut self.slots);
        let result = self.build_body(span, callee, &inputs, id, cx);
        let inside = std::mem::replace(&mut self.slots, outer);
        let builder = self.builders.pop().expect("invariant: pushed above");
        let position = self.bodies.iter().position(|body| body.id == id);
        let done = result.and_then(|outputs| self.finish_body(span, callee, (id, real), outputs, builder, &inside));
        match (done, position) {
            (Ok(()), Some(position)) => {
                self.bodies[position].done = true;
                self.give_derivatives(span, callee, position, cx)?;
                Ok(position)
            }
            (failed, position) => {
                if let Some(position) = position {
                    self.bodies.remove(position);
                }
                Err(match failed {
                    Err(Fail::Opaque) => {
                        let message = "an integer that is known before the run is needed here";
                        self.error(Code::NotStructural, self.opaque_at, message)
                    }
                    Err(fail) => fail,
                    Ok(()) => Fail::Reported,
                })
            }
        }
    }

    /// Declarations and algorithms as steps; the registers of the outputs.
    fn build_body(
        &mut self,
        span: Span,
        callee: &Callee,
        inputs: &[Form],
        id: BodyId,
        cx: &Context,
    ) -> Result<Vec<BodyOutput>, Fail> {
        let mut inner = callee.context(cx);
        inner.counts.clear();
        inner.fixed = None;
        inner.implicit.clear();
        inner.depends_on_run();
        let count = inputs.iter().map(|form| form.scalars().len()).sum::<usize>() as u32;
        let mut nodes = (0..count).map(|r| self.model.templates.arena.slot(SlotId(r))).collect::<Vec<_>>().into_iter();
        for (input, form) in callee.inputs().iter().zip(inputs) {
            inner.names.push((input.name.name.clone(), form.local(&mut nodes)));
        }
        let mut others: Vec<_> =
            callee.components.iter().filter(|(_, c)| c.direction != Some(Direction::Input)).collect();
        others.sort_by_key(|(_, c)| sized_by_value(c) && c.modification.binding.is_none());
        let made = self.declare_registers(callee, &others, &mut inner)?;
        let mut outputs = Vec::new();
        let mut known = Vec::new();
        for output in callee.outputs() {
            let Some((name, form, own)) = made.iter().find(|(name, ..)| *name == output.name.name).cloned() else {
                continue;
            };
            let count = own.len();
            let output = |(k, register)| BodyOutput { name: output_name(&name, count, k), register, zero: false };
            outputs.extend(own.enumerate().map(output));
            known.push((name, form));
        }
        self.bodies.push(KnownBody { function: callee.inst, inputs: inputs.to_vec(), id, outputs: known, done: false });
        self.bind_registers(callee, &others, &mut inner)?;
        self.run_algorithms(span, callee, &mut inner)?;
        Ok(outputs)
    }

    /// Registers for outputs and locals that may change, in the context by their names; those of the outputs.
    fn declare_registers(
        &mut self,
        callee: &Callee,
        components: &[&(u32, Component)],
        inner: &mut Context,
    ) -> Result<Vec<(Name, Form, Range<u32>)>, Fail> {
        let mut made = Vec::new();
        for (frame, component) in components {
            inner.scope.frame = *frame;
            if component.variability <= hyd_syntax::tree::Variability::Parameter {
                self.declare_local(component, callee, inner)?;
                continue;
            }
            let sizes = self.sizes_in_body(callee, component, inner)?;
            let form = self.declared_form(component, sizes, inner)?;
            let own = self.registers(form.scalars().len());
            let mut nodes =
                own.clone().map(|r| self.model.templates.arena.slot(SlotId(r))).collect::<Vec<_>>().into_iter();
            inner.names.push((component.name.name.clone(), form.local(&mut nodes)));
            if component.direction == Some(Direction::Output) {
                made.push((component.name.name.clone(), form, own));
            }
        }
        Ok(made)
    }

    /// What declarations say of outputs and locals that may change, as first assignments.
    fn bind_registers(
        &mut self,
        callee: &Callee,
        components: &[&(u32, Component)],
        inner: &mut Context,
    ) -> Result<(), Fail> {
        for (frame, component) in components {
            if component.variability <= hyd_syntax::tree::Variability::Parameter {
                continue;
            }
            inner.scope.frame = *frame;
            let binding = component.modification.binding.as_ref();
            let modified = !component.modification.arguments.is_empty();
            let record = (modified || binding.is_none()) && !crate::function::simple_type(component);
            let declared = if record { self.declared_record(component, callee, inner)? } else { None };
            let value = match (declared, binding) {
                (Some(record), _) => Some(record),
                (None, Some(binding)) => Some(self.local_value(binding, inner)?),
                (None, None) => None,
            };
            if let Some(value) = value {
                let target = hyd_syntax::tree::ComponentRef {
                    global: false,
                    parts: vec![hyd_syntax::tree::RefPart { name: component.name.clone(), subscripts: Vec::new() }],
                    span: component.name.span,
                };
                self.assign_in_body(&target, value, inner)?;
            }
        }
        Ok(())
    }

    fn finish_body(
        &mut self,
        span: Span,
        callee: &Callee,
        (id, real_inputs): (BodyId, Vec<bool>),
        outputs: Vec<BodyOutput>,
        mut builder: Builder,
        inside: &Slots,
    ) -> Result<(), Fail> {
        let name = callee.def.name.name.clone();
        if !inside.keys.is_empty() {
            let message =
                format!("`{name}` reads a variable of the model: a function has only its inputs and constants");
            return Err(self.error(Code::Misplaced, span, message));
        }
        if builder.registers > MAX_REGISTERS {
            let message = format!("the variables of `{name}` hold more than {MAX_REGISTERS} numbers");
            return Err(self.error(Code::Limit, span, message));
        }
        if outputs.is_empty() {
            return Err(self.error(Code::BadArguments, span, format!("`{name}` gives no value")));
        }
        let body = Body {
            name,
            inputs: real_inputs.len() as u32,
            real_inputs,
            registers: builder.registers,
            steps: builder.blocks.pop().unwrap_or_default(),
            outputs,
            derivatives: Vec::new(),
        };
        self.model.templates.arena.set_body(id, body);
        Ok(())
    }
}

/// Inputs that the sizes of declarations mention.
fn sizing_names(callee: &Callee) -> Vec<Name> {
    let mut names = Vec::new();
    for dim in callee.components.iter().flat_map(|(_, c)| &c.dims) {
        crate::walk::any_ref(dim, &mut |reference| {
            names.push(reference.parts[0].name.name.clone());
            false
        });
    }
    names
}

/// Name of one number of an output.
fn output_name(name: &Name, count: usize, k: usize) -> Name {
    if count == 1 { name.clone() } else { format!("{name}[{}]", k + 1).into() }
}
