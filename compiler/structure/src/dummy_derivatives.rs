//! Which derivatives become algebraic unknowns once the constraints are differentiated.
//!
//! Mattsson and Söderlind 1993, *Index reduction in differential-algebraic equations using dummy derivatives*, SIAM J. Sci.
//! Comput. 14(3): among the highest derivatives as many are chosen as there are differentiated equations, so that
//! these determine them; one order lower again among the chosen for the equations differentiated more often, and so on.  All
//! levels of a constraint stay in the system.  The matrix of a level is that of the undifferentiated equations, because
//! the highest derivatives enter a differentiated equation as they entered the equation itself.  Columns are chosen by
//! wish and numerical independence at given values; where these leave gaps, by structure.  Where pivots vary during the run the
//! choice can be left open (see [`crate::candidates`]).

use crate::augment::{Augmentation, Augmenter};
use crate::candidates::{CandidateSet, Coefficient, Level, Verdict};
use crate::graph::{Column, Entry, Incidence, Row};
use crate::independent::{Columns, independent_columns_before};
use crate::matching::Matching;
use hyd_index::{IndexVec, TypedIndex};
use std::cmp::Reverse;

/// What is chosen from.
#[derive(Clone, Copy, Debug)]
pub struct DummyProblem<'a> {
    /// Equations and unknowns (each unknown one column, whatever the order); an entry says that the fully
    /// differentiated equation contains the highest derivative of the unknown.
    pub incidence: &'a Incidence,
    /// How often each equation is differentiated.
    pub row_orders: &'a IndexVec<Row, u32>,
    /// Highest derivative of each unknown.
    pub column_orders: &'a IndexVec<Column, u32>,
    /// Partial derivative of the equation with respect to the highest derivative, at some typical point.
    pub values: &'a IndexVec<Entry, f64>,
    /// Partial derivatives that are the same during the whole run; none: the choice is made once whatever varies.
    pub constant: Option<&'a IndexVec<Entry, bool>>,
    /// Unknowns that must be states themselves (`stateSelect = always`): never candidates.
    pub states: &'a IndexVec<Column, bool>,
}

impl DummyProblem<'_> {
    /// True if what this level takes of a column is the unknown itself, which must be a state.
    fn is_state_at(&self, column: Column, level: u32) -> bool {
        self.states[column] && self.column_orders[column] == level
    }
}

/// The choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DummyPlan {
    /// How many of the highest derivatives of each unknown are dummies.
    pub dummies: IndexVec<Column, u32>,
    /// Equations whose dummy was chosen by structure alone, because the values are singular.
    pub uncertain: Vec<Row>,
    /// Where the choice is left to the run; these columns count in `dummies` with the levels below only.
    pub sets: Vec<CandidateSet>,
}

/// Fewer unknowns than equations at some level: the orders are none that index reduction gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoChoice;

/// Chooses dummy derivatives.
///
/// `wish(column, order)` says how much the derivative of that order (0: the unknown itself) is wanted as a state;
/// the least wanted become dummies first, on equal wishes the later columns.
///
/// # Errors
/// [`NoChoice`], if a level cannot be matched structurally.
pub fn choose_dummies<W: Ord>(
    problem: DummyProblem<'_>,
    wish: impl Fn(Column, u32) -> W,
) -> Result<DummyPlan, NoChoice> {
    let mut plan = DummyPlan {
        dummies: IndexVec::filled(0_u32, problem.incidence.column_count()),
        uncertain: Vec::new(),
        sets: Vec::new(),
    };
    // The last level at which the choice about a column was left open.
    let mut open_at = IndexVec::filled(0_u32, problem.incidence.column_count());
    let most = problem.row_orders.iter().copied().max().unwrap_or(0);
    for level in 1..=most {
        let candidate = |&column: &Column| {
            let may_depend = plan.dummies[column] == level - 1 || level > 1 && open_at[column] == level - 1;
            may_depend && problem.column_orders[column] >= level
        };
        let mut candidates: Vec<Column> = problem.incidence.columns().filter(candidate).collect();
        let key = |c: Column| (problem.is_state_at(c, level), wish(c, problem.column_orders[c] - level), Reverse(c));
        candidates.sort_by_key(|&column| key(column));
        let rows: Vec<Row> = problem.incidence.rows().filter(|&row| problem.row_orders[row] >= level).collect();
        let known = plan.sets.len();
        let rows = leave_open(problem, level, rows, &candidates, &mut plan)?;
        for &column in plan.sets[known..].iter().flat_map(|set| &set.candidates) {
            open_at[column] = level;
        }
        for column in choose_level(problem, level, &rows, &candidates, &mut plan.uncertain)? {
            plan.dummies[column] = level;
        }
    }
    plan.uncertain.sort_unstable();
    plan.uncertain.dedup();
    Ok(plan)
}

