//! Which unknowns the error test of a step looks at.
//!
//! Where constraints make a variable dependent, its derivative is an algebraic unknown.  The derivative of a solution that is within the
//! tolerance is known to the tolerance over the step only, so an error test of it asks for steps that the solution does not need, and where
//! rounding is what is left, for ever smaller ones (Brenan, Campbell, Petzold 1996, section 5.4, on variables of index 2).  This is so of the
//! highest derivatives, as of accelerations; velocities that are dependent are part of the solution and are tested.

use hyd_equations::{Resolution, Role, SortedSystem};
use hyd_flat::{Made, Target, VarId};
use rustc_hash::FxHashSet;

/// For each unknown of the simulation: it is tested.
pub(crate) fn tested(sorted: &SortedSystem) -> Vec<bool> {
    let system = &sorted.system;
    let kept = |v: VarId| match system.resolution[v] {
        Resolution::Alias { of, .. } => of,
        _ => v,
    };
    let mut derivatives: FxHashSet<VarId> = FxHashSet::default();
    // Variables that have a derivative, and orders of derivatives that have a higher one.
    let mut differentiated: FxHashSet<VarId> = FxHashSet::default();
    let mut highest: FxHashSet<(VarId, u32)> = FxHashSet::default();
    let made = || {
        system.flat.variables.iter().flat_map(|block| {
            let elements = match block.made {
                Some(Made::Derivative { of, order }) => Some((of, order)),
                _ => None,
            };
            (0..block.count).filter_map(move |k| elements.map(|own| (VarId(block.first.0 + k), own)))
        })
    };
    for (_, (of, order)) in made() {
        differentiated.insert(kept(of));
        highest.insert((of, order));
    }
    for (v, (of, order)) in made() {
        if highest.contains(&(of, order + 1)) {
            differentiated.insert(kept(v));
        } else {
            derivatives.insert(kept(v));
        }
    }
    let is_tested = |target: Target| match target {
        Target::Var(v) => system.roles[v] == Role::State || !derivatives.contains(&v) || differentiated.contains(&v),
        _ => true,
    };
    sorted.simulation.unknowns.iter().map(|unknown| unknown.differential || is_tested(unknown.target)).collect()
}
