//! Names, units, equations and places in the text, as the runtime and the reports want them.
//!
//! The row of outputs holds the assigned variables, the unknowns, the rates of the states and the discrete variables, in
//! this order; eliminated variables point to what they equal, with a sign.

use std::sync::Arc;

use hyd_equations::{Assignment, Block, EventRelation, Plan, Resolution, Role, SortedSystem};
use hyd_flat::{FlatModel, Made, Operand, Target, VarId, VariableBlock, rate_unit};
use hyd_index::TypedIndex;
use hyd_payload::{Limit, OutputRow};
use hyd_source::{Files, Origin, Span};
use hyd_symbolic::{Arena, Node, SlotId, print};
use hyd_system::{
    EquationInfo, LoopInfo, NamePattern, Place as ValuePlace, RootInfo, Settable, Source, Tables, ValueKind,
    Variability, VariableInfo,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::layout::{Layout, Place, resolve};
use crate::lower::Lowered;
use crate::program::Area;
use crate::spans::span_of;

/// The row of outputs of a system.
pub(crate) fn output_row(sorted: &SortedSystem, layout: &Layout) -> OutputRow {
    let plan = &sorted.simulation;
    OutputRow {
        assigned: plan.assignments.len() as u32,
        unknowns: plan.unknowns.len() as u32,
        states: (0u32..).zip(&plan.unknowns).filter(|(_, u)| u.differential).map(|(k, _)| k).collect(),
        discrete: layout.discrete.len() as u32,
    }
}

/// Position in the row of what stands at a place.
fn position(row: &OutputRow, layout: &Layout, place: Place) -> Option<u32> {
    match place.area {
        Area::Work => Some(place.index),
        Area::Unknown => Some(row.assigned + place.index),
        Area::Rate => {
            let k = row.states.binary_search(&place.index).ok()?;
            Some(row.assigned + row.unknowns + k as u32)
        }
        Area::Data if layout.discrete.contains(&place.index) => {
            Some(row.len() as u32 - row.discrete + (place.index - layout.discrete.start))
        }
        _ => None,
    }
}

/// What tables are made from.
pub(crate) struct Describe<'a> {
    /// The system.
    pub sorted: &'a SortedSystem,
    /// Its places.
    pub lowered: &'a Lowered,
    /// The texts.
    pub files: &'a Files,
    /// The row of outputs.
    pub row: &'a OutputRow,
}

