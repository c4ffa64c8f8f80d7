//! Derivatives of a text with units in it along directions: those of the text, chained with those of the units ([`super::twinned`]).
//!
//! What a text reads of a unit are inputs to it, whose derivatives it is given as it is given their values; what it gives a unit are values of its row.  The
//! Jacobians are those of the system.  Where the derivatives of a unit cannot be known, all of them are not a number from there on, so that
//! the run fails; [`Whole::diagnose`](hyd_system::DaeSystem::diagnose) says why.

use hyd_system::{Along, DaeSystem, Direction, DirectionError, EventPhase, Place, Tangents};

use super::twinned::{Lost, Moved, Twinned, refused};
use super::{Part, Whole};
use crate::host::Refusal;

/// Directions, and what is known along them.
#[derive(Default)]
pub(super) struct Carried {
    directions: Vec<Direction>,
    /// Derivatives are carried along with the run.
    is_active: bool,
    /// Why they are not known.
    lost: Option<String>,
    units: Vec<Twinned>,
    /// Derivatives of the parameters of the text, of what its inputs are given, of its row.
    by_parameters: Vec<f64>,
    inputs: Vec<f64>,
    row: Vec<f64>,
    /// Nothing moves: blocks for time and all unknowns.
    still: Vec<f64>,
    /// Steps of the run.
    steps: u32,
}

/// Units that ask to hear of steps are compared with their likenesses at the second step, and once in so many.
const COMPARED: u32 = 8;

impl Carried {
    fn width(&self) -> usize {
        self.directions.len()
    }

    fn note(&mut self, done: Result<(), Lost>) -> bool {
        match done {
            Ok(()) => return self.lost.is_none(),
            Err(Lost::Here) => {}
            Err(Lost::Always(sentence)) => {
                self.lost.get_or_insert(sentence);
            }
        }
        false
    }
}

/// How a unit moves with all unknowns.
fn moved<'a>(part: &Part, along: Along<'a>, width: usize) -> Moved<'a> {
    let blocks = |range: &std::ops::Range<usize>| &along.y[range.start * width..range.end * width];
    Moved { t: along.t, x: blocks(&part.x), w: blocks(&part.w) }
}

impl Whole {
    /// All units can have twins, and the text knows its derivatives.  Where directions have been set it stays so: a twin that costs the process
    /// in the middle of a run makes derivatives unknown, and those of later runs.
    pub(super) fn has_tangents(&mut self) -> bool {
        self.carried.is_some() || self.can_have_twins() && self.text.tangents().is_some()
    }

    fn can_have_twins(&self) -> bool {
        self.parts.iter().all(|part| part.unit.may_have_twins())
    }

    /// No derivatives are carried along with the next run.
    pub(super) fn carry_nothing(&mut self) {
        if let Some(carried) = &mut self.carried {
            carried.is_active = false;
        }
    }

    /// Derivatives are carried along with this run.
    pub(super) fn is_carrying(&self) -> bool {
        self.carried.as_ref().is_some_and(|carried| carried.is_active)
    }

    /// Why the derivatives of this run are not known.
    pub(super) fn why_lost(&self) -> Option<String> {
        self.carried.as_ref().filter(|carried| carried.is_active)?.lost.clone()
    }

    /// Nothing is known of derivatives from now on.
    pub(super) fn lose(&mut self, sentence: &str) {
        if let Some(carried) = self.carried.as_mut().filter(|carried| carried.is_active) {
            carried.lost.get_or_insert_with(|| sentence.to_string());
        }
    }

    fn carry<T>(&mut self, act: impl FnOnce(&mut Self, &mut Carried) -> T) -> T {
        let mut carried = self.carried.take().expect("invariant: directions are set before tangents are asked for");
        let answer = act(self, &mut carried);
        self.carried = Some(carried);
        answer
    }

    fn text_tangents(&mut self) -> &mut dyn Tangents {
        self.text.tangents().expect("invariant: a text that has tangents keeps them")
    }

