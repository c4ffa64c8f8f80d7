//! The shape of the workspace: arrows between crates, headers of files, names of modules, lengths, words.
//!
//! Manifests are read line by line, which suffices for the form they have here (`name.workspace = true` below a section).
//! An arrow that is not in `ALLOWED` fails: modules cannot forbid a cycle, crates can.  Development dependencies are free.
//! Files above the soft limit of their length are printed (`--nocapture`).

use std::path::{Path, PathBuf};

use hyd_tests::models::root;

/// Package, and which packages of the workspace it may depend on.
///
/// `hyd-source` (texts, spans, messages) and `hyd-index` (typed indices) are open to all of the compiler, `hyd-system` to its
/// stages for names, kinds of values and the shared functions of `math`: plain data, no behaviour of a solver.
const ALLOWED: [(&str, &[&str]); 36] = [
    ("hyd-index", &[]),
    ("hyd-source", &["hyd-index"]),
    ("hyd-syntax", &["hyd-source"]),
    ("hyd-format", &["hyd-source", "hyd-syntax"]),
    ("hyd-doc", &["hyd-source", "hyd-syntax"]),
    ("hyd-instance", &["hyd-source", "hyd-index", "hyd-syntax", "hyd-system"]),
    ("hyd-symbolic", &["hyd-index", "hyd-system"]),
    ("hyd-structure", &["hyd-index"]),
    ("hyd-typed", &["hyd-source", "hyd-syntax", "hyd-instance", "hyd-system"]),
    ("hyd-flat", &["hyd-source", "hyd-index", "hyd-syntax", "hyd-instance", "hyd-typed", "hyd-symbolic", "hyd-system"]),
    ("hyd-clocks", &["hyd-source", "hyd-index", "hyd-flat", "hyd-structure", "hyd-symbolic", "hyd-system"]),
    ("hyd-equations", &["hyd-source", "hyd-index", "hyd-flat", "hyd-structure", "hyd-symbolic", "hyd-system"]),
    ("hyd-units", &["hyd-source", "hyd-index", "hyd-flat", "hyd-symbolic", "hyd-system"]),
    // Variables keep the indices that they have in the flat model.
    (
        "hyd-codegen",
        &["hyd-source", "hyd-index", "hyd-flat", "hyd-equations", "hyd-symbolic", "hyd-system", "hyd-payload"],
    ),
    (
        "hyd-compiler",
        &[
            "hyd-source",
            "hyd-index",
            "hyd-syntax",
            "hyd-instance",
            "hyd-clocks",
            "hyd-flat",
            "hyd-units",
            "hyd-symbolic",
            "hyd-equations",
            "hyd-codegen",
            "hyd-system",
        ],
    ),
    ("hyd-system", &[]),
    // Of the compiler only expressions and their interpreter: an executable falls back to it.
    ("hyd-payload", &["hyd-index", "hyd-symbolic", "hyd-system"]),
    ("hyd-results", &["hyd-system"]),
    ("hyd-runtime", &["hyd-system", "hyd-results"]),
    ("hyd-frames", &["hyd-system", "hyd-results"]),
    ("hyd-ensemble", &["hyd-system", "hyd-results", "hyd-runtime", "hyd-frames"]),
    // Work shared out by engines that exist; what is shared out is none of its business.
    ("hyd-cluster", &[]),
    ("hyd-discovery", &["hyd-compiler", "hyd-runtime", "hyd-results", "hyd-system"]),
    (
        "hyd-run",
        &[
            "hyd-payload",
            "hyd-runtime",
            "hyd-results",
            "hyd-frames",
            "hyd-ensemble",
            "hyd-system",
            // For `did you mean` alone.
            "hyd-source",
        ],
    ),
    // What the command and the Python package share: everything but arguments and terminals.
    (
        "hyd-verbs",
        &[
            "hyd-compiler",
            "hyd-flat",
            "hyd-fmi-import",
            // Results of any format.
            "hyd-frames",
            "hyd-payload",
            "hyd-source",
            "hyd-runtime",
            "hyd-results",
            "hyd-cluster",
            "hyd-discovery",
            // Executables that are shipped.
            "hyd-payload",
            "hyd-run",
            "hyd-report",
            "hyd-system",
        ],
    ),
    // What editors ask: of texts the compiler, of libraries what the verbs know.  Pages that editors open are whole files.
    (
        "hyd-lsp",
        &[
            "hyd-compiler",
            "hyd-doc",
            "hyd-equations",
            "hyd-flat",
            "hyd-format",
            "hyd-instance",
            "hyd-results",
            "hyd-run",
            "hyd-source",
            "hyd-syntax",
            "hyd-system",
            "hyd-units",
            "hyd-verbs",
        ],
    ),
    // What agents ask: the verbs, and of classes what the map of a library knows.
    ("hyd-mcp", &["hyd-compiler", "hyd-doc", "hyd-results", "hyd-run", "hyd-source", "hyd-system", "hyd-verbs"]),
    // What people look at: models and their instances, results, and runs with other parameters.
    (
        "hyd-view",
        &[
            "hyd-compiler",
            "hyd-doc",
            "hyd-instance",
            "hyd-results",
            "hyd-run",
            "hyd-source",
            "hyd-syntax",
            "hyd-system",
            "hyd-verbs",
        ],
    ),
    // What every executable is: no stage of the compiler, no code generator.
    ("hyd-launcher", &["hyd-payload", "hyd-run", "hyd-runtime", "hyd-system"]),
    // Units for other tools: the description and the archive, and the library in it, which solves but compiles nothing.
    ("hyd-fmi", &["hyd-payload", "hyd-system"]),
    ("hyd-unit", &["hyd-fmi", "hyd-payload", "hyd-runtime", "hyd-system"]),
    // Units of other tools: a system like others, whose code runs in a process of its own.
    ("hyd-fmi-import", &["hyd-results", "hyd-system"]),
    ("hyd-report", &[]),
    // What computes models beside the product knows nothing of it.
    ("hyd-differential", &[]),
    // A workspace of its own, for comparison.
    ("peer-diffsol", &[]),
    // A workspace of its own: what judges the product must share nothing with it.
    ("hidden-effects", &[]),
];
/// Packages at the outer end, which may use all others and are used by none but each other.
const OUTER: [&str; 4] = ["hyd", "hyd-python", "hyd-tests", "hyd-fuzz"];

