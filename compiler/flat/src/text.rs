//! Strings: they are known at translation, and texts of messages carry values of the run.
//!
//! A String has no value in an equation; a comparison of Strings is decided here and so is a condition made of it.  The text
//! of an `assert` or `terminate` is a sum of Strings, of which `String(x)` may depend on the run: its expressions become
//! rows of their own, written into the text when the message is given.

use hyd_instance::{Env, Resolved, ScalarType, Scope, Value};
use hyd_symbolic::{NodeId, Relation};
use hyd_syntax::tree::{Arguments, BinaryOp, Expr, ExprKind};
use hyd_system::ValueKind;

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::lower::Typed;
use crate::model::{Message, MessagePart};

impl Flattener<'_, '_> {
    /// True if the value of the expression is a String.
    pub(crate) fn is_text(&mut self, expr: &Expr, cx: &Context) -> bool {
        match &expr.kind {
            ExprKind::Text(_) => true,
            ExprKind::Binary(BinaryOp::Add, a, b) => self.is_text(a, cx) || self.is_text(b, cx),
            ExprKind::If(_, otherwise) => self.is_text(otherwise, cx),
            ExprKind::Tuple(items) => matches!(items.as_slice(), [Some(only)] if self.is_text(only, cx)),
            ExprKind::Call(function, _) => {
                function.parts.len() == 1 && function.parts[0].name.name.as_ref() == "String"
            }
            ExprKind::Field(record, name) => self.tree.is_text_field(cx.scope, record, &name.name),
            ExprKind::Ref(reference) => {
                if !reference.global
                    && let Some(local) = cx.local(&reference.parts[0].name.name)
                {
                    return matches!(local, Local::Value(Value::Text(_)));
                }
                match self.tree.quietly(|tree| tree.resolve(cx.scope, reference)) {
                    Ok(Resolved::Variable(steps)) => {
                        let last = &self.tree.instances[steps[steps.len() - 1].0];
                        last.primitive.as_ref().is_some_and(|p| matches!(p.scalar, ScalarType::Text))
                    }
                    _ => false,
                }
            }
            _ => false,
        }
    }

    /// A relation of two Strings; `None` if neither side is one.
    pub(crate) fn relate_texts(
        &mut self,
        relation: Relation,
        a: &Expr,
        b: &Expr,
        cx: &Context,
    ) -> Result<Option<Typed>, Fail> {
        if !self.is_text(a, cx) || !self.is_text(b, cx) {
            return Ok(None);
        }
        let (x, y) = (self.text_value(a, cx)?, self.text_value(b, cx)?);
        let order = x.cmp(&y);
        let holds = match relation {
            Relation::Less => order.is_lt(),
            Relation::LessEqual => order.is_le(),
            Relation::Greater => order.is_gt(),
            Relation::GreaterEqual => order.is_ge(),
            Relation::Equal => order.is_eq(),
            Relation::NotEqual => order.is_ne(),
        };
        Ok(Some(self.literal(f64::from(u8::from(holds)), ScalarType::Boolean)))
    }

    /// A String known at translation.
    pub(crate) fn text_value(&mut self, expr: &Expr, cx: &Context) -> Result<String, Fail> {
        let (env, _) = cx.env();
        Ok(match self.tree.evaluate(expr, cx.scope, &env)? {
            Value::Text(text) => text.to_string(),
            other => other.text(),
        })
    }

    /// Adds the message of an `assert` or `terminate`: its number, and the expressions whose values it shows.
    pub(crate) fn message(&mut self, text: &Expr, scope: Scope, error: bool) -> (u32, Vec<Expr>) {
        let (mut parts, mut values) = (Vec::new(), Vec::new());
        let shown = self.message_parts(text, scope, &mut parts, &mut values);
        if values.is_empty() {
            parts.clear();
        }
        let message = Message { text: shown.into(), parts, error };
        // An assertion in a loop that is run through has one text.
        let known = self.newest_message().filter(|(_, last)| values.is_empty() && **last == message);
        let number = known.map(|(number, _)| number);
        (number.unwrap_or_else(|| self.add_message(message)), values)
    }

    /// The pieces of a text; returns it as it is written.
    fn message_parts(
        &mut self,
        expr: &Expr,
        scope: Scope,
        parts: &mut Vec<MessagePart>,
        values: &mut Vec<Expr>,
    ) -> String {
        if let ExprKind::Binary(BinaryOp::Add, a, b) = &expr.kind {
            return self.message_parts(a, scope, parts, values) + &self.message_parts(b, scope, parts, values);
        }
        // A number shown stays one of the run, so that parameters can still be set.
        let number = matches!(&expr.kind, ExprKind::Call(function, _)
            if function.parts.len() == 1 && function.parts[0].name.name.as_ref() == "String");
        let known = matches!(expr.kind, ExprKind::Text(_)) || !number && self.known_before_run(expr, scope);
        let fixed = match known.then(|| self.tree.evaluate(expr, scope, &Env::default())) {
            Some(Ok(Value::Text(text))) => Some(text.to_string()),
            _ => None,
        };
        if let (None, ExprKind::Call(_, Arguments::List { positional, named })) = (&fixed, &expr.kind)
            && number
            && let Some(value) = positional.first()
            && let Ok(format) = self.tree.text_format(expr.span, positional, named, scope, &Env::default())
        {
            // Which type it is shows when the value is lowered.
            parts.push(MessagePart::Value(format, ValueKind::Real));
            values.push(value.clone());
            return self.tree.table.files.snippet(expr.span).to_string();
        }
        let text = fixed.unwrap_or_else(|| self.tree.table.files.snippet(expr.span).to_string());
        parts.push(MessagePart::Text(text.clone().into()));
        text
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
