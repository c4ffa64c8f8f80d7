//! What assertions read and compare with, by name: it says what is meant, and no change touches it.
//!
//! A limit may stand in a component, where the assertion knows it by another name than the whole model does, may follow other
//! parameters, and may be asked in a condition that only then is asserted.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use hyd_syntax::tree::{
    Argument, BinaryOp, ClassBody, ClassDef, ComponentRef, Element, Equation, EquationKind, Expr, ExprKind,
    Modification, Statement, StatementKind, UnaryOp, Variability,
};
use hyd_syntax::visit::{Role, Visitor, walk_equation, walk_statement};

use super::is_named;

/// Names without subscripts, by their last parts.
#[derive(Default)]
pub(super) struct Asserted(BTreeMap<String, BTreeSet<String>>);

impl Asserted {
    /// Those of all assertions in equations and algorithms of these classes and of what is declared in them.
    pub(super) fn of(classes: &[Arc<ClassDef>]) -> Self {
        let (mut own, mut values) = (Self::default(), Vec::new());
        for class in classes {
            own.read_in(class);
            values_in(class, &mut values);
        }
        own.follow(values);
        own
    }

    /// True if an assertion may read this variable: of two names of it one ends with the other, part by part.
    pub(super) fn has(&self, name: &str) -> bool {
        let name = without_subscripts(name);
        let is_end = |long: &str, short: &str| {
            long.strip_suffix(short).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'))
        };
        let known = self.0.get(last(&name));
        known.is_some_and(|known| known.iter().any(|own| is_end(&name, own) || is_end(own, &name)))
    }

    fn insert(&mut self, name: &str) {
        let name = without_subscripts(name);
        self.0.entry(last(&name).to_string()).or_default().insert(name);
    }

    fn read_in(&mut self, class: &ClassDef) {
        struct Reads<'a>(&'a mut Asserted, bool);
        impl Visitor for Reads<'_> {
            fn reference(&mut self, reference: &ComponentRef, role: Role) {
                if self.1 && role == Role::Read {
                    self.0.insert(&hyd_syntax::print_reference(reference));
                }
            }
            fn equation(&mut self, equation: &Equation) {
                let around = self.1;
                self.1 |= matches!(&equation.kind, EquationKind::Call(name, _) if is_named(name, "assert"));
                walk_equation(self, equation);
                self.1 = around;
            }
            fn statement(&mut self, statement: &Statement) {
                let around = self.1;
                self.1 |= matches!(&statement.kind, StatementKind::Call(name, _) if is_named(name, "assert"));
                walk_statement(self, statement);
                self.1 = around;
            }
        }
        for nested in hyd_instance::class::nested_classes(class) {
            self.read_in(&nested.class);
        }
        let ClassBody::Long { equations, algorithms, .. } = &class.body else { return };
        let mut reads = Reads(self, false);
        equations.iter().flat_map(|section| &section.equations).for_each(|own| reads.equation(own));
        algorithms.iter().flat_map(|section| &section.statements).for_each(|own| reads.statement(own));
    }

    /// Adds what the values of those that are known read, until there is nothing new.
    fn follow(&mut self, mut values: Vec<(String, Vec<String>)>) {
        loop {
            let (known, others): (Vec<_>, Vec<_>) = values.into_iter().partition(|(name, _)| self.has(name));
            if known.is_empty() {
                return;
            }
            known.iter().flat_map(|(_, reads)| reads).for_each(|name| self.insert(name));
            values = others;
        }
    }
}

/// Collects the settings and conditions of a class, with the names that their values read: what another variable is computed from is not a limit.
fn values_in(class: &ClassDef, values: &mut Vec<(String, Vec<String>)>) {
    for nested in hyd_instance::class::nested_classes(class) {
        values_in(&nested.class, values);
    }
    let ClassBody::Long { elements, equations, .. } = &class.body else { return };
    for equation in equations.iter().flat_map(|section| &section.equations) {
        if let EquationKind::Equal(left, right) = &equation.kind
            && let ExprKind::Ref(of) = &left.kind
            && is_condition(right)
        {
            values.push((hyd_syntax::print_reference(of), read(right)));
        }
    }
    for element in elements {
        let Element::Component(component) = element else { continue };
        let (name, own) = (component.name.name.to_string(), &component.modification);
        let is_setting = component.variability <= Variability::Parameter;
        let binding = own.binding.as_ref().filter(|binding| is_setting || is_condition(binding));
        values.extend(binding.map(|binding| (name.clone(), read(binding))));
        modified(own, &name, values);
    }
}

/// Collects what modifiers give a value, with the names that it reads.
fn modified(modification: &Modification, owner: &str, values: &mut Vec<(String, Vec<String>)>) {
    for argument in &modification.arguments {
        let Argument::Modify(own) = argument else { continue };
        let path: Vec<&str> = own.target.parts.iter().map(|part| &*part.name).collect();
        let name = format!("{owner}.{}", path.join("."));
        values.extend(own.modification.binding.as_ref().map(|binding| (name.clone(), read(binding))));
        modified(&own.modification, &name, values);
    }
}

/// True for comparisons and what joins them.
fn is_condition(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Unary(UnaryOp::Not, _) => true,
        ExprKind::Binary(op, ..) => {
            !matches!(op, BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Pow)
        }
        _ => false,
    }
}

/// The names that an expression reads.
fn read(expr: &Expr) -> Vec<String> {
    struct Reads(Vec<String>);
    impl Visitor for Reads {
        fn reference(&mut self, reference: &ComponentRef, role: Role) {
            if role == Role::Read {
                self.0.push(hyd_syntax::print_reference(reference));
            }
        }
    }
    let mut reads = Reads(Vec::new());
    reads.expr(expr);
    reads.0
}

/// The last part of a name.
fn last(name: &str) -> &str {
    name.rsplit('.').next().unwrap_or(name)
}

/// A name without what stands in brackets.
fn without_subscripts(name: &str) -> String {
    let mut depth = 0_usize;
    let is_outside = |c: &char| {
        depth = match c {
            '[' => depth + 1,
            ']' => depth.saturating_sub(1),
            _ => depth,
        };
        depth == 0 && *c != ']'
    };
    name.chars().filter(is_outside).collect()
}

#[cfg(test)]
mod tests {
    use hyd_source::Files;

    use super::Asserted;

    fn of(text: &str) -> Asserted {
        let mut files = Files::new();
        let file = files.add("m.mo", text);
        Asserted::of(&hyd_syntax::parse(file, text).value.classes)
    }

    #[test]
    fn a_limit_is_known_by_all_its_names() {
        let own = of(
            "model W\n  parameter Real T_max = 350;\n  Real T;\nequation\n  assert(T < T_max, \"hot\");\nend W;\n\
                      model M\n  W w[2](T_max = {T_limit, 400});\n  parameter Real T_limit = 340;\n  parameter Real x_T_max = 1;\nend M;\n",
        );
        for name in ["T_max", "w[1].T_max", "m.w[2].T_max", "T_limit", "T"] {
            assert!(own.has(name), "{name}");
        }
        assert!(!own.has("x_T_max") && !own.has("max") && !own.has("w"));
    }

    #[test]
    fn what_is_computed_from_a_number_leaves_it_free() {
        let own =
            of("model M\n  parameter Real G = 5;\n  parameter Real k = 2;\n  Real T = 20/G;\n  Boolean hot = T > k;\n\
                      equation\n  assert(not hot, \"hot\");\nend M;\n");
        assert!(own.has("k") && own.has("T") && !own.has("G"));
    }
}
