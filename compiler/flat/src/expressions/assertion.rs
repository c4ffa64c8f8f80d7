//! Assertions and the texts of messages in equations.

use hyd_instance::ScalarType;
use hyd_source::{Code, Origin, Span};
use hyd_symbolic::{BodyId, Node, NodeId, Relation, Step};
use hyd_system::ValueKind;
use hyd_typed::{Assertion, Expr};

use crate::model::{Message, MessagePart, Section};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// An assertion that counts only where `holds` does; in a `when`, at the event at which that fires.
    pub(crate) fn guarded_assertion(
        &mut self,
        span: Span,
        parts: &Assertion,
        cx: &mut Context,
        holds: Option<NodeId>,
    ) -> Result<(), Fail> {
        let scope = cx.scope;
        let (message, values) = self.message(&parts.text, cx, parts.error)?;
        let before = std::mem::replace(&mut cx.no_event, true);
        let test = self.lower(&parts.condition, cx, &[]);
        let values = match test.is_ok() {
            true => self.message_values(message, &values, cx),
            false => Err(Fail::Reported),
        };
        cx.no_event = before;
        let test = test?;
        self.want_boolean(parts.condition.span, "`assert`", &test)?;
        let values = values?;
        let arena = &mut self.model.templates.arena;
        if cx.in_when {
            let fails = arena.not(test.node);
            let fails = holds.map_or(fails, |holds| arena.and(holds, fails));
            let origin = Origin { path: self.path(scope.inst), span };
            self.emit(Section::AssertOnce(message), fails, values, &cx.loop_counts(), &origin);
            return Ok(());
        }
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

    /// A call whose results are not taken: assertions inside may fail.  `always`: nothing decides in the run whether it is made.
    pub(crate) fn call_for_checks(
        &mut self,
        span: Span,
        call: &Expr,
        cx: &mut Context,
        always: bool,
    ) -> Result<(), Fail> {
        for (name, value) in self.call_outputs(call, cx)? {
            // Only what was made for checks has no name.
            let Local::Node(done) = value else { continue };
            if !name.is_empty() || self.model.templates.arena.as_constant(done.node).is_some() {
                continue;
            }
            if !always {
                let message = "a call for its assertions alone is not possible under a condition of the run";
                return Err(self.error(Code::OutsideProfile, span, message));
            }
            let text = self.checks_of(done.node).join("; or: ").into();
            let message = self.add_message(Message { text, parts: Vec::new(), error: true });
            let arena = &mut self.model.templates.arena;
            let zero = arena.constant(0.0);
            let holds = arena.compare(Relation::Equal, done.node, zero);
            let values = arena.argument_list(&[]);
            let origin = Origin { path: self.path(cx.scope.inst), span };
            self.emit(Section::Assert(message), holds, values, &cx.loop_counts(), &origin);
        }
        Ok(())
    }

    /// The texts of the assertions that the evaluation of a call may fail at.
    fn checks_of(&self, call: NodeId) -> Vec<String> {
        match self.model.templates.arena.node(call) {
            Node::Apply(body, ..) => self.checks_of_body(body),
            _ => Vec::new(),
        }
    }

    /// The texts of the assertions of a compiled function.
    pub(crate) fn checks_of_body(&self, body: BodyId) -> Vec<String> {
        let arena = &self.model.templates.arena;
        let mut texts: Vec<String> = Vec::new();
        let mut todo = vec![arena.body(body).steps.as_slice()];
        while let Some(steps) = todo.pop() {
            for step in steps {
                if let Step::Check(_, text) = step
                    && !texts.iter().any(|known| **known == **text)
                {
                    texts.push(text.to_string());
                }
                todo.extend(step.inner());
            }
        }
        texts
    }

    /// `terminate(text)` in a `when` of an algorithm.
    pub(crate) fn run_terminate(&mut self, span: Span, text: &Expr, cx: &mut Context) -> Result<(), Fail> {
        let (message, values) = self.message(text, cx, false)?;
        let values = self.message_values(message, &values, cx)?;
        let acts = cx.holds.unwrap_or_else(|| self.model.templates.arena.constant(1.0));
        let origin = Origin { path: self.path(cx.scope.inst), span };
        self.emit(Section::Terminate(message), acts, values, &cx.loop_counts(), &origin);
        Ok(())
    }

    /// The values that a message shows, as the right side of its equation.
    pub(crate) fn message_values(&mut self, message: u32, values: &[Expr], cx: &mut Context) -> Result<NodeId, Fail> {
        let mut nodes = Vec::with_capacity(values.len());
        let mut kinds = Vec::with_capacity(values.len());
        for expr in values {
            let value = self.lower(expr, cx, &[])?;
            kinds.push(match &value.scalar {
                ScalarType::Integer => ValueKind::Integer,
                ScalarType::Boolean => ValueKind::Boolean,
                ScalarType::Enumeration(e) => ValueKind::Enumeration(e.literals.clone().into()),
                _ => ValueKind::Real,
            });
            nodes.push(value.node);
        }
        if let Some(message) = self.message_mut(message) {
            let shown = message.parts.iter_mut().filter_map(|part| match part {
                MessagePart::Value(_, kind) => Some(kind),
                MessagePart::Text(_) => None,
            });
            shown.zip(kinds).for_each(|(kind, found)| *kind = found);
        }
        Ok(self.model.templates.arena.argument_list(&nodes))
    }
}
