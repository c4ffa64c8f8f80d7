//! Sizes of expressions that hold variables of the run: `Real e[:] = cat(1, a, {1, 2})` has a size before `a` has a value.
//!
//! Sizes follow from those of the operands (Modelica 3.6, chapter 10); the result of a function has the sizes that its declaration
//! says, which may ask for those of the arguments.

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{
    Arguments, BinaryOp, ClassKind, ComponentRef, Direction, Expr, ExprKind, Ident, Iterator, Name, Variability,
};
use hyd_syntax::visit::{Role, Visitor, walk_expr, walk_reference};

use crate::builtins::{Builtin, SizeFault, SizesOf};
use crate::instantiation::instance::Scope;
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;
use crate::instantiation::work::volume;
use crate::values::evaluate::Env;
use crate::values::value::Value;

/// What an expression reads, apart from its own loop variables and from what is only asked for its size.
struct Reads {
    own: Vec<Name>,
    found: Vec<ComponentRef>,
}

impl Visitor for Reads {
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        if role == Role::Read && (reference.global || !self.own.contains(&reference.parts[0].name.name)) {
            self.found.push(reference.clone());
        }
        walk_reference(self, reference);
    }

    fn enter(&mut self, iterators: &[Iterator]) {
        iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
        self.own.extend(iterators.iter().map(|i| i.name.name.clone()));
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.own.truncate(self.own.len() - iterators.len());
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Call(function, Arguments::List { positional, .. }) if Builtin::of_sizes(function) => {
                positional.iter().skip(1).for_each(|e| self.expr(e));
            }
            _ => walk_expr(self, expr),
        }
    }
}

/// The arguments of a function of the language.
struct List<'a, 's> {
    scopes: &'a mut Scopes<'s>,
    function: Builtin,
    span: Span,
    list: &'a [Expr],
    scope: Scope,
    env: &'a Env,
}

impl SizesOf for List<'_, '_> {
    type Fail = Reported;

    fn count(&self) -> usize {
        self.list.len()
    }

    fn sizes(&mut self, k: usize) -> Result<Vec<usize>, Reported> {
        self.scopes.shape_of(&self.list[k], self.scope, self.env)
    }

    fn number(&mut self, k: usize) -> Result<usize, Reported> {
        let value = self.scopes.evaluate(&self.list[k], self.scope, self.env)?;
        value.as_integer().and_then(|k| usize::try_from(k).ok()).ok_or_else(|| {
            let message = "a size is an integer from 0";
            self.scopes.error(Code::ArrayShape, self.list[k].span, message)
        })
    }

    fn fault(&mut self, fault: SizeFault) -> Reported {
        let (code, message) = fault.message(self.function);
        self.scopes.error(code, fault.place(|k| self.list[k].span, self.span), message)
    }
}

