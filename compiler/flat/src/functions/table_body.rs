//! Bodies of the functions that tables are during the run (see `hyd_instance::external`).
//!
//! A table is a search by halves for the piece that its argument lies in, and the polynomial of that piece.  Relations inside cause no events: where
//! a table has events its block asks for them.

use hyd_instance::external::{Cubic, Outside, Pieces, Table2d, TimeTable};
use hyd_symbolic::{Arena, Body, BodyId, BodyOutput, Function, NodeId, Relation, SlotId, Step};

/// The register of the result.
const RESULT: u32 = 8;
/// Registers for arguments that are moved into the range of a table.
const MOVED: [u32; 2] = [9, 10];
const REGISTERS: u32 = 11;

/// The part of the shortest time between two events within which an event counts as over: more than the rounding of times.
const OVER: f64 = 1e-6;
/// From where on a next event means that there is none.
const NEVER: f64 = 1e300;

/// A body in the making.
struct Maker<'a> {
    arena: &'a mut Arena,
}

/// A function of one variable.
pub(crate) fn of_pieces(arena: &mut Arena, name: &str, pieces: &Pieces) -> BodyId {
    let mut make = Maker { arena };
    let (first, last) = (pieces.ends[0], pieces.ends[pieces.ends.len() - 1]);
    let mut steps = make.moved_into(0, (first, last), pieces.outside, false);
    let mut leaves = vec![(first, first, pieces.beyond[0])];
    leaves.extend(pieces.ends.iter().zip(&pieces.cubics).map(|(&end, &cubic)| (end, end, cubic)));
    leaves.push((last, last, pieces.beyond[1]));
    steps.extend(make.search(&leaves, MOVED[0]));
    make.body(name, 1, steps)
}

/// The element of a list of numbers at a position from 0.  An element outside of it is that at the nearer end: whoever asks checks.
pub(crate) fn of_list(arena: &mut Arena, name: &str, list: &[f64]) -> BodyId {
    let mut make = Maker { arena };
    let mut leaf = |(k, &value): (usize, &f64)| (k as f64, vec![Step::Set(RESULT, make.number(value))]);
    let leaves: Vec<(f64, Vec<Step>)> = list.iter().enumerate().map(&mut leaf).collect();
    let steps = make.halves(&leaves, 0);
    make.body(name, 1, steps)
}

/// A table of two variables.
pub(crate) fn of_patches(arena: &mut Arena, name: &str, table: &Table2d, order: [u32; 2]) -> BodyId {
    let mut make = Maker { arena };
    let mut steps = Vec::new();
    for (k, range) in table.range().into_iter().enumerate() {
        if table.x[k].len() > 1 {
            steps.extend(make.moved_into(k, range, table.outside, true));
        } else {
            let own = make.slot(k as u32);
            steps.push(Step::Set(MOVED[k], own));
        }
    }
    // Steps have a value of their own at the last point.
    let count = |axis: usize| table.x[axis].len() - usize::from(!table.is_constant() && table.x[axis].len() > 1);
    let rows: Vec<(f64, Vec<Step>)> = (0..count(0))
        .map(|i| {
            let cells: Vec<(f64, Vec<Step>)> = (0..count(1))
                .map(|j| (table.x[1][j], make.patch(table.patch(i, j).0, [table.x[0][i], table.x[1][j]], order)))
                .collect();
            (table.x[0][i], make.halves(&cells, MOVED[1]))
        })
        .collect();
    steps.extend(make.halves(&rows, MOVED[0]));
    make.body(name, 2, steps)
}