    /// Tells the text the derivatives of what it reads, as those of the unknowns have it.
    fn tell_tangents(&mut self, carried: &mut Carried, y: &[f64]) {
        let width = carried.width();
        carried.inputs.fill(0.0);
        for part in &self.parts {
            for (&(input, _), at) in part.reads.iter().zip(part.y.clone()) {
                carried.inputs[input * width..(input + 1) * width].copy_from_slice(&y[at * width..(at + 1) * width]);
            }
        }
        self.text_tangents().set_input_tangents(&carried.inputs);
    }

    /// The same as the units have them.
    fn tell_watched(&mut self, carried: &mut Carried) {
        let width = carried.width();
        carried.inputs.fill(0.0);
        for (part, own) in self.parts.iter().zip(&carried.units) {
            for &(input, place) in &part.reads {
                let block = &own.watched[place * width..(place + 1) * width];
                carried.inputs[input * width..(input + 1) * width].copy_from_slice(block);
            }
        }
        self.text_tangents().set_input_tangents(&carried.inputs);
    }

    /// Takes derivatives of what is given, by those of the row of the text, from rows of `out`, of which the first has the position `first`
    /// among the unknowns.
    fn subtract_given(&self, carried: &Carried, first: usize, out: &mut [f64]) {
        let width = carried.width();
        for part in &self.parts {
            for (&(source, _, _), at) in part.gives.iter().zip(part.w.clone()) {
                let block = match source.place {
                    Place::Output(k) => &carried.row[k as usize * width..(k as usize + 1) * width],
                    Place::Parameter(k) => &carried.by_parameters[k as usize * width..(k as usize + 1) * width],
                    Place::Constant(_) => continue,
                };
                let sign = if source.negated { 1.0 } else { -1.0 };
                let out = &mut out[(at - first) * width..(at - first + 1) * width];
                out.iter_mut().zip(block).for_each(|(out, value)| *out += sign * value);
            }
        }
    }

    /// Derivatives of the row of the text where something is given to a unit.
    fn row_tangents(&mut self, carried: &mut Carried, t: f64, (y, yp): (&[f64], &[f64]), along: Along<'_>) {
        if self.parts.iter().any(|part| !part.gives.is_empty()) {
            let mut row = std::mem::take(&mut carried.row);
            self.text_tangents().outputs_tangent(t, y, yp, along, &mut row);
            carried.row = row;
        }
    }

