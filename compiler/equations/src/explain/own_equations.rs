//! The equation that each unknown has of its own, as people write models: the one that holds its rate, or `x = ...`.
//!
//! Where numbers differ, any of many unknowns may be the one that lacks an equation, and any of many equations the one too many. Who writes a
//! model by hand gives every unknown an equation; an unknown without one was forgotten, and an equation that belongs to none was added.

use hyd_flat::{Target, VarId};
use hyd_source::Diagnostic;
use hyd_symbolic::Node;
use rustc_hash::FxHashSet;

use crate::explain::faults::{
    is_made, is_of_translation, list_names, mark_equations, mark_variables, variable_of, written_text,
};
use crate::incidence::{Pattern, Unknowns};
use crate::system::{EqId, EquationSystem};

/// Most unknowns or equations that are named: of more, the model is not written in this way.
const MOST: usize = 3;

/// Unknowns without an equation of their own, or equations that belong to none.
pub(crate) enum Odd {
    /// The unknowns, where equations are missing.
    Unknowns(Vec<VarId>),
    /// The equations, where there are too many.
    Equations(Vec<EqId>),
}

/// Who is left over of what the model itself declares and says, where its other unknowns have one equation each; none where that is not so. Components are
/// counted by themselves.
pub(crate) fn odd_ones(system: &EquationSystem, pattern: &Pattern, unknowns: &Unknowns) -> Option<Odd> {
    // What the translation made for itself, in pairs, nobody has written.
    let written: Vec<EqId> = pattern.rows.iter().copied().filter(|&eq| !is_made(system, eq)).collect();
    let variables = unknowns.targets.iter().filter_map(|&target| variable_of(target));
    let wanted: FxHashSet<VarId> = variables.filter(|&v| !is_of_translation(system, v)).collect();
    let (rows, columns) = (written.len(), wanted.len());
    if rows + unknowns.targets.len() != columns + pattern.rows.len() {
        return None;
    }
    let mut owned: FxHashSet<VarId> = FxHashSet::default();
    let mut of_nobody = Vec::new();
    for eq in written {
        let is_first = owner(system, eq).filter(|v| wanted.contains(v)).is_some_and(|v| owned.insert(v));
        if !is_first {
            of_nobody.push(eq);
        }
        if of_nobody.len() > MOST {
            return None;
        }
    }
    if rows < columns && of_nobody.is_empty() && columns - rows <= MOST {
        let mut left: Vec<VarId> = wanted.into_iter().filter(|v| !owned.contains(v)).collect();
        left.sort_unstable();
        let is_own = |v: &VarId| system.flat.variables[system.flat.locate(*v).0].origin.path.is_empty();
        return left.iter().all(is_own).then_some(Odd::Unknowns(left));
    }
    let is_own = |eq: &EqId| {
        let block = &system.flat.equations[system.equations[*eq].block as usize];
        block.origin.path.is_empty() && !system.flat.is_connection(block)
    };
    let is_all = rows > columns && owned.len() == columns && of_nobody.iter().all(is_own);
    is_all.then_some(Odd::Equations(of_nobody))
}

/// The unknown that an equation is for: the one whose rate alone occurs in it, or else the one that stands alone on its left side.
fn owner(system: &EquationSystem, eq: EqId) -> Option<VarId> {
    let equation = system.equations[eq];
    let operands = system.operands_of(equation.operands);
    let mut rates = operands.iter().filter_map(|operand| match operand.target() {
        Target::Der(v) => Some(v),
        _ => None,
    });
    if let Some(first) = rates.next() {
        return rates.all(|other| other == first).then_some(first);
    }
    let template = system.flat.templates.get(equation.template);
    match system.flat.templates.arena.node(template.left) {
        Node::Slot(slot) => variable_of(operands[slot.0 as usize].target()),
        _ => None,
    }
}

/// The sentence on them.
pub(crate) fn sentence(system: &EquationSystem, pattern: &Pattern, odd: &Odd) -> String {
    match odd {
        Odd::Unknowns(left) => {
            let names = list_names(left.iter().map(|&v| system.flat.var_name(v)));
            match &left[..] {
                [v] => {
                    let reads = readers(system, pattern, *v);
                    let texts = list_names(reads.iter().map(|&eq| written_text(system, eq)));
                    let only = match reads.len() {
                        0 => "it occurs in none".to_string(),
                        _ => format!("it only occurs in {texts}"),
                    };
                    format!("{names} has no equation of its own: {only}")
                }
                _ => format!("{names} have no equations of their own"),
            }
        }
        Odd::Equations(left) => {
            if let [one] = left[..]
                && let Some((v, first)) = twin(system, pattern, one)
            {
                let (name, one, other) =
                    (system.flat.var_name(v), written_text(system, first), written_text(system, one));
                return format!("`{name}` has two equations, `{one}` and `{other}`: one of them is too many");
            }
            let texts = list_names(left.iter().map(|&eq| written_text(system, eq)));
            let (is, are) = if left.len() == 1 { ("is", "one equation") } else { ("are", "equations") };
            format!("{texts} {is} {are} too many: every unknown already has an equation of its own")
        }
    }
}

/// Marks them in the text.
pub(crate) fn mark(diagnostic: Diagnostic, system: &EquationSystem, pattern: &Pattern, odd: &Odd) -> Diagnostic {
    match odd {
        Odd::Unknowns(left) => {
            let reads: Vec<EqId> = left.iter().flat_map(|&v| readers(system, pattern, v)).collect();
            mark_variables(mark_equations(diagnostic, system, &reads), system, left)
        }
        Odd::Equations(left) => {
            let twins = left.iter().filter_map(|&eq| Some(twin(system, pattern, eq)?.1));
            let all: Vec<EqId> = twins.chain(left.iter().copied()).collect();
            mark_equations(diagnostic, system, &all)
        }
    }
}

/// The unknown that an equation is for, and the first equation that is for it, too.
fn twin(system: &EquationSystem, pattern: &Pattern, eq: EqId) -> Option<(VarId, EqId)> {
    let v = owner(system, eq).filter(|&v| !is_of_translation(system, v))?;
    let is_twin = |&other: &EqId| other != eq && !is_made(system, other) && owner(system, other) == Some(v);
    let first = pattern.rows.iter().copied().find(is_twin)?;
    Some((v, first))
}

/// The equations in which an unknown occurs.
fn readers(system: &EquationSystem, pattern: &Pattern, v: VarId) -> Vec<EqId> {
    let reads = |eq: &&EqId| {
        let operands = system.operands_of(system.equations[**eq].operands);
        operands.iter().any(|operand| variable_of(operand.target()) == Some(v))
    };
    pattern.rows.iter().filter(reads).copied().collect()
}
