//! Texts to typed equations: what names mean and what types expressions have, by subject.

mod deferred;
mod functions;
mod names;
mod types;
mod written;

use std::sync::Arc;

use hyd_instance::{ClassTable, InstanceTree, Scope, SourceText, Sources};
use hyd_syntax::tree::ClassBody;
use hyd_typed::{Elaborator, Equation, EquationKind, Iterator, Typing};

/// No libraries.
struct NoLibraries;

impl Sources for NoLibraries {
    fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        Ok(None)
    }
}

/// Calls `look` with the instance tree of the last class of a text; `None` if there is none.
fn with_tree<T>(text: &str, look: impl FnOnce(&mut InstanceTree<'_>) -> T) -> Option<T> {
    let mut sources = NoLibraries;
    let mut table = ClassTable::new(&mut sources);
    let classes = table.add_main("m.hyd", text);
    let mut tree = hyd_instance::instantiate(table, *classes.last()?, Vec::new()).ok()?;
    Some(look(&mut tree))
}

/// The equations of the root's own sections, typed.
fn equations(tree: &mut InstanceTree<'_>) -> Vec<Equation> {
    let root = tree.root;
    let Some(shape) = tree.instances[root].shape.clone() else { return Vec::new() };
    let mut typing = Typing::default();
    let mut typed = Vec::new();
    for frame in 0..shape.frames.len() as u32 {
        let def = shape.def(&tree.table, frame).clone();
        let ClassBody::Long { equations, .. } = &def.body else { continue };
        for equation in equations.iter().flat_map(|section| &section.equations) {
            let scope = Scope { inst: root, frame };
            typed.push(Elaborator::new(tree, &mut typing, scope, Vec::new()).equation(equation));
        }
    }
    typed
}

fn describe(equation: &Equation, tree: &InstanceTree<'_>, indent: usize, lines: &mut Vec<String>) {
    let inside = |list: &[Equation], lines: &mut Vec<String>| {
        list.iter().for_each(|equation| describe(equation, tree, indent + 2, lines));
    };
    let line = match &equation.kind {
        EquationKind::Equal(left, right) => format!("{} = {}", left.describe(tree), right.describe(tree)),
        EquationKind::Outputs(targets, call) => {
            let one = |e: &Option<hyd_typed::Expr>| e.as_ref().map_or(String::new(), |e| e.describe(tree));
            let targets: Vec<String> = targets.iter().map(one).collect();
            format!("({}) = {}", targets.join(", "), call.describe(tree))
        }
        EquationKind::Connect(a, b) => format!("connect({}, {})", a.describe(tree), b.describe(tree)),
        EquationKind::Overdetermined(said) => format!("{said:?}"),
        EquationKind::Fields(_) => "field by field".to_string(),
        EquationKind::For(iterators, _) => {
            let one = |i: &Iterator| i.range.as_ref().map_or(String::new(), |range| range.describe(tree));
            format!("for {} in {}", iterators[0].name.name, one(&iterators[0]))
        }
        EquationKind::If(_) => "if".to_string(),
        EquationKind::When(branches) => format!("when {}", branches[0].0.describe(tree)),
        EquationKind::Assert(assertion) => format!("assert {}", assertion.condition.describe(tree)),
        EquationKind::Terminate(text) => format!("terminate {}", text.describe(tree)),
        EquationKind::Reinit(state, value) => format!("reinit {} to {}", state.describe(tree), value.describe(tree)),
        EquationKind::Call(call) => call.describe(tree),
        EquationKind::Failed(said) => {
            let said: Vec<&str> = said.iter().map(|d| d.message.as_str()).collect();
            format!("<{}>", said.join("; "))
        }
    };
    lines.push(format!("{:indent$}{line}", ""));
    match &equation.kind {
        EquationKind::Fields(list) | EquationKind::For(_, list) => inside(list, lines),
        EquationKind::If(branches) => branches.iter().for_each(|(_, list)| inside(list, lines)),
        EquationKind::When(branches) => branches.iter().for_each(|(_, list)| inside(list, lines)),
        _ => {}
    }
}

/// The typed equations of the last class of a text, and what was said.
fn check_text(text: &str) -> String {
    let typed = with_tree(text, |tree| {
        let mut lines = Vec::new();
        for equation in equations(tree) {
            describe(&equation, tree, 0, &mut lines);
        }
        lines.extend(tree.table.messages.iter().map(|said| format!("said: {}", said.message)));
        lines.join("\n")
    });
    typed.unwrap_or_else(|| "not instantiated".to_string())
}

/// The typed equations of `model M` with this body.
fn check_typed(body: &str) -> String {
    check_text(&format!("model M\n{body}\nend M;\n"))
}
