//! What only the run decides, outside functions: loops of algorithm sections, and elements at subscripts of the run.
//!
//! A `while`, or a loop with a `break`, whose turns depend on values of the run cannot be run symbolically.  The statement
//! becomes a body (see `body`): its inputs are the values of all variables it mentions, its outputs those it assigns.  An
//! element `a[k]` with `k` a variable of the run is a body too: the elements and the subscripts go in, one element comes out.
//! Inside, relations cause no events.

use hyd_instance::{Resolved, ScalarType};
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyOutput, NodeId, SlotId, Step};
use hyd_syntax::tree::{ComponentRef, Expr, ExprKind, Ident, Name, RefPart, Statement, Variability};

use crate::body::Builder;
use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::form::Form;
use crate::index::Affine;
use crate::lower::Typed;
use crate::rename::{Found, rename};

/// A value that goes into the statement under one name.
struct Value {
    /// The name inside: the text outside.
    name: Name,
    /// What it is outside.
    expr: Expr,
    /// The type, where it is a variable of the model.
    scalar: Option<ScalarType>,
    /// The statement assigns it.
    set: bool,
}

/// Name, form and value of an input of a body.
type Input = (Name, Form, Local);

impl Flattener<'_, '_> {
    /// Runs a statement of an algorithm section as a body.
    pub(crate) fn run_compiled(&mut self, statement: &Statement, cx: &mut Context) -> Result<(), Fail> {
        let mut inside = statement.clone();
        let mut values: Vec<Value> = Vec::new();
        let mut failed = None;
        rename(&mut inside, &mut |found| match (failed, self.value_for(found, cx, &mut values)) {
            (None, Ok(name)) => name,
            (None, Err(fail)) => {
                failed = Some(fail);
                None
            }
            _ => None,
        });
        if let Some(fail) = failed {
            return Err(fail);
        }
        let mut inputs: Vec<Input> = Vec::new();
        for value in &values {
            let local = self.local_value(&value.expr, cx)?;
            inputs.push((value.name.clone(), self.form_outside(value, &local)?, local));
        }
        let results = self.own_body("algorithm", statement.span, &inputs, cx, |flat, inner| {
            // What is assigned gets registers of its own: inputs keep their values.
            let mut outputs = Vec::new();
            for ((name, form, _), _) in inputs.iter().zip(&values).filter(|(_, value)| value.set) {
                let before = inner.local(name).cloned().ok_or(Fail::Reported)?;
                let mut nodes = Vec::new();
                flat.nodes_of(statement.span, form, &before, &mut nodes)?;
                let own = flat.registers(nodes.len());
                own.clone().zip(nodes).for_each(|(register, node)| flat.step(Step::Set(register, node)));
                let local = flat.over_registers(form, own.clone());
                inner.names.retain(|(n, _)| n != name);
                inner.names.push((name.clone(), local));
                outputs.extend(own);
            }
            flat.build_statement(&inside, inner)?;
            Ok(outputs)
        })?;
        let mut results = results.into_iter();
        for ((_, form, _), value) in inputs.iter().zip(&values).filter(|(_, value)| value.set) {
            if let ExprKind::Ref(target) = &value.expr.kind {
                self.assign_variable(target, form.local(&mut results), cx)?;
            }
        }
        Ok(())
    }

    /// The name inside for a reference or call outside; `None` if it means the same inside.
    fn value_for(&mut self, found: Found<'_>, cx: &Context, values: &mut Vec<Value>) -> Result<Option<Name>, Fail> {
        let (reference, set, hidden) = match found {
            Found::Operator(expr) => {
                return Ok(Some(note(
                    Value { name: text_of(expr), expr: expr.clone(), scalar: None, set: false },
                    values,
                )));
            }
            Found::Reference(reference, set, hidden) => (reference, set, hidden),
        };
        let mut whole = reference.clone();
        let last = whole.parts.len() - 1;
        whole.parts[last].subscripts.clear();
        let inner = whole.parts.iter().flat_map(|part| &part.subscripts);
        if let Some(at) = inner.into_iter().find(|e| hidden.iter().any(|name| crate::walk::mentions(e, name))) {
            let message = "a component at a subscript that only the run decides cannot be named here";
            return Err(self.error(Code::OutsideProfile, at.span, message));
        }
        let scalar = if !reference.global && cx.local(&reference.parts[0].name.name).is_some() {
            None
        } else {
            match self.tree.resolve(cx.scope, reference)? {
                Resolved::Time => Some(ScalarType::Real),
                Resolved::Literal(..) | Resolved::Class(_) => return Ok(None),
                Resolved::Variable(steps) => {
                    let instance = &self.tree.instances[steps[steps.len() - 1].0];
                    if instance.variability == Variability::Constant {
                        return Ok(None);
                    }
                    match &instance.primitive {
                        Some(primitive) if matches!(primitive.scalar, ScalarType::Text) => return Ok(None),
                        Some(primitive) => Some(primitive.scalar.clone()),
                        None => {
                            let message = format!(
                                "`{}` is not a number; name its elements in a statement that only the run decides",
                                hyd_syntax::print_reference(reference)
                            );
                            return Err(self.error(Code::OutsideProfile, reference.span, message));
                        }
                    }
                }
            }
        };
        let expr = Expr { kind: ExprKind::Ref(whole), span: reference.span };
        Ok(Some(note(Value { name: text_of(&expr), expr, scalar, set }, values)))
    }

