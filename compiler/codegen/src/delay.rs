//! Delay sites of a compiled model: where source and delay time stand, and where the delayed values go.
//!
//! Sources and delay times are variables like others, computed by `assign`; delayed values and rates stand in the data
//! area.  A site with varying delay time reads `value + rate * time` there, as its equation subtracts `rate * time` again
//! and so has the right slope in the delay time.  The past itself is kept by the solver.

use hyd_equations::SortedSystem;
use hyd_flat::{Operand, Target, VarId};
use hyd_system::{DelaySite, RootInfo};

use crate::layout::{Layout, Place, PlanPlaces};
use crate::program::Area;
use crate::system::{CompiledSystem, Point};
use crate::tables::span_of_variable;
use hyd_source::Files;

/// A place, negated or not.
pub(crate) type Signed = (Place, bool);

/// Where the values of one site stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SitePlaces {
    /// What is delayed, in the simulation.
    pub(crate) source: Signed,
    /// The same in the initial system.
    pub(crate) initial_source: Signed,
    /// The delay time.
    pub(crate) time: Signed,
    /// Its upper bound.
    most: Signed,
    /// The delay time varies.
    pub(crate) varying: bool,
}

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

impl CompiledSystem {
    /// See [`hyd_system::DaeSystem::delay_bounds`].
    pub(crate) fn bounds_of_delays(&mut self, out: &mut [f64]) {
        for (bound, site) in out.iter_mut().zip(&self.shared.delays) {
            *bound = signed(site.most, self.memory.data[site.most.0.index as usize]);
        }
    }

    /// See [`hyd_system::DaeSystem::delay_points`]; time has been set.
    pub(crate) fn points_of_delays(&mut self, point: Point<'_>, sources: &mut [f64], times: &mut [f64]) {
        self.run(self.shared.lowered.simulation.assign, point, &mut [], &mut []);
        for (k, site) in self.shared.delays.iter().enumerate() {
            sources[k] = self.signed_value(site.source, point);
            times[k] = self.signed_value(site.time, point);
        }
    }

    /// See [`hyd_system::DaeSystem::set_delayed`].
    pub(crate) fn take_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        let layout = &self.shared.lowered.layout;
        let (first, first_rate) = (layout.delayed.start as usize, layout.delayed_rates.start as usize);
        for (k, site) in self.shared.delays.iter().enumerate() {
            self.memory.data[first + k] = if site.varying { values[k] + rates[k] * times[k] } else { values[k] };
            self.memory.data[first_rate + k] = rates[k];
        }
    }

    /// At the start the delayed values are the sources; `assign` of the initial plan has run.
    pub(crate) fn start_delayed(&mut self, z: &[f64]) {
        let shared = self.shared.clone();
        let first = shared.lowered.layout.delayed.start as usize;
        for (k, site) in shared.delays.iter().enumerate() {
            self.memory.data[first + k] = self.signed_value(site.initial_source, Point { unknown: z, rate: &[] });
        }
    }

    fn signed_value(&self, place: Signed, point: Point<'_>) -> f64 {
        let index = place.0.index as usize;
        let value = match place.0.area {
            Area::Data => self.memory.data[index],
            Area::Unknown => point.unknown[index],
            Area::Rate => point.rate[index],
            Area::Work => self.memory.work[index],
            Area::Out | Area::Out2 => 0.0,
        };
        signed(place, value)
    }
}

fn signed(place: Signed, value: f64) -> f64 {
    if place.1 { -value } else { value }
}
