//! `floor`, `ceil`, `integer`, `div`, `mod` and `rem` of values that change continuously: events at their jumps.
//!
//! The integer is a discrete variable of the translation's own: `q = if z < pre(q) then min(floor(z), pre(q) - 1)
//! elseif z >= pre(q) + 1 then max(floor(z), pre(q) + 1) else pre(q)`, whose two relations are watched (Modelica 3.6,
//! section 3.7.2.1).  So the solver never steps over a jump and between jumps `mod(x, y) = x - q*y` is smooth.  Inside
//! `noEvent`, functions and `when` the functions are plain.
//!
//! The variable has an equation of its own, outside the branch that the function stands in.  Where that branch is not taken `z`
//! may have no value (`if x > 0 then floor(sqrt(x)) else 0`), so there `q` rests: `z` is `pre(q)`.

use hyd_instance::ScalarType;
use hyd_source::{Origin, Span};
use hyd_symbolic::{Arena, Function, Node, NodeId, Relation, post_order};
use hyd_system::{ValueKind, Variability};

use crate::model::{Section, VarId};
use crate::state::context::{Context, Fail};
use crate::state::flattener::{Flattener, scale};
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

/// What a variable for an integer belongs to: the expression, what its slots read, the loops around.
pub(crate) type JumpKey = (NodeId, Vec<SlotKey>, Vec<usize>);

impl Flattener<'_, '_> {
    /// The function with events at its jumps; `None` where it is plain.
    pub(crate) fn lower_jump(
        &mut self,
        span: Span,
        function: Function,
        values: &[Typed],
        cx: &Context,
    ) -> Result<Option<NodeId>, Fail> {
        let jumps =
            matches!(function, Function::Floor | Function::Ceil | Function::Div | Function::Mod | Function::Rem);
        let plain = cx.no_event || cx.depth > 0 || cx.in_when;
        if !jumps || plain || !values.iter().any(|value| self.changes_between_events(value.node)) {
            return Ok(None);
        }
        Ok(Some(match (function, values) {
            (Function::Floor, [x]) => self.whole_below(span, x.node, cx)?,
            (Function::Ceil, [x]) => self.whole_above(span, x.node, cx)?,
            (_, [x, y]) => {
                let quotient = self.model.templates.arena.div(x.node, y.node);
                let whole = match function {
                    Function::Mod => self.whole_below(span, quotient, cx)?,
                    _ => self.toward_zero(span, quotient, cx)?,
                };
                if function == Function::Div {
                    return Ok(Some(whole));
                }
                let arena = &mut self.model.templates.arena;
                let part = arena.mul(whole, y.node);
                arena.sub(x.node, part)
            }
            _ => return Ok(None),
        }))
    }

    /// The condition under which the place is reached, if `z` may have no value where it is not.
    fn guard(&self, z: NodeId, cx: &Context) -> Option<NodeId> {
        cx.holds.filter(|_| may_fail(&self.model.templates.arena, z))
    }

    fn whole_above(&mut self, span: Span, z: NodeId, cx: &Context) -> Result<NodeId, Fail> {
        let minus = self.model.templates.arena.neg(z);
        let below = self.whole_below(span, minus, cx)?;
        Ok(self.model.templates.arena.neg(below))
    }

    fn toward_zero(&mut self, span: Span, z: NodeId, cx: &Context) -> Result<NodeId, Fail> {
        let (below, above) = (self.whole_below(span, z, cx)?, self.whole_above(span, z, cx)?);
        let arena = &mut self.model.templates.arena;
        let zero = arena.constant(0.0);
        let reached = match self.guard(z, cx) {
            Some(guard) => self.model.templates.arena.select(guard, z, zero),
            None => z,
        };
        let arena = &mut self.model.templates.arena;
        let positive = arena.event(Relation::GreaterEqual, reached, zero);
        Ok(arena.select(positive, below, above))
    }

