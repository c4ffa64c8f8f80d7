//! Numbers of records that functions of continuous values return: the `phase` of a state of a medium.
//!
//! Strictly an Integer follows from discrete-time expressions only (Modelica 3.6, section 3.8.3), and a function makes none of its
//! continuous arguments.  Media return such records all the same, and tools take them: the number is what is returned at any time, and so
//! is what is equal to it or connected with it.  Only components of records are treated so; others are faults (`discrete_time`).

use hyd_source::{Code, Diagnostic};
use hyd_symbolic::Node;
use hyd_system::Variability;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::model::{BlockId, EquationBlock, Operand, Section, Target, VarId};
use crate::state::flattener::Flattener;

/// Which equations say what of variables that change at events.
struct Discrete {
    /// Blocks of variables in components that are records.
    of_records: FxHashSet<BlockId>,
    /// Blocks of variables that equations say are equal.
    equal: FxHashMap<BlockId, Vec<BlockId>>,
    /// Variables that an equation determines, with its place; more than one.
    determined: FxHashMap<VarId, (usize, bool)>,
}

impl Flattener<'_, '_> {
    /// Makes the numbers of records continuous that follow from continuous values; `noted`: places of equations that determine discrete variables.
    pub(crate) fn let_records_follow(&mut self, noted: &[usize]) {
        let is_faulty = |flat: &Self, &at: &usize| flat.faulty_elements(at).next().is_some();
        if !noted.iter().any(|at| is_faulty(self, at)) {
            return;
        }
        let discrete = self.discrete_equations();
        let mut any = false;
        loop {
            let mut new: Vec<BlockId> = Vec::new();
            for &at in noted {
                let alone = |v: &VarId| discrete.determined.get(v).is_none_or(|&(by, more)| by == at && !more);
                let faulty = self.faulty_elements(at).filter(alone).map(|v| self.model.locate(v).0);
                new.extend(faulty.filter(|block| discrete.of_records.contains(block)));
            }
            if new.is_empty() {
                break;
            }
            any = true;
            while let Some(block) = new.pop() {
                let variable = &mut self.model.variables[block];
                if std::mem::replace(&mut variable.at_any_time, true) {
                    continue;
                }
                variable.variability = Variability::Continuous;
                let equal = discrete.equal.get(&block).into_iter().flatten();
                new.extend(equal.filter(|other| discrete.of_records.contains(other)));
            }
        }
        if any {
            self.make_continuous();
            self.refuse_events(noted);
        }
    }

    /// What changes at any time decides no event, for nothing would find the instant, and has no value before one.  What equations that
    /// `noted` names read is judged elsewhere, but for such values.
    fn refuse_events(&mut self, noted: &[usize]) {
        let mut found = Vec::new();
        for (at, block) in self.model.equations.iter().enumerate() {
            let is_noted = noted.contains(&at);
            let acts = is_at_events(block.section) && !is_noted;
            let decides = |operand: &&Operand| match operand.target() {
                Target::Var(v) if acts => self.model.variables[self.model.locate(v).0].at_any_time,
                Target::Pre(v) => self.model.variables[self.model.locate(v).0].at_any_time,
                _ => false,
            };
            if let Some(Target::Var(v) | Target::Pre(v)) =
                block.operands.iter().find(decides).map(|operand| operand.target())
            {
                found.push((v, block.origin.span));
            }
        }
        found.dedup_by_key(|(_, span)| *span);
        for (v, span) in found {
            let (of, k) = self.model.locate(v);
            let of = &self.model.variables[of];
            let message = format!(
                "`{}` follows from continuous values and changes at any time: it cannot decide an event",
                of.name.element(k)
            );
            let declared = of.origin.span;
            self.report(
                Diagnostic::error(Code::DiscreteTime, message)
                    .at(span, "")
                    .with(declared, "declared here")
                    .help("a relation of the values that it is computed from causes events"),
            );
        }
    }

