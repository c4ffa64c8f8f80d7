//! What is called and with what: the class of a function, its declarations, the values of its inputs.
//!
//! Arguments stand by position or by name, defaults may use inputs before them (Modelica 3.6, section 12.4.1).  An argument
//! with more dimensions than the input asks for one call per element (section 12.4.6).

use std::rc::Rc;
use std::sync::Arc;

use hyd_instance::class::elements;
use hyd_instance::modifier::AstMod;
use hyd_instance::shape::Shape;
use hyd_instance::{Builtin, ClassTable, InstId, LocalClass, Resolved, Scope, Value};
use hyd_source::{Code, Diagnostic, Span, did_you_mean};
use hyd_syntax::tree::{
    Arguments, ClassBody, ClassDef, Component, ComponentRef, Direction, Element, Expr, Name, Statement, StatementKind,
};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::function::simple_type;
use crate::index::Affine;
use crate::walk::mentions;

/// A function with all its declarations.
#[derive(Clone)]
pub(crate) struct Callee {
    /// Scope of its text.
    pub inst: InstId,
    pub def: Arc<ClassDef>,
    pub shape: Rc<Shape>,
    /// Its inputs, outputs and locals, each with the frame its text belongs to.
    pub components: Vec<(u32, Component)>,
}

impl Callee {
    /// The inputs in their order.
    pub(crate) fn inputs(&self) -> Vec<Component> {
        self.with_direction(Direction::Input)
    }

    /// The outputs in their order.
    pub(crate) fn outputs(&self) -> Vec<Component> {
        self.with_direction(Direction::Output)
    }

    /// `annotation(GenerateEvents = true)`: relations inside cause events (Modelica 3.6, section 12.8).
    pub(crate) fn generates_events(&self) -> bool {
        let Some(annotation) = &self.def.annotation else { return false };
        let tree = AstMod::from_syntax(annotation);
        let said = tree.children.iter().find(|(name, _)| name.as_ref() == "GenerateEvents");
        let value = said.and_then(|(_, tree)| tree.binding.as_ref().map(|e| &e.kind));
        matches!(value, Some(hyd_syntax::tree::ExprKind::Boolean(true)))
    }

    /// The derivatives that its annotation names (Modelica 3.6, section 12.7.1).
    pub(crate) fn derivatives(&self) -> Vec<Arc<AstMod>> {
        let Some(annotation) = &self.def.annotation else { return Vec::new() };
        let tree = AstMod::from_syntax(annotation);
        tree.children.into_iter().filter(|(name, _)| name.as_ref() == "derivative").map(|(_, tree)| tree).collect()
    }

    fn with_direction(&self, direction: Direction) -> Vec<Component> {
        self.components.iter().map(|(_, c)| c).filter(|c| c.direction == Some(direction)).cloned().collect()
    }

    /// True if a variable or an output of it has a size that mentions the input.
    fn decides_sizes(&self, input: &Name) -> bool {
        let open = self.components.iter().filter(|(_, c)| c.direction != Some(Direction::Input));
        open.flat_map(|(_, c)| &c.dims).any(|dim| mentions(dim, input))
    }

    /// What the first assignment to a variable as a whole gives it.
    pub(crate) fn first_value(&self, table: &ClassTable<'_>, name: &Name) -> Option<Expr> {
        self.shape.frames.iter().find_map(|part| {
            let ClassBody::Long { algorithms, .. } = &table.class(part.class).def.body else { return None };
            algorithms.iter().find_map(|section| first_assignment(&section.statements, name))
        })
    }

    /// The surroundings of its text when it is called from `cx`, without names.
    pub(crate) fn context(&self, cx: &Context) -> Context {
        let mut inner = Context {
            no_event: cx.no_event || !self.generates_events(),
            depth: cx.depth + 1,
            ..Context::new(Scope { inst: self.inst, frame: 0 })
        };
        inner.counts.clone_from(&cx.counts);
        inner.fixed.clone_from(&cx.fixed);
        inner.implicit.clone_from(&cx.implicit);
        inner.inputs = self.inputs().iter().map(|c| c.name.name.clone()).collect();
        inner.called.clone_from(&cx.called);
        inner.called.push((self.inst, false));
        inner.called_from = cx.called_from;
        inner
    }
}

