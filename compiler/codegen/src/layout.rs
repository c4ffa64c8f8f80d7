//! Where every quantity of a sorted system stands in memory.
//!
//! The data area holds, in this order: time, the `initial()` flag, the share of `homotopy`, the constants pool,
//! parameter values, for each parameter that can be set a flag and a given value, start values, discrete variables,
//! their values before the event, such values of continuous variables, held relations, which candidates are states, delayed values
//! with their rates, and recorded inputs with theirs. Unknowns and rates are the solver's vectors, assigned variables stand in the work
//! area by their number in the plan.  The initial and the simulation plan have each their own [`PlanPlaces`] over the
//! same data area.

use std::ops::Range;

use hyd_equations::{Plan, Resolution, Role, Selection, SortedSystem};
use hyd_flat::{Operand, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_system::{Settable, ValueKind};

use hyd_payload::Given;
pub(crate) use hyd_payload::Place;

use crate::program::{Area, HOMOTOPY};

/// The data area.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Length of the data area.
    pub data: u32,
    /// Position of the constants pool.
    pub constants: u32,
    /// Values of parameters and of everything that is computed with them.
    pub parameters: Range<u32>,
    /// Which variable each of them is.
    pub parameter_vars: Vec<VarId>,
    /// Flag and value per parameter, none if it cannot be set.
    pub given: Vec<Option<Given>>,
    /// Discrete variables.
    pub discrete: Range<u32>,
    /// Which variable each of them is.
    pub discrete_vars: Vec<VarId>,
    /// Their values before the event, in the same order.
    pub pre: Range<u32>,
    /// Continuous variables whose value before the event is asked for: variable and position.
    pub pre_continuous: Vec<(VarId, u32)>,
    /// Truth of the relations.
    pub held: Range<u32>,
    /// Which candidates are states, 1 or 0 (`Target::Chosen`).
    pub chosen: Range<u32>,
    /// Delayed values per site.
    pub delayed: Range<u32>,
    /// Delayed rates per site.
    pub delayed_rates: Range<u32>,
    /// Inputs that follow recorded samples.
    pub inputs: Range<u32>,
    /// Their derivatives.
    pub input_rates: Range<u32>,
    /// Positions with a value other than zero before anything is computed (constants, default start values).
    pub preset: Vec<(u32, f64)>,
    of: Positions,
}

/// Positions in the data area by variable.
#[derive(Clone, Debug)]
struct Positions {
    values: IndexVec<VarId, Option<Place>>,
    starts: IndexVec<VarId, Option<u32>>,
    pres: IndexVec<VarId, Option<u32>>,
}

/// Places of variables and derivatives in one plan.
#[derive(Clone, Debug)]
pub(crate) struct PlanPlaces {
    variables: IndexVec<VarId, Option<Place>>,
    rates: IndexVec<VarId, Option<Place>>,
}

impl Layout {
    /// Lays out the data area of a system.
    pub(crate) fn new(sorted: &SortedSystem) -> Self {
        let count = sorted.system.flat.scalars as usize;
        let constants = HOMOTOPY + 1;
        let mut layout = Self {
            data: constants,
            constants,
            parameters: 0..0,
            parameter_vars: parameter_vars(sorted),
            given: Vec::new(),
            discrete: 0..0,
            discrete_vars: Vec::new(),
            pre: 0..0,
            pre_continuous: Vec::new(),
            held: 0..0,
            chosen: 0..0,
            delayed: 0..0,
            delayed_rates: 0..0,
            inputs: 0..0,
            input_rates: 0..0,
            preset: Vec::new(),
            of: Positions {
                values: IndexVec::filled(None, count),
                starts: IndexVec::filled(None, count),
                pres: IndexVec::filled(None, count),
            },
        };
        let pool = layout.take(sorted.system.flat.constants.len());
        layout.preset.push((HOMOTOPY, 1.0));
        layout.preset.extend(pool.zip(sorted.system.flat.constants.iter().copied()));
        layout.place_parameters(sorted);
        layout.place_starts(sorted);
        layout.place_discrete(sorted);
        layout.held = layout.take(sorted.relations.len());
        layout.chosen = layout.take(sorted.selections.iter().map(Selection::choices).sum());
        let sites = sorted.system.flat.delay_sites() as usize;
        layout.delayed = layout.take(sites);
        layout.delayed_rates = layout.take(sites);
        let inputs = sorted.system.flat.driven_inputs() as usize;
        layout.inputs = layout.take(inputs);
        layout.input_rates = layout.take(inputs);
        layout
    }

