//! Executes sorted systems by interpretation and compares with the equations of the flat model.
//!
//! `Run` holds a value for every target.  The check is indirect and needs no solver: unknowns, rates and held relations get
//! random values, the assignments are executed, and each residual says by how much its equation is violated.  Equations
//! behind assignments must hold exactly, those behind residuals up to the residual's value (times a factor where the
//! residual was solved for its variable).

use std::collections::HashMap;

use hyd_flat::{FlatModel, Operand, Section, Target, VarId};
use hyd_symbolic::{NodeId, eval};

use crate::{
    Assignment, EquationSystem, OperandRange, Places, Plan, PlanJacobian, PlanPlace, Resolution, SortedSystem,
};

pub(crate) struct Run<'a> {
    pub system: &'a EquationSystem,
    pub values: HashMap<Target, f64>,
    pub time: f64,
    pub initial: bool,
}

/// A reproducible sequence of numbers in (0.5, 2) (Lehmer's generator).
pub(crate) struct Random(pub u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        0.5 + 1.5 * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

impl<'a> Run<'a> {
    /// Everything that the bindings and starts make known.
    pub(crate) fn new(sorted: &'a SortedSystem) -> Self {
        let mut run = Self { system: &sorted.system, values: HashMap::new(), time: 0.3, initial: false };
        run.execute(&sorted.bindings);
        run.execute(&sorted.starts);
        run
    }

    pub(crate) fn read(&self, operand: Operand) -> f64 {
        let value = match operand.target() {
            Target::Const(c) => self.system.flat.constants[c],
            target => self.values.get(&target).copied().unwrap_or(0.0),
        };
        if operand.negated() { -value } else { value }
    }

    pub(crate) fn value(&self, node: NodeId, operands: OperandRange) -> f64 {
        let operands = self.system.operands_of(operands);
        let slot = |slot: hyd_symbolic::SlotId| self.read(operands[slot.0 as usize]);
        eval(&self.system.flat.templates.arena, node, slot, self.time, self.initial)
    }

    pub(crate) fn execute(&mut self, assignments: &[Assignment]) {
        for a in assignments {
            let value = self.value(a.value, a.operands);
            self.values.insert(a.target, value);
        }
    }

    /// Random values for the unknowns and what is given from outside; then the assignments.
    pub(crate) fn randomize(&mut self, sorted: &SortedSystem, plan: &Plan, random: &mut Random) {
        for k in 0..sorted.relations.len() {
            self.values.insert(Target::Held(k as u32), f64::from(random.next() > 1.0));
        }
        for v in self.system.roles.indices().filter(|&v| self.system.roles[v] == crate::Role::Discrete) {
            self.values.insert(Target::Var(v), random.next());
            self.values.insert(Target::Pre(v), random.next());
        }
        for unknown in &plan.unknowns {
            self.values.insert(unknown.target, random.next());
            if let (true, Target::Var(v)) = (unknown.differential, unknown.target) {
                self.values.insert(Target::Der(v), random.next());
            }
        }
        self.execute(&plan.assignments);
    }

    pub(crate) fn residuals(&self, plan: &Plan) -> Vec<f64> {
        plan.residuals.iter().map(|r| self.value(r.value, r.operands)).collect()
    }

    /// The value a slot of the flat model has, through aliases and fixed values.
    fn flat_value(&self, flat: &FlatModel, operand: Operand) -> f64 {
        let of = |make: fn(VarId) -> Target, v: VarId| match self.system.resolution[v] {
            Resolution::Own => self.read(Operand::new(make(v))),
            Resolution::Alias { of, negated } => self.read(Operand::new(make(of)).signed(negated)),
            Resolution::Value(c) if matches!(make(v), Target::Var(_)) => self.system.flat.constants[c],
            Resolution::Value(_) => 0.0,
        };
        let value = match operand.target() {
            Target::Var(v) => of(Target::Var, v),
            Target::Der(v) => of(Target::Der, v),
            Target::Pre(v) => of(Target::Pre, v),
            Target::Start(v) => of(Target::Start, v),
            Target::Const(c) => flat.constants[c],
            Target::Held(_) | Target::Chosen(_) => panic!("the flat model holds no relations and no choices"),
            Target::Delayed(_) | Target::DelayedRate(_) | Target::Input(_) | Target::InputRate(_) => self.read(operand),
        };
        if operand.negated() { -value } else { value }
    }

    /// `left - right` of every equation of a section in the flat model (without event relations).
    pub(crate) fn violations(&self, flat: &FlatModel, section: Section) -> Vec<f64> {
        let mut found = Vec::new();
        for block in flat.equations.iter().filter(|block| block.section == section) {
            let template = flat.templates.get(block.template);
            for k in 0..block.count as usize {
                let operands = block.operands_of(k, template.arity as usize);
                let slot = |slot: hyd_symbolic::SlotId| self.flat_value(flat, operands[slot.0 as usize]);
                let side = |node| eval(&flat.templates.arena, node, slot, self.time, self.initial);
                found.push(side(template.left) - side(template.right));
            }
        }
        found
    }
}

/// Makes the residuals zero by damped Newton steps on differences; returns false if that fails.
pub(crate) fn solve(run: &mut Run<'_>, plan: &Plan) -> bool {
    let columns: Vec<Target> = plan
        .unknowns
        .iter()
        .map(|u| match (u.differential, u.target) {
            (true, Target::Var(v)) => Target::Der(v),
            (_, target) => target,
        })
        .collect();
    for _ in 0..60 {
        run.execute(&plan.assignments);
        let base = run.residuals(plan);
        if base.iter().all(|r| r.abs() < 1e-11) {
            return true;
        }
        let n = base.len();
        let mut matrix = vec![vec![0.0; n + 1]; n];
        for (c, &target) in columns.iter().enumerate() {
            let old = run.values[&target];
            let h = 1e-7 * old.abs().max(1.0);
            run.values.insert(target, old + h);
            run.execute(&plan.assignments);
            for (r, value) in run.residuals(plan).into_iter().enumerate() {
                matrix[r][c] = (value - base[r]) / h;
            }
            run.values.insert(target, old);
        }
        for r in 0..n {
            matrix[r][n] = -base[r];
        }
        let Some(step) = gauss(matrix) else { return false };
        for (&target, step) in columns.iter().zip(step) {
            *run.values.get_mut(&target).expect("set before") += step;
        }
    }
    false
}

/// Gaussian elimination with row pivoting on an augmented matrix.
fn gauss(mut m: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let n = m.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs()))?;
        m.swap(k, pivot);
        if m[k][k].abs() < 1e-14 {
            return None;
        }
        for r in 0..n {
            if r != k {
                let factor = m[r][k] / m[k][k];
                let pivot = m[k].clone();
                m[r].iter_mut().zip(pivot).skip(k).for_each(|(entry, pivot)| *entry -= factor * pivot);
            }
        }
    }
    Some((0..n).map(|k| m[k][n] / m[k][k]).collect())
}

/// The composed derivatives of the residuals by all columns, as the documentation of `PlanJacobian` defines them.
pub(crate) fn composed(run: &Run<'_>, plan: &Plan, jacobian: &PlanJacobian) -> Vec<HashMap<u32, f64>> {
    let places = Places::new(run.system.roles.len(), plan);
    let mut rows: Vec<HashMap<u32, f64>> = Vec::new();
    let ranges = plan.assignments.iter().map(|a| a.operands).chain(plan.residuals.iter().map(|r| r.operands));
    for (r, range) in ranges.enumerate() {
        let mut row = HashMap::new();
        for &(slot, partial) in jacobian.partials(r) {
            let operand = run.system.operands_of(range)[slot.0 as usize];
            let factor = run.value(partial, range) * if operand.negated() { -1.0 } else { 1.0 };
            match places.of(operand.target()) {
                PlanPlace::Column(c) => *row.entry(c).or_insert(0.0) += factor,
                PlanPlace::Assigned(k) => {
                    for (&c, &d) in &rows[k as usize].clone() {
                        *row.entry(c).or_insert(0.0) += factor * d;
                    }
                }
                PlanPlace::Fixed => {}
            }
        }
        rows.push(row);
    }
    rows.split_off(plan.assignments.len())
}
