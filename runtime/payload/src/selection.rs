//! Which candidates are states: judged by the size of pivots, switched as data.
//!
//! The constraints of a set have the Jacobian `G` (dependent and state columns together).  With `D` its dependent and `S` its
//! state columns, entry `(i, j)` of `D^-1 S` is the ratio of the determinants after and before exchanging dependent column `i`
//! for state column `j`; so the choice is good as long as no entry is much above 1, and exchanging the largest until all
//! are near 1 leads to a submatrix of nearly maximal volume (Goreinov, Oseledets, Savostyanov, Tyrtyshnikov, Zamarashkin 2010,
//! *How to find a good submatrix*).  Switching late and then going all the way keeps the choice from flipping back and forth.
//! Nothing is evaluated here but numbers: the entries come from the model's code.

use hyd_system::StateChoice;
use hyd_system::math::ln;

/// The choice is changed when an exchange would enlarge the determinant by this factor.
const WORTH_A_CHANGE: f64 = 2.5;
/// Exchanges then go on down to this factor.
const GOOD: f64 = 1.05;
/// Each exchange enlarges the determinant, so no choice comes back; the limit is for rounding.
const MOST_EXCHANGES: usize = 100;

/// A set of candidates with its numbers.
#[derive(Clone, PartialEq, Debug)]
pub struct CandidateSet {
    /// Rows and columns of the Jacobian.
    pub size: (u32, u32),
    /// Row and column of each entry.
    pub entries: Vec<(u32, u32)>,
    /// Pivots that hold for the whole run.
    pub pivots: Vec<(u32, u32)>,
    /// Rows left after these.
    pub open: Vec<u32>,
    /// Column of each candidate, and the factor of that column when pivots are compared.
    pub candidates: Vec<(u32, f64)>,
    /// Number of the first choice.
    pub first: u32,
    /// Position of each candidate among the unknowns.
    pub unknowns: Vec<u32>,
}

/// Work space and present choice of one set.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    /// Candidate that is dependent, for each open row.
    dependent: Vec<u32>,
    /// Candidate that is a state, for each equation of the set.
    states: Vec<u32>,
    matrix: Vec<f64>,
    /// Rows of the matrix that have had their pivot.
    done: Vec<bool>,
    /// Open rows and candidates.
    values: Vec<f64>,
    /// By candidate: it is dependent.
    is_dependent: Vec<bool>,
}

impl CandidateSet {
    /// A choice to begin with: the first candidates are dependent.
    pub(crate) fn first_choice(&self) -> Choice {
        let (rows, columns) = self.size;
        let (open, count) = (self.open.len() as u32, self.candidates.len() as u32);
        Choice {
            dependent: (0..open).collect(),
            states: (open..count).collect(),
            matrix: vec![0.0; (rows * columns) as usize],
            done: vec![false; rows as usize],
            values: vec![0.0; (open * count) as usize],
            is_dependent: vec![false; count as usize],
        }
    }

    /// Number of choices, 0 or 1 each.
    fn choices(&self) -> usize {
        (self.candidates.len() - self.open.len()) * self.candidates.len()
    }

    /// Judges the choice by the entries of the Jacobian.
    pub(crate) fn judge(&self, entries: &[f64], choice: &mut Choice) -> StateChoice {
        if entries.iter().any(|value| !value.is_finite()) {
            return StateChoice { changed: false, room: 0.0 };
        }
        let columns = self.size.1 as usize;
        choice.matrix.fill(0.0);
        for (&(row, column), value) in self.entries.iter().zip(entries) {
            choice.matrix[row as usize * columns + column as usize] += value;
        }
        self.eliminate_fixed(&mut choice.matrix, &mut choice.done);
        self.open_part(&choice.matrix, &mut choice.values);
        let (rows, columns) = (self.open.len(), self.candidates.len());
        let mut open = Open { rows, columns, values: &mut choice.values };
        let is_dependent = &mut choice.is_dependent;
        mark(&choice.dependent, is_dependent);
        let dependent = if open.solve_for(&choice.dependent) {
            let ratio = open.largest(is_dependent).0;
            if ratio <= WORTH_A_CHANGE {
                // An infinite room says that there is nothing to choose; a ratio of zero is one of this moment.
                return StateChoice { changed: false, room: ln(WORTH_A_CHANGE / ratio.max(f64::MIN_POSITIVE)) };
            }
            choice.dependent.clone()
        } else {
            self.open_part(&choice.matrix, open.values);
            let chosen = open.choose();
            mark(&chosen, is_dependent);
            chosen
        };
        let better = open.improve(dependent, is_dependent);
        StateChoice { changed: choice.adopt(better), room: 0.0 }
    }

