//! Every pass keeps its promises on every model of the repository.
//!
//! Models of `models`, reference problems and models of N equal parts are translated and what each pass made is checked against
//! its definition: flat model, system without aliases, reduced system, sorted system.

use hyd_compiler::{Compilation, Goal};
use hyd_tests::models::{compile_file, model_files};
use hyd_tests::numerics::problems;
use hyd_tests::scale::{MODELS, translate_to};

/// Passes that the compilation came through and that broke their promise; and how many were checked.
fn faults(compilation: &Compilation) -> (Vec<String>, usize) {
    let results = [
        compilation.flat.as_ref().map(|flat| ("flat", hyd_flat::verify(flat))),
        compilation.system.as_ref().map(|system| ("system", hyd_equations::verify_system(system))),
        compilation.reduced.as_ref().map(|system| ("reduced", hyd_equations::verify_system(system))),
        compilation.sorted.as_ref().map(|sorted| ("sorted", hyd_equations::verify(sorted))),
    ];
    let came = results.iter().flatten().count();
    let faults = results.into_iter().flatten().filter_map(|(pass, result)| Some(format!("{pass}: {}", result.err()?)));
    (faults.collect(), came)
}

#[test]
fn every_pass_on_every_model() {
    let mut report = String::new();
    let (mut models, mut passes) = (0, 0);
    let mut check = |name: &str, compilation: &Compilation| {
        let (faults, came) = faults(compilation);
        models += 1;
        passes += came;
        for fault in faults {
            report += &format!("\n{name}: {fault}");
        }
    };
    for file in model_files() {
        check(&file, &compile_file(&file, &[], Goal::Check));
    }
    for problem in problems() {
        check(&problem.name, &compile_file(&format!("tests/numerics/{}.hyd", problem.name), &[], Goal::Check));
    }
    for model in MODELS {
        check(model, &translate_to(model, 100, Goal::Check));
    }
    assert!(report.is_empty(), "{report}");
    assert!(models > 40 && passes > 3 * models, "{passes} passes on {models} models");
}
