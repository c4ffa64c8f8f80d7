//! Parameters whose values are set from outside and used at translation, and start values.
//!
//! Which parameters decide sizes or structure is known only when everything has been lowered: a range or a condition in the last
//! equation may be what asks.  So their values take the place of the bindings of the text at the very end, for all of them in
//! one way, whoever asked first.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

use hyd_instance::modifier::{Applied, AstMod};
use hyd_instance::{InstId, Override};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::Node;
use hyd_syntax::tree::Expr;
use hyd_system::ValueKind;

use crate::model::{EquationBlock, Section, Target, VarId};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};

impl Flattener<'_, '_> {
    /// The start value as declared, or as it is set from outside by the name of the variable and `.start`.
    pub(crate) fn start_of(&mut self, inst: InstId) -> Option<Applied> {
        let declared = self.attribute(inst, "start")?;
        if self.scopes.overrides.is_empty() {
            return Some(declared);
        }
        let path = self.path(inst);
        let is_meant = |set: &Override| set.path.strip_suffix(".start").is_some_and(|variable| *variable == *path);
        let Some(set) = self.scopes.overrides.iter_mut().rev().find(|set| is_meant(set)) else { return Some(declared) };
        set.used = true;
        let (text, span) = (set.text.clone(), declared.tree.span.unwrap_or(self.scopes.instances[inst].span));
        let wrong = |why: &str| format!("`{path}.start` cannot be set to `{text}`: {why}");
        let is_real = matches!(self.model.variables[self.blocks[&inst]].kind, ValueKind::Real);
        let message = match text.trim().parse::<f64>() {
            _ if !is_real => wrong("only start values of type Real can be set"),
            Ok(value) if value.is_finite() => {
                let tree = AstMod {
                    binding: Some(Arc::new(Expr::number(value, span))),
                    span: Some(span),
                    ..AstMod::default()
                };
                return Some(Applied { tree: Arc::new(tree), spread: Vec::new(), ..declared });
            }
            _ => wrong("it is not a number"),
        };
        self.report(Diagnostic::error(Code::Value, message).with(span, "declared here"));
        Some(declared)
    }

    /// A parameter whose value was set from outside and has been used.
    pub(crate) fn is_given(&mut self, inst: InstId) -> bool {
        self.scopes.overrides.iter().any(|o| o.used)
            && self.scopes.override_of(inst).is_some_and(|position| self.scopes.overrides[position].used)
    }

    /// Puts the values that were set from outside, and used, in the place of bindings.
    pub(crate) fn take_given_values(&mut self) {
        let mut given: Vec<(InstId, Vec<f64>)> = Vec::new();
        for inst in self.variable_instances() {
            if let Some(position) = self.scopes.override_of(inst)
                && self.is_evaluated(inst)
            {
                self.scopes.overrides[position].used = true;
            }
            if !self.is_given(inst) {
                continue;
            }
            let span = self.scopes.instances[inst].span;
            // One that was refused has had its message.
            let Ok(value) = self.scopes.value_of(inst, span) else { continue };
            let values: Vec<f64> = value.flatten().iter().filter_map(|v| v.as_stored()).collect();
            given.push((inst, values));
        }
        if given.is_empty() {
            return;
        }
        let range = |flat: &Self, inst: &InstId| {
            let block = &flat.model.variables[flat.blocks[inst]];
            block.first.0..block.first.0 + block.count
        };
        let ranges: Vec<Range<u32>> = given.iter().map(|(inst, _)| range(self, inst)).collect();
        self.drop_bindings(&ranges);
        let others = std::mem::take(&mut self.model.equations);
        let mut made: VecDeque<(u32, Vec<EquationBlock>)> = VecDeque::new();
        for ((inst, values), range) in given.into_iter().zip(ranges) {
            self.bind_numbers(inst, &values);
            made.push_back((range.start, std::mem::take(&mut self.model.equations)));
        }
        // Bindings stand in the order of the variables.
        let mut all = Vec::with_capacity(others.len() + made.len());
        for block in others {
            if let Some(v) = self.bound(&block, 0) {
                while let Some((_, own)) = made.pop_front_if(|(first, _)| *first < v.0) {
                    all.extend(own);
                }
            }
            all.push(block);
        }
        all.extend(made.into_iter().flat_map(|(_, own)| own));
        self.model.equations = all;
    }

    /// The scalar that a row of binding equations determines.
    fn bound(&self, block: &EquationBlock, row: usize) -> Option<VarId> {
        if block.section != Section::Binding {
            return None;
        }
        let template = self.model.templates.get(block.template);
        let Node::Slot(slot) = self.model.templates.arena.node(template.left) else { return None };
        match block.operands_of(row, template.arity as usize)[slot.0 as usize].target() {
            Target::Var(v) => Some(v),
            _ => None,
        }
    }

    /// Takes away the equations that bind these scalars; the ranges ascend.
    fn drop_bindings(&mut self, ranges: &[Range<u32>]) {
        let given = |v: VarId| {
            let after = ranges.partition_point(|range| range.start <= v.0);
            after > 0 && ranges[after - 1].contains(&v.0)
        };
        let mut kept = Vec::with_capacity(self.model.equations.len());
        for mut block in std::mem::take(&mut self.model.equations) {
            if block.section != Section::Binding {
                kept.push(block);
                continue;
            }
            let rows = 0..block.count as usize;
            let stay: Vec<usize> = rows.filter(|&row| !self.bound(&block, row).is_some_and(given)).collect();
            if stay.len() < block.count as usize {
                let arity = self.model.templates.get(block.template).arity as usize;
                block.operands = stay.iter().flat_map(|&row| block.operands_of(row, arity)).copied().collect();
                block.count = stay.len() as u32;
            }
            if block.count > 0 {
                kept.push(block);
            }
        }
        self.model.equations = kept;
    }

    /// `variable = number` for all elements; in an array of components, one value or one list may stand for all of them.
    fn bind_numbers(&mut self, inst: InstId, values: &[f64]) {
        let block = &self.model.variables[self.blocks[&inst]];
        let (first, count, origin) = (block.first, block.count as usize, block.origin.clone());
        for (k, &value) in values.iter().cycle().take(count).enumerate() {
            self.begin_slots();
            let target = self.slots.slot(SlotKey::Variable(Kind::Var, first, Affine::constant(k as i64)));
            let left = self.model.templates.arena.slot(target);
            let right = self.model.templates.arena.constant(value);
            self.emit(Section::Binding, left, right, &[], &origin);
        }
    }
}
