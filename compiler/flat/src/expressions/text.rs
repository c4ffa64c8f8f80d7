//! Strings: they are known at translation, and texts of messages carry values of the run.
//!
//! A String has no value in an equation; a comparison of Strings is decided here and so is a condition made of it.  The text
//! of an `assert` or `terminate` is a sum of Strings, of which `String(x)` may depend on the run: its expressions become
//! rows of their own, written into the text when the message is given.

use hyd_instance::{ScalarType, Value};
use hyd_symbolic::Relation;
use hyd_syntax::tree::{Arguments, BinaryOp};
use hyd_system::ValueKind;
use hyd_typed::{Expr, Kind};

use crate::model::{Message, MessagePart};
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    /// A relation of two Strings; `None` if neither side is one.
    pub(crate) fn relate_texts(
        &mut self,
        relation: Relation,
        a: &Expr,
        b: &Expr,
        cx: &Context,
    ) -> Result<Option<Typed>, Fail> {
        if !a.ty.is_text() || !b.ty.is_text() {
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
        let (env, complete) = cx.env();
        if let Kind::Failed(said, _) = &expr.kind {
            return Err(self.say(said));
        }
        if !complete && cx.has_counter_in(expr) {
            return Err(Fail::NeedsExpansion);
        }
        Ok(match self.scopes.evaluate(&expr.evaluable(), cx.scope, &env)? {
            Value::Text(text) => text.to_string(),
            other => other.text(),
        })
    }

    /// Adds the message of an `assert` or `terminate`: its number, and the expressions whose values it shows.
    ///
    /// # Errors
    /// When a String of the text differs between the turns of a loop.
    pub(crate) fn message(&mut self, text: &Expr, cx: &Context, error: bool) -> Result<(u32, Vec<Expr>), Fail> {
        let (mut parts, mut values) = (Vec::new(), Vec::new());
        let shown = self.message_parts(text, cx, &mut parts, &mut values)?;
        if values.is_empty() {
            parts.clear();
        }
        let message = Message { text: shown.into(), parts, error };
        // An assertion in a loop that is run through has one text.
        let known = self.newest_message().filter(|(_, last)| values.is_empty() && **last == message);
        let number = known.map(|(number, _)| number);
        Ok((number.unwrap_or_else(|| self.add_message(message)), values))
    }

    /// A text for people: what only the run knows stands in it as it is written.
    pub(crate) fn shown_text(&mut self, expr: &Expr, cx: &Context) -> Result<Local, Fail> {
        let text = match self.quietly(|flat| flat.text_value(expr, cx)) {
            Ok(text) => text,
            Err(Fail::Reported) => self.message_parts(expr, cx, &mut Vec::new(), &mut Vec::new())?,
            Err(fail) => return Err(fail),
        };
        Ok(Local::Value(Value::Text(text.into())))
    }

    /// The pieces of a text; returns it as it is written.
    fn message_parts(
        &mut self,
        expr: &Expr,
        cx: &Context,
        parts: &mut Vec<MessagePart>,
        values: &mut Vec<Expr>,
    ) -> Result<String, Fail> {
        if let Kind::Binary(BinaryOp::Add, a, b) = &expr.kind {
            let first = self.message_parts(a, cx, parts, values)?;
            return Ok(first + &self.message_parts(b, cx, parts, values)?);
        }
        // A number shown stays one of the run, so that parameters can still be set.
        let number = matches!(&expr.kind, Kind::Format(..));
        let known = matches!(expr.kind, Kind::Text(_)) || !number && self.known_before_run(expr);
        if known && cx.has_counter_in(expr) {
            return Err(Fail::NeedsExpansion);
        }
        let (env, _) = cx.env();
        // What has no value for all elements of an array (`getInstanceName()`) stands in a text for people as it is written.
        let evaluate =
            |flat: &mut Self| flat.scopes.quietly(|scopes| scopes.evaluate(&expr.evaluable(), cx.scope, &env));
        let fixed = match known.then(|| evaluate(self)) {
            Some(Ok(Value::Text(text))) => Some(text.to_string()),
            _ => None,
        };
        if let (None, Kind::Format(value, arguments)) = (&fixed, &expr.kind)
            && let Arguments::List { positional, named } = &**arguments
            && let Ok(format) = self.scopes.text_format(expr.span, positional, named, cx.scope, &env)
        {
            // Which type it is shows when the value is lowered.
            parts.push(MessagePart::Value(format, ValueKind::Real));
            values.push(Expr::clone(value));
            return Ok(self.scopes.table.files.snippet(expr.span).to_string());
        }
        let text = fixed.unwrap_or_else(|| self.scopes.table.files.snippet(expr.span).to_string());
        parts.push(MessagePart::Text(text.clone().into()));
        Ok(text)
    }
}
