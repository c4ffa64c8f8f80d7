//! Flat model to code: equations are sorted and differentiated, once more with sums of equations where they turn out singular.

use std::sync::Arc;

use hyd_codegen::Jacobians;
use hyd_equations::{Combination, EquationSystem, Loops, PlanJacobian, SortedSystem};
use hyd_flat::{FlatModel, Injection, PerElement};
use hyd_source::{Diagnostic, Outcome};

use crate::compilation::{Compilation, Goal, Options};
use crate::injection::refusals;
use crate::limits::{check_limits, check_starts};

/// Flat model to sorted system with its derivatives, and to code if that is wanted.
pub(crate) fn sort(
    result: &mut Compilation,
    flat: &FlatModel,
    options: &Options,
    (terms, loops): (&[Injection], Loops),
) {
    let attempt =
        hyd_equations::until_regular(|combinations| sort_once(result, flat, options, (terms, loops), combinations));
    result.diagnostics.extend(attempt.diagnostics);
    result.set_at_translation.extend(attempt.set_at_translation);
    result.system = attempt.system;
    result.reduced = attempt.reduced;
    let Some(mut sorted) = attempt.sorted else { return };
    let own = result.own_files.clone();
    let (messages, waived) = check_limits(&sorted, &options.set, &own);
    result.diagnostics.extend(messages);
    // What has been let pass here is not refused when it is run.
    for v in waived {
        let block = sorted.system.flat.locate(v).0;
        let variable = &mut sorted.system.flat.variables[block];
        (variable.min, variable.max) = (PerElement::All(f64::NEG_INFINITY), PerElement::All(f64::INFINITY));
    }
    result.diagnostics.extend(check_starts(&sorted));
    let jacobian = result.stage(options.clock, "differentiate", |_| {
        hyd_equations::differentiate(&mut sorted.system, &sorted.simulation)
    });
    if options.goal == Goal::Run {
        generate(result, &mut sorted, &jacobian, options);
    }
    result.jacobian = Some(jacobian);
    result.sorted = Some(Arc::new(sorted));
}

/// What became of a flat model whose equations were sorted in one way.
#[derive(Default)]
struct Sorting {
    diagnostics: Vec<Diagnostic>,
    set_at_translation: Vec<String>,
    system: Option<EquationSystem>,
    reduced: Option<EquationSystem>,
    sorted: Option<SortedSystem>,
}

/// One attempt, with sums in the place of some equations; which sum may help, if it fails.
fn sort_once(
    result: &mut Compilation,
    flat: &FlatModel,
    options: &Options,
    (terms, loops): (&[Injection], Loops),
    combinations: &[Combination],
) -> Result<Sorting, Box<(Sorting, Option<Combination>)>> {
    // Where code is made, stages in between are handed on: copies of a million equations are dear.
    let copy = |system: &EquationSystem| (options.goal < Goal::Run).then(|| system.clone());
    let mut made = Sorting::default();
    let build = |_: &mut Compilation| hyd_equations::build_combined(flat.clone(), combinations);
    let Some(system) = result.stage(options.clock, "eliminate aliases", build) else {
        return Err(Box::new((made, None)));
    };
    made.system = copy(&system);
    let Outcome { value, diagnostics } =
        result.stage(options.clock, "reduce index", |_| hyd_equations::reduce_index(system));
    made.diagnostics.extend(diagnostics);
    let Some(reduced) = value else { return Err(Box::new((made, None))) };
    made.diagnostics.extend(refusals(&reduced, terms));
    let fixed = reduced.reduction.fixed_at_zero.iter().map(|&v| reduced.flat.var_name(v));
    made.set_at_translation.extend(fixed.filter(|name| options.set.iter().any(|(set, _)| set == name)));
    made.reduced = copy(&reduced);
    let Outcome { value, diagnostics } =
        result.stage(options.clock, "sort", |_| hyd_equations::sort_system(reduced, loops));
    made.diagnostics.extend(diagnostics);
    match value {
        Ok(sorted) => {
            made.sorted = Some(sorted);
            Ok(made)
        }
        Err(next) => Err(Box::new((made, next))),
    }
}

/// Sorted system to code.
fn generate(result: &mut Compilation, sorted: &mut SortedSystem, jacobian: &PlanJacobian, options: &Options) {
    if result.has_errors() {
        return;
    }
    let made = result.stage(options.clock, "generate code", |result| {
        let initial = hyd_equations::differentiate(&mut sorted.system, &sorted.initial);
        let jacobians = Jacobians { simulation: jacobian, initial: &initial };
        hyd_codegen::generate(sorted, jacobians, &result.files, &hyd_codegen::Options::default())
    });
    match made {
        Ok(model) => result.model = Some(Arc::new(model)),
        Err(diagnostic) => result.diagnostics.push(diagnostic),
    }
}
