//! Expressions with `homotopy` are the actual ones everywhere but in the initial system.
//!
//! The share of the actual expression is a leaf of its own; with 1 in its place an expression simplifies to what the user calls
//! actual, so that the simulation knows nothing of the simplified one and is matched and sorted without it.

use hyd_flat::Section;
use hyd_symbolic::{Node, Template, TemplateId, contains_homotopy, rewrite};
use rustc_hash::FxHashMap;

use crate::system::{EqId, EquationSystem};

/// Equations with the templates they had.
pub(crate) struct Simplified(Vec<(EqId, TemplateId)>);

/// Makes all equations actual.
pub(crate) fn take_actual(system: &mut EquationSystem) -> Simplified {
    let mut actual: FxHashMap<TemplateId, Option<TemplateId>> = FxHashMap::default();
    let mut changed = Vec::new();
    for eq in system.equations.indices() {
        let old = system.equations[eq].template;
        let templates = &mut system.flat.templates;
        let new = *actual.entry(old).or_insert_with(|| {
            let Template { left, right, arity } = templates.get(old);
            let occurs = [left, right].iter().any(|&side| contains_homotopy(&templates.arena, side));
            occurs.then(|| {
                let [left, right] = [left, right].map(|side| {
                    rewrite(&mut templates.arena, side, |arena, node| {
                        (node == Node::Homotopy).then(|| arena.constant(1.0))
                    })
                });
                templates.intern(Template { left, right, arity })
            })
        });
        if let Some(new) = new {
            system.equations[eq].template = new;
            changed.push((eq, old));
        }
    }
    Simplified(changed)
}

/// Gives the equations of the initial system their simplified forms back.
pub(crate) fn restore_simplified(system: &mut EquationSystem, simplified: Simplified) {
    for (eq, template) in simplified.0 {
        if matches!(system.section(eq), Section::Continuous | Section::Initial) {
            system.equations[eq].template = template;
        }
    }
}
