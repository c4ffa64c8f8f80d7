//! Lowered equations to blocks of the model: a template, and operands for each turn of the loops.
//!
//! Templates are remembered by the nodes they were made from, so that a thousand equal components, declared one by one,
//! simplify their equations once.

use std::rc::Rc;

use hyd_index::TypedIndex;
use hyd_source::Origin;
use hyd_symbolic::{NodeId, SlotId, TemplateId, canonical};

use crate::flatten::Flattener;
use crate::index::{SlotKey, advance};
use crate::model::{ConstId, EquationBlock, Operand, Section, Target, VarId};

/// A template, and which slot each of its slots was before.
pub(crate) type Canonical = (TemplateId, Rc<[SlotId]>);

impl Flattener<'_, '_> {
    /// The template of `left = right`, and which slot each of its slots was before.
    pub(crate) fn template(&mut self, left: NodeId, right: NodeId) -> Canonical {
        if let Some(known) = self.canonical.get(&(left, right)) {
            return known.clone();
        }
        let (template, order) = canonical(&mut self.model.templates.arena, left, right);
        let made = (self.model.templates.intern(template), Rc::from(order));
        self.canonical.insert((left, right), made.clone());
        made
    }

    /// Adds `left = right` for all values of the counters.
    pub(crate) fn emit(&mut self, section: Section, left: NodeId, right: NodeId, counts: &[usize], origin: &Origin) {
        let Some(block) = self.equations_over(section, left, right, counts, origin) else { return };
        // Loops that had to be run through give neighbours with one template.
        if let Some(last) = self.model.equations.last_mut()
            && (last.section, last.template, last.made) == (section, block.template, false)
            && last.origin == *origin
        {
            last.count += block.count;
            last.operands.extend(block.operands);
        } else {
            self.model.equations.push(block);
        }
    }

    /// `left = right` for all values of the counters; none if there are no values.
    pub(crate) fn equations_over(
        &mut self,
        section: Section,
        left: NodeId,
        right: NodeId,
        counts: &[usize],
        origin: &Origin,
    ) -> Option<EquationBlock> {
        let (id, order) = self.template(left, right);
        let keys: Vec<SlotKey> = order.iter().map(|&s: &SlotId| self.slots.keys[s.index()].clone()).collect();
        let total: usize = counts.iter().product();
        let mut operands = Vec::with_capacity(total * keys.len());
        let mut counters = vec![0i64; counts.len()];
        for _ in 0..total {
            for key in &keys {
                operands.push(self.operand(key, &counters));
            }
            advance(&mut counters, counts);
        }
        let origin = origin.clone();
        let count = total as u32;
        (total > 0).then_some(EquationBlock { section, made: false, template: id, count, operands, origin })
    }

    pub(crate) fn operand(&mut self, key: &SlotKey, counters: &[i64]) -> Operand {
        match key {
            SlotKey::Variable(kind, first, affine) => {
                Operand::new(kind.of(VarId((i64::from(first.0) + affine.at(counters)) as u32)))
            }
            SlotKey::Number(affine) => Operand::new(Target::Const(self.number(affine.at(counters) as f64))),
            SlotKey::Quantity(id) => Operand::new(Target::Const(*id)),
        }
    }

    pub(crate) fn number(&mut self, value: f64) -> ConstId {
        if let Some(&known) = self.numbers.get(&value.to_bits()) {
            return known;
        }
        let id = self.model.constants.push(value);
        self.numbers.insert(value.to_bits(), id);
        id
    }
}
