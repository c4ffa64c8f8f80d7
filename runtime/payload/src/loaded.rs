//! A model ready to run: its data and what runs its program, shared by all its instances.

use std::sync::Arc;

use crate::engine::{Backend, Engine};
use crate::excerpt::{CodeSource, Excerpts};
use crate::model::Model;
use crate::tangent::{Derivatives, TangentSource};

/// A model ready to run.
#[derive(Debug)]
pub struct Loaded {
    /// The model.
    pub model: Model,
    /// What runs its program.
    pub engine: Engine,
    /// Where its tangents come from.
    pub(crate) derivatives: Derivatives,
    /// What evaluates some outputs without the others.
    pub(crate) excerpts: Excerpts,
}

impl Loaded {
    /// Maps the code of a model, or prepares its program for interpretation.  Its tangents are those that it was stored with.
    ///
    /// # Errors
    /// A sentence, when the program is inconsistent or its code does not suit this machine.
    pub fn new(model: Model, backend: Backend) -> Result<Self, String> {
        Self::with(model, backend, None)
    }

    /// The same with tangents, and code for some outputs without the others, that are made when they are first asked for.
    ///
    /// # Errors
    /// As for [`Loaded::new`].
    pub fn with_source(model: Model, backend: Backend, source: Arc<dyn CodeSource>) -> Result<Self, String> {
        Self::with(model, backend, Some(source))
    }

    fn with(model: Model, backend: Backend, source: Option<Arc<dyn CodeSource>>) -> Result<Self, String> {
        let engine = Engine::new(model.code.clone(), model.program.clone(), backend)?;
        let tangents = source.clone().map(|source| source as Arc<dyn TangentSource>);
        Ok(Self { model, engine, derivatives: Derivatives::new(tangents, backend), excerpts: Excerpts::new(source) })
    }
}
