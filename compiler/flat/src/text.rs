//! Strings: they are known at translation, and texts of messages carry values of the run.
//!
//! A String has no value in an equation; a comparison of Strings is decided here and so is a condition made of it.  The text
//! of an `assert` or `terminate` is a sum of Strings, of which `String(x)` may depend on the run: its expressions become
//! rows of their own, written into the text when the message is given.

use hyd_instance::{Resolved, ScalarType, Value};
use hyd_symbolic::Relation;
use hyd_syntax::tree::{BinaryOp, Expr, ExprKind};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::lower::Typed;

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
            ExprKind::Ref(reference) => {
                if !reference.global
                    && let Some(local) = cx.local(&reference.parts[0].name.name)
                {
                    return matches!(local, Local::Value(Value::Text(_)));
                }
                let mark = self.tree.table.diagnostics.len();
                let text = match self.tree.resolve(cx.scope, reference) {
                    Ok(Resolved::Variable(steps)) => {
                        let last = &self.tree.instances[steps[steps.len() - 1].0];
                        last.primitive.as_ref().is_some_and(|p| matches!(p.scalar, ScalarType::Text))
                    }
                    _ => false,
                };
                self.tree.table.diagnostics.truncate(mark);
                text
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
}
