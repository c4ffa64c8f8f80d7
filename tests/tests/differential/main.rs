//! Models at random, computed in ways that share as little as possible.
//!
//! `hyd-differential` makes a model, writes its text and computes it directly, without the product.  The product translates
//! the text and runs it as machine code, by the interpreter and out of the bytes of an executable; it translates other
//! texts that mean the same (loops written out, parameters as constants) and takes parameters from outside.  A difference is
//! made smaller and shown as a text.
//!
//! `HYD_DIFFERENTIAL=SEED:COUNT cargo test -p hyd-tests --test differential --release seeds -- --nocapture` compares so many
//! models from a seed; without it the test takes the same 200 every time.
#![allow(clippy::unwrap_used)]

mod compare;
mod hunt;
mod meanings;
mod processes;
mod ways;

/// Models of the usual run.
const USUAL: (u64, u64) = (1, 200);

/// Seed and number of models.
fn asked() -> (u64, u64) {
    let Ok(text) = std::env::var("HYD_DIFFERENTIAL") else { return USUAL };
    let numbers = text.split_once(':').and_then(|(seed, count)| Some((seed.parse().ok()?, count.parse().ok()?)));
    numbers.unwrap_or_else(|| panic!("HYD_DIFFERENTIAL is SEED:COUNT, not `{text}`"))
}

#[test]
fn seeds() {
    let (first, count) = asked();
    let bag = hunt::hunt(first, count);
    println!("{} models compared, {} not clear, {} differ", bag.compared, bag.unclear.len(), bag.differences);
    if std::env::var_os("HYD_DIFFERENTIAL").is_some() {
        bag.unclear.iter().for_each(|line| println!("not clear: {line}"));
    }
    assert!(bag.reports.is_empty(), "{} models differ\n\n{}", bag.differences, bag.reports.join("\n\n"));
    assert!(bag.compared * 10 >= count as usize * 7, "too few models are clear: {}", bag.unclear.join("\n"));
}

#[test]
fn executables() {
    processes::executables(500, 6);
}

#[test]
fn sweeps() {
    processes::sweeps(600, 5);
}

/// Statements mean the same over values, over nodes and as steps.
#[test]
fn functions_in_three_ways() {
    let (first, count) = asked();
    let (compared, different) = meanings::compare(first, count);
    println!("{compared} calls compared, {} differ", different.len());
    assert!(different.is_empty(), "{}", different.join("\n\n"));
    assert!(compared * 2 >= 3 * count as usize, "too few calls: {compared}");
}
