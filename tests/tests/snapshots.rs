//! The models of the repository printed after three stages: flat, sorted, Jacobian.
//!
//! One file per model and stage in `tests/snapshots`, discovered by listing; first the path of the text, then what `hyd equations`
//! would print.  Sub-models with open connectors do not determine all unknowns by themselves: they are printed flat
//! only, and their sorted form is seen inside the test stands (`RLCLocked`, `RM`, `HYPrescribed`, `SHPrescribed`, `StaticTables`).

use hyd_compiler::{Goal, Stage};
use hyd_tests::models::{compile_file, messages, model_files, text_of};

/// Texts that hold no complete model, and complete ones that need a neighbour on their open connectors.
const PARTIAL: [&str; 2] = ["partialem", "partiallc"];
const OPEN: [&str; 15] = [
    "em",
    "empaper",
    "hy",
    "lc",
    "lcconstantinductance",
    "lcnomotionalemf",
    "lcpaper",
    "qo",
    "qz",
    "ra",
    "ro",
    "sh",
    "so",
    "su",
    "sz",
];

fn stem(file: &str) -> &str {
    file.rsplit('/').next().and_then(|name| name.strip_suffix(".hyd")).expect("a model's file")
}

/// Stores one printed stage under `<folder>__<model>__<stage>`.
fn store(file: &str, stage: &str, text: &str) {
    let folder = file.split('/').nth(1).expect("models/<folder>/<file>");
    let name = format!("{folder}__{}__{stage}", stem(file));
    let content = format!("{file}, {stage}\n\n{text}");
    insta::with_settings!({ snapshot_path => "../snapshots", prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, content);
    });
}

#[test]
fn stages_of_all_models() {
    let mut printed = 0;
    for file in model_files() {
        if PARTIAL.contains(&stem(&file)) {
            assert!(text_of(&file).contains("\npartial model "), "{file} is listed as partial");
            continue;
        }
        let flat = compile_file(&file, &[], Goal::Flat);
        assert!(!flat.has_errors(), "{file}:\n{}", messages(&flat));
        store(&file, "flat", &flat.print(Stage::Flat).expect("a flat model"));
        printed += 1;
        let checked = compile_file(&file, &[], Goal::Check);
        if OPEN.contains(&stem(&file)) {
            assert!(
                checked.has_errors(),
                "{file} is determined although its connectors are open: take it off the list"
            );
            continue;
        }
        assert!(!checked.has_errors(), "{file}:\n{}", messages(&checked));
        store(&file, "sorted", &checked.print(Stage::Sorted).expect("a sorted system"));
        store(&file, "jacobian", &checked.print(Stage::Jacobian).expect("derivatives"));
    }
    assert!(printed >= 30, "only {printed} models found");
}
