//! Names of a model inside annotations: variables of curves and of what can be seen, names in texts, classes to choose from.
//!
//! What tools call their own parts (`Figure`, `Placement`, the names of arguments) is none of the model's names (Modelica 3.6,
//! section 18).

use std::sync::Arc;

use hyd_source::Span;

use super::{Collector, Place, Purpose, ReferencePart};
use crate::tree::{Argument, Arguments, ClassBody, Expr, ExprKind, Ident, Modification, Name};
use crate::visit::{Role, Visitor};

/// What annotations are made of.
const PARTS: [&str; 17] = [
    "Figure",
    "Plot",
    "Curve",
    "Axis",
    "Line",
    "Text",
    "Rectangle",
    "Ellipse",
    "Polygon",
    "Bitmap",
    "Placement",
    "transformation",
    "coordinateSystem",
    "Icon",
    "Diagram",
    "DynamicSelect",
    "OnMouseDownSetBoolean",
];
/// What a text on an icon says of the component that it is drawn for.
const OF_ICONS: [&str; 2] = ["name", "class"];

impl Collector<'_> {
    /// The names inside an annotation.
    pub(super) fn annotation(&mut self, annotation: Option<&Modification>) {
        let Some(annotation) = annotation else { return };
        let around = std::mem::replace(&mut self.in_annotation, true);
        self.arguments_of_annotation(annotation);
        self.in_annotation = around;
    }

    fn arguments_of_annotation(&mut self, annotation: &Modification) {
        for argument in &annotation.arguments {
            match argument {
                Argument::Modify(modify) => {
                    modify.modification.binding.iter().for_each(|value| self.expr(value));
                    self.arguments_of_annotation(&modify.modification);
                }
                Argument::RedeclareComponent { component, .. } => {
                    self.class_path(&component.class, false, false);
                }
                Argument::RedeclareClass { class, .. } => {
                    if let ClassBody::Short { base, .. } = &class.class.body {
                        self.class_path(base, false, false);
                    }
                }
            }
        }
    }

    /// Takes what only annotations have: their parts, and names in texts.  False for anything else.
    pub(super) fn annotated(&mut self, expr: &Expr) -> bool {
        match &expr.kind {
            ExprKind::Text(_) => {
                self.names_in_text(expr.span, false);
                true
            }
            ExprKind::Call(function, Arguments::List { positional, named }) => {
                let [part] = &function.parts[..] else { return false };
                if !PARTS.contains(&&*part.name.name) {
                    return false;
                }
                positional.iter().for_each(|value| self.expr(value));
                for (name, value) in named {
                    match (&*name.name, &value.kind) {
                        ("textString", ExprKind::Text(_)) => self.names_in_text(value.span, true),
                        _ => self.expr(value),
                    }
                }
                true
            }
            _ => false,
        }
    }

    /// `%{a.b}` in a string; on icons also `%a`.
    fn names_in_text(&mut self, span: Span, on_icon: bool) {
        let Some(raw) = self.text.get(span.start as usize..span.end as usize) else { return };
        let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let mut at = 0;
        while let Some(sign) = raw[at..].find('%').map(|found| at + found + 1) {
            let rest = &raw[sign..];
            if let Some(inside) = rest.strip_prefix('{') {
                let Some(length) = inside.find('}') else { return };
                self.dotted_name(span, sign + 1, &inside[..length]);
                at = sign + 1 + length;
            } else if rest.starts_with('%') {
                at = sign + 1;
            } else {
                let length = rest.find(|c| !is_of_name(c)).unwrap_or(rest.len());
                if on_icon && !OF_ICONS.contains(&&rest[..length]) {
                    self.dotted_name(span, sign, &rest[..length]);
                }
                at = sign + length;
            }
        }
    }

    /// A reference that stands in a string, `start` bytes behind the beginning of that; other expressions are passed over.
    fn dotted_name(&mut self, string: Span, start: usize, dotted: &str) {
        let mut parts: Vec<Ident> = Vec::new();
        let mut at = string.start as usize + start;
        for piece in dotted.split('.') {
            let name = piece.split('[').next().unwrap_or(piece);
            let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
            if !begins || !name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                return;
            }
            let span = Span::new(string.file, at, at + name.len());
            parts.push(Ident { name: Name::from(name), span });
            at += piece.len() + 1;
        }
        let parts: Arc<[Ident]> = parts.into();
        for (at, ident) in parts.iter().enumerate() {
            let part = ReferencePart { parts: parts.clone(), at, global: false, role: Role::Read, iterator: None };
            self.found.places.push(Place {
                ident: ident.clone(),
                class: self.class,
                purpose: Purpose::Reference(part),
            });
        }
    }
}