/// The value of an input.
pub(crate) struct Argument {
    pub local: Local,
    /// Sizes beyond those declared.
    pub outer: Vec<usize>,
}

impl Flattener<'_, '_> {
    pub(crate) fn called_class(
        &mut self,
        function: &ComponentRef,
        cx: &Context,
    ) -> Result<(LocalClass, Arc<ClassDef>), Fail> {
        let name = || function.parts.iter().map(|p| p.name.name.as_ref()).collect::<Vec<_>>().join(".");
        self.tree.table.messages.begin();
        let resolved = self.tree.resolve(cx.scope, function);
        let mut said = self.tree.table.messages.end();
        if resolved.is_err() && function.parts.len() == 1 {
            self.suggest_function(&mut said, &function.parts[0].name.name, cx.scope);
        }
        self.tree.table.messages.report_all(said);
        match resolved? {
            Resolved::Class(local) => {
                let def = self.tree.table.class(local.class).def.clone();
                Ok((local, def))
            }
            _ => Err(self.error(Code::BadArguments, function.span, format!("`{}` is not a function", name()))),
        }
    }

    /// The message for an unknown name in place of a function speaks of functions.
    fn suggest_function(&mut self, said: &mut [Diagnostic], name: &str, scope: Scope) {
        if said.iter().all(|d| d.code != Code::UnknownName) {
            return;
        }
        let mut names = self.tree.visible_classes(scope);
        names.extend(Builtin::names().map(Name::from));
        let help = did_you_mean(name, names.iter().map(|n| n.as_ref()));
        for message in said.iter_mut().filter(|d| d.code == Code::UnknownName) {
            message.message = format!("there is no function `{name}` here");
            message.notes = help.iter().cloned().collect();
        }
    }

