//! Events: finding where a relation changes ([`roots`]) and settling the system there ([`iteration`]).
//! Events that pile up end a run ([`chatter`]), and so does one that does not settle ([`cycle`]), unless they have no effect
//! ([`effect`]) or switch by rounding ([`rounding`]).
//!
//! Between events relations keep their truth values.  After each step the root functions are compared with the held values; the
//! first change within the step is located on the dense output.  At an event discrete equations run until nothing
//! changes, with the continuous part made consistent in between (Modelica language specification 3.6, section 8.6 and
//! appendix B).

pub(crate) mod chatter;
pub(crate) mod cycle;
pub(crate) mod effect;
pub(crate) mod iteration;
pub(crate) mod roots;
pub(crate) mod rounding;

use hyd_system::RootInfo;

use crate::problem::Problem;

/// The relations whose held truth differs from `before`.
pub(crate) fn held_changes(problem: &Problem<'_>, before: &[bool]) -> Vec<RootInfo> {
    let mut now = vec![false; before.len()];
    problem.system.held(&mut now);
    let changed: Vec<bool> = before.iter().zip(&now).map(|(a, b)| a != b).collect();
    relations(problem, &changed)
}

/// The marked relations by their text.
pub(crate) fn relations(problem: &Problem<'_>, marked: &[bool]) -> Vec<RootInfo> {
    let roots = &problem.system.tables().roots;
    marked.iter().zip(roots).filter(|(marked, _)| **marked).map(|(_, root)| root.clone()).collect()
}
