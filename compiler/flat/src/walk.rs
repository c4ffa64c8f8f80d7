//! Looking through syntax expressions without changing them.

use hyd_instance::Builtin;
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Iterator, Name};
use hyd_syntax::visit::{Role, Visitor, walk_arguments, walk_expr, walk_reference};

/// True if `test` holds for a reference anywhere in the expression, apart from the names of called functions and from the loop
/// variables that the expression itself declares.
pub(crate) fn any_ref(expr: &Expr, test: &mut dyn FnMut(&ComponentRef) -> bool) -> bool {
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
                ExprKind::Call(function, Arguments::List { positional, .. }) if Builtin::of_sizes(function) => {
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
pub(crate) fn mentions(expr: &Expr, name: &Name) -> bool {
    any_ref(expr, &mut |reference| {
        !reference.global && reference.parts.len() == 1 && reference.parts[0].name.name == *name
    })
}

/// Names of all loop variables of an expression.
pub(crate) fn iterator_names(expr: &Expr) -> Vec<Name> {
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
pub(crate) fn first_names(arguments: &Arguments) -> Vec<Name> {
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

/// True if an operator whose value comes from the run is called anywhere in the expression.
pub(crate) fn reads_run(expr: &Expr) -> bool {
    struct Search(bool);
    impl Visitor for Search {
        fn reference(&mut self, reference: &ComponentRef, role: Role) {
            let operator = || {
                reference.parts.len() == 1
                    && Builtin::from_name(&reference.parts[0].name.name).is_some_and(Builtin::reads_run)
            };
            self.0 = self.0 || role == Role::Called && operator();
            walk_reference(self, reference);
        }
    }
    let mut search = Search(false);
    search.expr(expr);
    search.0
}
