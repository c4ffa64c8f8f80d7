//! `String(x, ...)` at translation (Modelica 3.6, section 3.7.1.1).

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Expr, Ident};
use hyd_system::{TextFormat, ValueKind};

use crate::build::InstanceTree;
use crate::evaluate::Env;
use crate::instance::Scope;
use crate::value::Value;

impl InstanceTree<'_> {
    /// The text of a value known at translation.
    pub(crate) fn evaluate_text(
        &mut self,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let format = self.text_format(span, positional, named, scope, env)?;
        let value = self.evaluate(&positional[0], scope, env)?;
        let kind = match &value {
            Value::Real(_) => ValueKind::Real,
            Value::Integer(_) => ValueKind::Integer,
            Value::Boolean(_) => ValueKind::Boolean,
            Value::Enumeration(e, _) => ValueKind::Enumeration(e.literals.clone().into()),
            Value::Text(_) => return Ok(value),
            Value::Array(_) | Value::Record(_) => {
                self.table.report(Diagnostic::error(Code::ArrayShape, "`String` takes a scalar").at(span, ""));
                return Err(Reported);
            }
        };
        Ok(Value::Text(format.text(value.as_stored().unwrap_or(0.0), &kind).into()))
    }

    /// The format that the further arguments of `String(x, ...)` ask for.
    pub fn text_format(
        &mut self,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
        scope: Scope,
        env: &Env,
    ) -> Result<TextFormat, Reported> {
        let mut format = TextFormat::default();
        if positional.is_empty() {
            self.table.report(Diagnostic::error(Code::BadArguments, "`String` takes a value").at(span, ""));
            return Err(Reported);
        }
        // By position: a format alone, or minimum length and side.
        const BY_POSITION: [&str; 2] = ["minimumLength", "leftJustified"];
        let mut given: Vec<(String, &Expr)> = Vec::new();
        for (k, expr) in positional[1..].iter().enumerate() {
            let text = matches!(expr.kind, hyd_syntax::tree::ExprKind::Text(_));
            let name = if text { "format" } else { BY_POSITION.get(k).copied().unwrap_or("") };
            given.push((name.into(), expr));
        }
        given.extend(named.iter().map(|(name, expr)| (name.name.to_string(), expr)));
        for (name, expr) in given {
            let value = self.evaluate(expr, scope, env)?;
            let number = value.as_integer().and_then(|k| u32::try_from(k).ok());
            match (name.as_str(), number, &value) {
                ("significantDigits", Some(k), _) => format.significant_digits = k,
                ("minimumLength", Some(k), _) => format.minimum_length = k,
                ("leftJustified", _, Value::Boolean(left)) => format.left_justified = *left,
                ("format", _, Value::Text(text)) => format.format = Some(text.to_string()),
                _ => {
                    let message = format!("`String` has no argument `{name}` of type {}", value.type_name());
                    self.table.report(Diagnostic::error(Code::BadArguments, message).at(expr.span, ""));
                    return Err(Reported);
                }
            }
        }
        Ok(format)
    }
}
