//! References into arrays made in parts, each written as the part that it means.
//!
//! `c[i].x` in a loop, `c.x` and `c[2:end].x` name elements of an array that has no instance of its own for all of them (see
//! `parts`).  Before such a text is lowered or evaluated, loops over it are written out and the references in it replaced: `c.x`
//! becomes `{c[1].x, c[2].x}`, a connection of arrays becomes one for each pair.  What cannot be known here stays as it is, and
//! is reported by those who need it: a branch that is not taken may hold anything.

use std::sync::Arc;

use hyd_source::Span;
use hyd_syntax::tree::{
    AlgorithmSection, Arguments, ComponentRef, Equation, EquationKind, Expr, ExprKind, Iterator, Name, Statement,
    StatementKind,
};
use hyd_syntax::visit::{Role, Visitor, walk_equation, walk_expr, walk_reference, walk_statement};
use hyd_syntax::visit_mut::{VisitorMut, walk_equation_mut, walk_expr_mut, walk_reference_mut, walk_statement_mut};

use crate::builtins::Builtin;
use crate::classes::modifier::{Applied, AstMod};
use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::scopes::Scopes;
use crate::values::evaluate::Env;
use crate::values::substitute::{Text, with_value};
use crate::values::value::Value;

/// Most equations and elements that writing out one loop may give.
const MAX_WRITTEN: usize = 100_000;

/// The elements of arrays that a reference means: one, or as many as the sizes that its subscripts keep.
struct Elements {
    references: Vec<ComponentRef>,
    shape: Vec<usize>,
}

