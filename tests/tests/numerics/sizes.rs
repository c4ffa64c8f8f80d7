//! Sizes of states without nominal values: what a tolerance means does not depend on the unit that a motion is written in.

use hyd_compiler::{Compilation, Goal, Options as Translation, compile};
use hyd_results::Trajectory;
use hyd_runtime::{Options, Simulator};
use hyd_system::DaeSystem;
use hyd_tests::models::messages;

fn translate(text: &str) -> Compilation {
    let options = Translation { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut hyd::LibraryPath::new(), "m.mo", text, &options);
    assert!(compilation.model.is_some(), "{}", messages(&compilation));
    compilation
}

/// Values of a variable at the end of a run over 1 s, and the steps it took.
fn end(text: &str, tolerance: f64, name: &str) -> (f64, u64) {
    let compilation = translate(text);
    let model = compilation.model.as_ref().expect("translated");
    let mut system = model.instantiate();
    let options = Options::new(0.0, 1.0).with_tolerance(tolerance);
    let mut rows = Trajectory::new();
    let mut simulator = Simulator::new(&system.structure().clone());
    simulator.run(&mut system, &options, &mut rows, &|| false).expect("it runs");
    let tables = system.tables().clone();
    let (variable, element) = tables.find(name).expect("recorded");
    let hyd_system::Place::Output(place) = variable.sources[element].place else { panic!("{name} is not an output") };
    (rows.row(rows.len() - 1)[place as usize], simulator.statistics().steps)
}

/// Five turns of an oscillator of this amplitude, with something beside it.
fn oscillator(amplitude: f64, beside: &str) -> String {
    let (declared, equations) = beside.split_once('|').unwrap_or_default();
    format!(
        "model Oscillator\n  Real x(start = {amplitude:e}, fixed = true);\n  Real v(start = 0, fixed = true);\n  {declared}\nequation\n  \
         der(x) = 31.4*v;\n  der(v) = -31.4*x;\n  {equations}\nend Oscillator;\n"
    )
}

fn relative_error(amplitude: f64, tolerance: f64) -> f64 {
    let (x, _) = end(&oscillator(amplitude, ""), tolerance, "x");
    (x / amplitude - 31.4_f64.cos()).abs()
}

#[test]
fn a_motion_of_millimetres_is_as_exact_as_one_of_metres() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let large =
            [0.5, 1.0, 2.0].map(|amplitude| relative_error(amplitude, tolerance)).into_iter().fold(0.0, f64::max);
        for amplitude in [4e-3, 1e-2, 0.1] {
            let small = relative_error(amplitude, tolerance);
            // With a size of 1 the smallest would be wrong by 200 times as much.
            assert!(small < 3.0 * large, "{amplitude} at {tolerance:e}: {small:e} beside {large:e}");
        }
    }
}

/// A state that nothing but rounding moves does not keep steps short, nor does one that has moved long ago: beside runs in which its size
/// is stated to be 1.
#[test]
fn a_state_at_rest_costs_nothing() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let noise = ("der(z) = (0.1*x + 1 - 1 - 0.1*x) - 100*z;", 0.0, 1.02);
        let gone = ("der(z) = -1000*z;", 1e-3, 1.6);
        for (equation, start, more) in [noise, gone] {
            let steps = |size: &str| {
                let beside = format!("Real z(start = {start:e}, fixed = true{size});|{equation}");
                end(&oscillator(1.0, &beside), tolerance, "x").1 as f64
            };
            let (learned, stated) = (steps(""), steps(", nominal = 1"));
            assert!(learned < more * stated, "{equation} at {tolerance:e}: {learned} steps, {stated} with a size of 1");
        }
    }
}

#[test]
fn arrays_have_one_size_and_stated_ones_stay() {
    let text = "model M\n  model Part\n    Real p(start = 0, fixed = true);\n    Real s(start = 0, fixed = true, nominal = 1);\n  equation\n    \
                der(p) = 1;\n    der(s) = p;\n  end Part;\n  Real y;\n  Real a[3](each start = 0, each fixed = true);\n  Part part[2];\n  \
                Real b(start = 0, fixed = true);\nequation\n  der(a) = {1, b, y};\n  der(b) = y;\n  exp(y) + y = 2 + b;\nend M;\n";
    let compilation = translate(text);
    let system = compilation.model.as_ref().expect("translated").instantiate();
    let name = |unknown: u32| system.tables().unknown_name(unknown as usize);
    let mut groups: Vec<(u32, String)> =
        system.structure().sizes.iter().map(|size| (size.group, name(size.unknown))).collect();
    groups.sort();
    let mut lists: Vec<Vec<&str>> =
        groups.chunk_by(|a, b| a.0 == b.0).map(|own| own.iter().map(|(_, name)| name.as_str()).collect()).collect();
    lists.sort();
    assert_eq!(lists, [vec!["a[1]", "a[2]", "a[3]"], vec!["b"], vec!["part[1].p", "part[2].p"]]);
}
