//! Derivatives of a text with units in it: which entries there are, and their values.
//!
//! What the text and the units know of their own derivatives is taken from them.  Those by what the text reads of units, and of what it gives
//! them, are differences by the square root of rounding.

use hyd_system::{Pattern, Structure};

use super::wiring::pattern;
use super::{Part, Sizes, Whole};

/// Square root of the rounding of numbers of eight bytes.
const STEP: f64 = 1.490_116_119_384_765_6e-8;

/// Where entries stand among the values of the patterns.
#[derive(Default)]
pub(super) struct Positions {
    /// Of the entries of the text, by states and by rates.
    text: (Vec<usize>, Vec<usize>),
    /// Per coupled unknown: rows of the text, column by column.
    by_read: Vec<Vec<usize>>,
    /// Per unit: position, and entry of the unit's own Jacobian.
    units: Vec<Vec<(usize, usize)>>,
    /// Entries that are one: coupled unknowns by themselves; rates of states of units.
    ones: (Vec<usize>, Vec<usize>),
    /// Per value that is given.
    given: Vec<GivenRow>,
    /// Of the initial system: entries of the text; rows of the text by what is read; ones; what is given by all unknowns of the text, and by
    /// what is read.
    initial_text: Vec<usize>,
    initial_by_read: Vec<Vec<usize>>,
    initial_ones: Vec<usize>,
    initial_given: Vec<(Vec<usize>, Vec<usize>)>,
    /// What is read by what is given: position, and entry of the unit's own Jacobian.
    initial_units: Vec<Vec<(usize, usize)>>,
}

/// Entries of a value that is given: by each unknown of the text, by each of its rates, by each value that is read.
struct GivenRow {
    by_unknown: Vec<usize>,
    by_rate: Vec<Option<usize>>,
    by_read: Vec<usize>,
}

/// Position of an entry.
fn find(pattern: &Pattern, row: usize, column: usize) -> usize {
    let range = pattern.column(column);
    let at = pattern.row_indices[range.clone()].binary_search(&(row as u32)).unwrap_or_default();
    range.start + at
}

fn pairs(pattern: &Pattern) -> impl Iterator<Item = (u32, u32)> + '_ {
    let of = move |c: usize| pattern.column(c).map(move |k| (pattern.row_indices[k], c as u32));
    (0..pattern.columns()).flat_map(of)
}

/// Row and column among all unknowns of an entry of a unit's own Jacobian; a value that is watched may be read several times.
fn of_unit(part: &Part) -> Vec<(usize, usize, usize)> {
    let (starts, rows) = part.unit.whole();
    let states = part.x.len();
    let mut found = Vec::new();
    for column in 0..starts.len().saturating_sub(1) {
        let columns: Vec<usize> = match column < states {
            true => vec![part.x.start + column],
            false => {
                let own = part.gives.iter().enumerate();
                own.filter(|(_, (_, _, at))| *at == Some(column - states)).map(|(k, _)| part.w.start + k).collect()
            }
        };
        for k in starts[column] as usize..starts[column + 1] as usize {
            let row = rows[k] as usize;
            let rows: Vec<usize> = match row < states {
                true => vec![part.x.start + row],
                false => {
                    let own = part.reads.iter().enumerate();
                    own.filter(|(_, (_, place))| *place == row - states).map(|(k, _)| part.y.start + k).collect()
                }
            };
            found.extend(rows.iter().flat_map(|&row| columns.iter().map(move |&column| (row, column, k))));
        }
    }
    found
}

