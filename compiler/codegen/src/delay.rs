//! Delay sites of a system: where their sources and delay times stand in memory, and what messages call them.
//!
//! What an instance does with them at run time is the job of [`hyd_payload`].

use hyd_equations::SortedSystem;
use hyd_flat::{Operand, Target, VarId};
use hyd_system::{DelaySite, RootInfo};

use hyd_payload::SitePlaces;

use crate::layout::{Layout, PlanPlaces};
use crate::spans::span_of_variable;
use hyd_source::Files;

/// The places of all sites.
///
/// # Errors
/// A sentence, when a variable has no place (a fault of an earlier stage).
pub(crate) fn site_places(
    sorted: &SortedSystem,
    layout: &Layout,
    plans: [&PlanPlaces; 2],
) -> Result<Vec<SitePlaces>, String> {
    let mut sites = Vec::with_capacity(sorted.system.flat.delay_sites() as usize);
    for block in &sorted.system.flat.delays {
        for k in 0..block.count {
            let place =
                |v: VarId, plan: usize| layout.locate(sorted, plans[plan], Operand::new(Target::Var(VarId(v.0 + k))));
            sites.push(SitePlaces {
                source: place(block.source, 0)?,
                initial_source: place(block.source, 1)?,
                time: place(block.time, 0)?,
                most: place(block.most.unwrap_or(block.time), 0)?,
                varying: block.most.is_some(),
            });
        }
    }
    Ok(sites)
}

/// What the solver is told of the sites.
pub(crate) fn sites(places: &[SitePlaces]) -> Vec<DelaySite> {
    places.iter().map(|site| DelaySite { varying: site.varying }).collect()
}

/// The root functions of the sites with varying delay time, for messages.
pub(crate) fn roots(sorted: &SortedSystem, files: &Files) -> Vec<RootInfo> {
    let flat = &sorted.system.flat;
    let varying = flat.delays.iter().filter(|block| block.most.is_some());
    let root = |v: VarId| {
        let span = span_of_variable(sorted, v);
        RootInfo {
            text: format!("{} passes an event of the past", flat.var_name(v)).into(),
            file: files.name(span.file).clone(),
            line: files.location(span).line,
        }
    };
    varying.flat_map(|block| (0..block.count).map(move |k| VarId(block.value.0 + k))).map(root).collect()
}