    /// The part of derivatives that belongs to the text.
    fn of_text<'a>(&self, along: Along<'a>, width: usize) -> Along<'a> {
        let n = self.sizes.unknowns * width;
        Along { t: along.t, y: &along.y[..n], yp: &along.yp[..n] }
    }

    /// Derivatives of all units at a point; false where they are not known.
    fn derive_units(
        &mut self,
        carried: &mut Carried,
        (t, y): (f64, &[f64]),
        along: Option<Along<'_>>,
        (passed, all): (bool, bool),
    ) -> bool {
        let width = carried.width();
        if carried.lost.is_some() {
            return false;
        }
        let mut units = std::mem::take(&mut carried.units);
        let mut is_known = true;
        for (part, own) in self.parts.iter_mut().zip(&mut units) {
            let moved = along.map(|along| moved(part, along, width));
            is_known &= carried.note(own.derive(part, (t, y), moved, (width, passed, all)));
        }
        carried.units = units;
        is_known
    }

    /// Starts all twins, moved by what the units are given at the start (`w`, blocks of all unknowns) where that is known; true if states
    /// begin to move otherwise than before.
    fn start_twins(&mut self, carried: &mut Carried, t0: f64, w: Option<&[f64]>) -> bool {
        let width = carried.width();
        let mut units = std::mem::take(&mut carried.units);
        let mut is_other = false;
        for (part, own) in self.parts.iter_mut().zip(&mut units) {
            let w = w.map(|w| &w[part.w.start * width..part.w.end * width]);
            let started = own.start(part, (t0, w), width).map(|other| is_other |= other);
            carried.note(started);
        }
        carried.units = units;
        is_other
    }

    /// Jacobians, and what directions do while time and unknowns are held.
    fn carry_jacobian(
        &mut self,
        carried: &mut Carried,
        (t, y, yp): (f64, &[f64], &[f64]),
        (states, rates): (&mut [f64], &mut [f64]),
        out: &mut [f64],
    ) {
        let (n, width) = (self.sizes.unknowns, carried.width());
        carried.inputs.fill(0.0);
        self.text_tangents().set_input_tangents(&carried.inputs);
        self.parts.iter_mut().for_each(|part| part.unit.ask_likeness(true));
        self.jacobian_values(t, (y, yp), (states, rates), Some(&mut out[..n * width]));
        self.parts.iter_mut().for_each(|part| part.unit.ask_likeness(false));
        out[n * width..].fill(0.0);
        if !self.derive_units(carried, (t, y), None, (false, self.reads_matter())) {
            out.fill(f64::NAN);
            return;
        }
        self.place_units(carried, out);
        self.tell_text(y);
        let still = std::mem::take(&mut carried.still);
        let along = Along { t: &still[..width], y: &still[..n * width], yp: &still[..n * width] };
        self.row_tangents(carried, t, (&y[..n], &yp[..n]), along);
        carried.still = still;
        self.subtract_given(carried, 0, out);
    }

    /// Derivatives of the units in the rows of their states and of what is read of them, which have nothing else yet but those of
    /// unknowns by themselves.
    fn place_units(&self, carried: &Carried, out: &mut [f64]) {
        let width = carried.width();
        for (part, own) in self.parts.iter().zip(&carried.units) {
            let rates = out[part.x.start * width..part.x.end * width].iter_mut();
            rates.zip(&own.rates).for_each(|(out, value)| *out -= value);
            for (&(_, place), at) in part.reads.iter().zip(part.y.clone()) {
                let out = out[at * width..(at + 1) * width].iter_mut();
                out.zip(&own.watched[place * width..]).for_each(|(out, value)| *out -= value);
            }
        }
    }

    /// Derivatives of the initial system with its unknowns held.
    fn carry_initial(&mut self, carried: &mut Carried, t0: f64, z: &[f64], out: &mut [f64]) {
        let (n, m, first) = (self.sizes.unknowns, self.sizes.initial, self.sizes.first);
        let width = carried.width();
        self.tell_initial(z);
        carried.inputs.fill(0.0);
        self.text_tangents().set_input_tangents(&carried.inputs);
        self.text_tangents().initial_residual_tangent(t0, &z[..m], &mut out[..m * width]);
        out[m * width..].fill(0.0);
        let unknowns = self.at_start();
        let mut blocks = vec![0.0; unknowns.len() * width];
        self.starts_into(carried, &mut blocks);
        let still = carried.still[..width].to_vec();
        let along = Along { t: &still, y: &blocks, yp: &[] };
        if !self.derive_units(carried, (t0, &unknowns), Some(along), (false, true)) {
            out.fill(f64::NAN);
            return;
        }
        for (part, own) in self.parts.iter().zip(&carried.units) {
            for (&(_, place), at) in part.reads.iter().zip(part.y.clone()) {
                let at = at - first + m;
                let block = &own.watched[place * width..(place + 1) * width];
                out[at * width..(at + 1) * width].iter_mut().zip(block).for_each(|(out, value)| *out = -value);
            }
        }
        if self.parts.iter().all(|part| part.gives.is_empty()) {
            return;
        }
        let (mut y, mut yp) = (vec![0.0; n], vec![0.0; n]);
        if self.text.initial_store(t0, &z[..m], &mut y, &mut yp).is_err() {
            out.fill(f64::NAN);
            return;
        }
        let (mut dy, mut dyp) = (vec![0.0; n * width], vec![0.0; n * width]);
        let held = vec![0.0; m * width];
        self.text_tangents().initial_store_tangent(t0, &z[..m], &held, &mut dy, &mut dyp);
        self.row_tangents(carried, t0, (&y, &yp), Along { t: &still, y: &dy, yp: &dyp });
        self.subtract_given(carried, first - m, out);
    }

    /// All unknowns at the start, as far as they are known.
    fn at_start(&self) -> Vec<f64> {
        let mut unknowns = self.started.clone();
        for part in &self.parts {
            unknowns[part.x.clone()].copy_from_slice(part.unit.start());
        }
        unknowns
    }

    /// Derivatives of the states of the units at the start, in blocks of all unknowns.
    fn starts_into(&self, carried: &mut Carried, blocks: &mut [f64]) {
        let width = carried.width();
        for (part, own) in self.parts.iter().zip(&carried.units) {
            own.starts(width, &mut blocks[part.x.start * width..part.x.end * width]);
        }
    }

    /// Derivatives of everything at the start.
    fn carry_start(
        &mut self,
        carried: &mut Carried,
        (t0, z, dz): (f64, &[f64], &[f64]),
        dy: &mut [f64],
        dyp: &mut [f64],
    ) {
        let (n, m, first) = (self.sizes.unknowns, self.sizes.initial, self.sizes.first);
        let width = carried.width();
        dy[first * width..].copy_from_slice(&dz[m * width..]);
        dyp[n * width..].fill(0.0);
        self.tell_initial(z);
        self.tell_tangents(carried, dy);
        let of_text = (&mut dy[..n * width], &mut dyp[..n * width]);
        self.text_tangents().initial_store_tangent(t0, &z[..m], &dz[..m * width], of_text.0, of_text.1);
        let is_started = |(part, own): (&Part, &Twinned)| own.is_started_with(&part.settled);
        let given = self.parts.iter().flat_map(|part| &dy[part.w.start * width..part.w.end * width]);
        let is_moved = given.copied().any(|value| value != 0.0);
        if is_moved || !self.parts.iter().zip(&carried.units).all(is_started) {
            // What begins otherwise was not known when the initial system was solved; its unknowns that are algebraic are solved for again.
            if self.start_twins(carried, t0, Some(dy)) && self.text.structure().differential.iter().any(|own| *own) {
                carried.lost.get_or_insert_with(|| "the unit begins as it is given values by the rest".to_string());
            }
        }
        self.starts_into(carried, dy);
        if carried.lost.is_some() {
            dy.fill(f64::NAN);
        }
    }

    /// Units that hear of steps before they hear of the one that has come to a point: one that remembers them leaves its likeness behind, with
    /// or without events.
    pub(super) fn compare_at_step(&mut self, t: f64, y: &[f64]) {
        if self.parts.iter().any(|part| part.unit.hears_of_steps()) {
            self.carry(|own, carried| {
                carried.steps += 1;
                if carried.steps % COMPARED == 2 {
                    own.compare_units(carried, t, y);
                }
            });
        }
    }

    /// Units before an event.
    fn compare_units(&mut self, carried: &mut Carried, t: f64, y: &[f64]) {
        if carried.lost.is_some() {
            return;
        }
        let mut units = std::mem::take(&mut carried.units);
        for (part, own) in self.parts.iter_mut().zip(&mut units) {
            carried.note(own.compare(part, (t, y)));
        }
        carried.units = units;
    }

    /// Takes the twins of those units that had an event through it.
    fn carry_events(&mut self, carried: &mut Carried, (t, y): (f64, &[f64]), along: Along<'_>, dy: &mut [f64]) -> bool {
        let (width, instants) = (carried.width(), self.instants);
        let mut units = std::mem::take(&mut carried.units);
        let mut is_any = false;
        for (part, own) in self.parts.iter_mut().zip(&mut units) {
            let Some(reinitialised) = part.passed.take() else { continue };
            is_any = true;
            if carried.lost.is_none() {
                let moved = moved(part, along, width);
                let dx = &mut dy[part.x.start * width..part.x.end * width];
                let done = own.event(part, (t, y), moved, (width, instants, reinitialised), dx);
                if let Err(Lost::Here) = done {
                    carried
                        .lost
                        .get_or_insert_with(|| "the unit has no value at an event with another parameter".to_string());
                }
                carried.note(done);
            }
        }
        carried.units = units;
        is_any
    }
}

