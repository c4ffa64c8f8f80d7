//! Sets of candidates for states: where their variables stand among the unknowns.

use hyd_equations::{Selection, SortedSystem};
use hyd_flat::{Operand, Target};
use hyd_payload::CandidateSet;

use crate::layout::{Place, PlanPlaces, resolve};
use crate::program::Area;

/// The sets of a system.
///
/// # Errors
/// A sentence, when a candidate is not an unknown (a fault of an earlier stage).
pub(crate) fn candidate_sets(sorted: &SortedSystem, places: &PlanPlaces) -> Result<Vec<CandidateSet>, String> {
    let unknown = |v| {
        let (target, _) = resolve(sorted, Operand::new(Target::Var(v)));
        match places.get(target) {
            Some(Place { area: Area::Unknown, index }) => Ok(index),
            _ => Err(format!("`{}` may be a state but is not an unknown", sorted.system.flat.var_name(v))),
        }
    };
    let set = |selection: &Selection| {
        let unknowns = selection.candidates.iter().map(|candidate| unknown(candidate.variable));
        Ok(CandidateSet {
            size: selection.size,
            entries: selection.entries.clone(),
            pivots: selection.pivots.clone(),
            open: selection.open.clone(),
            candidates: selection.candidates.iter().map(|c| (c.column, c.weight)).collect(),
            first: selection.first,
            unknowns: unknowns.collect::<Result<_, String>>()?,
        })
    };
    sorted.selections.iter().map(set).collect()
}
