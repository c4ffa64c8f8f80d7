//! Forward sensitivities of models in the repository against wide-step central differences.
//!
//! Differences with steps `2 d`, `d` are extrapolated (Richardson); the distance between the two steps estimates their
//! own error, by which they are believed.  Where the trajectory jumps or bounces at a time that depends on the
//! parameter differences do not converge, and where the parameter itself stands on a branch (`if wyp < 1` at 1) those
//! from both sides (of second order) differ: both are left out by these estimates.  Deviations are measured by the
//! range of the difference over the run.  Close to contacts the estimate lets some points pass that it should not, so
//! all but a few must agree, and those few not badly.

use hyd_compiler::{Compilation, Goal, Instance};
use hyd_results::Trajectory;
use hyd_runtime::{Options, simulate};
use hyd_system::{DaeSystem, Place, Settable, ValueKind, Variability};
use hyd_tests::models::{compile_file, model_files};

/// Deviation allowed, as a part of the range of the derivative, and share of the values that must keep to it.
const ALLOWED: f64 = 1e-4;
const SHARE: f64 = 0.999;
/// Deviation allowed to the others.
const WORST: f64 = 5e-3;
/// Differences are believed to a tenth of that.
const BELIEVED: f64 = 1e-5;
/// Distance of the derivatives from both sides beyond which there is none.
const ONE_SIDED: f64 = WORST;
/// Larger models take too long (the head of four cylinders, 76 unknowns, agrees as the others do).
const MOST_UNKNOWNS: usize = 60;
/// Parameters per model, spread evenly over those there are.
const PARAMETERS: usize = 5;
/// The same for models with delays, whose runs at this tolerance are long.
const PARAMETERS_WITH_DELAYS: usize = 2;
const TOLERANCE: f64 = 1e-11;
const STEP: f64 = 1e-4;

struct Parameter {
    name: String,
    index: usize,
    value: f64,
}

fn parameters(system: &Instance) -> Vec<Parameter> {
    let mut list = Vec::new();
    for variable in &system.tables().variables {
        if variable.settable != Settable::Yes || variable.kind != ValueKind::Real {
            continue;
        }
        for (element, source) in variable.sources.iter().enumerate() {
            let Place::Parameter(index) = source.place else { continue };
            let (index, name) = (index as usize, variable.name.element(element));
            let value = system.parameters()[index];
            // Zero parameters switch something off; half of a step below zero may be out of range.
            if value != 0.0 {
                list.push(Parameter { name, index, value });
            }
        }
    }
    list
}

fn run(system: &mut Instance, options: &Options) -> Option<Trajectory> {
    let mut rows = Trajectory::new();
    simulate(system, options, &mut rows, &|| false).ok().map(|_| rows)
}

/// Comparison of one parameter: largest deviation, and share of the values that were compared.
struct Agreement {
    worst: f64,
    variable: String,
    compared: usize,
    left_out: usize,
    beyond: usize,
}

