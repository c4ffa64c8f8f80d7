//! Statements and conditional expressions as steps of a body (see `body`).
//!
//! An `if` computes only the side that is taken, also in expressions and in `and` and `or`, because a side may call the
//! function itself or use a subscript that is valid only there.  A `for` counts its turns; where its body needs the loop
//! variable before the run (in a size or a slice) the loop is written out instead.

use hyd_instance::ScalarType;
use hyd_instance::range::{ROUNDING, SLACK, ZERO_STEP};
use hyd_source::Code;
use hyd_symbolic::{Function, NodeId, Relation, SlotId, Step};
use hyd_typed::{Assertion, Expr, Iterator, Kind, Statement, StatementKind};

use crate::expressions::branch::Test;
use crate::functions::statement::Flow;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::node::Typed;
use crate::state::steps::DEEPEST;

/// Most turns of a loop that is written out.
const MAX_WRITTEN: usize = 1000;

impl Flattener<'_, '_> {
    pub(crate) fn build_statement(&mut self, statement: &Statement, cx: &mut Context) -> Result<Flow, Fail> {
        if let Some(builder) = self.builders.last_mut() {
            builder.calls.clear();
        }
        match &statement.kind {
            StatementKind::Assign(Expr { kind: Kind::Local(path), .. }, _)
                if self.is_text_for_messages(path.name()) => {}
            StatementKind::Assign(target, value) => {
                let value = self.local_value(value, cx)?;
                self.assign_in_body(target, value, cx)?;
            }
            StatementKind::AssignTuple(targets, call) => {
                let outputs = self.call_outputs(call, cx)?;
                if targets.len() > outputs.len() {
                    let (given, taken) = (outputs.len(), targets.len());
                    let message = format!("the function gives {given} values, but {taken} are taken");
                    return Err(self.error(Code::BadArguments, statement.span, message));
                }
                let mut pairs = Vec::with_capacity(targets.len());
                for (target, (_, value)) in targets.iter().zip(outputs) {
                    pairs.extend(target.as_ref().map(|target| (target, value)));
                }
                // `(a, b) := exchanged(a, b)`: what is given may read what is set.
                if pairs.len() > 1 {
                    pairs = pairs.into_iter().map(|(target, value)| (target, self.held_local(value))).collect();
                }
                for (target, value) in pairs {
                    self.assign_in_body(target, value, cx)?;
                }
            }
            StatementKind::If(branches) => self.build_if(branches, cx)?,
            StatementKind::For(iterators, body) => self.build_for(iterators, body, cx)?,
            StatementKind::While(condition, body) => {
                let (steps, ()) = self.block(|flat| {
                    flat.leave_unless(condition, cx)?;
                    flat.run(body, cx).map(|_| ())
                })?;
                self.step(Step::Loop(steps));
            }
            StatementKind::Break => {
                self.step(Step::Break);
                return Ok(Flow::Break);
            }
            StatementKind::Return => {
                self.step(Step::Return);
                return Ok(Flow::Return);
            }
            StatementKind::Call(call) => drop(self.call_outputs(call, cx)?),
            StatementKind::Assert(assertion) => self.build_assertion(assertion, cx)?,
            StatementKind::Failed(said) => return Err(self.say(said)),
            StatementKind::Terminate(_) | StatementKind::Reinit(..) => return Err(Fail::Reported),
            StatementKind::When(_) => {
                return Err(self.error(Code::Misplaced, statement.span, "`when` is not allowed in a function"));
            }
        }
        Ok(Flow::Next)
    }