    /// The function and its declarations.
    pub(crate) fn callee(&mut self, local: &LocalClass, def: Arc<ClassDef>) -> Result<Callee, Fail> {
        let shape = self.tree.table.shape(local.class)?;
        let inst = self.tree.package_of(local)?;
        let mut components: Vec<(u32, Component)> = Vec::new();
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = self.tree.table.class(shape.frames[element.frame as usize].class).def.clone();
            let Element::Component(component) = &elements(&owner)[element.position as usize] else { continue };
            let mut component = component.clone();
            // What a short definition or an `extends` clause says of an input is its default.
            let modified = shape.frames[element.frame as usize].modifications.iter().find_map(|(_, tree)| {
                let (_, inner) = tree.children.iter().find(|(name, _)| *name == component.name.name)?;
                inner.binding.clone()
            });
            if let Some(value) = modified {
                component.modification.binding = Some((*value).clone());
            }
            components.push((element.frame, component));
        }
        Ok(Callee { inst, def, shape, components })
    }

    /// Calls with the arguments of the text: once, or once per element where they are arrays of what is declared.
    pub(crate) fn call_with_arguments(
        &mut self,
        span: Span,
        callee: &Callee,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Vec<(Name, Local)>, Fail> {
        let values = match self.values_of_inputs(span, callee, arguments, cx) {
            Err(Fail::Reported) => {
                self.look_at_names(callee);
                return Err(Fail::Reported);
            }
            values => values?,
        };
        let Some(outer) = values.iter().map(|v| &v.outer).find(|outer| !outer.is_empty()).cloned() else {
            let locals = values.into_iter().map(|v| v.local).collect();
            return self.call_with(span, callee, locals, cx);
        };
        for value in values.iter().filter(|v| !v.outer.is_empty()) {
            self.check_same_sizes("the arguments of a call per element", span, &value.outer, &outer)?;
        }
        let total: usize = outer.iter().product();
        let mut results: Vec<(Name, Local)> = Vec::new();
        for k in 0..total {
            let locals = values.iter().map(|v| slice(v, k, total)).collect();
            for (position, (name, local)) in self.call_with(span, callee, locals, cx)?.into_iter().enumerate() {
                let (items, inner) = match local {
                    Local::Array(items, inner) => (items, inner),
                    Local::Record(_) | Local::Records(..) => {
                        let message = "a function that gives a record cannot be called per element";
                        return Err(self.error(Code::TypeMismatch, span, message));
                    }
                    single => (Rc::new(vec![self.as_node(span, &single)?]), Vec::new()),
                };
                if k == 0 {
                    let shape = outer.iter().chain(&inner).copied().collect();
                    results.push((name, Local::array(Vec::new(), shape)));
                }
                if let Local::Array(all, _) = &mut results[position].1 {
                    Rc::make_mut(all).extend(items.iter().cloned());
                }
            }
        }
        if total == 0 {
            let outputs = callee.outputs();
            results = outputs.into_iter().map(|c| (c.name.name, Local::array(Vec::new(), outer.clone()))).collect();
        }
        Ok(results)
    }

    /// The values of all inputs in their order, defaults in place of those not given.
    fn values_of_inputs(
        &mut self,
        span: Span,
        callee: &Callee,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Vec<Argument>, Fail> {
        let Arguments::List { positional, named } = arguments else {
            let message = "only sum, product, min and max take `... for ... in ...`";
            return Err(self.error(Code::BadArguments, span, message));
        };
        let inputs = callee.inputs();
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
        let mut defaults = callee.context(cx);
        let mut values = Vec::with_capacity(inputs.len());
        let mut spans = Vec::with_capacity(inputs.len());
        for (k, input) in inputs.iter().enumerate() {
            let by_name = || named.iter().find(|(n, _)| n.name == input.name.name).map(|(_, e)| e);
            let (local, outer) = match (positional.get(k).or_else(by_name), &input.modification.binding) {
                (Some(expr), _) => {
                    let local = match self.size_given(expr, callee, input, cx)? {
                        Some(size) => size,
                        None => self.local_value(expr, cx)?,
                    };
                    let outer = self.check_argument(expr, input, &local)?;
                    spans.push(Some(expr.span));
                    (local, outer)
                }
                (None, Some(default)) => {
                    spans.push(None);
                    (self.local_value(&default.clone(), &mut defaults)?, Vec::new())
                }
                (None, None) => {
                    let message = format!("the input `{}` has no value", input.name.name);
                    return Err(self.error(Code::BadArguments, span, message));
                }
            };
            defaults.names.push((input.name.name.clone(), local.clone()));
            values.push(Argument { local, outer });
        }
        for ((input, value), span) in inputs.iter().zip(&values).zip(spans) {
            if let Some(span) = span {
                self.check_sizes_of_input(span, input, value, &mut defaults)?;
            }
        }
        Ok(values)
    }

    /// The value of an argument that decides sizes inside the function, if parameters give it: they decide on structure then.
    fn size_given(
        &mut self,
        expr: &Expr,
        callee: &Callee,
        input: &Component,
        cx: &Context,
    ) -> Result<Option<Local>, Fail> {
        let decides = matches!(input.class.parts.as_slice(), [only] if only.name.as_ref() == "Integer")
            && input.dims.is_empty()
            && callee.decides_sizes(&input.name.name);
        let names: Vec<Name> = cx.names.iter().map(|(name, _)| name.clone()).collect();
        if !decides || cx.depth > 0 || !self.known_with(expr, cx.scope, &names) {
            return Ok(None);
        }
        let (env, complete) = cx.env();
        if !complete && self.mentions_counter(expr, cx) {
            return Err(Fail::NeedsExpansion);
        }
        match self.tree.quietly(|tree| tree.evaluate(expr, cx.scope, &env)) {
            Ok(Value::Integer(size)) => Ok(Some(Local::Index(Affine::constant(size)))),
            _ => Ok(None),
        }
    }

    /// The sizes that an input declares, where they are known here.
    fn check_sizes_of_input(
        &mut self,
        span: Span,
        input: &Component,
        value: &Argument,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let (Local::Array(_, shape) | Local::Records(_, shape)) = &value.local else { return Ok(()) };
        let own = &shape[value.outer.len()..];
        for (dim, &size) in input.dims.iter().zip(own) {
            if matches!(dim.kind, hyd_syntax::tree::ExprKind::Colon) {
                continue;
            }
            let known = self.quietly(|flat| flat.affine(dim, cx)).ok().and_then(|affine| affine.as_constant());
            if let Some(wanted) = known.filter(|&wanted| wanted != size as i64) {
                let name = &input.name.name;
                let message = format!("the input `{name}` has the size {wanted} here, but this has {size}");
                self.report(Diagnostic::error(Code::ArrayShape, message).at(span, "").with(dim.span, "declared here"));
                return Err(Fail::Reported);
            }
        }
        Ok(())
    }

    fn check_rank_of_records(&mut self, expr: &Expr, input: &Component, local: &Local) -> Result<Vec<usize>, Fail> {
        let (wanted, given) = (input.dims.len(), if let Local::Records(_, shape) = local { shape.len() } else { 0 });
        if wanted == given {
            return Ok(Vec::new());
        }
        let text = |rank: usize| match rank {
            0 => "one record".to_string(),
            1 => "an array of records".to_string(),
            _ => format!("an array of records with {rank} dimensions"),
        };
        let message = format!("the input `{}` is {}, but this is {}", input.name.name, text(wanted), text(given));
        Err(self.error(Code::ArrayShape, expr.span, message))
    }

    /// Rank and type of an argument against the declaration of the input.  An array more than is declared asks for
    /// a call per element (12.4.6): the sizes of that array.
    fn check_argument(&mut self, expr: &Expr, input: &Component, local: &Local) -> Result<Vec<usize>, Fail> {
        let shape: &[usize] = match local {
            Local::Array(_, shape) => shape,
            _ => &[],
        };
        let rank = shape.len();
        let outer = shape[..rank.saturating_sub(input.dims.len())].to_vec();
        if rank < input.dims.len() && simple_type(input) {
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
            Local::Record(_) | Local::Records(..) => return self.check_rank_of_records(expr, input, local),
        };
        let fits = input.class.parts.len() > 1
            || !matches!(wanted, "Real" | "Integer" | "Boolean")
            || wanted == given
            || wanted == "Real" && given == "Integer";
        if fits {
            return Ok(if simple_type(input) { outer } else { Vec::new() });
        }
        let message = format!("the input `{}` is {wanted}, but this is {given}", input.name.name);
        Err(self.error(Code::TypeMismatch, expr.span, message))
    }
}

fn first_assignment(statements: &[Statement], name: &Name) -> Option<Expr> {
    statements.iter().find_map(|statement| match &statement.kind {
        StatementKind::Assign(target, value) => {
            let whole = target.parts.len() == 1 && target.parts[0].subscripts.is_empty();
            (whole && target.parts[0].name.name == *name).then(|| value.clone())
        }
        StatementKind::If(branches) => branches.iter().find_map(|(_, body)| first_assignment(body, name)),
        StatementKind::For(_, body) | StatementKind::While(_, body) => first_assignment(body, name),
        _ => None,
    })
}

/// Element `k` of `total` of an argument that is an array of what is declared.
fn slice(argument: &Argument, k: usize, total: usize) -> Local {
    match &argument.local {
        Local::Array(items, shape) if !argument.outer.is_empty() => {
            let size = items.len() / total.max(1);
            let part = items[k * size..(k + 1) * size].to_vec();
            match &shape[argument.outer.len()..] {
                [] => Local::Node(part[0].clone()),
                inner => Local::array(part, inner.to_vec()),
            }
        }
        other => other.clone(),
    }
}
