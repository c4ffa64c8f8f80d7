//! Outputs that are evaluated without the others have the bits that they have with them, and what is not evaluated is still looked at now and
//! then.

use hyd_compiler::{Compilation, Goal, Options as Translation, compile};
use hyd_payload::Backend;
use hyd_results::Trajectory;
use hyd_runtime::{Options, SolveError, simulate};
use hyd_system::DaeSystem;
use hyd_tests::models::{compile_file, messages, model_files};

/// Every how manieth output is wanted, beginning with which.
const CHOICES: [(u32, u32); 4] = [(7, 3), (40, 0), (1000, 5), (3, 1)];

fn translate(text: &str) -> Compilation {
    let options = Translation { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut hyd::LibraryPath::new(), "m.mo", text, &options);
    assert!(compilation.model.is_some(), "{}", messages(&compilation));
    compilation
}

fn options_of(compilation: &Compilation) -> Options {
    let experiment = compilation.model.as_ref().expect("translated").payload().experiment;
    let stop = experiment.stop.unwrap_or(1.0).min(1.0);
    let mut options = Options::new(experiment.start.unwrap_or(0.0), stop).with_tolerance(1e-4);
    options.intervals = 40;
    options
}

/// Runs to the end or to what fails; both have the same rows, and the wanted outputs the same bits.
fn agree(file: &str, system: &mut dyn DaeSystem, options: &Options, wanted: &[u32]) -> usize {
    let mut all = Trajectory::new();
    let whole = simulate(system, options, &mut all, &|| false);
    let mut some = Trajectory::new();
    let options = Options { needed_outputs: Some(wanted.to_vec()), ..options.clone() };
    let part = simulate(system, &options, &mut some, &|| false);
    assert_eq!(whole.is_ok(), part.is_ok(), "{file}: {whole:?} and {part:?}");
    assert_eq!(all.len(), some.len(), "{file}");
    for k in 0..all.len() {
        for &output in wanted {
            let (left, right) = (all.row(k)[output as usize], some.row(k)[output as usize]);
            assert_eq!(left.to_bits(), right.to_bits(), "{file}: output {output} of row {k}, {left} and {right}");
        }
    }
    all.len() * wanted.len()
}

#[test]
fn outputs_have_the_same_bits_without_the_others() {
    let (mut compared, mut partly) = (0, 0);
    for file in model_files() {
        let compilation = compile_file(&file, &[], Goal::Run);
        let Some(model) = &compilation.model else { continue };
        let options = options_of(&compilation);
        for backend in [Backend::Native, Backend::Vm] {
            let mut system = model.on(backend).expect("both backends run it").instantiate();
            for (every, first) in CHOICES {
                let wanted: Vec<u32> = (first..system.structure().outputs as u32).step_by(every as usize).collect();
                partly += usize::from(DaeSystem::find_excerpt(&mut system, &wanted).is_some());
                compared += agree(&file, &mut system, &options, &wanted);
                if backend == Backend::Vm {
                    break;
                }
            }
        }
    }
    println!("{compared} values, {partly} choices that save work");
    assert!(compared > 100_000 && partly > 40, "{compared} values, {partly} choices");
}

