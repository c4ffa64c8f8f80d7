//! A plan to its routines: assigned variables, residuals, Jacobian, and further rows such as root functions.
//!
//! Small plans become straight-line code, large ones loops (the limit is in the options); the Jacobian of a plan whose
//! straight-line form grows too much falls back to loops alone.

use hyd_equations::{OperandRange, Plan, PlanJacobian, SortedSystem};
use hyd_index::IndexVec;
use hyd_payload::{JacobianForm, PlanRoutines};
use hyd_symbolic::{Arena, NodeId, size};
use hyd_system::Pattern;
use rustc_hash::FxHashMap;

use super::Options;
use super::accumulate;
use super::batch::{Batch, Item};
use super::rows::Rows;
use super::straight::Composer;
use crate::layout::{Layout, Place, PlanPlaces};
use crate::nominals::nominals;
use crate::program::{Address, Area, Kernel, Program, Routine, RoutineId, Store};

/// The kernels of a plan one row at a time, not composed: what its tangents are made from.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlainPlan {
    /// Assigned variables to the work area.
    pub assign: Vec<Kernel>,
    /// Residuals to `Out`.
    pub residual: Vec<Kernel>,
    /// Further rows to `Out`.
    pub extra: Vec<Kernel>,
}

/// Names of the routines of one plan, for listings: assign, residual, jacobian, extra, closing.
pub(crate) type Names = [&'static str; 5];

/// What a plan is made into code with.
pub(crate) struct PlanLowering<'a> {
    /// The system.
    pub sorted: &'a SortedSystem,
    /// The data area.
    pub layout: &'a Layout,
    /// Places of the plan.
    pub places: &'a PlanPlaces,
    /// The plan.
    pub plan: &'a Plan,
    /// Its derivatives.
    pub jacobian: &'a PlanJacobian,
    /// Further rows.
    pub extra: Vec<(NodeId, OperandRange)>,
    /// Limits.
    pub options: &'a Options,
}

