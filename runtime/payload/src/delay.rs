//! Delay sites of a model: where source and delay time stand, and where the delayed values go.
//!
//! Sources and delay times are variables like others, computed by `assign`; delayed values and rates stand in the data
//! area.  A site with varying delay time reads `value + rate * time` there, as its equation subtracts `rate * time` again
//! and so has the right slope in the delay time.  The past itself is kept by the solver.

use crate::instance::{Instance, Point};
use crate::program::Area;
use crate::routines::Signed;

impl Instance {
    /// See [`hyd_system::Delays::delay_bounds`].
    pub(crate) fn bounds_of_delays(&mut self, out: &mut [f64]) {
        for (bound, site) in out.iter_mut().zip(&self.loaded.model.delays) {
            *bound = signed(site.most, self.memory.data[site.most.0.index as usize]);
        }
    }

    /// See [`hyd_system::Delays::delay_points`]; time has been set.
    pub(crate) fn points_of_delays(&mut self, point: Point<'_>, sources: &mut [f64], times: &mut [f64]) {
        self.run(self.loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        for (k, site) in self.loaded.model.delays.iter().enumerate() {
            sources[k] = self.signed_value(site.source, point);
            times[k] = self.signed_value(site.time, point);
        }
    }

    /// See [`hyd_system::Delays::set_delayed`].
    pub(crate) fn take_delayed(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        let layout = &self.loaded.model.area;
        let (first, first_rate) = (layout.delayed.start as usize, layout.delayed_rates.start as usize);
        for (k, site) in self.loaded.model.delays.iter().enumerate() {
            self.memory.data[first + k] = if site.varying { values[k] + rates[k] * times[k] } else { values[k] };
            self.memory.data[first_rate + k] = rates[k];
        }
    }

    /// At the start the delayed values are the sources; `assign` of the initial plan has run.
    pub(crate) fn start_delayed(&mut self, z: &[f64]) {
        let loaded = self.loaded.clone();
        let first = loaded.model.area.delayed.start as usize;
        for (k, site) in loaded.model.delays.iter().enumerate() {
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
