//! Initial values where Newton's method fails from the start values: found from elsewhere, or not at all.
//!
//! In this order: start values of zero moved to what is usual for their units, as no temperature is near 0 K; moved away from zero, since many laws are vertical or flat there; the equations relaxed to what the
//! start values fulfil and led back, `G(x) = (1 - s) G(x0)` for `s` from 0 to 1 (Newton homotopy: Allgower, Georg 2003,
//! *Introduction to Numerical Continuation Methods*, chapter 2); the way through the pieces of equations that have kinks
//! ([`crate::corrector::kinks`]); starts scattered around those given, further out each time.  What is
//! found solves the equations as given, but may be another solution than the one that was meant, so a warning says so, with the
//! fewest start values found that lead there.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use hyd_system::{Tables, significant};

use super::{InitialSystem, TOLERANCE, View};
use crate::corrector::kinks::pass_pieces;
use crate::corrector::relaxed::lead_back;
use crate::problem::Problem;

/// Sizes that are usual for units whose zero is far from them.
const USUAL: [(&str, f64); 6] =
    [("K", 300.0), ("Pa", 1e5), ("bar", 1.0), ("kg/m3", 100.0), ("J/kg", 1e5), ("J/(kg.K)", 1e3)];
/// Places, in nominal values, to which start values of zero are moved.
const AWAY: [f64; 3] = [1.0, 0.01, -1.0];
/// Distances of scattered starts, in nominal values or start values if these are larger, and starts at each distance.
const DISTANCES: [f64; 5] = [0.3, 1.0, 3.0, 10.0, 30.0];
const STARTS_EACH: u32 = 5;
/// No further start is tried after so many factorisations.
const MOST_FACTORISATIONS: u64 = 3000;
/// Start values tried one by one, and several at once.
const MOST_ALONE: usize = 16;
const MOST_TOGETHER: usize = 32;
/// Solutions that differ by less, relative to values and nominals, are the same.
const SAME: f64 = 1e-6;
/// Digits of start values that are proposed.
const DIGITS: usize = 3;
/// Start values that a message names.
const MOST_NAMED: usize = 6;

/// From where initial values were found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
pub enum RescueStage {
    /// From start values of zero moved to what is usual for their units.
    UsualSizes,
    /// From start values of zero moved away from it.
    AwayFromZero,
    /// From equations that the start values fulfil, led back to those given.
    Relaxed,
    /// Piece by piece, in equations with kinks.
    Pieces,
    /// From starts scattered around those given.
    Scattered,
}

/// A start value that leads to a solution, beside the one that does not.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct OtherStart {
    /// Name of the variable.
    pub name: String,
    /// The start value as it is.
    pub given: f64,
    /// One that works.
    pub works: f64,
}

/// Initial values were found, but not from the start values.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct Rescue {
    /// Start time (s).
    pub time: f64,
    /// From where.
    pub stage: RescueStage,
    /// Start values from which Newton's method reaches them; empty if none of the lists tried does.
    pub starts: Vec<OtherStart>,
}

impl fmt::Display for RescueStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RescueStage::UsualSizes => "with start values of zero replaced by what is usual for their units",
            RescueStage::AwayFromZero => "with start values of zero moved away from it",
            RescueStage::Relaxed => "by way of relaxed equations",
            RescueStage::Pieces => "piece by piece, in equations that have kinks",
            RescueStage::Scattered => "from other start values",
        })
    }
}

impl fmt::Display for Rescue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = significant(self.time);
        write!(f, "the start values lead to no initial values at t = {time} s; they were found {}", self.stage)?;
        if self.starts.is_empty() {
            return write!(f, ", and there may be other solutions: check them");
        }
        write!(f, ", and there may be other solutions: check them and set ")?;
        for (k, start) in self.starts.iter().take(MOST_NAMED).enumerate() {
            let comma = if k == 0 { "" } else { ", " };
            write!(
                f,
                "{comma}`{}(start = {})` instead of {}",
                start.name,
                significant(start.works),
                significant(start.given)
            )?;
        }
        match self.starts.len().saturating_sub(MOST_NAMED) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

