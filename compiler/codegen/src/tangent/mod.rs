//! Forward-mode tangents of a model: the data that [`hyd_payload::tangent`] runs.
//!
//! [`code`] makes routines of the local partial derivatives of each row by what it reads (symbolic, loops as everywhere) and the rows that
//! chain them; [`sweep`] makes one routine for what steps of sensitivities ask for all the time.  Both are made when they are first asked
//! for ([`Source`]), the sweep for the chosen directions alone; a model that is to be stored gets them for all directions ([`stored`]).

mod code;
mod sweep;

use std::sync::Arc;

use hyd_payload::program::Program;
use hyd_payload::tangent::{SweepModel, TangentModel, TangentSource};
use hyd_payload::{Backend, Code, CodeSource, Model};

use crate::engine;
use crate::lower::Lowered;

/// Makes tangents, and code of further programs, when they are asked for.
#[derive(Debug)]
pub(crate) struct Source {
    /// What is differentiated.
    pub lowered: Arc<Lowered>,
    /// For each output the position of its start value, where that can be varied.
    pub starts: Arc<[Option<u32>]>,
    /// What runs the code.
    pub backend: Backend,
}

impl TangentSource for Source {
    fn tangents(&self) -> Result<TangentModel, String> {
        code::tangents(&self.lowered, self.starts.to_vec(), self.backend)
    }

    fn sweep(&self, reached: &[bool]) -> Option<SweepModel> {
        sweep::sweep(&self.lowered, reached, self.backend)
    }
}

impl CodeSource for Source {
    fn code(&self, program: &Program) -> Option<Arc<Code>> {
        engine::code(program, self.backend).ok().flatten()
    }
}

/// The model with its tangents along whatever can be varied.
///
/// # Errors
/// A sentence, when no code can be made.
pub(crate) fn stored(model: &Model, source: &Source) -> Result<Model, String> {
    let tangents = source.tangents()?;
    let sweep = source.sweep(&tangents.reachable(model));
    Ok(Model { tangents: Some(Arc::new(TangentModel { sweep, ..tangents })), ..model.clone() })
}