fn compare(
    compilation: &Compilation,
    options: &Options,
    parameter: &Parameter,
    exact: &Trajectory,
) -> Option<Agreement> {
    let moved = |factor: f64| {
        let mut system = compilation.model.as_ref().expect("translated").instantiate();
        system.set_parameter(parameter.index, parameter.value + factor * STEP * parameter.value).ok()?;
        run(&mut system, options)
    };
    let runs = [moved(-2.0)?, moved(-1.0)?, moved(1.0)?, moved(2.0)?];
    if runs.iter().any(|run| run.len() != exact.len()) {
        return None;
    }
    let h = STEP * parameter.value;
    let mut agreement = Agreement { worst: 0.0, variable: String::new(), compared: 0, left_out: 0, beyond: 0 };
    for variable in &exact.tables().variables {
        let continuous = variable.variability == Variability::Continuous && variable.kind == ValueKind::Real;
        let is_derivative = variable.name.parts.last().is_some_and(|part| part.0.contains("/d("));
        if !continuous || is_derivative || variable.name.derivative {
            continue;
        }
        for (element, &source) in variable.sources.iter().enumerate() {
            let name = variable.name.element(element);
            let base = exact.series_of(source);
            let Some(derivative) = exact.series(&format!("d({name})/d({})", parameter.name)) else { continue };
            let series: Vec<Vec<f64>> = runs.iter().map(|run| run.series_of(source).values()).collect();
            let wide = |k: usize| (series[3][k] - series[0][k]) / (4.0 * h);
            let narrow = |k: usize| (series[2][k] - series[1][k]) / (2.0 * h);
            let best = |k: usize| (4.0 * narrow(k) - wide(k)) / 3.0;
            let range = (0..exact.len()).map(best).fold((0.0f64, 0.0f64), |(a, b), v| (a.min(v), b.max(v)));
            let range = range.1 - range.0;
            // Runs are exact to the tolerance only, which a small difference does not survive.
            let size = (0..exact.len()).map(|k| series[1][k].abs()).fold(0.0, f64::max);
            if range * h.abs() <= 1e4 * TOLERANCE * size {
                continue;
            }
            let above = |k: usize| (4.0 * series[2][k] - series[3][k] - 3.0 * base.at(k)) / (2.0 * h);
            let below = |k: usize| (3.0 * base.at(k) - 4.0 * series[1][k] + series[0][k]) / (2.0 * h);
            for (k, time) in exact.times().iter().enumerate() {
                let one_sided = (above(k) - below(k)).abs() > ONE_SIDED * range;
                if (best(k) - narrow(k)).abs() > BELIEVED * range || one_sided {
                    agreement.left_out += 1;
                    continue;
                }
                agreement.compared += 1;
                let deviation: f64 = (derivative.at(k) - best(k)).abs() / range;
                agreement.beyond += usize::from(deviation.is_nan() || deviation > ALLOWED);
                if deviation.is_nan() || deviation > agreement.worst {
                    agreement.worst = deviation;
                    agreement.variable = format!("d({name})/d({}) at {time}", parameter.name);
                }
            }
        }
    }
    Some(agreement)
}

#[test]
fn models_of_the_single_acting_drive_agree_with_differences() {
    check(&|file| file.contains("single_acting_drive"));
}

#[test]
fn other_models_agree_with_differences() {
    check(&|file| !file.contains("single_acting_drive"));
}

/// Compares the models of these files.
fn check(is_wanted: &dyn Fn(&str) -> bool) {
    let (mut models, mut compared, mut beyond, mut failures) = (0, 0, 0, Vec::new());
    for file in model_files().into_iter().filter(|file| is_wanted(file)) {
        let compilation = compile_file(&file, &[], Goal::Run);
        let Some(model) = compilation.model.as_ref() else { continue };
        let mut system = model.instantiate();
        if system.structure().unknowns > MOST_UNKNOWNS || system.bind(0.0).is_err() {
            continue;
        }
        let experiment = &compilation.flat.as_ref().expect("flattened").experiment;
        let (start, stop) = (experiment.start.unwrap_or(0.0), experiment.stop.unwrap_or(1.0));
        let plain =
            Options { intervals: 100, event_rows: false, ..Options::new(start, stop).with_tolerance(TOLERANCE) };
        let all = parameters(&system);
        let wanted = if system.structure().delays.is_empty() { PARAMETERS } else { PARAMETERS_WITH_DELAYS };
        let chosen: Vec<&Parameter> = all.iter().step_by(all.len().div_ceil(wanted).max(1)).collect();
        if chosen.is_empty() {
            continue;
        }
        let names = chosen.iter().map(|parameter| parameter.name.clone()).collect();
        let mut exact = Trajectory::new();
        let options = Options { sensitivity: names, ..plain.clone() };
        let result = simulate(&mut system, &options, &mut exact, &|| false);
        result.unwrap_or_else(|error| panic!("{file}: {error}"));
        models += 1;
        for parameter in chosen {
            let Some(agreement) = compare(&compilation, &plain, parameter, &exact) else { continue };
            compared += agreement.compared;
            beyond += agreement.beyond;
            println!(
                "{file} {}: {:.1e} ({}) of {} values, {} beyond, {} left out",
                parameter.name,
                agreement.worst,
                agreement.variable,
                agreement.compared,
                agreement.beyond,
                agreement.left_out
            );
            if agreement.worst > WORST {
                failures.push(format!("{file}: {} deviates by {:.1e}", agreement.variable, agreement.worst));
            }
        }
    }
    println!("{models} models, {compared} values, {beyond} of them beyond {ALLOWED:e}");
    assert!(beyond as f64 <= (1.0 - SHARE) * compared as f64, "{beyond} of {compared} values deviate");
    assert!(models > 4 && compared > 5000, "{models} models, {compared} values");
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