    /// The largest integer not above `z`, as a discrete variable.
    fn whole_below(&mut self, span: Span, z: NodeId, cx: &Context) -> Result<NodeId, Fail> {
        let counts = cx.loop_counts();
        let guard = self.guard(z, cx);
        let arena = &mut self.model.templates.arena;
        let zero = arena.constant(0.0);
        let guarded = guard.map_or(z, |guard| arena.select(guard, z, zero));
        let slots = hyd_symbolic::slots(arena, &[guarded]);
        let keys: Vec<SlotKey> = slots.iter().map(|slot| self.slots.keys[slot.0 as usize].clone()).collect();
        let key = (guarded, keys, counts.clone());
        let known = self.all_notes().find_map(|notes| notes.jumps.iter().find(|(k, _)| *k == key).map(|(_, v)| *v));
        let first = match known {
            Some(first) => first,
            None => {
                let origin = Origin { path: self.path(cx.scope.inst), span };
                let number = self.all_notes().map(|notes| notes.jumps.len()).sum::<usize>() + 1;
                let shape = (ValueKind::Integer, Variability::Discrete);
                let first = self.make(Made::Event, format!("$whole{number}"), &counts, shape, origin.clone());
                self.tables().notes.jumps.push((key, first));
                self.emit_jump(first, (guard, z), &counts, cx, &origin)?;
                first
            }
        };
        self.whole_slot(Kind::Var, first, &counts, cx)
    }

    /// The element of the variable that belongs to the turn of the loops around.
    fn whole_slot(&mut self, kind: Kind, first: VarId, counts: &[usize], cx: &Context) -> Result<NodeId, Fail> {
        let fixed = cx.fixed.as_ref().map_or(0, Vec::len);
        let mut offset = Affine::constant(0);
        for (k, &size) in counts.iter().enumerate() {
            let at =
                if k < fixed { Affine::constant(0) } else { Affine::counter(crate::state::index::CounterId(k as u32)) };
            offset = scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
        }
        let slot = self.slots.slot(SlotKey::Variable(kind, first, offset));
        Ok(self.model.templates.arena.slot(slot))
    }

    fn emit_jump(
        &mut self,
        first: VarId,
        (guard, z): (Option<NodeId>, NodeId),
        counts: &[usize],
        cx: &Context,
        origin: &Origin,
    ) -> Result<(), Fail> {
        let (now, before) =
            (self.whole_slot(Kind::Var, first, counts, cx)?, self.whole_slot(Kind::Pre, first, counts, cx)?);
        let arena = &mut self.model.templates.arena;
        let z = guard.map_or(z, |guard| arena.select(guard, z, before));
        let one = arena.constant(1.0);
        let next = arena.add(before, one);
        let low = arena.event(Relation::Less, z, before);
        let high = arena.event(Relation::GreaterEqual, z, next);
        // At an instant known in advance the relations tell what holds just after it, the value of z does not yet.
        let floor = arena.call1(Function::Floor, z);
        let less = arena.sub(before, one);
        let (down, up) = (arena.call2(Function::Min, floor, less), arena.call2(Function::Max, floor, next));
        let rising = arena.select(high, up, before);
        let moved = arena.select(low, down, rising);
        let initial = arena.intern(Node::Initial);
        let value = arena.select(initial, floor, moved);
        self.emit(Section::Discrete, now, value, counts, origin);
        Ok(())
    }

    /// `integer(x)`: the largest integer not above, as an Integer.
    pub(crate) fn lower_integer(&mut self, span: Span, value: &Typed, cx: &Context) -> Result<Typed, Fail> {
        self.want_number(span, "`integer`", value)?;
        let node = match self.lower_jump(span, Function::Floor, std::slice::from_ref(value), cx)? {
            Some(node) => node,
            None => self.model.templates.arena.call1(Function::Floor, value.node),
        };
        Ok(Typed { node, scalar: ScalarType::Integer })
    }
}

/// True if an expression may have no finite value although all that it reads has one.
fn may_fail(arena: &Arena, z: NodeId) -> bool {
    let zero = |id: NodeId| arena.as_constant(id).is_none_or(|value| value == 0.0);
    post_order(arena, &[z]).into_iter().any(|id| match arena.node(id) {
        Node::Div(_, b) | Node::Call2(Function::Div | Function::Mod | Function::Rem, _, b) => zero(b),
        Node::Call1(function, _) => !matches!(
            function,
            Function::Sin
                | Function::Cos
                | Function::Atan
                | Function::Tanh
                | Function::Abs
                | Function::Sign
                | Function::Floor
                | Function::Ceil
        ),
        Node::Call2(function, ..) => !matches!(function, Function::Atan2 | Function::Min | Function::Max),
        Node::Apply(..) => true,
        _ => false,
    })
}
