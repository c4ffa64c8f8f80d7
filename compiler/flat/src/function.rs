//! Functions with algorithms, by running them symbolically.
//!
//! The statements of a function are executed once over nodes instead of numbers: an assignment binds a name to a node, an
//! `if` joins both ways by a selection, a `for` with known range is run through.  The result is an expression like any
//! other, so it is shared by template and differentiated like the rest.  Scalar and array arguments of known size; no
//! `while` whose condition depends on values of the run.

use std::sync::Arc;

use hyd_instance::class::elements;
use hyd_instance::{Resolved, ScalarType, Scope};
use hyd_source::{Code, Span};
use hyd_syntax::tree::{
    Arguments, ClassBody, ClassDef, ClassKind, Component, ComponentRef, Direction, Element, Expr, Name, Statement,
    StatementKind, Variability,
};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;
use crate::reference::Range;

/// Deepest nesting of function calls.
const MAX_CALLS: usize = 64;

impl Flattener<'_, '_> {
    fn function_class(
        &mut self,
        function: &ComponentRef,
        cx: &Context,
    ) -> Result<(hyd_instance::ClassId, Arc<ClassDef>), Fail> {
        let name = || function.parts.iter().map(|p| p.name.name.as_ref()).collect::<Vec<_>>().join(".");
        match self.tree.resolve(cx.scope, function)? {
            Resolved::Class(local) => {
                let def = self.tree.table.class(local.class).def.clone();
                if def.kind == ClassKind::Function {
                    return Ok((local.class, def));
                }
                Err(self.error(Code::BadArguments, function.span, format!("`{}` is not a function", name())))
            }
            _ => Err(self.error(Code::BadArguments, function.span, format!("`{}` is not a function", name()))),
        }
    }

