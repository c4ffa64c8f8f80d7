//! Checks of every plan against its definition; an error is one sentence naming the first violated invariant.
//!
//! The checks share no code with the algorithms they check and cost linear time, so that they run in debug builds
//! after each algorithm.  They establish that a plan is valid; of optimality only [`check_maximum_matching`] speaks
//! (no augmenting path, Berge 1957).

use crate::blocks::BlockPlan;
use crate::differentiation::DifferentiationPlan;
use crate::graph::{Column, Entry, Incidence, Row};
use crate::matching::Matching;
use crate::parts::{Decomposition, Part};
use crate::tearing_plan::TearingPlan;
use hyd_index::{IndexVec, TypedIndex};

fn ensure(holds: bool, sentence: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(sentence()) }
}

/// Every pair is an entry of the incidence and both tables are inverse to each other.
pub fn check_matching(incidence: &Incidence, matching: &Matching) -> Result<(), String> {
    let sizes = (matching.column_of_row.len(), matching.row_of_column.len());
    ensure(sizes == (incidence.row_count(), incidence.column_count()), || {
        "the tables of the matching do not have the size of the incidence".to_string()
    })?;
    for (row, &column) in matching.column_of_row.iter_enumerated() {
        let Some(column) = column else { continue };
        ensure(incidence.entry(row, column).is_some(), || {
            format!("{row} is matched to {column}, which does not occur in it")
        })?;
        ensure(matching.row_of_column[column] == Some(row), || {
            format!("{row} is matched to {column}, but {column} is not matched to {row}")
        })?;
    }
    for (column, &row) in matching.row_of_column.iter_enumerated() {
        let Some(row) = row else { continue };
        ensure(matching.column_of_row.get(row) == Some(&Some(column)), || {
            format!("{column} is matched to {row}, but {row} is not matched to {column}")
        })?;
    }
    Ok(())
}

/// A valid matching ([`check_matching`]) without augmenting path, that is, of the largest size.
pub fn check_maximum_matching(incidence: &Incidence, matching: &Matching) -> Result<(), String> {
    check_matching(incidence, matching)?;
    let mut reached: Vec<Row> = matching.unmatched_rows().collect();
    let mut seen = IndexVec::filled(false, incidence.column_count());
    while let Some(row) = reached.pop() {
        for &column in incidence.row(row) {
            if std::mem::replace(&mut seen[column], true) {
                continue;
            }
            match matching.row_of_column[column] {
                Some(next) => reached.push(next),
                None => return Err(format!("an augmenting path ends in {column} through {row}")),
            }
        }
    }
    Ok(())
}

/// Every row is in exactly one block with its matched column, and no row needs a column of a later block.
///
/// That blocks are as small as possible is not checked.
pub fn check_blocks(incidence: &Incidence, matching: &Matching, plan: &BlockPlan) -> Result<(), String> {
    ensure(plan.starts.first() == Some(&0), || "the first block does not start at position 0".to_string())?;
    ensure(plan.starts.windows(2).all(|pair| pair[0] < pair[1]), || "a block is empty".to_string())?;
    let lengths = (plan.rows.len(), plan.columns.len());
    let end = plan.starts.last().map_or(0, |&end| end as usize);
    ensure(lengths == (end, end), || "the last block does not end with the rows and columns".to_string())?;
    let mut known = IndexVec::filled(false, incidence.column_count());
    for column in matching.unmatched_columns() {
        known[column] = true;
    }
    let mut placed = IndexVec::filled(false, incidence.row_count());
    for block in plan.blocks() {
        let (rows, columns) = plan.block(block);
        for (&row, &column) in rows.iter().zip(columns) {
            ensure(placed.get(row) == Some(&false), || {
                format!("{row} of {block} does not exist or has occurred before")
            })?;
            placed[row] = true;
            ensure(matching.column_of_row[row] == Some(column), || {
                format!("{block} pairs {row} with {column}, but the matching does not")
            })?;
            known[column] = true;
        }
        for &row in rows {
            for &column in incidence.row(row) {
                ensure(known[column], || format!("{row} of {block} needs {column}, which a later block determines"))?;
            }
        }
    }
    match placed.iter_enumerated().find(|(_, placed)| !**placed) {
        Some((row, _)) => Err(format!("{row} is in no block")),
        None => Ok(()),
    }
}

