//! The components of the library: small models with the values that a closed form or a conservation law gives.
//!
//! A case is a file `tests/stdlib/<domain>/<name>.hyd` in the form of the language cases (see `tests/tests/language/main.rs`):
//! `// expect: VARIABLE @ TIME = VALUE`.  A test of its own looks whether each component is used by at least one case, and
//! whether each public element of a component says what it is.

use std::path::{Path, PathBuf};

use hyd_compiler::Goal;
use hyd_system::DaeSystem;
use hyd_tests::models::{compile_file, messages, root};
use hyd_tests::runs::{instance, on_grid, run, translated};

use crate::case::{check_topics, folder, run_topic};

macro_rules! domains {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                run_topic(&folder("stdlib"), stringify!($name), &[]);
            }
        )*

        /// Every folder has a test.
        #[test]
        fn no_domain_is_left_out() {
            check_topics(&folder("stdlib"), &[$(stringify!($name).to_string()),*], &[]);
        }
    };
}

domains! {
    electrical magnetic translational hydraulic thermal signals
}

/// Texts below a folder.
fn texts(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("listed").path();
        if path.is_dir() {
            found.extend(texts(&path));
        } else if path.extension().is_some_and(|extension| extension == "hyd") {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Whether `word` stands in `text` by itself.
fn stands_in(text: &str, word: &str) -> bool {
    let inside = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let before = text[..at].chars().next_back().is_some_and(inside);
        let after = text[at + word.len()..].chars().next().is_some_and(inside);
        !before && !after
    })
}

#[test]
fn every_component_is_tested() {
    let mut used = String::new();
    for file in texts(&folder("stdlib")).iter().chain(&texts(&root().join("models"))) {
        used += &read(file);
    }
    let mut checked = 0;
    let mut missing = Vec::new();
    for file in texts(&root().join("stdlib/Hyd")) {
        let text = read(&file);
        let parts: Vec<String> =
            file.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
        let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
        let tested = ["Components", "Sources", "Sensors", "Drivers", "Blocks", "Fluids", "Functions"];
        // Effects have cases of their own: `effects` and `generic_effects`.
        if stem(&file) == "package"
            || parts.contains(&"Effects")
            || !parts.iter().any(|part| tested.contains(part))
            || text.contains("\npartial ")
        {
            continue;
        }
        checked += 1;
        if !stands_in(&used, &stem(&file)) {
            missing.push(stem(&file));
        }
    }
    assert!(checked > 80, "only {checked} components found");
    assert!(missing.is_empty(), "no case uses {missing:?}");
}

/// The examples of the domains run as their annotations say, and something moves in each.
#[test]
fn examples_run() {
    let files: Vec<PathBuf> =
        texts(&root().join("stdlib/Hyd")).into_iter().filter(|f| f.to_string_lossy().contains("Examples")).collect();
    let mut ran = 0;
    for file in files.iter().filter(|file| stem(file) != "package") {
        let path = file.strip_prefix(root()).expect("below the root").display().to_string();
        let flat = compile_file(&path, &[], Goal::Flat);
        let stop = flat.flat.as_ref().and_then(|flat| flat.experiment.stop);
        let stop = stop.unwrap_or_else(|| panic!("{path} has no experiment\n{}", messages(&flat)));
        let unknowns = instance(&translated(&path, &[]), &[]).structure().unknowns;
        let run = run(&path, &[], &on_grid(stop, 100, 1e-6));
        let moves = (0..unknowns).any(|k| {
            let values = run.values(&run.rows.tables().unknown_name(k));
            values.iter().any(|value| (value - values[0]).abs() > 1e-3 * values[0].abs())
        });
        assert!(moves, "nothing happens in {path}");
        ran += 1;
    }
    assert!(ran >= 6, "only {ran} examples");
}

#[test]
fn every_class_and_parameter_is_described() {
    let mut missing = Vec::new();
    for file in texts(&root().join("stdlib/Hyd")) {
        let text = read(&file);
        let mut statement = String::new();
        for (number, line) in text.lines().enumerate().skip(1) {
            statement += line.trim();
            let open = statement.starts_with("parameter") && !statement.ends_with(';');
            // The description of a class that does not fit beside its name stands on the next line.
            let described = |k: usize| text.lines().nth(k).is_some_and(|line| line.trim_start().starts_with('"'));
            if number == 1 && !line.contains('"') && !described(2)
                || statement.starts_with("parameter") && !open && !statement.contains('"')
            {
                missing.push(format!("{}:{}", stem(&file), number + 1));
            }
            if !open {
                statement.clear();
            }
        }
    }
    assert!(missing.is_empty(), "without description: {missing:?}");
}

/// The documentation of a component says where its law is from, or writes it down.
#[test]
fn every_component_documents_its_law() {
    let mut missing = Vec::new();
    for file in texts(&root().join("stdlib/Hyd")) {
        let part = |name: &str| file.components().any(|part| part.as_os_str() == name);
        let wanted = ["Components", "Drivers", "Blocks", "Functions", "Fluids"].into_iter().any(part);
        if wanted && !part("Effects") && stem(&file) != "package" && !read(&file).contains("Documentation(info") {
            missing.push(stem(&file));
        }
    }
    assert!(missing.is_empty(), "without documentation: {missing:?}");
}
