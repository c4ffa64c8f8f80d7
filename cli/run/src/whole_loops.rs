//! What is said where a loop of equations cannot be solved one variable after the other: rounding errors grow along it, or no values are
//! found after an event.

/// What has happened.
pub const WHOLE_LOOPS: &str = "a loop of equations could not be solved one variable after the other";
/// How it was put right.
pub const DONE_AGAIN: &str = "done again with all variables of the loops as unknowns of the solver";
/// What is said where an executable or a unit is made so at once.
pub const BUILT_WHOLE: &str = "at the start a loop of equations cannot be solved one variable after the other: built as `--whole-loops` does, with all variables of \
                               the loops as unknowns of the solver";
/// What is said of so many runs that were done again.
pub fn runs_done_again(count: usize) -> String {
    let (runs, were) = if count == 1 { ("1 run".to_string(), "was") } else { (format!("{count} runs"), "were") };
    format!("{WHOLE_LOOPS} in {runs}, which {were} {DONE_AGAIN}")
}
/// What the user of an executable can do, where no compiler is at hand.
pub const REBUILD: &str = "a loop of equations may be one that cannot be solved one variable after the other with these values of the parameters; an executable made \
                           by `hyd build --whole-loops` takes all variables of the loops as unknowns of the solver";
