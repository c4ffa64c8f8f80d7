//! Every error code of the table is expected by at least one case: a code that no text can bring out would be dead.
//!
//! Codes are read from the comments of the cases as `case.rs` reads them; a failed run, `// run error: PART`, has the code
//! E0601 (`hyd simulate` prints it so).  What cases of texts cannot show stands in a short list with the reason.

use std::collections::BTreeSet;

use hyd_compiler::Code;

use crate::case::{Expected, folder, texts};

/// Codes without a case, and why.
const WITHOUT_A_CASE: &[(&str, &str)] = &[
    ("W0203", "versions stand in the names of folders; tests/tests/cli/command.rs brings it out"),
    ("E0215", "names are given on the command line, not in texts; tests/cases/bad_input/set_unknown.hyd brings it out"),
    (
        "E0406",
        "terms are added by studies and by programs, not by texts; tests/tests/numerics/injection.rs brings it out",
    ),
    ("E0501", "a machine without code generator or a fault of this compiler; no text leads to it"),
];

#[test]
fn every_code_is_expected_by_a_case() {
    let expected = codes();
    let table: BTreeSet<&str> = Code::ALL.iter().map(|code| code.number()).collect();
    let without: BTreeSet<&str> = WITHOUT_A_CASE.iter().map(|&(code, _)| code).collect();
    assert!(WITHOUT_A_CASE.iter().all(|(code, reason)| table.contains(code) && !reason.is_empty()));
    let missing: Vec<&&str> =
        table.iter().filter(|code| !expected.contains(**code) && !without.contains(*code)).collect();
    assert!(missing.is_empty(), "no case expects {missing:?}");
    let shown: Vec<&&str> = without.iter().filter(|code| expected.contains(**code)).collect();
    assert!(shown.is_empty(), "{shown:?} has a case now; take it off the list");
    let unknown: Vec<&String> = expected.iter().filter(|code| !table.contains(code.as_str())).collect();
    assert!(unknown.is_empty(), "not in the table: {unknown:?}");
}

/// Codes that the cases of all topics expect.
fn codes() -> BTreeSet<String> {
    let mut codes = BTreeSet::new();
    for (file, text) in texts(&folder("language")) {
        let mut expected = Expected::default();
        expected.read(&file.display().to_string(), &text);
        let said = expected.said.iter().filter_map(|(_, _, text)| text.split([' ', ':']).nth(1));
        codes.extend(said.map(str::to_string));
        codes.extend(expected.run_error.map(|_| Code::Run.number().to_string()));
    }
    codes
}