    /// A call of the user's own function: its (first) output.
    pub(crate) fn lower_user_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let (class, def) = self.function_class(function, cx)?;
        if cx.depth >= MAX_CALLS {
            let message = format!("functions call each other deeper than {MAX_CALLS} levels");
            return Err(self.error(Code::Limit, span, message));
        }
        let ClassBody::Long { elements: _, algorithms, external, .. } = &def.body else {
            return Err(self.error(
                Code::OutsideProfile,
                span,
                "functions defined by another function are not supported",
            ));
        };
        if let Some(external) = external {
            return Err(self.error(
                Code::OutsideProfile,
                *external,
                "external functions are outside the language profile",
            ));
        }
        let inst = self.tree.package_of(class)?;
        let mut inner = Context { no_event: true, depth: cx.depth + 1, ..Context::new(Scope { inst, frame: 0 }) };
        inner.counts.clone_from(&cx.counts);
        inner.fixed.clone_from(&cx.fixed);
        let components: Vec<&Component> = elements(&def).iter().filter_map(as_component).collect();
        self.bind_inputs(span, &components, arguments, cx, &mut inner)?;
        for component in components.iter().filter(|c| c.direction != Some(Direction::Input)) {
            self.declare_local(component, &mut inner)?;
        }
        for section in algorithms {
            self.run(&section.statements, &mut inner)?;
        }
        let Some(output) = components.iter().find(|c| c.direction == Some(Direction::Output)) else {
            return Err(self.error(Code::BadArguments, span, format!("`{}` gives no value", def.name.name)));
        };
        match inner.local(&output.name.name) {
            Some(Local::Node(typed)) if index.is_empty() => Ok(typed.clone()),
            Some(Local::Array(items, shape)) => {
                let mut position = 0;
                for (affine, size) in index.iter().zip(shape) {
                    let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                    position = position * size + k as usize;
                }
                items.get(position).cloned().ok_or(Fail::Reported)
            }
            _ => Err(self.error(
                Code::BadArguments,
                span,
                format!("`{}` does not set its output `{}`", def.name.name, output.name.name),
            )),
        }
    }

    pub(crate) fn shape_of_user_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        cx: &mut Context,
    ) -> Result<Vec<usize>, Fail> {
        let (class, def) = self.function_class(function, cx)?;
        let components: Vec<&Component> = elements(&def).iter().filter_map(as_component).collect();
        let Some(output) = components.iter().find(|c| c.direction == Some(Direction::Output)) else {
            return Ok(Vec::new());
        };
        if output.dims.is_empty() {
            return Ok(Vec::new());
        }
        let inst = self.tree.package_of(class)?;
        let mut inner = Context { depth: cx.depth + 1, ..Context::new(Scope { inst, frame: 0 }) };
        self.bind_inputs(span, &components, arguments, cx, &mut inner)?;
        self.local_sizes(output, &mut inner)
    }

    fn bind_inputs(
        &mut self,
        span: Span,
        components: &[&Component],
        arguments: &Arguments,
        cx: &mut Context,
        inner: &mut Context,
    ) -> Result<(), Fail> {
        let Arguments::List { positional, named } = arguments else {
            return Err(self.error(
                Code::BadArguments,
                span,
                "only sum, product, min and max take `... for ... in ...`",
            ));
        };
        let inputs: Vec<&&Component> = components.iter().filter(|c| c.direction == Some(Direction::Input)).collect();
        if positional.len() > inputs.len() {
            let message = format!("too many arguments: {} are taken, {} are given", inputs.len(), positional.len());
            return Err(self.error(Code::BadArguments, span, message));
        }
        for (name, expr) in named {
            if !inputs.iter().any(|c| c.name.name == name.name) {
                return Err(self.error(Code::BadArguments, expr.span, format!("there is no input `{}`", name.name)));
            }
        }
        for (k, input) in inputs.iter().enumerate() {
            let given =
                positional.get(k).or_else(|| named.iter().find(|(n, _)| n.name == input.name.name).map(|(_, e)| e));
            let local = match (given, &input.modification.binding) {
                (Some(expr), _) => self.local_value(expr, cx)?,
                (None, Some(default)) => self.local_value(&default.clone(), inner)?,
                (None, None) => {
                    return Err(self.error(
                        Code::BadArguments,
                        span,
                        format!("the input `{}` has no value", input.name.name),
                    ));
                }
            };
            inner.names.push((input.name.name.clone(), local));
        }
        Ok(())
    }

    /// An expression as a local value: a node, or an array of nodes.
    fn local_value(&mut self, expr: &Expr, cx: &mut Context) -> Result<Local, Fail> {
        let shape = self.shape(expr, cx)?;
        if shape.is_empty() {
            let before = std::mem::replace(&mut cx.no_event, true);
            let value = self.lower(expr, cx, &[]);
            cx.no_event = before;
            let value = value?;
            // Whole numbers known here may serve as sizes and subscripts.
            if let (ScalarType::Integer, Some(k)) = (&value.scalar, self.model.templates.arena.as_constant(value.node))
            {
                return Ok(Local::Index(Affine::constant(k as i64)));
            }
            return Ok(Local::Node(value));
        }
        Ok(Local::Array(self.elements_of(expr, cx)?, shape))
    }

    fn local_sizes(&mut self, component: &Component, inner: &mut Context) -> Result<Vec<usize>, Fail> {
        let mut sizes = Vec::new();
        for dim in &component.dims {
            let k = self.affine(dim, inner)?.as_constant().ok_or(Fail::NeedsExpansion)?;
            sizes.push(
                usize::try_from(k)
                    .map_err(|_| self.error(Code::ArrayShape, dim.span, format!("the size {k} is negative")))?,
            );
        }
        Ok(sizes)
    }

    fn declare_local(&mut self, component: &Component, inner: &mut Context) -> Result<(), Fail> {
        let local = match &component.modification.binding {
            Some(binding) => self.local_value(&binding.clone(), inner)?,
            None if component.variability <= Variability::Parameter => return Ok(()),
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

    fn run(&mut self, statements: &[Statement], cx: &mut Context) -> Result<(), Fail> {
        for statement in statements {
            self.run_statement(statement, cx)?;
        }
        Ok(())
    }

    fn run_statement(&mut self, statement: &Statement, cx: &mut Context) -> Result<(), Fail> {
        match &statement.kind {
            StatementKind::Assign(target, value) => self.assign(target, value, cx),
            StatementKind::If(branches) => self.run_if(branches, cx),
            StatementKind::For(iterators, body) => self.run_for(iterators, body, cx),
            StatementKind::Call(function, _) if function.parts[0].name.name.as_ref() == "assert" => Ok(()),
            _ => Err(self.error(
                Code::OutsideProfile,
                statement.span,
                "this statement is not supported inside functions",
            )),
        }
    }

    fn assign(&mut self, target: &ComponentRef, value: &Expr, cx: &mut Context) -> Result<(), Fail> {
        let [part] = target.parts.as_slice() else {
            return Err(self.error(
                Code::OutsideProfile,
                target.span,
                "assignments to record elements are not supported",
            ));
        };
        let name: Name = part.name.name.clone();
        if part.subscripts.is_empty() {
            let local = self.local_value(value, cx)?;
            cx.names.retain(|(n, _)| *n != name);
            cx.names.push((name, local));
            return Ok(());
        }
        let value = self.lower(value, cx, &[])?;
        let mut at = Vec::new();
        for subscript in &part.subscripts {
            at.push(self.affine(subscript, cx)?.as_constant().ok_or(Fail::NeedsExpansion)? - 1);
        }
        if let Some((_, Local::Array(items, shape))) = cx.names.iter_mut().rev().find(|(n, _)| *n == name) {
            let mut position = 0;
            for (&k, &size) in at.iter().zip(shape.iter()) {
                if k < 0 || k as usize >= size {
                    let message = format!("subscript {} is outside 1..{size}", k + 1);
                    return Err(self.error(Code::ArrayShape, target.span, message));
                }
                position = position * size + k as usize;
            }
            if let Some(item) = items.get_mut(position) {
                *item = value;
                return Ok(());
            }
        }
        Err(self.error(Code::ArrayShape, target.span, format!("`{name}` is not an array here")))
    }

    /// Both ways are run; what they set is joined by a selection.
    fn run_if(&mut self, branches: &[(Option<Expr>, Vec<Statement>)], cx: &mut Context) -> Result<(), Fail> {
        let Some(((condition, body), rest)) = branches.split_first() else { return Ok(()) };
        let Some(condition) = condition else { return self.run(body, cx) };
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        if let Some(known) = self.model.templates.arena.as_constant(test.node) {
            return if known != 0.0 { self.run(body, cx) } else { self.run_if(rest, cx) };
        }
        let mut yes = cx.clone();
        self.run(body, &mut yes)?;
        let mut no = cx.clone();
        self.run_if(rest, &mut no)?;
        let mut joined = Vec::new();
        for (name, local) in &yes.names {
            let Some(other) = no.local(name) else { continue };
            joined.push((name.clone(), self.join(condition.span, test.node, local, other)?));
        }
        cx.names = joined;
        Ok(())
    }

    fn join(&mut self, span: Span, test: hyd_symbolic::NodeId, a: &Local, b: &Local) -> Result<Local, Fail> {
        match (a, b) {
            (Local::Index(x), Local::Index(y)) if x == y => Ok(a.clone()),
            (Local::Array(x, shape), Local::Array(y, other)) if shape == other => {
                let mut items = Vec::with_capacity(x.len());
                for (p, q) in x.iter().zip(y) {
                    items.push(self.choose(span, test, p.clone(), q.clone())?);
                }
                Ok(Local::Array(items, shape.clone()))
            }
            (Local::Value(_), _) => Ok(a.clone()),
            _ => {
                let (x, y) = (self.as_node(a)?, self.as_node(b)?);
                Ok(Local::Node(self.choose(span, test, x, y)?))
            }
        }
    }

    fn as_node(&mut self, local: &Local) -> Result<Typed, Fail> {
        match local {
            Local::Node(typed) => Ok(typed.clone()),
            Local::Index(affine) => {
                let k = affine.as_constant().ok_or(Fail::NeedsExpansion)?;
                Ok(self.literal(k as f64, ScalarType::Integer))
            }
            _ => Err(Fail::Reported),
        }
    }

    fn run_for(
        &mut self,
        iterators: &[hyd_syntax::tree::Iterator],
        body: &[Statement],
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let Some((iterator, rest)) = iterators.split_first() else { return self.run(body, cx) };
        let range = self.range(iterator, cx)?;
        for k in 0..range.count() {
            let local = match &range {
                Range::Steps { start, step, .. } => {
                    Local::Index(start.add_scaled(&Affine::constant(k as i64), *step).ok_or(Fail::NeedsExpansion)?)
                }
                Range::Values(values) => crate::lower::local_of(values[k].clone()),
            };
            cx.names.push((iterator.name.name.clone(), local));
            self.run_for(rest, body, cx)?;
            if let Some(position) = cx.names.iter().rposition(|(n, _)| *n == iterator.name.name) {
                cx.names.remove(position);
            }
        }
        Ok(())
    }
}

fn as_component(element: &Element) -> Option<&Component> {
    match element {
        Element::Component(component) => Some(component),
        _ => None,
    }
}