/// Rows within steps: what follows from states, from algebraic unknowns and from rates, with events between.
#[test]
fn rows_within_steps_have_the_same_bits() {
    let text = "model M\n  Real x(start = 1, fixed = true);\n  Real v(start = 0, fixed = true);\n  Real z(start = 1);\n  Real a = 2*x + 1;\n  Real b = exp(z) - x;\n  \
        Real c = sin(der(v)) + 1;\n  Real d[20];\n  discrete Real n(start = 0, fixed = true);\nequation\n  der(x) = v;\n  der(v) = -40*x - z;\n  z + 0.3*tanh(z) = x*v;\n  \
        for i in 1:20 loop\n    d[i] = cos(i*x) + v;\n  end for;\n  when x < 0 then\n    n = pre(n) + a;\n  end when;\nend M;\n";
    let compilation = translate(text);
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    let tables = system.tables().clone();
    let at = |name: &str| {
        let (variable, element) = tables.find(name).expect("a variable");
        match variable.sources[element].place {
            hyd_system::Place::Output(k) => k,
            _ => panic!("{name} varies"),
        }
    };
    let all = Options { within_steps: true, ..options_of(&compilation) };
    let mut whole = Trajectory::new();
    simulate(&mut system, &all, &mut whole, &|| false).expect("runs");
    assert!(whole.len() > 200, "{} rows", whole.len());
    for names in [&["x"][..], &["a"], &["b"], &["c"], &["z"], &["der(v)"], &["n"], &["a", "d[7]"], &["b", "n", "v"]] {
        let wanted: Vec<u32> = names.iter().map(|name| at(name)).collect();
        let options = Options { needed_within: Some(wanted.clone()), ..all.clone() };
        let mut part = Trajectory::new();
        simulate(&mut system, &options, &mut part, &|| false).expect("runs");
        assert_eq!(whole.len(), part.len());
        for (k, &output) in (0..whole.len()).flat_map(|k| wanted.iter().map(move |output| (k, output))) {
            let (left, right) = (whole.row(k)[output as usize], part.row(k)[output as usize]);
            assert_eq!(left.to_bits(), right.to_bits(), "{names:?}: row {k}, {left} and {right}");
        }
    }
}

#[test]
fn loops_are_cut_to_the_instances_that_are_needed() {
    let text = "model M\n  Real x[3000](each start = 1, each fixed = true);\n  Real y[3000];\n  Real z[3000];\n  Real s;\nequation\n  \
        for i in 1:3000 loop\n    der(x[i]) = -x[i]/i;\n    y[i] = exp(x[i]) + i;\n    z[i] = y[3001 - i]^2;\n  end for;\n  s = sum(z[10:12]);\nend M;\n";
    let compilation = translate(text);
    let model = compilation.model.as_ref().expect("translated");
    let mut system = model.instantiate();
    let tables = system.tables().clone();
    let at = |name: &str| {
        let (variable, element) = tables.find(name).expect("a variable");
        match variable.sources[element].place {
            hyd_system::Place::Output(k) => k,
            _ => panic!("{name} varies"),
        }
    };
    for names in [&["s"][..], &["z[17]", "y[3]"], &["z[3000]"], &["x[5]"], &["y[1]", "y[3000]"]] {
        let mut wanted: Vec<u32> = names.iter().map(|name| at(name)).collect();
        wanted.sort_unstable();
        agree("loops", &mut system, &options_of(&compilation), &wanted);
    }
    assert!(DaeSystem::find_excerpt(&mut system, &[at("s")]).is_some());
    // From the first to the last there is nothing to save.
    let mut ends = [at("z[1]"), at("z[3000]"), at("y[1]"), at("y[3000]")];
    ends.sort_unstable();
    assert!(DaeSystem::find_excerpt(&mut system, &ends).is_none());
}

#[test]
fn what_nobody_asks_for_fails_at_the_end_and_what_is_asked_for_at_once() {
    let text = "model M\n  Real x(start = 0, fixed = true);\n  Real a = sqrt(0.73 - x);\n  Real b = 2*x;\n  Real c = 3*x;\n  Real d = 4*x + 1;\nequation\n  \
        der(x) = 1;\nend M;\n";
    let compilation = translate(text);
    let mut system = compilation.model.as_ref().expect("translated").instantiate();
    let tables = system.tables().clone();
    let mut fails_at = |name: &str| {
        let (variable, element) = tables.find(name).expect("a variable");
        let hyd_system::Place::Output(k) = variable.sources[element].place else { panic!("{name} varies") };
        let options = Options { needed_outputs: Some(vec![k]), ..Options::new(0.0, 1.0) };
        match simulate(&mut system, &options, &mut Trajectory::new(), &|| false) {
            Err(SolveError::Evaluation { time, .. }) => time,
            other => panic!("{name}: {other:?}"),
        }
    };
    assert!((fails_at("a") - 0.732).abs() < 1e-9);
    assert!(fails_at("d") > 0.732);
}
