//! The language, construct by construct: small models with the values or the messages that they must give.
//!
//! Beside it what the compiler makes of texts: `stdlib` the components of the library, `corpus`, `nesting` and `long_text` texts that nobody
//! writes, `snapshots`, `explain` and `verify` the stages, `templates`, `scale` and `settable` what does not grow and what stays open.
//!
//! A case is a file `tests/language/<topic>/<name>.hyd` (or `.mo`), or a folder of that kind whose main file has the line
//! `// main file`.  What is expected stands in comments:
//!
//! - `// expect: VARIABLE @ TIME = VALUE [rel R] [abs A]`: value after the events of that time; VALUE is a number or a closed
//!   form of numbers, `pi`, `+ - * / ^` and elementary functions.  |x - value| <= R |value| + A, R = 1e-6, A = 1e-9 by default.
//!   TIME is best a multiple of stop/500, where there is an output point.
//! - `// error E0203: MESSAGE` at the end of the faulty line, or on lines of its own directly above it (also `warning`,
//!   `note`).  The message is compared in full, with its code and its line.  Errors and warnings must be listed completely;
//!   notes only if the file lists one.  `// error E0203 without line: MESSAGE` is for messages that mark no text.
//! - `// ok`: translates without errors, runs, nothing else is asked.  `// run error: PART`: the run fails with these words.
//! - `// absent: VARIABLE`: the result has no such variable.  `// stopped at: TIME`: the run ends there by itself.
//! - `// model: NAME`, `// stop: TIME` (default 1), `// set: PARAMETER = VALUE`.

mod case;
mod closed_form;
mod codes;
mod conformance;
mod corpus;
mod explain;
mod long_text;
mod nesting;
mod reference_text;
mod scale;
mod settable;
mod snapshots;
mod source_texts;
mod stdlib;
mod templates;
mod typed_indices;
mod verify;

// Targets and their properties are the fuzz driver's own.
#[path = "../../../fuzz/src/targets.rs"]
#[allow(dead_code)]
mod targets;
#[path = "../../../fuzz/src/texts.rs"]
#[allow(dead_code)]
mod texts;

use case::{Known, folder, run_topic};

/// Cases that state what is wanted and not reached yet.  They must fail: who reaches one takes it off the list.
const KNOWN_OPEN: &[Known] = &[];

macro_rules! topics {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                run_topic(&folder("language"), stringify!($name), KNOWN_OPEN);
            }
        )*

        /// Every folder has a test.
        #[test]
        fn no_topic_is_left_out() {
            let mut known = vec![$(stringify!($name).to_string()),*];
            known.push("conformance".to_string());
            case::check_topics(&folder("language"), &known, KNOWN_OPEN);
        }
    };
}

topics! {
    packages_and_imports inheritance modification redeclaration inner_outer conditional arrays records enumerations
    functions algorithms equations_for_if_when events clocks initialisation connections types_and_units parameters operators
    outside_profile names limits loops index_reduction delays warnings units external operator_records
}
