//! Alias elimination: variables that merely rename another, or have a fixed value, disappear from the equations.
//!
//! Equations that say `a = b`, `a = -b` or `a = 3` join classes of equal variables (union-find with signs, Tarjan 1975,
//! "Efficiency of a good but not linear set union algorithm"), again and again, because a zero may turn a longer equation
//! into an alias.  Each class keeps one variable, states first; the others point to it.  An equation that says
//! nothing new about its class stays, so that the structural analysis reports it.  Variables equal to a parameter stay
//! too: parameters are run-time data.

mod classes;
pub(crate) mod representative;
mod specialize;

use hyd_flat::{ConstId, Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{SlotId, TemplateId, alias, constant_value};
use rustc_hash::FxHashMap;

use crate::alias::classes::Classes;
use crate::alias::representative::choose_representatives;
use crate::alias::specialize::{Change, Specializer};
use crate::fixed_starts::fixed_starts;
use crate::system::{EqId, Equation, EquationSystem, OperandRange, Resolution, Role};

/// More rounds than this are not made; each needs a new zero behind a chain of equations.
const MOST_ROUNDS: usize = 64;

/// What an equation says if it is trivial.
#[derive(Clone, Copy)]
enum Form {
    /// Two slots are equal, or opposite (true).
    Alias(SlotId, SlotId, bool),
    /// A slot has a fixed value.
    Value(SlotId, f64),
    /// Anything longer.
    Other,
}

/// The system after alias elimination.
pub fn eliminate_aliases(mut system: EquationSystem) -> EquationSystem {
    // A rate replaced by a state may leave a new alias (`w = der(s)` with `der(s) = v`), so this is repeated.
    while eliminate_once(&mut system) {}
    follow_chains(&mut system);
    system
}

/// One round; true if rates were replaced, so that new aliases may have come up.
fn eliminate_once(system: &mut EquationSystem) -> bool {
    let mut pass = Pass {
        classes: Classes::new(system.roles.len()),
        forms: Vec::new(),
        specializer: Specializer::default(),
        used: IndexVec::filled(false, system.equations.len()),
        rates: FxHashMap::default(),
        changes: Vec::new(),
        resolved: Vec::new(),
        discrete_starts: discrete_starts(system),
    };
    pass.join(system);
    resolve(system, &mut pass.classes);
    let dropped_starts = choose_representatives(system, &mut pass.classes);
    for eq in dropped_starts {
        pass.used[eq] = true;
    }
    pass.find_rates(system);
    pass.rewrite(system)
}

/// Lets variables whose representative was itself eliminated later point to the last one.
fn follow_chains(system: &mut EquationSystem) {
    for v in system.roles.indices() {
        let Resolution::Alias { mut of, mut negated } = system.resolution[v] else { continue };
        while let Resolution::Alias { of: next, negated: flip } = system.resolution[of] {
            (of, negated) = (next, negated ^ flip);
        }
        system.roles[v] = system.roles[of];
        system.resolution[v] = match system.resolution[of] {
            Resolution::Value(c) if negated => {
                let value = 0.0 - system.flat.constants[c];
                Resolution::Value(system.flat.constants.push(value))
            }
            Resolution::Value(c) => Resolution::Value(c),
            _ => Resolution::Alias { of, negated },
        };
    }
}

/// The discrete variables that start at a value of their own, with that value where it is a number.
fn discrete_starts(system: &EquationSystem) -> FxHashMap<VarId, Option<f64>> {
    let numbers = fixed_starts(system);
    let discrete = system.roles.iter_enumerated().filter(|(_, role)| **role == Role::Discrete).map(|(v, _)| v);
    let fixed = discrete.filter(|&v| {
        let (block, k) = system.flat.locate(v);
        system.flat.variables[block].fixed.get(k) && !system.fixed_by_others.contains(&v)
    });
    fixed.map(|v| (v, numbers.get(&v).copied())).collect()
}

struct Pass {
    classes: Classes,
    /// Form of each template, by id.
    forms: Vec<Option<Form>>,
    specializer: Specializer,
    /// Equations that are used up.
    used: IndexVec<EqId, bool>,
    /// States whose derivative is another state or its negative (`der(s) = v`), with the equation that says so.
    rates: FxHashMap<VarId, (EqId, Operand)>,
    /// Work space: what happens to each slot of an equation, and what it reads then.
    changes: Vec<Change>,
    resolved: Vec<Operand>,
    /// What discrete variables start at, by the root of their class; nothing where that is not a number.
    discrete_starts: FxHashMap<VarId, Option<f64>>,
}

impl Pass {
    /// Joins classes until no equation says anything new.
    fn join(&mut self, system: &mut EquationSystem) {
        for round in 0..MOST_ROUNDS {
            let mut progress = false;
            for eq in system.equations.indices() {
                if !self.used[eq]
                    && matches!(system.section(eq), Section::Continuous | Section::Discrete)
                    && self.take(system, eq, round > 0)
                {
                    self.used[eq] = true;
                    progress = true;
                }
            }
            if !progress {
                break;
            }
        }
    }

    /// Uses an equation up if it is an alias; in later rounds only those that have changed are looked at again.
    fn take(&mut self, system: &mut EquationSystem, eq: EqId, changed_only: bool) -> bool {
        let Equation { mut template, operands, .. } = system.equations[eq];
        let range = operands.first as usize..(operands.first + operands.len) as usize;
        let mut kept: Option<Box<[SlotId]>> = None;
        if changed_only {
            if !self.changes_of(system, range.clone()) {
                return false;
            }
            let (new, slots) = self.specializer.adapt(&mut system.flat.templates, template, &self.changes);
            template = *new;
            kept = Some(slots.clone());
        }
        let read = |slot: SlotId| {
            let slot = kept.as_ref().map_or(slot, |kept| kept[slot.index()]);
            system.operands[range.start + slot.index()]
        };
        match self.form(system, template) {
            Form::Other => false,
            Form::Value(slot, value) => self.fix(system, eq, read(slot), value),
            Form::Alias(a, b, opposite) => self.equate(system, eq, read(a), read(b), opposite),
        }
    }

    fn form(&mut self, system: &EquationSystem, template: TemplateId) -> Form {
        if self.forms.len() <= template.index() {
            self.forms.resize(system.flat.templates.len(), None);
        }
        *self.forms[template.index()].get_or_insert_with(|| {
            let (arena, template) = (&system.flat.templates.arena, system.flat.templates.get(template));
            match (alias(arena, &template), constant_value(arena, &template)) {
                (Some((a, b, opposite)), _) => Form::Alias(a, b, opposite),
                (None, Some((slot, value))) => Form::Value(slot, value),
                (None, None) => Form::Other,
            }
        })
    }

    fn fix(&mut self, system: &EquationSystem, eq: EqId, operand: Operand, value: f64) -> bool {
        let value = if operand.negated() { -value } else { value };
        match operand.target() {
            Target::Var(v) if system.section(eq) == Section::Continuous && is_unknown(system, v) => {
                self.classes.fix(v, value)
            }
            _ => false,
        }
    }

    fn equate(&mut self, system: &EquationSystem, eq: EqId, a: Operand, b: Operand, opposite: bool) -> bool {
        let opposite = opposite ^ a.negated() ^ b.negated();
        match (a.target(), b.target()) {
            (Target::Var(v), Target::Var(w)) if is_unknown(system, v) && is_unknown(system, w) => {
                self.classes.equate(v, w, opposite)
            }
            (Target::Var(v), Target::Var(w)) if are_discrete_twins(system, v, w) && !opposite => {
                self.equate_discrete(v, w)
            }
            (Target::Var(v), Target::Const(c)) | (Target::Const(c), Target::Var(v)) => {
                let value = system.flat.constants[c];
                self.fix(system, eq, Operand::new(Target::Var(v)), if opposite { -value } else { value })
            }
            _ => false,
        }
    }

    /// The equation of discrete variables that may start at different values stays: `pre` of them at the first event is not the same.
    fn equate_discrete(&mut self, v: VarId, w: VarId) -> bool {
        let [one, other] = [v, w].map(|v| self.classes.find(v).0);
        let starts = [one, other].map(|root| self.discrete_starts.get(&root).copied());
        if let [Some(first), Some(second)] = starts
            && (first != second || first.is_none())
        {
            return false;
        }
        let joined = self.classes.equate(v, w, false);
        if let Some(start) = starts[0].or(starts[1]) {
            self.discrete_starts.insert(self.classes.find(v).0, start);
        }
        joined
    }

    /// Fills `changes` for an equation by the classes found so far; true if a slot changes.
    fn changes_of(&mut self, system: &EquationSystem, range: std::ops::Range<usize>) -> bool {
        let classes = &mut self.classes;
        let read = |operand: Operand| match operand.target() {
            Target::Var(v) if is_unknown(system, v) => {
                let (root, negated) = classes.find(v);
                match classes.value_of_root(root) {
                    Some(0.0) => None,
                    Some(_) => Some(operand),
                    None => Some(Operand::new(Target::Var(root)).signed(negated ^ operand.negated())),
                }
            }
            Target::Der(v) => {
                let (root, negated) = classes.find(v);
                let fixed = classes.value_of_root(root).is_some();
                (!fixed).then(|| Operand::new(Target::Der(root)).signed(negated ^ operand.negated()))
            }
            _ => Some(operand),
        };
        list_changes(&system.operands[range], read, &mut self.changes, &mut self.resolved)
    }

    /// Finds the equations `der(s) = v` between states; elsewhere `v` is then read instead of `der(s)`, so that only
    /// one equation reads the rate and velocities computed from positions stay exact between the solver's steps.
    fn find_rates(&mut self, system: &mut EquationSystem) {
        for eq in system.equations.indices() {
            if self.used[eq] || system.section(eq) != Section::Continuous {
                continue;
            }
            let Equation { template, operands, .. } = system.equations[eq];
            let Form::Alias(a, b, opposite) = self.form(system, template) else { continue };
            let read = |slot: SlotId| resolve_operand(system, system.operands_of(operands)[slot.index()]);
            let (Some(a), Some(b)) = (read(a), read(b)) else { continue };
            let (state, rate) = match (a.target(), b.target()) {
                (Target::Der(s), Target::Var(_)) => (s, b),
                (Target::Var(_), Target::Der(s)) => (s, a),
                _ => continue,
            };
            let negated = opposite ^ a.negated() ^ b.negated();
            if let Target::Var(v) = rate.target()
                && system.roles[v] == Role::State
            {
                let rate = Operand::new(rate.target()).signed(negated);
                self.rates.entry(state).or_insert((eq, rate));
            }
        }
    }

    /// Replaces the operands of all remaining equations and drops the others.
    /// True if a rate was replaced.
    fn rewrite(&mut self, system: &mut EquationSystem) -> bool {
        let mut replaced = false;
        let mut operands = Vec::with_capacity(system.operands.len());
        let mut equations = IndexVec::new();
        for eq in system.equations.indices() {
            if self.used[eq] {
                continue;
            }
            let mut equation = system.equations[eq];
            let rates = &self.rates;
            let read = |operand| {
                let operand = resolve_operand(system, operand)?;
                let Target::Der(s) = operand.target() else { return Some(operand) };
                match rates.get(&s) {
                    Some(&(says_so, rate)) if says_so != eq => {
                        replaced = true;
                        Some(rate.signed(operand.negated()))
                    }
                    _ => Some(operand),
                }
            };
            let before = system.operands_of(equation.operands);
            let changed = list_changes(before, read, &mut self.changes, &mut self.resolved);
            let first = operands.len() as u32;
            if changed {
                let adapted = self.specializer.adapt(&mut system.flat.templates, equation.template, &self.changes);
                equation.template = adapted.0;
                operands.extend(adapted.1.iter().map(|slot| self.resolved[slot.index()]));
            } else {
                operands.extend_from_slice(&self.resolved);
            }
            equation.operands = OperandRange { first, len: operands.len() as u32 - first };
            equations.push(equation);
        }
        system.operands = operands;
        system.equations = equations;
        replaced
    }
}

/// A continuous unknown (a state or algebraic variable).
fn is_unknown(system: &EquationSystem, v: VarId) -> bool {
    system.roles[v].is_continuous()
}

fn are_discrete_twins(system: &EquationSystem, v: VarId, w: VarId) -> bool {
    let kind = |v| &system.flat.variables[system.flat.locate(v).0].kind;
    system.roles[v] == Role::Discrete && system.roles[w] == Role::Discrete && kind(v) == kind(w)
}

/// Lists what happens to each slot when `read` says what it reads now (none: zero); true if any slot goes away.
fn list_changes(
    operands: &[Operand],
    mut read: impl FnMut(Operand) -> Option<Operand>,
    changes: &mut Vec<Change>,
    now: &mut Vec<Operand>,
) -> bool {
    const SHORT: usize = 16;
    let zero = Operand::new(Target::Const(ConstId(0)));
    now.clear();
    changes.clear();
    let mut positions: FxHashMap<Target, u32> = FxHashMap::default();
    let mut changed = false;
    for (k, &operand) in operands.iter().enumerate() {
        let operand = read(operand);
        let change = match operand.map(|o| (o, o.target())) {
            None => Change::Zero,
            Some((operand, target @ (Target::Var(_) | Target::Der(_)))) => {
                let before = if operands.len() <= SHORT {
                    (0..k).find(|&j| changes[j] == Change::Keep && now[j].target() == target).map(|j| j as u32)
                } else {
                    let first = *positions.entry(target).or_insert(k as u32);
                    (first != k as u32).then_some(first)
                };
                before.map_or(Change::Keep, |j| {
                    let negated = now[j as usize].negated() != operand.negated();
                    Change::Same { slot: SlotId(j), negated }
                })
            }
            Some(_) => Change::Keep,
        };
        changed |= change != Change::Keep;
        now.push(operand.unwrap_or(zero));
        changes.push(change);
    }
    changed
}

/// What a slot reads after elimination; none for zero.
fn resolve_operand(system: &EquationSystem, operand: Operand) -> Option<Operand> {
    let moved = |make: fn(VarId) -> Target, v: VarId| match system.resolution[v] {
        Resolution::Own => Some(operand),
        Resolution::Alias { of, negated } => Some(Operand::new(make(of)).signed(negated ^ operand.negated())),
        Resolution::Value(c) => {
            let value = system.flat.constants[c];
            (value != 0.0).then(|| Operand::new(Target::Const(c)).signed(operand.negated()))
        }
    };
    match operand.target() {
        Target::Var(v) => moved(Target::Var, v),
        Target::Pre(v) => moved(Target::Pre, v),
        Target::Start(v) => moved(Target::Start, v),
        Target::Der(v) => match system.resolution[v] {
            Resolution::Value(_) => None,
            _ => moved(Target::Der, v),
        },
        Target::Const(_)
        | Target::Held(_)
        | Target::Chosen(_)
        | Target::Delayed(_)
        | Target::DelayedRate(_)
        | Target::Input(_)
        | Target::InputRate(_) => Some(operand),
    }
}

/// Enters the variables with fixed values into the table; aliases follow when representatives are chosen.
fn resolve(system: &mut EquationSystem, classes: &mut Classes) {
    let is_own = IndexVec::<VarId, bool>::from_vec(system.resolution.iter().map(|r| *r == Resolution::Own).collect());
    let mut pool: FxHashMap<u64, ConstId> = FxHashMap::default();
    for v in system.roles.indices().filter(|&v| is_own[v]) {
        let (root, negated) = classes.find(v);
        if let Some(value) = classes.value_of_root(root) {
            let value = if negated { -value } else { value } + 0.0;
            let constants = &mut system.flat.constants;
            let id = *pool.entry(value.to_bits()).or_insert_with(|| constants.push(value));
            system.resolution[v] = Resolution::Value(id);
            system.roles[v] = Role::Constant;
        }
    }
}
