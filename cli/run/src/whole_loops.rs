//! What is said where rounding errors grow along a loop of equations whose variables are computed one after the other.

/// What has happened.
pub const WHOLE_LOOPS: &str = "rounding errors grew along a loop of equations";
/// How it was put right.
pub const DONE_AGAIN: &str = "done again with all variables of the loops as unknowns of the solver";
/// What is said of so many runs that were done again.
pub fn runs_done_again(count: usize) -> String {
    let (runs, were) = if count == 1 { ("1 run".to_string(), "was") } else { (format!("{count} runs"), "were") };
    format!("{WHOLE_LOOPS} in {runs}, which {were} {DONE_AGAIN}")
}
/// What the user of an executable can do, where no compiler is at hand.
pub const REBUILD: &str = "rounding errors may have grown along a loop of equations with these values of the parameters; an executable made \
                           by `hyd build --whole-loops` takes all variables of the loops as unknowns of the solver";
