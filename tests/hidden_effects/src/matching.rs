//! The simple method that a search has to beat: sparse regression on matched derivatives.
//!
//! Signals are smoothed by local parabolas (Savitzky, Golay 1964), put with their derivatives into the lab's equations
//! at the numbers that the lab believes, and what is left of each equation is regressed on what its parameters may be
//! off by.  A term of an effect is added where it lowers the Bayesian information criterion most (Schwarz 1978), as in
//! sparse identification (Brunton, Proctor, Kutz 2016).  It sees the true equations and the usual terms, and no model
//! is run; equations of which a signal is missing are left out.

use crate::draft::{Draft, PUMP_OFF};
use crate::machine::{Inductance, Machine};
use crate::measure::times;
use crate::power::solve;

/// Samples to each side of the parabola.
const REACH: usize = 5;
/// Drop of the criterion that a name takes.
const NEEDED: f64 = 10.0;
/// Softness of a sign, m/s.
const SLOW: f64 = 5e-3;

/// A signal with its derivatives.
struct Smooth {
    value: Vec<f64>,
    rate: Vec<f64>,
    second: Vec<f64>,
}

/// Columns of an equation: what is left of it, what parameters may explain of it, terms of effects.  At least one term
/// of the equation (a mass times its acceleration, the voltage, the swept volume) is not a column, or nothing would ever
/// be left.
#[derive(Default)]
struct Equation {
    left: Vec<f64>,
    known: Vec<Vec<f64>>,
    terms: Vec<(&'static str, Vec<f64>)>,
}

/// The effect whose term explains most, if it explains enough.
pub fn name(draft: &Draft, recorded: &[Vec<[f64; 6]>]) -> Option<&'static str> {
    let mut equations: [Equation; 5] = Default::default();
    let last = draft.shots.len().saturating_sub(1).max(1) as f64;
    for (place, rows) in recorded.iter().enumerate() {
        let has = |channel: usize| draft.channels.contains(&channel);
        let smooth =
            |channel: usize| has(channel).then(|| smooth(&rows.iter().map(|row| row[channel]).collect::<Vec<_>>()));
        let signals = [0, 1, 2, 3, 4, 5].map(smooth);
        let shot = Seen { draft, machine: Machine::nominal(), signals, place, warm: place as f64 / last };
        shot.circuit(&mut equations[0]);
        shot.spool(&mut equations[1]);
        shot.valve(&mut equations[2]);
        shot.chamber(&mut equations[3]);
        shot.supply(&mut equations[4]);
    }
    let best = equations.iter().flat_map(Equation::gains).max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 > NEEDED).then_some(best.0)
}

/// Values and derivatives of the parabolas through `2 REACH + 1` samples.
fn smooth(samples: &[f64]) -> Smooth {
    let step = times()[1] - times()[0];
    let reach = REACH as f64;
    let count = 2.0 * reach + 1.0;
    let (two, four) = (-(REACH as i32)..=REACH as i32).fold((0.0, 0.0), |(two, four), k| {
        let square = f64::from(k * k);
        (two + square, four + square * square)
    });
    let determinant = count * four - two * two;
    let mut smooth = Smooth { value: Vec::new(), rate: Vec::new(), second: Vec::new() };
    for at in 0..samples.len() {
        let (mut sum, mut first, mut square) = (0.0, 0.0, 0.0);
        for k in 0..=2 * REACH {
            let offset = k as f64 - reach;
            let value = samples[(at + k).saturating_sub(REACH).min(samples.len() - 1)];
            sum += value;
            first += offset * value;
            square += offset * offset * value;
        }
        smooth.value.push((four * sum - two * square) / determinant);
        smooth.rate.push(first / two / step);
        smooth.second.push(2.0 * (count * square - two * sum) / determinant / (step * step));
    }
    smooth
}

/// A shot as the lab sees it.
struct Seen<'a> {
    draft: &'a Draft,
    machine: Machine,
    signals: [Option<Smooth>; 6],
    place: usize,
    warm: f64,
}

