//! What the parts of a `when` give the variables that they set, where they act, and that each is set once.

use hyd_instance::{InstId, ScalarType};
use hyd_source::{Code, Diagnostic, Edit, Origin, Span};
use hyd_symbolic::NodeId;
use hyd_typed::{Expr, Iterator};

use crate::functions::draw::AtEvent;
use crate::model::{Message, Section};
use crate::sections::when_condition::printed;
use crate::sections::when_parts::{Given, Guard, Target, Whole};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    /// A part begins: the loops outside the `when`, which of its branches fires, the loops inside.
    pub(super) fn enter_part(
        &mut self,
        cx: &mut Context,
        whole: Whole<'_>,
        loops: &[&Iterator],
    ) -> Result<(Vec<NodeId>, bool), Fail> {
        self.enter_all(cx, whole.loops)?;
        let fires = self.fires(whole.conditions, cx)?;
        self.enter_loops(cx, loops)?;
        Ok((fires, cx.counts.contains(&0)))
    }

    /// `node` and all guards.
    pub(super) fn guarded(&mut self, mut node: NodeId, guards: &[Guard<'_>], cx: &mut Context) -> Result<NodeId, Fail> {
        for guard in guards {
            for (condition, wanted) in guard.earlier.iter().map(|c| (*c, false)).chain(guard.own.map(|c| (c, true))) {
                let test = self.lower(condition, cx, &[])?;
                self.want_boolean(condition.span, "a condition", &test)?;
                let arena = &mut self.model.templates.arena;
                let holds = if wanted { test.node } else { arena.not(test.node) };
                node = arena.and(node, holds);
            }
        }
        Ok(node)
    }

    /// The value a branch gives: an expression or one of several outputs of a call.
    fn when_value(
        &mut self,
        (expr, output): (&Expr, Option<usize>),
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let Some(n) = output else {
            let rank = self.shape(expr, cx)?.len();
            return self.lower(expr, cx, if rank == 0 { &[] } else { index });
        };
        let outputs = self.call_outputs(expr, cx)?;
        match outputs.get(n) {
            Some((_, value)) => self.element_of_local(expr.span, value, index),
            None => {
                let message = format!("the function gives {} values, but {} are taken", outputs.len(), n + 1);
                Err(self.error(Code::BadArguments, expr.span, message))
            }
        }
    }

    /// `right`, or what is given where that acts; `loops`: how many counters the loops around the assignment have.
    pub(super) fn when_given(
        &mut self,
        given: &Given<'_>,
        (target, left): (&Expr, &Typed),
        (fires, right): (&[NodeId], NodeId),
        cx: &mut Context,
        (loops, index): (usize, &[Affine]),
    ) -> Result<NodeId, Fail> {
        let acts = self.guarded(fires[given.branch], &given.guards, cx)?;
        cx.event = Some(AtEvent { loops, ..AtEvent::new(acts, cx) });
        let value = self.when_value(given.value, cx, index);
        cx.event = None;
        let value = value?;
        let fits = value.scalar == left.scalar || value.is_number() && matches!(left.scalar, ScalarType::Real);
        if !fits {
            let (name, is, given_is) = (printed(target), &left.scalar, &value.scalar);
            let message = format!("`{name}` is {}, but the value is {}", is.name(), given_is.name());
            return Err(self.error(Code::TypeMismatch, given.value.0.span, message));
        }
        Ok(self.model.templates.arena.select(acts, value.node, right))
    }

    /// At most one of these may act in one branch: reports the second of two that no condition keeps apart.
    pub(super) fn want_one(&mut self, left: &Expr, given: &[&Given<'_>], cx: &mut Context) -> Result<(), Fail> {
        let mut acting: Vec<(&Given<'_>, NodeId, bool)> = Vec::new();
        for &own in given {
            let always = self.model.templates.arena.constant(1.0);
            let acts = self.guarded(always, &own.guards, cx)?;
            if self.model.templates.arena.as_constant(acts) == Some(0.0) {
                continue;
            }
            let mut conditions = own.guards.iter().flat_map(|guard| guard.earlier.iter().copied().chain(guard.own));
            let is_known = conditions.all(|condition| self.known_before_run(condition));
            let mut both = Vec::new();
            for &(first, other, other_is_known) in &acting {
                if first.branch != own.branch || are_apart(&first.guards, &own.guards) {
                    continue;
                }
                // What parameters decide may be set for a run, which then says so.
                if is_known && other_is_known && !(own.guards.is_empty() && first.guards.is_empty()) {
                    both.push(self.model.templates.arena.and(other, acts));
                    continue;
                }
                let message = format!("`{}` is set twice by one branch of a `when`", printed(left));
                let diagnostic = Diagnostic::error(Code::Unbalanced, message)
                    .at(own.value.0.span, "second time")
                    .with(first.value.0.span, "first time")
                    .help("equations of a `when` have no order: leave one of them out, or let an `if` decide");
                self.report(diagnostic);
                return Err(Fail::Reported);
            }
            for both in both {
                let text = format!("`{}` is set twice by one branch of a `when` with these parameters", printed(left));
                let message = self.add_message(Message { text: text.into(), parts: Vec::new(), error: true });
                let arena = &mut self.model.templates.arena;
                let (holds, none) = (arena.not(both), arena.constant(0.0));
                let origin = Origin { path: self.path(cx.scope.inst), span: own.value.0.span };
                self.emit(Section::Assert(message), holds, none, &cx.loop_counts(), &origin);
            }
            acting.push((own, acts, is_known));
        }
        Ok(())
    }

    /// From `end when;` to the next `when` between two places of a text, if nothing else stands there.
    fn between_whens(&self, first: Span, second: Span) -> Option<Span> {
        let text = self.scopes.table.files.text(first.file);
        if first.file != second.file || text.get(first.end as usize..second.start as usize)?.contains("elsewhen") {
            return None;
        }
        let from = first.end as usize;
        let end = from + text.get(from..second.start as usize)?.find("end when")?;
        let after = text[end + "end when".len()..second.start as usize].trim_start().strip_prefix(';')?;
        let rest = after.trim_start();
        let begin = second.start as usize - rest.len();
        rest.starts_with("when").then(|| Span::new(first.file, end, begin))
    }

    /// Only one `when` may set a variable: reports the second.
    pub(super) fn set_before(&mut self, inst: InstId, target: &Target<'_>) -> bool {
        let known = self.all_notes().find_map(|notes| notes.set_in_when.get(&inst).copied());
        self.tables().notes.set_in_when.insert(inst, target.span);
        let Some(first) = known else { return false };
        let message = format!("`{}` is set by two `when` equations", printed(target.left));
        let mut diagnostic = Diagnostic::error(Code::Unbalanced, message)
            .at(target.span, "second time")
            .with(first, "first time")
            .help("one `when` with `elsewhen` says which comes first");
        if let Some(span) = self.between_whens(first, target.span) {
            let edit = Edit { span, text: "else".to_string() };
            diagnostic =
                diagnostic.propose("join the two: `elsewhen`, so that the first one has precedence", vec![edit]);
        }
        self.report(diagnostic);
        true
    }
}

/// True for what stands in different branches of one `if`.
fn are_apart(one: &[Guard<'_>], other: &[Guard<'_>]) -> bool {
    let first = |guard: &Guard<'_>| guard.earlier.first().copied().or(guard.own).map(std::ptr::from_ref);
    one.iter().zip(other).any(|(a, b)| first(a) == first(b) && a.earlier.len() != b.earlier.len())
}
