//! Linear equations of a block that depend on each other, found by numbers before the run.
//!
//! `x + y = 1` and `x + y = 2` match two unknowns, and an electric circuit without ground matches all of its potentials, but both are
//! singular.  Where the slopes of a block depend on parameters alone, they are evaluated and the block's matrix is eliminated with
//! complete pivoting (Golub and Van Loan 2013, *Matrix Computations*, section 3.4); what is left without pivot names the equations
//! and unknowns.  A block that is singular with made-up values of its parameters too is refused, one that is singular only with
//! the values as they are gives a warning.  Blocks with varying slopes are not judged here.

use hyd_flat::{Operand, Target};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{NodeId, SlotId, TemplateId, partial, slots};
use rustc_hash::FxHashMap;

use crate::algebra::{Algebra, Known, is_clocked};
use crate::explain::faults::{equation_text, list_names, mark_equations, mark_variables, variable_of};
use crate::plan::bindings::Bindings;
use crate::plan::linearity::block_targets;
use crate::sorted::{Block, Plan};
use crate::start_point::StartPoint;
use crate::system::{Combination, EqId, EquationSystem, Role};

/// Larger blocks are left to the start.
const MOST_UNKNOWNS: usize = 100;
/// A pivot counts as zero below this, relative to the largest entries of its row and column.
const ZERO: f64 = 1e-12;
/// A row takes part in a dependence if its factor is at least this, relative to the largest.
const SHARE: f64 = 1e-9;

/// Judges the blocks of a plan; an error for the first that no values make regular, with the sum of equations in which unknowns cancel,
/// else warnings.
pub(crate) fn judge_blocks(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    bindings: &Bindings,
    declared: &StartPoint,
    plan: &Plan,
) -> Result<Vec<Diagnostic>, Box<(Diagnostic, Option<Combination>)>> {
    let mut judge = Judge { algebra, known: &bindings.known, slopes: FxHashMap::default() };
    let mut warnings = Vec::new();
    let mut made_up: Option<StartPoint> = None;
    for block in plan.blocks.iter() {
        let size = block.assignments.len() + block.residuals.len();
        // What is solved for alone has a slope.
        if size > MOST_UNKNOWNS || size == 1 && block.residuals.is_empty() {
            continue;
        }
        let Some(linear) = judge.linear(system, plan, block) else { continue };
        let Some(dependence) = linear.dependence(system, declared) else { continue };
        let made_up = made_up.get_or_insert_with(|| StartPoint::of_made_up_parameters(system, &bindings.assignments));
        match linear.dependence(system, made_up) {
            Some(_) => {
                let weighted: Vec<(EqId, f64)> =
                    dependence.rows.iter().map(|&(row, factor)| (linear.equations[row], factor)).collect();
                let combination = Combination::new(system, &weighted);
                return Err(Box::new((fault(system, &linear, &dependence, true), combination)));
            }
            // A single factor that vanishes is reported by index reduction.
            None if size == 1 => {}
            None => warnings.push(fault(system, &linear, &dependence, false)),
        }
    }
    Ok(warnings)
}

struct Judge<'a> {
    algebra: &'a mut Algebra,
    known: &'a Known,
    slopes: FxHashMap<(TemplateId, SlotId), Slope>,
}

/// A partial derivative.
struct Slope {
    value: NodeId,
    /// Slots in it.
    reads: Vec<SlotId>,
    clocked: bool,
}

/// A block with slopes that only parameters decide.
struct Linear {
    equations: Vec<EqId>,
    targets: Vec<Target>,
    /// Row, column, slope, and whether it counts negative.
    entries: Vec<(usize, usize, NodeId, bool)>,
}

/// Which equations add up to nothing, and which unknowns stay open; positions in the block.
struct Dependence {
    /// With what an equation is multiplied.
    rows: Vec<(usize, f64)>,
    columns: Vec<usize>,
}

