//! Parameters whose values are set from outside and used at translation.
//!
//! Which parameters decide sizes or structure is known only when everything has been lowered: a range or a condition in the last
//! equation may be what asks.  So their values take the place of the bindings of the text at the very end, for all of them in
//! one way, whoever asked first.

use std::ops::Range;

use hyd_instance::InstId;
use hyd_symbolic::Node;
use hyd_syntax::tree::Variability as Declared;

use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::model::{EquationBlock, Section, Target};

impl Flattener<'_, '_> {
    /// A parameter whose value was set from outside and has been used.
    pub(crate) fn is_given(&mut self, inst: InstId) -> bool {
        if !self.tree.overrides.iter().any(|o| o.used) || self.tree.instances[inst].variability > Declared::Parameter {
            return false;
        }
        let path = self.path(inst);
        self.tree.overrides.iter().any(|o| o.used && *o.path == *path)
    }

    /// Puts the values that were set from outside, and used, in the place of bindings.
    pub(crate) fn take_given_values(&mut self) {
        let mut given: Vec<(InstId, Vec<f64>)> = Vec::new();
        for inst in self.variable_instances() {
            if !self.is_given(inst) {
                continue;
            }
            let span = self.tree.instances[inst].span;
            // One that was refused has had its message.
            let Ok(value) = self.tree.value_of(inst, span) else { continue };
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
        for (inst, values) in given {
            self.bind_numbers(inst, &values);
        }
    }

    /// Takes away the equations that bind these scalars; the ranges ascend.
    fn drop_bindings(&mut self, ranges: &[Range<u32>]) {
        let templates = &self.model.templates;
        let bound = |block: &EquationBlock, k: usize| {
            let template = templates.get(block.template);
            let Node::Slot(slot) = templates.arena.node(template.left) else { return false };
            let operand = block.operands_of(k, template.arity as usize)[slot.0 as usize];
            let Target::Var(v) = operand.target() else { return false };
            let after = ranges.partition_point(|range| range.start <= v.0);
            after > 0 && ranges[after - 1].contains(&v.0)
        };
        self.model.equations.retain_mut(|block| {
            if block.section != Section::Binding || !(0..block.count as usize).any(|k| bound(block, k)) {
                return true;
            }
            let arity = templates.get(block.template).arity as usize;
            let kept: Vec<usize> = (0..block.count as usize).filter(|&k| !bound(block, k)).collect();
            block.operands = kept.iter().flat_map(|&k| block.operands_of(k, arity).to_vec()).collect();
            block.count = kept.len() as u32;
            block.count > 0
        });
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
