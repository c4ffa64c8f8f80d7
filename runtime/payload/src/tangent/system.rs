//! The contract of tangents: primal values, partial derivatives, chain rule.

use hyd_system::{Along, Direction, DirectionError, EventPhase, Tangents};

use super::memory::TangentMemory;
use super::model::Part;
use crate::instance::{Instance, Point};
use crate::program::Area;

/// Rounds after which discrete equations that feed back through assigned variables are taken as they are.
const ROUNDS: usize = 16;

impl Instance {
    fn take_tangents(&mut self) -> Box<TangentMemory> {
        self.tangents.take().expect("invariant: directions are set before tangents are asked for")
    }

    /// Coefficients of a stage at the values in memory.
    pub(super) fn partials(&mut self, tangents: &mut TangentMemory, part: Part, point: Point<'_>) {
        let code = tangents.code.clone();
        let routine = code.model.stage(part).partials;
        let TangentMemory { coefficients, registers, .. } = tangents;
        self.run_on((&code.engine, routine, registers), point, &mut coefficients[part as usize], &mut []);
    }

    /// Assigned variables and their partial derivatives.
    pub(super) fn assign_partials(&mut self, tangents: &mut TangentMemory, point: Point<'_>) {
        self.run(self.loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        self.partials(tangents, Part::Assign, point);
    }

    /// Tangents of the discrete equations, which may feed back through assigned variables; true if one changed.
    fn settle_tangents(&mut self, tangents: &mut TangentMemory, point: Point<'_>) -> bool {
        let loaded = self.loaded.clone();
        let first = loaded.model.area.discrete.start;
        let mut before = std::mem::take(&mut tangents.before);
        let mut last = std::mem::take(&mut tangents.last);
        tangents.get(first, &mut before);
        self.partials(tangents, Part::Discrete, point);
        for _ in 0..ROUNDS {
            tangents.get(first, &mut last);
            tangents.chain(Part::Assign, |rows| &rows.assign, false);
            tangents.chain(Part::Discrete, |rows| &rows.discrete, false);
            let start = first as usize * tangents.width;
            if tangents.blocks[start..start + last.len()] == last[..] {
                break;
            }
        }
        let changed = before != last;
        (tangents.before, tangents.last) = (before, last);
        changed
    }

    /// Tangents of `reinit` into `dy` where it fired.
    fn reinit_tangents(&mut self, tangents: &mut TangentMemory, point: Point<'_>, dy: &mut [f64]) {
        let loaded = self.loaded.clone();
        let unknowns = &loaded.model.routines.events.reinit_unknowns;
        if unknowns.is_empty() {
            return;
        }
        self.run_own(loaded.model.routines.events.reinits, point);
        self.partials(tangents, Part::Reinits, point);
        tangents.chain(Part::Reinits, |rows| &rows.reinits, false);
        let width = tangents.width;
        let out = tangents.spaces().start(Area::Out, false) as usize * width;
        for (k, &unknown) in unknowns.iter().enumerate() {
            let unknown = unknown as usize;
            let result = &tangents.blocks[out + k * width..out + (k + 1) * width];
            let kept = unknown * width..(unknown + 1) * width;
            // As with the values: a `reinit` that did not fire returns the state itself.
            let fired = self.results()[k].to_bits() != point.unknown[unknown].to_bits();
            let own = tangents.spaces().start(Area::Unknown, false) as usize * width + kept.start;
            if fired || *result != tangents.blocks[own..own + width] {
                dy[kept].copy_from_slice(result);
            }
        }
    }
}

impl Tangents for Instance {
    fn set_directions(&mut self, directions: &[Direction]) -> Result<(), (usize, DirectionError)> {
        // Run after run with the same directions uses the same memory.
        if self.tangents.as_ref().is_some_and(|tangents| tangents.directions == directions) {
            return Ok(());
        }
        self.tangents = Some(Box::new(TangentMemory::new(&self.loaded, directions)?));
        Ok(())
    }

    fn bind_tangent(&mut self, t0: f64) {
        let mut tangents = self.take_tangents();
        self.set_time(t0, true);
        tangents.blocks.fill(0.0);
        tangents.forget_inputs();
        tangents.sweep.outdated = true;
        for k in 0..tangents.seeds.len() {
            let (block, direction) = tangents.seeds[k];
            tangents.blocks[block as usize * tangents.width + direction as usize] = 1.0;
        }
        self.partials(&mut tangents, Part::Bind, Point { unknown: &[], rate: &[] });
        tangents.chain(Part::Bind, |rows| &rows.bind, true);
        let loaded = self.loaded.clone();
        let area = &loaded.model.area;
        for (k, start) in area.discrete_starts.iter().enumerate() {
            if let Some(start) = *start {
                tangents.copy(start, area.discrete.start + k as u32);
                tangents.copy(start, area.pre.start + k as u32);
            }
        }
        self.tangents = Some(tangents);
    }