impl Positions {
    /// Positions, and the patterns by states, by rates, and of the initial system.
    pub(super) fn new(text: &Structure, parts: &[Part], sizes: Sizes) -> (Self, Pattern, Pattern, Pattern) {
        let Sizes { unknowns: n, initial: m, first, coupled, .. } = sizes;
        let all = first + coupled;
        let reads: Vec<usize> = parts.iter().flat_map(|part| part.y.clone()).collect();
        let gives: Vec<usize> = parts.iter().flat_map(|part| part.w.clone()).collect();
        let units: Vec<Vec<(usize, usize, usize)>> = parts.iter().map(of_unit).collect();
        let at = |row: usize, column: usize| (row as u32, column as u32);
        let mut state: Vec<(u32, u32)> = pairs(&text.state_pattern).collect();
        let mut rate: Vec<(u32, u32)> = pairs(&text.rate_pattern).collect();
        state.extend(reads.iter().flat_map(|&y| (0..n).map(move |row| at(row, y))));
        state.extend(units.iter().flatten().map(|&(row, column, _)| at(row, column)));
        state.extend((n..all).map(|k| at(k, k)));
        rate.extend((n..first).map(|k| at(k, k)));
        for &w in &gives {
            state.extend((0..n).chain(reads.iter().copied()).map(|column| at(w, column)));
            rate.extend((0..n).filter(|&column| text.differential[column]).map(|column| at(w, column)));
        }
        let (state, rate) = (pattern(all, &state), pattern(all, &rate));
        // In the initial system what is read and given stands behind the unknowns of the text.
        let moved = |k: usize| k - first + m;
        let mut initial: Vec<(u32, u32)> = pairs(&text.initial.pattern).collect();
        initial.extend(reads.iter().flat_map(|&y| (0..m).map(move |row| at(row, moved(y)))));
        let coupling = |&(row, column, _): &(usize, usize, usize)| row >= first && column >= first;
        let kept = units.iter().flatten().filter(|entry| coupling(entry));
        initial.extend(kept.map(|&(row, column, _)| at(moved(row), moved(column))));
        initial.extend((m..m + coupled).map(|k| at(k, k)));
        for &w in &gives {
            initial.extend((0..m).chain(reads.iter().map(|&y| moved(y))).map(|column| at(moved(w), column)));
        }
        let initial = pattern(m + coupled, &initial);
        let positions = Self {
            text: (
                pairs(&text.state_pattern).map(|(r, c)| find(&state, r as usize, c as usize)).collect(),
                pairs(&text.rate_pattern).map(|(r, c)| find(&rate, r as usize, c as usize)).collect(),
            ),
            by_read: reads.iter().map(|&y| (0..n).map(|row| find(&state, row, y)).collect()).collect(),
            units: units
                .iter()
                .map(|own| own.iter().map(|&(row, column, k)| (find(&state, row, column), k)).collect())
                .collect(),
            ones: ((first..all).map(|k| find(&state, k, k)).collect(), (n..first).map(|k| find(&rate, k, k)).collect()),
            given: gives
                .iter()
                .map(|&w| {
                    let by_rate = |column: usize| text.differential[column].then(|| find(&rate, w, column));
                    GivenRow {
                        by_unknown: (0..n).map(|column| find(&state, w, column)).collect(),
                        by_rate: (0..n).map(by_rate).collect(),
                        by_read: reads.iter().map(|&y| find(&state, w, y)).collect(),
                    }
                })
                .collect(),
            initial_text: pairs(&text.initial.pattern).map(|(r, c)| find(&initial, r as usize, c as usize)).collect(),
            initial_by_read: reads.iter().map(|&y| (0..m).map(|row| find(&initial, row, moved(y))).collect()).collect(),
            initial_ones: (m..m + coupled).map(|k| find(&initial, k, k)).collect(),
            initial_given: gives
                .iter()
                .map(|&w| {
                    (
                        (0..m).map(|column| find(&initial, moved(w), column)).collect(),
                        reads.iter().map(|&y| find(&initial, moved(w), moved(y))).collect(),
                    )
                })
                .collect(),
            initial_units: units
                .iter()
                .map(|own| {
                    let kept = own.iter().filter(|entry| coupling(entry));
                    kept.map(|&(row, column, k)| (find(&initial, moved(row), moved(column)), k)).collect()
                })
                .collect(),
        };
        (positions, state, rate, initial)
    }
}

/// What is added to a value for a difference, after rounding.
fn step(value: f64, size: f64) -> f64 {
    let away = STEP * value.abs().max(size);
    (value + away) - value
}