/// The sequence is explicit and acyclic and covers the block: every row is an assignment or a residual, every column
/// is assigned or torn, every assignment is solvable and needs only torn and previously assigned columns of the
/// block, no dependency chain is longer than `max_depth`.
pub fn check_tearing(
    incidence: &Incidence,
    rows: &[Row],
    columns: &[Column],
    solvable: &IndexVec<Entry, bool>,
    max_depth: Option<u32>,
    plan: &TearingPlan,
) -> Result<(), String> {
    let assigned = plan.assignments.iter();
    let plan_rows = assigned.clone().map(|pair| pair.0);
    check_same_members("row", rows, plan_rows.chain(plan.residuals.iter().copied()))?;
    let plan_columns = assigned.map(|pair| pair.1);
    check_same_members("column", columns, plan_columns.chain(plan.tearing.iter().copied()))?;
    let members = Lookup::new(columns);
    let mut depth: Vec<Option<u32>> = vec![None; columns.len()];
    for &column in &plan.tearing {
        depth[members.position(column).unwrap_or(0)] = Some(0);
    }
    for &(row, column) in &plan.assignments {
        let entry = incidence.entry(row, column);
        ensure(entry.is_some_and(|entry| solvable[entry]), || {
            format!("{row} is assigned to {column} but cannot be solved for it")
        })?;
        let mut deepest = 0;
        for &other in incidence.row(row).iter().filter(|&&other| other != column) {
            let Some(position) = members.position(other) else {
                continue;
            };
            let Some(depth) = depth[position] else {
                return Err(format!("{row} needs {other} before it is known"));
            };
            deepest = deepest.max(depth);
        }
        ensure(max_depth.is_none_or(|limit| deepest < limit), || {
            format!("the chain of assignments that ends in {column} is too long")
        })?;
        depth[members.position(column).unwrap_or(0)] = Some(deepest + 1);
    }
    Ok(())
}

/// Positions of columns in a list, by binary search in a sorted copy.
struct Lookup(Vec<Column>);

impl Lookup {
    fn new(columns: &[Column]) -> Self {
        let mut sorted = columns.to_vec();
        sorted.sort_unstable();
        Self(sorted)
    }

    fn position(&self, column: Column) -> Option<usize> {
        self.0.binary_search(&column).ok()
    }
}

fn check_same_members<T: TypedIndex>(kind: &str, expected: &[T], found: impl Iterator<Item = T>) -> Result<(), String> {
    let (mut expected, mut found) = (expected.to_vec(), found.collect::<Vec<T>>());
    expected.sort_unstable();
    found.sort_unstable();
    match expected.iter().zip(&found).find(|(a, b)| a != b) {
        Some((a, b)) => Err(format!("not every {kind} occurs once: {:?} is missing or repeated", a.min(b))),
        None => ensure(expected.len() == found.len(), || {
            format!("there are {} {kind}s instead of {}", found.len(), expected.len())
        }),
    }
}

/// Every vertex is in one part; the parts have the right excess; no row of the over-determined part has a column
/// outside it, and no column of the under-determined part a row outside it.
pub fn check_decomposition(incidence: &Incidence, parts: &Decomposition) -> Result<(), String> {
    let Decomposition { over, square, under } = parts;
    let rows: Vec<Row> = incidence.rows().collect();
    let columns: Vec<Column> = incidence.columns().collect();
    let all = [over, square, under];
    let part_rows = all.iter().flat_map(|part| part.rows.iter().copied());
    check_same_members("row", &rows, part_rows)?;
    let part_columns = all.iter().flat_map(|part| part.columns.iter().copied());
    check_same_members("column", &columns, part_columns)?;
    let empty = Part::default();
    ensure(over.rows.len() > over.columns.len() || *over == empty, || {
        "the over-determined part does not have more rows than columns".to_string()
    })?;
    ensure(under.rows.len() < under.columns.len() || *under == empty, || {
        "the under-determined part does not have more columns than rows".to_string()
    })?;
    ensure(square.rows.len() == square.columns.len(), || "the square part is not square".to_string())?;
    check_closed(incidence, over, under)
}

fn check_closed(incidence: &Incidence, over: &Part, under: &Part) -> Result<(), String> {
    let mut in_over = IndexVec::filled(false, incidence.column_count());
    for &column in &over.columns {
        in_over[column] = true;
    }
    for &row in &over.rows {
        if let Some(column) = incidence.row(row).iter().find(|&&column| !in_over[column]) {
            return Err(format!("{row} is over-determined but its {column} is outside that part"));
        }
    }
    let mut in_under = IndexVec::filled(false, incidence.column_count());
    for &column in &under.columns {
        in_under[column] = true;
    }
    for row in incidence.rows() {
        let column = incidence.row(row).iter().find(|&&column| in_under[column]);
        if let Some(column) = column
            && under.rows.binary_search(&row).is_err()
        {
            return Err(format!("{column} is under-determined but its {row} is outside that part"));
        }
    }
    Ok(())
}