    fn set_input_tangents(&mut self, values: &[f64]) {
        if let Some(tangents) = &mut self.tangents {
            tangents.give_inputs(values);
        }
    }

    fn initial_residual_tangent(&mut self, t0: f64, z: &[f64], out: &mut [f64]) {
        let mut tangents = self.take_tangents();
        self.set_time(t0, true);
        let point = Point { unknown: z, rate: &[] };
        self.run(self.loaded.model.routines.initial.assign, point, &mut [], &mut []);
        self.partials(&mut tangents, Part::InitialAssign, point);
        self.partials(&mut tangents, Part::InitialResidual, point);
        let first = tangents.spaces().start(Area::Unknown, true) as usize * tangents.width;
        tangents.blocks[first..first + out.len()].fill(0.0);
        tangents.load_inputs(self.loaded.model.area.inputs.start);
        tangents.chain(Part::InitialAssign, |rows| &rows.initial_assign, false);
        tangents.chain(Part::InitialResidual, |rows| &rows.initial_residual, false);
        tangents.get(tangents.spaces().start(Area::Out, true), out);
        self.tangents = Some(tangents);
    }

    fn initial_store_tangent(&mut self, t0: f64, z: &[f64], dz: &[f64], dy: &mut [f64], dyp: &mut [f64]) {
        let mut tangents = self.take_tangents();
        tangents.sweep.outdated = true;
        self.set_time(t0, true);
        let point = Point { unknown: z, rate: &[] };
        self.run(self.loaded.model.routines.initial.assign, point, &mut [], &mut []);
        self.partials(&mut tangents, Part::InitialAssign, point);
        tangents.put(tangents.spaces().start(Area::Unknown, true), dz);
        tangents.load_inputs(self.loaded.model.area.inputs.start);
        tangents.chain(Part::InitialAssign, |rows| &rows.initial_assign, false);
        let loaded = self.loaded.clone();
        let width = tangents.width;
        let places = [(&loaded.model.initial.states, dy), (&loaded.model.initial.rates, dyp)];
        for (list, out) in places {
            for (place, out) in list.iter().zip(out.chunks_exact_mut(width)) {
                match place {
                    Some(place) => tangents.get(tangents.block(*place, true), out),
                    None => out.fill(0.0),
                }
            }
        }
        for &(from, to) in &loaded.model.initial.values {
            tangents.copy(tangents.block(from, true), to);
        }
        // At the start the delayed values are the sources.
        let mut source = vec![0.0; width];
        for (site, to) in loaded.model.delays.iter().zip(loaded.model.area.delayed.clone()) {
            tangents.signed(site.initial_source, true, &mut source);
            tangents.put(to, &source);
        }
        self.tangents = Some(tangents);
    }

    fn residual_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        let point = Point { unknown: y, rate: yp };
        self.assign_partials(&mut tangents, point);
        self.partials(&mut tangents, Part::Residual, point);
        tangents.load(along, self);
        tangents.chain(Part::Assign, |rows| &rows.for_residual, false);
        tangents.chain(Part::Residual, |rows| &rows.residual, false);
        tangents.get(tangents.spaces().start(Area::Out, false), out);
        self.tangents = Some(tangents);
    }

