//! Looking through syntax expressions without changing them.

use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Iterator, Name};

/// True if `test` holds for a reference (not for the names of called functions) anywhere in the expression.
pub fn any_ref(expr: &Expr, test: &mut dyn FnMut(&ComponentRef) -> bool) -> bool {
    match &expr.kind {
        ExprKind::Ref(reference) => {
            test(reference) || reference.parts.iter().flat_map(|p| &p.subscripts).any(|e| any_ref(e, test))
        }
        // Sizes are known whatever the values are.
        ExprKind::Call(function, Arguments::List { positional, .. }) if asks_for_sizes(function) => {
            positional.iter().skip(1).any(|e| any_ref(e, test))
        }
        ExprKind::Call(_, Arguments::List { positional, named }) => {
            positional.iter().any(|e| any_ref(e, test)) || named.iter().any(|(_, e)| any_ref(e, test))
        }
        ExprKind::Call(_, Arguments::Reduction(body, iterators)) | ExprKind::ArrayFor(body, iterators) => {
            any_ref(body, test) || iterators.iter().filter_map(|i| i.range.as_ref()).any(|e| any_ref(e, test))
        }
        ExprKind::Unary(_, a) | ExprKind::Field(a, _) => any_ref(a, test),
        ExprKind::Binary(_, a, b) => any_ref(a, test) || any_ref(b, test),
        ExprKind::If(branches, otherwise) => {
            branches.iter().any(|(c, v)| any_ref(c, test) || any_ref(v, test)) || any_ref(otherwise, test)
        }
        ExprKind::Range(a, step, b) => {
            any_ref(a, test) || step.as_ref().is_some_and(|s| any_ref(s, test)) || any_ref(b, test)
        }
        ExprKind::Array(items) => items.iter().any(|e| any_ref(e, test)),
        ExprKind::Matrix(rows) => rows.iter().flatten().any(|e| any_ref(e, test)),
        ExprKind::Tuple(items) => items.iter().flatten().any(|e| any_ref(e, test)),
        ExprKind::Integer(_)
        | ExprKind::Real(_)
        | ExprKind::Text(_)
        | ExprKind::Boolean(_)
        | ExprKind::Colon
        | ExprKind::End => false,
    }
}

fn asks_for_sizes(function: &ComponentRef) -> bool {
    function.parts.len() == 1 && matches!(function.parts[0].name.name.as_ref(), "size" | "ndims")
}

/// Names of all loop variables of an expression.
pub fn iterator_names(expr: &Expr) -> Vec<Name> {
    let mut names = Vec::new();
    let mut note = |iterators: &[Iterator]| names.extend(iterators.iter().map(|i| i.name.name.clone()));
    gather_iterators(expr, &mut note);
    names
}

fn gather_iterators(expr: &Expr, note: &mut dyn FnMut(&[Iterator])) {
    match &expr.kind {
        ExprKind::Call(_, Arguments::List { positional, named }) => {
            positional.iter().chain(named.iter().map(|(_, e)| e)).for_each(|e| gather_iterators(e, note));
        }
        ExprKind::Call(_, Arguments::Reduction(body, iterators)) | ExprKind::ArrayFor(body, iterators) => {
            note(iterators);
            gather_iterators(body, note);
            iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| gather_iterators(e, note));
        }
        ExprKind::Unary(_, a) => gather_iterators(a, note),
        ExprKind::Binary(_, a, b) => {
            gather_iterators(a, note);
            gather_iterators(b, note);
        }
        ExprKind::If(branches, otherwise) => {
            branches.iter().flat_map(|(c, v)| [c, v]).chain([&**otherwise]).for_each(|e| gather_iterators(e, note));
        }
        ExprKind::Array(items) => items.iter().for_each(|e| gather_iterators(e, note)),
        ExprKind::Matrix(rows) => rows.iter().flatten().for_each(|e| gather_iterators(e, note)),
        ExprKind::Tuple(items) => items.iter().flatten().for_each(|e| gather_iterators(e, note)),
        _ => {}
    }
}

/// True if a function of one of these names is called anywhere in the expression.
pub fn calls_any(expr: &Expr, names: &[&str]) -> bool {
    let inner = |e: &Expr| calls_any(e, names);
    match &expr.kind {
        ExprKind::Call(function, arguments) => {
            let own = function.parts.len() == 1 && names.contains(&function.parts[0].name.name.as_ref());
            own || match arguments {
                Arguments::List { positional, named } => {
                    positional.iter().any(inner) || named.iter().any(|(_, e)| inner(e))
                }
                Arguments::Reduction(body, _) => inner(body),
            }
        }
        ExprKind::Unary(_, a) | ExprKind::Field(a, _) => inner(a),
        ExprKind::Binary(_, a, b) => inner(a) || inner(b),
        ExprKind::If(branches, otherwise) => branches.iter().any(|(c, v)| inner(c) || inner(v)) || inner(otherwise),
        ExprKind::Array(items) => items.iter().any(inner),
        ExprKind::ArrayFor(body, _) => inner(body),
        ExprKind::Tuple(items) => items.iter().flatten().any(inner),
        ExprKind::Matrix(rows) => rows.iter().flatten().any(inner),
        _ => false,
    }
}