impl Tangents for Whole {
    fn set_directions(&mut self, directions: &[Direction]) -> Result<(), (usize, DirectionError)> {
        self.text_tangents().set_directions(directions)?;
        let width = directions.len();
        let own = self.text.structure();
        let (unknowns, inputs, row) = (self.structure.unknowns, own.inputs.len(), own.outputs);
        let parameters = self.text.parameters().len();
        self.carried = Some(Box::new(Carried {
            directions: directions.to_vec(),
            units: self.parts.iter().map(|_| Twinned::default()).collect(),
            by_parameters: vec![0.0; parameters * width],
            inputs: vec![0.0; inputs * width],
            row: vec![0.0; row * width],
            still: vec![0.0; (unknowns + 1) * width],
            ..Carried::default()
        }));
        Ok(())
    }

    fn bind_tangent(&mut self, t0: f64) {
        self.carry(|own, carried| {
            own.text_tangents().bind_tangent(t0);
            own.text_tangents().parameters_tangent(&mut carried.by_parameters);
            (carried.is_active, carried.lost, carried.steps) = (true, None, 0);
            if !own.can_have_twins() {
                carried.note(Err(refused(Refusal::Lost)));
                return;
            }
            let mut units = std::mem::take(&mut carried.units);
            for (part, unit) in own.parts.iter_mut().zip(&mut units) {
                part.passed = None;
                let known = (own.text.parameters(), &carried.by_parameters[..]);
                let planned = unit.plan(part, &carried.directions, known);
                carried.note(planned);
            }
            carried.units = units;
            if carried.lost.is_none() {
                own.start_twins(carried, t0, None);
            }
        });
    }