    fn form_outside(&mut self, value: &Value, local: &Local) -> Result<Form, Fail> {
        let typed = |given: &ScalarType| value.scalar.clone().unwrap_or_else(|| given.clone());
        Ok(match local {
            Local::Array(items, shape) => {
                Form::Array(typed(items.first().map_or(&ScalarType::Real, |item| &item.scalar)), shape.clone())
            }
            single => {
                let scalar = self.as_node(value.expr.span, single)?.scalar;
                Form::Scalar(typed(&scalar))
            }
        })
    }

    /// An element at subscripts of which some are known in the run only; `index` goes to those that keep a dimension.
    pub(crate) fn element_at_run(
        &mut self,
        reference: &ComponentRef,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let mut whole = reference.clone();
        let last = whole.parts.len() - 1;
        let subscripts = std::mem::take(&mut whole.parts[last].subscripts);
        let Local::Array(items, shape) =
            self.local_value(&Expr { kind: ExprKind::Ref(whole), span: reference.span }, cx)?
        else {
            return Err(self.error(Code::ArrayShape, reference.span, "this takes no subscripts"));
        };
        if subscripts.len() != shape.len() {
            let (has, written) = (shape.len(), subscripts.len());
            let message = format!("an array of {has} dimensions needs {has} subscripts here, not {written}");
            return Err(self.error(Code::ArrayShape, reference.span, message));
        }
        let scalar = items.first().map_or(ScalarType::Real, |item| item.scalar.clone());
        let array: Name = hyd_syntax::print_reference(reference).into();
        let mut inputs: Vec<Input> =
            vec![(array.clone(), Form::Array(scalar.clone(), shape.clone()), Local::Array(items, shape.clone()))];
        let mut inner_subscripts = Vec::new();
        let mut kept = index.iter();
        for (expr, &size) in subscripts.iter().zip(&shape) {
            let span = expr.span;
            let position = if self.is_of_the_run(expr, cx) {
                cx.ends.push(size);
                let value = self.lower(expr, cx, &[]);
                cx.ends.pop();
                let value = value?;
                if matches!(value.scalar, ScalarType::Real) {
                    let message = "an Integer is needed here, not Real";
                    return Err(self.error(Code::TypeMismatch, span, message));
                }
                let name: Name = format!("subscript {}", inputs.len()).into();
                inputs.push((name.clone(), Form::Scalar(value.scalar.clone()), Local::Node(value)));
                let part = RefPart { name: Ident { name, span }, subscripts: Vec::new() };
                ExprKind::Ref(ComponentRef { global: false, parts: vec![part], span })
            } else {
                let k = self.known_position(span, expr, size, &mut kept, cx)?;
                ExprKind::Integer(k + 1)
            };
            inner_subscripts.push(Expr { kind: position, span });
        }
        let part = RefPart { name: Ident { name: array.clone(), span: reference.span }, subscripts: inner_subscripts };
        let element = ComponentRef { global: false, parts: vec![part], span: reference.span };
        let nodes = self.own_body(&array, reference.span, &inputs, cx, |flat, inner| {
            let value = flat.lower_ref(&element, inner, &[])?;
            let register = flat.registers(1).start;
            flat.step(Step::Set(register, value.node));
            Ok(vec![register])
        })?;
        Ok(Typed { node: nodes[0], scalar })
    }

    /// True for a scalar subscript with variables of the run in it.
    pub(crate) fn is_of_the_run(&mut self, expr: &Expr, cx: &Context) -> bool {
        if matches!(expr.kind, ExprKind::Colon | ExprKind::Range(..) | ExprKind::Array(_) | ExprKind::Integer(_)) {
            return false;
        }
        let names: Vec<Name> = cx.names.iter().map(|(name, _)| name.clone()).collect();
        let mut varies = false;
        crate::walk::any_ref(expr, &mut |reference| {
            let first = &reference.parts[0].name.name;
            if names.contains(first) {
                return false;
            }
            match self.tree.resolve(cx.scope, reference) {
                Ok(Resolved::Variable(steps)) => {
                    varies = self.tree.instances[steps[steps.len() - 1].0].variability > Variability::Parameter;
                }
                Ok(Resolved::Time) => varies = cx.depth == 0,
                _ => {}
            }
            varies
        });
        varies
    }

