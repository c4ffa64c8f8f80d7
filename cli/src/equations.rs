//! `hyd equations FILE --stage S | --explain V | --html F`: shows what became of the equations.

use hyd_compiler::{Goal, Stage};

use crate::arguments::{Equations, EquationsWanted, StageName};
use crate::translate::translate;
use crate::{Failure, output};
use hyd_results::write_whole;
use hyd_run::check_target;

/// Runs the verb.
pub(crate) fn equations(arguments: &Equations) -> Result<(), Failure> {
    let EquationsWanted { stage, explain, html } = &arguments.wanted;
    let (stage, goal) = match stage {
        Some(StageName::Flat) => (Stage::Flat, Goal::Flat),
        Some(StageName::System) => (Stage::System, Goal::Check),
        Some(StageName::Reduced) => (Stage::Reduced, Goal::Check),
        Some(StageName::Sorted) | None => (Stage::Sorted, Goal::Check),
        Some(StageName::Jacobian) => (Stage::Jacobian, Goal::Check),
        Some(StageName::C) => (Stage::C, Goal::Run),
    };
    if let Some(path) = html {
        check_target("--html", path, &[&arguments.model.file])?;
    }
    let compilation = translate(&arguments.model, goal)?;
    let unfinished = || Failure::Fault("the translation did not come to this stage".to_string());
    if let Some(variable) = explain {
        let text = compilation.explain(variable).ok_or_else(unfinished)?;
        return output::print(&text.map_err(Failure::Fault)?);
    }
    if let Some(path) = html {
        let page = compilation.page().ok_or_else(unfinished)?;
        let failed = |error: std::io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
        return write_whole(path, page.as_bytes()).map_err(failed);
    }
    output::print(&compilation.print(stage).ok_or_else(unfinished)?)
}
