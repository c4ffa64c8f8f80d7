//! Every model of the repository, built and run where nothing of the repository can be reached, gives the bytes of `hyd simulate`.

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use hyd_compiler::Goal;
use hyd_payload::{executable, format};
use hyd_run::{Beside, Facts, Names, RunArguments};
use hyd_system::{Place, Settable, Tables, ValueKind};
use hyd_tests::models::{compile_file, model_files, root};

use super::scratch::{Scratch, messages};

/// The launcher without symbols would do the same; it is read once.
fn launcher() -> Vec<u8> {
    fs::read(env!("CARGO_BIN_EXE_hyd-launcher-under-test")).unwrap()
}

fn arguments(result: &Path, sensitivity: Option<Names>) -> RunArguments {
    RunArguments { sensitivity, result: Some(result.to_path_buf()), ..RunArguments::default() }
}

/// What differs for one model; nothing if all is well.
fn check(file: &str, launcher: &[u8]) -> Result<(), String> {
    let compilation = compile_file(file, &[], Goal::Run);
    // Files that hold parts only are not models.
    let Some(model) = &compilation.model else { return Ok(()) };
    let scratch = Scratch::new();
    let payload = format::write(&model.stored().unwrap());
    let program = scratch.file("model");
    fs::write(&program, executable::join(launcher, &payload)).unwrap();
    #[cfg(unix)]
    fs::set_permissions(&program, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    for varied in [None, Some(varied(model.tables()))] {
        let given = varied.as_ref().map(|names| names.join(","));
        if given.as_ref().is_some_and(String::is_empty) {
            continue;
        }
        let own = arguments(&scratch.file("own.csv"), varied.map(Names));
        let options = hyd_run::options(&own, &model.payload().experiment).unwrap();
        let quiet = Beside { drawn: false, into: None, only_shown: false, stop: &|| false, progress: false };
        let ran = hyd_run::simulate(&mut model.instantiate(), &own, &options, Facts::default(), quiet);
        let wanted: Vec<&str> = given.iter().flat_map(|names| ["--sensitivity", names.as_str()]).collect();
        let output = scratch.bare("model", &[&["--result", "exe.csv"], wanted.as_slice()].concat());
        let ran_well = ran.as_ref().is_ok_and(|ran| ran.result.is_ok());
        if ran_well != output.status.success() {
            let reason = ran.map(|ran| ran.result.err());
            return Err(format!("{file} {given:?}: {reason:?}, and the executable: {}", messages(&output)));
        }
        let read = |name: &str| fs::read(scratch.file(name)).map_err(|error| format!("{file}: {name}: {error}"));
        if ran_well && read("own.csv")? != read("exe.csv")? {
            return Err(format!("{file} {given:?}: the results differ"));
        }
    }
    Ok(())
}

/// A few parameters, and start values of states.
fn varied(tables: &Tables) -> Vec<String> {
    let (mut parameters, mut starts) = (Vec::new(), Vec::new());
    for (k, variable) in tables.variables.iter().enumerate().filter(|(_, info)| info.kind == ValueKind::Real) {
        for (element, source) in variable.sources.iter().enumerate() {
            let name = variable.name.element(element);
            match source.place {
                Place::Parameter(_) if variable.settable == Settable::Yes => parameters.push(name),
                Place::Output(_) if tables.unknowns.contains(&(k as u32, element as u32)) => starts.push(name),
                _ => {}
            }
        }
    }
    let third = parameters.len().div_ceil(3).max(1);
    parameters.into_iter().step_by(third).chain(starts.into_iter().take(1)).collect()
}

#[test]
fn every_model_runs_alone_and_gives_the_same_bytes() {
    let (files, launcher) = (model_files(), launcher());
    let (next, wrong) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Err(reason) = check(file, &launcher) {
                        wrong.lock().unwrap().push(reason);
                    }
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The same by the commands, from text to result, in both formats that executables stream.
#[test]
fn the_commands_agree_for_the_drive() {
    let scratch = Scratch::new();
    let file = root().join("models/single_acting_drive/drive.hyd");
    let file = file.to_str().unwrap();
    for result in ["a.csv", "a.mat"] {
        let output = scratch.hyd(&["simulate", file, "--result", result, "--set", "p0=15e6", "--stop", "0.01"]);
        assert!(output.status.success(), "{}", messages(&output));
    }
    let output = scratch.hyd(&["build", file, "-o", "drive"]);
    assert!(output.status.success(), "{}", messages(&output));
    for (result, own) in [("b.csv", "a.csv"), ("b.mat", "a.mat")] {
        let output = scratch.bare("drive", &["--result", result, "--set", "p0=15e6", "--stop", "0.01"]);
        assert!(output.status.success(), "{}", messages(&output));
        assert!(fs::read(scratch.file(result)).unwrap() == fs::read(scratch.file(own)).unwrap(), "{result}");
    }
    // The interpreter of the same program: the same operations in the same order.
    let output = scratch.bare("drive", &["--result", "c.csv", "--set", "p0=15e6", "--stop", "0.01", "--backend", "vm"]);
    assert!(output.status.success(), "{}", messages(&output));
    assert!(fs::read(scratch.file("c.csv")).unwrap() == fs::read(scratch.file("b.csv")).unwrap());
}
