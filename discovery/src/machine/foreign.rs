//! Units of other tools that are blocks of a model: whoever opens a study knows their files and runs them.
//!
//! A machine joins the system of a text with that of its units.  Their insides cannot be looked at: derivatives by parameters are those that
//! the joined system knows, else differences of whole runs (`machine`), and no term is added to an equation inside.

use std::sync::Arc;

use hyd_compiler::ForeignBlock;
use hyd_system::DaeSystem;

use crate::Fault;

/// Runs units beside texts.
pub trait Joiner: Send + Sync {
    /// The system of a text and of the units that are blocks of it, for one thread.
    ///
    /// # Errors
    /// Why there is none.
    fn join(&self, text: Box<dyn DaeSystem>, blocks: &[ForeignBlock]) -> Result<Box<dyn DaeSystem>, Fault>;
}

/// A shared one.
pub type Foreign = Arc<dyn Joiner>;

/// The system of a text, with its units where it has some.
pub(crate) fn joined(
    text: Box<dyn DaeSystem>,
    blocks: &[ForeignBlock],
    joiner: Option<&Foreign>,
) -> Result<Box<dyn DaeSystem>, Fault> {
    match (blocks.first(), joiner) {
        (None, _) => Ok(text),
        (Some(_), Some(joiner)) => joiner.join(text, blocks),
        (Some(block), None) => Err(Fault::new(format!(
            "the model holds the unit `{}` of another tool, which the command `hyd` alone can run",
            block.file
        ))),
    }
}