impl Whole {
    /// Values of the Jacobian by states and by rates; with them what directions do to the rows of the text while the unknowns are held
    /// (`forcing`), where that is wanted.
    pub(super) fn jacobian_values(
        &mut self,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        (states, rates): (&mut [f64], &mut [f64]),
        forcing: Option<&mut [f64]>,
    ) {
        let positions = std::mem::take(&mut self.positions);
        let n = self.sizes.unknowns;
        // What nothing depends on need not be known of a unit for derivatives along directions.
        let rates_will_do = forcing.is_some() && !self.reads_matter();
        states.fill(0.0);
        rates.fill(0.0);
        positions.ones.0.iter().for_each(|&at| states[at] = 1.0);
        positions.ones.1.iter().for_each(|&at| rates[at] = 1.0);
        self.tell_text(y);
        let entries = (&mut self.state_values[..], &mut self.rate_values[..]);
        match (forcing, self.text.tangents()) {
            (Some(forcing), Some(tangents)) => {
                let (states, rates) = (positions.text.0.len(), positions.text.1.len());
                let entries = (&mut entries.0[..states], &mut entries.1[..rates]);
                tangents.jacobian_tangent(t, &y[..n], &yp[..n], entries, forcing);
            }
            _ => self.text.jacobian(t, &y[..n], &yp[..n], entries.0, entries.1),
        }
        for (&at, &value) in positions.text.0.iter().zip(&self.state_values) {
            states[at] = value;
        }
        for (&at, &value) in positions.text.1.iter().zip(&self.rate_values) {
            rates[at] = value;
        }
        for (part, own) in self.parts.iter_mut().zip(&positions.units) {
            part.tell(y);
            match rates_will_do {
                true => part.unit.rate_derivatives(t, &y[part.x.clone()], &mut part.entries),
                false => part.unit.derivatives(t, &y[part.x.clone()], &mut part.entries),
            }
            for &(at, k) in own {
                states[at] -= part.entries[k];
            }
        }
        self.text.residual(t, &y[..n], &yp[..n], &mut self.residual[..n]);
        self.text_row(t, &y[..n], &yp[..n]);
        self.by_reads(t, (y, yp), &positions, states);
        self.of_given(t, (y, yp), &positions, (states, rates));
        self.positions = positions;
    }

    /// Columns of what is read: rows of the text and of what is given.
    fn by_reads(&mut self, t: f64, (y, yp): (&[f64], &[f64]), positions: &Positions, states: &mut [f64]) {
        let n = self.sizes.unknowns;
        for k in 0..self.reads.len() {
            let (input, at, size) = self.reads[k];
            let away = step(y[at], size);
            self.give_text(input, y[at] + away);
            self.text.residual(t, &y[..n], &yp[..n], &mut self.other_residual[..n]);
            for (row, &position) in positions.by_read[k].iter().enumerate() {
                states[position] = (self.other_residual[row] - self.residual[row]) / away;
            }
            if !positions.given.is_empty() {
                self.text.outputs(t, &y[..n], &yp[..n], &mut self.other_row);
                for (w, slope) in self.slopes_from(&self.row, &self.other_row, away).enumerate() {
                    states[positions.given[w].by_read[k]] = -slope;
                }
            }
            self.give_text(input, y[at]);
        }
    }

    /// Rows of what is given, by the unknowns of the text and their rates.
    fn of_given(
        &mut self,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        positions: &Positions,
        (states, rates): (&mut [f64], &mut [f64]),
    ) {
        if positions.given.is_empty() {
            return;
        }
        let n = self.sizes.unknowns;
        let (mut z, mut zp) = (std::mem::take(&mut self.z), std::mem::take(&mut self.zp));
        z[..n].copy_from_slice(&y[..n]);
        zp.copy_from_slice(&yp[..n]);
        let mut sizes = std::mem::take(&mut self.text_nominals);
        self.text.nominals(&mut sizes);
        for column in 0..n {
            let away = step(z[column], sizes[column]);
            z[column] += away;
            self.text.outputs(t, &z[..n], &zp, &mut self.other_row);
            z[column] = y[column];
            for (w, slope) in self.slopes_from(&self.row, &self.other_row, away).enumerate() {
                states[positions.given[w].by_unknown[column]] = -slope;
            }
            if self.text.structure().differential[column] {
                let away = step(zp[column], sizes[column]);
                zp[column] += away;
                self.text.outputs(t, &z[..n], &zp, &mut self.other_row);
                zp[column] = yp[column];
                for (w, slope) in self.slopes_from(&self.row, &self.other_row, away).enumerate() {
                    if let Some(at) = positions.given[w].by_rate[column] {
                        rates[at] = -slope;
                    }
                }
            }
        }
        (self.z, self.zp, self.text_nominals) = (z, zp, sizes);
    }