/// A table of time, its arguments the time and the next event; `Err`: a sentence.
pub(crate) fn of_time(
    arena: &mut Arena,
    name: &str,
    table: &TimeTable,
    output: usize,
    order: u32,
) -> Result<BodyId, String> {
    let mut make = Maker { arena };
    let beyond = table.beyond(output)?.map(|line| line.derivative(order));
    let stretches = table.stretches(output)?;
    let (low, high) = table.range();
    let (time, next) = (make.slot(0), make.slot(1));
    // The times of the table in MOVED[0].
    let shift = make.number(table.shift);
    let own = make.arena.sub(time, shift);
    let event = make.arena.sub(next, shift);
    let mut inside = Vec::new();
    if table.is_constant() {
        let value = make.number(beyond[0].0[0]);
        inside.push(Step::Set(RESULT, value));
    } else {
        let mut leaves: Vec<(f64, Vec<Step>)> = Vec::new();
        let mut from = f64::NEG_INFINITY;
        let repeated = table.outside == Outside::Repeat;
        let set_own = Step::Set(MOVED[0], own);
        for (k, stretch) in stretches.iter().enumerate() {
            let pieces = stretch.pieces.derivative(order);
            let mut leaf = Vec::new();
            if repeated {
                // The next event stands at the end of the stretch.
                let to = make.number(stretch.to);
                let ahead = make.arena.sub(time, next);
                let at = make.arena.add(ahead, to);
                leaf.push(Step::Set(MOVED[0], at));
            } else {
                leaf.push(set_own.clone());
            }
            let ends = pieces.ends.iter().zip(&pieces.cubics);
            let cubics: Vec<(f64, f64, Cubic)> = ends.map(|(&end, &cubic)| (end, end, cubic)).collect();
            leaf.extend(make.search(&cubics, MOVED[0]));
            if k > 0 || !repeated {
                // The stretch that the next event ends is found by the middle between ends.
                from = 0.5 * (stretch.from + stretch.to);
            }
            leaves.push((from, leaf));
        }
        if repeated {
            // The next event within the first period; an event at its beginning is one at its end.
            let (length, base) = (make.number(high - low), make.number(low));
            let distance = make.arena.sub(event, base);
            let turns = make.arena.div(distance, length);
            let whole = make.arena.call1(Function::Floor, turns);
            let back = make.arena.mul(whole, length);
            let at = make.arena.sub(event, back);
            inside.push(Step::Set(MOVED[1], at));
            let slot = make.slot(MOVED[1]);
            let middle = make.number(0.5 * (low + stretches.first().map_or(high, |stretch| stretch.to)));
            let early = make.arena.compare(Relation::Less, slot, middle);
            let moved = make.arena.add(slot, length);
            inside.push(Step::If(early, vec![Step::Set(MOVED[1], moved)], Vec::new()));
        } else {
            inside.push(Step::Set(MOVED[1], event));
            let before = make.beyond(&beyond[0], own, low, (table.outside, Relation::GreaterEqual));
            leaves.insert(0, (f64::NEG_INFINITY, before));
            let after = make.beyond(&beyond[1], own, high, (table.outside, Relation::LessEqual));
            leaves.push((NEVER, after));
        }
        inside.extend(make.halves(&leaves, MOVED[1]));
    }
    let zero = make.number(0.0);
    let begin = make.begin(table);
    let early = make.arena.compare(Relation::Less, time, begin);
    let start = make.number(table.start);
    let waits = make.arena.compare(Relation::LessEqual, next, start);
    let off = make.arena.or(early, waits);
    let steps = vec![Step::Set(RESULT, zero), Step::If(off, Vec::new(), inside)];
    Ok(make.body(name, 2, steps))
}