    fn take(&mut self, count: usize) -> Range<u32> {
        let start = self.data;
        self.data += count as u32;
        start..self.data
    }

    fn place_parameters(&mut self, sorted: &SortedSystem) {
        self.parameters = self.take(self.parameter_vars.len());
        for (&v, index) in self.parameter_vars.iter().zip(self.parameters.clone()) {
            self.of.values[v] = Some(Place::data(index));
        }
        let mut solved = vec![false; self.of.values.len()];
        let initial = &sorted.initial;
        let unknowns = initial.unknowns.iter().map(|u| u.target);
        for target in unknowns.chain(initial.assignments.iter().map(|a| a.target)) {
            if let Target::Var(v) = target {
                solved[v.index()] = true;
            }
        }
        for k in 0..self.parameter_vars.len() {
            let v = self.parameter_vars[k];
            let (block, _) = sorted.system.flat.locate(v);
            let settable = sorted.system.flat.variables[block].settable == Settable::Yes && !solved[v.index()];
            let given = settable.then(|| {
                let flag = self.take(2).start;
                Given { flag, value: flag + 1 }
            });
            self.given.push(given);
        }
    }

    fn place_starts(&mut self, sorted: &SortedSystem) {
        let targets = sorted.starts.iter().map(|a| a.target);
        let operands = sorted.system.operands.iter().map(|o| o.target());
        let unknowns = sorted.simulation.unknowns.iter().chain(&sorted.initial.unknowns).map(|u| match u.target {
            Target::Var(v) => Target::Start(v),
            other => other,
        });
        let discrete = discrete_vars(sorted).into_iter().map(Target::Start);
        for target in targets.chain(operands).chain(unknowns).chain(discrete) {
            let Target::Start(v) = target else { continue };
            if self.of.starts[v].is_none() {
                let index = self.take(1).start;
                self.of.starts[v] = Some(index);
                let default = default_start(sorted, v);
                if default != 0.0 {
                    self.preset.push((index, default));
                }
            }
        }
    }

    fn place_discrete(&mut self, sorted: &SortedSystem) {
        self.discrete_vars = discrete_vars(sorted).into_iter().filter(|&v| self.of.values[v].is_none()).collect();
        self.discrete = self.take(self.discrete_vars.len());
        self.pre = self.take(self.discrete_vars.len());
        for (k, &v) in self.discrete_vars.iter().enumerate() {
            self.of.values[v] = Some(Place::data(self.discrete.start + k as u32));
            self.of.pres[v] = Some(self.pre.start + k as u32);
        }
        let wanted: Vec<VarId> = sorted
            .system
            .operands
            .iter()
            .filter_map(|o| if let Target::Pre(v) = o.target() { Some(v) } else { None })
            .collect();
        for v in wanted {
            if self.of.pres[v].is_none() {
                let index = self.take(1).start;
                self.of.pres[v] = Some(index);
                self.pre_continuous.push((v, index));
            }
        }
    }

    /// Position of a start value.
    pub(crate) fn start(&self, v: VarId) -> Option<u32> {
        self.of.starts[v]
    }