    /// The discrete variables that an equation gives values which change between events.
    fn faulty_elements(&self, at: usize) -> impl Iterator<Item = VarId> {
        let block = self.model.equations.get(at);
        block.into_iter().flat_map(move |block| {
            let template = self.model.templates.get(block.template);
            (0..block.count as usize).filter_map(move |k| {
                let operands = block.operands_of(k, template.arity as usize);
                let v = self.discrete_variable(template.left, operands)?;
                let varies =
                    [template.left, template.right].iter().any(|&side| self.varying_part(side, operands).is_some());
                varies.then_some(v)
            })
        })
    }

    fn discrete_equations(&self) -> Discrete {
        let is_of_record = |inst| {
            let parent = self.scopes.instances[inst].parent;
            parent.is_some_and(|parent| self.scopes.is_record(parent))
        };
        let of_records = self.blocks.iter().filter(|&(&inst, _)| is_of_record(inst)).map(|(_, &block)| block);
        let mut found = Discrete {
            of_records: of_records.collect(),
            equal: FxHashMap::default(),
            determined: FxHashMap::default(),
        };
        for (at, block) in self.model.equations.iter().enumerate() {
            if block.section != Section::Discrete {
                continue;
            }
            for k in 0..block.count as usize {
                match self.variables_of(block, k) {
                    (Some(a), Some(b)) => {
                        let (a, b) = (self.model.locate(a).0, self.model.locate(b).0);
                        found.equal.entry(a).or_default().push(b);
                        found.equal.entry(b).or_default().push(a);
                    }
                    (Some(v), None) => {
                        found.determined.entry(v).and_modify(|(_, more)| *more = true).or_insert((at, false));
                    }
                    _ => {}
                }
            }
        }
        found
    }

    /// The variables that the sides of an equation are.
    fn variables_of(&self, block: &EquationBlock, k: usize) -> (Option<VarId>, Option<VarId>) {
        let template = self.model.templates.get(block.template);
        let operands = block.operands_of(k, template.arity as usize);
        let variable = |side| match self.model.templates.arena.node(side) {
            Node::Slot(slot) => match operands[slot.0 as usize].target() {
                Target::Var(v) => Some(v),
                _ => None,
            },
            _ => None,
        };
        (variable(template.left), variable(template.right))
    }

    /// Equations of what changes at any time are continuous ones: whole blocks, or their elements in blocks of their own.
    fn make_continuous(&mut self) {
        let follows =
            |flat: &Self, v: Option<VarId>| v.is_some_and(|v| flat.model.variables[flat.model.locate(v).0].at_any_time);
        for at in 0..self.model.equations.len() {
            let block = &self.model.equations[at];
            if block.section != Section::Discrete {
                continue;
            }
            let own: Vec<bool> = (0..block.count as usize)
                .map(|k| {
                    let (left, right) = self.variables_of(block, k);
                    follows(self, left) || follows(self, right) && left.is_none()
                })
                .collect();
            if !own.contains(&true) {
                continue;
            }
            let arity = self.model.templates.get(block.template).arity as usize;
            let operands = |wanted: bool| {
                let chosen = own.iter().enumerate().filter(|&(_, &own)| own == wanted);
                chosen.flat_map(|(k, _)| block.operands_of(k, arity).to_vec()).collect::<Vec<_>>()
            };
            let (kept, moved) = (operands(false), operands(true));
            let count = own.iter().filter(|own| **own).count() as u32;
            let continuous = EquationBlock { section: Section::Continuous, count, operands: moved, ..block.clone() };
            if kept.is_empty() && count == block.count {
                self.model.equations[at] = continuous;
            } else {
                let rest = EquationBlock { count: block.count - count, operands: kept, ..block.clone() };
                self.model.equations[at] = rest;
                self.model.equations.push(continuous);
            }
        }
    }
}

/// True for what acts at events only.
fn is_at_events(section: Section) -> bool {
    matches!(section, Section::Discrete | Section::Reinit | Section::AssertOnce(_) | Section::Terminate(_))
}
