//! Lowered equations to blocks of the model: a template, and operands for each turn of the loops.
//!
//! Templates are remembered by the nodes they were made from, so that a thousand equal components, declared one by one,
//! simplify their equations once.

use std::rc::Rc;

use hyd_index::TypedIndex;
use hyd_source::{Code, Origin, Span};
use hyd_symbolic::{NodeId, SlotId, TemplateId, canonical};

use crate::model::{ConstId, EquationBlock, Operand, Section, Target, VarId};
use crate::state::context::Fail;
use crate::state::draft::append;
use crate::state::flattener::Flattener;
use crate::state::index::{SlotKey, advance};

/// A template, and which slot each of its slots was before.
pub(crate) type Canonical = (TemplateId, Rc<[SlotId]>);

/// Most operands of all equations together (half a gigabyte): products of large matrices reach it in one line.
const MAX_OPERANDS: u64 = 1 << 27;

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
        let around = self.clock_around.filter(|_| matches!(section, Section::Continuous | Section::Discrete));
        let tables = self.tables();
        append(tables.equations, block);
        let (at, known) = (tables.equations.len() - 1, &mut tables.notes.clocked);
        if let Some((clock, count)) = around.filter(|_| known.last().is_none_or(|last| last.0 != at)) {
            known.push((at, clock, count));
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
        self.spend_operands(counts, keys.len(), origin.span).ok()?;
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

    /// Counts the operands of equations before they are made.
    ///
    /// # Errors
    /// When all there may be are made; reported once.
    pub(crate) fn spend_operands(&mut self, counts: &[usize], width: usize, span: Span) -> Result<(), Fail> {
        self.check_operands(counts, width, span)?;
        self.tables().notes.operands += volume(counts, width);
        Ok(())
    }

    /// The same before variables are made for such equations.
    ///
    /// # Errors
    /// When that would be more than there may be; reported once.
    pub(crate) fn check_operands(&mut self, counts: &[usize], width: usize, span: Span) -> Result<(), Fail> {
        if self.too_many_operands {
            return Err(Fail::Reported);
        }
        let before: u64 = self.all_notes().map(|notes| notes.operands).sum();
        if before.saturating_add(volume(counts, width)) <= MAX_OPERANDS {
            return Ok(());
        }
        self.too_many_operands = true;
        let message = format!("with this equation the model has more than {MAX_OPERANDS} operands, element by element");
        Err(self.error(Code::Limit, span, message))
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

/// Operands of equations with so many each, for all values of the counters.
fn volume(counts: &[usize], width: usize) -> u64 {
    counts.iter().fold(width as u64, |product, &count| product.saturating_mul(count as u64))
}
