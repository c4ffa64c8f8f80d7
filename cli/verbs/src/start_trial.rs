//! Whether a model that leaves this program, and the compiler with it, finds its start.

use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel};
use hyd_results::Discard;
use hyd_run::parameters;
use hyd_runtime::{Options, SolveError, simulate};

use crate::translate::with_whole_loops;

/// The model with all variables of loops as unknowns of the solver, where initial values are found so alone, and not with these computed
/// one after the other; `set`: all parameters that are set.  None, too, where a start cannot be tried here or fails either way.
pub fn whole_loops_for_the_start(
    compilation: &Compilation,
    set: &[(String, String)],
    stop: &dyn Fn() -> bool,
) -> Option<Arc<CompiledModel>> {
    let model = compilation.model.as_deref().filter(|model| model.payload().has_torn_loops())?;
    // Units of other tools would have to be opened.
    if !compilation.flat.as_ref()?.foreign.is_empty() {
        return None;
    }
    let started = |model: &CompiledModel| -> Option<Result<(), SolveError>> {
        let mut system = model.instantiate();
        parameters::apply(&mut system, set, &compilation.set_at_translation).ok()?;
        let experiment = &model.payload().experiment;
        let start = experiment.start.unwrap_or(0.0);
        let mut options = Options::new(start, start);
        options.tolerance = experiment.tolerance.unwrap_or(options.tolerance);
        options.check().ok()?;
        Some(simulate(&mut system, &options, &mut Discard, stop).map(drop))
    };
    let error = started(model)?.err().filter(SolveError::may_be_of_loops);
    let whole = error.and_then(|_| with_whole_loops(compilation, set))?;
    matches!(started(&whole), Some(Ok(()))).then_some(whole)
}
