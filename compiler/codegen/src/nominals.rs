//! Nominal values of variables.

use hyd_equations::SortedSystem;
use hyd_flat::Target;

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
