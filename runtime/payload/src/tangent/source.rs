//! The tangents of a loaded model: those that it was stored with, or those that a code generator makes when they are first asked for.

use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use super::code::{SweepCode, TangentCode};
use super::model::{SweepModel, TangentModel};
use crate::engine::Backend;
use crate::model::Model;

/// Makes tangents when they are asked for.
pub trait TangentSource: Debug + Send + Sync {
    /// The tangents of all routines, without [`TangentModel::sweep`].
    ///
    /// # Errors
    /// A sentence, when no code can be made.
    fn tangents(&self) -> Result<TangentModel, String>;

    /// Derivatives of the residuals by the marked positions of the data area; none where the Jacobian is not straight-line code.
    fn sweep(&self, reached: &[bool]) -> Option<SweepModel>;
}

/// Where the tangents of a loaded model come from.
#[derive(Debug)]
pub struct Derivatives {
    source: Option<Arc<dyn TangentSource>>,
    backend: Backend,
    made: OnceLock<Result<Arc<TangentCode>, String>>,
}

impl Derivatives {
    /// Those of the model itself, unless there is a source.
    pub(crate) fn new(source: Option<Arc<dyn TangentSource>>, backend: Backend) -> Self {
        Self { source, backend, made: OnceLock::new() }
    }

    /// Code of the tangents, made once.
    pub(crate) fn code(&self, model: &Model) -> Result<Arc<TangentCode>, String> {
        let make = || {
            let tangents = match (&self.source, &model.tangents) {
                (Some(source), _) => Arc::new(source.tangents()?),
                (None, Some(tangents)) => tangents.clone(),
                (None, None) => return Err("the model was stored without derivatives".to_string()),
            };
            TangentCode::new(tangents, self.backend).map(Arc::new)
        };
        self.made.get_or_init(make).clone()
    }

    /// The sweep for the marked positions of the data area; none where rows do its work.
    pub(crate) fn sweep(&self, tangents: &TangentModel, reached: &[bool]) -> Option<Arc<SweepCode>> {
        let sweep = match &self.source {
            Some(source) => source.sweep(reached)?,
            None => tangents.sweep.clone()?,
        };
        SweepCode::new(sweep, self.backend).ok().map(Arc::new)
    }
}
