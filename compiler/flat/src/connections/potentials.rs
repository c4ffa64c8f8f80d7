//! The potentials and flows of physical connectors: what connections make equal and add up, and what some component must fix.
//!
//! Noted for messages only: a circuit without ground has a potential for each of its nodes, and no equation that says what they
//! are counted from.

use std::sync::Arc;

use hyd_instance::InstId;
use hyd_syntax::tree::{ClassBody, ClassKind, Direction, Element};
use hyd_system::Variability;
use rustc_hash::FxHashSet;

use crate::model::{Gaps, Potential, Target, VarId};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// Notes the potentials and flows of all connectors that have both.
    pub(crate) fn note_potentials(&mut self) {
        let mut known = FxHashSet::default();
        for (connector, _) in self.connections.order.clone() {
            let leaves = self.leaves(connector);
            let open = self.connections.range(connector).into_iter().flatten().any(|own| self.connections.is_open(own));
            if !leaves.iter().any(|leaf| leaf.flow) {
                continue;
            }
            let flows = leaves.iter().filter(|leaf| leaf.flow).filter_map(|leaf| self.blocks.get(&leaf.inst).copied());
            let new: Vec<_> = flows.filter(|&block| known.insert(block)).collect();
            self.model.flows.extend(new);
            for leaf in leaves.iter().filter(|leaf| !leaf.flow && !leaf.stream) {
                if self.direction_of(leaf.inst).is_some() {
                    continue;
                }
                let Some(&block) = self.blocks.get(&leaf.inst) else { continue };
                if self.model.variables[block].variability != Variability::Continuous || !known.insert(block) {
                    continue;
                }
                let (owner, depth) = self.owner_of(leaf.inst);
                let instances = &self.scopes.instances;
                let declared = instances[if owner == self.tree.root { connector } else { owner }].span;
                let class = instances[connector].class.map(|class| self.scopes.table.full_name(class));
                let class: Arc<str> = class.unwrap_or_default().into();
                self.model.potentials.push(Potential { block, connector: class, depth, declared, open });
            }
        }
    }

    /// Where the text of the model itself can be added to.
    pub(crate) fn note_gaps(&mut self) {
        let Some(class) = self.scopes.instances[self.tree.root].class else { return };
        let def = self.scopes.table.class(class).def.clone();
        let ClassBody::Long { elements, equations, .. } = &def.body else { return };
        let declaration = elements.iter().find_map(|element| match element {
            Element::Component(component) => Some(component.span),
            _ => None,
        });
        let mut sections = equations.iter().filter(|section| !section.initial);
        let equation = sections.find_map(|section| section.equations.first()).map(|equation| equation.span);
        self.model.gaps = declaration.zip(equation).map(|(declaration, equation)| Gaps { declaration, equation });
    }

    /// Notes the outputs of the model's components that nothing reads.
    pub(crate) fn note_unread_outputs(&mut self) {
        let instances = &self.scopes.instances;
        let mut unread: Vec<(VarId, String)> = Vec::new();
        for &part in &instances[self.tree.root].children {
            let component = &instances[part];
            if !matches!(component.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class)
                || !component.dims.is_empty()
            {
                continue;
            }
            for &output in &component.children {
                let own = &instances[output];
                let is_output = own.direction == Some(Direction::Output) && own.primitive.is_some();
                let is_joined =
                    self.connections.range(output).is_some_and(|mut all| all.any(|k| !self.connections.is_open(k)));
                if let (true, false, true, Some(&block)) =
                    (is_output && !own.protected, is_joined, own.dims.is_empty(), self.blocks.get(&output))
                {
                    unread.push((self.variable(block).first, format!("{}.{}", component.name, own.name)));
                }
            }
        }
        // The model's own equations may read it.
        for block in self.model.equations.iter().filter(|block| block.origin.path.is_empty()) {
            unread.retain(|(v, _)| block.operands.iter().all(|operand| operand.target() != Target::Var(*v)));
        }
        self.model.unread_outputs = unread.into_iter().map(|(_, name)| name).collect();
    }

    /// The component around the connectors that hold a variable, and how many names lead from it to the variable.
    fn owner_of(&self, variable: InstId) -> (InstId, u32) {
        let instances = &self.scopes.instances;
        let (mut at, mut depth) = (variable, 0);
        while let Some(above) = instances[at].parent {
            (at, depth) = (above, depth + 1);
            if !matches!(instances[at].kind, ClassKind::Connector | ClassKind::Record | ClassKind::Type) {
                break;
            }
        }
        (at, depth)
    }
}
