//! What is called with what: the values of the inputs of a function.
//!
//! Arguments stand by position or by name, defaults may use inputs before them (Modelica 3.6, section 12.4.1).  An argument
//! with more dimensions than the input asks for one call per element (section 12.4.6).

use std::rc::Rc;

use hyd_instance::{ScalarType, Scope, Value};
use hyd_source::{Code, Diagnostic, Span, did_you_mean};
use hyd_syntax::tree::Name;
use hyd_typed::{Base, Call, Declaration, Expr, Function, Kind};

use crate::state::context::{Closure, Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;

/// True for the name of a variable of a function that nothing has given a value on the way here.
fn is_unset_number(expr: &Expr, cx: &Context) -> bool {
    let is_number = expr.ty == hyd_typed::Type::scalar(ScalarType::Real);
    matches!(&expr.kind, Kind::Local(name) if is_number && cx.local(name.name()).is_none())
}

impl Context {
    /// The surroundings of the text of a function that is called from here, without names.
    pub(crate) fn inside(&self, function: &Function) -> Context {
        let mut inner = Context {
            no_event: self.no_event || self.in_when || !function.generates_events(),
            depth: self.depth + 1,
            ..Context::new(Scope { inst: function.inst, frame: 0 })
        };
        inner.counts.clone_from(&self.counts);
        inner.fixed.clone_from(&self.fixed);
        inner.implicit.clone_from(&self.implicit);
        inner.inputs = function.inputs().map(|v| v.name.name.clone()).collect();
        inner.called.clone_from(&self.called);
        inner.called.push((function.inst, false));
        inner.called_from = self.called_from;
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
    /// Calls with the arguments of the text: once, or once per element where they are arrays of what is declared.
    pub(crate) fn call_with_arguments(
        &mut self,
        span: Span,
        closure: &Closure,
        call: &Call,
        cx: &mut Context,
    ) -> Result<Vec<(Name, Local)>, Fail> {
        let callee = &*closure.function;
        let values = match self.values_of_inputs(span, closure, call, cx) {
            Err(Fail::Reported) => {
                self.say_failed(callee);
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
        // Records by the position of their output.
        let mut records: Vec<(usize, Name, Vec<Local>)> = Vec::new();
        for k in 0..total {
            let locals = values.iter().map(|v| slice(v, k, total)).collect();
            for (position, (name, local)) in self.call_with(span, callee, locals, cx)?.into_iter().enumerate() {
                let (items, inner) = match local {
                    Local::Array(items, inner) => (items, inner),
                    record @ (Local::Record(_) | Local::Records(..)) => {
                        match records.iter_mut().find(|(at, ..)| *at == position) {
                            Some((.., all)) => all.push(record),
                            None => records.push((position, name, vec![record])),
                        }
                        continue;
                    }
                    single => (Rc::new(vec![self.as_node(span, &single)?]), Vec::new()),
                };
                match results.iter_mut().find(|(known, _)| *known == name) {
                    Some((_, Local::Array(all, _))) => Rc::make_mut(all).extend(items.iter().cloned()),
                    _ => {
                        let shape = outer.iter().chain(&inner).copied().collect();
                        results.push((name, Local::array(items.to_vec(), shape)));
                    }
                }
            }
        }
        for (position, name, mut all) in records {
            for &size in outer.iter().rev() {
                let rows: Vec<Vec<Local>> = all.chunks(size).map(<[Local]>::to_vec).collect();
                all = rows.into_iter().map(|row| self.stacked(span, row)).collect::<Result<_, Fail>>()?;
            }
            if let Some(whole) = all.pop() {
                results.insert(position.min(results.len()), (name, whole));
            }
        }
        if total == 0 {
            return Ok(self.results_of_no_calls(callee, &values, &outer, cx));
        }
        Ok(results)
    }

    /// What calls for arrays without elements give: arrays without elements, of the sizes that the outputs have by their declarations.
    fn results_of_no_calls(
        &mut self,
        callee: &Function,
        values: &[Argument],
        outer: &[usize],
        cx: &Context,
    ) -> Vec<(Name, Local)> {
        let zero = self.literal(0.0, ScalarType::Real);
        let mut inner = cx.inside(callee);
        for (input, value) in callee.inputs().zip(values) {
            let one = match &value.local {
                Local::Array(_, shape) if !value.outer.is_empty() => match &shape[value.outer.len()..] {
                    [] => Local::Node(zero.clone()),
                    own => Local::array(vec![zero.clone(); own.iter().product()], own.to_vec()),
                },
                other => other.clone(),
            };
            inner.names.push((input.name.name.clone(), one));
        }
        let mut results = Vec::new();
        for output in callee.outputs() {
            inner.scope.frame = output.frame;
            let sizes = self.quietly(|flat| flat.local_sizes(output, &mut inner));
            // What asks for values that there are not has no elements.
            let own = sizes.unwrap_or_else(|_| vec![0; output.dims.len()]);
            let sizes: Vec<usize> = outer.iter().copied().chain(own).collect();
            let form = self.quietly(|flat| flat.declared_form(&output.name, &output.ty.base, &sizes, &inner));
            let none = form.map(|form| form.local(&mut std::iter::repeat(zero.node)));
            results.push((output.name.name.clone(), none.unwrap_or_else(|_| Local::array(Vec::new(), sizes))));
        }
        results
    }

    /// The values of all inputs in their order, defaults in place of those not given.
    fn values_of_inputs(
        &mut self,
        span: Span,
        Closure { function: callee, given }: &Closure,
        call: &Call,
        cx: &mut Context,
    ) -> Result<Vec<Argument>, Fail> {
        let (positional, named) = (&call.positional, &call.named);
        let inputs: Vec<&Declaration> = callee.inputs().collect();
        let before = |input: &Declaration| given.iter().find(|(name, _)| *name == input.name.name);
        let open: Vec<&Declaration> = inputs.iter().copied().filter(|input| before(input).is_none()).collect();
        if positional.len() > open.len() {
            let message = format!("too many arguments: {} are taken, {} are given", open.len(), positional.len());
            return Err(self.error(Code::BadArguments, span, message));
        }
        for (name, expr) in named {
            let Some(k) = open.iter().position(|c| c.name.name == name.name) else {
                let help = did_you_mean(&name.name, open.iter().map(|c| c.name.name.as_ref()));
                let message = format!("there is no input `{}`", name.name);
                self.report(Diagnostic::error(Code::BadArguments, message).at(name.span, "").maybe_help(help));
                return Err(Fail::Reported);
            };
            if k < positional.len() {
                let message = format!("the input `{}` has a value already, by its position", name.name);
                return Err(self.error(Code::BadArguments, name.span.to(expr.span), message));
            }
        }
        let mut defaults = cx.inside(callee);
        let mut values = Vec::with_capacity(inputs.len());
        let mut spans = Vec::with_capacity(inputs.len());
        let mut places = 0..;
        for input in &inputs {
            if let Some((name, value)) = before(input) {
                defaults.names.push((name.clone(), value.clone()));
                values.push(Argument { local: value.clone(), outer: Vec::new() });
                spans.push(None);
                continue;
            }
            let k = places.next().unwrap_or(usize::MAX);
            let by_name = || named.iter().find(|(n, _)| n.name == input.name.name).map(|(_, e)| e);
            let (local, outer) = match (positional.get(k).or_else(by_name), &input.value) {
                (Some(expr), _) => {
                    let local = match self.size_given(expr, callee, input, cx)? {
                        Some(size) => size,
                        // What the function does not read may be anything.
                        None if is_unset_number(expr, cx)
                            && callee.derivatives().is_empty()
                            && !callee.reads(&input.name.name) =>
                        {
                            Local::Node(self.literal(0.0, ScalarType::Real))
                        }
                        None if input.ty.is_text()
                            && input.ty.rank == 0
                            && self.only_shows(callee, &input.name.name, cx.scope) =>
                        {
                            self.shown_text(expr, cx)?
                        }
                        None => {
                            let local = self.argument(expr, cx)?;
                            self.with_sizing_fields(expr, callee, input, local, cx)?
                        }
                    };
                    let outer = self.check_argument(expr, input, &local)?;
                    spans.push(Some(expr.span));
                    (local, outer)
                }
                (None, Some(default)) => {
                    spans.push(None);
                    (self.argument(default, &mut defaults)?, Vec::new())
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
        callee: &Function,
        input: &Declaration,
        cx: &Context,
    ) -> Result<Option<Local>, Fail> {
        let decides =
            input.ty == hyd_typed::Type::scalar(ScalarType::Integer) && callee.decides_sizes(&input.name.name);
        if !decides {
            return Ok(None);
        }
        self.size_known(expr, cx)
    }

    /// A record with the integers in it that decide sizes inside the function as numbers, where parameters give them.
    fn with_sizing_fields(
        &mut self,
        expr: &Expr,
        callee: &Function,
        input: &Declaration,
        local: Local,
        cx: &mut Context,
    ) -> Result<Local, Fail> {
        let (Local::Record(mut fields), Kind::Variable(variable)) = (local.clone(), &expr.kind) else {
            return Ok(local);
        };
        let children = self.scopes.instances[variable.last()].children.clone();
        for name in callee.sizing_fields(&input.name.name) {
            let child = children.iter().copied().find(|&child| self.scopes.instances[child].name == name);
            let (Some(child), Some(field)) = (child, fields.iter_mut().find(|field| field.0 == name)) else { continue };
            let component = self.component_of(expr, variable, child);
            let scalar = |scalar| component.ty == hyd_typed::Type::scalar(scalar);
            if (scalar(ScalarType::Integer) || scalar(ScalarType::Boolean))
                && let Some(size) = self.size_known(&component, cx)?
            {
                field.1 = size;
            }
        }
        Ok(Local::Record(fields))
    }

    /// The value of an Integer or Boolean that parameters give.
    fn size_known(&mut self, expr: &Expr, cx: &Context) -> Result<Option<Local>, Fail> {
        if cx.depth > 0 || !self.known_before_run(expr) {
            return Ok(None);
        }
        let (env, complete) = cx.env();
        if !complete && cx.has_counter_in(expr) {
            return Err(Fail::NeedsExpansion);
        }
        let text = expr.evaluable();
        match self.scopes.quietly(|scopes| scopes.evaluate(&text, cx.scope, &env)) {
            Ok(Value::Integer(size)) => Ok(Some(Local::Index(Affine::constant(size)))),
            Ok(decides @ Value::Boolean(_)) => Ok(Some(Local::Value(decides))),
            _ => Ok(None),
        }
    }

    /// The sizes that an input declares, where they are known here.
    fn check_sizes_of_input(
        &mut self,
        span: Span,
        input: &Declaration,
        value: &Argument,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let (Local::Array(_, shape) | Local::Records(_, shape)) = &value.local else { return Ok(()) };
        let own = &shape[value.outer.len()..];
        for (dim, &size) in input.dims.iter().zip(own) {
            if matches!(dim.kind, Kind::Colon) {
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

    fn check_rank_of_records(&mut self, expr: &Expr, input: &Declaration, local: &Local) -> Result<Vec<usize>, Fail> {
        let shape: &[usize] = if let Local::Records(_, shape) = local { shape } else { &[] };
        let (wanted, given) = (input.dims.len(), shape.len());
        if wanted <= given {
            return Ok(shape[..given - wanted].to_vec());
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
    fn check_argument(&mut self, expr: &Expr, input: &Declaration, local: &Local) -> Result<Vec<usize>, Fail> {
        let shape: &[usize] = match local {
            Local::Array(_, shape) => shape,
            _ => &[],
        };
        let rank = match local {
            Local::Value(value) => value.shape().len(),
            _ => shape.len(),
        };
        let outer = shape[..shape.len().saturating_sub(input.dims.len())].to_vec();
        if rank < input.dims.len() && input.is_simple() {
            let rank_text = |rank: usize| match rank {
                0 => "a scalar".to_string(),
                1 => "an array".to_string(),
                _ => format!("an array with {rank} dimensions"),
            };
            let (wanted, given) = (rank_text(input.dims.len()), rank_text(rank));
            let message = format!("the input `{}` is {wanted}, but this is {given}", input.name.name);
            return Err(self.error(Code::ArrayShape, expr.span, message));
        }
        let wanted = input.text.class.parts[0].name.as_ref();
        let given = match local {
            Local::Node(typed) => typed.scalar.name().to_string(),
            Local::Array(items, _) => match (items.first(), &expr.ty.base) {
                (Some(first), _) => first.scalar.name().to_string(),
                // Without elements the text says of which type they would be.
                (None, Base::Scalar(scalar)) => scalar.name().to_string(),
                (None, _) => wanted.to_string(),
            },
            Local::Index(_) => "Integer".to_string(),
            Local::Value(value) => value.type_name(),
            Local::Function(_) if input.ty.is_function() => return Ok(Vec::new()),
            Local::Function(_) => "a function".to_string(),
            Local::Record(_) | Local::Records(..) if input.ty.is_function() => "a record".to_string(),
            Local::Record(_) | Local::Records(..) => return self.check_rank_of_records(expr, input, local),
        };
        if input.ty.is_function() {
            let message = format!("the input `{}` is a function, but this is {given}", input.name.name);
            return Err(self.error(Code::TypeMismatch, expr.span, message));
        }
        let fits = input.text.class.parts.len() > 1
            || !matches!(wanted, "Real" | "Integer" | "Boolean")
            || wanted == given
            || wanted == "Real" && given == "Integer";
        if fits {
            return Ok(if input.is_simple() { outer } else { Vec::new() });
        }
        let message = format!("the input `{}` is {wanted}, but this is {given}", input.name.name);
        Err(self.error(Code::TypeMismatch, expr.span, message))
    }
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
        Local::Records(fields, shape) if !argument.outer.is_empty() => {
            record_at(fields, shape, argument.outer.len(), k, total)
        }
        other => other.clone(),
    }
}

/// Element `k` of `total` of an array of records, along its first `outer` dimensions.
fn record_at(fields: &[(Name, Local)], shape: &[usize], outer: usize, k: usize, total: usize) -> Local {
    let field = |(name, field): &(Name, Local)| {
        let part = match field {
            Local::Array(items, sizes) => {
                let size = items.len() / total.max(1);
                let part = items[k * size..(k + 1) * size].to_vec();
                match &sizes[outer..] {
                    [] => Local::Node(part[0].clone()),
                    inner => Local::array(part, inner.to_vec()),
                }
            }
            Local::Records(inner, sizes) => record_at(inner, sizes, outer, k, total),
            other => other.clone(),
        };
        (name.clone(), part)
    };
    let fields = fields.iter().map(field).collect();
    match &shape[outer..] {
        [] => Local::Record(fields),
        inner => Local::Records(fields, inner.to_vec()),
    }
}
