//! `homotopy(actual, simplified)` as an expression (Modelica 3.6, section 3.7.4.4).
//!
//! It is the actual expression, except on the way to the start, where a share below 1 blends it with the simplified one:
//! `if share < 1 then simplified + share*(actual - simplified) else actual`.  Later stages take the actual one alone
//! wherever there is no such way.

use hyd_symbolic::{Node, Relation};
use hyd_syntax::tree::Expr;

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

impl Flattener<'_, '_> {
    pub(crate) fn lower_homotopy(
        &mut self,
        actual: &Expr,
        simplified: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let actual = self.lower(actual, cx, index)?;
        let simplified = self.lower(simplified, cx, index)?;
        // A compiled function has only its arguments and cannot know how far the start has come.
        if !self.builders.is_empty() {
            return Ok(actual);
        }
        let arena = &mut self.model.templates.arena;
        let (share, one) = (arena.intern(Node::Homotopy), arena.constant(1.0));
        let part = arena.compare(Relation::Less, share, one);
        let difference = arena.sub(actual.node, simplified.node);
        let scaled = arena.mul(share, difference);
        let blend = arena.add(simplified.node, scaled);
        Ok(Typed::real(arena.select(part, blend, actual.node)))
    }
}