    /// All start values with their positions.
    pub(crate) fn starts(&self) -> impl Iterator<Item = (VarId, u32)> + '_ {
        self.of.starts.iter_enumerated().filter_map(|(v, index)| index.map(|index| (v, index)))
    }

    /// Place of a parameter or discrete variable.
    pub(crate) fn value(&self, v: VarId) -> Option<Place> {
        self.of.values[v]
    }

    /// Places while parameters and start values are computed: nothing but the data area.
    pub(crate) fn bound(&self) -> PlanPlaces {
        PlanPlaces { variables: self.of.values.clone(), rates: IndexVec::filled(None, self.of.values.len()) }
    }

    /// Places in a plan; with `rates` the derivatives of its unknowns are the solver's.
    pub(crate) fn plan(&self, plan: &Plan, rates: bool) -> PlanPlaces {
        let mut places = self.bound();
        for (k, assignment) in plan.assignments.iter().enumerate() {
            places.set(assignment.target, Place { area: Area::Work, index: k as u32 });
        }
        for (k, unknown) in plan.unknowns.iter().enumerate() {
            let index = k as u32;
            places.set(unknown.target, Place { area: Area::Unknown, index });
            if let (true, Target::Var(v)) = (rates, unknown.target) {
                places.set(Target::Der(v), Place { area: Area::Rate, index });
            }
        }
        places
    }

    /// Place and sign of what a slot reads.
    ///
    /// # Errors
    /// A sentence, when the target has no place (a fault of an earlier stage).
    pub(crate) fn locate(
        &self,
        sorted: &SortedSystem,
        places: &PlanPlaces,
        operand: Operand,
    ) -> Result<(Place, bool), String> {
        let (target, negated) = resolve(sorted, operand);
        let place = match target {
            Target::Const(c) => Some(Place::data(self.constants + c.0)),
            Target::Start(v) => self.of.starts[v].map(Place::data),
            Target::Pre(v) => self.of.pres[v].map(Place::data),
            Target::Held(r) => Some(Place::data(self.held.start + r)),
            Target::Chosen(k) => Some(Place::data(self.chosen.start + k)),
            Target::Delayed(site) => Some(Place::data(self.delayed.start + site)),
            Target::DelayedRate(site) => Some(Place::data(self.delayed_rates.start + site)),
            Target::Input(k) => Some(Place::data(self.inputs.start + k)),
            Target::InputRate(k) => Some(Place::data(self.input_rates.start + k)),
            Target::Var(_) | Target::Der(_) => places.get(target),
        };
        let name = || format!("`{}` is used but never computed", sorted.system.flat.operand_name(operand));
        place.map(|place| (place, negated)).ok_or_else(name)
    }
}

impl PlanPlaces {
    fn set(&mut self, target: Target, place: Place) {
        match target {
            Target::Var(v) => self.variables[v] = Some(place),
            Target::Der(v) => self.rates[v] = Some(place),
            _ => {}
        }
    }

    /// Place of a variable or derivative.
    pub(crate) fn get(&self, target: Target) -> Option<Place> {
        match target {
            Target::Var(v) => self.variables[v],
            Target::Der(v) => self.rates[v],
            _ => None,
        }
    }
}

/// Follows what alias elimination made of a variable.
pub(crate) fn resolve(sorted: &SortedSystem, operand: Operand) -> (Target, bool) {
    let (target, negated) = (operand.target(), operand.negated());
    let follow = |v: VarId, wrap: fn(VarId) -> Target| match sorted.system.resolution[v] {
        Resolution::Own => (target, negated),
        Resolution::Alias { of, negated: flip } => (wrap(of), negated != flip),
        Resolution::Value(c) => (Target::Const(c), negated),
    };
    match target {
        Target::Var(v) => follow(v, Target::Var),
        Target::Der(v) => follow(v, Target::Der),
        Target::Pre(v) => follow(v, Target::Pre),
        _ => (target, negated),
    }
}

/// Parameters, constants and everything that a binding computes, by number.
fn parameter_vars(sorted: &SortedSystem) -> Vec<VarId> {
    let mut member = vec![false; sorted.system.roles.len()];
    for (v, role) in sorted.system.roles.iter_enumerated() {
        let own = sorted.system.resolution[v] == Resolution::Own;
        member[v.index()] = own && matches!(role, Role::Parameter | Role::Constant);
    }
    for binding in &sorted.bindings {
        if let Target::Var(v) = binding.target {
            member[v.index()] = true;
        }
    }
    member.iter().enumerate().filter(|(_, m)| **m).map(|(k, _)| VarId::new(k)).collect()
}

/// Discrete variables and whatever the discrete equations compute, by number.
fn discrete_vars(sorted: &SortedSystem) -> Vec<VarId> {
    let mut member = vec![false; sorted.system.roles.len()];
    for (v, role) in sorted.system.roles.iter_enumerated() {
        member[v.index()] = sorted.system.resolution[v] == Resolution::Own && *role == Role::Discrete;
    }
    for assignment in &sorted.discrete {
        if let Target::Var(v) = assignment.target {
            member[v.index()] = true;
        }
    }
    // What the plan computes at all times has its place there.
    for assignment in &sorted.simulation.assignments {
        if let Target::Var(v) = assignment.target {
            member[v.index()] = false;
        }
    }
    member.iter().enumerate().filter(|(_, m)| **m).map(|(k, _)| VarId::new(k)).collect()
}

/// Start value of a variable that states none: 0, false, or the first literal of an enumeration.
fn default_start(sorted: &SortedSystem, v: VarId) -> f64 {
    let (block, _) = sorted.system.flat.locate(v);
    match sorted.system.flat.variables[block].kind {
        ValueKind::Enumeration(_) => 1.0,
        _ => 0.0,
    }
}
