//! Derivatives of the residuals by what a measuring chain does, against differences of the residuals; and masks around a time.
//!
//! Offsets, gains and the shift of a record have columns of their own that need no run of the model; the delay of a
//! trigger that moves the machine's own times has one from sensitivities.  A recorded set is compared with the drive at
//! numbers drawn at random; correlated noise makes neighbouring rows hang together.

use std::fs;

use hyd::LibraryPath;
use hyd_compiler::Sources;
use hyd_discovery::{Bench, Meaning, Problem, Setup, Study, Weighing, Workshop};
use hyd_tests::models::{root, text_of};

/// Set B01 with a study and a change of its text.
fn setup(study: &str, change: impl Fn(&str) -> String) -> Setup {
    let study = Study::parse(study).expect("a study");
    let folder = root().join("tests/data/bench");
    let mut read = |file: &str| Ok(fs::read_to_string(folder.join(file)).expect("readable"));
    let text = change(&text_of("tests/data/bench/B01.json"));
    let bench = Bench::parse(&folder.join("B01.json"), &text, &study, &mut read).expect("a set");
    Setup::new(study, bench, 2).expect("they fit")
}

/// What the tests do with the problem of the drive and set B01 under a study: how it is weighed, and numbers drawn at random.
fn with_problem(study: &str, work: impl Fn(&Setup, &Problem<'_>, &Weighing, &[f64])) {
    let mut setup = setup(study, str::to_string);
    // As if the record before the trigger had shown it.
    setup.data.channels.iter_mut().for_each(|channel| channel.noise.rho = 0.4);
    let model_file = root().join("models/single_acting_drive/drive.hyd");
    let text = text_of("models/single_acting_drive/drive.hyd");
    let sources = || -> Box<dyn Sources> {
        let mut library = LibraryPath::new();
        library.add_main_file(&model_file, &text);
        Box::new(library)
    };
    let workshop = Workshop {
        starts: Vec::new(),
        study: "bench.toml".to_string(),
        sources: &sources,
        preamble: if text.starts_with("within") { String::new() } else { text.clone() },
        file: model_file.display().to_string(),
        class: "SingleActingDrive.Drive".to_string(),
        channels: setup.expressions(),
        driven: setup.driven(),
        library_classes: [].into(),
        opaque: None,
        others: hyd_discovery::OtherFiles::default(),
    };
    let model = workshop.translate(&[]).expect("a model");
    let machine = setup.machine(model).expect("a machine");
    let problem = setup.problem(&machine, &[]).expect("a problem");
    let weighing = Weighing { horizon: 0.6, ..Weighing::whole(&setup.train, 0.5) };
    let xi: Vec<f64> = (0..problem.unknowns.len()).map(|k| (1.7 * k as f64).sin()).collect();
    work(&setup, &problem, &weighing, &xi);
}

fn is_late(problem: &Problem<'_>, k: usize) -> bool {
    matches!(problem.unknowns[k].meaning, Meaning::Late { .. })
}

#[test]
fn columns_of_the_measuring_chain_are_those_of_differences() {
    let study = text_of("models/single_acting_drive/bench.toml");
    let shifted = study.replace("trigger_moves", "# trigger_moves");
    assert_ne!(study, shifted);
    with_problem(&shifted, |setup, problem, weighing, xi| {
        let runs = problem.simulate(xi, weighing).expect("runs");
        let chain: Vec<usize> = (0..xi.len()).filter(|&k| !problem.unknowns[k].is_simulated()).collect();
        let late = |k: usize| is_late(problem, k);
        assert!(chain.iter().any(|&k| late(k)) && chain.iter().filter(|&&k| !late(k)).count() >= 8);
        let columns = problem.jacobian((xi, &runs), weighing, &chain, 0.05).expect("a Jacobian");
        for (column, &k) in chain.iter().enumerate() {
            let moved = |by: f64| {
                let mut xi = xi.to_vec();
                xi[k] += by;
                problem.residuals(&xi, &runs, weighing)
            };
            // Residuals are linear in offsets and gains; in a delay they are piecewise cubic.
            let step = if late(k) { 1e-4 } else { 1e-2 };
            let differences = (moved(step) - moved(-step)) / (2.0 * step);
            let name = &problem.unknowns[k].name;
            let unlike = (columns.column(column) - &differences).amax() / differences.amax().max(f64::MIN_POSITIVE);
            let touched = setup.train.iter().any(|&shot| problem.unknowns[k].touches(shot));
            assert_eq!(differences.amax() > 0.0, touched, "{name}");
            if touched {
                assert!(unlike < if late(k) { 2e-3 } else { 1e-9 }, "{name}: {unlike:e}");
            } else {
                assert_eq!(columns.column(column).amax(), 0.0, "{name}");
            }
        }
    });
}

#[test]
fn a_trigger_that_moves_the_machine_has_the_columns_of_differences_of_runs() {
    // So exact that differences show more than what steps of the solver leave.
    let study = text_of("models/single_acting_drive/bench.toml") + "\n[run]\ntolerance = 1e-10\n";
    with_problem(&study, |setup, problem, weighing, xi| {
        let runs = problem.simulate(xi, weighing).expect("runs");
        let late: Vec<usize> = (0..xi.len()).filter(|&k| is_late(problem, k)).collect();
        assert_eq!(late.len(), setup.data.shots.len());
        let columns = problem.jacobian((xi, &runs), weighing, &late, 0.05).expect("a Jacobian");
        for (column, &k) in late.iter().enumerate() {
            let moved = |by: f64| {
                let mut xi = xi.to_vec();
                xi[k] += by;
                problem.residuals(&xi, &problem.simulate(&xi, weighing).expect("runs"), weighing)
            };
            let differences = (moved(0.02) - moved(-0.02)) / (2.0 * 0.02);
            let unlike = (columns.column(column) - &differences).norm() / differences.norm().max(f64::MIN_POSITIVE);
            let touched = setup.train.iter().any(|&shot| problem.unknowns[k].touches(shot));
            let name = &problem.unknowns[k].name;
            assert!(if touched { unlike < 1e-3 } else { unlike == 0.0 }, "{name}: {unlike:e}");
        }
    });
}

#[test]
fn samples_around_a_time_do_not_count() {
    let study = text_of("models/single_acting_drive/bench.toml");
    let with = setup(&study, str::to_string);
    let begin = study.find("masks =").expect("masks");
    let end = begin + study[begin..].find("\n[").unwrap_or(study.len() - begin);
    let without = setup(&format!("{}{}", &study[..begin], &study[end..]), str::to_string);
    let current = with.data.channel("i_A").expect("the current");
    for (shot, (own, all)) in with.bench.shots.iter().zip(with.data.shots.iter().zip(&without.data.shots)) {
        let (on, pulse) = (shot.conditions["trigger_time_s"], shot.conditions["pulse_s"]);
        let mut masked = 0;
        for (channel, (trace, before)) in own.traces.iter().zip(&all.traces).enumerate() {
            let (Some(trace), Some(before)) = (trace, before) else { continue };
            for (k, &time) in own.times.iter().enumerate() {
                let is_near = channel == current && [on, on + pulse].iter().any(|at| (time - at).abs() <= 1.1e-4);
                assert_eq!(trace.used[k], before.used[k] && !is_near, "channel {channel} at {time}");
                masked += usize::from(is_near);
            }
        }
        assert!(masked >= 4, "{masked} samples at 20 kHz");
    }
}

#[test]
fn a_mask_around_a_time_needs_a_width() {
    let study = text_of("models/single_acting_drive/bench.toml");
    for (from, to) in
        [("within = 1.1e-4", "within = 0.0"), (", within = 1.1e-4", ""), ("1.1e-4", "-1e-4"), ("1.1e-4", "nan")]
    {
        let text = study.replace(from, to);
        assert_ne!(text, study);
        let fault = Study::parse(&text).expect_err(to).to_string();
        assert!(fault.contains("`within`"), "{fault}");
    }
}