/// Checks a plan of differentiations against its definition: the given part is unchanged, every differentiated row holds
/// the derivatives of what the row before holds, and the rows and columns without derivative are matched.
pub fn check_differentiation(
    incidence: &Incidence,
    derivative: &IndexVec<Column, Option<Column>>,
    plan: &DifferentiationPlan,
) -> Result<(), String> {
    check_matching(&plan.incidence, &plan.matching)?;
    if incidence.rows().any(|row| incidence.row(row) != plan.incidence.row(row)) {
        return Err("a given row has changed".into());
    }
    for (column, next) in derivative.iter_enumerated() {
        if next.is_some() && plan.column_derivative[column] != *next {
            return Err(format!("the derivative of {column} has changed"));
        }
    }
    for row in plan.incidence.rows() {
        let Some(after) = plan.row_derivative[row] else {
            match plan.matching.column_of_row[row] {
                Some(column) if plan.column_derivative[column].is_none() => continue,
                _ => return Err(format!("{row} is not matched to a highest derivative")),
            }
        };
        let derivatives = plan.incidence.row(row).iter().map(|&column| plan.column_derivative[column]);
        let mut expected = derivatives.collect::<Option<Vec<Column>>>().ok_or(format!("{row} lacks a derivative"))?;
        expected.sort_unstable();
        if expected != plan.incidence.row(after) {
            return Err(format!("{after} is not the derivative of {row}"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::components::block_order;

    fn triangular() -> (Incidence, Matching) {
        let text = "2 rows, 2 columns\neq0: v0\neq1: v0 v1\n";
        let incidence: Incidence = text.parse().expect("text");
        let mut matching = Matching::empty(&incidence);
        matching.assign(Row(0), Column(0));
        matching.assign(Row(1), Column(1));
        (incidence, matching)
    }

    #[test]
    fn broken_matchings_are_named() {
        let (incidence, good) = triangular();
        let mut foreign = good.clone();
        foreign.assign(Row(0), Column(1));
        let sentence = "eq0 is matched to v1, which does not occur in it".to_string();
        assert_eq!(check_matching(&incidence, &foreign), Err(sentence));
        let mut one_sided = good.clone();
        one_sided.row_of_column[Column(1)] = None;
        let sentence = "eq1 is matched to v1, but v1 is not matched to eq1".to_string();
        assert_eq!(check_matching(&incidence, &one_sided), Err(sentence));
        let mut small = good.clone();
        small.release(Row(1));
        assert_eq!(check_matching(&incidence, &small), Ok(()));
        let sentence = "an augmenting path ends in v1 through eq1".to_string();
        assert_eq!(check_maximum_matching(&incidence, &small), Err(sentence));
    }

    #[test]
    fn broken_block_orders_are_named() {
        let (incidence, matching) = triangular();
        let good = block_order(&incidence, &matching).expect("perfect");
        assert_eq!(check_blocks(&incidence, &matching, &good), Ok(()));
        let mut reversed = good.clone();
        reversed.rows.reverse();
        reversed.columns.reverse();
        let sentence = "eq1 of block0 needs v0, which a later block determines".to_string();
        assert_eq!(check_blocks(&incidence, &matching, &reversed), Err(sentence));
        let mut short = good.clone();
        (short.starts, short.rows, short.columns) = (vec![0, 1], vec![Row(0)], vec![Column(0)]);
        let sentence = "eq1 is in no block".to_string();
        assert_eq!(check_blocks(&incidence, &matching, &short), Err(sentence));
    }

    #[test]
    fn broken_tearing_is_named() {
        let text = "2 rows, 2 columns\neq0: v0 v1\neq1: v0 v1\n";
        let incidence: Incidence = text.parse().expect("text");
        let (rows, columns) = ([Row(0), Row(1)], [Column(0), Column(1)]);
        let check = |assignments: &[(Row, Column)], tearing: &[Column], residuals: &[Row]| {
            let plan = TearingPlan {
                assignments: assignments.to_vec(),
                tearing: tearing.to_vec(),
                residuals: residuals.to_vec(),
            };
            let solvable = incidence.entry_table(|row, _| row == Row(0));
            check_tearing(&incidence, &rows, &columns, &solvable, Some(1), &plan)
        };
        let (first, second) = ((Row(0), Column(0)), (Row(1), Column(1)));
        assert_eq!(check(&[first], &[Column(1)], &[Row(1)]), Ok(()));
        let sentence = "eq1 is assigned to v1 but cannot be solved for it".to_string();
        assert_eq!(check(&[second], &[Column(0)], &[Row(0)]), Err(sentence));
        let sentence = "eq0 needs v1 before it is known".to_string();
        assert_eq!(check(&[first, second], &[], &[]), Err(sentence));
        let sentence = "not every column occurs once: v0 is missing or repeated".to_string();
        assert_eq!(check(&[first], &[Column(0)], &[Row(1)]), Err(sentence));
    }

    #[test]
    fn broken_decompositions_are_named() {
        let (incidence, _) = triangular();
        let part = |rows: &[Row], columns: &[Column]| Part::sorted(rows.to_vec(), columns.to_vec());
        let good = Decomposition {
            over: Part::default(),
            square: part(&[Row(0), Row(1)], &[Column(0), Column(1)]),
            under: Part::default(),
        };
        assert_eq!(check_decomposition(&incidence, &good), Ok(()));
        let wrong = Decomposition {
            over: part(&[Row(0), Row(1)], &[Column(0)]),
            square: Part::default(),
            under: part(&[], &[Column(1)]),
        };
        let sentence = "eq1 is over-determined but its v1 is outside that part".to_string();
        assert_eq!(check_decomposition(&incidence, &wrong), Err(sentence));
    }
}