impl InitialSystem {
    /// Looks for a solution elsewhere and leaves it in `newton.x`; else the number of starts that were tried in vain.
    pub(super) fn rescue(&mut self, problem: &mut Problem<'_>, t: f64, guess: &[f64]) -> Result<Rescue, usize> {
        let spent = problem.statistics.factorisations;
        let mut tried = 0usize;
        let mut found = None;
        if let Some(from) = usual_sizes(problem.system.tables(), guess) {
            tried += 1;
            found = self.reaches(problem, t, &from).then_some(RescueStage::UsualSizes);
        }
        if found.is_none() && guess.contains(&0.0) {
            for place in AWAY {
                let moved = |k: usize| place * self.newton.nominals[k] * (1.0 + 0.1 * scatter(k as u32, 0));
                let from: Vec<f64> =
                    (0..guess.len()).map(|k| if guess[k] == 0.0 { moved(k) } else { guess[k] }).collect();
                tried += 1;
                if self.reaches(problem, t, &from) {
                    found = Some(RescueStage::AwayFromZero);
                    break;
                }
            }
        }
        if found.is_none() {
            tried += 1;
            found = self.lead_back(problem, t, guess).then_some(RescueStage::Relaxed);
        }
        if found.is_none() {
            tried += 1;
            found = self.pass_pieces(problem, t, guess).then_some(RescueStage::Pieces);
        }
        let starts = DISTANCES.iter().flat_map(|&distance| (1..=STARTS_EACH).map(move |seed| (distance, seed)));
        for (number, (distance, seed)) in starts.enumerate() {
            if found.is_some() || problem.statistics.factorisations - spent > MOST_FACTORISATIONS {
                break;
            }
            let size = |k: usize| guess[k].abs().max(self.newton.nominals[k]);
            let place =
                |k: usize| guess[k] + distance * size(k) * scatter(k as u32, seed + STARTS_EACH * number as u32);
            let from: Vec<f64> = (0..guess.len()).map(place).collect();
            tried += 1;
            found = self.reaches(problem, t, &from).then_some(RescueStage::Scattered);
        }
        let Some(stage) = found else { return Err(tried) };
        let solution = self.newton.x.clone();
        let starts = self.fewest_starts(problem, t, guess, &solution);
        // The solution is taken as it was found, whatever was tried since.
        self.newton.x.copy_from_slice(&solution);
        let name = |k: usize| problem.system.tables().initial_unknowns[k].to_string();
        let starts = starts.into_iter().map(|(k, works)| OtherStart { name: name(k), given: guess[k], works });
        Ok(Rescue { time: t, stage, starts: starts.collect() })
    }

    /// Newton's method from there leads to a solution, which stands in `newton.x`.
    fn reaches(&mut self, problem: &mut Problem<'_>, t: f64, from: &[f64]) -> bool {
        self.newton.x.copy_from_slice(from);
        self.newton.solve(&mut View { core: &mut self.core, problem, t }, TOLERANCE).is_ok()
            && self.newton.x.iter().all(|x| x.is_finite())
    }

    /// Through the pieces from there.
    fn pass_pieces(&mut self, problem: &mut Problem<'_>, t: f64, guess: &[f64]) -> bool {
        self.newton.x.copy_from_slice(guess);
        let mut view = View { core: &mut self.core, problem, t };
        pass_pieces(&mut self.newton, &mut view, TOLERANCE) && self.newton.solve(&mut view, TOLERANCE).is_ok()
    }

    /// From the equations that the guess fulfils back to those given.
    fn lead_back(&mut self, problem: &mut Problem<'_>, t: f64, guess: &[f64]) -> bool {
        lead_back(&mut self.newton, &mut View { core: &mut self.core, problem, t }, guess, TOLERANCE)
    }