impl Describe<'_> {
    /// All tables, and the bounds of what does not change.
    ///
    /// # Errors
    /// A sentence, when a variable has no value anywhere (a fault of an earlier stage).
    pub(crate) fn tables(&self) -> Result<(Tables, Vec<Limit>), String> {
        let flat = self.flat();
        let unknown_blocks = self.unknown_blocks();
        let mut variables = Vec::new();
        let mut shown: Vec<Option<u32>> = Vec::with_capacity(flat.variables.len());
        // Derivatives that are variables, by what they are the derivatives of: one that the text differentiates again may be freed
        // by the reduction of the index as well.
        let mut rates: FxHashMap<(VarId, u32, u32), u32> = FxHashMap::default();
        for block in flat.variables.iter() {
            if let (Some(Made::Derivative { of, order }), 1..) = (block.made, block.count) {
                let known = *rates.entry((of, order, block.count)).or_insert(variables.len() as u32);
                if known < variables.len() as u32 {
                    shown.push(Some(known));
                    continue;
                }
            }
            // Of what the translation made derivatives are shown, and unknowns, because messages name them.
            let hide = match block.made {
                None | Some(Made::Derivative { .. }) => block.count == 0,
                Some(_) => unknown_blocks.binary_search(&block.first).is_err(),
            };
            shown.push((!hide).then_some(variables.len() as u32));
            if !hide {
                variables.push(self.variable(block)?);
            }
        }
        let named = self.differentiated();
        let with_rate = self.with_rate();
        for block in flat.variables.iter() {
            // The variable that a block is the derivative of, and its order.
            let (of, order) = match block.made {
                None => (block.first, 0),
                Some(Made::Derivative { of, order }) => (of, order),
                Some(_) => continue,
            };
            let has_none = |k: u32| {
                !with_rate.contains(&(VarId(of.0 + k), order + 1))
                    && !with_rate.contains(&(VarId(block.first.0 + k), 1))
            };
            self.derivatives(block, |k| has_none(k).then(|| named[block.first.index() + k as usize]), &mut variables);
        }
        let unknown = |target: Target| match target {
            Target::Var(v) => {
                let (block, element) = flat.locate(v);
                shown[block.index()].map(|variable| (variable, element as u32))
            }
            _ => None,
        };
        let unknowns = self.sorted.simulation.unknowns.iter().map(|u| unknown(u.target)).collect::<Option<Vec<_>>>();
        let initial = &self.sorted.initial;
        let tables = Tables {
            model: flat.name.clone(),
            variables,
            unknowns: unknowns.ok_or("an unknown has no name")?,
            rows: self.rows(&self.sorted.simulation),
            loops: self.loops(&unknown),
            equations: self.equations(),
            roots: self.roots().into_iter().chain(crate::delay::roots(self.sorted, self.files)).collect(),
            initial_unknowns: initial.unknowns.iter().map(|u| self.name(u.target).into()).collect(),
            initial_rows: self.rows(initial),
        };
        Ok((tables, self.limits(&shown)))
    }

    /// `min` and `max` of parameters and constants; `shown`: index into `Tables::variables` of each block.
    fn limits(&self, shown: &[Option<u32>]) -> Vec<Limit> {
        let mut limits = Vec::new();
        for (block, shown) in self.flat().variables.iter().zip(shown) {
            let Some(variable) = *shown else { continue };
            if block.variability > Variability::Parameter || block.kind == ValueKind::Boolean {
                continue;
            }
            let of = |element: u32| {
                let (min, max) = (block.min.get(element as usize), block.max.get(element as usize));
                Limit { variable, element, min, max }
            };
            limits.extend((0..block.count).map(of).filter(|limit| limit.min.is_finite() || limit.max.is_finite()));
        }
        limits
    }

    /// First element of the blocks of all unknowns.
    fn unknown_blocks(&self) -> Vec<VarId> {
        let flat = self.flat();
        let block = |target: Target| match target {
            Target::Var(v) => Some(flat.variables[flat.locate(v).0].first),
            _ => None,
        };
        let mut blocks: Vec<VarId> = self.sorted.simulation.unknowns.iter().filter_map(|u| block(u.target)).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }

    fn flat(&self) -> &FlatModel {
        &self.sorted.system.flat
    }

    fn name(&self, target: Target) -> String {
        self.flat().operand_name(Operand::new(target))
    }

    fn rows(&self, plan: &Plan) -> Vec<u32> {
        plan.residuals.iter().map(|r| self.sorted.system.equations[r.equation].block).collect()
    }

    /// The blocks of the simulation that hold more than one equation.
    fn loops(&self, place: &dyn Fn(Target) -> Option<(u32, u32)>) -> Vec<LoopInfo> {
        let plan = &self.sorted.simulation;
        let describe = |block: Block<'_>| {
            let assigned = block.assignments.iter().map(|&k| &plan.assignments[k as usize]);
            let residuals = block.residuals.iter().map(|&k| &plan.residuals[k as usize]);
            let targets = block.unknowns.iter().map(|&k| plan.unknowns[k as usize].target);
            let targets = targets.chain(assigned.clone().map(|a| a.target));
            let equations = residuals.map(|r| r.equation).chain(assigned.map(|a| a.equation));
            LoopInfo {
                unknowns: block.unknowns.to_vec(),
                variables: targets.filter_map(place).collect(),
                equations: equations.map(|e| self.sorted.system.equations[e].block).collect(),
            }
        };
        let several = |block: &Block<'_>| block.assignments.len() + block.residuals.len() > 1;
        plan.blocks.iter().filter(several).map(describe).collect()
    }

    fn variable(&self, block: &VariableBlock) -> Result<VariableInfo, String> {
        let elements = (0..block.count).map(|k| VarId(block.first.0 + k));
        let text = |text: &Option<Arc<str>>| text.clone().unwrap_or_else(|| "".into());
        Ok(VariableInfo {
            name: block.name.clone(),
            unit: text(&block.unit),
            display_unit: text(&block.display_unit),
            description: text(&block.description),
            kind: block.kind.clone(),
            variability: block.variability,
            settable: self.settable(block),
            protected: block.protected,
            sources: elements.map(|v| self.source(v)).collect::<Result<_, _>>()?,
        })
    }

    /// As declared, except that what the initial system solves for cannot be set.
    fn settable(&self, block: &VariableBlock) -> Settable {
        if block.settable != Settable::Yes {
            return block.settable.clone();
        }
        let layout = &self.lowered.layout;
        let given = |v: VarId| {
            let place = layout.value(v).and_then(|place| place.index.checked_sub(layout.parameters.start));
            place.is_some_and(|k| layout.given.get(k as usize).is_some_and(Option::is_some))
        };
        let all = (0..block.count).all(|k| given(VarId(block.first.0 + k)));
        if all { Settable::Yes } else { Settable::No }
    }

    fn source(&self, v: VarId) -> Result<Source, String> {
        let (target, negated) = resolve(self.sorted, Operand::new(Target::Var(v)));
        let layout = &self.lowered.layout;
        let place = match (target, self.lowered.places.get(target)) {
            (Target::Const(c), _) => Some(ValuePlace::Constant(self.flat().constants[c])),
            (_, Some(Place { area: Area::Data, index })) if layout.parameters.contains(&index) => {
                Some(ValuePlace::Parameter(index - layout.parameters.start))
            }
            (_, Some(place)) => position(self.row, layout, place).map(ValuePlace::Output),
            _ => None,
        };
        let place = place.ok_or_else(|| format!("`{}` is never computed", self.flat().var_name(v)))?;
        Ok(Source { place, negated })
    }

    /// Variables whose derivative the user's equations name.
    fn differentiated(&self) -> Vec<bool> {
        let mut named = vec![false; self.flat().scalars as usize];
        for operand in self.flat().equations.iter().flat_map(|equation| &equation.operands) {
            if let Target::Der(v) = operand.target() {
                named[v.index()] = true;
            }
        }
        named
    }

    /// Variables (with an order from 1) whose derivative is a variable of its own.
    fn with_rate(&self) -> FxHashSet<(VarId, u32)> {
        let of = |block: &VariableBlock| match block.made {
            Some(Made::Derivative { of, order }) => Some((of.0..of.0 + block.count, order)),
            _ => None,
        };
        let rates = self.flat().variables.iter().filter_map(of);
        rates.flat_map(|(of, order)| of.map(move |v| (VarId(v), order))).collect()
    }

    /// `der(x)` of the states of a block and of variables equal to them whose derivative is named (`None` where it is a variable): as an array if all
    /// elements have one, else one by one.
    fn derivatives(
        &self,
        block: &VariableBlock,
        named: impl Fn(u32) -> Option<bool>,
        variables: &mut Vec<VariableInfo>,
    ) {
        let source = |k: u32| {
            let v = VarId(block.first.0 + k);
            let named = named(k)?;
            let own = self.sorted.system.resolution[v] == Resolution::Own;
            let role = self.sorted.system.roles[v];
            // The derivative of a candidate is a variable of its own.
            let wanted = role != Role::Candidate && (named || own && role == Role::State);
            let (target, negated) = resolve(self.sorted, Operand::new(Target::Der(v)));
            let place = self.lowered.places.get(target).filter(|_| wanted)?;
            let output = position(self.row, &self.lowered.layout, place)?;
            Some(Source { place: ValuePlace::Output(output), negated })
        };
        let sources: Vec<Option<Source>> = (0..block.count).map(source).collect();
        let info = |name: NamePattern, sources: Vec<Source>| VariableInfo {
            name,
            unit: rate_unit(block.unit.as_deref().unwrap_or("")).into(),
            display_unit: "".into(),
            description: "".into(),
            kind: ValueKind::Real,
            variability: Variability::Continuous,
            settable: Settable::No,
            protected: block.protected,
            sources,
        };
        let all: Option<Vec<Source>> = sources.iter().copied().collect();
        if let Some(all) = all {
            if !all.is_empty() {
                variables.push(info(NamePattern { derivative: true, ..block.name.clone() }, all));
            }
            return;
        }
        for (k, source) in sources.into_iter().enumerate() {
            if let Some(source) = source {
                let name = NamePattern { derivative: true, ..NamePattern::scalar(block.name.element(k)) };
                variables.push(info(name, vec![source]));
            }
        }
    }

    /// Equations of equal components share their texts.
    fn equations(&self) -> Vec<EquationInfo> {
        let mut known: FxHashMap<Span, (Arc<str>, u32)> = FxHashMap::default();
        let info = |origin: &Origin| {
            let span = origin.span;
            let place = known.entry(span);
            let (text, line) = place
                .or_insert_with(|| (one_line(self.files.snippet(span)).into(), self.files.location(span).line))
                .clone();
            EquationInfo { component: origin.path.clone(), text, file: self.files.name(span.file).clone(), line }
        };
        self.flat().equations.iter().map(|e| &e.origin).map(info).collect()
    }

    fn roots(&self) -> Vec<RootInfo> {
        let rooted = &self.lowered.routines.events.rooted;
        if rooted.is_empty() {
            return Vec::new();
        }
        // The literal relation would print as `noEvent(...)`, so its event form is made for the text.
        let mut arena = self.flat().templates.arena.clone();
        let relation = |&r: &u32| &self.sorted.relations[r as usize];
        rooted.iter().map(|r| self.root(&mut arena, relation(r))).collect()
    }

    fn root(&self, arena: &mut Arena, relation: &EventRelation) -> RootInfo {
        let span = span_of(self.sorted, relation.equation);
        let operands = self.sorted.system.operands_of(relation.operands);
        let shown = match arena.node(relation.truth) {
            Node::Compare(kind, a, b) => arena.intern(Node::Event(kind, a, b)),
            _ => relation.truth,
        };
        let name = |slot: SlotId| match operands.get(slot.index()) {
            Some(&operand) => self.flat().operand_name(operand),
            None => "?".into(),
        };
        RootInfo {
            text: print(arena, shown, &name).into(),
            file: self.files.name(span.file).clone(),
            line: self.files.location(span).line,
        }
    }
}

/// Equation (index into `Tables::equations`) of each assignment, then of each residual.
pub(crate) fn row_equations(sorted: &SortedSystem, plan: &Plan) -> Vec<u32> {
    let assignments = plan.assignments.iter().map(|a: &Assignment| a.equation);
    let all = assignments.chain(plan.residuals.iter().map(|r| r.equation));
    all.map(|equation| sorted.system.equations[equation].block).collect()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_equations_take_one_line() {
        assert_eq!(one_line("x =\n    y + 1"), "x = y + 1");
    }
}