/// The next event of a table of time, its argument the time.
pub(crate) fn next_event(arena: &mut Arena, name: &str, table: &TimeTable) -> BodyId {
    let mut make = Maker { arena };
    let (low, high) = table.range();
    let time = make.slot(0);
    let shift = make.number(table.shift);
    let shortest = table.events.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let mut inside = Vec::new();
    if table.is_constant() {
        let never = make.number(f64::MAX);
        inside.push(Step::Set(RESULT, never));
    } else {
        let over = make.number(OVER * shortest);
        let own = make.arena.sub(time, shift);
        let own = make.arena.add(own, over);
        inside.push(Step::Set(MOVED[0], own));
        let mut offset = shift;
        let repeated = table.outside == Outside::Repeat;
        if repeated {
            let (length, base) = (make.number(high - low), make.number(low));
            let slot = make.slot(MOVED[0]);
            let distance = make.arena.sub(slot, base);
            let turns = make.arena.div(distance, length);
            let whole = make.arena.call1(Function::Floor, turns);
            let back = make.arena.mul(whole, length);
            inside.push(Step::Set(MOVED[1], back));
            let back = make.slot(MOVED[1]);
            let within = make.arena.sub(slot, back);
            inside.push(Step::Set(MOVED[0], within));
            offset = make.arena.add(shift, back);
        }
        let mut leaves: Vec<(f64, Vec<Step>)> = Vec::new();
        let first = usize::from(repeated);
        let mut from = f64::NEG_INFINITY;
        for &event in &table.events[first..] {
            let at = make.number(event);
            let at = make.arena.add(at, offset);
            leaves.push((from, vec![Step::Set(RESULT, at)]));
            from = event;
        }
        if !repeated {
            let never = make.number(f64::MAX);
            leaves.push((from, vec![Step::Set(RESULT, never)]));
        }
        inside.extend(make.halves(&leaves, MOVED[0]));
    }
    let start = make.number(table.start);
    let begin = make.begin(table);
    let early = make.arena.compare(Relation::Less, time, begin);
    let steps = vec![Step::If(early, vec![Step::Set(RESULT, start)], inside)];
    make.body(name, 1, steps)
}

