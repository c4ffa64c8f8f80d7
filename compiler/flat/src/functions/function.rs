//! Calls of the user's functions, by running their algorithms symbolically (`statement`).
//!
//! The statements of a function are executed once over nodes instead of numbers, so that the result is an expression like
//! any other: shared by template, simplified and differentiated like the rest.  Arguments are scalars, arrays of known
//! size and records.

use hyd_instance::{ScalarType, Value};
use hyd_source::{Code, Diagnostic, Span};
use hyd_typed::{Expr, Function, Kind, any, walk_statements};

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, Outputs};

/// Deepest nesting of function calls.
pub(crate) const MAX_CALLS: usize = 64;

/// Statements that take about as long as a call of a function that is run symbolically.
const CALL: u32 = 8;

impl<'s> Flattener<'_, 's> {
    /// All outputs of a call in their order.
    pub(crate) fn call_outputs(&mut self, expr: &Expr, cx: &mut Context) -> Result<Outputs, Fail> {
        if let Some(outputs) = self.known_call(expr, cx) {
            return Ok(outputs);
        }
        let outside = std::mem::take(&mut self.asked);
        let drawn = self.drawn;
        let (result, draft) = self.attempt(|flat| flat.make_call(expr, cx));
        if let (Ok(outputs), Some(claims), true) = (&result, draft.only_claims(), self.drawn == drawn) {
            self.remember_call(expr, claims, outputs, cx);
        }
        self.keep(draft);
        let inside = std::mem::replace(&mut self.asked, outside);
        inside.into_iter().for_each(|array| self.note_subscripts_of(array));
        result
    }

    fn make_call(&mut self, expr: &Expr, cx: &mut Context) -> Result<Outputs, Fail> {
        if cx.depth >= MAX_CALLS {
            let message = format!("functions call each other deeper than {MAX_CALLS} levels");
            return Err(self.error(Code::Limit, expr.span, message));
        }
        match &expr.kind {
            Kind::Record(made) => {
                let name = self.scopes.table.class(made.record.class).def.name.name.clone();
                let record = self.construct(expr.span, made, None, cx)?;
                Ok(vec![(name, record)])
            }
            Kind::Call(call) => {
                if let Some(outputs) = self.call_over_texts(expr, call, cx) {
                    return Ok(outputs);
                }
                let callee = self.callee(call, cx)?;
                self.call_with_arguments(expr.span, &callee, call, cx)
            }
            _ => Err(self.error(Code::BadArguments, expr.span, "a function is needed here")),
        }
    }

    /// Says what has no meaning in a function, where it could not be run: one run tells all.
    pub(crate) fn say_failed(&mut self, function: &Function) {
        if self.all_notes().any(|notes| notes.looked_at.contains(&function.inst)) {
            return;
        }
        self.tables().notes.looked_at.insert(function.inst);
        let mut said: Vec<Diagnostic> = Vec::new();
        let mut inside: Vec<Diagnostic> = Vec::new();
        for (_, statements) in &function.algorithms {
            let mut look = |expr: &Expr| {
                any(expr, &mut |part| {
                    if let Kind::Failed(why, _) = &part.kind {
                        inside.extend(why.iter().cloned());
                    }
                    false
                });
            };
            walk_statements(statements, &mut look, &mut |why| said.extend(why.iter().cloned()));
        }
        said.extend(inside);
        // What has been said at this place is not said again.
        let place = |d: &Diagnostic| d.labels.iter().find(|l| l.primary).map(|l| l.span);
        for new in said.into_iter().filter(|d| d.code == Code::UnknownName) {
            if !self.scopes.table.messages.iter().any(|old| place(old) == place(&new)) {
                self.report(new);
            }
        }
    }

    /// A call with values: run symbolically, or compiled where that is not possible.
    pub(crate) fn call_with(
        &mut self,
        span: Span,
        callee: &Function,
        values: Vec<Local>,
        cx: &mut Context,
    ) -> Result<Outputs, Fail> {
        if let Some(external) =
            callee.external.as_ref().filter(|external| !self.scopes.is_column_reader(&external.text))
        {
            return self.call_external(span, callee, external, values, cx);
        }
        // Derivatives that functions of records name are not used (`given_derivative`).
        let of_records = values.iter().any(|value| matches!(value, Local::Record(_) | Local::Records(..)));
        if self.is_being_built(callee.inst) || !of_records && !callee.derivatives().is_empty() {
            return self.call_compiled(span, callee, values, cx);
        }
        // A call of itself that the run decides would never end here.
        if cx.called.contains(&(callee.inst, true)) && self.in_body(cx) {
            return self.call_compiled(span, callee, values, cx);
        }
        if cx.called.contains(&(callee.inst, true)) {
            self.opaque_at = span;
            return Err(Fail::Opaque);
        }
        let (result, draft) = self.attempt(|flat| flat.call_symbolically(span, callee, &values, cx));
        match &result {
            Err(Fail::Opaque) => return self.call_compiled(span, callee, values, cx),
            Ok(outputs) if !callee.generates_events() && self.is_large(&values, outputs) => {
                let (compiled, own) = self.attempt(|flat| flat.call_compiled(span, callee, values, cx));
                if compiled.is_ok() {
                    self.keep(own);
                    return compiled;
                }
            }
            _ => {}
        }
        self.keep(draft);
        if matches!(result, Err(Fail::Reported)) {
            self.say_failed(callee);
        }
        result
    }

    fn call_symbolically(
        &mut self,
        span: Span,
        callee: &Function,
        values: &[Local],
        cx: &Context,
    ) -> Result<Outputs, Fail> {
        self.statements = self.statements.saturating_add(CALL);
        let mut inner = cx.inside(callee);
        inner.called_from = Some(cx.called_from.unwrap_or(span));
        (inner.holds, inner.event) = match &cx.event {
            Some(event) => (cx.holds, Some(event.through(span, cx))),
            None => (None, None),
        };
        let values = self.claim_inputs(span, callee, values.to_vec(), cx);
        for (input, value) in callee.inputs().zip(values) {
            inner.names.push((input.name.name.clone(), value));
        }
        for declaration in callee.others() {
            inner.scope.frame = declaration.frame;
            self.declare_local(declaration, callee, &mut inner)?;
        }
        self.run_algorithms(span, callee, &mut inner)?;
        let mut outputs = Vec::new();
        for output in callee.outputs() {
            let Some(local) = inner.local(&output.name.name) else {
                let message = format!("`{}` does not set its output `{}`", callee.name(), output.name.name);
                return Err(self.error(Code::BadArguments, span, message));
            };
            outputs.push((output.name.name.clone(), local.clone()));
        }
        Ok(outputs)
    }

    /// The algorithm sections of a function.
    pub(crate) fn run_algorithms(&mut self, span: Span, callee: &Function, inner: &mut Context) -> Result<(), Fail> {
        if let Some(span) = callee.equation {
            let message = "a function cannot hold equations; its values are assigned in an `algorithm` section";
            return Err(self.error(Code::Misplaced, span, message));
        }
        // All other external functions are called in `external`.
        if callee.external.is_some() {
            return self.column(span, callee, inner);
        }
        for (frame, statements) in &callee.algorithms {
            inner.scope.frame = *frame;
            self.run(statements, inner)?;
        }
        // Declarations alone may give the outputs their values.
        if callee.algorithms.is_empty() && !callee.outputs().all(|output| output.value.is_some()) {
            let message = format!("the function `{}` has no algorithm", callee.name());
            return Err(self.error(Code::BadArguments, span, message));
        }
        Ok(())
    }

    /// The output of a function that reads a column of a file: numbers.
    fn column(&mut self, span: Span, callee: &Function, inner: &mut Context) -> Result<(), Fail> {
        let inputs: Vec<Value> = callee
            .inputs()
            .filter_map(|input| match inner.local(&input.name.name) {
                Some(Local::Value(value)) => Some(value.clone()),
                _ => None,
            })
            .collect();
        let numbers =
            self.scopes.read_column(inner.called_from.unwrap_or(span), &inputs).map_err(|_| Fail::Reported)?;
        let items = numbers.iter().map(|&number| self.literal(number, ScalarType::Real)).collect();
        if let Some(output) = callee.outputs().next() {
            inner.names.push((output.name.name.clone(), Local::array(items, vec![numbers.len()])));
        }
        Ok(())
    }
}
