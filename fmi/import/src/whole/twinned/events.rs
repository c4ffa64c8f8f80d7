//! The way of twins through the events of their unit: a twin goes through its own event at its own instant, and must come out as the unit does.

use hyd_system::{DaeSystem, Instants};

use super::{ALIKE, Lost, Moved, NEXT, STEP, TIME, Twin, Twinned, differs_in_time, refused, said, same_next};
use crate::protocol::Update;
use crate::twins::LIKENESS;
use crate::whole::Part;
use crate::whole::start::differs;

/// Where a twin has not quite come to its event, it is asked so much later, as parts of its time: far less than what its step moves.
const LATER: [f64; 4] = [0.0, 1e-14, 1e-13, 1e-12];

impl Twinned {
    /// The likeness is what the unit is, before an event.
    pub(in crate::whole) fn compare(&mut self, part: &mut Part, (t, unknowns): (f64, &[f64])) -> Result<(), Lost> {
        let n = part.x.len();
        part.tell(unknowns);
        let mut own = vec![0.0; n + part.watched.len()];
        let mut other = own.clone();
        let x = &unknowns[part.x.clone()];
        for (values, is_first) in [(&mut own, true), (&mut other, false)] {
            let (rates, watched) = values.split_at_mut(n);
            match is_first {
                true => part.unit.first_one(|unit| unit.watch(t, x, rates, watched)),
                false => {
                    part.unit.ask_likeness(true);
                    part.unit.watch(t, x, rates, watched);
                    part.unit.ask_likeness(false);
                }
            }
        }
        let sizes = &self.largest[n..];
        let close = |((a, b), size): ((&f64, &f64), &f64)| {
            a.to_bits() == b.to_bits()
                || (a.is_nan() && b.is_nan())
                || (a - b).abs() <= ALIKE * size.max(a.abs()).max(b.abs())
        };
        if own.iter().zip(&other).zip(sizes).all(close) {
            return Ok(());
        }
        said("the unit follows its steps, so that a second instance is no longer like the first one")
    }

    /// Takes likeness and twins through the event that the unit has had at a point, `moved` by total derivatives; where the unit has written
    /// into its states (`reinitialised`) their derivatives come into `dx`, a block each.
    pub(in crate::whole) fn event(
        &mut self,
        part: &mut Part,
        (t, unknowns): (f64, &[f64]),
        moved: Moved<'_>,
        (width, instants, reinitialised): (usize, Instants, bool),
        dx: &mut [f64],
    ) -> Result<(), Lost> {
        let (n, count) = (part.x.len(), part.unit.structure().roots);
        let (mut states, mut held, mut own_held) = (vec![0.0; n], vec![false; count], vec![false; count]);
        part.unit.held(&mut own_held);
        let (due, before, next) = (self.is_due(t, instants), self.next, part.unit.next);
        self.ready(part, (t, unknowns), None, (LIKENESS, 0, 0.0), width);
        let alike = part.unit.twin_event(self.calls[0], (&self.inputs, &self.states), (&mut states, &mut held));
        let alike = alike.map_err(refused)?;
        let own: Vec<f64> = if reinitialised { part.unit.start().to_vec() } else { states.clone() };
        let is_other = states.iter().zip(&own).any(|(a, b)| differs(*a, *b));
        if is_other || held != own_held || alike.states_changed != reinitialised || differs_in_time(alike.next, next) {
            return said("a second instance of the unit goes through an event otherwise than the first one");
        }
        self.next = next;
        let mut twins = std::mem::take(&mut self.twins);
        let mut done = Ok(());
        for (k, twin) in twins.iter_mut().enumerate() {
            let Some(twin) = twin else { continue };
            if twin.step == 0.0 {
                twin.step = self.step_along(part, (t, unknowns), moved, (k, width));
            } else {
                done = self.is_small(part, unknowns, moved, (k, width, twin.step));
                if done.is_err() {
                    break;
                }
            }
            let own_event =
                Own { k, due: due.then_some((before, twin.next)), width, held: &own_held, alike, t, unknowns };
            done = self.twin_event(part, twin, moved, &own_event, (&mut states, &mut held));
            if done.is_err() {
                break;
            }
            if reinitialised {
                for ((block, state), own) in dx.chunks_exact_mut(width).zip(&states).zip(&own) {
                    block[k] = if twin.step == 0.0 { 0.0 } else { (state - own) / twin.step };
                }
            }
        }
        self.twins = twins;
        done
    }

    /// Prepares one question.
    fn ready(
        &mut self,
        part: &Part,
        at: (f64, &[f64]),
        moved: Option<Moved<'_>>,
        (number, k, step): (u32, usize, f64),
        width: usize,
    ) {
        self.inputs.clear();
        self.states.clear();
        self.calls.clear();
        self.steps.clear();
        self.call(part, at, moved, (number, false, k, step), width);
    }

    /// The event of one twin.
    fn twin_event(
        &mut self,
        part: &mut Part,
        twin: &mut Twin,
        moved: Moved<'_>,
        own: &Own<'_>,
        (states, held): (&mut [f64], &mut [bool]),
    ) -> Result<(), Lost> {
        self.ready(part, (own.t, own.unknowns), Some(moved), (twin.number, own.k, twin.step), own.width);
        if let Some((next, its)) = own.due {
            // At its own instant, which rounding must not miss.
            let (at, shift) = (self.calls[0].t, (its - next).abs().max((self.calls[0].t - own.t).abs()));
            if (at - its).abs() > NEXT * shift + ALIKE * STEP * own.t.abs().max(TIME.0) {
                return said("two events of the model that coincide move apart with a parameter");
            }
            self.calls[0].t = its.max(at);
        }
        let at = self.calls[0].t;
        for later in LATER {
            self.calls[0].t = at + later * at.abs().max(TIME.0);
            let update = part.unit.twin_event(self.calls[0], (&self.inputs, &self.states), (states, held));
            let update = update.map_err(refused)?;
            let is_same = held == own.held
                && update.states_changed == own.alike.states_changed
                && update.terminate == own.alike.terminate
                && same_next(own.t, (own.alike.next, update.next));
            if is_same {
                twin.next = update.next;
                return Ok(());
            }
            if update.states_changed {
                break;
            }
        }
        said("an event of the unit becomes another one with a small step of a parameter")
    }
}

/// The event of the unit that a twin goes through.
struct Own<'a> {
    /// The direction.
    k: usize,
    /// Where a time event is due: its instant, and that of the twin (s).
    due: Option<(f64, f64)>,
    width: usize,
    held: &'a [bool],
    alike: Update,
    t: f64,
    unknowns: &'a [f64],
}
