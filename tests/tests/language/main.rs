//! The language, construct by construct: small models with the values or the messages that they must give.
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
mod conformance;
mod reference_text;

use case::{Known, folder, run_topic};

/// Cases that state what is wanted and not reached yet.  They must fail: who reaches one takes it off the list.
const KNOWN_OPEN: &[Known] = &[
    ("functions/assigns_input", "an assignment to an input is accepted"),
    ("inheritance/protected_extends", "elements of a protected `extends` stay public"),
    ("inheritance/same_declaration_again", "an own declaration equal to an inherited one is taken as a second one"),
    ("inner_outer/types_differ", "the types of `inner` and `outer` are not compared"),
    ("modification/each_without_array", "`each` on a scalar component is ignored"),
    ("modification/protected_element", "a modifier reaches a protected element"),
    (
        "packages_and_imports/package_extends_package",
        "a class inherited by a package reads the constants of the package where it stands",
    ),
    ("parameters/out_of_range", "`min` and `max` of parameters are not checked"),
    ("records/constructor_field_missing", "a missing field of a constructor gets 0 with a warning"),
    ("records/constructor_unknown_field", "unknown fields of a constructor in a declaration are ignored"),
    ("records/with_equation", "equations of a record are accepted"),
    ("redeclaration/lacks_an_element", "what a constraining class asks for is not compared"),
];

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
    functions algorithms equations_for_if_when events initialisation connections types_and_units parameters operators
    outside_profile names limits index_reduction
}
