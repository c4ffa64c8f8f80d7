//! `if` equations: a branch chosen at translation, or rows that select between branches during the run.
//!
//! A condition of parameters and loop variables chooses one branch and leaves the others unread, so they may hold anything
//! (Modelica 3.6, section 8.3.4).  Where a connection or a `when` hangs on a loop variable, the loop is written out in the
//! text.  Branches chosen during the run are taken apart into scalar rows, paired by their left sides, else by their order.

use std::collections::VecDeque;
use std::sync::Arc;

use hyd_instance::substitute::with_value;
use hyd_instance::{Scope, Value};
use hyd_source::{Code, Origin, Reported, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::{Equation, EquationKind, Expr, ExprKind, Name};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;
use crate::model::Section;
use crate::range::Range;
use crate::section::Loops;
use crate::walk::mentions;

type Branches = [(Option<Expr>, Vec<Equation>)];

/// A scalar equation of a branch.
struct Row {
    left: Typed,
    right: Typed,
    span: Span,
}

/// What surrounds the rows of a branch.
#[derive(Clone, Copy)]
struct Around {
    scope: Scope,
    /// The branch holds; `None` where it always does.
    holds: Option<NodeId>,
}

impl Flattener<'_, '_> {
    pub(crate) fn if_equation(
        &mut self,
        equation: &Equation,
        branches: &Branches,
        scope: Scope,
        loops: &Loops<'_>,
        initial: bool,
    ) {
        let names: Vec<Name> = loops.iterators.iter().map(|i| i.name.name.clone()).collect();
        let conditions: Vec<&Expr> = branches.iter().filter_map(|(c, _)| c.as_ref()).collect();
        if !conditions.iter().all(|c| self.known_with(c, scope, &names)) {
            self.selected(equation, branches, scope, loops, initial);
        } else if !conditions.iter().any(|c| names.iter().any(|name| mentions(c, name))) {
            if let Ok(Some(body)) = self.chosen(branches, scope) {
                body.iter().for_each(|equation| self.equation(equation, scope, loops, initial));
            }
        } else if branches.iter().flat_map(|(_, body)| body).any(needs_text) {
            self.written_out(equation, scope, loops, initial);
        } else {
            self.selected(equation, branches, scope, loops, initial);
        }
    }

    /// The branch that conditions known before the run choose.
    fn chosen<'b>(&mut self, branches: &'b Branches, scope: Scope) -> Result<Option<&'b [Equation]>, Reported> {
        for (condition, body) in branches {
            let Some(condition) = condition else { return Ok(Some(body)) };
            match self.tree.evaluate(condition, scope, &hyd_instance::Env::default())? {
                Value::Boolean(true) => return Ok(Some(body)),
                Value::Boolean(false) => {}
                other => {
                    let message = format!("a condition must be Boolean, not {}", other.type_name());
                    let _ = self.error(Code::TypeMismatch, condition.span, message);
                    return Err(Reported);
                }
            }
        }
        Ok(None)
    }

    /// The equation once per value of the loop variables around it.
    fn written_out(&mut self, equation: &Equation, scope: Scope, loops: &Loops<'_>, initial: bool) {
        let Some((first, rest)) = loops.iterators.split_first() else {
            self.equation(equation, scope, loops, initial);
            return;
        };
        let mut cx = self.context_of(scope);
        let values = match self.range(first, &mut cx) {
            Ok(Range::Steps { start, step, count }) => match start.as_constant() {
                Some(start) => {
                    Arc::new((0..count as i64).map(|k| Value::Integer(start + step * k)).collect::<Vec<_>>())
                }
                None => return,
            },
            Ok(Range::Values(values)) => values,
            _ => return,
        };
        for value in values.iter() {
            let inner: Vec<_> = rest.iter().map(|i| with_value(*i, &first.name.name, value)).collect();
            let loops = Loops { iterators: inner.iter().collect() };
            self.written_out(&with_value(equation, &first.name.name, value), scope, &loops, initial);
        }
    }

    /// One equation per row of the branches.
    fn selected(&mut self, equation: &Equation, branches: &Branches, scope: Scope, loops: &Loops<'_>, initial: bool) {
        let path = self.path(scope.inst);
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            if cx.counts.contains(&0) {
                return Ok(());
            }
            let around = Around { scope, holds: None };
            for row in flat.joined(equation.span, branches, cx, around)? {
                let section = flat.section_of(&row.left, initial);
                let origin = Origin { path: path.clone(), span: row.span };
                flat.emit_equal(section, (row.left.node, row.right.node), cx, &[], &origin)?;
            }
            Ok(())
        });
    }

    /// The rows of an `if`: `l = if c then r1 else r2` where left sides agree, else the difference of the sides.
    ///
    /// A loop over the branches: a table of many thousands of them is no deeper for the machine than one of two.
    fn joined(&mut self, span: Span, branches: &Branches, cx: &mut Context, around: Around) -> Result<Vec<Row>, Fail> {
        let mut tried: Vec<(NodeId, Vec<Row>)> = Vec::new();
        let mut around = around;
        let mut rows = Vec::new();
        for (condition, body) in branches {
            let Some(condition) = condition else {
                rows = self.rows(body, cx, around)?;
                break;
            };
            let test = self.lower(condition, cx, &[])?;
            self.want_boolean(condition.span, "a condition", &test)?;
            match self.model.templates.arena.as_constant(test.node) {
                Some(0.0) => continue,
                Some(_) => {
                    rows = self.rows(body, cx, around)?;
                    break;
                }
                None => {}
            }
            self.expand_for_condition(condition, cx, around.scope)?;
            let arena = &mut self.model.templates.arena;
            let not = arena.not(test.node);
            let (yes, no) = match around.holds {
                None => (test.node, not),
                Some(outer) => (arena.and(outer, test.node), arena.and(outer, not)),
            };
            tried.push((test.node, self.rows(body, cx, Around { holds: Some(yes), ..around })?));
            around.holds = Some(no);
        }
        for (test, first) in tried.into_iter().rev() {
            if first.len() != rows.len() {
                let message = "the branches of an `if` that is decided during the run must have the same number of equations, and there must be an `else`";
                return Err(self.error(Code::Unbalanced, span, message));
            }
            let pairs = paired(first, rows);
            rows = pairs.into_iter().map(|(yes, no)| self.pair(test, yes, no)).collect::<Result<_, _>>()?;
        }
        Ok(rows)
    }

    /// A condition of loop variables that is known before the run needs them one after the other.
    fn expand_for_condition(&mut self, condition: &Expr, cx: &Context, scope: Scope) -> Result<(), Fail> {
        let names: Vec<Name> = cx.names.iter().map(|(name, _)| name.clone()).collect();
        if names.is_empty() || !self.known_with(condition, scope, &names) {
            return Ok(());
        }
        let symbolic = |(name, local): &(Name, Local)| {
            matches!(local, Local::Index(a) if a.as_constant().is_none()) && mentions(condition, name)
        };
        if cx.names.iter().any(symbolic) { Err(Fail::NeedsExpansion) } else { Ok(()) }
    }

    fn pair(&mut self, test: NodeId, yes: Row, no: Row) -> Result<Row, Fail> {
        if yes.left.node == no.left.node {
            let right = self.choose(yes.span, test, yes.right, no.right)?;
            return Ok(Row { left: yes.left, right, span: yes.span });
        }
        let arena = &mut self.model.templates.arena;
        let (a, b) = (arena.sub(yes.left.node, yes.right.node), arena.sub(no.left.node, no.right.node));
        let right = Typed::real(arena.select(test, a, b));
        Ok(Row { left: Typed::real(arena.constant(0.0)), right, span: yes.span })
    }

    /// The equations of a branch by scalar.
    fn rows(&mut self, body: &[Equation], cx: &mut Context, around: Around) -> Result<Vec<Row>, Fail> {
        let outside = std::mem::replace(&mut cx.holds, around.holds);
        let rows = self.rows_of_branch(body, cx, around);
        cx.holds = outside;
        rows
    }

    fn rows_of_branch(&mut self, body: &[Equation], cx: &mut Context, around: Around) -> Result<Vec<Row>, Fail> {
        let mut rows = Vec::new();
        for equation in body {
            match &equation.kind {
                EquationKind::Equal(left, right) => self.equal_rows(equation, left, right, cx, &mut rows)?,
                EquationKind::If(inner) => rows.extend(self.joined(equation.span, inner, cx, around)?),
                EquationKind::For(iterators, inner) => {
                    let iterators: Vec<_> = iterators.iter().collect();
                    self.loop_rows(&iterators, inner, cx, around, &mut rows)?;
                }
                EquationKind::Call(function, arguments) if function.parts[0].name.name.as_ref() == "assert" => {
                    self.guarded_assertion(equation.span, arguments, cx, around.scope, around.holds)?;
                }
                EquationKind::Connect(..) => {
                    let message = "a connection cannot depend on a condition that changes during the run";
                    return Err(self.error(Code::Misplaced, equation.span, message));
                }
                _ => {
                    let message = "an `if` that is decided during the run can hold only `=` equations";
                    return Err(self.error(Code::Misplaced, equation.span, message));
                }
            }
        }
        Ok(rows)
    }

    fn loop_rows(
        &mut self,
        iterators: &[&hyd_syntax::tree::Iterator],
        body: &[Equation],
        cx: &mut Context,
        around: Around,
        rows: &mut Vec<Row>,
    ) -> Result<(), Fail> {
        let Some((first, rest)) = iterators.split_first() else {
            rows.extend(self.rows(body, cx, around)?);
            return Ok(());
        };
        let range = self.range(first, cx)?;
        for k in 0..range.count() {
            let local = range.local(k)?;
            cx.names.push((first.name.name.clone(), local));
            let done = self.loop_rows(rest, body, cx, around, rows);
            cx.names.pop();
            done?;
        }
        Ok(())
    }

    /// `left = right` by field and element.
    fn equal_rows(
        &mut self,
        equation: &Equation,
        left: &Expr,
        right: &Expr,
        cx: &mut Context,
        rows: &mut Vec<Row>,
    ) -> Result<(), Fail> {
        if let Some(pairs) = self.record_pairs(left, right, cx)? {
            return pairs.iter().try_for_each(|(l, r)| self.equal_rows(equation, l, r, cx, rows));
        }
        if let (ExprKind::Tuple(targets), ExprKind::Call(function, arguments)) = (&left.kind, &right.kind)
            && targets.len() > 1
        {
            let outputs = self.call_outputs(right.span, function, arguments, cx)?;
            for (target, (_, value)) in targets.iter().zip(&outputs) {
                let Some(target) = target else { continue };
                let shape = self.shape(target, cx)?;
                for at in positions(&shape) {
                    let (a, b) = (self.lower(target, cx, &at)?, self.element_of_local(right.span, value, &at)?);
                    self.check_sides(equation, target, right, &a, &b)?;
                    rows.push(Row { left: a, right: b, span: equation.span });
                }
            }
            return Ok(());
        }
        let (l, r) = (self.shape(left, cx)?, self.shape(right, cx)?);
        self.check_same_shape(equation.span, &l, &r)?;
        for at in positions(&l) {
            let (a, b) = (self.lower(left, cx, &at)?, self.lower(right, cx, &at)?);
            self.check_sides(equation, left, right, &a, &b)?;
            rows.push(Row { left: a, right: b, span: equation.span });
        }
        Ok(())
    }

    /// An assertion that counts only where `holds` does.
    pub(crate) fn guarded_assertion(
        &mut self,
        span: Span,
        arguments: &hyd_syntax::tree::Arguments,
        cx: &mut Context,
        scope: Scope,
        holds: Option<NodeId>,
    ) -> Result<(), Fail> {
        let parts = self.assert_parts(span, arguments, scope)?;
        let (message, values) = self.message(&parts.text, scope, parts.error);
        let before = std::mem::replace(&mut cx.no_event, true);
        let test = self.lower(&parts.condition, cx, &[]);
        cx.no_event = before;
        let test = test?;
        self.want_boolean(parts.condition.span, "`assert`", &test)?;
        let values = self.message_values(message, &values, cx)?;
        let arena = &mut self.model.templates.arena;
        let node = match holds {
            Some(holds) => {
                let idle = arena.not(holds);
                arena.or(idle, test.node)
            }
            None => test.node,
        };
        let origin = Origin { path: self.path(scope.inst), span };
        self.emit(Section::Assert(message), node, values, &cx.loop_counts(), &origin);
        Ok(())
    }
}

