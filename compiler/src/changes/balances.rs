//! Components with two connectors of one kind, whose flows no equation brings together: what goes in at one comes out at the other.

use std::collections::BTreeMap;

use hyd_syntax::tree::{ClassDef, ClassKind, ComponentRef, Equation, EquationKind, EquationSection};
use hyd_syntax::visit::{Role, Visitor, walk_equation};

use super::{Found, Rank};

impl Found<'_> {
    /// The balance `a.q + b.q = 0` that a class may lack.
    pub(super) fn balances(&mut self, class: &ClassDef, sections: &[EquationSection]) {
        let equations = || sections.iter().filter(|own| !own.initial).flat_map(|own| &own.equations);
        let Some(first) = equations().next().filter(|_| self.trouble.too_few) else { return };
        let mut pairs: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut flows: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for component in self.classes.components(class) {
            let Some(connector) = self.classes.named(&component.class) else { continue };
            if connector.kind != ClassKind::Connector || !component.dims.is_empty() || component.condition.is_some() {
                continue;
            }
            let name = connector.name.name.to_string();
            let members = self.classes.components(connector);
            let own = members.into_iter().filter(|own| own.flow && own.dims.is_empty());
            flows.insert(name.clone(), own.map(|own| own.name.name.to_string()).collect());
            pairs.entry(name).or_default().push(component.name.name.to_string());
        }
        let mut found = Vec::new();
        for (connector, ends) in pairs {
            let [a, b] = &ends[..] else { continue };
            for flow in &flows[&connector] {
                let (one, other) = (format!("{a}.{flow}"), format!("{b}.{flow}"));
                if !equations().any(|own| reads_both(own, &one, &other)) {
                    found.push(format!("{one} + {other} = 0"));
                }
            }
        }
        for text in found {
            let edit = self.edit(first.span.start, first.span.start, format!("{text};\n  "));
            self.push(Rank::Balance, format!("add the balance `{text}` to `{}`", class.name.name), vec![edit]);
        }
    }
}

/// True for an equation with both names in it, and for one that joins their connectors.
fn reads_both(equation: &Equation, one: &str, other: &str) -> bool {
    struct Names<'a>([(&'a str, bool); 2]);
    impl Visitor for Names<'_> {
        fn reference(&mut self, reference: &ComponentRef, _: Role) {
            let name = hyd_syntax::print_reference(reference);
            self.0.iter_mut().for_each(|(own, seen)| *seen |= *own == name);
        }
        fn equation(&mut self, equation: &Equation) {
            if let EquationKind::Connect(a, b) = &equation.kind {
                for end in [a, b].map(hyd_syntax::print_reference) {
                    let is_of = |own: &str| own.strip_prefix(&end).is_some_and(|rest| rest.starts_with('.'));
                    self.0.iter_mut().for_each(|(own, seen)| *seen |= is_of(own));
                }
            }
            walk_equation(self, equation);
        }
    }
    let mut names = Names([(one, false), (other, false)]);
    names.equation(equation);
    names.0.iter().all(|(_, seen)| *seen)
}
