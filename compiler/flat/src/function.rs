//! Calls of the user's functions, by running their algorithms symbolically (`statement`).
//!
//! The statements of a function are executed once over nodes instead of numbers, so that the result is an expression like
//! any other: shared by template, simplified and differentiated like the rest.  Arguments are scalars, arrays of known
//! size and records.

use std::sync::Arc;

use hyd_instance::class::elements;
use hyd_instance::record::{Field, field, making_call};
use hyd_instance::{LocalClass, Resolved, ScalarType, Scope, Value};
use hyd_source::{Code, Diagnostic, Span, did_you_mean};
use hyd_syntax::tree::{
    Arguments, ClassBody, ClassDef, ClassKind, Component, ComponentRef, Direction, Element, Expr, ExprKind, Name,
    Variability,
};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

/// Deepest nesting of function calls.
const MAX_CALLS: usize = 64;

impl Flattener<'_, '_> {
    fn called_class(&mut self, function: &ComponentRef, cx: &Context) -> Result<(LocalClass, Arc<ClassDef>), Fail> {
        let name = || function.parts.iter().map(|p| p.name.name.as_ref()).collect::<Vec<_>>().join(".");
        let before = self.tree.table.diagnostics.len();
        let resolved = self.tree.resolve(cx.scope, function);
        if resolved.is_err() && function.parts.len() == 1 {
            self.suggest_function(before, &function.parts[0].name.name, cx.scope);
        }
        match resolved? {
            Resolved::Class(local) => {
                let def = self.tree.table.class(local.class).def.clone();
                Ok((local, def))
            }
            _ => Err(self.error(Code::BadArguments, function.span, format!("`{}` is not a function", name()))),
        }
    }

