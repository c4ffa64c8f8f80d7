//! Derivatives of the residuals by the unknowns.
//!
//! Those by parameters of the model are sensitivities carried along with one run of each shot; runs that fail with them are
//! differenced.  Those by offsets, gains and the shift of a record follow from the curves of the runs.

use nalgebra::{DMatrix, DVector};

use super::{Problem, Runs, Weighing};
use crate::Fault;
use crate::machine::Job;
use crate::machine::span::Span;
use crate::threads::each;
use crate::unknowns::Meaning;

/// How a change of a run shows in a shot: the same for all parameters, so that it is computed once.
struct Sight {
    /// Output points of the run.
    span: Span,
    channels: Vec<SeenChannel>,
}

/// A measured channel of it.
struct SeenChannel {
    channel: usize,
    /// Reciprocal standard deviations of the samples.
    weights: Vec<f64>,
    /// By sample the time of the run that it shows, and its factor if it counts.
    factors: Vec<(f64, Option<f64>)>,
}

impl Problem<'_> {
    /// Derivatives of the residuals by the unknowns `which`; `step` is that of differences, in standard deviations.
    ///
    /// # Errors
    /// A run that fails to both sides.
    pub fn jacobian(
        &self,
        (xi, runs): (&[f64], &Runs),
        weighing: &Weighing,
        which: &[usize],
        step: f64,
    ) -> Result<DMatrix<f64>, Fault> {
        let rows = self.rows(weighing);
        let mut jacobian = DMatrix::zeros(rows, which.len());
        let varied: Vec<usize> = (0..which.len()).filter(|&k| self.unknowns[which[k]].is_simulated()).collect();
        let own = match self.lender {
            Some(lender) => {
                let (lent, own): (Vec<usize>, Vec<usize>) =
                    varied.iter().partition(|&&column| which[column] < lender.unknowns.len());
                let done =
                    lender.carried((&xi[..lender.unknowns.len()], runs, weighing), (which, &lent), &mut jacobian);
                if done { own } else { varied }
            }
            None => varied,
        };
        if !self.carried((xi, runs, weighing), (which, &own), &mut jacobian) {
            for (column, change) in self.differences((xi, runs), weighing, (which, &own), step)? {
                jacobian.set_column(column, &change);
            }
        }
        for (column, &unknown) in which.iter().enumerate() {
            if !self.unknowns[unknown].is_simulated() {
                jacobian.set_column(column, &self.chained((xi, runs), weighing, unknown));
            }
        }
        Ok(jacobian)
    }

    /// The column of an offset, a gain or a shift.
    fn chained(&self, (xi, runs): (&[f64], &Runs), weighing: &Weighing, unknown: usize) -> DVector<f64> {
        let (own, spans) = (&self.unknowns[unknown], self.spans(weighing.horizon));
        let slope = own.slope(xi[unknown]);
        let mut column = DVector::zeros(self.rows(weighing));
        let mut first = 0;
        for &shot in &weighing.shots {
            let data = &self.data.shots[shot];
            for (channel, trace) in data.traces.iter().enumerate() {
                let (Some(_), Some(run)) = (trace, &runs[shot]) else { continue };
                let rows = first..first + data.times.len();
                first = rows.end;
                let weights = match own.meaning {
                    Meaning::Offset { channel: of, .. }
                    | Meaning::Gain { channel: of, .. }
                    | Meaning::Course { channel: of, .. }
                    | Meaning::Lag { channel: of, .. }
                        if of != channel =>
                    {
                        continue;
                    }
                    _ if !own.touches(shot) => continue,
                    _ => self.weights(shot, channel, weighing),
                };
                let chain = self.chain(xi, shot, channel);
                let rows = &mut column.as_mut_slice()[rows];
                for ((row, &time), &weight) in rows.iter_mut().zip(&data.times).zip(&weights) {
                    let (value, rate) = spans[shot].at(&run[channel], chain.machine_time(time));
                    *row = match own.meaning {
                        _ if chain.is_clipped(value, time) => 0.0,
                        Meaning::Offset { .. } => -weight * slope,
                        Meaning::Gain { .. } => -weight * slope * value,
                        Meaning::Course { course, .. } => -weight * slope * course.value(time),
                        Meaning::Clock { .. } => weight * slope * chain.gain * rate * time,
                        _ => weight * slope * chain.gain * rate,
                    };
                }
                self.whiten(channel, &weights, rows);
            }
        }
        column
    }

    /// Columns by sensitivities; false where a run fails with them.
    fn carried(
        &self,
        (xi, runs, weighing): (&[f64], &Runs, &Weighing),
        (which, varied): (&[usize], &[usize]),
        jacobian: &mut DMatrix<f64>,
    ) -> bool {
        if varied.is_empty() {
            return true;
        }
        let job = |&shot: &usize| {
            let touching = varied.iter().map(|&column| &self.unknowns[which[column]]).filter(|u| u.touches(shot));
            let mut derived: Vec<usize> = touching.flat_map(|unknown| unknown.places().iter().copied()).collect();
            derived.sort_unstable();
            derived.dedup();
            Job { span: shot, values: self.values(xi, shot), derived }
        };
        let jobs: Vec<Job> = weighing.shots.iter().map(job).collect();
        let spans = self.spans(weighing.horizon);
        let answers = self.machine.run_derived(&spans, &self.places, &jobs);
        // Rows of one shot, column by column.
        let rows = |k: usize| -> Option<Vec<(usize, Vec<f64>)>> {
            let (job, Ok((_, derivatives))) = (&jobs[k], &answers[k]) else { return None };
            let touching = varied.iter().filter(|&&column| self.unknowns[which[column]].touches(job.span));
            let sight = self.sight((xi, runs), job.span, weighing)?;
            let part = |&column: &usize| {
                let shares = self.shares(xi, which[column], job);
                let change = |channel: usize| -> Vec<f64> {
                    let points = 0..=spans[job.span].intervals;
                    let sum = |k| shares.iter().map(|&(by, share)| share * derivatives[by][channel][k]).sum();
                    points.map(sum).collect()
                };
                Some((column, self.response_of(&sight, &change)?))
            };
            touching.map(part).collect()
        };
        let mut first = 0;
        for (job, parts) in jobs.iter().zip(each(self.machine.threads(), jobs.len(), &rows)) {
            let Some(parts) = parts else { return false };
            for (column, part) in parts {
                jacobian.view_mut((first, column), (part.len(), 1)).copy_from_slice(&part);
            }
            first += self.rows_of(job.span);
        }
        true
    }

    /// How much each derived parameter of a run changes with an unknown: position among the derived ones, and change
    /// per unit of `xi`.
    fn shares(&self, xi: &[f64], unknown: usize, job: &Job) -> Vec<(usize, f64)> {
        let (meaning, at) = (&self.unknowns[unknown], xi[unknown]);
        let share = |&place: &usize| {
            let position = job.derived.iter().position(|&derived| derived == place)?;
            let slope = match &meaning.meaning {
                // The factor may be zero, so that what it multiplies is computed without it.
                Meaning::Relative { .. } => {
                    let mut without = xi.to_vec();
                    without[unknown] = 0.0;
                    self.values(&without, job.span)[place] / meaning.value(0.0) * meaning.slope(at)
                }
                _ => meaning.slope(at),
            };
            Some((position, slope))
        };
        meaning.places().iter().filter_map(share).collect()
    }

    /// Change of the whitened residuals of a shot with a change of the channels of its run; none where it is not a number.
    pub(crate) fn response(
        &self,
        at: (&[f64], &Runs),
        shot: usize,
        change: &dyn Fn(usize) -> Vec<f64>,
        weighing: &Weighing,
    ) -> Option<Vec<f64>> {
        self.response_of(&self.sight(at, shot, weighing)?, change)
    }

    /// How changes of the run of a shot show; none for a shot that was not run.
    fn sight(&self, (xi, runs): (&[f64], &Runs), shot: usize, weighing: &Weighing) -> Option<Sight> {
        let (data, span) = (&self.data.shots[shot], self.spans(weighing.horizon).swap_remove(shot));
        let run = runs[shot].as_ref()?;
        let measured = data.traces.iter().enumerate().filter(|(_, trace)| trace.is_some());
        let channels = measured.map(|(channel, _)| {
            let chain = self.chain(xi, shot, channel);
            let weights = self.weights(shot, channel, weighing);
            let factor = |(&time, &weight): (&f64, &f64)| {
                let at = chain.machine_time(time);
                let counts = weight > 0.0 && !chain.is_clipped(span.at(&run[channel], at).0, time);
                (at, if counts { Some(-chain.gain * weight) } else { None })
            };
            let factors = data.times.iter().zip(&weights).map(factor).collect();
            SeenChannel { channel, weights, factors }
        });
        let channels = channels.collect();
        Some(Sight { span, channels })
    }

    /// The change of the whitened residuals with one change of the channels; none where it is not a number.
    fn response_of(&self, sight: &Sight, change: &dyn Fn(usize) -> Vec<f64>) -> Option<Vec<f64>> {
        let mut all = Vec::with_capacity(sight.channels.iter().map(|own| own.weights.len()).sum());
        for SeenChannel { channel, weights, factors } in &sight.channels {
            let begin = all.len();
            let series = change(*channel);
            all.extend(
                factors.iter().map(|&(at, factor)| factor.map_or(0.0, |own| own * sight.span.at(&series, at).0)),
            );
            self.whiten(*channel, weights, &mut all[begin..]);
        }
        all.iter().all(|value| value.is_finite()).then_some(all)
    }

    /// Columns of the unknowns that need runs.
    fn differences(
        &self,
        (xi, runs): (&[f64], &Runs),
        weighing: &Weighing,
        (which, varied): (&[usize], &[usize]),
        step: f64,
    ) -> Result<Vec<(usize, DVector<f64>)>, Fault> {
        let mut jobs = Vec::new();
        let mut owners = Vec::new();
        for &column in varied {
            let unknown = which[column];
            let mut moved = xi.to_vec();
            moved[unknown] += step;
            for &shot in weighing.shots.iter().filter(|&&shot| self.unknowns[unknown].touches(shot)) {
                jobs.push(Job { span: shot, values: self.values(&moved, shot), derived: Vec::new() });
                owners.push(column);
            }
        }
        let spans = self.spans(weighing.horizon);
        let answers = self.machine.run(&spans, &self.places, &jobs);
        let mut columns: Vec<(usize, Runs, f64)> = varied.iter().map(|&column| (column, runs.clone(), step)).collect();
        let mut failed: Vec<(usize, usize)> = Vec::new();
        for ((job, owner), answer) in jobs.iter().zip(&owners).zip(answers) {
            let Some(position) = varied.iter().position(|column| column == owner) else { continue };
            match answer {
                Ok(series) => columns[position].1[job.span] = Some(series),
                Err(_) => failed.push((position, job.span)),
            }
        }
        // To the other side where a run failed.
        failed.dedup_by_key(|(position, _)| *position);
        for (position, _) in failed {
            let mut moved = xi.to_vec();
            moved[which[columns[position].0]] -= step;
            let touched =
                weighing.shots.iter().copied().filter(|&shot| self.unknowns[which[columns[position].0]].touches(shot));
            let part = Weighing { shots: touched.collect(), ..weighing.clone() };
            let back = self.simulate(&moved, &part)?;
            columns[position].1 = back.into_iter().zip(runs).map(|(new, old)| new.or_else(|| old.clone())).collect();
            columns[position].2 = -step;
        }
        let changes = columns
            .into_iter()
            .map(|(column, other, step)| (column, self.signature(xi, runs, &other, weighing) / step));
        Ok(changes.collect())
    }
}
