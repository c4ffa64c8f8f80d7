//! The models of the repository printed after three stages: flat, sorted, Jacobian.
//!
//! One file per model and stage in `tests/snapshots`, discovered by listing; first the path of the text, then what `hyd equations`
//! would print.  A model that extends another complete one of its folder shows only the lines in which they differ; where several
//! drives stand on one rail, what happens inside of each is left out.  Lines of pipe have few cells here.  Sub-models with open connectors do not determine all unknowns by themselves: they are printed
//! flat only, and their sorted form is seen inside the test stands (`RLCLocked`, `RM`, `HYPrescribed`, `SHPrescribed`,
//! `StaticTables`).

use hyd_compiler::{Goal, Stage};
use hyd_tests::models::{compile_file, messages, model_files, text_of};

/// Complete models that need a neighbour on their open connectors.
const OPEN: [&str; 14] = [
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
    "so",
    "su",
    "sz",
];

fn stem(file: &str) -> &str {
    file.rsplit('/').next().and_then(|name| name.strip_suffix(".hyd")).expect("a model's file")
}

/// Parameters under which a model is printed.
fn set(file: &str) -> &'static [(&'static str, &'static str)] {
    let has_cells = file.starts_with("models/hydraulic_line/") && text_of(file).contains("parameter Integer N");
    if has_cells { &[("N", "4")] } else { &[] }
}

/// The complete model of the same folder or of the one around it that a model extends, if it does.
fn base(file: &str, files: &[String]) -> Option<String> {
    let text = text_of(file);
    let name = text.lines().find_map(|line| line.strip_prefix("  extends "))?;
    let name = name.split(['(', ';']).next().unwrap_or(name).to_lowercase();
    let (folder, _) = file.rsplit_once('/')?;
    let outer = folder.rsplit_once('/').map_or(folder, |(outer, _)| outer);
    [folder, outer].iter().map(|folder| format!("{folder}/{name}.hyd")).find(|base| files.contains(base))
}

/// Parts of a drive that is a component itself.
const INSIDE: [&str; 8] = [".ro.", ".hy.", ".sh.", ".supply.", ".drain.", ".passage.", ".flow_force.", ".sensor_"];

/// The lines of a text that do not speak of what is inside of such a drive.
fn outside(text: &str) -> String {
    let lines = text.lines().filter(|line| !INSIDE.iter().any(|part| line.contains(part)));
    lines.map(|line| format!("{line}\n")).collect()
}

fn print(file: &str, stage: Stage) -> String {
    let goal = if stage == Stage::Flat { Goal::Flat } else { Goal::Check };
    let compilation = compile_file(file, set(file), goal);
    assert!(!compilation.has_errors(), "{file}:\n{}", messages(&compilation));
    compilation.print(stage).unwrap_or_else(|| panic!("{file} has no {stage:?}"))
}

/// Stores one printed stage under `<folder>__<model>__<stage>`.
fn store(file: &str, files: &[String], stage: Stage) {
    let folder = file.split('/').nth(1).expect("models/<folder>/<file>");
    let stage_name = format!("{stage:?}").to_lowercase();
    let name = format!("{folder}__{}__{stage_name}", stem(file));
    let whole = print(file, stage);
    let text = if file.contains("/rail/") { outside(&whole) } else { whole };
    let under: String = set(file).iter().map(|(name, value)| format!(" with {name} = {value}")).collect();
    let content = match base(file, files) {
        None => format!("{file}{under}, {stage_name}\n\n{text}"),
        Some(base) => {
            let differences = differences(&print(&base, stage), &text);
            format!("{file}{under}, {stage_name}: where it differs from {base}\n\n{differences}")
        }
    };
    insta::with_settings!({ snapshot_path => "../../snapshots", prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, content);
    });
}

/// A line without the number that it has in a list of blocks.
fn bare(line: &str) -> &str {
    line.split_once(": ").filter(|(number, _)| number.trim().parse::<u32>().is_ok()).map_or(line, |(_, rest)| rest)
}

/// Lines that one of the texts has more often than the other, in their order; the order of the others is not looked at.
fn differences(old: &str, new: &str) -> String {
    let surplus = |text: &str, other: &str, sign: char| {
        let mut known: Vec<&str> = other.lines().map(bare).collect();
        let is_new = |line: &&str| match known.iter().position(|known| known == line) {
            Some(found) => {
                known.swap_remove(found);
                false
            }
            None => true,
        };
        let lines: Vec<&str> = text.lines().map(bare).filter(is_new).collect();
        lines.iter().map(|line| format!("{sign} {}\n", line.trim())).collect::<String>()
    };
    surplus(old, new, '-') + &surplus(new, old, '+')
}

#[test]
fn differences_do_not_see_numbers_and_order() {
    assert_eq!(differences("a\n 1: b\nc\nc", "a\nx\nc\n 2: b\nd"), "- c\n+ x\n+ d\n");
    assert_eq!(differences("a\nb", "b\na"), "");
}

#[test]
fn stages_of_all_models() {
    let files = model_files();
    let mut printed = 0;
    for file in &files {
        store(file, &files, Stage::Flat);
        printed += 1;
        if OPEN.contains(&stem(file)) {
            let alone = compile_file(file, &[], Goal::Check);
            assert!(alone.has_errors(), "{file} is determined although its connectors are open: take it off the list");
            continue;
        }
        store(file, &files, Stage::Sorted);
        store(file, &files, Stage::Jacobian);
    }
    assert!(printed >= 30, "only {printed} models found");
}
