//! Time events: relations that change at instants known in advance, and on which side of an instant the clock stands.
//!
//! `time >= p` changes at its instant, `time > p` right after it: at `p` itself it is false, and a moment later it is true
//! (Modelica 3.6, sections 3.5 and 8.5).  So one time can have two events, first that of all relations that change at it,
//! then that of those that change right after it; the first pass of the second one moves the clock to the right side.  What
//! a relation is follows from where the clock stands and never from comparing its sides, which rounding may have moved;
//! whether an instant has come is asked of [`hyd_system::Instants`] alone, so every relation changes in an event, none between two.

use hyd_system::TimeEvent;

use crate::instance::{Instance, Point};
use crate::routines::{EventRoutines, TimedRelation};

impl Instance {
    /// See [`hyd_system::DaeSystem::next_time_event`].
    pub(crate) fn following_instant(&mut self, t: f64) -> TimeEvent {
        self.memory.clock.announced = None;
        if self.loaded.model.routines.events.timed.is_empty() {
            return TimeEvent::NEVER;
        }
        self.set_time(t, false);
        self.run_own(self.loaded.model.routines.events.instants, Point::NOWHERE);
        let clock = &mut self.memory.clock;
        let timed = &self.loaded.model.routines.events.timed;
        let known = || timed.iter().zip(&self.memory.out);
        let right = clock.stands_right_of(t);
        let waits = |(relation, instant): (&TimedRelation, &f64)| {
            relation.right_after && !right && clock.instants.same(*instant, t)
        };
        if known().any(waits) {
            clock.announced = Some(t);
            return TimeEvent { right_after: true, ..TimeEvent::at(t) };
        }
        let ahead = known().map(|(_, &instant)| instant).filter(|&instant| clock.instants.lies_ahead(instant, t));
        let next = ahead.fold(f64::INFINITY, f64::min);
        let mut then = known().filter(|(_, instant)| clock.instants.same(**instant, next));
        let right_after = next < f64::INFINITY && then.all(|(relation, _)| relation.right_after);
        clock.announced = right_after.then_some(next);
        TimeEvent { right_after, ..TimeEvent::at(next) }
    }

    /// At the first pass of an event: moves the clock to the right side of `t`, if that is what the event is for.
    pub(crate) fn place_clock(&mut self, t: f64, point: Point<'_>) {
        let clock = self.memory.clock;
        if clock.stands_right_of(t) || !clock.announced.is_some_and(|announced| clock.instants.same(announced, t)) {
            return;
        }
        // Another event at this time may have begun what has to come first.
        let loaded = self.loaded.clone();
        let events = &loaded.model.routines.events;
        self.run_own(events.instants, point);
        let first = loaded.model.area.held.start;
        let waits = |(relation, &instant): (&TimedRelation, &f64)| {
            let held = self.memory.data[(first + relation.relation) as usize] != 0.0;
            !relation.right_after && clock.truth(relation, instant, t).is_some_and(|truth| truth != held)
        };
        if !events.timed.iter().zip(&self.memory.out).any(waits) {
            self.memory.clock.right_of = Some(t);
        }
    }

    /// Relations with an instant take the truth that follows from where the clock stands, however the comparison rounds.
    ///
    /// `space` holds three thirds: the truths, and space for instants.
    pub(crate) fn truths_by_instants(&mut self, t: f64, point: Point<'_>, events: &EventRoutines, space: &mut [f64]) {
        if events.timed.is_empty() {
            return;
        }
        let third = space.len() / 3;
        let (truths, instants) = space.split_at_mut(third);
        self.run(events.instants, point, instants, &mut []);
        for (relation, &instant) in events.timed.iter().zip(instants.iter()) {
            if let Some(truth) = self.memory.clock.truth(relation, instant, t) {
                truths[relation.relation as usize] = f64::from(u8::from(truth));
            }
        }
    }

    /// The first relation whose instant is `t`, in the order of the instants' routine, which has run.
    pub fn changes_at(&self, t: f64) -> Option<usize> {
        let count = self.loaded.model.routines.events.timed.len();
        self.memory.out[..count].iter().position(|&instant| self.memory.clock.instants.same(instant, t))
    }
}