impl Scopes<'_> {
    /// True if an array of components is made in parts, so that loops over it are written out.
    pub fn has_parts(&self) -> bool {
        !self.apart.is_empty()
    }

    /// The equation with each part named; none if it names no array made in parts.
    pub fn parts_in_equation(&mut self, equation: &Equation, scope: Scope) -> Option<Equation> {
        self.named(equation, scope, |naming, equation| naming.equation(equation))
    }

    /// The algorithm with each part named; none if it names no array made in parts.
    pub fn parts_in_algorithm(&mut self, section: &AlgorithmSection, scope: Scope) -> Option<AlgorithmSection> {
        self.named(section, scope, |naming, section| section.statements.iter_mut().for_each(|s| naming.statement(s)))
    }

    fn named<T: Clone>(&mut self, text: &T, scope: Scope, walk: impl Fn(&mut Naming<'_, '_>, &mut T)) -> Option<T> {
        if self.apart.is_empty() {
            return None;
        }
        let mut copy = text.clone();
        let named = self.quietly(|scopes| {
            let mut naming = Naming { scopes, scope, hidden: Vec::new(), named: false };
            walk(&mut naming, &mut copy);
            naming.named
        });
        named.then_some(copy)
    }

    /// Names the parts in all that modifications say of variables.
    pub(crate) fn name_parts_in_bindings(&mut self) {
        if self.apart.is_empty() {
            return;
        }
        for inst in self.instances.indices().collect::<Vec<_>>() {
            let Some(primitive) = &self.instances[inst].primitive else { continue };
            let (binding, attributes) = (primitive.binding.clone(), primitive.attributes.clone());
            let binding = binding.map(|applied| self.applied_named(applied));
            let attributes =
                attributes.into_iter().map(|(name, applied)| (name, self.applied_named(applied))).collect();
            if let Some(primitive) = &mut self.instances.edit(inst).primitive {
                (primitive.binding, primitive.attributes) = (binding, attributes);
            }
        }
    }

    fn applied_named(&mut self, applied: Applied) -> Applied {
        let tree = &applied.tree;
        let Some(expr) = &tree.binding else { return applied };
        let Some(named) = self.named(expr.as_ref(), applied.scope, |naming, expr| naming.expr(expr)) else {
            return applied;
        };
        let tree = AstMod {
            binding: Some(Arc::new(named)),
            each: tree.each,
            is_final: tree.is_final,
            redeclare: None,
            children: tree.children.clone(),
            span: tree.span,
        };
        Applied { tree: Arc::new(tree), ..applied }
    }

    /// What a reference into an array made in parts means, as an expression of references to parts; none for other references
    /// and for those that name parts already.
    pub fn parts_named(&mut self, reference: &ComponentRef, scope: Scope, env: &Env) -> Option<Expr> {
        if self.apart.is_empty() || !self.goes_through_parts(reference, scope) || self.names_parts(reference, scope) {
            return None;
        }
        let elements = self.quietly(|scopes| scopes.elements_of_parts(reference, scope, env, false));
        let Elements { references, shape } = elements?;
        Some(nested(references, &shape, reference.span))
    }

    /// The reference with the first part of each array made in parts in the place of all: what has the same type as any of them.
    pub(crate) fn first_part_named(&mut self, scope: Scope, reference: &ComponentRef) -> ComponentRef {
        let mut first = reference.clone();
        if self.apart.is_empty() {
            return first;
        }
        self.follow(reference, scope, &mut |scopes, array, k| {
            let one = |span| Expr { kind: ExprKind::Integer(1), span };
            first.parts[k].subscripts = vec![one(reference.span); scopes.instances[array].dims.len()];
            scopes.instances[array].parts.first().copied()
        });
        first
    }

    /// Walks along a reference; `part` says which part of an array made in parts to follow.
    fn follow(
        &mut self,
        reference: &ComponentRef,
        scope: Scope,
        part: &mut dyn FnMut(&mut Self, InstId, usize) -> Option<InstId>,
    ) {
        if reference.global {
            return;
        }
        let Ok(Some(mut current)) = self.component_of(scope, &reference.parts[0].name.name) else { return };
        for k in 0..reference.parts.len() {
            if k > 0 {
                let Some(&next) = self.instances[current].by_name.get(&reference.parts[k].name.name) else { return };
                current = next;
            }
            let whole = k + 1 == reference.parts.len() && reference.parts[k].subscripts.is_empty();
            if !self.instances[current].parts.is_empty() && !whole {
                let Some(next) = part(self, current, k) else { return };
                current = next;
            }
        }
    }

    /// True if a reference leads to parts of an array.
    fn goes_through_parts(&mut self, reference: &ComponentRef, scope: Scope) -> bool {
        let mut found = false;
        self.follow(reference, scope, &mut |scopes, array, _| {
            found = true;
            scopes.instances[array].parts.first().copied()
        });
        found
    }

    /// True if the subscripts of all arrays made in parts are numbers.
    fn names_parts(&mut self, reference: &ComponentRef, scope: Scope) -> bool {
        let mut all = true;
        self.follow(reference, scope, &mut |scopes, array, k| {
            let literal = |e: &Expr| matches!(e.kind, ExprKind::Integer(_));
            let subscripts = &reference.parts[k].subscripts;
            all &= !subscripts.is_empty() && subscripts.iter().all(literal);
            scopes.instances[array].parts.first().copied()
        });
        all
    }

    /// The elements a reference means, by the subscripts of arrays made in parts; those of other arrays, too, for `connect`.
    fn elements_of_parts(
        &mut self,
        reference: &ComponentRef,
        scope: Scope,
        env: &Env,
        connected: bool,
    ) -> Option<Elements> {
        let first = self.component_of(scope, &reference.parts[0].name.name).ok().flatten()?;
        let mut all = vec![(reference.clone(), first)];
        let mut shape = Vec::new();
        let last = reference.parts.len() - 1;
        for k in 0..=last {
            if k > 0 {
                for (_, current) in &mut all {
                    *current = *self.instances[*current].by_name.get(&reference.parts[k].name.name)?;
                }
            }
            let Some(&(_, array)) = all.first() else { break };
            let subscripts = &reference.parts[k].subscripts;
            let in_parts = !self.instances[array].parts.is_empty();
            let whole = k == last && subscripts.is_empty();
            if !connected && (!in_parts || whole) {
                continue;
            }
            let dims = self.instances[array].dims.clone();
            if all.iter().any(|(_, other)| self.instances[*other].dims != dims) || subscripts.len() > dims.len() {
                return None;
            }
            for (d, &size) in dims.iter().enumerate() {
                let (positions, kept) = self.positions(subscripts.get(d), size, scope, env)?;
                if kept {
                    shape.push(positions.len());
                }
                if all.len().saturating_mul(positions.len()) > MAX_WRITTEN {
                    return None;
                }
                let span = reference.span;
                let with = |reference: &ComponentRef, position: i64| {
                    let mut copy = reference.clone();
                    copy.parts[k].subscripts.truncate(d);
                    copy.parts[k].subscripts.push(Expr { kind: ExprKind::Integer(position), span });
                    copy
                };
                all = all
                    .iter()
                    .flat_map(|(reference, inst)| positions.iter().map(move |&p| (with(reference, p), *inst)))
                    .collect();
            }
            for (reference, current) in &mut all {
                if !self.instances[*current].parts.is_empty() {
                    *current = self.part_at(*current, &reference.parts[k].subscripts)?;
                }
            }
        }
        Some(Elements { references: all.into_iter().map(|(reference, _)| reference).collect(), shape })
    }

    /// The subscripts from 1 that one subscript means, and whether it keeps the dimension.
    fn positions(
        &mut self,
        subscript: Option<&Expr>,
        size: usize,
        scope: Scope,
        env: &Env,
    ) -> Option<(Vec<i64>, bool)> {
        let Some(expr) = subscript.filter(|e| !matches!(e.kind, ExprKind::Colon)) else {
            return Some(((1..=size as i64).collect(), true));
        };
        let mut inner = env.clone();
        inner.ends.push(size);
        let value = self.evaluate(expr, scope, &inner).ok()?;
        let position = |value: &Value| match value {
            Value::Integer(k) => Some(*k),
            Value::Enumeration(_, k) => Some(i64::from(*k)),
            Value::Boolean(b) => Some(i64::from(*b) + 1),
            _ => None,
        };
        match &value {
            Value::Array(items) => Some((items.iter().map(position).collect::<Option<_>>()?, true)),
            one => Some((vec![position(one)?], false)),
        }
    }
}