    fn set_input_tangents(&mut self, values: &[f64]) {
        // Nobody gives inputs of the whole values: those that are left follow what was recorded.
        debug_assert!(values.iter().all(|value| *value == 0.0));
    }

    fn initial_residual_tangent(&mut self, t0: f64, z: &[f64], out: &mut [f64]) {
        self.carry(|own, carried| own.carry_initial(carried, t0, z, out));
    }

    fn initial_store_tangent(&mut self, t0: f64, z: &[f64], dz: &[f64], dy: &mut [f64], dyp: &mut [f64]) {
        self.carry(|own, carried| own.carry_start(carried, (t0, z, dz), dy, dyp));
    }

    fn residual_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let n = self.sizes.unknowns;
        self.carry(|own, carried| {
            let width = carried.width();
            own.tell_text(y);
            own.tell_tangents(carried, along.y);
            let of_text = own.of_text(along, width);
            own.text_tangents().residual_tangent(t, &y[..n], &yp[..n], of_text, &mut out[..n * width]);
            if !own.derive_units(carried, (t, y), Some(along), (false, true)) {
                out.fill(f64::NAN);
                return;
            }
            let (states, coupled) = (n * width..own.sizes.first * width, own.sizes.first * width..);
            out[states.clone()].copy_from_slice(&along.yp[states]);
            out[coupled.clone()].copy_from_slice(&along.y[coupled]);
            own.place_units(carried, out);
            own.row_tangents(carried, t, (&y[..n], &yp[..n]), of_text);
            own.subtract_given(carried, 0, out);
        });
    }

    fn jacobian_tangent(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        jacobians: (&mut [f64], &mut [f64]),
        out: &mut [f64],
    ) {
        self.carry(|own, carried| own.carry_jacobian(carried, (t, y, yp), jacobians, out));
    }

    fn branches(&mut self) -> usize {
        // Those of the units are not known, and who knows some takes them for all.
        0
    }

    fn branch_values(&mut self, _t: f64, _y: &[f64], _yp: &[f64], _out: &mut [f64]) {}

    fn roots_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let n = self.sizes.unknowns;
        self.carry(|own, carried| {
            let width = carried.width();
            let (of_units, of_text) = out.split_at_mut(own.sizes.indicators * width);
            let mut units = std::mem::take(&mut carried.units);
            let mut first = 0;
            for (part, unit) in own.parts.iter_mut().zip(&mut units) {
                let last = first + part.unit.structure().roots * width;
                let moved = moved(part, along, width);
                let done = unit.indicators(part, (t, y), moved, (width, &mut of_units[first..last]));
                if carried.lost.is_some() || !carried.note(done) {
                    of_units[first..last].fill(f64::NAN);
                }
                first = last;
            }
            carried.units = units;
            own.tell_text(y);
            own.tell_tangents(carried, along.y);
            let along = own.of_text(along, width);
            own.text_tangents().roots_tangent(t, &y[..n], &yp[..n], along, of_text);
        });
    }

    fn instant_tangent(&mut self, t: f64, out: &mut [f64]) -> bool {
        if self.text_tangents().instant_tangent(t, out) {
            return true;
        }
        let instants = self.instants;
        self.carry(|_, carried| {
            let due = carried.units.iter().find(|unit| unit.is_due(t, instants));
            due.inspect(|unit| unit.instant(out)).is_some()
        })
    }

    fn before_event_pass(&mut self, phase: EventPhase, t: f64, y: &[f64], yp: &[f64], along: Along<'_>) {
        let n = self.sizes.unknowns;
        self.carry(|own, carried| {
            own.parts.iter_mut().for_each(|part| part.passed = None);
            if phase == EventPhase::First {
                own.compare_units(carried, t, y);
            }
            own.tell_text(y);
            own.tell_tangents(carried, along.y);
            let along = own.of_text(along, carried.width());
            own.text_tangents().before_event_pass(phase, t, &y[..n], &yp[..n], along);
        });
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
        let n = self.sizes.unknowns;
        self.carry(|own, carried| {
            let width = carried.width();
            own.tell_text(y);
            own.tell_tangents(carried, along.y);
            let of_text = own.of_text(along, width);
            let (text, dy_text) = (own.text_tangents(), &mut dy[..n * width]);
            let changed = text.after_event_pass(phase, t, &y[..n], &yp[..n], of_text, dy_text);
            own.carry_events(carried, (t, y), along, dy) || changed
        })
    }

    fn set_delayed_tangents(&mut self, values: &[f64], rates: &[f64], times: &[f64]) {
        self.text_tangents().set_delayed_tangents(values, rates, times);
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
        let n = self.sizes.unknowns;
        self.carry(|own, carried| {
            own.tell_text(y);
            own.tell_tangents(carried, along.y);
            let along = own.of_text(along, carried.width());
            own.text_tangents().delay_points_tangent(t, &y[..n], &yp[..n], along, sources, times);
        });
    }

    fn select_outputs(&mut self, wanted: Option<&[u32]>) {
        let row = self.sizes.row as u32;
        // What is given to units is looked at, too.
        let given = self.parts.iter().flat_map(|part| &part.gives).filter_map(|(source, ..)| match source.place {
            Place::Output(at) => Some(at),
            _ => None,
        });
        let own = wanted.map(|wanted| {
            let mut all: Vec<u32> = wanted.iter().copied().filter(|at| *at < row).chain(given).collect();
            all.sort_unstable();
            all.dedup();
            all
        });
        self.text_tangents().select_outputs(own.as_deref());
    }

    fn outputs_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        let (n, row) = (self.sizes.unknowns, self.sizes.row);
        self.carry(|own, carried| {
            let width = carried.width();
            if !own.derive_units(carried, (t, y), Some(along), (true, true)) {
                out.fill(f64::NAN);
                return;
            }
            own.tell_watched(carried);
            let of_text = own.of_text(along, width);
            own.text_tangents().outputs_tangent(t, &y[..n], &yp[..n], of_text, &mut out[..row * width]);
            out[row * width..].copy_from_slice(&along.y[n * width..own.sizes.first * width]);
        });
    }

    fn parameters_tangent(&mut self, out: &mut [f64]) {
        self.text_tangents().parameters_tangent(out);
    }
}
