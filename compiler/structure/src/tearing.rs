//! Tearing: a block becomes a sequence of explicit assignments around a few iteration variables.
//!
//! Elimination after Cellier's heuristic (Täuber, Ochel, Braun, Bachmann 2014, *Practical realization and adaptation
//! of Cellier's tearing method*; the idea in Elmqvist & Otter 1994, *Methods for tearing systems of equations in
//! object-oriented modeling*): an equation with one unknown left is solved for it (front of the sequence), an unknown
//! left in one equation is solved from it (back of the sequence), and when neither exists an unknown is torn.
//! Unknowns no remaining equation can be solved for are torn, equations that cannot be solved become residuals.
//! Torn is the unknown with the highest score: each equation it occurs in counts the more the fewer unknowns it has
//! left.  Finding the smallest number of torn unknowns is NP-hard; this is a heuristic, in O(m log m) for m entries.

use crate::elimination::{Elimination, LocalBlock, OUTSIDE};
use crate::graph::{Column, Entry, Incidence, Row};
use crate::tearing_plan::TearingPlan;
use hyd_index::IndexVec;

/// What the heuristic may and should do.
#[derive(Clone, Copy, Debug)]
pub struct TearingOptions<'a> {
    /// For every entry: can its row be solved explicitly for its column?
    pub solvable: &'a IndexVec<Entry, bool>,
    /// Wish per column, 0 neutral: when an unknown must be torn, the one with the highest wish is taken, whatever its
    /// score.  Positive for natural iteration variables, negative for those without a good start value.
    pub wish: Option<&'a IndexVec<Column, i8>>,
    /// Longest allowed chain of assignments: 1 means that assignments use tearing columns (and columns outside the
    /// block) only, 0 that there are none.  An assignment beyond it becomes a tearing column and a residual.
    pub max_depth: Option<u32>,
}

/// Tears the blocks of one incidence; the work space is shared between blocks, so that each costs only its own size.
#[derive(Clone, Debug)]
pub struct Tearing<'a> {
    incidence: &'a Incidence,
    options: TearingOptions<'a>,
    /// Position of each column in the block at work, `OUTSIDE` for all others.
    position: IndexVec<Column, u32>,
}

impl<'a> Tearing<'a> {
    /// Panics if a table of the options does not have the size of the incidence (a programming error).
    pub fn new(incidence: &'a Incidence, options: TearingOptions<'a>) -> Self {
        assert!(options.solvable.len() == incidence.entry_count(), "invariant: one solvability per entry");
        assert!(
            options.wish.is_none_or(|wish| wish.len() == incidence.column_count()),
            "invariant: one wish per column"
        );
        let position = IndexVec::filled(OUTSIDE, incidence.column_count());
        Self { incidence, options, position }
    }

    /// The plan for one block: `rows` and `columns` of the incidence, each listed once.
    ///
    /// Columns outside the block count as known.  The block need not be square; surplus rows become residuals and
    /// surplus columns tearing columns.  The result is a function of the arguments; ties go to the column listed
    /// first.
    pub fn tear(&mut self, rows: &[Row], columns: &[Column]) -> TearingPlan {
        for (k, &column) in (0..).zip(columns) {
            self.position[column] = k;
        }
        let block = LocalBlock::new(self.incidence, self.options.solvable, &self.position, rows, columns.len());
        for &column in columns {
            self.position[column] = OUTSIDE;
        }
        let wish = |k: u32| match self.options.wish {
            Some(wish) => wish[columns[k as usize]],
            None => 0,
        };
        let sequence = Elimination::new(&block, wish).run();
        let sequence = limit_depth(&block, sequence, self.options.max_depth);
        let plan = global_plan(rows, columns, &sequence);
        debug_assert_eq!(self.check(rows, columns, &plan), Ok(()));
        plan
    }

    fn check(&self, rows: &[Row], columns: &[Column], plan: &TearingPlan) -> Result<(), String> {
        let TearingOptions { solvable, max_depth, .. } = self.options;
        crate::verify::check_tearing(self.incidence, rows, columns, solvable, max_depth, plan)
    }
}

/// Drops the assignments whose chain of dependencies would be longer than allowed; their columns count as torn, so
/// chains begin anew behind them.
fn limit_depth(block: &LocalBlock, mut sequence: Vec<(u32, u32)>, max_depth: Option<u32>) -> Vec<(u32, u32)> {
    let Some(limit) = max_depth else {
        return sequence;
    };
    let mut depth = vec![0_u32; block.column_count()];
    sequence.retain(|&(row, column)| {
        let others = block.columns(row).iter().filter(|&&other| other != column);
        let deepest = others.map(|&other| depth[other as usize]).max();
        let own = deepest.unwrap_or(0) + 1;
        if own > limit {
            return false;
        }
        depth[column as usize] = own;
        true
    });
    sequence
}

