//! The run: Runge-Kutta steps between events, bisection for events, rounds at an event.

use super::Solution;
use super::expression::due;
use super::machine::Machine;
use super::value::{Done, Dual};
use crate::model::{Expr, Id, Role};

/// Rounds of an event at most.
const MOST_ROUNDS: usize = 20;
/// Events closer than this, and not at once, are unclear (s).
const APART: f64 = 1e-4;
/// Width to which an event is located (s).
const LOCATED: f64 = 1e-10;
/// The least slope of a relation where it changes (1/s).
const SLOPE: f64 = 0.02;
/// A relation that comes nearer without changing is unclear.
const NEAR: f64 = 2e-3;

/// What happens when: constants of the text.
struct Calendar {
    samples: Vec<(f64, f64)>,
    delays: Vec<f64>,
    /// Instants at which delayed values jump or have a kink (s).
    returns: Vec<f64>,
}

/// Distances of the relations at the last points without event.
type Gaps = Vec<Vec<f64>>;

impl Machine<'_> {
    fn states(&self) -> Vec<(Id, usize)> {
        let list = self.model.variables.iter().enumerate().filter(|(_, v)| v.role == Role::State && !v.dropped);
        list.flat_map(|(id, v)| (0..v.count()).map(move |k| (id, k))).collect()
    }

    /// Rates at a time and values of the states; relations keep their truth.
    fn rates(&mut self, states: &[(Id, usize)], time: f64, y: &[f64], after: bool) -> Done<Vec<f64>> {
        for ((id, k), value) in states.iter().zip(y) {
            self.memory[*id][*k].v = *value;
        }
        (self.time, self.after, self.trace.frozen, self.event) = (time, after, true, false);
        self.evaluate()?;
        Ok(states.iter().map(|(id, k)| self.memory[*id][*k].d).collect())
    }

    /// A step of the classic method of order 4; leaves everything computed at its end.  Gives values and rates there.
    fn advance(
        &mut self,
        states: &[(Id, usize)],
        t: f64,
        end: f64,
        y: &[f64],
        k1: &[f64],
    ) -> Done<(Vec<f64>, Vec<f64>)> {
        let h = end - t;
        let moved = |k: &[f64], c: f64| -> Vec<f64> { y.iter().zip(k).map(|(y, k)| y + c * h * k).collect() };
        let k2 = self.rates(states, t + h / 2.0, &moved(k1, 0.5), true)?;
        let k3 = self.rates(states, t + h / 2.0, &moved(&k2, 0.5), true)?;
        let k4 = self.rates(states, end, &moved(&k3, 1.0), false)?;
        let next: Vec<f64> =
            (0..y.len()).map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])).collect();
        let rates = self.rates(states, end, &next, false)?;
        Ok((next, rates))
    }

    fn calendar(&self) -> Calendar {
        let (mut samples, mut delays) = (Vec::new(), Vec::new());
        crate::visit::all(self.model, &mut |e| match e {
            Expr::Sample(start, interval) => samples.push((*start, *interval)),
            Expr::Delay(_, delay) => delays.push(*delay),
            _ => {}
        });
        delays.sort_by(f64::total_cmp);
        delays.dedup();
        let returns = delays.clone();
        Calendar { samples, delays, returns }
    }

    /// Runs from 0 with so many steps in a second and gives the values at these instants.
    pub(super) fn run(mut self, times: &[f64], steps: usize) -> Done<Solution> {
        self.start()?;
        let mut solution = Solution { times: times.to_vec(), rows: Vec::new(), events: Vec::new() };
        let mut calendar = self.calendar();
        let stop = times.last().copied().unwrap_or(0.0);
        let states = self.states();
        let mut t = 0.0;
        self.happen(t)?;
        if times.first() == Some(&0.0) {
            self.record(&mut solution);
        }
        let mut gaps: Gaps = Vec::new();
        // The rates at the end of a step without event are those at the beginning of the next.
        let mut fresh: Option<Vec<f64>> = None;
        while t < stop {
            let grid = ((t * steps as f64).floor() + 1.0) / steps as f64;
            let output = times[solution.rows.len()];
            let back = calendar.returns.iter().copied().filter(|back| *back > t).fold(f64::INFINITY, f64::min);
            let next = grid.min(output).min(back);
            let y: Vec<f64> = states.iter().map(|(id, k)| self.memory[*id][*k].v).collect();
            let before = self.trace.clone();
            let k1 = match fresh.take() {
                Some(rates) => rates,
                None => self.rates(&states, t, &y, true)?,
            };
            let (mut end, mut last) = (next, self.advance(&states, t, next, &y, &k1)?);
            let happens = self.trace.changed();
            if happens {
                let (mut low, mut high) = (t, next);
                // Time events fall on the ends of steps.
                let almost = next - 0.5 * LOCATED;
                if almost > t {
                    self.advance(&states, t, almost, &y, &k1)?;
                    *(if self.trace.changed() { &mut high } else { &mut low }) = almost;
                }
                while high - low > LOCATED {
                    let middle = 0.5 * (low + high);
                    self.advance(&states, t, middle, &y, &k1)?;
                    *(if self.trace.changed() { &mut high } else { &mut low }) = middle;
                }
                end = high;
                last = self.advance(&states, t, end, &y, &k1)?;
                self.check_crossing(&before, t, end)?;
            }
            self.remember(&states, (t, end), (&y, &k1), (&last.0, &last.1))?;
            let sampled = calendar.samples.iter().any(|(start, interval)| due(end, *start, *interval));
            let returned = calendar.returns.contains(&end);
            t = end;
            if happens || sampled || returned {
                if solution.events.last().is_some_and(|event| t - event < APART && t > *event) {
                    return Err(format!("unclear: two events near {t} s"));
                }
                solution.events.push(t);
                if calendar.returns.len() > 2000 {
                    return Err("unclear: too many events".into());
                }
                let delays = calendar.delays.clone();
                calendar.returns.extend(delays.iter().map(|delay| t + delay).filter(|back| *back < stop));
                self.happen(t)?;
                gaps.clear();
            } else {
                fresh = Some(last.1);
                self.check_gaps(&mut gaps)?;
            }
            if t == output {
                self.record(&mut solution);
            }
        }
        Ok(solution)
    }

    /// An event is clear when one quantity passes its limit with a slope, or time does.
    fn check_crossing(&self, before: &super::trace::Trace, t: f64, end: f64) -> Done<()> {
        let changed = self.trace.answers.iter().zip(&before.answers).filter(|(a, _)| a.held != a.now && !a.timed);
        let list: Vec<_> = changed.collect();
        if list.len() > 1 {
            return Err(format!("unclear: two relations change at {end} s"));
        }
        // Where the way is short, its slope is rounding.
        let slow = |gap: f64| end - t > 1e-6 && gap.abs() < SLOPE * (end - t);
        if list.iter().any(|(a, b)| slow(a.gap - b.gap)) {
            return Err(format!("unclear: a slow crossing at {end} s"));
        }
        Ok(())
    }

    /// Refuses relations that come near to their limit and go away again.
    fn check_gaps(&self, gaps: &mut Gaps) -> Done<()> {
        gaps.push(self.trace.answers.iter().map(|a| if a.timed { f64::INFINITY } else { a.gap.abs() }).collect());
        if gaps.len() > 3 {
            gaps.remove(0);
        }
        let [a, b, c] = gaps.as_slice() else { return Ok(()) };
        let touched = a.iter().zip(b).zip(c).any(|((a, b), c)| b < a && b < c && *b < NEAR);
        if touched { Err(format!("unclear: a relation is almost touched at {} s", self.time)) } else { Ok(()) }
    }

    /// Keeps the past of delayed expressions over a step.
    fn remember(
        &mut self,
        states: &[(Id, usize)],
        (t, end): (f64, f64),
        (y, k): (&[f64], &[f64]),
        (next, rates): (&[f64], &[f64]),
    ) -> Done<()> {
        if self.past.is_empty() || end <= t {
            return Ok(());
        }
        self.rates(states, t, y, true)?;
        let first = self.sources.clone();
        let middle = (0..y.len()).map(|i| 0.5 * (y[i] + next[i]) + (end - t) / 8.0 * (k[i] - rates[i]));
        let middle: Vec<f64> = middle.collect();
        self.rates(states, 0.5 * (t + end), &middle, true)?;
        let between = self.sources.clone();
        self.rates(states, end, next, false)?;
        for (site, past) in self.past.iter_mut().enumerate() {
            past.add(t, end, [first[site], between[site], self.sources[site]]);
        }
        Ok(())
    }

    /// The rounds of an event (8.6): until no discrete variable changes any more.
    fn happen(&mut self, t: f64) -> Done<()> {
        self.pre.clone_from(&self.memory);
        (self.time, self.after, self.trace.frozen, self.event, self.sampling) = (t, true, false, true, true);
        for _ in 0..MOST_ROUNDS {
            self.evaluate()?;
            let conditions = self.conditions == self.before;
            let discrete = |(id, v): (usize, &crate::model::Variable)| {
                let discrete = v.role == Role::Discrete || v.kind != crate::model::Kind::Real;
                !discrete || self.memory[id].iter().zip(&self.pre[id]).all(|(a, b)| a.v == b.v)
            };
            let settled = self.model.variables.iter().enumerate().all(discrete);
            let reinits = std::mem::take(&mut self.reinits);
            for (id, k, value) in &reinits {
                self.memory[*id][*k] = Dual::fixed(*value);
            }
            self.before.clone_from(&self.conditions);
            self.pre.clone_from(&self.memory);
            let sampled = std::mem::take(&mut self.sampling);
            if settled && reinits.is_empty() && (conditions || !sampled) {
                if sampled {
                    // Conditions of `sample` are false again after their instant.
                    self.evaluate()?;
                    self.before.clone_from(&self.conditions);
                }
                self.event = false;
                return Ok(());
            }
        }
        Err("unclear: an event without end".into())
    }

    fn record(&self, solution: &mut Solution) {
        let values = self.memory.iter().map(|list| list.iter().map(|x| x.v).collect());
        solution.rows.push(values.collect());
    }
}
