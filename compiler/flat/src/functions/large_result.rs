//! Whether a function that was run symbolically gave expressions that are better computed by a loop.
//!
//! A loop whose turns build on each other becomes one expression as deep as the loop is long.  Registers for thousands of values
//! that all live at once take the code generator a time that grows with their square, and the code is slower than the loop.

use hyd_symbolic::NodeId;
use rustc_hash::FxHashSet;

use crate::state::context::Local;
use crate::state::flattener::{Flattener, Outputs};

/// Most nodes between the arguments of a call and one of its values.
const MOST_NODES: usize = 4_000;

impl Flattener<'_, '_> {
    /// True if one of these outputs is further from the arguments than it should be.
    pub(crate) fn is_large(&self, arguments: &[Local], outputs: &Outputs) -> bool {
        let (mut known, mut roots) = (FxHashSet::default(), FxHashSet::default());
        arguments.iter().for_each(|local| collect(local, &mut known));
        outputs.iter().for_each(|(_, local)| collect(local, &mut roots));
        let all = roots.iter().copied().collect();
        self.exceeds(&known, all) && roots.into_iter().any(|root| self.exceeds(&known, vec![root]))
    }

    /// True if there are more nodes than allowed below these.
    fn exceeds(&self, known: &FxHashSet<NodeId>, mut stack: Vec<NodeId>) -> bool {
        let mut seen = FxHashSet::default();
        while let Some(id) = stack.pop() {
            if known.contains(&id) || !seen.insert(id) {
                continue;
            }
            if seen.len() > MOST_NODES {
                return true;
            }
            stack.extend(self.model.templates.arena.node(id).operands());
        }
        false
    }
}

fn collect(local: &Local, roots: &mut FxHashSet<NodeId>) {
    match local {
        Local::Node(typed) => {
            roots.insert(typed.node);
        }
        Local::Array(items, _) => roots.extend(items.iter().map(|item| item.node)),
        Local::Record(fields) | Local::Records(fields, _) => fields.iter().for_each(|(_, field)| collect(field, roots)),
        Local::Function(closure) => closure.given.iter().for_each(|(_, given)| collect(given, roots)),
        Local::Index(_) | Local::Value(_) => {}
    }
}
