//! Models of the repository: found by listing the folder `models`, compiled through the façade of the compiler.
//!
//! File names are made relative to the repository and written with `/`, so that what is printed does not depend on the
//! machine.  Classes are looked up as the command does it: package folder of the file first, then the built-in library.

use std::path::{Path, PathBuf};

use hyd::LibraryPath;
use hyd_compiler::{Compilation, Goal, Options, compile, render};

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().expect("the package of the tests lies in the workspace").to_path_buf()
}

/// All model texts below `models`, relative to the root, sorted; package files are left out.
pub fn model_files() -> Vec<String> {
    let mut found = Vec::new();
    list(&root().join("models"), &mut found);
    let root = root();
    let relative = |path: &PathBuf| {
        let path = path.strip_prefix(&root).expect("listed below the root");
        path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
    };
    let mut files: Vec<String> = found.iter().map(relative).collect();
    files.retain(|file| !file.ends_with("/package.hyd"));
    files.sort();
    assert!(files.len() > 20, "models not found: {files:?}");
    files
}

fn list(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("listed").path();
        if path.is_dir() {
            list(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "hyd") {
            found.push(path);
        }
    }
}

/// Text of a file given relative to the root.
pub fn text_of(file: &str) -> String {
    let path = root().join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Compiles a file given relative to the root as far as it comes; `set` are parameters by path and text.
pub fn compile_file(file: &str, set: &[(&str, &str)], goal: Goal) -> Compilation {
    let text = text_of(file);
    let mut library = LibraryPath::new();
    library.name_from(&root());
    library.add_main_file(&root().join(file), &text);
    let set = set.iter().map(|&(name, value)| (name.to_string(), value.to_string())).collect();
    compile(&mut library, file, &text, &Options { model: None, set, goal, clock: || 0.0 })
}

/// The messages of a compilation as text.
pub fn messages(compilation: &Compilation) -> String {
    render::render(&compilation.files, &compilation.diagnostics, false)
}
