//! Nominal values of variables, and which states have none.

use hyd_equations::SortedSystem;
use hyd_flat::Target;
use hyd_system::LearnedSize;

/// Nominal values of variables, one where the text gives none.
pub(crate) fn nominals(sorted: &SortedSystem, targets: impl Iterator<Item = Target>) -> Vec<f64> {
    let flat = &sorted.system.flat;
    let nominal = |target: Target| match target {
        Target::Var(v) => {
            let (block, k) = flat.locate(v);
            flat.variables[block].nominal.get(k)
        }
        _ => None,
    };
    let positive = |value: &f64| value.is_finite() && *value > 0.0;
    targets.map(|target| nominal(target).map(f64::abs).filter(positive).unwrap_or(1.0)).collect()
}

/// States without a nominal value, grouped by the variables that were declared: an array is one of them, as is a variable of all
/// components of an array.
pub(crate) fn learned_sizes(sorted: &SortedSystem) -> Vec<LearnedSize> {
    let flat = &sorted.system.flat;
    let mut sizes: Vec<LearnedSize> = Vec::new();
    let mut groups = rustc_hash::FxHashMap::default();
    for (unknown, state) in (0u32..).zip(&sorted.simulation.unknowns) {
        if let (Target::Var(v), true) = (state.target, state.differential) {
            let (block, k) = flat.locate(v);
            if flat.variables[block].nominal.get(k).is_none() {
                let next = groups.len() as u32;
                sizes.push(LearnedSize { unknown, group: *groups.entry(block).or_insert(next) });
            }
        }
    }
    sizes
}