    /// Writes the choices into their place in the data area.
    pub(crate) fn write(&self, choice: &Choice, chosen: &mut [f64]) {
        let count = self.candidates.len();
        let own = &mut chosen[self.first as usize..][..self.choices()];
        own.fill(0.0);
        for (row, &state) in choice.states.iter().enumerate() {
            own[row * count + state as usize] = 1.0;
        }
    }

    /// Marks the unknowns of the set that are states.
    pub(crate) fn mark(&self, choice: &Choice, states: &mut [bool]) {
        for &unknown in &self.unknowns {
            states[unknown as usize] = false;
        }
        for &state in &choice.states {
            states[self.unknowns[state as usize] as usize] = true;
        }
    }

    fn eliminate_fixed(&self, matrix: &mut [f64], done: &mut [bool]) {
        let (rows, columns) = (self.size.0 as usize, self.size.1 as usize);
        done.fill(false);
        for &(pivot_row, column) in &self.pivots {
            let (pivot_row, column) = (pivot_row as usize, column as usize);
            done[pivot_row] = true;
            let head = matrix[pivot_row * columns + column];
            for row in (0..rows).filter(|&row| !done[row]) {
                let factor = matrix[row * columns + column] / head;
                if factor == 0.0 || !factor.is_finite() {
                    continue;
                }
                subtract(matrix, columns, row, factor, pivot_row);
            }
        }
    }

    fn open_part(&self, matrix: &[f64], values: &mut [f64]) {
        let columns = self.size.1 as usize;
        for (&row, values) in self.open.iter().zip(values.chunks_exact_mut(self.candidates.len())) {
            let own = &matrix[row as usize * columns..][..columns];
            for (value, candidate) in values.iter_mut().zip(&self.candidates) {
                *value = own[candidate.0 as usize] * candidate.1;
            }
        }
    }
}

/// Takes a multiple of row `source` from another one.
#[inline(always)]
fn subtract(values: &mut [f64], columns: usize, row: usize, factor: f64, source: usize) {
    let place = |row: usize| row * columns..(row + 1) * columns;
    let rows = values.get_disjoint_mut([place(row), place(source)]);
    let [own, other] = rows.expect("invariant: two rows of the matrix");
    own.iter_mut().zip(other).for_each(|(value, taken)| *value -= factor * *taken);
}

fn mark(dependent: &[u32], is_dependent: &mut [bool]) {
    is_dependent.fill(false);
    dependent.iter().for_each(|&column| is_dependent[column as usize] = true);
}

crate::codec::stored! {
    Choice { dependent, states, matrix, done, values, is_dependent }
}

impl Choice {
    /// True if it is a choice of this set.
    pub(crate) fn suits(&self, set: &CandidateSet) -> bool {
        let first = set.first_choice();
        let below = |list: &[u32]| list.iter().all(|&k| (k as usize) < set.candidates.len());
        self.dependent.len() == first.dependent.len()
            && self.states.len() == first.states.len()
            && self.matrix.len() == first.matrix.len()
            && self.done.len() == first.done.len()
            && self.values.len() == first.values.len()
            && self.is_dependent.len() == first.is_dependent.len()
            && below(&self.dependent)
            && below(&self.states)
    }

