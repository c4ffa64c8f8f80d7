//! What a model has, counted: variables, equations, and what became of them.

use hyd_compiler::{Compilation, FlatModel};
use hyd_flat::{EquationBlock, Section};
use hyd_system::Variability;

/// What there is of each kind, as far as the translation came.
pub fn counts(compilation: &Compilation) -> Vec<(&'static str, usize)> {
    let mut counts = Vec::new();
    if let Some(flat) = &compilation.flat {
        let scalars = |chosen: &dyn Fn(Variability) -> bool| -> usize {
            flat.variables.raw.iter().filter(|b| chosen(b.variability)).map(|b| b.count as usize).sum()
        };
        counts.extend([
            ("parameters and constants", scalars(&|v| v <= Variability::Parameter)),
            ("continuous variables", scalars(&|v| v == Variability::Continuous)),
            ("discrete variables", scalars(&|v| v == Variability::Discrete)),
            ("continuous equations", flat.count(Section::Continuous)),
            ("discrete equations", flat.count(Section::Discrete)),
            ("initial equations", flat.count(Section::Initial)),
            ("equation templates", flat.templates.len()),
            ("variables of unknown unit", compilation.undecided_units.iter().map(|(_, count)| count).sum()),
        ]);
    }
    if let Some(sorted) = &compilation.sorted {
        let plan = &sorted.simulation;
        let states = plan.unknowns.iter().filter(|unknown| unknown.differential).count();
        counts.extend([
            ("states", states),
            ("iteration variables", plan.unknowns.len() - states),
            ("explicit assignments", plan.assignments.len()),
            ("initial unknowns", sorted.initial.unknowns.len()),
            ("event relations", sorted.relations.len()),
        ]);
    }
    counts
}

/// How many equations a component brings: those of connections, and of connectors left open, are not its own.
pub fn own_equations(compilation: &Compilation) -> usize {
    let own = |flat: &FlatModel| {
        let is_own = |block: &&EquationBlock| block.section == Section::Continuous && !flat.is_connection(block);
        flat.equations.iter().filter(is_own).map(|block| block.count as usize).sum()
    };
    compilation.flat.as_deref().map_or(0, own)
}
