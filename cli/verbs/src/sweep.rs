//! Many runs of a translated model; those in which rounding errors grow along a torn loop are done again with the loops whole.

use std::sync::{Arc, OnceLock};

use hyd_compiler::{Compilation, CompiledModel, FlatModel, Severity};
use hyd_run::parameters;
use hyd_run::{Failure, InputTable, Prepared, Recorded, Subject, WholeLoops};
use hyd_system::DaeSystem;

use crate::Listener;
use crate::translate::with_whole_loops;

/// Runs the model as prepared: `work` gets the subject of the runs.  `set`: all parameters that are set for all runs; `table`: recorded inputs,
/// which the translation knew of.
///
/// # Errors
/// As `work`; also values and inputs that the model does not take.
pub fn sweep<T>(
    (compilation, set): (&Compilation, &[(String, String)]),
    table: Option<&InputTable>,
    prepared: &Prepared<'_>,
    listener: &dyn Listener,
    work: impl FnOnce(&Subject<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let model = compilation.model.clone();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let experiment = InputTable::experiment(table, &model.payload().experiment, None);
    let recorded = match table {
        Some(table) => {
            let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
            table.recorded(&mut model.instantiate(), prepared.span(&experiment)?, &known)?
        }
        None => Recorded::default(),
    };
    recorded.warnings.iter().for_each(|warning| listener.sentence(Severity::Warning, warning));
    let make = || {
        let mut system = model.instantiate();
        parameters::apply(&mut system, set, &compilation.set_at_translation)?;
        recorded.hand_over(&mut system)?;
        Ok(Box::new(system) as Box<dyn DaeSystem>)
    };
    let payload = model.payload();
    let limits = &payload.parameters.limits;
    // Translated once, by whichever run needs it first.
    let whole: OnceLock<Option<Arc<CompiledModel>>> = OnceLock::new();
    let make_whole = || {
        let model = whole.get_or_init(|| with_whole_loops(compilation, set)).as_ref()?;
        let mut system = model.instantiate();
        parameters::apply(&mut system, set, &compilation.set_at_translation).ok()?;
        recorded.hand_over(&mut system).ok()?;
        Some(Box::new(system) as Box<dyn DaeSystem>)
    };
    let whole_loops = if payload.has_torn_loops() { WholeLoops::Made(&make_whole) } else { WholeLoops::Needless };
    let sources = payload.identity.sources ^ table.map_or(0, InputTable::fingerprint);
    work(&Subject { sources, experiment, limits, make: &make, whole_loops })
}