    /// The fewest start values found that lead to the solution, the others as given.
    fn fewest_starts(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        guess: &[f64],
        solution: &[f64],
    ) -> Vec<(usize, f64)> {
        let tables = problem.system.tables().clone();
        // Only the start value of a variable itself can be set, not that of its derivative.
        let can_be_set = |k: &usize| tables.initial_unknowns.get(*k).is_some_and(|name| !name.starts_with("der("));
        let nominals = self.newton.nominals.clone();
        let size = |k: usize| solution[k].abs().max(nominals[k]);
        let change = |k: usize| (solution[k] - guess[k]).abs() / size(k);
        let mut order: Vec<usize> = (0..guess.len()).filter(can_be_set).filter(|&k| change(k) > SAME).collect();
        let decisive = self.curvature(problem, t, guess);
        let weight = |k: usize| decisive.as_ref().map_or(0.0, |found| found.of_unknown[k]);
        order.sort_by(|&a, &b| weight(b).total_cmp(&weight(a)).then(change(b).total_cmp(&change(a))));
        let works = |system: &mut Self, problem: &mut Problem<'_>, set: &[usize]| {
            let mut from = guess.to_vec();
            set.iter().for_each(|&k| from[k] = rounded(solution[k]));
            system.reaches(problem, t, &from) && {
                (0..guess.len()).all(|k| (system.newton.x[k] - solution[k]).abs() <= SAME * size(k))
            }
        };
        let valued = |set: Vec<usize>| set.into_iter().map(|k| (k, rounded(solution[k]))).collect();
        for &k in order.iter().take(MOST_ALONE) {
            if works(self, problem, &[k]) {
                return valued(vec![k]);
            }
        }
        let mut set: Vec<usize> = Vec::new();
        let mut is_enough = false;
        for &k in order.iter().take(MOST_TOGETHER) {
            set.push(k);
            is_enough = set.len() > 1 && works(self, problem, &set);
            if is_enough {
                break;
            }
        }
        if !is_enough {
            return Vec::new();
        }
        for k in set.clone() {
            let fewer: Vec<usize> = set.iter().copied().filter(|&other| other != k).collect();
            if !fewer.is_empty() && works(self, problem, &fewer) {
                set = fewer;
            }
        }
        valued(set)
    }
}

/// The guess with zeros replaced by what is usual for the units of their variables; none where no unit says so.
fn usual_sizes(tables: &Tables, guess: &[f64]) -> Option<Vec<f64>> {
    let usual = |unit: &str| USUAL.iter().find(|(own, _)| *own == unit).map(|&(_, size)| size);
    let mut sizes: HashMap<String, f64> = HashMap::new();
    for variable in &tables.variables {
        let Some(size) = usual(&variable.unit) else { continue };
        sizes.extend((0..variable.sources.len()).map(|element| (variable.name.element(element), size)));
    }
    let moved = |(&value, name): (&f64, &Arc<str>)| sizes.get(&**name).copied().filter(|_| value == 0.0);
    let moved: Vec<Option<f64>> = guess.iter().zip(&tables.initial_unknowns).map(moved).collect();
    let is_moved = moved.iter().any(Option::is_some);
    is_moved.then(|| moved.iter().zip(guess).map(|(size, &value)| size.unwrap_or(value)).collect())
}

/// A few digits of a number.
fn rounded(value: f64) -> f64 {
    // Through its text, so that the number is the one that is written.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// A number between -1 and 1, the same in every run (multiplicative hashing, Knuth 1998, section 6.4).
fn scatter(unknown: u32, seed: u32) -> f64 {
    let key = unknown.wrapping_mul(0x85eb_ca6b) ^ seed.wrapping_mul(0x9e37_79b9);
    let hash = key.wrapping_add(1).wrapping_mul(2_654_435_769);
    2.0 * (f64::from(hash >> 8) / f64::from(1_u32 << 24)) - 1.0
}

#[cfg(test)]
mod tests {
    use super::{rounded, scatter};

    #[test]
    fn numbers_are_cut_to_digits_that_can_be_written() {
        for (value, expected) in [(1.23456, 1.23), (-0.000987654, -0.000988), (123_456.0, 123_000.0), (0.0, 0.0)] {
            assert_eq!(rounded(value), expected);
        }
    }

    #[test]
    fn scattered_numbers_fill_the_interval() {
        let all: Vec<f64> = (0..1000).map(|k| scatter(k, 3)).collect();
        assert!(all.iter().all(|x| (-1.0..1.0).contains(x)));
        for quarter in 0..4 {
            let from = -1.0 + 0.5 * f64::from(quarter);
            let inside = all.iter().filter(|x| (from..from + 0.5).contains(*x)).count();
            assert!((200..300).contains(&inside), "{inside} from {from}");
        }
    }
}