impl Seen<'_> {
    /// Sample numbers and times whose parabola lies in the record and has no switching in it.
    fn samples(&self) -> impl Iterator<Item = (usize, f64)> {
        let (times, pulse) = (times(), self.draft.shots[self.place].stated.pulse);
        let reach = (REACH as f64 + 1.5) * (times[1] - times[0]);
        let last = times.len() - REACH;
        let is_smooth = move |time: f64| time > reach && (time - pulse).abs() > reach;
        times.into_iter().enumerate().filter(move |(at, time)| *at < last && is_smooth(*time))
    }

    fn supply_pressure(&self, at: usize) -> f64 {
        self.signals[5].as_ref().map_or(self.draft.shots[self.place].stated.p_0, |signal| signal.value[at])
    }

    fn circuit(&self, equation: &mut Equation) {
        let [Some(u), Some(i), Some(x), ..] = &self.signals else { return };
        let (circuit, pulse) = (&self.machine.circuit, self.draft.shots[self.place].stated.pulse);
        for (at, time) in self.samples() {
            let closed = f64::from(u8::from(time < pulse));
            let (l, slope) = match self.draft.believed {
                Inductance::Constant => self.machine.inductance(0.0),
                _ => self.machine.inductance(x.value[at]),
            };
            let (current, rate, speed) = (i.value[at], i.rate[at], x.rate[at]);
            let motion = slope * speed * current;
            let believed = if self.draft.believed == Inductance::Moving { motion } else { 0.0 };
            let diode = (1.0 - closed) * circuit.v_fw * (current / circuit.i_sm).tanh();
            let resistance = circuit.r + closed * circuit.r_w + (1.0 - closed) * circuit.r_fw;
            let driving = closed * u.value[at] - resistance * current - diode;
            let (true_l, true_slope) = self.machine.inductance(x.value[at]);
            let flux = (true_l * current / 0.05).abs();
            let bend = 7.0 * flux.powi(6) * (true_l * rate + true_slope * speed * current);
            let change = closed * u.rate[at] - resistance * rate - l * i.second[at];
            equation.add(
                driving - l * rate - believed,
                &[current, closed * current, diode, rate],
                &[
                    ("eddy_currents", change + l * i.second[at]),
                    ("magnetic_saturation", bend),
                    ("coil_heating", self.warm * current),
                    ("motional_emf", if self.draft.believed == Inductance::Motionless { motion } else { 0.0 }),
                    (
                        "variable_inductance",
                        if self.draft.believed == Inductance::Constant {
                            (true_l - l) * rate + true_slope * speed * current
                        } else {
                            0.0
                        },
                    ),
                    ("trigger_delay", if time < 7e-4 { u.value[at] } else { 0.0 }),
                    ("sensor_lag", l * i.second[at] + resistance * rate),
                ],
            );
        }
    }

    fn spool(&self, equation: &mut Equation) {
        let [_, Some(i), Some(x), _, Some(p), _] = &self.signals else { return };
        for (at, _) in self.samples().filter(|(at, _)| (2e-5..4.3e-4).contains(&x.value[*at])) {
            let (speed, p_0) = (x.rate[at], self.supply_pressure(at));
            let force = self.machine.spool_force(x.value[at], speed, i.value[at], p_0, p.value[at]);
            let (_, slope) = self.machine.inductance(x.value[at]);
            let sign = speed / (speed * speed + SLOW * SLOW).sqrt();
            equation.add(
                force - self.machine.spool.mass * x.second[at],
                &[1.0, x.value[at], speed, p_0, p.value[at], i.value[at].powi(2) * slope],
                &[
                    ("spool_stiction", sign),
                    ("spool_flow_force", x.value[at] * (p_0 - p.value[at])),
                    ("oil_temperature", self.warm * speed),
                ],
            );
        }
    }

    fn valve(&self, equation: &mut Equation) {
        let [_, _, _, Some(y), Some(p), _] = &self.signals else { return };
        let valve = &self.machine.valve;
        for (at, _) in self.samples().filter(|(at, _)| y.value[*at] > 5e-5) {
            let (lift, speed) = (y.value[at], y.rate[at]);
            let (force, deep) = (self.machine.valve_force(lift, speed, p.value[at]), (lift - valve.y_max).max(0.0));
            let sign = speed / (speed * speed + SLOW * SLOW).sqrt();
            equation.add(
                force - valve.mass * y.second[at],
                &[1.0, lift, speed, p.value[at], deep, deep * speed],
                &[
                    ("piston_friction", sign),
                    ("seat_cushion", speed / (1.0 + lift / 5e-4).powi(3)),
                    ("stop_elasticity", deep * deep),
                    ("oil_temperature", self.warm * speed),
                ],
            );
        }
    }

    fn chamber(&self, equation: &mut Equation) {
        let [_, _, Some(x), Some(y), Some(p), _] = &self.signals else { return };
        let (chamber, area) = (&self.machine.chamber, self.machine.valve.area);
        let mut inside = 0.0;
        for (at, _) in self.samples() {
            let (pressure, rate) = (p.value[at], p.rate[at]);
            let inflow = self.machine.inflow(x.value[at], self.supply_pressure(at) - pressure);
            let outflow = self.machine.outflow(x.value[at], pressure - chamber.p_z);
            let volume = chamber.v_0 + area * y.value[at];
            inside += inflow * (times()[1] - times()[0]);
            let early = f64::from(u8::from(inside < 0.08 * chamber.v_0));
            let low = f64::from(u8::from(pressure < 0.5 * chamber.p_z));
            equation.add(
                inflow - outflow - area * y.rate[at] - volume / chamber.bulk * rate,
                &[inflow, outflow, volume / chamber.bulk * rate],
                &[
                    ("chamber_leakage", pressure - chamber.p_z),
                    ("incomplete_filling", early * inflow),
                    ("entrained_air", volume * rate * (1e5 / pressure.max(2e4)).powf(0.8) / pressure.max(2e4)),
                    ("cavitation", low * (area * y.rate[at] - inflow)),
                    ("connecting_pipe", volume * p.second[at]),
                    ("sensor_lag", volume / chamber.bulk * p.second[at]),
                ],
            );
        }
    }

    fn supply(&self, equation: &mut Equation) {
        let [_, _, Some(x), _, Some(p), Some(p_0)] = &self.signals else { return };
        let stated = self.draft.shots[self.place].stated.p_0;
        if stated <= PUMP_OFF {
            return;
        }
        let inflow = |at: usize| self.machine.inflow(x.value[at], p_0.value[at] - p.value[at]);
        for (at, _) in self.samples() {
            let change = inflow(at + 1) - inflow(at - 1);
            let flows = [("supply_line", inflow(at)), ("supply_line", change)];
            equation.add(p_0.value[at] - stated, &[1.0, stated], &flows);
        }
    }
}

