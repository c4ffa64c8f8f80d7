//! What all instances of a compiled model share.

use std::sync::Arc;

use hyd_payload::{Backend, Loaded};

use crate::lower::Lowered;
use crate::tangent::Source;

/// Sizes of the code.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CodeStatistics {
    /// Different expressions among assignments and residuals of the simulation.
    pub templates: usize,
    /// Kernels over all routines.
    pub kernels: usize,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
}

/// What the instances share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub loaded: Arc<Loaded>,
    pub lowered: Arc<Lowered>,
    pub statistics: CodeStatistics,
    pub backend: Backend,
    /// What tangents are made from.
    pub source: Arc<Source>,
}