/// Each row of a branch with one of the other: with the same left side, else the next one whose left side this branch does not
/// have.  There are as many of the one as of the other.
fn paired(first: Vec<Row>, others: Vec<Row>) -> Vec<(Row, Row)> {
    let lefts: FxHashSet<NodeId> = first.iter().map(|row| row.left.node).collect();
    let mut same: FxHashMap<NodeId, VecDeque<usize>> = FxHashMap::default();
    for (k, other) in others.iter().enumerate().filter(|(_, other)| lefts.contains(&other.left.node)) {
        same.entry(other.left.node).or_default().push_back(k);
    }
    let foreign: Vec<usize> = (0..others.len()).filter(|&k| !lefts.contains(&others[k].left.node)).collect();
    let mut others: Vec<Option<Row>> = others.into_iter().map(Some).collect();
    let (mut foreign, mut any) = (foreign.into_iter(), 0);
    let mut pairs = Vec::with_capacity(first.len());
    for row in first {
        let agreeing = same
            .get_mut(&row.left.node)
            .and_then(|places| std::iter::from_fn(|| places.pop_front()).find(|&k| others[k].is_some()));
        let place = agreeing.or_else(|| foreign.find(|&k| others[k].is_some())).unwrap_or_else(|| {
            any += others[any..].iter().take_while(|other| other.is_none()).count();
            any
        });
        if let Some(other) = others.get_mut(place).and_then(Option::take) {
            pairs.push((row, other));
        }
    }
    pairs
}

/// True for what cannot be taken apart into rows.
fn needs_text(equation: &Equation) -> bool {
    match &equation.kind {
        EquationKind::Connect(..) | EquationKind::When(_) => true,
        EquationKind::For(_, body) => body.iter().any(needs_text),
        EquationKind::If(branches) => branches.iter().flat_map(|(_, body)| body).any(needs_text),
        EquationKind::Equal(..) | EquationKind::Call(..) => false,
    }
}

/// All subscripts (from 0) of an array, the last fastest.
pub(crate) fn positions(shape: &[usize]) -> impl Iterator<Item = Vec<Affine>> + use<'_> {
    (0..shape.iter().product::<usize>()).map(|k| {
        let mut rest = k;
        let mut at = vec![Affine::constant(0); shape.len()];
        for (position, &size) in shape.iter().enumerate().rev() {
            at[position] = Affine::constant((rest % size) as i64);
            rest /= size;
        }
        at
    })
}
