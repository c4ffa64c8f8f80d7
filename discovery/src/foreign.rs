//! Models without a text: units of other tools, whose insides cannot be looked at.
//!
//! A machine takes one like a translated model; what its channels show are its variables by name, and derivatives are differences of
//! whole runs (`machine`).

use std::sync::Arc;

use hyd_system::DaeSystem;

use crate::Fault;

/// A model of which there is no text.
pub trait ForeignModel: Send + Sync {
    /// A system of its own, for one thread; columns drive its inputs with these names.
    ///
    /// # Errors
    /// Why there is none.
    fn instantiate(&self, driven: &[String]) -> Result<Box<dyn DaeSystem>, Fault>;

    /// Names of its inputs.
    fn inputs(&self) -> Vec<String>;

    /// Smallest and largest values of its parameters, by name.
    fn limits(&self) -> Vec<(String, (f64, f64))>;
}

/// A shared one.
pub type Foreign = Arc<dyn ForeignModel>;
