//! The flat model as text: variables with attributes, then equations by section, in the user's names.

use std::fmt;

use hyd_index::TypedIndex;
use hyd_symbolic::{Node, NodeId, Template, format_number};
use hyd_system::{ValueKind, Variability};

use crate::model::{EquationBlock, FlatModel, Operand, PerElement, Section, Target, VariableBlock};

/// Which sections stand under one title.
type Wanted = fn(Section) -> bool;

/// Equations of a block that are printed one by one; of longer blocks the first two and the last.
const SHOWN: usize = 8;

impl fmt::Display for FlatModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "flat model {}", self.name)?;
        for block in self.variables.iter() {
            self.print_variable(f, block)?;
        }
        let sections: [(&str, Wanted); 6] = [
            ("equation", |s| s == Section::Continuous),
            ("discrete equation", |s| s == Section::Discrete),
            ("when fired", |s| matches!(s, Section::Reinit | Section::AssertOnce(_) | Section::Terminate(_))),
            ("initial equation", |s| s == Section::Initial),
            ("assert", |s| matches!(s, Section::Assert(_))),
            ("value", |s| matches!(s, Section::Binding | Section::Start)),
        ];
        for (title, wanted) in sections {
            let blocks: Vec<&EquationBlock> = self.equations.iter().filter(|e| wanted(e.section)).collect();
            if blocks.is_empty() {
                continue;
            }
            let count: usize = blocks.iter().map(|b| b.count as usize).sum();
            writeln!(f, "{title} ({count})")?;
            for block in blocks {
                self.print_equations(f, block)?;
            }
        }
        Ok(())
    }
}

impl FlatModel {
    fn print_variable(&self, f: &mut fmt::Formatter<'_>, block: &VariableBlock) -> fmt::Result {
        let variability = match block.variability {
            Variability::Constant => "constant ",
            Variability::Parameter => "parameter ",
            Variability::Discrete => "discrete ",
            Variability::Continuous => "",
        };
        let kind = match &block.kind {
            ValueKind::Real => "Real",
            ValueKind::Integer => "Integer",
            ValueKind::Boolean => "Boolean",
            ValueKind::Enumeration(_) => "enumeration",
        };
        let mut attributes = Vec::new();
        if let Some(unit) = &block.unit {
            attributes.push(format!("unit = \"{unit}\""));
        }
        let known = block.variability <= Variability::Parameter;
        match &block.fixed {
            PerElement::All(fixed) if *fixed != known => attributes.push(format!("fixed = {fixed}")),
            PerElement::Each(_) => attributes.push("fixed by element".into()),
            PerElement::All(_) => {}
        }
        if let PerElement::All(Some(nominal)) = &block.nominal {
            attributes.push(format!("nominal = {}", format_number(*nominal)));
        }
        let attributes = if attributes.is_empty() { String::new() } else { format!(" ({})", attributes.join(", ")) };
        let name = match block.count {
            1 if block.name.parts.iter().all(|(_, d)| d.is_empty()) => block.name.element(0),
            _ => {
                let parts = block.name.parts.iter().map(|(text, dims)| {
                    let sizes: Vec<String> = dims.iter().map(u32::to_string).collect();
                    if dims.is_empty() { text.to_string() } else { format!("{text}[{}]", sizes.join(",")) }
                });
                parts.collect()
            }
        };
        writeln!(f, "  {variability}{kind} {name}{attributes}")
    }

    fn print_equations(&self, f: &mut fmt::Formatter<'_>, block: &EquationBlock) -> fmt::Result {
        let count = block.count as usize;
        for k in 0..count {
            if count > SHOWN && k >= 2 && k + 1 < count {
                if k == 2 {
                    writeln!(f, "  ... {} equations of the same template", count - 3)?;
                }
                continue;
            }
            writeln!(f, "  {}", self.equation_text(block, k))?;
        }
        Ok(())
    }

    /// Both sides of an equation as text.
    pub fn print_sides(&self, template: &Template, operands: &[Operand]) -> (String, String) {
        self.sides(&|operand| self.target_name(operand), template, operands)
    }

    /// The same for messages about what is written, without names that the translation gave.
    pub fn written_sides(&self, template: &Template, operands: &[Operand]) -> (String, String) {
        self.sides(&|operand| self.written_name(operand), template, operands)
    }

    fn sides(&self, name: &dyn Fn(Operand) -> String, template: &Template, operands: &[Operand]) -> (String, String) {
        let kind = |side: NodeId| match self.templates.arena.node(side) {
            Node::Slot(slot) => self.kind_of(operands[slot.index()].target()),
            _ => None,
        };
        let (left, right) = (kind(template.right), kind(template.left));
        let side = |kind, root| self.print_typed(name, kind, root, operands);
        (side(left, template.left), side(right, template.right))
    }

    /// The type of what a target reads; none for numbers and relations.
    pub fn kind_of(&self, target: Target) -> Option<&ValueKind> {
        match target {
            Target::Var(v) | Target::Pre(v) | Target::Start(v) => Some(&self.variables[self.locate(v).0].kind),
            _ => None,
        }
    }

    /// An expression whose value has that type: numbers alone are printed as `true`, `false` or the literal.
    pub fn print_as(&self, kind: Option<&ValueKind>, root: NodeId, operands: &[Operand]) -> String {
        self.print_typed(&|operand| self.target_name(operand), kind, root, operands)
    }

    fn print_typed(
        &self,
        name: &dyn Fn(Operand) -> String,
        kind: Option<&ValueKind>,
        root: NodeId,
        operands: &[Operand],
    ) -> String {
        let number = match self.templates.arena.node(root) {
            Node::Slot(slot) => match operands[slot.index()].target() {
                Target::Const(c) => Some(self.constants[c]),
                _ => None,
            },
            _ => self.templates.arena.as_constant(root),
        };
        match (kind, number) {
            (Some(ValueKind::Boolean), Some(number)) => (number != 0.0).to_string(),
            (Some(ValueKind::Enumeration(literals)), Some(number)) => {
                let literal = literals.get((number as usize).wrapping_sub(1));
                literal.map_or_else(|| format_number(number), |literal| literal.to_string())
            }
            _ => self.print_named(name, root, operands),
        }
    }

    /// Equation `k` of a block as text.
    pub fn equation_text(&self, block: &EquationBlock, k: usize) -> String {
        let template = self.templates.get(block.template);
        let operands = block.operands_of(k, template.arity as usize);
        let (left, other) = self.print_sides(&template, operands);
        let right = || other;
        match block.section {
            Section::Assert(message) => format!("assert({left}, \"{}\")", self.messages[message as usize].text),
            Section::AssertOnce(message) => {
                format!("fail when {left}: \"{}\"", self.messages[message as usize].text)
            }
            Section::Terminate(message) => {
                format!("terminate when {left}: \"{}\"", self.messages[message as usize].text)
            }
            Section::Reinit => format!("reinit({left}, {})", right()),
            _ => format!("{left} = {}", right()),
        }
    }
}
