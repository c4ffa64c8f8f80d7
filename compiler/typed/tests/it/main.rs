//! Texts to typed equations: what names mean and what types expressions have, by subject.

mod deferred;
mod functions;
mod names;
mod types;
mod written;

use std::sync::Arc;

use hyd_instance::{ClassTable, Scope, Scopes, SourceText, Sources};
use hyd_syntax::tree::ClassBody;
use hyd_typed::{Elaborator, Equation, EquationKind, Iterator, Typing};

/// No libraries.
struct NoLibraries;

impl Sources for NoLibraries {
    fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        Ok(None)
    }
}

/// Calls `look` with the scopes of the last class of a text; `None` if there is none.
fn with_tree<T>(text: &str, look: impl FnOnce(&mut Scopes<'_>) -> T) -> Option<T> {
    let mut sources = NoLibraries;
    let mut table = ClassTable::new(&mut sources);
    let classes = table.add_main("m.hyd", text);
    let (_, mut scopes) = hyd_instance::instantiate(table, *classes.last()?, Vec::new()).ok()?;
    Some(look(&mut scopes))
}

/// The equations of the root's own sections, typed.
fn equations(scopes: &mut Scopes<'_>) -> Vec<Equation> {
    let root = scopes.instances.tree().root;
    let Some(shape) = scopes.instances[root].shape.clone() else { return Vec::new() };
    let mut typing = Typing::default();
    let mut typed = Vec::new();
    for frame in 0..shape.frames.len() as u32 {
        let def = shape.def(&scopes.table, frame).clone();
        let ClassBody::Long { equations, .. } = &def.body else { continue };
        for equation in equations.iter().flat_map(|section| &section.equations) {
            let scope = Scope { inst: root, frame };
            typed.push(Elaborator::new(scopes, &mut typing, scope, Vec::new()).equation(equation));
        }
    }
    typed
}

fn describe(equation: &Equation, scopes: &Scopes<'_>, indent: usize, lines: &mut Vec<String>) {
    let inside = |list: &[Equation], lines: &mut Vec<String>| {
        list.iter().for_each(|equation| describe(equation, scopes, indent + 2, lines));
    };
    let line = match &equation.kind {
        EquationKind::Equal(left, right) => format!("{} = {}", left.describe(scopes), right.describe(scopes)),
        EquationKind::Outputs(targets, call) => {
            let one = |e: &Option<hyd_typed::Expr>| e.as_ref().map_or(String::new(), |e| e.describe(scopes));
            let targets: Vec<String> = targets.iter().map(one).collect();
            format!("({}) = {}", targets.join(", "), call.describe(scopes))
        }
        EquationKind::Connect(a, b) => format!("connect({}, {})", a.describe(scopes), b.describe(scopes)),
        EquationKind::Overdetermined(said) => format!("{said:?}"),
        EquationKind::Fields(_) => "field by field".to_string(),
        EquationKind::For(iterators, _) => {
            let one = |i: &Iterator| i.range.describe(scopes);
            format!("for {} in {}", iterators[0].name.name, one(&iterators[0]))
        }
        EquationKind::If(_) => "if".to_string(),
        EquationKind::When(branches) => format!("when {}", branches[0].0.describe(scopes)),
        EquationKind::Assert(assertion) => format!("assert {}", assertion.condition.describe(scopes)),
        EquationKind::Terminate(text) => format!("terminate {}", text.describe(scopes)),
        EquationKind::Reinit(state, value) => {
            format!("reinit {} to {}", state.describe(scopes), value.describe(scopes))
        }
        EquationKind::Call(call) => call.describe(scopes),
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
    let typed = with_tree(text, |scopes| {
        let mut lines = Vec::new();
        for equation in equations(scopes) {
            describe(&equation, scopes, 0, &mut lines);
        }
        lines.extend(scopes.table.messages.iter().map(|said| format!("said: {}", said.message)));
        lines.join("\n")
    });
    typed.unwrap_or_else(|| "not instantiated".to_string())
}

/// The typed equations of `model M` with this body.
fn check_typed(body: &str) -> String {
    check_text(&format!("model M\n{body}\nend M;\n"))
}
