//! Arguments that a compiled function does not look at.
//!
//! A function may have arguments for its derivative only (Modelica 3.6, section 12.7.1): what stands there is not an unknown of the equation
//! with the call, but one of its derivative.

use hyd_index::TypedIndex;

use crate::body::Step;
use crate::node::{Arena, BodyId, Node, NodeId};
use crate::occurs::{contains, slots};
use crate::substitute::rewrite;

/// The expression with 0 for arguments that decide neither what a function gives nor whether it fails.
pub fn without_ignored(arena: &mut Arena, root: NodeId) -> NodeId {
    let zero = arena.constant(0.0);
    rewrite(arena, root, |arena, node| {
        let Node::Apply(body, output, list) = node else { return None };
        let ignored = ignored(arena, body);
        if !ignored.contains(&true) {
            return None;
        }
        let mut arguments = arena.arguments(list);
        for (argument, _) in arguments.iter_mut().zip(&ignored).filter(|(_, ignored)| **ignored) {
            // A call within may fail, which must be heard.
            if !contains(arena, *argument, |node| matches!(node, Node::Apply(..))) {
                *argument = zero;
            }
        }
        let list = arena.argument_list(&arguments);
        Some(arena.apply(body, output, list))
    })
}

/// For each argument of a body: no step reads it, and it is not an output.
fn ignored(arena: &Arena, id: BodyId) -> Vec<bool> {
    let body = arena.body(id);
    let mut read = vec![false; body.registers as usize];
    let mut lists: Vec<&[Step]> = vec![&body.steps];
    while let Some(steps) = lists.pop() {
        for step in steps {
            slots(arena, &step.expressions()).into_iter().for_each(|slot| read[slot.index()] = true);
            if let Step::Load { first, count, .. } = step {
                read[*first as usize..(first + count) as usize].fill(true);
            }
            lists.extend(step.inner());
        }
    }
    body.outputs.iter().for_each(|output| read[output.register as usize] = true);
    (0..body.inputs as usize).map(|k| !read[k]).collect()
}
