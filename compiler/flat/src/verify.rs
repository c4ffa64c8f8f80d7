//! Invariants of the flat model, checked after flattening in debug builds and by tests.
//!
//! Blocks number the scalar variables without gaps; names, attributes and counts agree; every equation block has as many
//! operands as its template has slots, all pointing into the tables; left sides fit the section.

use hyd_index::TypedIndex;
use hyd_symbolic::Node;

use crate::model::{FlatModel, PerElement, Section, Target};

/// A sentence about the first invariant that does not hold.
pub fn verify(model: &FlatModel) -> Result<(), String> {
    verify_variables(model)?;
    for (k, block) in model.equations.iter().enumerate() {
        let template = model.templates.get(block.template);
        let expected = block.count as usize * template.arity as usize;
        if block.operands.len() != expected {
            return Err(format!("equation block {k} has {} operands for {expected} slots", block.operands.len()));
        }
        for operand in &block.operands {
            let inside = match operand.target() {
                Target::Var(v) | Target::Der(v) | Target::Pre(v) | Target::Start(v) => v.0 < model.scalars,
                Target::Const(c) => c.index() < model.constants.len(),
                Target::Held(_) | Target::Chosen(_) => false,
                Target::Delayed(site) | Target::DelayedRate(site) => site < model.delay_sites(),
                Target::Input(k) | Target::InputRate(k) => k < model.driven_inputs(),
            };
            if !inside {
                return Err(format!("equation block {k} reads {operand:?}, which does not exist"));
            }
        }
        let plain_left = matches!(model.templates.arena.node(template.left), Node::Slot(_));
        let fits = match block.section {
            Section::Binding | Section::Start | Section::Reinit => plain_left,
            Section::Assert(message) | Section::AssertOnce(message) | Section::Terminate(message) => {
                (message as usize) < model.messages.len()
            }
            Section::Continuous | Section::Discrete | Section::Initial => true,
            Section::Selection | Section::Pivot => false,
        };
        if !fits {
            return Err(format!("equation block {k} does not have the form of its section {:?}", block.section));
        }
    }
    Ok(())
}

fn verify_variables(model: &FlatModel) -> Result<(), String> {
    let mut next = 0;
    for block in model.variables.iter() {
        let name = block.name.element(0);
        if block.first.0 != next {
            return Err(format!("the variables of `{name}` begin at {}, not at {next}", block.first));
        }
        if block.name.count() != block.count as usize {
            return Err(format!("`{name}` has {} elements by name and {} by count", block.name.count(), block.count));
        }
        if let PerElement::Each(flags) = &block.fixed
            && flags.len() != block.count as usize
        {
            return Err(format!("`{name}` has {} fixed attributes for {} elements", flags.len(), block.count));
        }
        next += block.count;
    }
    if next != model.scalars { Err(format!("{next} variables in blocks, {} in all", model.scalars)) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{EquationBlock, Operand, VarId};
    use hyd_source::{FileId, Origin, Span};
    use hyd_symbolic::{SlotId, Template};

    #[test]
    fn an_operand_outside_the_tables_is_found() {
        let mut model = FlatModel::default();
        assert_eq!(verify(&model), Ok(()));
        let slot = model.templates.arena.slot(SlotId(0));
        let zero = model.templates.arena.constant(0.0);
        let template = model.templates.intern(Template { left: slot, right: zero, arity: 1 });
        let origin = Origin { path: "".into(), span: Span::new(FileId(0), 0, 0) };
        let operands = vec![Operand::new(Target::Var(VarId(3)))];
        model.equations.push(EquationBlock {
            section: Section::Continuous,
            made: false,
            template,
            count: 1,
            operands,
            origin,
        });
        assert!(verify(&model).is_err());
        model.equations[0].operands.clear();
        assert!(verify(&model).is_err());
    }
}
