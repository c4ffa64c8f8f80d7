//! Classes that a file declares, and the numbers that they give their parameters, which modifiers change.

use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_syntax::tree::{
    Argument, BinaryOp, ClassBody, ClassDef, Component, Element, Expr, ExprKind, Modification, Path, UnaryOp,
};

/// Classes by their own names; of several of one name the first.
#[derive(Default)]
pub(super) struct Classes(BTreeMap<String, Arc<ClassDef>>);

impl Classes {
    /// Those of a file, with what is declared in them.
    pub(super) fn of(classes: &[Arc<ClassDef>]) -> Self {
        let mut own = Self::default();
        classes.iter().for_each(|class| own.add(class));
        own
    }

    fn add(&mut self, class: &Arc<ClassDef>) {
        self.0.entry(class.name.name.to_string()).or_insert_with(|| class.clone());
        hyd_instance::class::nested_classes(class).for_each(|nested| self.add(&nested.class));
    }

    /// The class that a path means, by its last part.
    pub(super) fn named(&self, path: &Path) -> Option<&Arc<ClassDef>> {
        self.0.get(&*path.parts.last()?.name)
    }

    /// The components of a class, those of its base classes in the file among them.
    pub(super) fn components<'a>(&'a self, class: &'a ClassDef) -> Vec<&'a Component> {
        let mut found = Vec::new();
        let (mut around, mut at) = (vec![class], 0);
        while let Some(class) = around.get(at).copied() {
            at += 1;
            let ClassBody::Long { elements, .. } = &class.body else { continue };
            for element in elements {
                match element {
                    Element::Component(component) => found.push(component),
                    Element::Extends(extends) => {
                        let base = self.named(&extends.base).map(|base| &**base);
                        around.extend(base.filter(|base| around.iter().all(|own| !std::ptr::eq(*own, *base))));
                    }
                    _ => {}
                }
            }
        }
        found
    }

    /// For each number that a modifier gives a parameter, by where it begins: the number that the class gives it.
    pub(super) fn defaults(&self) -> BTreeMap<u32, f64> {
        let mut found = BTreeMap::new();
        for class in self.0.values() {
            let ClassBody::Long { elements, .. } = &class.body else { continue };
            for element in elements {
                if let Element::Component(component) = element
                    && let Some(class) = self.named(&component.class)
                {
                    self.defaults_in(&component.modification, class, &mut found);
                }
            }
        }
        found
    }

    fn defaults_in(&self, modification: &Modification, class: &ClassDef, found: &mut BTreeMap<u32, f64>) {
        for argument in &modification.arguments {
            let Argument::Modify(own) = argument else { continue };
            let [name] = &own.target.parts[..] else { continue };
            let components = self.components(class);
            let Some(declared) = components.into_iter().find(|own| *own.name.name == *name.name) else { continue };
            if let (Some(given), Some(default)) =
                (&own.modification.binding, declared.modification.binding.as_ref().and_then(literal))
            {
                found.insert(given.span.start, default);
            }
            if let Some(class) = self.named(&declared.class) {
                self.defaults_in(&own.modification, class, found);
            }
        }
    }
}

/// The value of numbers and of arithmetic with numbers.
pub(super) fn literal(expr: &Expr) -> Option<f64> {
    match &expr.kind {
        ExprKind::Integer(value) => Some(*value as f64),
        ExprKind::Real(value) => Some(*value),
        ExprKind::Unary(UnaryOp::Minus, of) => literal(of).map(|value| -value),
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (literal(a)?, literal(b)?);
            match op {
                BinaryOp::Add => Some(a + b),
                BinaryOp::Sub => Some(a - b),
                BinaryOp::Mul => Some(a * b),
                BinaryOp::Div => Some(a / b),
                _ => None,
            }
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use hyd_source::Files;

    use super::Classes;

    #[test]
    fn numbers_of_modifiers_have_those_of_their_classes() {
        let text = "model B\n  parameter Real q = 20/60000;\nend B;\nmodel P\n  extends B;\n  parameter Real r = -2;\nend P;\n\
                    model M\n  P p(q = 12/1000, r = 5);\n  N n(p(r = 7), x = 3);\nend M;\nmodel N\n  P p;\n  parameter Real x;\nend N;\n";
        let mut files = Files::new();
        let file = files.add("m.mo", text);
        let found = Classes::of(&hyd_syntax::parse(file, text).value.classes).defaults();
        let at = |what: &str| found.get(&(text.find(what).expect("it is there") as u32)).copied();
        assert_eq!(
            [at("12/1000"), at("5)"), at("7)"), at("3);")],
            [Some(20.0 / 60000.0), Some(-2.0), Some(-2.0), None]
        );
    }
}