/// Takes the parts out of a level whose choice is left open; the rows of the others.
fn leave_open(
    problem: DummyProblem<'_>,
    level: u32,
    rows: Vec<Row>,
    candidates: &[Column],
    plan: &mut DummyPlan,
) -> Result<Vec<Row>, NoChoice> {
    let Some(constant) = problem.constant else { return Ok(rows) };
    let mut admitted = IndexVec::filled(false, problem.incidence.column_count());
    for &column in candidates {
        admitted[column] = true;
    }
    let entries = |row: Row| {
        let entries = problem.incidence.entries(row).filter(|&(_, column)| admitted[column]);
        entries.map(|(e, column)| (column, Coefficient { value: problem.values[e], constant: constant[e] })).collect()
    };
    let mut rank = IndexVec::filled(None, problem.incidence.column_count());
    for (position, &column) in (0..).zip(candidates).filter(|(_, column)| !problem.is_state_at(**column, level)) {
        rank[column] = Some(position);
    }
    let all = Level { level, rows: rows.iter().map(|&row| (row, entries(row))).collect(), rank: &rank };
    let mut fixed = Vec::new();
    for part in all.parts() {
        match part.judge() {
            Verdict::Fixed => fixed.extend(part.rows.iter().map(|row| row.0)),
            Verdict::Short => return Err(NoChoice),
            Verdict::Open { dummies, sets, doubtful } => {
                plan.uncertain.extend(doubtful);
                for column in dummies {
                    plan.dummies[column] = level;
                }
                plan.sets.extend(sets);
            }
        }
    }
    fixed.sort_unstable();
    Ok(fixed)
}

/// As many of the candidates as rows, numerically independent as far as possible.
fn choose_level(
    problem: DummyProblem<'_>,
    level: u32,
    rows: &[Row],
    candidates: &[Column],
    uncertain: &mut Vec<Row>,
) -> Result<Vec<Column>, NoChoice> {
    let mut place: IndexVec<Column, Option<usize>> = IndexVec::filled(None, problem.incidence.column_count());
    for (k, &column) in candidates.iter().enumerate() {
        place[column] = Some(k);
    }
    let mut matrix = Columns { rows: rows.len(), columns: vec![Vec::new(); candidates.len()] };
    let mut pattern = Incidence::new(problem.incidence.column_count());
    for (position, &row) in rows.iter().enumerate() {
        let entries = problem.incidence.entries(row).filter(|&(_, column)| place[column].is_some());
        let entries: Vec<(Entry, Column)> = entries.collect();
        for &(entry, column) in &entries {
            if let Some(k) = place[column] {
                matrix.columns[k].push((position as u32, problem.values[entry]));
            }
        }
        let pushed = pattern.push_row(entries.iter().map(|&(_, column)| column));
        pushed.expect("invariant: a part of a row that ascends");
    }
    let mut matching = Matching::empty(&pattern);
    // What must be a state is a matter of last resort.
    let reserve = candidates.iter().filter(|&&column| !problem.is_state_at(column, level)).count();
    for (k, row) in independent_columns_before(&matrix, reserve) {
        matching.assign(Row(row), candidates[k]);
    }
    complete(&pattern, rows, &mut matching, uncertain)?;
    Ok(matching.column_of_row.iter().flatten().copied().collect())
}