impl Judge<'_> {
    fn linear(&mut self, system: &mut EquationSystem, plan: &Plan, block: Block<'_>) -> Option<Linear> {
        let assigned = block.assignments.iter().map(|&a| plan.assignments[a as usize].equation);
        let residuals = block.residuals.iter().map(|&r| plan.residuals[r as usize].equation);
        let equations: Vec<EqId> = assigned.chain(residuals).collect();
        let targets: Vec<Target> = block_targets(plan, block).collect();
        // Whether the value or the derivative of a candidate is unknown changes during the run.
        let varies = |target: &Target| variable_of(*target).is_some_and(|v| system.roles[v] == Role::Candidate);
        if targets.iter().any(varies) {
            return None;
        }
        let mut entries = Vec::new();
        for (row, &eq) in equations.iter().enumerate() {
            let equation = system.equations[eq];
            let templates = &mut system.flat.templates;
            let facts = self.algebra.facts(templates, equation.template);
            for &slot in &facts.slots {
                let range = equation.operands;
                let operands = &system.operands[range.first as usize..(range.first + range.len) as usize];
                let operand = operands[slot.index()];
                let Some(column) = targets.iter().position(|&target| target == operand.target()) else { continue };
                let slope = self.slopes.entry((equation.template, slot)).or_insert_with(|| {
                    let value = partial(&mut templates.arena, facts.residual, slot);
                    Slope { value, reads: slots(&templates.arena, &[value]), clocked: is_clocked(templates, value) }
                });
                let fixed = slope.reads.iter().all(|slot| self.known.is_known(operands[slot.index()]));
                if !fixed || slope.clocked {
                    return None;
                }
                entries.push((row, column, slope.value, operand.negated()));
            }
        }
        Some(Linear { equations, targets, entries })
    }
}

impl Linear {
    /// `None` if the matrix is regular or not finite.
    fn dependence(&self, system: &EquationSystem, point: &StartPoint) -> Option<Dependence> {
        let n = self.equations.len();
        if n == 1 {
            let values = self.entries.iter().map(|&(_, _, slope, negated)| {
                let value = point.evaluate(system, slope, system.equations[self.equations[0]].operands);
                if negated { -value } else { value }
            });
            // What is not finite says nothing.
            let vanishes = values.sum::<f64>() == 0.0;
            return vanishes.then(|| Dependence { rows: vec![(0, 1.0)], columns: vec![0] });
        }
        let mut matrix = vec![vec![0.0; n]; n];
        for &(row, column, slope, negated) in &self.entries {
            let value = point.evaluate(system, slope, system.equations[self.equations[row]].operands);
            matrix[row][column] += if negated { -value } else { value };
        }
        if matrix.iter().flatten().any(|value| !value.is_finite()) {
            return None;
        }
        dependence(matrix)
    }
}

/// Eliminates with complete pivoting; the combination of rows that the first row without pivot stands for, and the columns of a
/// vector that the matrix maps to zero.
fn dependence(mut a: Vec<Vec<f64>>) -> Option<Dependence> {
    let n = a.len();
    let largest = |row: &Vec<f64>| row.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    let sizes: Vec<f64> = a.iter().map(largest).map(|size| if size > 0.0 { size } else { 1.0 }).collect();
    for (row, size) in a.iter_mut().zip(&sizes) {
        row.iter_mut().for_each(|value| *value /= size);
    }
    let scale: Vec<f64> = (0..n).map(|c| a.iter().fold(0.0_f64, |size, row| size.max(row[c].abs()))).collect();
    let mut factors: Vec<Vec<f64>> = (0..n).map(|k| (0..n).map(|j| f64::from(u8::from(k == j))).collect()).collect();
    let mut columns: Vec<usize> = (0..n).collect();
    for k in 0..n {
        let size = |row: usize, column: usize| a[row][column].abs() / scale[column].max(f64::MIN_POSITIVE);
        let places = (k..n).flat_map(|row| (k..n).map(move |c| (row, c)));
        let best = places.max_by(|&(r, c), &(s, d)| size(r, columns[c]).total_cmp(&size(s, columns[d])));
        let (row, place) = best?;
        if size(row, columns[place]) <= ZERO {
            let rows = shares(&factors[k]).into_iter().map(|row| (row, factors[k][row] / sizes[row])).collect();
            return Some(Dependence { rows, columns: kernel(&a, &columns, k) });
        }
        columns.swap(k, place);
        a.swap(k, row);
        factors.swap(k, row);
        for below in k + 1..n {
            let factor = a[below][columns[k]] / a[k][columns[k]];
            if factor != 0.0 {
                let (upper, lower) = a.split_at_mut(below);
                lower[0].iter_mut().zip(&upper[k]).for_each(|(value, pivot)| *value -= factor * pivot);
                let (upper, lower) = factors.split_at_mut(below);
                lower[0].iter_mut().zip(&upper[k]).for_each(|(value, pivot)| *value -= factor * pivot);
            }
        }
    }
    None
}

