//! Which version of a library is taken where a folder holds several, and what is said if it is not the one that is used.

use std::path::Path;
use std::sync::Arc;

use hyd_compiler::{Code, Diagnostic, SourceText, compare_versions, version};

use super::{EXTENSIONS, LibraryPath};

impl LibraryPath {
    /// The text of a class of a library in a folder of libraries: of the version that is used, else of the folder or file without a version,
    /// else of the latest one.
    pub(super) fn find_library(&mut self, folder: &Path, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let Some((name, rest)) = path.split_first() else { return Ok(None) };
        let exact = self.exact_version(folder, name);
        if exact.is_none()
            && let Some(found) = self.find_in(folder, path)?
        {
            return Ok(Some(found));
        }
        let Some(entry) = exact.or_else(|| self.latest_version(folder, name)) else { return Ok(None) };
        let place = folder.join(entry);
        match rest {
            rest if place.is_dir() => self.find_in(&place, rest),
            [] => self.read_file(&place),
            _ => Ok(None),
        }
    }

    /// The folder or file of a library in a folder of libraries.
    pub(super) fn library_entry(&mut self, folder: &Path, name: &str) -> Result<Option<String>, String> {
        if let Some(exact) = self.exact_version(folder, name) {
            return Ok(Some(exact));
        }
        Ok(self.entry(folder, name)?.or_else(|| self.latest_version(folder, name)))
    }

    fn exact_version(&mut self, folder: &Path, name: &str) -> Option<String> {
        let used: Vec<String> =
            self.uses.iter().filter(|used| used.library == name).map(|used| used.version.clone()).collect();
        let versions = self.listed_versions(folder, name);
        let of = |used: &String| versions.iter().find(|(version, _)| compare_versions(version, used).is_eq());
        used.iter().find_map(of).map(|(_, entry)| entry.clone())
    }

    fn latest_version(&mut self, folder: &Path, name: &str) -> Option<String> {
        let versions = self.listed_versions(folder, name).into_iter();
        versions.max_by(|(a, _), (b, _)| compare_versions(a, b)).map(|(_, entry)| entry)
    }

    /// The versions of a library that stand in a folder as `Name 1.2.0` or `Name 1.2.0.mo`, with these names.
    fn listed_versions(&mut self, folder: &Path, name: &str) -> Vec<(String, String)> {
        let names = self.list(folder).unwrap_or_default();
        let version = |entry: &String| {
            let rest = entry.strip_prefix(name)?.strip_prefix(' ')?;
            let suffix = EXTENSIONS.iter().find_map(|extension| rest.strip_suffix(&format!(".{extension}")));
            let version = suffix.unwrap_or(rest);
            version.starts_with(|c: char| c.is_ascii_digit()).then(|| (version.to_string(), entry.clone()))
        };
        names.iter().filter_map(version).collect()
    }

    /// Takes note of a library that was found: of its version, and of what it uses.  What stands beside it counts only for a library that stands
    /// beside a named one itself.
    pub(super) fn follow(&mut self, path: &[Arc<str>], found: &SourceText, beside: Option<&Path>) {
        let [name] = path else { return };
        if self.versions.contains_key(&**name) {
            return;
        }
        self.versions.insert(name.to_string(), (version(&found.text), found.name.to_string()));
        let used = self.add_uses(&format!("`{name}`"), &found.text);
        if let Some(folder) = beside {
            if !used.is_empty() {
                self.beside.push((used, folder.to_path_buf()));
            }
            // Its data files lie in it.
            if let Ok(Some(entry)) = self.library_entry(folder, name) {
                self.data.push(folder.join(entry));
            }
        }
    }

    /// Warnings where a library is older than the one that a text uses, or of another main version, whichever of the two was read first.
    pub(super) fn wrong_versions(&self) -> Vec<Diagnostic> {
        let main = |version: &str| version.split('.').next().unwrap_or_default().to_string();
        let mut sentences: Vec<String> = Vec::new();
        for used in &self.uses {
            let Some((Some(own), file)) = self.versions.get(&used.library) else { continue };
            if compare_versions(own, &used.version).is_lt() || main(own) != main(&used.version) {
                let sentence = format!(
                    "{} uses `{}` {}, and {own} was found in `{file}`: what changed between the two may be missing or mean something else",
                    used.by, used.library, used.version
                );
                if !sentences.contains(&sentence) {
                    sentences.push(sentence);
                }
            }
        }
        sentences.into_iter().map(|sentence| Diagnostic::warning(Code::LibraryVersion, sentence)).collect()
    }
}
