//! Cases that fuzzing has kept, gone through again: nothing panics, nothing is without end, and what must hold of a case does.
//!
//! `tests/corpus` has a folder per target of the fuzz driver with the cases that reach most; `fuzz/README.md` says how they are made.
//! Targets and properties are the driver's own.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use hyd_tests::models::root;

use crate::targets::{self, TARGETS, Target};
use crate::texts;

/// Goes through the cases of a target on a thread with the stack that the program's main thread has.
fn replay(name: &str) {
    let target: &'static Target = TARGETS.iter().find(|target| target.name == name).unwrap();
    let cases = cases(&root().join("tests/corpus").join(name));
    assert!(cases.len() >= 10, "only {} cases of {name}", cases.len());
    let work = move || {
        for (path, case) in cases {
            let call = std::panic::AssertUnwindSafe(|| (target.call)(&case));
            assert!(std::panic::catch_unwind(call).is_ok(), "{path}");
        }
    };
    std::thread::Builder::new().stack_size(8 << 20).spawn(work).unwrap().join().unwrap();
}

fn cases(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = paths.collect();
    paths.sort();
    paths.into_iter().map(|path| (path.display().to_string(), std::fs::read(path).unwrap())).collect()
}

macro_rules! replayed {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                replay(stringify!($name));
            }
        )*

        #[test]
        fn no_target_is_left_out() {
            let mut known = vec![$(stringify!($name)),*];
            let mut all: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
            known.sort_unstable();
            all.sort_unstable();
            assert_eq!(known, all);
        }
    };
}

replayed!(front format doc run results frame payload study);

/// What a target refuses at its door is never looked for in the rooms behind.
#[test]
fn studies_are_put_together_and_compared_with_a_model() {
    let setups: Vec<_> = texts::studies().iter().filter_map(|case| targets::setup(case).ok()).collect();
    let masked = |setup: &&hyd_discovery::Setup| {
        let traces = setup.data.shots.iter().flat_map(|shot| shot.traces.iter().flatten());
        // One sample of a channel is a gap; more are left out by a mask.
        !setup.study.shots.masks.is_empty()
            && traces.into_iter().any(|trace| trace.used.iter().filter(|used| !**used).count() > 1)
    };
    assert!(setups.iter().any(|setup| masked(&setup)), "no mask is reached by {} setups", setups.len());
    let unknowns: Vec<usize> = setups.iter().filter_map(|setup| targets::unknowns(setup).ok()).collect();
    // Three nuisances, offsets and gains of two channels.
    assert!(unknowns.iter().any(|&count| count >= 7), "{unknowns:?}");
}
