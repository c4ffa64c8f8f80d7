//! Expressions as hash-consed nodes whose leaves are numbered slots.
//!
//! Equal expressions get the same [`NodeId`], so comparing, caching and common subexpressions cost nothing (Ershov 1958;
//! Filliâtre and Conchon 2006, "Type-safe modular hash-consing").  A node does not say what its slots mean: an
//! equation is a [`Template`] plus a list of what stands in each slot, so that a thousand equal components share one
//! template.  All values are `f64`; Booleans are 0 and 1.

use std::sync::Arc;

use hyd_index::{IndexVec, typed_index};
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

use crate::body::Body;

typed_index!(
    /// A node of an [`Arena`].
    NodeId,
    "n"
);
typed_index!(
    /// A slot of a template: a place for a variable, derivative, parameter or constant.
    SlotId,
    "s"
);
typed_index!(
    /// A compiled function of an [`Arena`].
    BodyId,
    "f"
);
typed_index!(
    /// A template of [`Templates`].
    TemplateId,
    "t"
);

/// A number that can be hashed: equal bits are equal (-0.0 is stored as 0.0, NaN never is).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Number(u64);

impl Number {
    /// Stores a value.
    pub fn new(value: f64) -> Self {
        Self(if value == 0.0 { 0.0f64.to_bits() } else { value.to_bits() })
    }

    /// The value.
    pub fn value(self) -> f64 {
        f64::from_bits(self.0)
    }
}

/// Comparison operators.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Relation {
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `==`
    Equal,
    /// `<>`
    NotEqual,
}

/// One operation.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Node {
    /// A number.
    Const(Number),
    /// What stands in a slot.
    Slot(SlotId),
    /// The independent variable, in s.
    Time,
    /// `initial()`: 1 during initialisation, else 0.
    Initial,
    /// How much of `homotopy` is actual rather than simplified: 1, but less on the way to the start if that needs it.
    Homotopy,
    /// `-a`
    Neg(NodeId),
    /// `not a`
    Not(NodeId),
    /// `a + b`
    Add(NodeId, NodeId),
    /// `a - b`
    Sub(NodeId, NodeId),
    /// `a * b`
    Mul(NodeId, NodeId),
    /// `a / b`
    Div(NodeId, NodeId),
    /// `a and b`
    And(NodeId, NodeId),
    /// `a or b`
    Or(NodeId, NodeId),
    /// A relation evaluated literally: it causes no event.
    Compare(Relation, NodeId, NodeId),
    /// A relation whose change of truth is an event; it keeps its value in between.
    Event(Relation, NodeId, NodeId),
    /// `if c then a else b`
    If(NodeId, NodeId, NodeId),
    /// A function of one argument.
    Call1(Function, NodeId),
    /// A function of two arguments, `Pow` included.
    Call2(Function, NodeId, NodeId),
    /// The first of several arguments and the rest: stands only below [`Node::Apply`] and has no value of its own.
    Pair(NodeId, NodeId),
    /// An output of a compiled function ([`Body`](crate::Body)), counted from 0; the operand is its only argument or a
    /// chain of [`Node::Pair`].
    Apply(BodyId, u32, NodeId),
}

impl Node {
    /// The operands in order.
    pub fn operands(&self) -> impl Iterator<Item = NodeId> + use<> {
        let (a, b, c) = match *self {
            Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy => (None, None, None),
            Node::Neg(a) | Node::Not(a) | Node::Call1(_, a) | Node::Apply(_, _, a) => (Some(a), None, None),
            Node::Add(a, b)
            | Node::Sub(a, b)
            | Node::Mul(a, b)
            | Node::Div(a, b)
            | Node::And(a, b)
            | Node::Or(a, b)
            | Node::Compare(_, a, b)
            | Node::Event(_, a, b)
            | Node::Call2(_, a, b)
            | Node::Pair(a, b) => (Some(a), Some(b), None),
            Node::If(c, a, b) => (Some(c), Some(a), Some(b)),
        };
        [a, b, c].into_iter().flatten()
    }

