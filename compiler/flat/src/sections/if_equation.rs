//! `if` equations: a branch chosen at translation, or rows that select between branches during the run.
//!
//! A condition of parameters and loop variables chooses one branch and leaves the others unread, so they may hold anything
//! (Modelica 3.6, section 8.3.4).  Where a connection or a `when` hangs on a loop variable, the loop is written out in the
//! text.  Branches chosen during the run are taken apart into scalar rows, paired by their left sides, else by their order.

use std::collections::VecDeque;

use hyd_instance::{Env, Scope, Value};
use hyd_source::{Code, Origin, Reported, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::Name;
use hyd_typed::{Equation, EquationKind, Expr, Iterator as Loop, mentions};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::expressions::range::Range;
use crate::expressions::value::local_of;
use crate::sections::loops::Loops;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, Pass};
use crate::state::index::Affine;
use crate::state::node::Typed;

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
        if self.pass == Pass::Connections {
            self.connections_of_if(equation, branches, (&conditions, &names), scope, loops);
        } else if !conditions.iter().all(|c| self.known_before_run(c)) {
            self.selected(equation, branches, scope, loops, initial);
        } else if !conditions.iter().any(|c| names.iter().any(|name| mentions(c, name))) {
            if let Ok(Some(body)) = self.chosen(branches, scope, loops) {
                body.iter().for_each(|equation| self.equation(equation, scope, loops, initial));
            }
        } else if branches.iter().flat_map(|(_, body)| body).any(needs_text) {
            self.written_out(equation, scope, loops, initial);
        } else {
            self.selected(equation, branches, scope, loops, initial);
        }
    }

    /// The connections in the branch that is taken.  What is wrong with the conditions is said with the other equations.
    fn connections_of_if(
        &mut self,
        equation: &Equation,
        branches: &Branches,
        (conditions, names): (&[&Expr], &[Name]),
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        let has_connections = branches.iter().flat_map(|(_, body)| body).any(needs_text);
        if !has_connections || !conditions.iter().all(|c| self.known_before_run(c)) {
            return;
        }
        if conditions.iter().any(|c| names.iter().any(|name| mentions(c, name))) {
            self.written_out(equation, scope, loops, false);
        } else if let Ok(Some(body)) = self.quietly(|flat| flat.chosen(branches, scope, loops)) {
            body.iter().for_each(|equation| self.equation(equation, scope, loops, false));
        }
    }

    /// The branch that conditions known before the run choose.
    fn chosen<'b>(
        &mut self,
        branches: &'b Branches,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Result<Option<&'b [Equation]>, Reported> {
        let env = Env { names: loops.fixed.clone(), ..Env::default() };
        for (condition, body) in branches {
            let Some(condition) = condition else { return Ok(Some(body)) };
            match self.scopes.evaluate(&condition.evaluable(), scope, &env)? {
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
        cx.names.extend(loops.fixed.iter().map(|(name, value)| (name.clone(), local_of(value.clone()))));
        let values = match self.range(first, &mut cx) {
            Ok(Range::Steps { start, step, count }) => match start.as_constant() {
                Some(start) => {
                    Value::array((0..count as i64).map(|k| Value::Integer(start + step * k)).collect()).items()
                }
                None => return,
            },
            Ok(Range::Values(values)) => values,
            _ => return,
        };
        for value in values.iter() {
            let mut fixed = loops.fixed.clone();
            fixed.push((first.name.name.clone(), value.clone()));
            let loops = Loops { iterators: rest.to_vec(), fixed };
            self.written_out(equation, scope, &loops, initial);
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
            let around = Around { holds: None };
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
            self.expand_for_condition(condition, cx)?;
            let arena = &mut self.model.templates.arena;
            let not = arena.not(test.node);
            let (yes, no) = match around.holds {
                None => (test.node, not),
                Some(outer) => (arena.and(outer, test.node), arena.and(outer, not)),
            };
            tried.push((test.node, self.rows(body, cx, Around { holds: Some(yes) })?));
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
    fn expand_for_condition(&mut self, condition: &Expr, cx: &Context) -> Result<(), Fail> {
        if cx.names.is_empty() || !self.known_before_run(condition) {
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
                EquationKind::Fields(fields) => rows.extend(self.rows_of_branch(fields, cx, around)?),
                EquationKind::Outputs(targets, call) => self.output_rows(equation, targets, call, cx, &mut rows)?,
                EquationKind::Failed(said) => return Err(self.say(said)),
                EquationKind::If(inner) => rows.extend(self.joined(equation.span, inner, cx, around)?),
                EquationKind::For(iterators, inner) => {
                    let iterators: Vec<_> = iterators.iter().collect();
                    self.loop_rows(&iterators, inner, cx, around, &mut rows)?;
                }
                EquationKind::Assert(assertion) => {
                    self.guarded_assertion(equation.span, assertion, cx, around.holds)?;
                }
                EquationKind::Call(call) => self.call_for_checks(equation.span, call, cx, false)?,
                EquationKind::Connect(..) | EquationKind::Overdetermined(_) => {
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
        iterators: &[&Loop],
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
        let (l, r) = (self.shape(left, cx)?, self.shape(right, cx)?);
        self.check_same_shape(equation.span, &l, &r)?;
        for at in positions(&l) {
            let (a, b) = (self.lower(left, cx, &at)?, self.lower(right, cx, &at)?);
            self.check_sides(equation.span, left, right, &a, &b)?;
            rows.push(Row { left: a, right: b, span: equation.span });
        }
        Ok(())
    }

    /// `(a, , b) = f(...)` by output and element.
    fn output_rows(
        &mut self,
        equation: &Equation,
        targets: &[Option<Expr>],
        call: &Expr,
        cx: &mut Context,
        rows: &mut Vec<Row>,
    ) -> Result<(), Fail> {
        let outputs = self.call_outputs(call, cx)?;
        for (target, (_, value)) in targets.iter().zip(&outputs) {
            let Some(target) = target else { continue };
            let shape = self.shape(target, cx)?;
            for at in positions(&shape) {
                let (a, b) = (self.lower(target, cx, &at)?, self.element_of_local(call.span, value, &at)?);
                self.check_sides(equation.span, target, call, &a, &b)?;
                rows.push(Row { left: a, right: b, span: equation.span });
            }
        }
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
        EquationKind::Connect(..) | EquationKind::Overdetermined(_) | EquationKind::When(_) => true,
        EquationKind::For(_, body) => body.iter().any(needs_text),
        EquationKind::If(branches) => branches.iter().flat_map(|(_, body)| body).any(needs_text),
        EquationKind::Fields(fields) => fields.iter().any(needs_text),
        _ => false,
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