impl Maker<'_> {
    fn number(&mut self, value: f64) -> NodeId {
        self.arena.constant(value)
    }

    fn slot(&mut self, register: u32) -> NodeId {
        self.arena.slot(SlotId(register))
    }

    /// The start time, less by the rounding of times.
    fn begin(&mut self, table: &TimeTable) -> NodeId {
        self.number(table.start - 1e-10 * table.start.abs().max(1e-3))
    }

    fn body(&mut self, name: &str, inputs: u32, steps: Vec<Step>) -> BodyId {
        let real_inputs = vec![true; inputs as usize];
        let id = self.arena.reserve_body(name.into(), real_inputs.clone());
        let outputs = vec![BodyOutput { name: "y".into(), register: RESULT, zero: false }];
        let (name, registers) = (name.into(), REGISTERS);
        self.arena.set_body(id, Body { name, inputs, real_inputs, registers, steps, outputs, derivatives: Vec::new() });
        id
    }

    /// Argument `k` in its register of moved ones, as the choice for what is outside says; `hold`: values beyond the ends are the ends.
    fn moved_into(&mut self, k: usize, (first, last): (f64, f64), outside: Outside, hold: bool) -> Vec<Step> {
        let (own, to) = (self.slot(k as u32), MOVED[k]);
        let (low, high) = (self.number(first), self.number(last));
        let mut steps = vec![Step::Set(to, own)];
        let (below, above) =
            (self.arena.compare(Relation::Less, own, low), self.arena.compare(Relation::Greater, own, high));
        match outside {
            Outside::Repeat if last > first => {
                let (length, out) = (self.number(last - first), self.arena.or(below, above));
                let distance = self.arena.sub(own, low);
                let turns = self.arena.div(distance, length);
                let whole = self.arena.call1(Function::Floor, turns);
                let back = self.arena.mul(whole, length);
                let moved = self.arena.sub(own, back);
                steps.push(Step::If(out, vec![Step::Set(to, moved)], Vec::new()));
            }
            Outside::Nothing => {
                let out = self.arena.or(below, above);
                let inside = self.arena.not(out);
                let text = format!("the argument of a table must lie between {first} and {last}");
                steps.push(Step::Check(inside, text.into()));
            }
            Outside::Hold if hold => {
                steps.push(Step::If(below, vec![Step::Set(to, low)], Vec::new()));
                steps.push(Step::If(above, vec![Step::Set(to, high)], Vec::new()));
            }
            _ => {}
        }
        steps
    }

    /// The line beyond an end, over the distance from it; nothing holds there where the choice says so.
    fn beyond(&mut self, line: &Cubic, at: NodeId, end: f64, (outside, inside): (Outside, Relation)) -> Vec<Step> {
        let mut steps = vec![Step::Set(MOVED[0], at)];
        if outside == Outside::Nothing {
            let limit = self.number(end);
            let slack = self.number(1e-10 * end.abs().max(1e-3));
            let limit = match inside {
                Relation::LessEqual => self.arena.add(limit, slack),
                _ => self.arena.sub(limit, slack),
            };
            let holds = self.arena.compare(inside, at, limit);
            steps.push(Step::Check(
                holds,
                "the time is outside of the table, which says that nothing holds there".into(),
            ));
        }
        steps.extend(self.search(&[(end, end, *line)], MOVED[0]));
        steps
    }

    /// The polynomial of the last leaf whose start is not above the register; the first one before.  A leaf is its start, the place its polynomial
    /// counts from, and the polynomial.
    fn search(&mut self, leaves: &[(f64, f64, Cubic)], register: u32) -> Vec<Step> {
        let list: Vec<(f64, Vec<Step>)> = leaves
            .iter()
            .map(|&(start, origin, cubic)| {
                let (slot, origin) = (self.slot(register), self.number(origin));
                let d = self.arena.sub(slot, origin);
                let value = self.polynomial(&cubic, d);
                (start, vec![Step::Set(RESULT, value)])
            })
            .collect();
        // What holds before the first piece begins where that does: the search tells them apart.
        let mut list = list;
        if leaves.len() > 1 && leaves[0].0 == leaves[1].0 {
            list[0].0 = f64::NEG_INFINITY;
        }
        self.halves(&list, register)
    }

    fn polynomial(&mut self, cubic: &Cubic, d: NodeId) -> NodeId {
        let [c0, c1, c2, c3] = cubic.0.map(|c| self.number(c));
        let mut value = self.arena.mul(c3, d);
        value = self.arena.add(value, c2);
        value = self.arena.mul(value, d);
        value = self.arena.add(value, c1);
        value = self.arena.mul(value, d);
        self.arena.add(value, c0)
    }

    /// A function of both moved arguments on a rectangle, differentiated by each as often as `order` says.
    fn patch(&mut self, c: [f64; 4], corner: [f64; 2], order: [u32; 2]) -> Vec<Step> {
        let distance = |make: &mut Self, k: usize| {
            let (slot, origin) = (make.slot(MOVED[k]), make.number(corner[k]));
            make.arena.sub(slot, origin)
        };
        let c = c.map(|c| self.number(c));
        let value = match order {
            [0, 0] => {
                let (a, b) = (distance(self, 0), distance(self, 1));
                let mixed = self.arena.mul(c[3], b);
                let slope = self.arena.add(c[1], mixed);
                let (along, across) = (self.arena.mul(slope, a), self.arena.mul(c[2], b));
                let sum = self.arena.add(along, across);
                self.arena.add(sum, c[0])
            }
            [1, 0] | [0, 1] => {
                let (own, other) = if order[0] == 1 { (c[1], 1) } else { (c[2], 0) };
                let d = distance(self, other);
                let mixed = self.arena.mul(c[3], d);
                self.arena.add(own, mixed)
            }
            [1, 1] => c[3],
            _ => self.number(0.0),
        };
        vec![Step::Set(RESULT, value)]
    }

    /// The steps of the last leaf whose start is not above the register, found by halves; those of the first one before.
    fn halves(&mut self, leaves: &[(f64, Vec<Step>)], register: u32) -> Vec<Step> {
        match leaves {
            [] => Vec::new(),
            [(_, only)] => only.clone(),
            _ => {
                let middle = leaves.len() / 2;
                let (slot, start) = (self.slot(register), self.number(leaves[middle].0));
                let behind = self.arena.compare(Relation::GreaterEqual, slot, start);
                let (low, high) = leaves.split_at(middle);
                let (yes, no) = (self.halves(high, register), self.halves(low, register));
                vec![Step::If(behind, yes, no)]
            }
        }
    }
}
