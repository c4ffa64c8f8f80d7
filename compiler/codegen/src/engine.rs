//! From a program to what runs it: machine code where it is wanted and possible.

use std::sync::Arc;

use hyd_payload::{Backend, Code, Engine};

use crate::native;
use crate::program::Program;

/// Code of a program, interpreted where none can be made or mapped.
///
/// # Errors
/// A sentence, when the program is inconsistent.
pub(crate) fn engine(program: Arc<Program>, backend: Backend) -> Result<Engine, String> {
    Engine::new(code(&program, backend)?, program, backend)
}

/// Machine code; none where it is not wanted or not possible.
pub(crate) fn code(program: &Program, backend: Backend) -> Result<Option<Arc<Code>>, String> {
    let wanted = backend == Backend::Native && native::is_supported();
    wanted.then(|| native::compile(program).map(Arc::new)).transpose()
}
