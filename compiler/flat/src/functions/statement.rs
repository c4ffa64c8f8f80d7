//! Algorithms run symbolically: statements over nodes instead of numbers.
//!
//! An assignment (`assignment`) binds a name to a node, an `if` joins both ways by a selection, a `for` with known range is run through.
//! In a function the names are its own; in an algorithm section of a model they are the model's variables, which become
//! `variable = node` when the section ends.  What only the run decides is left to `body` in functions and to `run_decided` in
//! models.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Function, NodeId};
use hyd_syntax::tree::Name;
use hyd_typed::{Assertion, Expr, Iterator, Kind as Form, Statement, StatementKind};
use rustc_hash::FxHashSet;

use crate::model::VarId;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::node::Typed;

/// Most turns of a `while` that is decided at translation.
const MAX_TURNS: usize = 100_000;

/// Most statements that the functions of one equation, or an algorithm section, may take when they are run symbolically, some seconds;
/// beyond them they are compiled.
const MAX_STATEMENTS: u32 = 2_000_000;

/// Names, and variables of the model that an algorithm section has assigned so far, with their values.
type Assigned = (Vec<(Name, Local)>, Option<Vec<(VarId, Typed)>>);

/// How a list of statements ended.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flow {
    /// At its end.
    Next,
    /// At a `break`.
    Break,
    /// At a `return`.
    Return,
}

