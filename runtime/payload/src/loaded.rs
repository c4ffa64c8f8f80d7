//! A model ready to run: its data and what runs its program, shared by all its instances.

use crate::engine::{Backend, Engine};
use crate::model::Model;

/// A model ready to run.
#[derive(Debug)]
pub struct Loaded {
    /// The model.
    pub model: Model,
    /// What runs its program.
    pub engine: Engine,
}

impl Loaded {
    /// Maps the code of a model, or prepares its program for interpretation.
    ///
    /// # Errors
    /// A sentence, when the program is inconsistent or its code does not suit this machine.
    pub fn new(model: Model, backend: Backend) -> Result<Self, String> {
        let engine = Engine::new(model.code.clone(), model.program.clone(), backend)?;
        Ok(Self { model, engine })
    }
}
