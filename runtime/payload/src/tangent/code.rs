//! Tangents ready to run.

use std::sync::Arc;

use super::model::{SweepModel, TangentModel};
use crate::engine::{Backend, Engine};

/// Code for all tangents of a model, shared by its instances.
#[derive(Debug)]
pub(crate) struct TangentCode {
    pub(super) engine: Engine,
    pub(super) model: Arc<TangentModel>,
}

impl TangentCode {
    pub(super) fn new(model: Arc<TangentModel>, backend: Backend) -> Result<Self, String> {
        let engine = Engine::new(model.code.clone(), model.program.clone(), backend)?;
        Ok(Self { engine, model })
    }
}

/// Code of a sweep.
#[derive(Debug)]
pub(crate) struct SweepCode {
    pub(super) engine: Engine,
    pub(super) model: SweepModel,
}

impl SweepCode {
    pub(super) fn new(model: SweepModel, backend: Backend) -> Result<Self, String> {
        let engine = Engine::new(model.code.clone(), model.program.clone(), backend)?;
        Ok(Self { engine, model })
    }

    /// Length of the array that the routine writes.
    pub(super) fn length(&self) -> usize {
        self.model.state_entries as usize + self.model.entries.len()
    }
}
