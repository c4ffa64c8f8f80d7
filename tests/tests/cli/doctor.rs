//! What the program says of models that fail, and that it is silent about healthy ones.
//!
//! `tests/doctor/fails` holds models with a fault each.  Comments say what must be found and what heals it:
//! `// cause: WORDS` words that name the cause in an error, `// warns: WORDS` in a warning of a run that succeeds, `// notes: WORDS` in a note
//! of one, `// proposes: WORDS` words of the change that is proposed, `` // heal: `OLD` -> `NEW` `` the change itself, `// fix: yes` that
//! `hyd check --fix` makes a change after which the model runs, `// fault: SENTENCE` the fault in plain words (of models that were written before
//! the program was run on them), `// stop: SECONDS` the length of the run (`default`: as the model says).  How often
//! the cause comes first and among the first three sentences, and how often the change is proposed, is counted over all of them and
//! must not fall; every change must make its model run without a word.  `tests/doctor/healthy` holds models that only resemble those.

use std::fs;
use std::path::{Path, PathBuf};

use hyd_tests::models::root;

use crate::process::{Outcome, Scratch, assert_no_panic, run};

/// Least parts of the models whose cause is the first thing said, stands among the first three, and whose change is proposed.
const FIRST: f64 = 0.8;
const AMONG_THREE: f64 = 0.95;
const PROPOSED: f64 = 0.7;
/// Models that `hyd check --fix` heals, at least.
const LEAST_FIXED: usize = 80;

/// The length of a run that the model alone says.
const DEFAULT: &str = "default";

/// A model with what its comments say.
struct Case {
    name: String,
    text: String,
    cause: Option<String>,
    warns: bool,
    notes: bool,
    fix: bool,
    proposes: Option<String>,
    heals: Vec<(String, String)>,
    stop: String,
}

fn cases(folder: &str) -> Vec<Case> {
    let folder = root().join("tests/doctor").join(folder);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| case(path)).collect()
}

fn case(path: &Path) -> Case {
    let text = fs::read_to_string(path).unwrap();
    let name = path.file_stem().unwrap().to_string_lossy().into_owned();
    let said = |word: &str| {
        let begin = format!("// {word}: ");
        text.lines().find_map(|line| line.strip_prefix(&begin)).map(str::to_string)
    };
    let heal = |line: &str| {
        let parts: Vec<&str> = line.strip_prefix("// heal: ")?.split('`').collect();
        assert_eq!(parts.len(), 5, "{name}: {line}");
        Some((parts[1].to_string(), parts[3].to_string()))
    };
    let (cause, warning, note) = (said("cause"), said("warns"), said("notes"));
    Case {
        warns: warning.is_some() || note.is_some(),
        notes: note.is_some(),
        fix: said("fix").is_some(),
        cause: cause.or(warning).or(note),
        proposes: said("proposes"),
        heals: text.lines().filter_map(heal).collect(),
        stop: said("stop").unwrap_or_else(|| "1".to_string()),
        name,
        text,
    }
}

fn simulate(text: &str, stop: &str) -> Outcome {
    let folder = Scratch::new();
    folder.write("model.hyd", text);
    let mut arguments = vec!["simulate", "model.hyd", "--message-format", "json"];
    if stop != DEFAULT {
        arguments.extend(["--stop", stop]);
    }
    let outcome = run(folder.path(), &arguments);
    assert_no_panic(&outcome);
    outcome
}

/// All that is said, in the order in which it is read: each message with the sentences below it.
fn sentences(outcome: &Outcome, notes: bool) -> Vec<String> {
    let mut all = Vec::new();
    for line in outcome.stderr.lines() {
        let Ok(message) = serde_json::from_str::<serde_json::Value>(line) else {
            all.push(line.to_string());
            continue;
        };
        if message["severity"] == "note" && !notes {
            continue;
        }
        all.push(message["message"].as_str().unwrap_or_default().to_string());
        let notes = message["notes"].as_array().cloned().unwrap_or_default();
        all.extend(notes.iter().filter_map(|note| note.as_str()).map(str::to_string));
    }
    all
}

fn healed(case: &Case) -> String {
    let mut text = case.text.lines().filter(|line| !line.starts_with("//")).collect::<Vec<_>>().join("\n");
    for (old, new) in &case.heals {
        assert_eq!(text.matches(old.as_str()).count(), 1, "{}: `{old}`", case.name);
        text = text.replace(old, new);
    }
    text
}

#[test]
fn causes_come_first_and_changes_heal() {
    let cases = cases("fails");
    let (mut first, mut among, mut proposed, mut report) = (0, 0, 0, String::new());
    for case in &cases {
        let outcome = simulate(&case.text, &case.stop);
        let said = sentences(&outcome, case.notes);
        match case.warns {
            true => assert_eq!(outcome.code, Some(0), "{}: {}", case.name, outcome.stderr),
            false => assert!(outcome.code.is_some_and(|code| code != 0) || !said.is_empty(), "{} runs", case.name),
        }
        let cause = case.cause.as_deref().unwrap_or_else(|| panic!("{} has no cause", case.name));
        let rank = said.iter().position(|sentence| sentence.contains(cause));
        first += usize::from(rank == Some(0));
        among += usize::from(rank.is_some_and(|rank| rank < 3));
        let is_proposed =
            case.proposes.as_deref().is_some_and(|words| said.iter().any(|sentence| sentence.contains(words)));
        proposed += usize::from(is_proposed);
        if rank != Some(0) || !is_proposed {
            report += &format!("{}: cause at {rank:?}, proposed {is_proposed}\n  {}\n", case.name, said.join("\n  "));
        }
        let after = simulate(&healed(case), &case.stop);
        assert_eq!((after.code, after.stderr.as_str()), (Some(0), ""), "{} is not healed", case.name);
    }
    let part = |count: usize| count as f64 / cases.len() as f64;
    println!("{report}{} models: cause first {first}, among three {among}, change proposed {proposed}", cases.len());
    assert!(
        part(first) >= FIRST && part(among) >= AMONG_THREE && part(proposed) >= PROPOSED,
        "of {}: {first} first, {among} among three, {proposed} proposed\n{report}",
        cases.len()
    );
}

#[test]
fn proposed_changes_are_made_by_check() {
    let cases: Vec<Case> = cases("fails").into_iter().filter(|case| case.fix).collect();
    assert!(cases.len() >= LEAST_FIXED, "{} models", cases.len());
    for case in cases {
        let folder = Scratch::new();
        folder.write("model.hyd", &case.text);
        let mut arguments = vec!["check", "model.hyd", "--fix"];
        if case.stop != DEFAULT {
            arguments.extend(["--stop", &case.stop]);
        }
        let outcome = run(folder.path(), &arguments);
        assert_no_panic(&outcome);
        let text = folder.read("model.hyd");
        assert_ne!(text, case.text, "{}: {}{}", case.name, outcome.stdout, outcome.stderr);
        let after = simulate(&text, &case.stop);
        assert_eq!((after.code, after.stderr.as_str()), (Some(0), ""), "{} is not healed by\n{text}", case.name);
    }
}

#[test]
fn healthy_models_pass_without_a_word() {
    for case in cases("healthy") {
        let outcome = simulate(&case.text, &case.stop);
        assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""), "{}", case.name);
    }
}