    /// The message for an unknown name in place of a function speaks of functions.
    fn suggest_function(&mut self, before: usize, name: &str, scope: Scope) {
        if self.tree.table.diagnostics.iter().skip(before).all(|d| d.code != Code::UnknownName) {
            return;
        }
        let own = self.tree.visible_classes(scope);
        let builtin = hyd_symbolic::Function::ALL.iter().map(|f| f.name());
        let operators = ["der", "pre", "edge", "change", "sum", "product", "size", "fill", "zeros", "ones", "linspace"];
        let help = did_you_mean(name, own.iter().map(|n| n.as_ref()).chain(builtin).chain(operators));
        for message in self.tree.table.diagnostics.iter_mut().skip(before).filter(|d| d.code == Code::UnknownName) {
            message.message = format!("there is no function `{name}` here");
            message.notes = help.iter().cloned().collect();
        }
    }

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
    fn call(
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
    ) -> Result<Vec<(Name, Local)>, Fail> {
        let (local, def) = self.called_class(function, cx)?;
        if cx.depth >= MAX_CALLS {
            let message = format!("functions call each other deeper than {MAX_CALLS} levels");
            return Err(self.error(Code::Limit, span, message));
        }
        if def.kind == ClassKind::Record {
            let expr = Expr { kind: ExprKind::Call(function.clone(), arguments.clone()), span };
            let record = self.construct(&local, &expr, cx)?;
            return Ok(vec![(def.name.name.clone(), record)]);
        }
        if def.kind != ClassKind::Function {
            let message = format!("`{}` is not a function", def.name.name);
            return Err(self.error(Code::BadArguments, function.span, message));
        }
        let shape = self.tree.table.shape(local.class)?;
        let inst = self.tree.package_of(&local)?;
        let mut inner = Context { no_event: true, depth: cx.depth + 1, ..Context::new(Scope { inst, frame: 0 }) };
        inner.counts.clone_from(&cx.counts);
        inner.fixed.clone_from(&cx.fixed);
        inner.implicit.clone_from(&cx.implicit);
        let mut components: Vec<Component> = Vec::new();
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            if let Element::Component(component) = &elements(&owner)[element.position as usize] {
                let mut component = component.clone();
                // What a short definition or an `extends` clause says of an input is its default.
                let modified = shape.frames[element.frame as usize].modifications.iter().find_map(|(_, tree)| {
                    let (_, inner) = tree.children.iter().find(|(name, _)| *name == component.name.name)?;
                    inner.binding.clone()
                });
                if let Some(value) = modified {
                    component.modification.binding = Some((*value).clone());
                }
                components.push(component);
            }
        }
        self.bind_inputs(span, &components, arguments, cx, &mut inner)?;
        let inputs = components.iter().filter(|c| c.direction == Some(Direction::Input));
        inner.inputs = inputs.map(|c| c.name.name.clone()).collect();
        for component in components.iter().filter(|c| c.direction != Some(Direction::Input)) {
            self.declare_local(component, &mut inner)?;
        }
        let mut found = false;
        for (frame, part) in shape.frames.iter().enumerate() {
            let owner = self.tree.table.class(part.class).def.clone();
            let ClassBody::Long { algorithms, external, equations, .. } = &owner.body else { continue };
            if let Some(equation) = equations.iter().find_map(|section| section.equations.first()) {
                let message = "a function cannot hold equations; its values are assigned in an `algorithm` section";
                return Err(self.error(Code::Misplaced, equation.span, message));
            }
            if let Some(external) = external {
                let message = "external functions are outside the language profile";
                return Err(self.error(Code::OutsideProfile, *external, message));
            }
            inner.scope.frame = frame as u32;
            for section in algorithms {
                found = true;
                self.run(&section.statements, &mut inner)?;
            }
        }
        // Declarations alone may give the outputs their values.
        let given = |c: &Component| c.direction != Some(Direction::Output) || c.modification.binding.is_some();
        if !found && !components.iter().all(given) {
            let message = format!("the function `{}` has no algorithm", def.name.name);
            return Err(self.error(Code::BadArguments, span, message));
        }
        let mut outputs = Vec::new();
        for output in components.iter().filter(|c| c.direction == Some(Direction::Output)) {
            let Some(local) = inner.local(&output.name.name) else {
                let message = format!("`{}` does not set its output `{}`", def.name.name, output.name.name);
                return Err(self.error(Code::BadArguments, span, message));
            };
            outputs.push((output.name.name.clone(), local.clone()));
        }
        Ok(outputs)
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
            Local::Record(_) => Err(self.error(Code::TypeMismatch, span, "a record stands where a scalar is needed")),
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
        let shape = self.tree.table.shape(local.class)?;
        let scalar = shape.elements.iter().all(|element| {
            let owner = &self.tree.table.class(shape.frames[element.frame as usize].class).def;
            match &elements(owner)[element.position as usize] {
                Element::Component(c) => c.direction != Some(Direction::Output) || c.dims.is_empty() && simple_type(c),
                _ => true,
            }
        });
        if scalar {
            return Ok(Vec::new());
        }
        Ok(match self.call(span, function, arguments, cx)? {
            Local::Array(_, shape) => shape,
            _ => Vec::new(),
        })
    }

    fn bind_inputs(
        &mut self,
        span: Span,
        components: &[Component],
        arguments: &Arguments,
        cx: &mut Context,
        inner: &mut Context,
    ) -> Result<(), Fail> {
        let Arguments::List { positional, named } = arguments else {
            let message = "only sum, product, min and max take `... for ... in ...`";
            return Err(self.error(Code::BadArguments, span, message));
        };
        let inputs: Vec<&Component> = components.iter().filter(|c| c.direction == Some(Direction::Input)).collect();
        if positional.len() > inputs.len() {
            let message = format!("too many arguments: {} are taken, {} are given", inputs.len(), positional.len());
            return Err(self.error(Code::BadArguments, span, message));
        }
        for (name, expr) in named {
            let Some(k) = inputs.iter().position(|c| c.name.name == name.name) else {
                let help = did_you_mean(&name.name, inputs.iter().map(|c| c.name.name.as_ref()));
                let message = format!("there is no input `{}`", name.name);
                self.report(Diagnostic::error(Code::BadArguments, message).at(name.span, "").maybe_help(help));
                return Err(Fail::Reported);
            };
            if k < positional.len() {
                let message = format!("the input `{}` has a value already, by its position", name.name);
                return Err(self.error(Code::BadArguments, name.span.to(expr.span), message));
            }
        }
        for (k, input) in inputs.iter().enumerate() {
            let given =
                positional.get(k).or_else(|| named.iter().find(|(n, _)| n.name == input.name.name).map(|(_, e)| e));
            let local = match (given, &input.modification.binding) {
                (Some(expr), _) => {
                    let local = self.local_value(expr, cx)?;
                    self.check_argument(expr, input, &local)?;
                    local
                }
                (None, Some(default)) => self.local_value(&default.clone(), inner)?,
                (None, None) => {
                    let message = format!("the input `{}` has no value", input.name.name);
                    return Err(self.error(Code::BadArguments, span, message));
                }
            };
            inner.names.push((input.name.name.clone(), local));
        }
        Ok(())
    }

    /// Rank and type of an argument against the declaration of the input.
    fn check_argument(&mut self, expr: &Expr, input: &Component, local: &Local) -> Result<(), Fail> {
        let rank = match local {
            Local::Array(_, shape) => shape.len(),
            _ => 0,
        };
        if rank != input.dims.len() && simple_type(input) {
            let rank_text = |rank: usize| match rank {
                0 => "a scalar".to_string(),
                1 => "an array".to_string(),
                _ => format!("an array with {rank} dimensions"),
            };
            let (wanted, given) = (rank_text(input.dims.len()), rank_text(rank));
            let message = format!("the input `{}` is {wanted}, but this is {given}", input.name.name);
            return Err(self.error(Code::ArrayShape, expr.span, message));
        }
        let wanted = input.class.parts[0].name.as_ref();
        let given = match local {
            Local::Node(typed) => typed.scalar.name().to_string(),
            Local::Array(items, _) => items.first().map_or("Real", |t| t.scalar.name()).to_string(),
            Local::Index(_) => "Integer".to_string(),
            Local::Value(value) => value.type_name(),
            Local::Record(_) => return Ok(()),
        };
        let fits = input.class.parts.len() > 1
            || !matches!(wanted, "Real" | "Integer" | "Boolean")
            || wanted == given
            || wanted == "Real" && given == "Integer";
        if fits {
            return Ok(());
        }
        let message = format!("the input `{}` is {wanted}, but this is {given}", input.name.name);
        Err(self.error(Code::TypeMismatch, expr.span, message))
    }

    /// An expression as a local value: a node, an array of nodes or a record.
    pub(crate) fn local_value(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        if let Some(record) = self.as_record(expr, cx)? {
            return Ok(record);
        }
        if self.is_text(expr, cx) {
            return Ok(Local::Value(Value::Text(self.text_value(expr, cx)?.into())));
        }
        let shape = self.shape(expr, cx)?;
        if shape.is_empty() {
            let value = self.lower(expr, cx, &[])?;
            // Whole numbers known here may serve as sizes and subscripts.
            if let (ScalarType::Integer, Some(k)) = (&value.scalar, self.model.templates.arena.as_constant(value.node))
            {
                return Ok(Local::Index(Affine::constant(k as i64)));
            }
            return Ok(Local::Node(value));
        }
        Ok(Local::Array(self.elements_of(expr, cx)?, shape))
    }

    /// A record expression as its fields; `None` if the expression is no record.
    fn as_record(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Local>, Fail> {
        match &expr.kind {
            ExprKind::Ref(reference) => {
                if !reference.global && cx.local(&reference.parts[0].name.name).is_some() {
                    let local = self.local_of_path(reference, cx)?;
                    return Ok(matches!(local, Local::Record(_)).then_some(local));
                }
                let Resolved::Variable(steps) = self.tree.resolve(cx.scope, reference)? else { return Ok(None) };
                let (last, _) = steps[steps.len() - 1];
                if self.tree.instances[last].primitive.is_some() {
                    return Ok(None);
                }
                let children = self.tree.instances[last].children.clone();
                let names: Vec<Name> = children.iter().map(|&c| self.tree.instances[c].name.clone()).collect();
                let mut fields = Vec::with_capacity(names.len());
                for (position, name) in names.iter().enumerate() {
                    if let Field::Expr(value) = field(expr, name, position, true) {
                        fields.push((name.clone(), self.local_value(&value, cx)?));
                    }
                }
                Ok(Some(Local::Record(fields)))
            }
            ExprKind::Call(function, arguments) if self.makes_record(function, cx)? => {
                self.call(expr.span, function, arguments, cx).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// True for constructors of records and functions whose first output is of a class, not of a predefined type.
    fn makes_record(&mut self, function: &ComponentRef, cx: &Context) -> Result<bool, Fail> {
        let simple = function.parts.len() == 1 && !function.global;
        if simple && crate::call::is_predefined(&function.parts[0].name.name) {
            return Ok(false);
        }
        let (local, def) = self.called_class(function, cx)?;
        if def.kind == ClassKind::Record {
            return Ok(true);
        }
        let shape = self.tree.table.shape(local.class)?;
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            if let Element::Component(c) = &elements(&owner)[element.position as usize]
                && c.direction == Some(Direction::Output)
            {
                if simple_type(c) {
                    return Ok(false);
                }
                let inst = self.tree.package_of(&local)?;
                let found = self.tree.find_class(Scope { inst, frame: element.frame }, &c.class)?;
                return Ok(self.tree.table.class(found.class).def.kind == ClassKind::Record);
            }
        }
        Ok(false)
    }

    /// The record of a constructor call, fields not given from the declarations.
    fn construct(&mut self, local: &LocalClass, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        self.tree.check_constructor(local.class, expr)?;
        let shape = self.tree.table.shape(local.class)?;
        let inst = self.tree.package_of(local)?;
        let mut fields: Vec<(Name, Local)> = Vec::new();
        for (position, element) in shape.elements.iter().filter(|e| e.component).enumerate() {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            let Element::Component(declaration) = &elements(&owner)[element.position as usize] else { continue };
            let value = match field(expr, &element.name, position, true) {
                Field::Expr(value) => self.local_value(&value, cx)?,
                _ => {
                    let mut own = Context { depth: cx.depth + 1, ..Context::new(Scope { inst, frame: element.frame }) };
                    own.names.clone_from(&fields);
                    match &declaration.modification.binding {
                        Some(default) => self.local_value(&default.clone(), &mut own)?,
                        None => {
                            let message = format!("the field `{}` has no value", element.name);
                            return Err(self.error(Code::BadArguments, expr.span, message));
                        }
                    }
                }
            };
            fields.push((element.name.clone(), value));
        }
        Ok(Local::Record(fields))
    }

    /// The fields of a record-valued expression as expressions; `None` if it is no record.
    pub(crate) fn record_fields(&mut self, expr: &Expr, cx: &mut Context) -> Result<Option<Vec<Name>>, Fail> {
        match &expr.kind {
            ExprKind::Ref(reference) => {
                if cx.local(&reference.parts[0].name.name).is_some() {
                    return Ok(None);
                }
                let Ok(Resolved::Variable(steps)) = self.tree.resolve(cx.scope, reference) else { return Ok(None) };
                let last = &self.tree.instances[steps[steps.len() - 1].0];
                if last.kind != ClassKind::Record {
                    return Ok(None);
                }
                Ok(Some(last.children.iter().map(|&c| self.tree.instances[c].name.clone()).collect()))
            }
            _ => Ok(None),
        }
    }

    /// True if calls that make the record in `expr` are constructors.
    pub(crate) fn by_constructor(&mut self, expr: &Expr, cx: &Context) -> Result<bool, Fail> {
        match making_call(expr) {
            None => Ok(true),
            Some(function) => {
                let function = function.clone();
                Ok(self.called_class(&function, cx)?.1.kind != ClassKind::Function)
            }
        }
    }

    /// `call.field`
    pub(crate) fn lower_field(
        &mut self,
        record: &Expr,
        name: &Name,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let local = self.field_value(record, name, cx)?;
        self.element_of_local(record.span, &local, index)
    }

    pub(crate) fn field_value(&mut self, record: &Expr, name: &Name, cx: &mut Context) -> Result<Local, Fail> {
        let Local::Record(fields) = self.local_value(record, cx)? else {
            return Err(self.error(Code::TypeMismatch, record.span, "a record is needed here"));
        };
        match fields.into_iter().find(|(n, _)| n == name) {
            Some((_, local)) => Ok(local),
            None => Err(self.error(Code::TypeMismatch, record.span, format!("the record has no field `{name}`"))),
        }
    }

    fn declare_local(&mut self, component: &Component, inner: &mut Context) -> Result<(), Fail> {
        let local = match &component.modification.binding {
            Some(binding) => self.local_value(&binding.clone(), inner)?,
            None if component.variability <= Variability::Parameter => return Ok(()),
            None if !simple_type(component) => match self.empty_record(component, inner)? {
                Some(record) => record,
                None => return Ok(()),
            },
            None => {
                let sizes = self.local_sizes(component, inner)?;
                if sizes.is_empty() {
                    return Ok(());
                }
                let zero = self.literal(0.0, ScalarType::Real);
                Local::Array(vec![zero; sizes.iter().product()], sizes)
            }
        };
        inner.names.push((component.name.name.clone(), local));
        Ok(())
    }

    /// A local record before its fields are set.
    fn empty_record(&mut self, component: &Component, inner: &mut Context) -> Result<Option<Local>, Fail> {
        let local = self.tree.find_class(inner.scope, &component.class)?;
        if self.tree.table.class(local.class).def.kind != ClassKind::Record {
            return Ok(None);
        }
        let shape = self.tree.table.shape(local.class)?;
        let zero = self.literal(0.0, ScalarType::Real);
        let fields = shape.elements.iter().filter(|e| e.component).map(|e| (e.name.clone(), Local::Node(zero.clone())));
        Ok(Some(Local::Record(fields.collect())))
    }

    fn local_sizes(&mut self, component: &Component, inner: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut sizes = Vec::new();
        for dim in &component.dims {
            let k = self.affine(dim, inner)?.as_constant().ok_or(Fail::NeedsExpansion)?;
            let size = usize::try_from(k).ok().filter(|&size| size <= MAX_LOCAL);
            sizes.push(size.ok_or_else(|| {
                self.error(Code::ArrayShape, dim.span, format!("the size {k} is negative or above {MAX_LOCAL}"))
            })?);
        }
        Ok(sizes)
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

/// Declared with a predefined type.
fn simple_type(component: &Component) -> bool {
    component.class.parts.len() == 1
        && matches!(component.class.parts[0].name.as_ref(), "Real" | "Integer" | "Boolean" | "String")
}