/// `{{a, b}, {c, d}}` of references in this order.
fn nested(references: Vec<ComponentRef>, shape: &[usize], span: Span) -> Expr {
    let mut items: Vec<Expr> = references.into_iter().map(|r| Expr { span: r.span, kind: ExprKind::Ref(r) }).collect();
    for &size in shape.iter().skip(1).rev() {
        items = items.chunks(size.max(1)).map(|row| Expr { kind: ExprKind::Array(row.to_vec()), span }).collect();
    }
    match (shape.is_empty(), items.pop()) {
        (true, Some(only)) => only,
        (_, last) => {
            items.extend(last);
            Expr { kind: ExprKind::Array(items), span }
        }
    }
}

/// True if the statement may end the loop around it.
fn breaks(statement: &Statement) -> bool {
    match &statement.kind {
        StatementKind::Break | StatementKind::Return => true,
        StatementKind::If(branches) => branches.iter().flat_map(|(_, body)| body).any(breaks),
        StatementKind::When(branches) => branches.iter().flat_map(|(_, body)| body).any(breaks),
        _ => false,
    }
}

/// The way through a text.
struct Naming<'t, 's> {
    scopes: &'t mut Scopes<'s>,
    scope: Scope,
    /// Loop variables of loops that are not written out.
    hidden: Vec<Name>,
    /// A part was named.
    named: bool,
}

impl Naming<'_, '_> {
    fn is_own(&self, reference: &ComponentRef) -> bool {
        !reference.global && self.hidden.contains(&reference.parts[0].name.name)
    }