impl Scopes<'_> {
    /// True if the value of an expression changes during the run.
    pub(crate) fn depends_on_run(&mut self, expr: &Expr, scope: Scope, env: &Env) -> bool {
        let own = env.names.iter().map(|(name, _)| name.clone()).collect();
        let mut reads = Reads { own, found: Vec::new() };
        reads.expr(expr);
        reads.found.iter().any(|reference| {
            let reference = self.first_part_named(scope, reference);
            match self.resolve(scope, &reference) {
                Ok(Resolved::Time) => true,
                Ok(Resolved::Variable(steps)) => {
                    let inst = steps[steps.len() - 1].0;
                    let last = &self.instances[inst];
                    self.variability(inst) > Variability::Parameter
                        && (last.primitive.is_some() || last.kind == ClassKind::Record)
                }
                _ => false,
            }
        })
    }

    /// The sizes of an expression; only what they depend on is computed.
    pub(crate) fn shape_of(&mut self, expr: &Expr, scope: Scope, env: &Env) -> Result<Vec<usize>, Reported> {
        if let ExprKind::Call(function, arguments) = &expr.kind
            && let Some(array) = self.array_of_call(scope, function, arguments, expr.span)
        {
            return self.shape_of(&array, scope, env);
        }
        match &expr.kind {
            ExprKind::Ref(reference) => self.shape_of_reference(expr, reference, scope, env),
            ExprKind::Unary(_, a) => self.shape_of(a, scope, env),
            ExprKind::Binary(op, a, b) => {
                let (mut left, right) = (self.shape_of(a, scope, env)?, self.shape_of(b, scope, env)?);
                Ok(match (op, left.is_empty(), right.is_empty()) {
                    (_, true, _) => right,
                    (BinaryOp::Mul, false, false) => {
                        left.pop();
                        left.extend(right.into_iter().skip(1));
                        left
                    }
                    _ => left,
                })
            }
            ExprKind::If(branches, otherwise) => self.shape_of_branches(branches, otherwise, scope, env),
            ExprKind::Array(items) => {
                let inner = items.first().map_or(Ok(Vec::new()), |first| self.shape_of(first, scope, env))?;
                Ok(std::iter::once(items.len()).chain(inner).collect())
            }
            ExprKind::ArrayFor(body, iterators) => {
                let (mut shape, mut inner) = (Vec::new(), env.clone());
                for iterator in iterators.iter().rev() {
                    let Some(range) = &iterator.range else { return Err(self.size_unknown(expr.span)) };
                    let values = self.evaluate(range, scope, &inner)?.items();
                    shape.push(values.len());
                    let first = values.first().cloned().unwrap_or(Value::Integer(1));
                    inner.names.push((iterator.name.name.clone(), first));
                }
                shape.extend(self.shape_of(body, scope, &inner)?);
                Ok(shape)
            }
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.shape_of(only, scope, env),
                _ => Err(self.size_unknown(expr.span)),
            },
            ExprKind::Matrix(rows) => {
                if let [row] = rows.as_slice()
                    && let [only] = row.as_slice()
                {
                    let shape = self.shape_of(only, scope, env)?;
                    if shape.len() >= 2 {
                        return Ok(shape);
                    }
                }
                let (mut high, mut wide) = (0, 0);
                for row in rows {
                    let (mut row_high, mut row_wide) = (0, 0);
                    for part in row {
                        let shape = self.shape_of(part, scope, env)?;
                        row_high = shape.first().copied().unwrap_or(1);
                        row_wide += shape.get(1).copied().unwrap_or(1);
                    }
                    (high, wide) = (high + row_high, row_wide);
                }
                Ok(vec![high, wide])
            }
            ExprKind::Call(function, Arguments::List { positional, named }) => {
                self.shape_of_call(expr, function, (positional, named), scope, env)
            }
            ExprKind::Call(..)
            | ExprKind::Integer(_)
            | ExprKind::Real(_)
            | ExprKind::Boolean(_)
            | ExprKind::Text(_)
            | ExprKind::End => Ok(Vec::new()),
            _ => Ok(self.evaluate(expr, scope, env)?.shape()),
        }
    }

    /// Branches of different sizes are those of the one that is taken, which must be known then.
    fn shape_of_branches(
        &mut self,
        branches: &[(Expr, Expr)],
        otherwise: &Expr,
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<usize>, Reported> {
        let last = self.quietly(|scopes| scopes.shape_of(otherwise, scope, env));
        let mut same = last.is_ok();
        for (_, value) in branches {
            same = same && self.quietly(|scopes| scopes.shape_of(value, scope, env)) == last;
        }
        if same {
            return last;
        }
        for (condition, value) in branches {
            if self.depends_on_run(condition, scope, env) {
                return Err(self.size_unknown(condition.span));
            }
            if self.evaluate(condition, scope, env)? == Value::Boolean(true) {
                return self.shape_of(value, scope, env);
            }
        }
        self.shape_of(otherwise, scope, env)
    }

    fn size_unknown(&mut self, span: Span) -> Reported {
        let message = "the size of this expression is not known before the run";
        self.not_structural(span, message.into())
    }

    fn shape_of_reference(
        &mut self,
        expr: &Expr,
        reference: &ComponentRef,
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<usize>, Reported> {
        if !reference.global && env.names.iter().any(|(name, _)| *name == reference.parts[0].name.name) {
            return Ok(self.evaluate(expr, scope, env)?.shape());
        }
        if let Some(named) = self.parts_named(reference, scope, env) {
            return self.shape_of(&named, scope, env);
        }
        let steps = match self.resolve(scope, reference)? {
            Resolved::Variable(steps) => steps,
            Resolved::Time => return Ok(Vec::new()),
            _ => return Ok(self.evaluate(expr, scope, env)?.shape()),
        };
        let mut shape = Vec::new();
        for (inst, subscripts) in steps {
            self.want_made(inst, expr.span)?;
            for (k, size) in self.instances[inst].dims.clone().into_iter().enumerate() {
                match subscripts.get(k) {
                    None => shape.push(size),
                    Some(subscript) if matches!(subscript.kind, ExprKind::Colon) => shape.push(size),
                    Some(subscript) => {
                        let mut inner = env.clone();
                        inner.ends.push(size);
                        shape.extend(self.shape_of(subscript, scope, &inner)?);
                    }
                }
            }
        }
        Ok(shape)
    }

    fn shape_of_call(
        &mut self,
        expr: &Expr,
        function: &ComponentRef,
        (positional, named): (&[Expr], &[(Ident, Expr)]),
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<usize>, Reported> {
        match self.predefined(scope, function) {
            Some(builtin) => builtin.sizes(&mut List {
                scopes: self,
                function: builtin,
                span: expr.span,
                list: positional,
                scope,
                env,
            }),
            None => self.shape_of_result(expr.span, function, (positional, named), scope, env),
        }
    }

    /// The sizes that a function declares for its first output, its arguments being arrays of their sizes.
    fn shape_of_result(
        &mut self,
        span: Span,
        function: &ComponentRef,
        (positional, named): (&[Expr], &[(Ident, Expr)]),
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<usize>, Reported> {
        let Resolved::Class(local) = self.resolve(scope, function)? else { return Err(self.size_unknown(span)) };
        let kind = self.table.class(local.class).def.kind;
        if kind == ClassKind::Record {
            return Ok(Vec::new());
        }
        if kind != ClassKind::Function || env.calls >= crate::values::interpret::MAX_CALLS {
            return Err(self.size_unknown(span));
        }
        let shape = self.table.shape(local.class)?;
        let inst = self.package_of(&local)?;
        let mut inner = Env { calls: env.calls + 1, ..Env::default() };
        let mut outer: Vec<usize> = Vec::new();
        let mut position = 0;
        for (frame, component) in self.components_of(&shape) {
            let own = Scope { inst, frame };
            match component.direction {
                Some(Direction::Input) => {
                    let name = &component.name.name;
                    let given =
                        positional.get(position).or(named.iter().find(|(n, _)| n.name == *name).map(|(_, e)| e));
                    position += 1;
                    let value = match (given, &component.modification.binding) {
                        (Some(expr), _) if !self.depends_on_run(expr, scope, env) => {
                            Some(self.evaluate(expr, scope, env)?)
                        }
                        (Some(expr), _) => {
                            let sizes = self.shape_of(expr, scope, env)?;
                            // More dimensions than declared: one call per element (12.4.6).
                            let of_type = self.sizes_of_type(&component, own)?.len();
                            let more = sizes.len().saturating_sub(component.dims.len() + of_type);
                            if outer.is_empty() {
                                outer = sizes[..more].to_vec();
                            }
                            let sizes = &sizes[more..];
                            if volume(sizes).is_none() {
                                return Err(self.size_unknown(span));
                            }
                            (!sizes.is_empty()).then(|| Value::filled(Value::Real(0.0), sizes))
                        }
                        (None, Some(default)) => Some(self.evaluate(&default.clone(), own, &inner)?),
                        (None, None) => None,
                    };
                    inner.names.extend(value.map(|value| (name.clone(), value)));
                }
                Some(Direction::Output) => {
                    if component.dims.iter().any(|dim| matches!(dim.kind, ExprKind::Colon)) {
                        return Err(self.size_unknown(span));
                    }
                    let own = self.local_sizes(&component, own, &inner)?;
                    return Ok(outer.into_iter().chain(own).collect());
                }
                None => {}
            }
        }
        Err(self.size_unknown(span))
    }
}
