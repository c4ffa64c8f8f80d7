//! The equation system as text: variables with their roles, what became of the others, equations by section.
//!
//! Line-based and stable, in the user's names, for snapshots and `hyd equations`.  Long runs of equations of one template
//! are shortened.

use std::fmt;
use std::fmt::Write;

use hyd_flat::{Section, VarId};
use hyd_symbolic::NodeId;

use crate::explain::faults::equation_text;
use crate::system::{EqId, EquationSystem, OperandRange, Resolution, Role};

/// Longer runs of one template show the first two and the last.
pub(crate) const LONGEST_RUN: usize = 8;

const DIFFERENTIATED: &str = "differentiated equations";
const CHOSEN: &str = "states chosen during the run";

type Belongs = fn(Section) -> bool;

/// The system as text.
pub fn print_system(system: &EquationSystem) -> String {
    let mut text = String::new();
    list_variables(system, &mut text);
    list_reduction(system, &mut text);
    let sections: [(&str, Belongs); 12] = [
        ("bindings", |s| s == Section::Binding),
        ("starts", |s| s == Section::Start),
        ("equations", |s| s == Section::Continuous),
        (DIFFERENTIATED, |s| s == Section::Continuous),
        (CHOSEN, |s| s == Section::Selection),
        ("coefficients that decide the choice", |s| s == Section::Pivot),
        ("initial equations", |s| s == Section::Initial),
        ("discrete equations", |s| s == Section::Discrete),
        ("reinit", |s| s == Section::Reinit),
        ("assertions", |s| matches!(s, Section::Assert(_))),
        ("assertions at events", |s| matches!(s, Section::AssertOnce(_))),
        ("terminations", |s| matches!(s, Section::Terminate(_))),
    ];
    for (title, belongs) in sections {
        let derived = |eq: EqId| (system.equations[eq].order > 0) == (title == DIFFERENTIATED);
        let all = system.equations.indices();
        let rows: Vec<EqId> = all.filter(|&eq| belongs(system.section(eq)) && derived(eq)).collect();
        let template = |eq: &EqId| system.equations[*eq].template;
        let left_only = matches!(
            title,
            "assertions" | "assertions at events" | "terminations" | "coefficients that decide the choice"
        );
        section(&mut text, title, &rows, template, |&eq| match left_only {
            true => {
                let left = system.flat.templates.get(template(&eq)).left;
                expression(system, left, system.equations[eq].operands)
            }
            false if title == CHOSEN => equation_text(system, eq),
            false => equation(system, eq),
        });
    }
    text
}

impl fmt::Display for EquationSystem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&print_system(self))
    }
}

/// A title with the number of items, then one line for each, runs of equal `key` shortened.
pub(crate) fn section<T, K: PartialEq>(
    text: &mut String,
    title: &str,
    items: &[T],
    key: impl Fn(&T) -> K,
    line: impl Fn(&T) -> String,
) {
    if items.is_empty() {
        return;
    }
    let _ = writeln!(text, "{title} ({})", items.len());
    for run in items.chunk_by(|a, b| key(a) == key(b)) {
        let shown = if run.len() > LONGEST_RUN { 2 } else { run.len() };
        for item in &run[..shown] {
            let _ = writeln!(text, "  {}", line(item));
        }
        if shown < run.len() {
            let _ = writeln!(text, "  ... {} equations of the same template", run.len() - 3);
            let _ = writeln!(text, "  {}", line(&run[run.len() - 1]));
        }
    }
}

/// An expression with what its slots read.
pub(crate) fn expression(system: &EquationSystem, value: NodeId, operands: OperandRange) -> String {
    system.flat.print(value, system.operands_of(operands))
}

/// An equation with its operands after alias elimination.
pub(crate) fn equation(system: &EquationSystem, eq: EqId) -> String {
    let equation = system.equations[eq];
    let operands = system.operands_of(equation.operands);
    let template = system.flat.templates.get(equation.template);
    let (left, right) = system.flat.print_sides(&template, operands);
    format!("{left} = {right}")
}

fn list_variables(system: &EquationSystem, text: &mut String) {
    let roles = [
        ("constants", Role::Constant),
        ("parameters", Role::Parameter),
        ("states", Role::State),
        ("candidates for states", Role::Candidate),
        ("algebraic variables", Role::Algebraic),
        ("discrete variables", Role::Discrete),
    ];
    let block = crate::alias::representative::block_of_variable(&system.flat);
    let name = |v: &VarId| system.flat.var_name(*v);
    for (title, role) in roles {
        let own = |&v: &VarId| system.is_own(v) && system.roles[v] == role;
        let variables: Vec<VarId> = system.roles.indices().filter(own).collect();
        names(text, title, &variables, |v| block[*v], name);
    }
    let eliminated: Vec<VarId> = system.roles.indices().filter(|&v| !system.is_own(v)).collect();
    section(
        text,
        "eliminated",
        &eliminated,
        |v| block[*v],
        |&v| match system.resolution[v] {
            Resolution::Alias { of, negated } => {
                format!("{} = {}{}", name(&v), if negated { "-" } else { "" }, name(&of))
            }
            Resolution::Value(c) => format!("{} = {}", name(&v), system.flat.constants[c]),
            Resolution::Own => name(&v),
        },
    );
}

/// What index reduction made of former states.
fn list_reduction(system: &EquationSystem, text: &mut String) {
    let block = crate::alias::representative::block_of_variable(&system.flat);
    let name = |v: &VarId| system.flat.var_name(*v);
    names(text, "no longer states", &system.never_states(), |v| block[*v], name);
    names(text, "dummy derivatives", &system.dummies(), |v| block[*v], name);
}

/// A title and names in lines; the elements of a long array are shortened.
fn names(
    text: &mut String,
    title: &str,
    variables: &[VarId],
    block: impl Fn(&VarId) -> u32,
    name: impl Fn(&VarId) -> String,
) {
    if variables.is_empty() {
        return;
    }
    let _ = writeln!(text, "{title} ({})", variables.len());
    for run in variables.chunk_by(|a, b| block(a) == block(b)) {
        let line = match run {
            [first, .., last] if run.len() > LONGEST_RUN => format!("{} ... {}", name(first), name(last)),
            _ => run.iter().map(&name).collect::<Vec<_>>().join(", "),
        };
        let _ = writeln!(text, "  {line}");
    }
}