impl PlanLowering<'_> {
    /// Appends the routines to the program.
    ///
    /// # Errors
    /// A sentence, when an operand has no place or a pattern does not fit.
    pub(crate) fn lower(&self, program: &mut Program, names: Names) -> Result<(PlanRoutines, PlainPlan), String> {
        let rows = Rows { plan: self.plan };
        let n = self.plan.unknowns.len();
        let state_pattern = Pattern::from_pairs(n, n, &self.jacobian.state_pattern);
        let rate_pattern = Pattern::from_pairs(n, n, &self.jacobian.rate_pattern);
        let mut routines = IndexVec::<RoutineId, Vec<Kernel>>::new();
        let patterns = (&state_pattern, &rate_pattern);
        let plain = self.plain(program, &rows)?;
        let mut jacobian_kernel = None;
        if self.is_small(&program.arena, &rows) {
            let mut composer = Composer::new(&mut program.arena, self.sorted, self.layout, self.places, &rows)?;
            routines.push(vec![composer.kernel(composer.assigned(), Area::Work)]);
            let residuals = self.plan.residuals.iter().map(|r| (r.value, r.operands));
            for list in [residuals.collect(), self.extra.clone()] {
                routines.push(vec![self.compose(&mut composer, &list)?]);
            }
            jacobian_kernel = self.straight_jacobian(&mut composer, &rows, patterns)?;
        } else {
            let PlainPlan { assign, residual, extra } = plain.clone();
            routines.push(assign.clone());
            routines.push(assign.iter().cloned().chain(residual).collect());
            routines.push(if extra.is_empty() { extra } else { assign.into_iter().chain(extra).collect() });
        }
        let [assign, residual, extra] = <[Vec<Kernel>; 3]>::try_from(routines.raw).unwrap_or_default();
        let jacobian = match jacobian_kernel {
            Some(kernel) => JacobianForm::Entries(push(program, names[2], vec![kernel])),
            None => self.partials(program, &rows, patterns, plain.assign.clone(), names[2])?,
        };
        let (closing, closing_rows) = self.closing(program)?;
        let assigned_nominals = match closing_rows.is_empty() {
            true => Vec::new(),
            false => nominals(self.sorted, self.plan.assignments.iter().map(|a| a.target)),
        };
        let routines = PlanRoutines {
            closing: push(program, names[4], closing),
            closing_rows,
            assigned_nominals,
            assign: push(program, names[0], assign),
            residual: push(program, names[1], residual),
            extra: push(program, names[3], extra),
            jacobian,
            state_pattern,
            rate_pattern,
        };
        Ok((routines, plain))
    }

    /// The residuals of torn loops, not composed, and which these are.
    fn closing(&self, program: &mut Program) -> Result<(Vec<Kernel>, Vec<u32>), String> {
        let torn = self.plan.blocks.iter().filter(|block| !block.assignments.is_empty());
        let rows: Vec<u32> = torn.flat_map(|block| block.residuals.iter().copied()).collect();
        let residuals = rows.iter().map(|&row| &self.plan.residuals[row as usize]).map(|r| (r.value, r.operands));
        Ok((self.row_kernels(program, residuals)?, rows))
    }

    fn plain(&self, program: &mut Program, rows: &Rows<'_>) -> Result<PlainPlan, String> {
        let residuals = self.plan.residuals.iter().map(|r| (r.value, r.operands));
        Ok(PlainPlan {
            assign: self.assign_kernels(program, rows)?,
            residual: self.row_kernels(program, residuals)?,
            extra: self.row_kernels(program, self.extra.iter().copied())?,
        })
    }

    /// True if the rows have no more nodes than straight-line code may have.
    fn is_small(&self, arena: &Arena, rows: &Rows<'_>) -> bool {
        let mut sizes: FxHashMap<NodeId, usize> = FxHashMap::default();
        let mut total = 0;
        for row in 0..rows.count() {
            let (value, _) = rows.expression(self.sorted, row);
            total += *sizes.entry(value).or_insert_with(|| size(arena, &[value]));
            if total > self.options.straight_nodes {
                return false;
            }
        }
        true
    }

    fn compose(&self, composer: &mut Composer<'_>, list: &[(NodeId, OperandRange)]) -> Result<Kernel, String> {
        let mut values = Vec::with_capacity(list.len());
        for &(value, operands) in list {
            values.push(composer.expression(value, self.sorted.system.operands_of(operands))?);
        }
        Ok(composer.kernel(&values, Area::Out))
    }

    /// The Jacobian as one kernel, none if it grows beyond the limit.
    fn straight_jacobian(
        &self,
        composer: &mut Composer<'_>,
        rows: &Rows<'_>,
        patterns: (&Pattern, &Pattern),
    ) -> Result<Option<Kernel>, String> {
        let gradients = composer.jacobian(rows, self.jacobian)?;
        let zero = composer.arena().constant(0.0);
        let n = self.plan.unknowns.len();
        let mut entries = [vec![zero; patterns.0.entries()], vec![zero; patterns.1.entries()]];
        for (row, gradient) in gradients.iter().enumerate() {
            for &(column, node) in gradient {
                let (which, column) =
                    if (column as usize) < n { (0, column as usize) } else { (1, column as usize - n) };
                let pattern = if which == 0 { patterns.0 } else { patterns.1 };
                let range = pattern.column(column);
                let found = pattern.row_indices[range.clone()].binary_search(&(row as u32));
                let k = found.map_err(|_| "a Jacobian entry lies outside its pattern".to_string())?;
                entries[which][range.start + k] = node;
            }
        }
        let all: Vec<NodeId> = entries.concat();
        if size(composer.arena(), &all) > JACOBIAN_GROWTH * self.options.straight_nodes {
            return Ok(None);
        }
        let mut kernel = composer.kernel(&entries[0], Area::Out);
        let store = |(k, &value): (usize, &NodeId)| Store {
            value,
            to: Address::Fixed { area: Area::Out2, index: k as u32, negated: false },
        };
        kernel.stores.extend(entries[1].iter().enumerate().map(store));
        Ok(Some(kernel))
    }

    fn assign_kernels(&self, program: &mut Program, rows: &Rows<'_>) -> Result<Vec<Kernel>, String> {
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let mut batch = Batch::new(&locate);
        for (index, a) in (0u32..).zip(&rows.plan.assignments) {
            let (operands, to) = (self.sorted.system.operands_of(a.operands), [Place { area: Area::Work, index }]);
            let item = Item { level: a.level, values: &[a.value], operands, extra: &[], to: &to };
            batch.add(&program.arena, item)?;
        }
        Ok(batch.kernels(&mut program.tables))
    }

    fn row_kernels(
        &self,
        program: &mut Program,
        rows: impl IntoIterator<Item = (NodeId, OperandRange)>,
    ) -> Result<Vec<Kernel>, String> {
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let mut batch = Batch::new(&locate);
        super::add_rows(&mut batch, &program.arena, self.sorted, rows)?;
        Ok(batch.kernels(&mut program.tables))
    }

    fn partials(
        &self,
        program: &mut Program,
        rows: &Rows<'_>,
        patterns: (&Pattern, &Pattern),
        mut kernels: Vec<Kernel>,
        name: &'static str,
    ) -> Result<JacobianForm, String> {
        let locate = |operand| self.layout.locate(self.sorted, self.places, operand);
        let mut batch = Batch::new(&locate);
        let (accumulation, owners) =
            accumulate::plan(self.sorted, self.places, rows, self.jacobian, patterns, (&program.arena, &mut batch))?;
        kernels.extend(batch.kernels(&mut program.tables));
        Ok(JacobianForm::Partials(push(program, name, kernels), accumulation, owners))
    }
}

/// The straight-line Jacobian may have this many times the nodes that the equations may have.
const JACOBIAN_GROWTH: usize = 8;

/// Appends a routine.
pub(crate) fn push(program: &mut Program, name: &'static str, kernels: Vec<Kernel>) -> RoutineId {
    program.routines.push(Routine { name, kernels })
}
