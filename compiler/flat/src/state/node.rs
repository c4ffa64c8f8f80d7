//! Nodes with their types.

use hyd_instance::ScalarType;
use hyd_symbolic::NodeId;

/// A node with its type.
#[derive(Clone, Debug)]
pub(crate) struct Typed {
    /// The value.
    pub node: NodeId,
    /// Its type.
    pub scalar: ScalarType,
}

impl Typed {
    pub(crate) fn real(node: NodeId) -> Self {
        Self { node, scalar: ScalarType::Real }
    }

    pub(crate) fn boolean(node: NodeId) -> Self {
        Self { node, scalar: ScalarType::Boolean }
    }

    /// A number: Real or Integer.
    pub(crate) fn is_number(&self) -> bool {
        matches!(self.scalar, ScalarType::Real | ScalarType::Integer)
    }
}