/// Translates positions into rows and columns; what is not assigned is residual or torn.
fn global_plan(rows: &[Row], columns: &[Column], sequence: &[(u32, u32)]) -> TearingPlan {
    let mut row_left = vec![true; rows.len()];
    let mut column_left = vec![true; columns.len()];
    let mut plan = TearingPlan::default();
    for &(row, column) in sequence {
        let (row, column) = (row as usize, column as usize);
        (row_left[row], column_left[column]) = (false, false);
        plan.assignments.push((rows[row], columns[column]));
    }
    let left = |left: &[bool]| -> Vec<usize> { (0..left.len()).filter(|&k| left[k]).collect() };
    plan.residuals.extend(left(&row_left).iter().map(|&k| rows[k]));
    plan.tearing.extend(left(&column_left).iter().map(|&k| columns[k]));
    plan.residuals.sort_unstable();
    plan.tearing.sort_unstable();
    plan
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::any_incidence_with;
    use crate::verify::check_tearing;
    use proptest::prelude::*;

    fn tear_all(incidence: &Incidence, solvable: &IndexVec<Entry, bool>, max_depth: Option<u32>) -> TearingPlan {
        let options = TearingOptions { solvable, wish: None, max_depth };
        let rows: Vec<Row> = incidence.rows().collect();
        let columns: Vec<Column> = incidence.columns().collect();
        let plan = Tearing::new(incidence, options).tear(&rows, &columns);
        let check = check_tearing(incidence, &rows, &columns, solvable, max_depth, &plan);
        assert_eq!(check, Ok(()));
        plan
    }

    /// Row k of a band holds the columns k - width ..= k + width.
    fn band(n: u32, width: u32) -> Incidence {
        let rows = (0..n).map(|k| {
            let range = k.saturating_sub(width)..(k + width + 1).min(n);
            range.map(Column)
        });
        Incidence::from_rows(n as usize, rows).expect("ascending")
    }

    /// Five-point stencil on an n x n grid.
    fn grid(n: u32) -> Incidence {
        let rows = (0..n * n).map(|k| {
            let (i, j) = (k / n, k % n);
            let mut row = Vec::new();
            row.extend((i > 0).then(|| Column(k - n)));
            row.extend((j > 0).then(|| Column(k - 1)));
            row.push(Column(k));
            row.extend((j + 1 < n).then(|| Column(k + 1)));
            row.extend((i + 1 < n).then(|| Column(k + n)));
            row
        });
        Incidence::from_rows((n * n) as usize, rows).expect("ascending")
    }

    /// Smallest number of torn columns: for every set, see how far explicit solving alone gets.
    fn fewest_torn(incidence: &Incidence, solvable: &IndexVec<Entry, bool>) -> u32 {
        let n = incidence.column_count();
        let determined = |set: u32| {
            let mut known = set;
            let mut used = 0_u32;
            while let Some((row, column)) = next_assignment(incidence, solvable, known, used) {
                known |= 1 << column.0;
                used |= 1 << row.0;
            }
            known.count_ones() as usize == n
        };
        let sets = (0..1_u32 << n).filter(|&set| determined(set));
        sets.map(u32::count_ones).min().expect("tearing all works")
    }

    fn next_assignment(
        incidence: &Incidence,
        solvable: &IndexVec<Entry, bool>,
        known: u32,
        used: u32,
    ) -> Option<(Row, Column)> {
        let unknown = |column: Column| known >> column.0 & 1 == 0;
        incidence.rows().filter(|row| used >> row.0 & 1 == 0).find_map(|row| {
            let mut open = incidence.entries(row).filter(|&(_, column)| unknown(column));
            match (open.next(), open.next()) {
                (Some((entry, column)), None) if solvable[entry] => Some((row, column)),
                _ => None,
            }
        })
    }

    proptest! {
        #[test]
        fn plans_are_valid((incidence, solvable) in any_incidence_with(8, 8, any::<bool>()), depth in 0..4_u32) {
            let plan = tear_all(&incidence, &solvable, None);
            let free = incidence.column_count() - plan.assignments.len();
            prop_assert_eq!(plan.tearing.len(), free);
            tear_all(&incidence, &solvable, Some(depth));
        }

        /// Never better than the exhaustive optimum (that would be a wrong plan) and exact where nothing need be torn.
        #[test]
        fn compared_with_the_optimum((incidence, solvable) in any_incidence_with(7, 7, proptest::bool::weighted(0.8))) {
            let torn = tear_all(&incidence, &solvable, None).tearing.len() as u32;
            let fewest = fewest_torn(&incidence, &solvable);
            prop_assert!(torn >= fewest);
            prop_assert!(fewest > 0 || torn == 0);
        }

        /// Blocks inside a larger incidence: columns outside are known, and the work space is left clean.
        #[test]
        fn parts_of_an_incidence(
            (incidence, solvable) in any_incidence_with(8, 8, any::<bool>()),
            split in 0..8_usize,
        ) {
            let rows: Vec<Row> = incidence.rows().collect();
            let columns: Vec<Column> = incidence.columns().collect();
            let options = TearingOptions { solvable: &solvable, wish: None, max_depth: None };
            let mut tearing = Tearing::new(&incidence, options);
            let cut = split.min(rows.len());
            for (rows, columns) in [(&rows[cut..], &columns[split..]), (&rows[..cut], &columns[..split])] {
                let plan = tearing.tear(rows, columns);
                let check = check_tearing(&incidence, rows, columns, &solvable, None, &plan);
                prop_assert_eq!(check, Ok(()));
                prop_assert_eq!(&plan, &Tearing::new(&incidence, options).tear(rows, columns));
            }
        }
    }

    /// Uniform numbers in [0, 1) from the multiplier of Knuth's MMIX generator; the same sequence in every run.
    fn random_numbers() -> impl FnMut() -> f64 {
        let mut state = 12345_u64;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1_u64 << 31) as f64
        }
    }

    /// On random blocks with a full diagonal and 60 % solvable entries the heuristic tears at most a tenth more
    /// columns in total than the exhaustive optimum.
    #[test]
    fn close_to_the_optimum_on_average() {
        let mut random = random_numbers();
        let (n, mut torn, mut fewest) = (9, 0, 0);
        for trial in 0..200 {
            let density = 0.15 + 0.03 * f64::from(trial % 10);
            let mut row = |own: u32| -> Vec<Column> {
                let columns = (0..n).filter(|&k| k == own || random() < density);
                columns.map(Column).collect()
            };
            let rows: Vec<Vec<Column>> = (0..n).map(&mut row).collect();
            let incidence = Incidence::from_rows(n as usize, rows).expect("ascending");
            let solvable = incidence.entry_table(|_, _| random() < 0.6);
            torn += tear_all(&incidence, &solvable, None).tearing.len() as u32;
            fewest += fewest_torn(&incidence, &solvable);
        }
        assert!(10 * torn <= 11 * fewest, "{torn} instead of {fewest}");
    }

    /// A ring of n equations in two unknowns each needs one iteration variable.
    #[test]
    fn ring_needs_one_variable() {
        let text = "3 rows, 3 columns\neq0: v0 v2\neq1: v0 v1\neq2: v1 v2\n";
        let incidence: Incidence = text.parse().expect("text");
        let solvable = incidence.entry_table(|_, _| true);
        let plan = tear_all(&incidence, &solvable, None);
        let expected = "tearing: v0\nassign: eq0=v2 eq1=v1\nresiduals: eq2\n";
        assert_eq!(plan.to_string(), expected);
    }

    #[test]
    fn wishes_decide_what_is_torn() {
        let incidence = band(9, 1);
        let solvable = incidence.entry_table(|_, _| true);
        let rows: Vec<Row> = incidence.rows().collect();
        let columns: Vec<Column> = incidence.columns().collect();
        let mut wish = IndexVec::filled(0, 9);
        wish[Column(4)] = 1;
        let options = TearingOptions { solvable: &solvable, wish: Some(&wish), max_depth: None };
        let plan = Tearing::new(&incidence, options).tear(&rows, &columns);
        assert!(plan.tearing.contains(&Column(4)), "{plan}");
    }

    /// Without a limit a tridiagonal band is one long chain (shooting); with one it is cut.
    #[test]
    fn depth_limit_cuts_chains() {
        let incidence = band(100, 1);
        let solvable = incidence.entry_table(|_, _| true);
        assert_eq!(tear_all(&incidence, &solvable, None).tearing.len(), 1);
        let cut = tear_all(&incidence, &solvable, Some(3)).tearing.len();
        assert!((20..=60).contains(&cut), "{cut}");
        let none = tear_all(&incidence, &solvable, Some(0));
        assert!(none.assignments.is_empty());
    }

    /// A band of half width w can be shot through from w values, a grid from one line of it.  If each row of the
    /// grid can be solved for its own column only, assigned columns must not be neighbours: half is torn.
    #[test]
    fn torn_counts_reach_the_known_optimum() {
        for width in 1..6 {
            let incidence = band(400, width);
            let solvable = incidence.entry_table(|_, _| true);
            let torn = tear_all(&incidence, &solvable, None).tearing.len();
            assert_eq!(torn, width as usize);
        }
        for n in [4, 8, 16, 32] {
            let incidence = grid(n);
            let solvable = incidence.entry_table(|_, _| true);
            let torn = tear_all(&incidence, &solvable, None).tearing.len();
            assert_eq!(torn, n as usize);
            let solvable = incidence.entry_table(|row, column| row.0 == column.0);
            let torn = tear_all(&incidence, &solvable, None).tearing.len();
            assert_eq!(torn, (n * n / 2) as usize);
        }
    }

    #[test]
    fn bands_and_grid_of_1e5_rows() {
        for incidence in [band(100_000, 1), band(100_000, 4), grid(316)] {
            let solvable = incidence.entry_table(|row, column| (row.0 + column.0) % 7 != 3);
            let plan = tear_all(&incidence, &solvable, Some(50));
            assert_eq!(plan.tearing.len(), plan.residuals.len());
        }
    }
}