impl Flattener<'_, '_> {
    pub(crate) fn run(&mut self, statements: &[Statement], cx: &mut Context) -> Result<Flow, Fail> {
        for statement in statements {
            let flow = self.run_statement(statement, cx)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn run_statement(&mut self, statement: &Statement, cx: &mut Context) -> Result<Flow, Fail> {
        if self.in_body(cx) {
            return self.build_statement(statement, cx);
        }
        if cx.in_section() && !matches!(statement.kind, StatementKind::When(_)) && !leaves(statement) {
            let start = cx.clone();
            let (result, draft) = self.attempt(|flat| flat.run_plain(statement, cx));
            if result != Err(Fail::Opaque) {
                self.keep(draft);
                return result;
            }
            *cx = start;
            return self.run_compiled(statement, cx).map(|()| Flow::Next);
        }
        self.run_plain(statement, cx)
    }

    /// Counts a statement, or the turn of a loop.
    fn count_statement(&mut self, span: Span) -> Result<(), Fail> {
        self.statements = self.statements.saturating_add(1);
        if self.statements > MAX_STATEMENTS { self.opaque(span) } else { Ok(()) }
    }

    fn run_plain(&mut self, statement: &Statement, cx: &mut Context) -> Result<Flow, Fail> {
        self.count_statement(statement.span)?;
        match &statement.kind {
            StatementKind::Assign(target, value) if cx.depth > 0 && value.ty.is_text() => {
                // What the run puts together is a matter of compiled functions.
                let (known, draft) = self.attempt(|flat| flat.local_value(value, cx));
                let Ok(value) = known else { return self.opaque(value.span) };
                self.keep(draft);
                self.assign(target, value, cx)?;
            }
            StatementKind::Assign(target, value) => {
                let value = self.local_value(value, cx)?;
                self.assign(target, value, cx)?;
            }
            StatementKind::AssignTuple(targets, call) => self.assign_tuple(statement.span, targets, call, cx)?,
            StatementKind::If(branches) => return self.run_if(branches, cx),
            StatementKind::For(iterators, body) => return self.run_for(iterators, body, cx),
            StatementKind::While(condition, body) => return self.run_while(condition, body, cx),
            StatementKind::When(branches) => self.run_when(statement.span, branches, cx)?,
            StatementKind::Break => return Ok(Flow::Break),
            StatementKind::Return => return Ok(Flow::Return),
            StatementKind::Call(call) => self.run_call(call, cx)?,
            StatementKind::Assert(assertion) if cx.in_section() => {
                self.guarded_assertion(statement.span, assertion, cx, cx.holds)?;
            }
            StatementKind::Assert(assertion) => self.run_assert(statement.span, assertion, cx)?,
            StatementKind::Terminate(text) => self.run_terminate(statement.span, text, cx)?,
            StatementKind::Reinit(state, value) => self.run_reinit(statement.span, state, value, cx)?,
            StatementKind::Failed(said) => return Err(self.say(said)),
        }
        Ok(Flow::Next)
    }

    fn run_call(&mut self, call: &Expr, cx: &mut Context) -> Result<(), Fail> {
        match &call.kind {
            Form::Call(_) | Form::Record(_) if cx.in_section() => {
                self.call_for_checks(call.span, call, cx, cx.holds.is_none())
            }
            Form::Call(_) | Form::Record(_) => {
                let outputs = self.call_outputs(call, cx)?;
                let arena = &self.model.templates.arena;
                // What only checks something must be run, and what is run symbolically would leave it out.
                let checks = outputs.iter().any(|(name, value)| {
                    name.is_empty() && matches!(value, Local::Node(done) if arena.as_constant(done.node).is_none())
                });
                if checks && !self.in_body(cx) { self.opaque(call.span) } else { Ok(()) }
            }
            _ => self.lower(call, cx, &[]).map(drop),
        }
    }

    /// An assertion in a function that is known to hold says nothing; another one needs the function compiled.
    fn run_assert(&mut self, span: Span, parts: &Assertion, cx: &mut Context) -> Result<(), Fail> {
        if !parts.error {
            return Ok(());
        }
        let (condition, text) = (&parts.condition, &parts.text);
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "`assert`", &test)?;
        match self.model.templates.arena.as_constant(test.node) {
            // The run decides whether this place is reached.
            Some(0.0) if cx.called.iter().any(|(_, uncertain)| *uncertain) => self.opaque(span),
            Some(0.0) => {
                let text = self.text_value(text, cx)?;
                Err(self.error(Code::Value, span, text))
            }
            Some(_) => Ok(()),
            None => self.opaque(span),
        }
    }

    fn assign_tuple(
        &mut self,
        span: Span,
        targets: &[Option<Expr>],
        call: &Expr,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let outputs = self.call_outputs(call, cx)?;
        if targets.len() > outputs.len() {
            let message = format!("the function gives {} values, but {} are taken", outputs.len(), targets.len());
            return Err(self.error(Code::BadArguments, span, message));
        }
        for (target, (_, value)) in targets.iter().zip(outputs) {
            if let Some(target) = target {
                self.assign(target, value, cx)?;
            }
        }
        Ok(())
    }

    /// All ways are run; what they set is joined by selections.
    fn run_if(&mut self, branches: &[(Option<Expr>, Vec<Statement>)], cx: &mut Context) -> Result<Flow, Fail> {
        let mut ways: Vec<(Span, NodeId, Context)> = Vec::new();
        // Where no condition held so far; `cx` itself before the first one that the run decides.
        let mut other: Option<Context> = None;
        let mut flow = Flow::Next;
        for (condition, body) in branches {
            let here = other.as_mut().unwrap_or(cx);
            let Some(condition) = condition else {
                flow = self.run(body, here)?;
                break;
            };
            let test = self.lower(condition, here, &[])?;
            self.want_boolean(condition.span, "a condition", &test)?;
            match self.model.templates.arena.as_constant(test.node) {
                Some(0.0) => continue,
                Some(_) => {
                    flow = self.run(body, here)?;
                    break;
                }
                None => {}
            }
            let mut yes = here.clone();
            yes.depends_on_run();
            let mut no = yes.clone();
            if here.in_section() {
                let arena = &mut self.model.templates.arena;
                let not = arena.not(test.node);
                let (a, b) = here.holds.map_or((test.node, not), |h| (arena.and(h, test.node), arena.and(h, not)));
                (yes.holds, no.holds) = (Some(a), Some(b));
            } else if here.event.is_some() {
                let arena = &mut self.model.templates.arena;
                let not = arena.not(test.node);
                for (way, holds) in [(&mut yes, test.node), (&mut no, not)] {
                    way.holds = Some(way.holds.map_or(holds, |around| arena.and(around, holds)));
                }
            }
            if self.run(body, &mut yes)? != Flow::Next {
                return self.opaque(condition.span);
            }
            ways.push((condition.span, test.node, yes));
            other = Some(no);
        }
        let Some(mut no) = other else { return Ok(flow) };
        if let (true, Some((span, ..))) = (flow != Flow::Next, ways.last()) {
            return self.opaque(*span);
        }
        for (span, test, yes) in ways.into_iter().rev() {
            (no.names, no.assigned) = self.both_ways(span, test, &yes, &no)?;
        }
        (cx.names, cx.assigned) = (no.names, no.assigned);
        Ok(Flow::Next)
    }

    /// What holds after either of two ways.
    pub(crate) fn join_contexts(
        &mut self,
        span: Span,
        test: NodeId,
        yes: Context,
        no: Context,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        (cx.names, cx.assigned) = self.both_ways(span, test, &yes, &no)?;
        Ok(())
    }

    /// The names, and the variables of an algorithm section, after either of two ways.
    fn both_ways(&mut self, span: Span, test: NodeId, yes: &Context, no: &Context) -> Result<Assigned, Fail> {
        let mut joined = Vec::new();
        for (name, local) in &yes.names {
            let Some(other) = no.local(name) else { continue };
            joined.push((name.clone(), self.join(span, test, local, other)?));
        }
        // What only one way sets is no number after the other: a value that would be made of it has no meaning, and the run says so.
        let arena = &mut self.model.templates.arena;
        let below = arena.constant(-1.0);
        let none = arena.call1(Function::Log, below);
        for (way, other, is_yes) in [(yes, no, true), (no, yes, false)] {
            for (name, local) in &way.names {
                if let Local::Node(set) = local
                    && set.scalar == ScalarType::Real
                    && other.local(name).is_none()
                    && !joined.iter().any(|(known, _)| known == name)
                {
                    let none = Typed::real(none);
                    let (a, b) = if is_yes { (set.clone(), none) } else { (none, set.clone()) };
                    joined.push((name.clone(), Local::Node(self.choose(span, test, a, b)?)));
                }
            }
        }
        let (Some(mine), Some(other)) = (&yes.assigned, &no.assigned) else { return Ok((joined, None)) };
        let mut all = Vec::new();
        let mut seen = FxHashSet::default();
        for v in mine.iter().chain(other).map(|(v, _)| *v).filter(|v| seen.insert(*v)) {
            let (a, b) = (self.current(v, yes), self.current(v, no));
            all.push((v, self.choose(span, test, a, b)?));
        }
        Ok((joined, Some(all)))
    }

    fn run_for(&mut self, iterators: &[Iterator], body: &[Statement], cx: &mut Context) -> Result<Flow, Fail> {
        let Some((iterator, rest)) = iterators.split_first() else { return self.run(body, cx) };
        let range = self.range(iterator, cx)?;
        for k in 0..range.count() {
            self.count_statement(iterator.name.span)?;
            let local = range.local(k)?;
            cx.names.push((iterator.name.name.clone(), local));
            let flow = self.run_for(rest, body, cx)?;
            if let Some(position) = cx.names.iter().rposition(|(n, _)| *n == iterator.name.name) {
                cx.names.remove(position);
            }
            match flow {
                Flow::Next => {}
                Flow::Break => break,
                Flow::Return => return Ok(Flow::Return),
            }
        }
        Ok(Flow::Next)
    }

    fn run_while(&mut self, condition: &Expr, body: &[Statement], cx: &mut Context) -> Result<Flow, Fail> {
        for _ in 0..MAX_TURNS {
            let test = self.lower(condition, cx, &[])?;
            self.want_boolean(condition.span, "a condition", &test)?;
            match self.model.templates.arena.as_constant(test.node) {
                Some(0.0) => return Ok(Flow::Next),
                Some(_) => {}
                None => return self.opaque(condition.span),
            }
            match self.run(body, cx)? {
                Flow::Next => {}
                Flow::Break => return Ok(Flow::Next),
                Flow::Return => return Ok(Flow::Return),
            }
        }
        Err(self.error(Code::Limit, condition.span, format!("this `while` takes more than {MAX_TURNS} turns")))
    }
}

/// True if the statement can end the loop or the function around it.
fn leaves(statement: &Statement) -> bool {
    let returns = |body: &[Statement]| body.iter().any(|s| leaves(s) && !ends_with_break(s));
    match &statement.kind {
        StatementKind::Break | StatementKind::Return => true,
        StatementKind::If(branches) => branches.iter().flat_map(|(_, body)| body).any(leaves),
        StatementKind::For(_, body) | StatementKind::While(_, body) => returns(body),
        _ => false,
    }
}

/// True if the statement leaves by `break` only, which ends at the loop around it.
fn ends_with_break(statement: &Statement) -> bool {
    match &statement.kind {
        StatementKind::Return => false,
        StatementKind::If(branches) => {
            branches.iter().flat_map(|(_, body)| body).filter(|s| leaves(s)).all(ends_with_break)
        }
        StatementKind::For(..) | StatementKind::While(..) => !leaves(statement),
        _ => true,
    }
}
