//! `homotopy(actual, simplified)` as an expression (Modelica 3.6, section 3.7.4.4).
//!
//! It is the actual expression, except on the way to the start, where a share below 1 blends it with the simplified one:
//! `if share < 1 then simplified + share*(actual - simplified) else actual`.  Later stages take the actual one alone
//! wherever there is no such way.

use hyd_symbolic::{Node, Relation};

use crate::state::flattener::Flattener;
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    pub(crate) fn homotopy(&mut self, actual: Typed, simplified: Typed) -> Typed {
        // A compiled function has only its arguments and cannot know how far the start has come.
        if !self.builders.is_empty() {
            return actual;
        }
        let arena = &mut self.model.templates.arena;
        let (share, one) = (arena.intern(Node::Homotopy), arena.constant(1.0));
        let part = arena.compare(Relation::Less, share, one);
        let difference = arena.sub(actual.node, simplified.node);
        let scaled = arena.mul(share, difference);
        let blend = arena.add(simplified.node, scaled);
        Typed::real(arena.select(part, blend, actual.node))
    }
}
