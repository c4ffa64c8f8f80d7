//! What stands for each derivative after index reduction.
//!
//! A variable with highest derivative `d`, of which the last `k` are dummies, keeps `m = d - k` states: itself and its
//! derivatives below `m`; derivative `m` is the rate of the last state, and the derivatives above are algebraic
//! variables named `der(x)`, `der(der(x))`.  Where the choice is left to the run, all derivatives are variables.  New
//! variables are appended in blocks, whole arrays in one, so that they share templates and code as the declared ones
//! do.

use hyd_flat::{Target, VarId, derivative_block};
use hyd_index::IndexVec;

use crate::system::{EquationSystem, Resolution, Role};

/// The derivatives of the variables.
pub(crate) struct Derivatives {
    /// Number of states of each variable.
    states: IndexVec<VarId, u32>,
    /// The orders of each variable that may be states.
    open: rustc_hash::FxHashMap<VarId, Vec<u32>>,
    /// Variables made for derivatives: `(variable, order)`, `order` from 1.
    made: rustc_hash::FxHashMap<(VarId, u32), VarId>,
    /// `der(left) = right` for states that are derivatives themselves.
    pub chains: Vec<(VarId, VarId)>,
}

impl Derivatives {
    /// Makes the variables that the choice `(variable, highest, dummies)` needs, and sets the roles.  `open` are derivatives
    /// (variable, order) that may be states.
    pub(crate) fn make(system: &mut EquationSystem, variables: &[(VarId, u32, u32)], open: &[(VarId, u32)]) -> Self {
        let mut states = IndexVec::filled(0, system.roles.len());
        for v in system.roles.indices() {
            states[v] = u32::from(system.roles[v] == Role::State);
        }
        let mut made = Self { states, open: Default::default(), made: Default::default(), chains: Vec::new() };
        for &(v, order) in open {
            made.open.entry(v).or_default().push(order);
        }
        for &(v, highest, dummies) in variables {
            let before = system.roles[v];
            made.states[v] = highest - dummies;
            system.roles[v] = made.role(v, 0);
            if before == Role::State && system.roles[v] != Role::State {
                system.reduction.demoted.push(v);
            }
        }
        let most = variables.iter().map(|entry| entry.1).max().unwrap_or(0);
        for order in 1..=most {
            let wanted: Vec<VarId> = variables
                .iter()
                .filter(|&&(v, highest, dummies)| {
                    order <= highest && (order != highest - dummies || made.open.contains_key(&v))
                })
                .map(|entry| entry.0)
                .collect();
            made.append(system, &wanted, order);
        }
        for &(v, _, _) in variables {
            let states = made.states[v];
            let is_rate = |order: u32| order == states && !made.open.contains_key(&v);
            let chained = (1..=states).filter(|&order| made.role(v, order - 1) == Role::State && !is_rate(order));
            let pairs: Vec<_> = chained.map(|order| (made.variable(v, order - 1), made.variable(v, order))).collect();
            made.chains.extend(pairs);
        }
        made
    }

    /// The role of a derivative.
    fn role(&self, v: VarId, order: u32) -> Role {
        match self.open.get(&v) {
            Some(open) if open.contains(&order) => Role::Candidate,
            _ if order < self.states[v] => Role::State,
            _ => Role::Algebraic,
        }
    }

    /// What a slot reads for the derivative of a variable of the given order.
    pub(crate) fn target(&self, v: VarId, order: u32) -> Target {
        match self.states.get(v) {
            Some(&states) if order > 0 && order == states && !self.open.contains_key(&v) => {
                Target::Der(self.variable(v, order - 1))
            }
            _ => Target::Var(self.variable(v, order)),
        }
    }

    /// The variable of a derivative that is not a rate.
    pub(crate) fn variable(&self, v: VarId, order: u32) -> VarId {
        match order {
            0 => v,
            _ => *self.made.get(&(v, order)).expect("invariant: made for every order that is not a rate"),
        }
    }

    /// Appends the derivatives of the given order; whole blocks keep their form.
    fn append(&mut self, system: &mut EquationSystem, variables: &[VarId], order: u32) {
        let mut rest = variables;
        while let Some(&v) = rest.first() {
            let (id, element) = system.flat.locate(v);
            let block = &system.flat.variables[id];
            let count = block.count as usize;
            let whole = element == 0 && rest.len() >= count && rest[count - 1].0 == v.0 + count as u32 - 1;
            let taken = if whole { count } else { 1 };
            let first = VarId(system.flat.scalars);
            let new = derivative_block(block, (element, taken), order, first);
            system.flat.variables.push(new);
            system.flat.scalars += taken as u32;
            for (k, &v) in rest[..taken].iter().enumerate() {
                let made = VarId(first.0 + k as u32);
                self.made.insert((v, order), made);
                let role = self.role(v, order);
                system.roles.push(role);
                system.resolution.push(Resolution::Own);
                if role == Role::Algebraic {
                    system.reduction.dummies.push(made);
                }
            }
            rest = &rest[taken..];
        }
    }
}
