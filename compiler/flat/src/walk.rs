//! Looking through syntax expressions without changing them.

use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Iterator, Name};
use hyd_syntax::visit::{Role, Visitor, walk_arguments, walk_expr, walk_reference};

/// True if `test` holds for a reference anywhere in the expression, apart from the names of called functions and from the loop
/// variables that the expression itself declares.
pub fn any_ref(expr: &Expr, test: &mut dyn FnMut(&ComponentRef) -> bool) -> bool {
    struct Search<'f> {
        test: &'f mut dyn FnMut(&ComponentRef) -> bool,
        own: Vec<Name>,
        found: bool,
    }
    impl Visitor for Search<'_> {
        fn reference(&mut self, reference: &ComponentRef, role: Role) {
            let own = !reference.global && self.own.contains(&reference.parts[0].name.name);
            self.found = self.found || role == Role::Read && !own && (self.test)(reference);
            walk_reference(self, reference);
        }

        fn enter(&mut self, iterators: &[Iterator]) {
            iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
            self.own.extend(iterators.iter().map(|i| i.name.name.clone()));
        }

        fn leave(&mut self, iterators: &[Iterator]) {
            self.own.truncate(self.own.len() - iterators.len());
        }

        fn expr(&mut self, expr: &Expr) {
            match &expr.kind {
                _ if self.found => {}
                // Sizes are known whatever the values are.
                ExprKind::Call(function, Arguments::List { positional, .. }) if asks_for_sizes(function) => {
                    positional.iter().skip(1).for_each(|e| self.expr(e));
                }
                _ => walk_expr(self, expr),
            }
        }
    }
    let mut search = Search { test, own: Vec::new(), found: false };
    search.expr(expr);
    search.found
}

/// True if the name stands in the expression, not hidden.
pub fn mentions(expr: &Expr, name: &Name) -> bool {
    any_ref(expr, &mut |reference| {
        !reference.global && reference.parts.len() == 1 && reference.parts[0].name.name == *name
    })
}

fn asks_for_sizes(function: &ComponentRef) -> bool {
    function.parts.len() == 1 && matches!(function.parts[0].name.name.as_ref(), "size" | "ndims")
}

/// Names of all loop variables of an expression.
pub fn iterator_names(expr: &Expr) -> Vec<Name> {
    struct Search(Vec<Name>);
    impl Visitor for Search {
        fn enter(&mut self, iterators: &[Iterator]) {
            self.0.extend(iterators.iter().map(|i| i.name.name.clone()));
            iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
        }
    }
    let mut search = Search(Vec::new());
    search.expr(expr);
    search.0
}

/// The first names of all references in the arguments of a call, called functions among them.
pub fn first_names(arguments: &Arguments) -> Vec<Name> {
    struct Search(Vec<Name>);
    impl Visitor for Search {
        fn reference(&mut self, reference: &ComponentRef, _: Role) {
            let name = &reference.parts[0].name.name;
            if !self.0.contains(name) {
                self.0.push(name.clone());
            }
            walk_reference(self, reference);
        }
    }
    let mut search = Search(Vec::new());
    walk_arguments(&mut search, arguments);
    search.0
}

/// True if a function of one of these names is called anywhere in the expression.
pub fn calls_any(expr: &Expr, names: &[&str]) -> bool {
    struct Search<'a> {
        names: &'a [&'a str],
        found: bool,
    }
    impl Visitor for Search<'_> {
        fn reference(&mut self, reference: &ComponentRef, role: Role) {
            let named = || reference.parts.len() == 1 && self.names.contains(&reference.parts[0].name.name.as_ref());
            self.found = self.found || role == Role::Called && named();
            walk_reference(self, reference);
        }
    }
    let mut search = Search { names, found: false };
    search.expr(expr);
    search.found
}