impl Equation {
    fn add(&mut self, left: f64, known: &[f64], terms: &[(&'static str, f64)]) {
        self.known.resize_with(known.len(), Vec::new);
        if self.terms.is_empty() {
            self.terms = terms.iter().map(|(id, _)| (*id, Vec::new())).collect();
        }
        self.left.push(left);
        self.known.iter_mut().zip(known).for_each(|(column, value)| column.push(*value));
        self.terms.iter_mut().zip(terms).for_each(|(column, (_, value))| column.1.push(*value));
    }

    /// By how much each term lowers the criterion; neighbouring samples of smooth signals count as one.
    fn gains(&self) -> Vec<(&'static str, f64)> {
        let apart = self.left.len() as f64 / (2 * REACH + 1) as f64;
        if apart < 10.0 {
            return Vec::new();
        }
        let mut columns: Vec<&[f64]> = self.known.iter().map(Vec::as_slice).collect();
        let without = self.residue(&columns);
        let mut gains = Vec::new();
        for (id, term) in self.terms.iter().filter(|(_, term)| term.iter().any(|value| *value != 0.0)) {
            columns.push(term);
            gains.push((*id, apart * (without / self.residue(&columns)).ln() - apart.ln()));
            columns.pop();
        }
        gains
    }

    /// Sum of squares that a regression on these columns leaves.
    fn residue(&self, columns: &[&[f64]]) -> f64 {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let sizes: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt().max(1e-300)).collect();
        let normal =
            |a: usize, b: usize| dot(columns[a], columns[b]) / (sizes[a] * sizes[b]) + if a == b { 1e-9 } else { 0.0 };
        let matrix = (0..columns.len()).map(|a| (0..columns.len()).map(|b| normal(a, b)).collect()).collect();
        let right: Vec<f64> = columns.iter().zip(&sizes).map(|(column, size)| dot(column, &self.left) / size).collect();
        let found = solve(matrix, right.clone());
        (dot(&self.left, &self.left) - dot(&found, &right)).max(1e-300)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draft::{Points, Request};
    use crate::measure;

    #[test]
    fn parabolas_are_met_exactly() {
        let step = times()[1] - times()[0];
        let samples: Vec<f64> = (0..100).map(|k| (k as f64 * step - 2e-3).powi(2)).collect();
        let smooth = smooth(&samples);
        for at in [10, 50, 80] {
            let time = at as f64 * step - 2e-3;
            assert!((smooth.value[at] - time * time).abs() < 1e-15);
            assert!((smooth.rate[at] - 2.0 * time).abs() < 1e-10 && (smooth.second[at] - 2.0).abs() < 1e-6);
        }
    }

    /// Where every signal is measured a large change of a law is found: the method is not a straw man.
    #[test]
    fn a_wrong_flux_law_is_named() {
        for seed in 1..40 {
            let effects = vec![("variable_inductance".to_string(), 1.0)];
            let draft = Draft::draw(&Request {
                name: "d".into(),
                seed,
                effects,
                disturbances: Vec::new(),
                points: Points::default(),
            })
            .expect("a draft");
            if draft.channels.len() == 6 {
                let (_, recorded) = measure::all(&draft).expect("runs");
                assert_eq!(name(&draft, &recorded), Some("variable_inductance"));
                return;
            }
        }
        panic!("no draft with all channels");
    }
}