    fn build_assertion(&mut self, parts: &Assertion, cx: &mut Context) -> Result<(), Fail> {
        if !parts.error {
            return Ok(());
        }
        let (condition, text) = (&parts.condition, &parts.text);
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "`assert`", &test)?;
        let text =
            self.quietly(|flat| flat.text_value(text, cx)).unwrap_or_else(|_| hyd_syntax::print_expr(&text.written()));
        self.step(Step::Check(test.node, text.into()));
        Ok(())
    }

    /// `if not condition then break`
    fn leave_unless(&mut self, condition: &Expr, cx: &mut Context) -> Result<(), Fail> {
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        self.step(Step::If(test.node, Vec::new(), vec![Step::Break]));
        Ok(())
    }

    fn build_if(&mut self, branches: &[(Option<Expr>, Vec<Statement>)], cx: &mut Context) -> Result<(), Fail> {
        if branches.len() > DEEPEST {
            return self.build_flat_if(branches, cx);
        }
        let Some(((condition, body), rest)) = branches.split_first() else { return Ok(()) };
        let Some(condition) = condition else { return self.run(body, cx).map(|_| ()) };
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        match self.model.templates.arena.as_constant(test.node) {
            Some(0.0) => return self.build_if(rest, cx),
            Some(_) => return self.run(body, cx).map(|_| ()),
            None => {}
        }
        let (yes, _) = self.block(|flat| flat.run(body, cx))?;
        let (no, ()) = self.block(|flat| flat.build_if(rest, cx))?;
        self.step(Step::If(test.node, yes, no));
        Ok(())
    }

    /// A long `if`, one branch after the other: a register says that a branch has been taken, so that steps nest no deeper with
    /// more branches.
    fn build_flat_if(&mut self, branches: &[(Option<Expr>, Vec<Statement>)], cx: &mut Context) -> Result<(), Fail> {
        let taken = self.open_flag();
        for (condition, body) in branches {
            let (steps, always) = self.block(|flat| {
                let test = match condition {
                    None => Test::Always,
                    Some(condition) => flat.known_test(condition, cx)?,
                };
                match test {
                    Test::Never => {}
                    Test::Always => flat.run(body, cx).map(|_| ())?,
                    Test::Run(test) => {
                        let (mut yes, _) = flat.block(|flat| flat.run(body, cx))?;
                        yes.push(flat.take(taken));
                        flat.step(Step::If(test, yes, Vec::new()));
                    }
                }
                Ok(matches!(test, Test::Always))
            })?;
            self.step_unless(taken, steps);
            if always {
                break;
            }
        }
        Ok(())
    }

    fn known_test(&mut self, condition: &Expr, cx: &mut Context) -> Result<Test, Fail> {
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        Ok(match self.model.templates.arena.as_constant(test.node) {
            Some(0.0) => Test::Never,
            Some(_) => Test::Always,
            None => Test::Run(test.node),
        })
    }

    fn build_for(&mut self, iterators: &[Iterator], body: &[Statement], cx: &mut Context) -> Result<(), Fail> {
        let Some((iterator, rest)) = iterators.split_first() else { return self.run(body, cx).map(|_| ()) };
        let mark = cx.names.len();
        let (counted, draft) = self.attempt(|flat| flat.block(|flat| flat.build_counted(iterator, rest, body, cx)));
        cx.names.truncate(mark);
        if matches!(counted, Err(Fail::Opaque)) {
            return self.build_written(iterator, rest, body, cx);
        }
        self.keep(draft);
        counted.map(|(steps, ())| steps.into_iter().for_each(|step| self.step(step)))
    }

    /// A loop that counts its turns in a register.
    fn build_counted(
        &mut self,
        iterator: &Iterator,
        rest: &[Iterator],
        body: &[Statement],
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let turns = self.turns(&iterator.range, cx)?;
        let counter = self.registers(1).start;
        let (zero, one) = (self.model.templates.arena.constant(0.0), self.model.templates.arena.constant(1.0));
        self.step(Step::Set(counter, zero));
        let at = self.model.templates.arena.slot(SlotId(counter));
        let count = match &turns {
            Turns::Even { count, .. } => *count,
            Turns::List { count, .. } => self.model.templates.arena.constant(f64::from(*count)),
        };
        let (steps, ()) = self.block(|flat| {
            let more = flat.model.templates.arena.compare(Relation::Less, at, count);
            flat.step(Step::If(more, Vec::new(), vec![Step::Break]));
            let (node, scalar) = match &turns {
                Turns::Even { start, step, scalar, .. } => {
                    let arena = &mut flat.model.templates.arena;
                    let way = arena.mul(at, *step);
                    (arena.add(*start, way), scalar.clone())
                }
                Turns::List { first, count, scalar } => {
                    let to = flat.registers(1).start;
                    flat.step(Step::Load { to, first: *first, count: *count, index: at });
                    (flat.model.templates.arena.slot(SlotId(to)), scalar.clone())
                }
            };
            let node = flat.held(node);
            let next = flat.model.templates.arena.add(at, one);
            flat.step(Step::Set(counter, next));
            cx.names.push((iterator.name.name.clone(), Local::Node(Typed { node, scalar })));
            let done = flat.build_for(rest, body, cx);
            cx.names.pop();
            done
        })?;
        self.step(Step::Loop(steps));
        Ok(())
    }

    /// How often a loop turns and what its variable is.
    fn turns(&mut self, range: &Expr, cx: &mut Context) -> Result<Turns, Fail> {
        if let Kind::Range(start, step, stop) = &range.kind {
            let (a, b) = (self.lower(start, cx, &[])?, self.lower(stop, cx, &[])?);
            let s = match step {
                Some(step) => self.lower(step, cx, &[])?,
                None => self.literal(1.0, ScalarType::Integer),
            };
            let scalar = match (&a.scalar, &s.scalar, &b.scalar) {
                (ScalarType::Real, ..) | (_, ScalarType::Real, _) | (.., ScalarType::Real) => ScalarType::Real,
                (other, ..) => other.clone(),
            };
            let (start, step, stop) = (self.held(a.node), self.held(s.node), self.held(b.node));
            let arena = &mut self.model.templates.arena;
            let zero = arena.constant(0.0);
            let moves = arena.compare(Relation::NotEqual, s.node, zero);
            match arena.as_constant(moves) {
                Some(0.0) => return Err(self.error(Code::Value, range.span, ZERO_STEP)),
                Some(_) => {}
                None => self.step(Step::Check(moves, ZERO_STEP.into())),
            }
            let arena = &mut self.model.templates.arena;
            let distance = arena.sub(stop, start);
            let quotient = arena.div(distance, step);
            // Ranges of integers are exact; a Real step that just misses the end by rounding still counts.
            let reach = if matches!(scalar, ScalarType::Real) {
                let (low, high, width) = (
                    arena.call1(Function::Abs, start),
                    arena.call1(Function::Abs, stop),
                    arena.call1(Function::Abs, step),
                );
                let largest = arena.call2(Function::Max, low, high);
                let steps = arena.div(largest, width);
                let (rounding, slack) = (arena.constant(ROUNDING), arena.constant(SLACK));
                let rounding = arena.mul(rounding, steps);
                let slack = arena.call2(Function::Max, slack, rounding);
                arena.add(quotient, slack)
            } else {
                quotient
            };
            let whole = arena.call1(Function::Floor, reach);
            let one = arena.constant(1.0);
            let count = arena.add(whole, one);
            let count = self.held(count);
            return Ok(Turns::Even { start, step, count, scalar });
        }
        let items = match &range.kind {
            _ if !matches!(self.range_values(range, cx)?, Some(())) => self.elements_of(range, cx)?,
            _ => {
                let (env, _) = cx.env();
                let values = self.scopes.evaluate(&range.evaluable(), cx.scope, &env)?.items();
                let mut items = Vec::with_capacity(values.len());
                for value in values.iter() {
                    items.push(self.constant_value(range.span, value)?);
                }
                items
            }
        };
        let registers = self.registers(items.len());
        for (register, item) in registers.clone().zip(&items) {
            self.step(Step::Set(register, item.node));
        }
        let scalar = items.first().map_or(ScalarType::Real, |item| item.scalar.clone());
        Ok(Turns::List { first: registers.start, count: items.len() as u32, scalar })
    }

    /// `Some` if the range does not mention variables of the function.
    fn range_values(&mut self, range: &Expr, cx: &Context) -> Result<Option<()>, Fail> {
        let local = hyd_typed::any_local(range, &mut |name| cx.local(name.name()).is_some());
        Ok((!local).then_some(()))
    }

    /// The turns one after the other, the loop variable known in each.
    fn build_written(
        &mut self,
        iterator: &Iterator,
        rest: &[Iterator],
        body: &[Statement],
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let range = self.range(iterator, cx)?;
        if range.count() > MAX_WRITTEN {
            let message = format!(
                "a loop whose variable is needed before the run can have {MAX_WRITTEN} turns, not {}",
                range.count()
            );
            return Err(self.error(Code::Limit, iterator.range.span, message));
        }
        let (mut steps, ()) = self.block(|flat| {
            for k in 0..range.count() {
                let local = range.local(k)?;
                cx.names.push((iterator.name.name.clone(), local));
                let done = flat.build_for(rest, body, cx);
                cx.names.pop();
                done?;
            }
            Ok(())
        })?;
        // A `break` in a turn leaves all of them.
        steps.push(Step::Break);
        self.step(Step::Loop(steps));
        Ok(())
    }
}

/// The turns of a loop.
enum Turns {
    /// `start + k*step` for `k` below `count`.
    Even { start: NodeId, step: NodeId, count: NodeId, scalar: ScalarType },
    /// The registers of a list.
    List { first: u32, count: u32, scalar: ScalarType },
}
