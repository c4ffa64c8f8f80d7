//! `hyd new NAME`: a folder with a small valve drive, a study of it and a README whose commands run.
//!
//! The texts are templates beside this file, in which `{name}` is the name given, `{quoted}` the same as a string of TOML or JSON, and
//! `{Class}` the class made of it.  Nothing that
//! exists is touched: the folder must not be there, or be empty.

use std::fs;
use std::path::Path;

use hyd_results::write_whole;

use crate::arguments::New;
use crate::{Failure, output};

/// The files of a new folder.
const FILES: [(&str, &str); 4] = [
    ("drive.hyd", include_str!("new/drive.hyd.txt")),
    ("bench.toml", include_str!("new/bench.toml.txt")),
    ("bench/set.json", include_str!("new/set.json.txt")),
    ("README.md", include_str!("new/README.md.txt")),
];

/// Runs the verb.
pub(crate) fn new(arguments: &New) -> Result<(), Failure> {
    let folder = &arguments.name;
    let name = folder.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let Some(class) = class_name(&name) else {
        let sentence = format!("`{}` gives no name for a model: a letter is needed", folder.display());
        return Err(Failure::Usage(sentence));
    };
    let failed = |path: &Path, error: &std::io::Error| {
        Failure::Fault(format!("`{}` cannot be written: {error}", path.display()))
    };
    let empty = || fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
    if folder.symlink_metadata().is_ok() && !empty() {
        return Err(Failure::Fault(format!("`{}` exists already; nothing was written", folder.display())));
    }
    fs::create_dir_all(folder.join("bench")).map_err(|error| failed(folder, &error))?;
    let mut text = format!("{}\n", folder.display());
    for (file, template) in FILES {
        let path = folder.join(file);
        // The name comes last: what it holds is not a template.
        let content = template.replace("{Class}", &class).replace("{quoted}", &quoted(&name));
        let content = content.replace("{name}", &name.replace(char::is_control, " "));
        write_whole(&path, content.as_bytes()).map_err(|error| failed(&path, &error))?;
        text.push_str(&format!("  {file}\n"));
    }
    text.push_str("README.md says what to do first.\n");
    output::print(&text)
}

/// A string that JSON and TOML read alike.
fn quoted(text: &str) -> String {
    let mut string = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => string.extend(['\\', c]),
            // JSON could do without for some of them, TOML not.
            c if c.is_control() => string.push_str(&format!("\\u{:04x}", c as u32)),
            c => string.push(c),
        }
    }
    string.push('"');
    string
}

/// `lift_valve-2` becomes `LiftValve2`; none if there is no letter to begin with.
fn class_name(name: &str) -> Option<String> {
    let mut class = String::new();
    let mut begins = true;
    for c in name.chars() {
        if c.is_ascii_alphanumeric() && !(class.is_empty() && c.is_ascii_digit()) {
            class.push(if begins { c.to_ascii_uppercase() } else { c });
        }
        begins = class.is_empty() || !c.is_ascii_alphanumeric();
    }
    // The library's own name would hide the library.
    if class == "Hyd" {
        class.push_str("Drive");
    }
    (!class.is_empty()).then_some(class)
}

#[cfg(test)]
mod tests {
    use super::{class_name, quoted};

    #[test]
    fn names_are_quoted_for_toml_and_json() {
        assert_eq!(quoted("a\"b\\c\n\u{7f}ö"), r#""a\"b\\c\u000a\u007fö""#);
    }

    #[test]
    fn names_of_folders_become_names_of_classes() {
        let classes = ["lift_valve-2", "4cylinders", "Äpfel", "hyd", "_", ""].map(class_name);
        let names = classes.each_ref().map(|class| class.as_deref());
        assert_eq!(names, [Some("LiftValve2"), Some("Cylinders"), Some("Pfel"), Some("HydDrive"), None, None]);
    }
}
