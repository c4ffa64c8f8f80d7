//! What can still be set on a translated model, and that it acts: values yes, sizes no, and a scale fixes nothing.

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile};
use hyd_results::Trajectory;
use hyd_runtime::simulate;
use hyd_system::{DaeSystem, Settable};
use hyd_tests::models::messages;
use hyd_tests::runs::{instance, on_grid};

const TEXT: &str = "model Scaled
  parameter Real p0 = 2;
  parameter Real scale = 3*p0;
  parameter Integer n = 2;
  Real x[n](each start = 1, each fixed = true, each nominal = scale);
equation
  for k in 1:n loop
    der(x[k]) = -p0*x[k];
  end for;
end Scaled;
";

fn translated(set: &[(&str, &str)]) -> Compilation {
    let set = set.iter().map(|&(name, value)| (name.to_string(), value.to_string())).collect();
    let options = Options { model: None, set, goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut LibraryPath::new(), "scaled.hyd", TEXT, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    compilation
}

fn end(compilation: &Compilation, set: &[(&str, &str)]) -> f64 {
    let mut system = instance(compilation, set);
    let mut rows = Trajectory::new();
    simulate(&mut system, &on_grid(1.0, 10, 1e-11), &mut rows, &|| false).expect("runs");
    *rows.series("x[2]").expect("a variable").values().last().expect("rows")
}

#[test]
fn a_parameter_in_nominal_stays_settable() {
    let compilation = translated(&[]);
    let system = instance(&compilation, &[]);
    let settable = |name: &str| system.tables().find(name).expect("a parameter").0.settable.clone();
    assert_eq!(settable("p0"), Settable::Yes);
    assert_eq!(settable("n"), Settable::Structural);
    // x = exp(-p0 t)
    assert!((end(&compilation, &[]) - (-2.0_f64).exp()).abs() < 1e-8);
    assert!((end(&compilation, &[("p0", "5")]) - (-5.0_f64).exp()).abs() < 1e-8);
}

/// A value stated before translation enters the scale and is set on the model all the same.
#[test]
fn a_value_set_before_translation_is_not_fixed_by_a_scale() {
    let set = [("p0", "5"), ("n", "3")];
    let compilation = translated(&set);
    assert_eq!(compilation.set_at_translation, ["n"]);
    let flat = compilation.flat.as_ref().expect("flat");
    let x = flat.variables.iter().find(|block| &*block.name.parts[0].0 == "x").expect("a variable");
    assert_eq!(x.nominal, hyd_flat::model::PerElement::All(Some(15.0)));
    assert!((end(&compilation, &set) - (-5.0_f64).exp()).abs() < 1e-8);
}
