//! Shots that have not been made: like one that was, under other conditions.
//!
//! Noise, its correlation, what disturbs the channels, and which samples count are those of the shot that they are like.  What the channels
//! would show is what a model shows, so that samples on flanks are weighed as those of a record would be.

use std::collections::BTreeMap;

use crate::data::Data;
use crate::disturbance::Disturbances;
use crate::problem::{Problem, Runs};
use crate::unknowns::Meaning;
use crate::{Bench, Fault, Setup};

/// Farthest that a carried number lies from what is expected, in standard deviations.
const FAR: f64 = 11.0;

impl Setup {
    /// A bench of shots like `template`, one for each of these conditions.
    ///
    /// # Errors
    /// A mask whose formula cannot be evaluated under the conditions.
    pub(crate) fn planned(&self, template: usize, conditions: &[BTreeMap<String, f64>]) -> Result<Setup, Fault> {
        let first = self.bench.shots.iter().map(|shot| shot.number).max().unwrap_or(0) + 1;
        let shots = conditions.iter().enumerate().map(|(k, own)| {
            let mut shot = self.bench.shots[template].clone();
            (shot.number, shot.conditions) = (first + k, own.clone());
            shot
        });
        let shots = shots.collect();
        self.of_planned(Bench { shots, ..self.bench.without_shots() })
    }

    /// The same with its channels as this model shows them.
    ///
    /// # Errors
    /// A value that no variable has.
    pub(crate) fn showing(&self, problem: &Problem<'_>, xi: &[f64], runs: &Runs) -> Result<Setup, Fault> {
        let mut bench = self.bench.clone();
        for (shot, own) in bench.shots.iter_mut().enumerate() {
            for (place, channel) in self.data.channels.iter().enumerate() {
                let Some(values) = own.values.get_mut(&channel.name) else { continue };
                for (value, shown) in values.iter_mut().zip(problem.shown(xi, runs, shot, place)) {
                    if value.is_finite() {
                        *value = channel.scale * shown;
                    }
                }
            }
        }
        self.of_planned(bench)
    }

    /// The bench as it is with planned shots behind its own, which are fitted like the others.
    pub(crate) fn joined(&self, planned: &Setup) -> Setup {
        let (mut bench, mut data, mut train) = (self.bench.clone(), self.data.clone(), self.train.clone());
        let next = bench.shots.len();
        bench.shots.extend(planned.bench.shots.iter().cloned());
        data.shots.extend(planned.data.shots.iter().cloned());
        train.extend(next..bench.shots.len());
        let (held_out, disturbances) = (self.held_out.clone(), self.disturbances.clone());
        self.over((bench, data), (train, held_out), disturbances)
    }

    fn of_planned(&self, bench: Bench) -> Result<Setup, Fault> {
        let data = self.data.of_shots(&bench.shots, &self.study)?;
        let disturbances = Disturbances { spikes: Vec::new(), ..self.disturbances.clone() };
        let train = (0..bench.shots.len()).collect();
        Ok(self.over((bench, data), (train, Vec::new()), disturbances))
    }

    /// The same study over other shots.
    fn over(
        &self,
        (bench, data): (Bench, Data),
        (train, held_out): (Vec<usize>, Vec<usize>),
        disturbances: Disturbances,
    ) -> Setup {
        let (study, watch, exposed) = (self.study.clone(), self.watch.clone(), self.exposed.clone());
        Setup {
            study,
            bench,
            data,
            train,
            held_out,
            exposed,
            disturbances,
            threads: self.threads,
            foreign: self.foreign.clone(),
            watch,
        }
    }
}

/// Where a fit has left the unknowns of all shots, for another problem of the same model; what belongs to a shot is as expected,
/// and an effect with a size in every shot has its mean size.
pub(crate) fn carried(from: &Problem<'_>, xi: &[f64], to: &Problem<'_>) -> Vec<f64> {
    let carry = |own: &crate::unknowns::Unknown| {
        let is_same = |other: &crate::unknowns::Unknown| match own.effect {
            Some(part) => other.effect == Some(part),
            None => own.shot.is_none() && other.shot.is_none() && other.effect.is_none() && other.name == own.name,
        };
        let known: Vec<f64> = from
            .unknowns
            .iter()
            .zip(xi)
            .filter(|(other, _)| is_same(other))
            .map(|(other, &xi)| match (&own.meaning, &other.meaning) {
                // What it stands for may be counted from elsewhere.
                (Meaning::Value { prior, .. }, Meaning::Value { .. }) => prior.xi(other.value(xi), FAR),
                _ => xi,
            })
            .collect();
        if known.is_empty() { 0.0 } else { own.within(known.iter().sum::<f64>() / known.len() as f64) }
    };
    to.unknowns.iter().map(carry).collect()
}