    /// The values of a loop variable, if they are known.
    fn values(&mut self, iterator: &Iterator) -> Option<Vec<Value>> {
        let values = self.scopes.evaluate(iterator.range.as_ref()?, self.scope, &Env::default()).ok()?.items();
        (values.len() <= MAX_WRITTEN).then(|| values.to_vec())
    }

    /// The texts with each value in the place of the loop variables, the first of them the outermost.
    fn written_out<T: Text>(&mut self, iterators: &[Iterator], body: Vec<T>) -> Option<Vec<T>> {
        let Some((first, rest)) = iterators.split_first() else { return Some(body) };
        let mut written = Vec::new();
        for value in self.values(first)? {
            let rest: Vec<Iterator> = rest.iter().map(|i| with_value(i, &first.name.name, &value)).collect();
            let body = body.iter().map(|text| with_value(text, &first.name.name, &value)).collect();
            written.extend(self.written_out(&rest, body)?);
            if written.len() > MAX_WRITTEN {
                return None;
            }
        }
        Some(written)
    }

    /// `{body for iterators}` written out, the last iterator the outermost (10.4.1).
    fn array(&mut self, body: &Expr, iterators: &[Iterator]) -> Option<Expr> {
        let Some((last, rest)) = iterators.split_last() else { return Some(body.clone()) };
        let mut items = Vec::new();
        for value in self.values(last)? {
            let rest: Vec<Iterator> = rest.iter().map(|i| with_value(i, &last.name.name, &value)).collect();
            items.push(self.array(&with_value(body, &last.name.name, &value), &rest)?);
        }
        Some(Expr { kind: ExprKind::Array(items), span: body.span })
    }

    /// True if a text leads to parts of an array.
    fn mentions_parts(&mut self, walk: impl FnOnce(&mut Mentions<'_, '_>)) -> bool {
        let mut mentions = Mentions { scopes: self.scopes, scope: self.scope, own: self.hidden.clone(), found: false };
        walk(&mut mentions);
        mentions.found
    }

    /// A connection whose sides lead to parts: one for each pair of elements.
    fn connection(&mut self, equation: &mut Equation) {
        let EquationKind::Connect(a, b) = &equation.kind else { return };
        let (left, right) = (self.elements(a), self.elements(b));
        let (Some(left), Some(right)) = (left, right) else { return };
        if left.shape != right.shape {
            return;
        }
        let pair = |(a, b)| Equation { kind: EquationKind::Connect(a, b), ..equation.clone() };
        let pairs: Vec<Equation> = left.references.into_iter().zip(right.references).map(pair).collect();
        self.named = true;
        equation.kind = EquationKind::For(Vec::new(), pairs);
    }

    fn elements(&mut self, reference: &ComponentRef) -> Option<Elements> {
        self.scopes.elements_of_parts(reference, self.scope, &Env::default(), true)
    }

    fn connects_parts(&mut self, reference: &ComponentRef) -> bool {
        let whole = self.scopes.component_at(reference, self.scope);
        self.scopes.goes_through_parts(reference, self.scope)
            || whole.is_some_and(|inst| !self.scopes.instances[inst].parts.is_empty())
    }
}

impl Scopes<'_> {
    /// The component that a reference ends at, the first part of arrays made in parts.
    fn component_at(&mut self, reference: &ComponentRef, scope: Scope) -> Option<InstId> {
        let mut current = self.component_of(scope, &reference.parts[0].name.name).ok().flatten()?;
        for part in &reference.parts[1..] {
            current = self.instances[current].parts.first().copied().unwrap_or(current);
            current = *self.instances[current].by_name.get(&part.name.name)?;
        }
        Some(current)
    }
}

impl VisitorMut for Naming<'_, '_> {
    fn enter(&mut self, iterators: &mut [Iterator]) {
        iterators.iter_mut().filter_map(|i| i.range.as_mut()).for_each(|e| self.expr(e));
        self.hidden.extend(iterators.iter().map(|i| i.name.name.clone()));
    }

