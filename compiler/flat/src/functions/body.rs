//! Functions that cannot be run symbolically become bodies: registers, loops and branches (`hyd_symbolic::Body`).
//!
//! That is so for loops and branches decided by values of the run, subscripts computed in the run, recursion and assertions,
//! and for functions whose author gives the derivative.  The expressions inside are lowered as everywhere; the names of the
//! function stand for registers.  A body is made once per function and sizes of its arguments; Strings and integers
//! that size its arrays are fixed in it.  A call is a node over the nodes of the arguments.

use std::ops::Range;

use hyd_instance::{ScalarType, Value};
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyId, BodyOutput, NodeId, Relation, SlotId, Step};
use hyd_syntax::tree::{Direction, Name};
use hyd_typed::{Base, Declaration, Expr, Function, Kind, Local as Path, Type, mentions};

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::form::Form;
use crate::state::index::Slots;
use crate::state::node::Typed;
use crate::state::steps::{Builder, KnownBody};

/// Most registers of a body: its arrays together.  A call takes half of the stack of nested calls then
/// ([`hyd_symbolic::MACHINE_LIMITS`]).
const MAX_REGISTERS: u32 = 1 << 15;
/// Most operands of the equations that a call of a body becomes, one for each of its outputs; beyond that memory is counted in gigabytes.
const MAX_OPERANDS: u64 = 1 << 20;