    fn jacobian_tangent(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        jacobians: (&mut [f64], &mut [f64]),
        out: &mut [f64],
    ) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        self.sweep(&mut tangents, Point { unknown: y, rate: yp }, jacobians, out);
        self.tangents = Some(tangents);
    }

    fn branches(&mut self) -> usize {
        self.tangents.as_ref().map_or(0, |tangents| tangents.sweep.branches.len())
    }

    fn branch_values(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        self.branch_arguments(&mut tangents, Point { unknown: y, rate: yp }, out);
        self.tangents = Some(tangents);
    }

    fn roots_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        let point = Point { unknown: y, rate: yp };
        self.assign_partials(&mut tangents, point);
        self.partials(&mut tangents, Part::Roots, point);
        tangents.load(along, self);
        tangents.chain(Part::Assign, |rows| &rows.for_roots, false);
        tangents.chain(Part::Roots, |rows| &rows.roots, false);
        tangents.get(tangents.spaces().start(Area::Out, false), out);
        self.tangents = Some(tangents);
    }

    fn instant_tangent(&mut self, t: f64, out: &mut [f64]) -> bool {
        let loaded = self.loaded.clone();
        let events = &loaded.model.routines.events;
        if events.timed.is_empty() {
            return false;
        }
        self.set_time(t, false);
        let nothing = Point { unknown: &[], rate: &[] };
        self.run_own(events.instants, nothing);
        let Some(k) = self.changes_at(t) else { return false };
        let mut tangents = self.take_tangents();
        self.partials(&mut tangents, Part::Instants, nothing);
        tangents.chain(Part::Instants, |rows| &rows.instants, false);
        tangents.get(tangents.spaces().start(Area::Out, false) + k as u32, out);
        self.tangents = Some(tangents);
        true
    }

    fn before_event_pass(&mut self, phase: EventPhase, t: f64, y: &[f64], yp: &[f64], along: Along<'_>) {
        let mut tangents = self.take_tangents();
        tangents.sweep.outdated = true;
        self.set_time(t, phase == EventPhase::Initial);
        let loaded = self.loaded.clone();
        let area = &loaded.model.area;
        if phase == EventPhase::Repeat {
            self.tangents = Some(tangents);
            return;
        }
        if phase != EventPhase::Initial {
            for (from, to) in area.discrete.clone().zip(area.pre.clone()) {
                tangents.copy(from, to);
            }
        }
        if !area.pre_continuous.is_empty() {
            let point = Point { unknown: y, rate: yp };
            self.assign_partials(&mut tangents, point);
            tangents.load(along, self);
            tangents.chain(Part::Assign, |rows| &rows.assign, false);
            for &(place, index) in &area.pre_continuous {
                tangents.copy(tangents.block(place, false), index);
            }
        }
        self.tangents = Some(tangents);
    }

    fn after_event_pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &[f64],
        yp: &[f64],
        along: Along<'_>,
        dy: &mut [f64],
    ) -> bool {
        let loaded = self.loaded.clone();
        let area = &loaded.model.area;
        if area.discrete.is_empty() && self.loaded.model.routines.events.reinit_unknowns.is_empty() {
            return false;
        }
        let mut tangents = self.take_tangents();
        tangents.sweep.outdated = true;
        self.set_time(t, phase == EventPhase::Initial);
        let point = Point { unknown: y, rate: yp };
        self.assign_partials(&mut tangents, point);
        tangents.load(along, self);
        let changed = self.settle_tangents(&mut tangents, point);
        if !self.reinit_waits() {
            self.reinit_tangents(&mut tangents, point, dy);
        }
        self.tangents = Some(tangents);
        changed
    }

    fn set_delayed_tangents(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        let mut tangents = self.take_tangents();
        let loaded = self.loaded.clone();
        let area = &loaded.model.area;
        let width = tangents.width;
        tangents.put(area.delayed.start, values);
        tangents.put(area.delayed_rates.start, rates);
        for (k, _) in loaded.model.delays.iter().enumerate().filter(|(_, site)| site.varying) {
            // As with the values: `value + rate * time` stands there.
            let first = (area.delayed.start as usize + k) * width;
            let block = &mut tangents.blocks[first..first + width];
            for (value, rate) in block.iter_mut().zip(&rates[k * width..]) {
                *value += rate * times[k];
            }
        }
        self.tangents = Some(tangents);
    }

    fn delay_points_tangent(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        along: Along<'_>,
        sources: &mut [f64],
        times: &mut [f64],
    ) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        self.assign_partials(&mut tangents, Point { unknown: y, rate: yp });
        tangents.load(along, self);
        tangents.chain(Part::Assign, |rows| &rows.for_delays, false);
        let width = tangents.width;
        for (k, site) in self.loaded.model.delays.iter().enumerate() {
            let block = k * width..(k + 1) * width;
            tangents.signed(site.source, false, &mut sources[block.clone()]);
            tangents.signed(site.time, false, &mut times[block]);
        }
        self.tangents = Some(tangents);
    }

    fn select_outputs(&mut self, wanted: Option<&[u32]>) {
        let assigned = self.loaded.model.row.assigned;
        if let Some(tangents) = &mut self.tangents {
            tangents.select_outputs(wanted, assigned);
        }
    }

    fn outputs_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let mut tangents = self.take_tangents();
        self.set_time(t, false);
        self.assign_partials(&mut tangents, Point { unknown: y, rate: yp });
        tangents.load(along, self);
        tangents.chain(Part::Assign, |rows| &rows.for_outputs, false);
        let width = tangents.width;
        let row = &self.loaded.model.row;
        let (assigned, rest) = out.split_at_mut(row.assigned as usize * width);
        tangents.get_wanted(tangents.spaces().start(Area::Work, false), assigned);
        let (unknowns, rest) = rest.split_at_mut(along.y.len());
        unknowns.copy_from_slice(along.y);
        let (rates, discrete) = rest.split_at_mut(row.states.len() * width);
        for (out, &state) in rates.chunks_exact_mut(width).zip(&row.states) {
            out.copy_from_slice(&along.yp[state as usize * width..(state as usize + 1) * width]);
        }
        tangents.get(self.loaded.model.area.discrete.start, discrete);
        self.tangents = Some(tangents);
    }

    fn parameters_tangent(&mut self, out: &mut [f64]) {
        if let Some(tangents) = &self.tangents {
            tangents.get(self.loaded.model.area.parameters.start, out);
        }
    }
}
