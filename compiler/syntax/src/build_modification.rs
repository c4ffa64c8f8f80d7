//! Modifications: `(start = 1, redeclare model A = B) = 3`, and annotations, which have the same form.
//!
//! Keeps the order of the arguments.  Whether an argument names something is decided when names are looked up.

use crate::build::Builder;
use crate::grammar::{Node, Rule};
use crate::tree::{Argument, Constraint, ElementModification, Modification, NestedClass};

/// The words before an argument.
#[derive(Clone, Copy, Default)]
struct ArgumentPrefixes {
    each: bool,
    is_final: bool,
    redeclare: bool,
    replaceable: bool,
}

impl ArgumentPrefixes {
    fn add(&mut self, word: &str) {
        match word {
            "each" => self.each = true,
            "final" => self.is_final = true,
            "redeclare" => self.redeclare = true,
            _ => self.replaceable = true,
        }
    }
}

impl<'t> Builder<'t> {
    /// A `modification` node.
    pub(crate) fn modification(&mut self, node: Node<'t>) -> Modification {
        let mut modification = Modification { span: Some(self.span(&node)), ..Modification::default() };
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::class_modification => modification.arguments = self.class_arguments(part),
                Rule::expression => modification.binding = Some(self.expression(part)),
                _ => {}
            }
        }
        modification
    }

    /// A `class_modification` node: `(arguments)`.
    pub(crate) fn class_modification(&mut self, node: Node<'t>) -> Modification {
        let span = Some(self.span(&node));
        Modification { arguments: self.class_arguments(node), binding: None, span }
    }

    /// An `annotation` node.
    pub(crate) fn annotation(&mut self, node: Node<'t>) -> Modification {
        let inner = node.into_inner().find(|n| n.as_rule() == Rule::class_modification);
        self.annotations += 1;
        let annotation = inner.map_or_else(Modification::default, |n| self.class_modification(n));
        self.annotations -= 1;
        annotation
    }

    fn class_arguments(&mut self, node: Node<'t>) -> Vec<Argument> {
        let mut arguments = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::element_modification => arguments.push(Argument::Modify(self.element_modification(part))),
                Rule::redeclaration => arguments.extend(self.redeclaration(part)),
                Rule::break_argument => {
                    let span = self.span(&part);
                    self.outside_profile(
                        span,
                        "leaving out inherited elements (`break`) is outside the language profile",
                    );
                }
                _ => {}
            }
        }
        arguments
    }

    fn element_modification(&mut self, node: Node<'t>) -> ElementModification {
        let span = self.span(&node);
        let mut prefixes = ArgumentPrefixes::default();
        let mut modification = Modification::default();
        let mut target = crate::tree::Path { global: false, parts: Vec::new(), span };
        let mut description = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::plain_prefix => prefixes.add(part.as_str()),
                Rule::path => target = self.path(part),
                Rule::modification => modification = self.modification(part),
                Rule::description => description = self.description(part),
                _ => {}
            }
        }
        ElementModification {
            each: prefixes.each,
            is_final: prefixes.is_final,
            target,
            modification,
            description,
            span,
        }
    }

    fn redeclaration(&mut self, node: Node<'t>) -> Option<Argument> {
        let span = self.span(&node);
        let mut words = ArgumentPrefixes::default();
        let mut prefixes = crate::build_element::Prefixes::default();
        let mut head = None;
        let mut class = None;
        let mut component = None;
        let mut constraint = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::mod_prefix => words.add(part.as_str()),
                Rule::element_prefix => self.add_prefix(&mut prefixes, &part),
                Rule::class_head => head = Some(self.class_head(part)),
                Rule::short_class => {
                    let head = head.take().unwrap_or_default();
                    class = Some(self.short_class(head, part, span));
                }
                Rule::redeclared_component => component = Some(part),
                Rule::constraining => constraint = self.constraint(part),
                _ => {}
            }
        }
        prefixes.element.redeclare |= words.redeclare;
        prefixes.element.replaceable |= words.replaceable;
        prefixes.element.is_final |= words.is_final;
        if let Some(class) = class {
            let class = NestedClass { prefixes: prefixes.element, class, constrained_by: constraint };
            return Some(Argument::RedeclareClass {
                each: words.each,
                redeclare: words.redeclare,
                class: Box::new(class),
            });
        }
        let component = self.components(component?, &prefixes, constraint, span.start).pop()?;
        Some(Argument::RedeclareComponent {
            each: words.each,
            redeclare: words.redeclare,
            component: Box::new(component),
        })
    }

    /// A `constraining` node.
    pub(crate) fn constraint(&mut self, node: Node<'t>) -> Option<Constraint> {
        let mut base = None;
        let mut modification = Modification::default();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::path => base = Some(self.path(part)),
                Rule::class_modification => modification = self.class_modification(part),
                _ => {}
            }
        }
        base.map(|base| Constraint { base, modification })
    }
}