    /// Values of the Jacobian of the initial system.
    pub(super) fn initial_values(
        &mut self,
        t0: f64,
        z: &[f64],
        values: &mut [f64],
    ) -> Result<(), hyd_system::EvalFailure> {
        let positions = std::mem::take(&mut self.positions);
        let done = self.fill_initial(t0, z, &positions, values);
        self.positions = positions;
        done
    }

    fn fill_initial(
        &mut self,
        t0: f64,
        z: &[f64],
        positions: &Positions,
        values: &mut [f64],
    ) -> Result<(), hyd_system::EvalFailure> {
        let m = self.sizes.initial;
        values.fill(0.0);
        positions.initial_ones.iter().for_each(|&at| values[at] = 1.0);
        self.tell_initial(z);
        let entries = positions.initial_text.len();
        self.text.initial_jacobian(t0, &z[..m], &mut self.state_values[..entries])?;
        for (&at, &value) in positions.initial_text.iter().zip(&self.state_values) {
            values[at] = value;
        }
        for (part, own) in self.parts.iter_mut().zip(&positions.initial_units) {
            part.unit.start_derivatives(t0, &mut part.entries);
            for &(at, k) in own {
                values[at] -= part.entries[k];
            }
        }
        self.text.initial_residual(t0, &z[..m], &mut self.residual[..m])?;
        self.initial_row(t0, &z[..m])?;
        let base = self.row.clone();
        let (first, moved) = (self.sizes.first, z.to_vec());
        for (k, (input, at, size)) in self.reads.clone().into_iter().enumerate() {
            let value = moved[at - first + m];
            let away = step(value, size);
            self.give_text(input, value + away);
            self.text.initial_residual(t0, &z[..m], &mut self.other_residual[..m])?;
            for (row, &position) in positions.initial_by_read[k].iter().enumerate() {
                values[position] = (self.other_residual[row] - self.residual[row]) / away;
            }
            if !positions.initial_given.is_empty() {
                self.initial_row(t0, &z[..m])?;
                for (w, slope) in self.slopes_from(&base, &self.row, away).enumerate() {
                    values[positions.initial_given[w].1[k]] = -slope;
                }
            }
            self.give_text(input, value);
        }
        if positions.initial_given.is_empty() {
            return Ok(());
        }
        let mut sizes = vec![1.0; m];
        self.text.initial_nominals(&mut sizes);
        let mut changed = z[..m].to_vec();
        for column in 0..m {
            let away = step(changed[column], sizes[column]);
            changed[column] += away;
            self.initial_row(t0, &changed)?;
            changed[column] = z[column];
            for (w, slope) in self.slopes_from(&base, &self.row, away).enumerate() {
                values[positions.initial_given[w].0[column]] = -slope;
            }
        }
        Ok(())
    }

    /// Rates or other unknowns depend on what is read of units.
    pub(super) fn reads_matter(&self) -> bool {
        self.sizes.unknowns > 0 || self.parts.iter().any(|part| !part.gives.is_empty())
    }

    fn give_text(&mut self, input: usize, value: f64) {
        if let Some(inputs) = self.text.inputs() {
            // The position was found in the list of the inputs.
            let _ = inputs.give_input(input, value);
        }
    }

    /// Slopes of all that is given, from one row of the text to another.
    fn slopes_from<'a>(&'a self, from: &'a [f64], to: &'a [f64], away: f64) -> impl Iterator<Item = f64> + 'a {
        let all = self.parts.iter().flat_map(|part| &part.gives);
        all.map(move |&(source, _, _)| (self.given(source, to) - self.given(source, from)) / away)
    }
}
