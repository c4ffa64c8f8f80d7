//! Assignments in levels: those of one level do not read each other.

use crate::sorted::Assignment;

/// Sorts by level, then by expression, so that equal expressions are neighbours; returns where each entry went.
pub(crate) fn order_by_level(assignments: &mut Vec<Assignment>) -> Vec<u32> {
    let mut order: Vec<u32> = (0..assignments.len() as u32).collect();
    let key = |&k: &u32| (assignments[k as usize].level, assignments[k as usize].value);
    if !order.is_sorted_by_key(key) {
        order.sort_by_key(key);
    }
    let mut position = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        position[old as usize] = new as u32;
    }
    *assignments = order.iter().map(|&old| assignments[old as usize]).collect();
    position
}
