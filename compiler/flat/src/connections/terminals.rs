//! Connectors that can be seen from outside of the model: its own, and those of its public components.
//!
//! Noted for whoever describes the model to other tools.  Of components only connectors with several variables count: a single one says no
//! more than its name.

use hyd_instance::InstId;
use hyd_syntax::tree::ClassKind;
use hyd_system::MemberKind;

use crate::model::Terminal;
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// Notes the connectors, when variables are there.
    pub(crate) fn note_terminals(&mut self) {
        let root = self.tree.root;
        for inst in self.scopes.instances[root].children.clone() {
            let instance = &self.scopes.instances[inst];
            if instance.protected || instance.absent {
                continue;
            }
            if instance.kind == ClassKind::Connector {
                self.note_terminal(inst, true);
            } else {
                for inner in instance.children.clone() {
                    let inner_instance = &self.scopes.instances[inner];
                    if inner_instance.kind == ClassKind::Connector && !inner_instance.protected {
                        self.note_terminal(inner, false);
                    }
                }
            }
        }
    }

    fn note_terminal(&mut self, inst: InstId, outside: bool) {
        let leaves = self.leaves(inst);
        if leaves.is_empty() || !outside && leaves.len() < 2 {
            return;
        }
        let kind = |leaf: &crate::connections::connect::Leaf| match self.direction_of(leaf.inst) {
            Some(_) => MemberKind::Signal,
            None if leaf.flow => MemberKind::Flow,
            None if leaf.stream => MemberKind::Stream,
            None => MemberKind::Potential,
        };
        let member = |leaf: &crate::connections::connect::Leaf| Some((*self.blocks.get(&leaf.inst)?, kind(leaf)));
        let members = leaves.iter().filter_map(member).collect();
        let instance = &self.scopes.instances[inst];
        let class = instance.class.map(|class| self.scopes.table.full_name(class)).unwrap_or_default().into();
        let (name, description) = (self.name_pattern(inst), instance.description.clone());
        self.model.terminals.push(Terminal { name, class, description, outside, members });
    }
}