/// A file with more lines is printed: it may have two subjects.
const LONG_FILE: usize = 500;
/// Nobody can read more lines as one file.
const LONGEST_FILE: usize = 900;
const DRAWERS: [&str; 5] = ["utils", "util", "misc", "common", "helpers"];
/// Parts of a path of one machine and words of one way to work, which say nothing to a reader; spelt in two parts so that this
/// file is none of its own findings.
const FORBIDDEN: [&str; 4] =
    [concat!("/wo", "rk/"), concat!("sha", "red/"), concat!("iss", "ue"), concat!("/tm", "p/hyd")];

/// All files below the root with this extension or, with a dot, of this name; build products and hidden folders are left out.
fn files(extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("listed").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                if !["target", "node_modules"].contains(&&*name) && !name.starts_with('.') {
                    folders.push(path);
                }
            } else if name == extension || path.extension().is_some_and(|found| found == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    assert!(!found.is_empty(), "no files with `{extension}`");
    found
}

fn shown(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Name of a package and the packages of the workspace below its `[dependencies]`; none for a manifest without package.
fn arrows(manifest: &str) -> Option<(String, Vec<String>)> {
    let mut name = None;
    let mut targets = Vec::new();
    let mut section = "";
    for line in manifest.lines().map(str::trim).filter(|line| !line.starts_with('#')) {
        if line.starts_with('[') {
            section = line.trim_matches(['[', ']']);
            // `[dependencies.x]`, `[target."...".dependencies]`, `[build-dependencies]` count as well.
            if let Some(package) = section.rsplit_once("dependencies.").filter(|(before, _)| !before.ends_with("dev-"))
            {
                targets.push(package.1.to_string());
            }
        } else if let Some((key, value)) = line.split_once('=') {
            let key = key.trim().split('.').next().unwrap_or_default();
            if section == "package" && key == "name" {
                name = Some(value.trim().trim_matches('"').to_string());
            }
            if section.ends_with("dependencies") && !section.ends_with("dev-dependencies") {
                targets.push(key.to_string());
            }
        }
    }
    targets.retain(|target| target == "hyd" || target.starts_with("hyd-"));
    name.map(|name| (name, targets))
}

/// What is wrong with the arrows of a package.
fn wrong_arrows(name: &str, targets: &[String]) -> Vec<String> {
    if OUTER.contains(&name) {
        return Vec::new();
    }
    let Some((_, allowed)) = ALLOWED.iter().find(|(package, _)| *package == name) else {
        return vec![format!("{name} is not in the list of packages")];
    };
    let wrong = targets.iter().filter(|target| !allowed.contains(&target.as_str()));
    wrong.map(|target| format!("{name} must not depend on {target}")).collect()
}

#[test]
fn manifests_are_read() {
    let text = "[package]\nname = \"hyd-a\"\n[dependencies]\nhyd-b.workspace = true\nlibm = \"1\"\n[dev-dependencies]\nhyd-c = {}\n\
                [target.\"cfg(unix)\".dependencies]\nhyd-d = {}\n[dependencies.hyd-e]\npath = \"x\"\n";
    let (name, targets) = arrows(text).expect("a package");
    assert_eq!((name.as_str(), targets), ("hyd-a", ["hyd-b", "hyd-d", "hyd-e"].map(String::from).to_vec()));
    assert_eq!(wrong_arrows("hyd-runtime", &["hyd-compiler".into()]), ["hyd-runtime must not depend on hyd-compiler"]);
    assert_eq!(wrong_arrows("hyd-new", &[]).len(), 1);
}

#[test]
fn crates_depend_along_the_arrows() {
    let manifests = files("Cargo.toml").into_iter().filter_map(|path| arrows(&read(&path)));
    let packages: Vec<(String, Vec<String>)> = manifests.collect();
    assert!(packages.len() >= 16, "{packages:?}");
    let wrong: Vec<String> = packages.iter().flat_map(|(name, targets)| wrong_arrows(name, targets)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The README's first command is `cargo run`, which takes the one default member that says what runs.
#[test]
fn cargo_run_knows_its_program() {
    let workspace = read(&root().join("Cargo.toml"));
    let members = workspace.lines().find_map(|line| line.strip_prefix("default-members = [")).expect("default members");
    let members: Vec<&str> =
        members.trim_end_matches(']').split(',').map(|name| name.trim().trim_matches('"')).collect();
    let says = |member: &&&str| read(&root().join(member).join("Cargo.toml")).contains("\ndefault-run = \"hyd\"\n");
    assert!(members.len() > 1 && members.iter().filter(says).count() == 1, "{members:?}");
    assert!(read(&root().join("README.md")).contains("    cargo run --release -- simulate "));
}

/// A library whose manifest turns its tests off would keep them without ever running them.
#[test]
fn tests_of_every_crate_run() {
    let is_off = |manifest: &str| {
        let own: toml::Table = toml::from_str(manifest).expect("a manifest that cargo reads");
        own.get("lib").and_then(|lib| lib.get("test")).is_some_and(|test| test.as_bool() == Some(false))
    };
    assert!(is_off("[lib]\ndoctest = false\ntest = false\n") && !is_off("[[bin]]\nname = \"a\"\ntest = false\n"));
    let off: Vec<PathBuf> = files("toml")
        .into_iter()
        .filter(|path| path.ends_with("Cargo.toml") && is_off(&read(path)))
        .map(|path| path.with_file_name("src"))
        .collect();
    assert!(!off.is_empty(), "no manifest turns tests off any more");
    let lost: Vec<String> = files("rs")
        .iter()
        .filter(|path| off.iter().any(|own| path.starts_with(own)) && read(path).contains("#[test]"))
        .map(|path| shown(path))
        .collect();
    assert!(lost.is_empty(), "tests that no command runs, as their crate has `test = false`: {lost:#?}");
}

#[test]
fn every_file_opens_with_a_header() {
    let missing: Vec<String> =
        files("rs").iter().filter(|path| !read(path).starts_with("//! ")).map(|path| shown(path)).collect();
    assert!(missing.is_empty(), "no `//!` header: {}", missing.join(", "));
}

#[test]
fn no_module_is_a_drawer() {
    let is_drawer = |path: &PathBuf| {
        let parts = path.strip_prefix(root()).unwrap_or(path).with_extension("");
        parts.components().any(|part| DRAWERS.iter().any(|drawer| part.as_os_str() == *drawer))
    };
    let drawers: Vec<String> = files("rs").iter().filter(|path| is_drawer(path)).map(|path| shown(path)).collect();
    assert!(drawers.is_empty(), "name the subject instead: {}", drawers.join(", "));
}

#[test]
fn files_can_be_read() {
    let mut lengths: Vec<(usize, String)> =
        files("rs").iter().map(|path| (read(path).lines().count(), shown(path))).collect();
    lengths.sort_by(|a, b| b.cmp(a));
    println!("files above {LONG_FILE} lines:");
    let above = |limit: usize| lengths.iter().filter(move |(lines, _)| *lines > limit);
    above(LONG_FILE).for_each(|(lines, path)| println!("{lines:6} {path}"));
    let longest: Vec<String> = above(LONGEST_FILE).map(|(lines, path)| format!("{path} has {lines} lines")).collect();
    assert!(longest.is_empty(), "split by subject: {}", longest.join(", "));
}

#[test]
fn texts_speak_of_the_product_alone() {
    let mut found = Vec::new();
    for path in ["rs", "hyd", "md", "toml"].iter().flat_map(|extension| files(extension)) {
        for (number, line) in read(&path).lines().enumerate() {
            let lower = line.to_lowercase();
            for word in FORBIDDEN.iter().filter(|word| lower.contains(*word)) {
                found.push(format!("{}:{}: `{word}`", shown(&path), number + 1));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A code without a case is a message that nobody has read.
#[test]
fn every_code_has_a_case() {
    let mut cases = String::new();
    for path in ["rs", "hyd", "mo", "snap", "md"].iter().flat_map(|extension| files(extension)) {
        let name = shown(&path);
        if name.contains("tests/") || name.starts_with("docs/") {
            cases += &read(&path);
        }
    }
    let open: Vec<&str> = hyd_compiler::Code::ALL
        .iter()
        .filter(|code| !cases.contains(code.number()) && !cases.contains(&format!("Code::{code:?}")))
        .map(|code| code.number())
        .collect();
    assert!(open.is_empty(), "codes without a case in the tests: {}", open.join(", "));
}
