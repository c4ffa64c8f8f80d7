//! Calls of the user's functions, by running their algorithms symbolically (`statement`).
//!
//! The statements of a function are executed once over nodes instead of numbers, so that the result is an expression like
//! any other: shared by template, simplified and differentiated like the rest.  Arguments are scalars, arrays of known
//! size and records.

use std::rc::Rc;

use hyd_instance::{ScalarType, Value};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{
    Arguments, ClassBody, ClassKind, Component, ComponentRef, Direction, Expr, ExprKind, Name, Variability,
};

use crate::callee::Callee;
use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

/// Deepest nesting of function calls.
pub(crate) const MAX_CALLS: usize = 64;

/// Statements that take about as long as a call of a function that is run symbolically.
const CALL: u32 = 8;

/// The outputs of a call in their order.
pub(crate) type Outputs = Vec<(Name, Local)>;

impl Flattener<'_, '_> {
    /// A call of the user's own function: its first output.
    pub(crate) fn lower_user_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let result = self.call(span, function, arguments, cx)?;
        self.element_of_local(span, &result, index)
    }

    /// The first output of a function, or the record that a constructor makes.
    pub(crate) fn call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Local, Fail> {
        let outputs = self.call_outputs(span, function, arguments, cx)?;
        outputs.into_iter().next().map(|(_, local)| local).ok_or_else(|| {
            let name = &function.parts[function.parts.len() - 1].name.name;
            self.error(Code::BadArguments, span, format!("`{name}` gives no value"))
        })
    }

    /// All outputs of a call in their order.
    pub(crate) fn call_outputs(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Outputs, Fail> {
        if let Some(outputs) = self.known_call(span, cx) {
            return Ok(outputs);
        }
        let outside = std::mem::take(&mut self.asked);
        let (result, draft) = self.attempt(|flat| flat.make_call(span, function, arguments, cx));
        if let (Ok(outputs), Some(claims)) = (&result, draft.only_claims()) {
            self.remember_call(span, arguments, claims, outputs, cx);
        }
        self.keep(draft);
        let inside = std::mem::replace(&mut self.asked, outside);
        inside.into_iter().for_each(|array| self.note_subscripts_of(array));
        result
    }

    fn make_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Outputs, Fail> {
        let (local, def) = self.called_class(function, cx)?;
        if cx.depth >= MAX_CALLS {
            let message = format!("functions call each other deeper than {MAX_CALLS} levels");
            return Err(self.error(Code::Limit, span, message));
        }
        if def.kind == ClassKind::Record {
            let record = self.construct(&local, span, arguments, None, cx)?;
            return Ok(vec![(def.name.name.clone(), record)]);
        }
        if def.kind != ClassKind::Function {
            let message = format!("`{}` is not a function", def.name.name);
            return Err(self.error(Code::BadArguments, function.span, message));
        }
        let callee = self.callee(&local, def)?;
        self.call_with_arguments(span, &callee, arguments, cx)
    }

    /// A call with values: run symbolically, or compiled where that is not possible.
    pub(crate) fn call_with(
        &mut self,
        span: Span,
        callee: &Callee,
        values: Vec<Local>,
        cx: &mut Context,
    ) -> Result<Outputs, Fail> {
        if self.is_being_built(callee.inst) || !callee.derivatives().is_empty() {
            return self.call_compiled(span, callee, values, cx);
        }
        // A call of itself that the run decides would never end here.
        if cx.called.contains(&(callee.inst, true)) && self.in_body(cx) {
            return self.call_compiled(span, callee, values, cx);
        }
        if cx.called.contains(&(callee.inst, true)) {
            self.opaque_at = span;
            return Err(Fail::Opaque);
        }
        let (result, draft) = self.attempt(|flat| flat.call_symbolically(span, callee, &values, cx));
        match &result {
            Err(Fail::Opaque) => return self.call_compiled(span, callee, values, cx),
            Ok(outputs) if !callee.generates_events() && self.is_large(&values, outputs) => {
                let (compiled, own) = self.attempt(|flat| flat.call_compiled(span, callee, values, cx));
                if compiled.is_ok() {
                    self.keep(own);
                    return compiled;
                }
            }
            _ => {}
        }
        self.keep(draft);
        if matches!(result, Err(Fail::Reported)) {
            self.look_at_names(callee);
        }
        result
    }

    fn call_symbolically(
        &mut self,
        span: Span,
        callee: &Callee,
        values: &[Local],
        cx: &Context,
    ) -> Result<Outputs, Fail> {
        self.statements = self.statements.saturating_add(CALL);
        let mut inner = callee.context(cx);
        inner.called_from = Some(cx.called_from.unwrap_or(span));
        let values = self.claim_inputs(span, callee, values.to_vec(), cx);
        for (input, value) in callee.inputs().iter().zip(values) {
            inner.names.push((input.name.name.clone(), value));
        }
        for (frame, component) in callee.components.iter().filter(|(_, c)| c.direction != Some(Direction::Input)) {
            inner.scope.frame = *frame;
            self.declare_local(component, callee, &mut inner)?;
        }
        self.run_algorithms(span, callee, &mut inner)?;
        let mut outputs = Vec::new();
        for output in callee.outputs() {
            let Some(local) = inner.local(&output.name.name) else {
                let message = format!("`{}` does not set its output `{}`", callee.def.name.name, output.name.name);
                return Err(self.error(Code::BadArguments, span, message));
            };
            outputs.push((output.name.name.clone(), local.clone()));
        }
        Ok(outputs)
    }

    /// The algorithm sections of a function.
    pub(crate) fn run_algorithms(&mut self, span: Span, callee: &Callee, inner: &mut Context) -> Result<(), Fail> {
        let mut found = false;
        for (frame, part) in callee.shape.frames.iter().enumerate() {
            let owner = self.tree.table.class(part.class).def.clone();
            let ClassBody::Long { algorithms, external, equations, .. } = &owner.body else { continue };
            if let Some(equation) = equations.iter().find_map(|section| section.equations.first()) {
                let message = "a function cannot hold equations; its values are assigned in an `algorithm` section";
                return Err(self.error(Code::Misplaced, equation.span, message));
            }
            if let Some(external) = external {
                if self.tree.is_column_reader(*external) {
                    return self.column(span, callee, inner);
                }
                let name = &callee.def.name.name;
                let message = format!("`{name}` is an external function, which is outside the language profile");
                return Err(self.error(Code::OutsideProfile, *external, message));
            }
            inner.scope.frame = frame as u32;
            for section in algorithms {
                found = true;
                self.run(&section.statements, inner)?;
            }
        }
        // Declarations alone may give the outputs their values.
        let given = |c: &Component| c.direction != Some(Direction::Output) || c.modification.binding.is_some();
        if !found && !callee.components.iter().all(|(_, c)| given(c)) {
            let message = format!("the function `{}` has no algorithm", callee.def.name.name);
            return Err(self.error(Code::BadArguments, span, message));
        }
        Ok(())
    }

    /// The output of a function that reads a column of a file: numbers.
    fn column(&mut self, span: Span, callee: &Callee, inner: &mut Context) -> Result<(), Fail> {
        let inputs: Vec<Value> = callee
            .inputs()
            .iter()
            .filter_map(|input| match inner.local(&input.name.name) {
                Some(Local::Value(value)) => Some(value.clone()),
                _ => None,
            })
            .collect();
        let numbers = self.tree.read_column(inner.called_from.unwrap_or(span), &inputs).map_err(|_| Fail::Reported)?;
        let items = numbers.iter().map(|&number| self.literal(number, ScalarType::Real)).collect();
        if let Some(output) = callee.outputs().first() {
            inner.names.push((output.name.name.clone(), Local::array(items, vec![numbers.len()])));
        }
        Ok(())
    }

    /// An element of a local value.
    pub(crate) fn element_of_local(&mut self, span: Span, local: &Local, index: &[Affine]) -> Result<Typed, Fail> {
        match local {
            Local::Node(typed) if index.is_empty() => Ok(typed.clone()),
            Local::Index(_) | Local::Value(_) if index.is_empty() => self.as_node(span, local),
            Local::Array(items, shape) if shape.len() == index.len() => {
                let mut position = 0;
                for (affine, &size) in index.iter().zip(shape) {
                    let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                    if k < 0 || k as usize >= size {
                        return Err(self.outside(span, "", k + 1, size));
                    }
                    position = position * size + k as usize;
                }
                items.get(position).cloned().ok_or(Fail::Reported)
            }
            Local::Array(..) => Err(self.error(Code::ArrayShape, span, "an array stands where a scalar is needed")),
            Local::Record(_) | Local::Records(..) => {
                Err(self.error(Code::TypeMismatch, span, "a record stands where a scalar is needed"))
            }
            _ => Err(self.error(Code::ArrayShape, span, "a scalar stands where an array is needed")),
        }
    }

    /// Sizes of the first output.
    pub(crate) fn shape_of_user_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let (local, def) = self.called_class(function, cx)?;
        if def.kind != ClassKind::Function {
            return Ok(Vec::new());
        }
        let callee = self.callee(&local, def)?;
        let plain = |c: &Component| c.dims.is_empty() && simple_type(c);
        if callee.outputs().iter().all(plain) && callee.inputs().iter().all(plain) {
            let Arguments::List { positional, named } = arguments else { return Ok(Vec::new()) };
            for expr in positional.iter().chain(named.iter().map(|(_, e)| e)) {
                if !self.is_text(expr, cx) {
                    let shape = self.shape(expr, cx)?;
                    if !shape.is_empty() {
                        return Ok(shape);
                    }
                }
            }
            return Ok(Vec::new());
        }
        Ok(match self.call(span, function, arguments, cx)? {
            Local::Array(_, shape) | Local::Records(_, shape) => shape,
            _ => Vec::new(),
        })
    }

    /// An expression as a local value: a node, an array of nodes or a record.
    pub(crate) fn local_value(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        if let Some(record) = self.as_record(expr, cx)? {
            return Ok(record);
        }
        if self.is_text(expr, cx) {
            return Ok(Local::Value(Value::Text(self.text_value(expr, cx)?.into())));
        }
        if let Some(local) = self.whole_call(expr, cx)? {
            return Ok(local);
        }
        let shape = self.shape(expr, cx)?;
        if shape.is_empty() {
            let value = self.lower(expr, cx, &[])?;
            // Integers known here may serve as sizes and subscripts.
            if let (ScalarType::Integer, Some(k)) = (&value.scalar, self.model.templates.arena.as_constant(value.node))
            {
                return Ok(Local::Index(Affine::constant(k as i64)));
            }
            return Ok(Local::Node(value));
        }
        Ok(Local::array(self.elements_of(expr, cx)?, shape))
    }

    /// The value of an expression that is nothing but a call of a user's function: all elements at once.
    fn whole_call(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Local>, Fail> {
        let ExprKind::Call(function, arguments @ Arguments::List { .. }) = &expr.kind else { return Ok(None) };
        if self.predefined(function, cx).is_some() {
            return Ok(None);
        }
        let local = self.call(expr.span, function, arguments, cx)?;
        // Integers known here may serve as sizes and subscripts.
        if let Local::Node(Typed { node, scalar: ScalarType::Integer }) = &local
            && let Some(k) = self.model.templates.arena.as_constant(*node)
        {
            return Ok(Some(Local::Index(Affine::constant(k as i64))));
        }
        Ok(Some(local))
    }

    pub(crate) fn declare_local(
        &mut self,
        component: &Component,
        callee: &Callee,
        inner: &mut Context,
    ) -> Result<(), Fail> {
        let modified = !component.modification.arguments.is_empty();
        if (modified || component.modification.binding.is_none())
            && !simple_type(component)
            && let Some(record) = self.declared_record(component, callee, inner)?
        {
            inner.names.push((component.name.name.clone(), record));
            return Ok(());
        }
        let local = match &component.modification.binding {
            Some(binding) => {
                let local = self.local_value(&binding.clone(), inner)?;
                self.claim_assigned(binding.span, &component.name.name, local, inner)
            }
            None if component.variability <= Variability::Parameter => return Ok(()),
            None if !simple_type(component) => return Ok(()),
            // `v[:]` has the size of what is assigned to it.
            None if sized_by_value(component) => return Ok(()),
            None => {
                let sizes = self.local_sizes(component, inner)?;
                if sizes.is_empty() {
                    return Ok(());
                }
                let zero = self.literal(0.0, ScalarType::Real);
                Local::array(vec![zero; sizes.iter().product()], sizes)
            }
        };
        inner.names.push((component.name.name.clone(), local));
        Ok(())
    }

    pub(crate) fn local_sizes(&mut self, component: &Component, inner: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut sizes = Vec::new();
        for dim in &component.dims {
            let k = match self.size_by_type(dim, inner)? {
                Some(count) => count as i64,
                None => self.affine(dim, inner)?.as_constant().ok_or(Fail::NeedsExpansion)?,
            };
            let size = usize::try_from(k).ok().filter(|&size| size <= MAX_LOCAL);
            sizes.push(size.ok_or_else(|| {
                self.error(Code::ArrayShape, dim.span, format!("the size {k} is negative or above {MAX_LOCAL}"))
            })?);
        }
        Ok(sizes)
    }

    /// The size that an enumeration or `Boolean` means: one element per value (Modelica 3.6, section 10.5).
    pub(crate) fn size_by_type(&mut self, dim: &Expr, inner: &Context) -> Result<Option<usize>, Fail> {
        let ExprKind::Ref(reference) = &dim.kind else { return Ok(None) };
        if !reference.global && inner.local(&reference.parts[0].name.name).is_some() {
            return Ok(None);
        }
        if matches!(reference.parts.as_slice(), [only] if only.name.name.as_ref() == "Boolean") {
            return Ok(Some(2));
        }
        Ok(match self.tree.resolve(inner.scope, reference)? {
            hyd_instance::Resolved::Class(local) => self.tree.enumeration(local.class).map(|e| e.literals.len()),
            _ => None,
        })
    }

    /// The elements of an array, or the one value there is.
    pub(crate) fn values_of(&mut self, span: Span, local: Local) -> Result<Rc<Vec<Typed>>, Fail> {
        match local {
            Local::Array(values, _) => Ok(values),
            single => Ok(Rc::new(vec![self.as_node(span, &single)?])),
        }
    }

    pub(crate) fn as_node(&mut self, span: Span, local: &Local) -> Result<Typed, Fail> {
        match local {
            Local::Node(typed) => Ok(typed.clone()),
            Local::Index(affine) => {
                let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                Ok(self.literal(k as f64, ScalarType::Integer))
            }
            Local::Value(value) => self.constant_value(span, &value.clone()),
            _ => Err(self.error(Code::ArrayShape, span, "an array or record stands where a scalar is needed")),
        }
    }
}

/// Largest array inside a function.
const MAX_LOCAL: usize = 1 << 20;

/// Declared as `v[:]`: the size is that of the value.
pub(crate) fn sized_by_value(component: &Component) -> bool {
    component.dims.iter().any(|dim| matches!(dim.kind, ExprKind::Colon))
}

/// Declared with a predefined type.
pub(crate) fn simple_type(component: &Component) -> bool {
    component.class.parts.len() == 1
        && matches!(component.class.parts[0].name.as_ref(), "Real" | "Integer" | "Boolean" | "String")
}