    /// The same operation on operands changed by `f`.
    pub fn map(self, mut f: impl FnMut(NodeId) -> NodeId) -> Node {
        match self {
            Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy => self,
            Node::Neg(a) => Node::Neg(f(a)),
            Node::Not(a) => Node::Not(f(a)),
            Node::Add(a, b) => Node::Add(f(a), f(b)),
            Node::Sub(a, b) => Node::Sub(f(a), f(b)),
            Node::Mul(a, b) => Node::Mul(f(a), f(b)),
            Node::Div(a, b) => Node::Div(f(a), f(b)),
            Node::And(a, b) => Node::And(f(a), f(b)),
            Node::Or(a, b) => Node::Or(f(a), f(b)),
            Node::Compare(r, a, b) => Node::Compare(r, f(a), f(b)),
            Node::Event(r, a, b) => Node::Event(r, f(a), f(b)),
            Node::If(c, a, b) => Node::If(f(c), f(a), f(b)),
            Node::Call1(g, a) => Node::Call1(g, f(a)),
            Node::Call2(g, a, b) => Node::Call2(g, f(a), f(b)),
            Node::Pair(a, b) => Node::Pair(f(a), f(b)),
            Node::Apply(body, output, a) => Node::Apply(body, output, f(a)),
        }
    }
}

/// The table of nodes.  Operands always come before the nodes that use them.
#[derive(Clone, Default, Debug)]
pub struct Arena {
    nodes: IndexVec<NodeId, Node>,
    known: FxHashMap<Node, NodeId>,
    pub(crate) bodies: IndexVec<BodyId, Arc<Body>>,
    /// The derivative of each body that was differentiated.
    pub(crate) derived: FxHashMap<BodyId, BodyId>,
}

impl Arena {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// True without nodes.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The operation behind an id.
    pub fn node(&self, id: NodeId) -> Node {
        self.nodes[id]
    }

    /// The id of exactly this operation (no simplification; see the constructors in `simplify`).
    pub fn intern(&mut self, node: Node) -> NodeId {
        if let Some(&id) = self.known.get(&node) {
            return id;
        }
        let id = self.nodes.push(node);
        self.known.insert(node, id);
        id
    }

    /// A number.
    pub fn constant(&mut self, value: f64) -> NodeId {
        self.intern(Node::Const(Number::new(value)))
    }

    /// What stands in a slot.
    pub fn slot(&mut self, slot: SlotId) -> NodeId {
        self.intern(Node::Slot(slot))
    }

    /// The value, if the node is a number.
    pub fn as_constant(&self, id: NodeId) -> Option<f64> {
        match self.nodes[id] {
            Node::Const(number) => Some(number.value()),
            _ => None,
        }
    }
}

/// An equation `left = right` over slots `0..arity`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Template {
    /// Left side.
    pub left: NodeId,
    /// Right side.
    pub right: NodeId,
    /// Number of slots.
    pub arity: u32,
}

/// All templates of a model with the arena they live in; equal templates have the same id.
#[derive(Clone, Default, Debug)]
pub struct Templates {
    /// The nodes.
    pub arena: Arena,
    list: IndexVec<TemplateId, Template>,
    known: FxHashMap<Template, TemplateId>,
}

impl Templates {
    /// An empty table.
    pub fn new() -> Self {
        Self::default()
    }

    /// The id of a template.
    pub fn intern(&mut self, template: Template) -> TemplateId {
        if let Some(&id) = self.known.get(&template) {
            return id;
        }
        let id = self.list.push(template);
        self.known.insert(template, id);
        id
    }

    /// The template behind an id.
    pub fn get(&self, id: TemplateId) -> Template {
        self.list[id]
    }

    /// Number of templates.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// True without templates.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}