/// Matches the rows that are left.  The numerical choice need not be a matching by pattern (elimination fills in), so
/// its pairs are first put into place.
fn complete(
    pattern: &Incidence,
    rows: &[Row],
    matching: &mut Matching,
    uncertain: &mut Vec<Row>,
) -> Result<(), NoChoice> {
    let chosen: Vec<Column> = matching.column_of_row.iter().flatten().copied().collect();
    if chosen.len() == rows.len() {
        return Ok(());
    }
    let mut is_chosen = IndexVec::filled(false, pattern.column_count());
    for &column in &chosen {
        is_chosen[column] = true;
    }
    uncertain.extend(pattern.rows().filter(|&row| matching.column_of_row[row].is_none()).map(|row| rows[row.index()]));
    *matching = Matching::empty(pattern);
    let mut augmenter = Augmenter::new();
    for row in pattern.rows() {
        // Chosen columns are independent, hence matchable together; a matched column stays matched later.
        augmenter.augment(pattern, matching, row, |column| is_chosen[column]);
    }
    for row in pattern.rows() {
        if augmenter.augment(pattern, matching, row, |_| true) != Augmentation::Matched {
            return Err(NoChoice);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signature::any_signature;
    use proptest::prelude::*;

    /// Pendulum as first-order equations with multiplier: x, y, vx, vy, F; the equations x' = vx, y' = vy and the
    /// length are differentiated.
    #[test]
    fn the_pendulum_keeps_one_coordinate_and_its_velocity() {
        let text = "3 rows, 5 columns\neq0: v0 v2\neq1: v1 v3\neq2: v0 v1\n";
        let incidence: Incidence = text.parse().expect("text");
        let (row_orders, column_orders) = (IndexVec::from_vec(vec![1, 1, 2]), IndexVec::from_vec(vec![2, 2, 1, 1, 0]));
        let choose = |x: f64, y: f64, wish: fn(Column) -> u32| {
            let values = IndexVec::from_vec(vec![1.0, -1.0, 1.0, -1.0, 2.0 * x, 2.0 * y]);
            let problem = DummyProblem {
                incidence: &incidence,
                row_orders: &row_orders,
                column_orders: &column_orders,
                values: &values,
                constant: None,
                states: &IndexVec::filled(false, 5),
            };
            let plan = choose_dummies(problem, |column, order| (order == 0, wish(column))).expect("regular");
            (plan.dummies.raw, plan.uncertain)
        };
        assert_eq!(choose(0.6, -0.8, |_| 0), (vec![1, 2, 0, 1, 0], vec![]));
        assert_eq!(choose(0.6, -0.8, |c| c.0 % 2), (vec![2, 1, 1, 0, 0], vec![]));
        // Hanging straight down, x follows from nothing: y must stay dependent whatever is wished.
        assert_eq!(choose(0.0, -1.0, |c| c.0 % 2), (vec![1, 2, 0, 1, 0], vec![]));
        // At the origin nothing is regular; the structure decides.
        assert_eq!(choose(0.0, 0.0, |_| 0).1, vec![Row(2)]);
    }

    /// With the entries of the length varying, two sets are left: a position and a velocity; `x'` and `y'` follow from
    /// the velocities for the whole run.
    #[test]
    fn the_choice_between_coordinates_is_left_open() {
        let text = "3 rows, 5 columns\neq0: v0 v2\neq1: v1 v3\neq2: v0 v1\n";
        let incidence: Incidence = text.parse().expect("text");
        let problem = DummyProblem {
            incidence: &incidence,
            row_orders: &IndexVec::from_vec(vec![1, 1, 2]),
            column_orders: &IndexVec::from_vec(vec![2, 2, 1, 1, 0]),
            values: &IndexVec::from_vec(vec![1.0, -1.0, 1.0, -1.0, 0.0, -2.0]),
            constant: Some(&IndexVec::from_vec(vec![true, true, true, true, false, false])),
            states: &IndexVec::filled(false, 5),
        };
        let plan = choose_dummies(problem, |column, order| (order == 0, column)).expect("regular");
        let sets: Vec<_> = plan.sets.iter().map(|set| (set.level, set.open.clone(), set.candidates.clone())).collect();
        let [x, y, vx, vy] = [0, 1, 2, 3].map(Column);
        assert_eq!(sets, [(1, vec![Row(2)], vec![vx, vy]), (2, vec![Row(2)], vec![x, y])]);
        assert_eq!(plan.dummies.raw, [1, 1, 0, 0, 0]);
        // `x` and `vx` are to be states always: nothing is left open.
        let always = IndexVec::from_vec(vec![true, false, true, false, false]);
        let plan = choose_dummies(DummyProblem { states: &always, ..problem }, |column, order| (order == 0, column));
        assert_eq!(plan.map(|plan| (plan.dummies.raw, plan.sets)), Ok((vec![1, 2, 0, 1, 0], vec![])));
        // Hanging straight down `x` follows from nothing: where `y` and `vy` are to be states there is no choice, and that is said.
        let always = IndexVec::from_vec(vec![false, true, false, true, false]);
        let plan = choose_dummies(DummyProblem { states: &always, ..problem }, |column, order| (order == 0, column));
        assert_eq!(plan.map(|plan| plan.uncertain), Ok(vec![Row(2)]));
    }

    /// A length of two coordinates of second order without velocities of their own: both levels are left open for the same two.
    #[test]
    fn a_coordinate_may_be_open_on_two_levels() {
        let incidence: Incidence = "1 rows, 2 columns\neq0: v0 v1\n".parse().expect("text");
        let problem = DummyProblem {
            incidence: &incidence,
            row_orders: &IndexVec::from_vec(vec![2]),
            column_orders: &IndexVec::from_vec(vec![2, 2]),
            values: &IndexVec::from_vec(vec![1.0, 0.0]),
            constant: Some(&IndexVec::from_vec(vec![false, false])),
            states: &IndexVec::filled(false, 2),
        };
        let plan = choose_dummies(problem, |column, order| (order == 0, column)).expect("regular");
        let sets: Vec<_> = plan.sets.iter().map(|set| (set.level, set.candidates.clone())).collect();
        assert_eq!(sets, [(1, vec![Column(0), Column(1)]), (2, vec![Column(0), Column(1)])]);
        assert_eq!((plan.dummies.raw, plan.uncertain), (vec![0, 0], vec![]));
    }

    proptest! {
        /// With generic values every level is non-singular: checked by the definition, a determinant of the chosen
        /// columns that does not vanish; the states left over are as many as the sums of the offsets differ.
        #[test]
        fn chosen_columns_are_regular_on_every_level(signature in any_signature(5, 2), seed in 0_u64..1000) {
            let Some((rows, columns)) = signature.offsets() else { return Ok(()) };
            let n = signature.size();
            let leading = |i: usize, j: usize| signature.order(i, j).is_some_and(|order| order + rows[i] == columns[j]);
            let lists = (0..n).map(|i| (0..n).filter(|&j| leading(i, j)).map(Column::new).collect::<Vec<_>>());
            let incidence = Incidence::from_rows(n, lists).expect("ascending");
            let mut state = seed * 2 + 1;
            let values = incidence.entry_table(|_, _| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                0.5 + (state >> 33) as f64 / (1_u64 << 31) as f64
            });
            let (row_orders, column_orders) = (IndexVec::from_vec(rows.clone()), IndexVec::from_vec(columns.clone()));
            let problem = DummyProblem {
                incidence: &incidence,
                row_orders: &row_orders,
                column_orders: &column_orders,
                values: &values,
                constant: None,
                states: &IndexVec::filled(false, n),
            };
            let plan = choose_dummies(problem, |column, order| (order == 0, column)).expect("offsets are canonical");
            prop_assert_eq!(plan.dummies.iter().sum::<u32>(), rows.iter().sum::<u32>());
            for level in 1..=rows.iter().copied().max().unwrap_or(0) {
                let chosen: Vec<usize> = (0..n).filter(|&j| plan.dummies.raw[j] >= level).collect();
                let used: Vec<usize> = (0..n).filter(|&i| rows[i] >= level).collect();
                prop_assert_eq!(chosen.len(), used.len());
                prop_assert!(chosen.iter().all(|&j| columns[j] >= level));
                let at = |i: usize, j: usize| incidence.entry(Row::new(i), Column::new(j)).map_or(0.0, |e| values[e]);
                let matrix: Vec<Vec<f64>> = used.iter().map(|&i| chosen.iter().map(|&j| at(i, j)).collect()).collect();
                prop_assert!(determinant(&matrix).abs() > 1e-12, "level {level}: {matrix:?}");
            }
        }
    }

    /// By expansion along the first row.
    fn determinant(matrix: &[Vec<f64>]) -> f64 {
        let Some((first, rest)) = matrix.split_first() else { return 1.0 };
        let minor = |j: usize| {
            let rows = rest.iter().map(|row| [&row[..j], &row[j + 1..]].concat());
            determinant(&rows.collect::<Vec<_>>())
        };
        let sign = |j: usize| if j.is_multiple_of(2) { 1.0 } else { -1.0 };
        first.iter().enumerate().filter(|(_, value)| **value != 0.0).map(|(j, value)| sign(j) * value * minor(j)).sum()
    }
}