    fn leave(&mut self, iterators: &mut [Iterator]) {
        self.hidden.truncate(self.hidden.len() - iterators.len());
    }

    fn reference(&mut self, reference: &mut ComponentRef, role: Role) {
        walk_reference_mut(self, reference);
        // What is assigned is one element.
        if matches!(role, Role::Assigned | Role::Taken) && !self.is_own(reference) {
            let named = self.scopes.parts_named(reference, self.scope, &Env::default());
            if let Some(ExprKind::Ref(named)) = named.map(|named| named.kind) {
                *reference = named;
                self.named = true;
            }
        }
    }

    fn expr(&mut self, expr: &mut Expr) {
        match &expr.kind {
            ExprKind::Ref(reference) if !self.is_own(reference) => {
                if let Some(named) = self.scopes.parts_named(reference, self.scope, &Env::default()) {
                    self.named = true;
                    *expr = named;
                } else if self.scopes.goes_through_parts(reference, self.scope) {
                    self.named = true;
                }
            }
            ExprKind::ArrayFor(body, iterators) if self.mentions_parts(|m| walk_expr(m, expr)) => {
                if let Some(written) = self.array(body, iterators) {
                    self.named = true;
                    *expr = written;
                }
            }
            ExprKind::Call(function, Arguments::Reduction(body, iterators))
                if self.mentions_parts(|m| walk_expr(m, expr)) =>
            {
                if let Some(written) = self.array(body, iterators) {
                    self.named = true;
                    if self.scopes.predefined(self.scope, function) == Some(Builtin::Array) {
                        *expr = written;
                    } else {
                        let arguments = Arguments::List { positional: vec![written], named: Vec::new() };
                        expr.kind = ExprKind::Call(function.clone(), arguments);
                    }
                }
            }
            _ => {}
        }
        walk_expr_mut(self, expr);
    }

    fn equation(&mut self, equation: &mut Equation) {
        match &equation.kind {
            EquationKind::For(iterators, body) if self.mentions_parts(|m| walk_equation(m, equation)) => {
                if let Some(written) = self.written_out(iterators, body.clone()) {
                    self.named = true;
                    equation.kind = EquationKind::For(Vec::new(), written);
                }
            }
            EquationKind::Connect(a, b) => {
                let (a, b) = (a.clone(), b.clone());
                if self.connects_parts(&a) || self.connects_parts(&b) {
                    self.connection(equation);
                    return;
                }
            }
            _ => {}
        }
        walk_equation_mut(self, equation);
    }

    fn statement(&mut self, statement: &mut Statement) {
        // A loop that may be left early is none that is a list of statements.
        if let StatementKind::For(iterators, body) = &statement.kind
            && !body.iter().any(breaks)
            && self.mentions_parts(|m| walk_statement(m, statement))
            && let Some(written) = self.written_out(iterators, body.clone())
        {
            self.named = true;
            statement.kind = StatementKind::For(Vec::new(), written);
        }
        walk_statement_mut(self, statement);
    }
}

/// Looks for references that lead to parts of an array.
struct Mentions<'t, 's> {
    scopes: &'t mut Scopes<'s>,
    scope: Scope,
    own: Vec<Name>,
    found: bool,
}

impl Visitor for Mentions<'_, '_> {
    fn enter(&mut self, iterators: &[Iterator]) {
        self.own.extend(iterators.iter().map(|i| i.name.name.clone()));
        iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.own.truncate(self.own.len() - iterators.len());
    }

    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        let own = !reference.global && self.own.contains(&reference.parts[0].name.name);
        if role != Role::Called && !own {
            let connected = role == Role::Connected && {
                let whole = self.scopes.component_at(reference, self.scope);
                whole.is_some_and(|inst| !self.scopes.instances[inst].parts.is_empty())
            };
            self.found = self.found || connected || self.scopes.goes_through_parts(reference, self.scope);
        }
        walk_reference(self, reference);
    }
}