    /// A body of its own around what `build` makes, and its call.
    fn own_body(
        &mut self,
        name: &str,
        span: Span,
        inputs: &[Input],
        cx: &Context,
        build: impl FnOnce(&mut Self, &mut Context) -> Result<Vec<u32>, Fail>,
    ) -> Result<Vec<NodeId>, Fail> {
        let mut arguments = Vec::new();
        for (_, form, local) in inputs {
            self.nodes_of(span, form, local, &mut arguments)?;
        }
        let scalars = inputs.iter().flat_map(|(_, form, _)| form.scalars());
        let real_inputs: Vec<bool> = scalars.map(|scalar| matches!(scalar, ScalarType::Real)).collect();
        let name: Name = name.into();
        let count = real_inputs.len() as u32;
        let id = self.model.templates.arena.reserve_body(name.clone(), real_inputs.clone());
        let depth = cx.depth + 1;
        self.builders.push(Builder { depth, registers: count, blocks: vec![Vec::new()], calls: Vec::new() });
        let outer = std::mem::take(&mut self.slots);
        let mut inner = Context { depth, no_event: true, ..Context::new(cx.scope) };
        let mut next = 0;
        for (name, form, _) in inputs {
            let own = next..next + form.scalars().len() as u32;
            next = own.end;
            inner.names.push((name.clone(), self.over_registers(form, own)));
        }
        let outputs = build(self, &mut inner);
        let inside = std::mem::replace(&mut self.slots, outer);
        let mut builder = self.builders.pop().ok_or(Fail::Reported)?;
        let registers = match outputs {
            Err(Fail::Opaque) => {
                let message = "an integer that is known before the run is needed here";
                return Err(self.error(Code::NotStructural, self.opaque_at, message));
            }
            other => other?,
        };
        if !inside.keys.is_empty() {
            let message =
                "a derivative or a component of a component cannot be named in a loop that only the run decides";
            return Err(self.error(Code::OutsideProfile, span, message));
        }
        let output = |(k, &register): (usize, &u32)| BodyOutput {
            name: format!("{name} {}", k + 1).into(),
            register,
            zero: false,
        };
        let outputs: Vec<BodyOutput> = registers.iter().enumerate().map(output).collect();
        let steps = builder.blocks.pop().unwrap_or_default();
        let registers = builder.registers;
        let body = Body { name, inputs: count, real_inputs, registers, steps, outputs, derivatives: Vec::new() };
        let arena = &mut self.model.templates.arena;
        let count = body.outputs.len() as u32;
        arena.set_body(id, body);
        let list = arena.argument_list(&arguments);
        Ok((0..count).map(|k| arena.apply(id, k, list)).collect())
    }

    /// A local value over registers in a row.
    fn over_registers(&mut self, form: &Form, registers: std::ops::Range<u32>) -> Local {
        let slots: Vec<NodeId> = registers.map(|r| self.model.templates.arena.slot(SlotId(r))).collect();
        form.local(&mut slots.into_iter())
    }

    /// A position from 0 that is known, from the subscript or from the element asked for.
    fn known_position<'i>(
        &mut self,
        span: Span,
        expr: &Expr,
        size: usize,
        kept: &mut impl Iterator<Item = &'i Affine>,
        cx: &mut Context,
    ) -> Result<i64, Fail> {
        use crate::reference::Subscript;
        let mut wanted = |flat: &mut Self| match kept.next() {
            Some(at) => at.as_constant().ok_or(Fail::NeedsExpansion),
            None => Err(flat.error(Code::ArrayShape, span, "an array stands where a scalar is needed")),
        };
        let position = match self.subscript(expr, size, cx)? {
            Subscript::At(at) => at.as_constant().ok_or(Fail::NeedsExpansion)?,
            Subscript::All => wanted(self)?,
            Subscript::Slice { start, step, .. } => {
                start.as_constant().ok_or(Fail::NeedsExpansion)? + step * wanted(self)?
            }
            Subscript::List(list) => {
                let k = wanted(self)?;
                list.get(k as usize).copied().ok_or(Fail::Reported)?
            }
        };
        if position < 0 || position as usize >= size {
            return Err(self.outside(span, "", position + 1, size));
        }
        Ok(position)
    }
}

/// Adds a value unless its name is there; the name.
fn note(value: Value, values: &mut Vec<Value>) -> Name {
    let name = value.name.clone();
    match values.iter_mut().find(|known| known.name == name) {
        Some(known) => known.set |= value.set,
        None => values.push(value),
    }
    name
}

fn text_of(expr: &Expr) -> Name {
    hyd_syntax::print_expr(expr).into()
}
