//! `hyd equations FILE --stage S`: prints a stage of the translation.

use hyd_compiler::{Goal, Stage};

use crate::arguments::{Equations, StageName};
use crate::translate::translate;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn equations(arguments: &Equations) -> Result<(), Failure> {
    let (stage, goal) = match arguments.stage {
        StageName::Flat => (Stage::Flat, Goal::Flat),
        StageName::System => (Stage::System, Goal::Check),
        StageName::Reduced => (Stage::Reduced, Goal::Check),
        StageName::Sorted => (Stage::Sorted, Goal::Check),
        StageName::Jacobian => (Stage::Jacobian, Goal::Check),
    };
    let compilation = translate(&arguments.model, goal)?;
    let text = compilation.print(stage);
    output::print(&text.ok_or_else(|| Failure::Fault("the translation did not come to this stage".to_string()))?)
}