impl Flattener<'_, '_> {
    /// A call of the compiled function.
    pub(crate) fn call_compiled(
        &mut self,
        span: Span,
        callee: &Function,
        values: Vec<Local>,
        cx: &mut Context,
    ) -> Result<Vec<(Name, Local)>, Fail> {
        let mut forms = Vec::with_capacity(values.len());
        let sizing = sizing_names(callee);
        for (input, value) in callee.inputs().zip(&values) {
            forms.push(self.form_of(span, input.is_real(), value, sizing.contains(&input.name.name))?);
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
        let count = self.model.templates.arena.body(id).outputs.len() as u32;
        if arguments.len() as u64 * u64::from(count) > MAX_OPERANDS {
            let message = format!(
                "`{}` gives {count} numbers from {}: each would be an equation of all of them, more than {MAX_OPERANDS} operands",
                callee.name(),
                arguments.len()
            );
            return Err(self.error(Code::Limit, span, message));
        }
        let arena = &mut self.model.templates.arena;
        let list = arena.argument_list(&arguments);
        let mut nodes: Vec<NodeId> = Vec::with_capacity(count as usize);
        for k in 0..count {
            nodes.push(arena.apply(id, k, list));
        }
        if let (true, [done]) = (outputs.is_empty(), nodes.as_slice()) {
            return Ok(vec![("".into(), Local::Node(Typed::real(*done)))]);
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
        if outputs.is_empty() {
            registers.extend(self.registers(1));
        }
        for (name, form) in outputs {
            let own = self.registers(form.scalars().len());
            let mut nodes =
                own.clone().map(|r| self.model.templates.arena.slot(SlotId(r))).collect::<Vec<_>>().into_iter();
            registers.extend(own);
            results.push((name, form.local(&mut nodes)));
        }
        let done = registers.first().filter(|_| results.is_empty()).copied();
        self.step(Step::Call { body: id, arguments: arguments.clone(), results: registers });
        // A function that only checks something has failed where its result is no number, which nobody else reads.
        if let Some(done) = done {
            let text = self.checks_of_body(id).join("; or: ").into();
            let arena = &mut self.model.templates.arena;
            let (done, zero) = (arena.slot(SlotId(done)), arena.constant(0.0));
            let holds = arena.compare(Relation::Equal, done, zero);
            self.step(Step::Check(holds, text));
        }
        if let Some(builder) = self.builders.last_mut() {
            builder.calls.push((id, arguments, results.clone()));
        }
        results
    }

    /// The body for arguments of these forms: position in the list of bodies.
    pub(crate) fn body_for(
        &mut self,
        span: Span,
        callee: &Function,
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
        let name = callee.name().clone();
        let id = self.model.templates.arena.reserve_body(name, real.clone());
        let (depth, registers) = (cx.depth + 1, real.len() as u32);
        let texts: Vec<Name> = callee.own_texts().map(|text| text.name.name.clone()).collect();
        let texts = texts.into_iter().filter(|text| self.only_shows(callee, text, cx.scope)).collect();
        let builder =
            Builder { depth, registers, blocks: vec![Vec::new()], calls: Vec::new(), texts, settled: Vec::new() };
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
        callee: &Function,
        inputs: &[Form],
        id: BodyId,
        cx: &Context,
    ) -> Result<Vec<BodyOutput>, Fail> {
        let mut inner = cx.inside(callee);
        inner.counts.clear();
        inner.fixed = None;
        inner.implicit.clear();
        inner.depends_on_run();
        let count = inputs.iter().map(|form| form.scalars().len()).sum::<usize>() as u32;
        let mut nodes = (0..count).map(|r| self.model.templates.arena.slot(SlotId(r))).collect::<Vec<_>>().into_iter();
        for (input, form) in callee.inputs().zip(inputs) {
            inner.names.push((input.name.name.clone(), form.local(&mut nodes)));
        }
        let mut others: Vec<&Declaration> = callee.others().collect();
        others.sort_by_key(|v| v.is_sized_by_value() && v.value.is_none());
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

    /// A scalar that its declaration gives a number known before the run, and that no statement changes, is that number: it may size
    /// arrays.  False for all others.
    fn settle_declared(
        &mut self,
        component: &Declaration,
        callee: &Function,
        components: &[&Declaration],
        inner: &mut Context,
    ) -> Result<bool, Fail> {
        let name = &component.name.name;
        let Some(value) = component.value.as_ref() else { return Ok(false) };
        let is_number =
            component.ty.rank == 0 && matches!(component.ty.base, Base::Scalar(ScalarType::Real | ScalarType::Integer));
        if component.direction.is_some() || !is_number || callee.assigns(name) {
            return Ok(false);
        }
        let settled = &self.builders.last().expect("invariant: asked for inside a body").settled;
        let is_open = |other: &&Declaration| !other.is_fixed() && !settled.contains(&other.name.name);
        if components.iter().filter(|other| is_open(other)).any(|other| mentions(value, &other.name.name)) {
            return Ok(false);
        }
        let lowered = self.local_value(value, inner)?;
        let constant = match &lowered {
            Local::Index(index) if index.as_constant().is_some() => Some(lowered),
            Local::Value(_) => Some(lowered),
            Local::Node(typed) => {
                let number = self.model.templates.arena.as_constant(typed.node);
                number.map(|number| Local::Value(Value::Real(number)))
            }
            _ => None,
        };
        let is_constant = constant.is_some();
        if let Some(constant) = constant {
            inner.names.push((name.clone(), constant));
            self.builders.last_mut().expect("invariant: asked for inside a body").settled.push(name.clone());
        }
        Ok(is_constant)
    }

    /// Registers for outputs and locals that may change, in the context by their names; those of the outputs.
    fn declare_registers(
        &mut self,
        callee: &Function,
        components: &[&Declaration],
        inner: &mut Context,
    ) -> Result<Vec<(Name, Form, Range<u32>)>, Fail> {
        let mut made = Vec::new();
        for component in components {
            inner.scope.frame = component.frame;
            if component.is_fixed() {
                self.declare_local(component, callee, inner)?;
                continue;
            }
            if self.settle_declared(component, callee, components, inner)? {
                continue;
            }
            if self.is_text_for_messages(&component.name.name) {
                inner.names.push((component.name.name.clone(), Local::Value(Value::Text("...".into()))));
                continue;
            }
            let sizes = self.sizes_in_body(callee, component, inner)?;
            let form = self.declared_form(&component.name, &component.ty.base, &sizes, inner)?;
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
        callee: &Function,
        components: &[&Declaration],
        inner: &mut Context,
    ) -> Result<(), Fail> {
        for component in components {
            let name = &component.name.name;
            let is_settled = self.builders.last().is_some_and(|builder| builder.settled.contains(name));
            if component.is_fixed() || is_settled || self.is_text_for_messages(name) {
                continue;
            }
            inner.scope.frame = component.frame;
            let binding = component.value.as_ref();
            let modified = !component.text.modification.arguments.is_empty();
            let record = (modified || binding.is_none()) && !component.is_simple();
            let declared = if record { self.declared_record(component, callee, inner)? } else { None };
            let value = match (declared, binding) {
                (Some(record), _) => Some(record),
                (None, Some(binding)) => Some(self.local_value(binding, inner)?),
                (None, None) => None,
            };
            if let Some(value) = value {
                let reference = hyd_syntax::tree::ComponentRef {
                    global: false,
                    parts: vec![hyd_syntax::tree::RefPart { name: component.name.clone(), subscripts: Vec::new() }],
                    span: component.name.span,
                };
                let path = Path { parts: vec![(component.name.clone(), Vec::new())], reference: reference.into() };
                let span = component.name.span;
                let target = Expr { kind: Kind::Local(path), ty: Type::clone(&component.ty), span };
                self.assign_in_body(&target, value, inner)?;
            }
        }
        Ok(())
    }

    fn finish_body(
        &mut self,
        span: Span,
        callee: &Function,
        (id, real_inputs): (BodyId, Vec<bool>),
        outputs: Vec<BodyOutput>,
        mut builder: Builder,
        inside: &Slots,
    ) -> Result<(), Fail> {
        let name = callee.name().clone();
        if !inside.keys.is_empty() {
            let message =
                format!("`{name}` reads a variable of the model: a function has only its inputs and constants");
            return Err(self.error(Code::Misplaced, span, message));
        }
        if builder.registers > MAX_REGISTERS {
            let message = format!("the variables of `{name}` hold more than {MAX_REGISTERS} numbers");
            return Err(self.error(Code::Limit, span, message));
        }
        // A function without outputs is called for its assertions; what is asked for is a 0.
        let mut outputs = outputs;
        if outputs.is_empty() {
            outputs.push(BodyOutput { name: "".into(), register: builder.registers, zero: false });
            builder.registers += 1;
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
fn sizing_names(callee: &Function) -> Vec<Name> {
    let inputs = callee.inputs().map(|input| &input.name.name);
    let of_inputs = |name: &&Name| callee.inputs().flat_map(|v| &v.dims).any(|dim| mentions(dim, name));
    inputs.filter(|name| callee.decides_sizes(name) || of_inputs(name)).cloned().collect()
}

/// Name of one number of an output.
fn output_name(name: &Name, count: usize, k: usize) -> Name {
    if count == 1 { name.clone() } else { format!("{name}[{}]", k + 1).into() }
}