/// Rows of a square matrix that depend on each other; `None` if it is regular.
pub(crate) fn dependent_rows(matrix: Vec<Vec<f64>>) -> Option<Vec<usize>> {
    dependence(matrix).map(|found| found.rows.into_iter().map(|(row, _)| row).collect())
}

/// Positions of the entries that are not small.
fn shares(vector: &[f64]) -> Vec<usize> {
    let largest = vector.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
    (0..vector.len()).filter(|&k| vector[k].abs() > SHARE * largest).collect()
}

/// Columns of a vector in the kernel: the first open column and what follows from it by back substitution.
fn kernel(a: &[Vec<f64>], columns: &[usize], rank: usize) -> Vec<usize> {
    let mut vector = vec![0.0; columns.len()];
    vector[columns[rank]] = 1.0;
    for k in (0..rank).rev() {
        let sum: f64 = columns[k + 1..].iter().map(|&c| a[k][c] * vector[c]).sum();
        vector[columns[k]] = -sum / a[k][columns[k]];
    }
    shares(&vector)
}

fn fault(system: &EquationSystem, linear: &Linear, dependence: &Dependence, always: bool) -> Diagnostic {
    let mut equations: Vec<EqId> = dependence.rows.iter().map(|&(row, _)| linear.equations[row]).collect();
    equations.sort_unstable();
    let mut targets: Vec<Target> = dependence.columns.iter().map(|&column| linear.targets[column]).collect();
    targets.sort_unstable_by_key(|&target| variable_of(target));
    let names = list_names(targets.iter().map(|&target| system.flat.operand_name(Operand::new(target))));
    let texts = list_names(equations.iter().map(|&eq| equation_text(system, eq)));
    let reason = match equations.len() {
        1 => {
            let cancels = if targets.len() == 1 { "cancels" } else { "cancel" };
            format!("given the other equations, {names} {cancels} out of {texts}")
        }
        _ => format!("with all unknowns on the left, the left-hand sides of {texts} are linearly dependent"),
    };
    let diagnostic = if always {
        Diagnostic::error(Code::Singular, format!("{names} cannot be determined: the equations are singular"))
    } else {
        let message = format!("with the parameter values as they are, {names} cannot be determined");
        Diagnostic::warning(Code::Singular, message)
    };
    let mut variables: Vec<_> = targets.iter().filter_map(|&target| variable_of(target)).collect();
    variables.sort_unstable();
    mark_variables(mark_equations(diagnostic.help(reason), system, &equations), system, &variables)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> Vec<Vec<f64>> {
        rows.iter().map(|row| row.to_vec()).collect()
    }

    #[test]
    fn dependent_rows_and_open_columns_are_named() {
        // Third row: first minus twice the second; the last column stands alone.
        let rows: &[&[f64]] =
            &[&[1.0, 2.0, 3.0, 0.0], &[1e6, 1e6, 0.0, 0.0], &[-1.0, 0.0, 3.0, 0.0], &[1.0, 0.0, 0.0, 5.0]];
        let found = dependence(matrix(rows)).expect("singular");
        let factors: Vec<f64> = found.rows.iter().map(|(_, factor)| factor / found.rows[0].1).collect();
        assert_eq!(found.rows.iter().map(|(row, _)| *row).collect::<Vec<_>>(), [0, 1, 2]);
        let off = |(factor, exact): (&f64, f64)| (factor - exact).abs() > 1e-15;
        assert!(!factors.iter().zip([1.0, -2e-6, -1.0]).any(off), "{factors:?}");
        // (1, -1, 1/3, -1/5) is mapped to zero.
        assert_eq!(found.columns, [0, 1, 2, 3]);
    }

    #[test]
    fn badly_scaled_matrices_are_regular() {
        assert!(dependence(matrix(&[&[1e-9, 1.0], &[1.0, 1e12]])).is_none());
        assert!(dependence(matrix(&[&[1e-15, 0.0], &[0.0, 1e15]])).is_none());
    }
}
