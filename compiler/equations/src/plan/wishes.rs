//! Which unknowns of a loop make good iteration variables.

use hyd_flat::Target;
use hyd_index::IndexVec;
use hyd_structure::Column;

use crate::alias::representative::block_of_variable;
use crate::incidence::Unknowns;
use crate::system::EquationSystem;

/// Variables with a start value make good iteration variables, those of the translation bad ones.
pub(crate) fn wishes(system: &EquationSystem, unknowns: &Unknowns) -> IndexVec<Column, i8> {
    let blocks = block_of_variable(&system.flat);
    let wish = |target: &Target| match *target {
        Target::Var(v) => {
            let block = &system.flat.variables.raw[blocks[v] as usize];
            i8::from(block.has_start) - i8::from(block.made.is_some())
        }
        _ => 0,
    };
    IndexVec::from_vec(unknowns.targets.iter().map(wish).collect())
}