    /// Makes the choice; states that stay keep their equations.  False if it is the same one.
    fn adopt(&mut self, dependent: Vec<u32>) -> bool {
        let mut released = self.dependent.iter().copied().filter(|k| !dependent.contains(k));
        let mut changed = false;
        for state in self.states.iter_mut().filter(|state| dependent.contains(state)) {
            *state = released.next().expect("invariant: as many leave the dependent ones as join them");
            changed = true;
        }
        drop(released);
        self.dependent = dependent;
        changed
    }
}

/// The matrix of open rows and candidates, brought to the unit matrix in the dependent columns.
struct Open<'a> {
    rows: usize,
    columns: usize,
    values: &'a mut [f64],
}

impl Open<'_> {
    /// Makes the dependent columns a unit matrix, rows in their order; false if they are singular.
    fn solve_for(&mut self, dependent: &[u32]) -> bool {
        for (k, &column) in dependent.iter().enumerate() {
            let column = column as usize;
            let size = |row: usize| self.values[row * self.columns + column].abs();
            let best = (k..self.rows).fold(k, |a, b| if size(b) > size(a) { b } else { a });
            if size(best) == 0.0 {
                return false;
            }
            for c in 0..self.columns {
                self.values.swap(k * self.columns + c, best * self.columns + c);
            }
            self.exchange(k, column);
        }
        self.values.iter().all(|value| value.is_finite())
    }

    /// Dependent columns by complete pivoting.
    fn choose(&mut self) -> Vec<u32> {
        let mut dependent = Vec::with_capacity(self.rows);
        for k in 0..self.rows {
            let mut best = (-1.0, k, 0);
            for row in k..self.rows {
                for column in (0..self.columns).filter(|&column| !dependent.contains(&(column as u32))) {
                    let size = self.values[row * self.columns + column].abs();
                    if size > best.0 {
                        best = (size, row, column);
                    }
                }
            }
            let (size, row, column) = best;
            for c in 0..self.columns {
                self.values.swap(k * self.columns + c, row * self.columns + c);
            }
            dependent.push(column as u32);
            if size > 0.0 {
                self.exchange(k, column);
            }
        }
        dependent
    }

    /// Exchanges columns while that enlarges the determinant; gives the dependent ones.
    fn improve(&mut self, mut dependent: Vec<u32>, is_dependent: &mut [bool]) -> Vec<u32> {
        for _ in 0..MOST_EXCHANGES {
            let (ratio, row, column) = self.largest(is_dependent);
            if ratio <= GOOD {
                break;
            }
            self.exchange(row, column);
            is_dependent[dependent[row] as usize] = false;
            is_dependent[column] = true;
            dependent[row] = column as u32;
        }
        dependent
    }

    /// The largest entry outside the dependent columns: size, row, column.
    fn largest(&self, is_dependent: &[bool]) -> (f64, usize, usize) {
        let mut best = (0.0, 0, 0);
        for row in 0..self.rows {
            for column in (0..self.columns).filter(|&column| !is_dependent[column]) {
                let size = self.values[row * self.columns + column].abs();
                if size > best.0 {
                    best = (size, row, column);
                }
            }
        }
        best
    }

    /// Makes a column the unit vector of a row (Gauss-Jordan).
    fn exchange(&mut self, row: usize, column: usize) {
        let n = self.columns;
        let pivot = self.values[row * n + column];
        self.values[row * n..][..n].iter_mut().for_each(|value| *value /= pivot);
        for other in (0..self.rows).filter(|&other| other != row) {
            let factor = self.values[other * n + column];
            if factor != 0.0 {
                subtract(self.values, n, other, factor, row);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A full matrix: the first rows and columns are pivots for the whole run, the rest is open.
    fn set(pivots: u32, open: u32, candidates: u32) -> CandidateSet {
        let (rows, columns) = (pivots + open, pivots + candidates);
        CandidateSet {
            size: (rows, columns),
            entries: (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))).collect(),
            pivots: (0..pivots).map(|k| (k, k)).collect(),
            open: (pivots..rows).collect(),
            candidates: (0..candidates).map(|k| (pivots + k, 1.0)).collect(),
            first: 0,
            unknowns: (0..candidates).collect(),
        }
    }

    /// By expansion along the first row.
    fn determinant(matrix: &[Vec<f64>]) -> f64 {
        let Some((first, rest)) = matrix.split_first() else { return 1.0 };
        let term = |(j, value): (usize, &f64)| {
            let minor: Vec<Vec<f64>> = rest.iter().map(|row| [&row[..j], &row[j + 1..]].concat()).collect();
            if j.is_multiple_of(2) { value * determinant(&minor) } else { -value * determinant(&minor) }
        };
        first.iter().enumerate().map(term).sum()
    }

    /// Determinant of the columns of the pivots and of some candidates.
    fn volume(values: &[f64], (rows, columns): (usize, usize), pivots: usize, dependent: &[u32]) -> f64 {
        let chosen: Vec<usize> = (0..pivots).chain(dependent.iter().map(|&k| pivots + k as usize)).collect();
        let row = |row: usize| chosen.iter().map(|&column| values[row * columns + column]).collect();
        determinant(&(0..rows).map(row).collect::<Vec<Vec<f64>>>()).abs()
    }

    proptest! {
        // Exchanges that follow each other are rare.
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        /// No exchange of one column enlarges the determinant by more than the choice promises, and a choice that was good
        /// enough is kept.
        #[test]
        fn choices_have_nearly_the_largest_determinant(
            (pivots, open, more) in (0_usize..3, 1_usize..4, 1_usize..4),
            numbers in prop::collection::vec(-1.0f64..1.0, 64),
            others in prop::collection::vec(-1.0f64..1.0, 64),
        ) {
            let (rows, columns) = (pivots + open, pivots + open + more);
            let set = set(pivots as u32, open as u32, (open + more) as u32);
            let mut choice = set.first_choice();
            for numbers in [numbers, others] {
                let mut values = numbers[..rows * columns].to_vec();
                for k in 0..pivots {
                    values[k * columns + k] += 4.0;
                }
                let size = |dependent: &[u32]| volume(&values, (rows, columns), pivots, dependent);
                let before = choice.clone();
                let StateChoice { changed, room } = set.judge(&values, &mut choice);
                let kept = choice.dependent == before.dependent;
                prop_assert_eq!(changed, choice.states != before.states);
                prop_assert!(room.is_finite());
                let limit = if kept { WORTH_A_CHANGE } else { GOOD };
                let own = size(&choice.dependent);
                let mut largest = 0.0f64;
                for k in 0..open {
                    for &state in &choice.states {
                        let mut exchanged = choice.dependent.clone();
                        exchanged[k] = state;
                        largest = largest.max(size(&exchanged));
                    }
                }
                prop_assert!(largest <= limit * own * (1.0 + 1e-9) + 1e-12);
                // What a choice that stays has left, unless all determinants are next to nothing.
                let left = if kept { (WORTH_A_CHANGE * own / largest).ln() } else { 0.0 };
                prop_assert!(own < 1e-6 || (room - left).abs() < 1e-6, "{room} instead of {left}");
                let mut all: Vec<u32> = choice.dependent.iter().chain(&choice.states).copied().collect();
                all.sort_unstable();
                prop_assert_eq!(all, (0..(open + more) as u32).collect::<Vec<_>>());
            }
        }
    }

    /// A pendulum hanging down and then lying: the dependent coordinate is the one with the large coefficient.
    #[test]
    fn the_choice_follows_a_turning_pendulum_late() {
        let set = set(0, 1, 2);
        let mut choice = set.first_choice();
        let mut dependent = |angle: f64| {
            set.judge(&[angle.sin(), angle.cos()], &mut choice);
            choice.dependent[0]
        };
        let seen: Vec<u32> = [0.0, 0.8, 1.1, 1.3, 1.57, 2.3, 2.5, 3.1].map(&mut dependent).to_vec();
        assert_eq!(seen, [1, 1, 1, 0, 0, 0, 0, 1]);
        let (mut chosen, mut states) = (vec![9.0; 2], vec![false; 2]);
        set.write(&choice, &mut chosen);
        set.mark(&choice, &mut states);
        assert_eq!((chosen, states), (vec![1.0, 0.0], vec![true, false]));
    }
}
