//! Many seeds on all cores: how many models were clear, and the differences, made smaller.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use hyd_differential::generate::model;
use hyd_differential::shrink::shrink;

use crate::compare::{CHECKS, Check, Difference, Verdict, check, reference};

/// Differences that are made smaller and told; more of them say little.
const MOST: usize = 8;

/// What a hunt found.
#[derive(Default)]
pub(crate) struct Bag {
    /// Models that were compared.
    pub compared: usize,
    /// Models that were not clear, with the reasons.
    pub unclear: Vec<String>,
    /// Reports of differences.
    pub reports: Vec<String>,
    /// All of them, those not told included.
    pub differences: usize,
}

/// What differs for a seed.
fn first_difference(seed: u64) -> Result<Option<(Check, Difference)>, String> {
    let model = model(seed);
    let known = reference(&model).ok();
    for way in CHECKS {
        match check(&model, way, known.as_ref()) {
            Verdict::Same => {}
            // With other values it may be that another model is not clear.
            Verdict::Unclear(_) if way == Check::Set => {}
            Verdict::Unclear(reason) => return Err(reason),
            Verdict::Different(difference) => return Ok(Some((way, difference))),
        }
    }
    Ok(None)
}

/// The report of a difference, as small as it gets.
fn report(seed: u64, way: Check, found: &Difference) -> String {
    let whole = model(seed);
    let mut last = found.clone();
    shrink(&whole, &mut |candidate| match check(candidate, way, None) {
        Verdict::Different(difference) if difference.kind == last.kind => {
            last = difference;
            true
        }
        _ => false,
    });
    format!("seed {seed}, {way:?}: {}\n{}\n{}", last.kind, last.details, last.text)
}

/// Compares the models of so many seeds from the first one.
pub(crate) fn hunt(first: u64, count: u64) -> Bag {
    let (next, bag) = (AtomicU64::new(first), Mutex::new(Bag::default()));
    let kinds = Mutex::new(Vec::<String>::new());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= first + count {
                return;
            }
            let found = first_difference(seed);
            let mut told = None;
            if let Ok(Some((way, difference))) = &found {
                let told_enough = {
                    let mut kinds = kinds.lock().expect("no thread panics with it");
                    kinds.push(difference.kind.clone());
                    kinds.len() > MOST
                };
                told = (!told_enough).then(|| report(seed, *way, difference));
            }
            let mut bag = bag.lock().expect("no thread panics with it");
            match found {
                Err(reason) => bag.unclear.push(format!("seed {seed}: {reason}")),
                Ok(None) => bag.compared += 1,
                Ok(Some((way, difference))) => {
                    bag.compared += 1;
                    bag.differences += 1;
                    let first = difference.details.lines().next().unwrap_or_default();
                    bag.reports
                        .push(told.unwrap_or_else(|| format!("seed {seed}, {way:?}: {}: {first}", difference.kind)));
                }
            }
        }
    };
    std::thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    bag.into_inner().expect("no thread panics with it")
}
