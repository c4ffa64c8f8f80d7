//! From a program to machine code, where it is wanted and possible.

use std::sync::Arc;

use hyd_payload::{Backend, Code};

use crate::native;
use crate::program::Program;

/// Machine code; none where it is not wanted or not possible.
pub(crate) fn code(program: &Program, backend: Backend) -> Result<Option<Arc<Code>>, String> {
    let wanted = backend == Backend::Native && native::is_supported();
    wanted.then(|| native::compile(program).map(Arc::new)).transpose()
}
