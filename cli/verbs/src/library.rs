//! Where classes come from: the package folder of the main file, library folders, the built-in standard library.
//!
//! A package is a folder with `package.hyd` (or `.mo`), a class in it is a file or a folder of its own, as Modelica 3.6, section
//! 13.4, lays packages out; file names are compared without case.  A folder's name need not be that of its package where
//! the `within` clause of the main file says which package it is.  Class names never become paths: they are only compared
//! with the names that folders list.
//!
//! A folder of libraries may hold several versions of one (`Fluids 1.2.0`, section 18.8.3); which one is meant is what the main file and the
//! libraries that were named say they use.  What such a library uses is also looked for beside it, last of all.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_compiler::{Code, Diagnostic, Head, SourceText, Sources, head, uses};

use crate::inside::{is_inside, refuse_outside};
use hyd_run::{TextError, read_text};

include!(concat!(env!("OUT_DIR"), "/standard_library.rs"));

mod chosen;

const EXTENSIONS: [&str; 2] = ["hyd", "mo"];
/// Texts and libraries that only the tool reads which they were encrypted for.
const ENCRYPTED: [&str; 2] = ["moe", "mol"];

/// A folder that is a package: the classes of `prefix` stand in it.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Root {
    /// Full name of the package; empty for a folder of libraries.
    prefix: Vec<String>,
    folder: PathBuf,
    /// The only file that counts, if the library is a file.
    file: Option<String>,
    /// The package, or one around it, of the main file.
    is_main: bool,
}

impl Root {
    fn folder(prefix: Vec<String>, folder: PathBuf) -> Self {
        Self { prefix, folder, file: None, is_main: false }
    }
}

/// A version of a library that a text says it uses.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Use {
    /// File or library that says so.
    by: String,
    library: String,
    version: String,
}

/// Library look-up in a fixed order: the package of the main file, the folders given, the built-in library.
#[derive(Debug, Default)]
pub struct LibraryPath {
    roots: Vec<Root>,
    /// Folders in which libraries that were named stand, with what these use.
    beside: Vec<(Vec<String>, PathBuf)>,
    /// What the main file and the libraries that were named use.
    uses: Vec<Use>,
    /// Libraries that were found: version, if they say one, and file.
    versions: BTreeMap<String, (Option<String>, String)>,
    /// What the user should know beside that.
    remarks: Vec<Diagnostic>,
    listings: BTreeMap<PathBuf, Vec<String>>,
    /// Files below this folder are named relative to it.
    base: Option<PathBuf>,
    /// Folders in which data files are looked for: that of the main file, those of the libraries.
    data: Vec<PathBuf>,
    /// Models may name data files elsewhere.
    allow_outside: bool,
    /// Folders outside of which no class is read; none: classes are read wherever packages have them.
    fences: Vec<PathBuf>,
    /// Texts that stand in the place of those of their files.
    open: Arc<BTreeMap<PathBuf, Arc<str>>>,
    /// Names of all classes, once somebody has asked for them.
    names: Option<Vec<String>>,
}

impl LibraryPath {
    /// Nothing but the built-in library.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names files below a folder relative to it, in messages and explanations.
    pub fn name_from(&mut self, base: &Path) {
        self.base = Some(base.to_path_buf());
    }

    /// Lets models name data files outside of these folders.
    pub fn allow_outside(&mut self) {
        self.allow_outside = true;
    }

    /// Reads no class that lies outside of this folder and of these, be it by the words of a text or by a link.
    pub fn fence(&mut self, folder: &Path, libraries: &[PathBuf]) {
        self.fences = [folder].into_iter().map(Path::to_path_buf).chain(libraries.iter().cloned()).collect();
    }

    /// May this be looked at?
    fn is_allowed(&self, path: &Path) -> bool {
        self.fences.is_empty() || is_inside(path, &self.fences)
    }

    /// Reads these texts in the place of those of their files, as an editor has them before they are saved; files that do not exist
    /// yet are found, too.
    pub fn open_texts(&mut self, texts: Arc<BTreeMap<PathBuf, Arc<str>>>) {
        self.open = texts;
    }

    /// Adds the folder of the main file if its text says that it belongs to a package.
    pub fn add_main_file(&mut self, file: &Path, text: &str) {
        let Head { within, package, .. } = head(text);
        let mut prefix = within;
        let is_package_file =
            EXTENSIONS.iter().any(|extension| file_name(file).eq_ignore_ascii_case(&format!("package.{extension}")));
        if is_package_file {
            prefix.extend(package);
        }
        let mut folder = folder_of(file);
        self.data.insert(0, folder.clone());
        self.add_uses(&format!("`{}`", file.display()), text);
        while !prefix.is_empty() {
            self.roots.push(Root { is_main: true, ..Root::folder(prefix.clone(), folder.clone()) });
            let parent = parent_of(&folder);
            // What the library uses that the file belongs to may stand beside that.
            if let [library] = &prefix[..]
                && let Ok(Some(whole)) = self.read(&folder, "package")
            {
                self.add_library(std::slice::from_ref(library), &whole.text, &parent);
            }
            prefix.pop();
            folder = parent;
        }
    }

    /// The folder of the package that the main file belongs to, the outermost one; none if it stands alone.
    pub fn main_package(&self) -> Option<&Path> {
        let main = self.roots.iter().filter(|root| root.is_main);
        main.min_by_key(|root| root.prefix.len()).map(|root| root.folder.as_path())
    }

    /// Adds a folder of libraries, a folder that is a library itself, or the file of one.  `Err`: why it cannot be used.
    pub fn add_folder(&mut self, folder: &Path) -> Result<(), String> {
        if folder.is_file() {
            return self.add_file(folder);
        }
        let names = self.list(folder).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => format!("there is no library folder `{}`", folder.display()),
            _ => format!("the library folder `{}` cannot be read: {error}", folder.display()),
        })?;
        self.data.push(folder.to_path_buf());
        let Some(name) = file_of(&names, "package") else {
            if ENCRYPTED.iter().any(|extension| same_name(&names, &format!("package.{extension}")).is_some()) {
                return Err(encrypted(&file_name(folder), folder));
            }
            self.roots.push(Root::folder(Vec::new(), folder.to_path_buf()));
            return Ok(());
        };
        let text = read_text(&folder.join(name)).map_err(|error| error.to_string())?;
        let Head { mut within, package, .. } = head(&text);
        within.extend(package);
        self.add_library(&within, &text, &parent_of(folder));
        self.roots.push(Root::folder(within, folder.to_path_buf()));
        Ok(())
    }

    /// Adds a folder that other tools look into as well: one that cannot be used is no reason to end.
    pub fn add_common_folder(&mut self, folder: &Path) {
        if let Err(sentence) = self.add_folder(folder) {
            self.remarks.push(Diagnostic::warning(Code::FileAccess, format!("{sentence} (named by `MODELICAPATH`)")));
        }
    }

    /// Adds a library that is one file.
    fn add_file(&mut self, file: &Path) -> Result<(), String> {
        let name = file_name(file);
        let has_extension = |extension: &str| name.to_lowercase().ends_with(&format!(".{extension}"));
        if ENCRYPTED.iter().any(|extension| has_extension(extension)) {
            return Err(encrypted(&name, file));
        }
        if !EXTENSIONS.iter().any(|extension| has_extension(extension)) {
            return Err(format!(
                "`{}` is not a library: it is neither a folder nor a `.mo` or `.hyd` file",
                file.display()
            ));
        }
        let folder = folder_of(file);
        let stem = name.rsplit_once('.').map_or(&*name, |(stem, _)| stem);
        if stem.eq_ignore_ascii_case("package") {
            return self.add_folder(&folder);
        }
        let text = read_text(file).map_err(|error| error.to_string())?;
        let Head { within: mut prefix, package, .. } = head(&text);
        prefix.push(package.unwrap_or_else(|| stem.to_string()));
        self.add_library(&prefix, &text, &folder);
        self.data.push(folder.clone());
        self.roots.push(Root { prefix, folder, file: Some(name), is_main: false });
        Ok(())
    }

    /// What a library uses, and where that may stand: beside it.
    fn add_library(&mut self, path: &[String], text: &str, folder: &Path) {
        let used = self.add_uses(&format!("`{}`", path.join(".")), text);
        if path.len() == 1 && !used.is_empty() {
            self.beside.push((used, folder.to_path_buf()));
        }
    }

    /// Takes note of what a text uses; the names of the libraries.
    fn add_uses(&mut self, by: &str, text: &str) -> Vec<String> {
        let used = uses(text);
        let names = used.iter().map(|(library, _)| library.clone()).collect();
        self.uses.extend(used.into_iter().map(|(library, version)| Use { by: by.into(), library, version }));
        names
    }

    /// Names in a folder, sorted; a folder is read once.
    fn list(&mut self, folder: &Path) -> io::Result<Vec<String>> {
        if let Some(names) = self.listings.get(folder) {
            return Ok(names.clone());
        }
        if !self.is_allowed(folder) {
            return Err(io::ErrorKind::NotFound.into());
        }
        let mut names = Vec::new();
        let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        for entry in std::fs::read_dir(place)? {
            // A name that is not Unicode text is not a class's name.
            names.extend(entry?.file_name().into_string().ok());
        }
        let open = self.open.keys().filter(|file| file.parent() == Some(folder));
        names.extend(open.filter_map(|file| file.file_name()?.to_str().map(str::to_string)));
        names.sort();
        names.dedup();
        self.listings.insert(folder.to_path_buf(), names.clone());
        Ok(names)
    }

    /// The text of the class with the names `rest` within `folder`.
    fn find_in(&mut self, folder: &Path, rest: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let mut folder = folder.to_path_buf();
        let (last, inner) = match rest.split_last() {
            None => return self.read(&folder, "package"),
            Some((last, inner)) => (last, inner),
        };
        for name in inner {
            match self.entry(&folder, name)? {
                Some(entry) => folder.push(entry),
                None => return Ok(None),
            }
        }
        if let Some(entry) = self.entry(&folder, last)?
            && folder.join(&entry).is_dir()
            && let Some(text) = self.read(&folder.join(entry), "package")?
        {
            return Ok(Some(text));
        }
        self.read(&folder, last)
    }

    /// The name in a folder that is `name` but for case; `None` if there is none or no such folder.
    fn entry(&mut self, folder: &Path, name: &str) -> Result<Option<String>, String> {
        match self.list(folder) {
            Ok(names) => Ok(same_name(&names, name)),
            Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => Ok(None),
            Err(error) => Err(format!("the folder `{}` cannot be read: {error}", folder.display())),
        }
    }

    fn read(&mut self, folder: &Path, stem: &str) -> Result<Option<SourceText>, String> {
        // The file of the folder itself is not that of a class in it that is called `Package`.
        let is_named_so = stem != "package" && stem.eq_ignore_ascii_case("package");
        for extension in EXTENSIONS {
            let file = format!("{stem}.{extension}");
            if let Some(name) = self.entry(folder, &file)?.filter(|name| !is_named_so || *name == file) {
                return self.read_file(&folder.join(name));
            }
        }
        for extension in ENCRYPTED {
            if let Some(name) = self.entry(folder, &format!("{stem}.{extension}"))? {
                let whole = file_name(folder);
                return Err(encrypted(if stem == "package" { &whole } else { stem }, &folder.join(name)));
            }
        }
        Ok(None)
    }

    fn read_file(&mut self, path: &Path) -> Result<Option<SourceText>, String> {
        if !self.is_allowed(path) {
            return Ok(None);
        }
        let text: Arc<str> = match self.open.get(path) {
            Some(text) => text.clone(),
            None => read_text(path).map_err(|error| error.to_string())?.into(),
        };
        let short = self.base.as_ref().and_then(|base| path.strip_prefix(base).ok()).unwrap_or(path);
        Ok(Some(SourceText { name: short.display().to_string().into(), text }))
    }
}

impl LibraryPath {
    /// The text of a class at the top of a folder of libraries, in a file whose name differs from it in underscores, too: `small_drag.hyd` may
    /// hold `SmallDrag`.  Asked last, so that it hides no class.
    fn nearly_named(&mut self, path: &[Arc<str>]) -> Option<SourceText> {
        let [name] = path else { return None };
        let folders: Vec<PathBuf> =
            self.roots.iter().filter(|root| root.prefix.is_empty()).map(|root| root.folder.clone()).collect();
        for folder in folders {
            for extension in EXTENSIONS {
                let Ok(names) = self.list(&folder) else { continue };
                let Some(file) = nearly_same_name(&names, &format!("{name}.{extension}")) else { continue };
                let stem = file.strip_suffix(&format!(".{extension}")).unwrap_or(&file).to_string();
                match self.read(&folder, &stem) {
                    Ok(Some(source)) if declares(&source.text, name) => return Some(source),
                    _ => {}
                }
            }
        }
        None
    }
}

impl Sources for LibraryPath {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let mut fitting: Vec<Root> =
            self.roots.iter().filter(|root| starts_with(path, &root.prefix)).cloned().collect();
        // The package of the main file first, its inner folders before the outer; folders of libraries in their order.
        fitting.sort_by_key(|root| Reverse(if root.is_main { root.prefix.len() } else { 0 }));
        for root in fitting {
            let found = match &root.file {
                Some(name) if path.len() == root.prefix.len() => self.read_file(&root.folder.join(name))?,
                Some(_) => None,
                None if root.prefix.is_empty() => self.find_library(&root.folder, path)?,
                None => self.find_in(&root.folder, &path[root.prefix.len()..])?,
            };
            if let Some(found) = found {
                self.follow(path, &found, None);
                return Ok(Some(found));
            }
        }
        if let Some(found) = built_in(path) {
            return Ok(Some(found));
        }
        for (names, folder) in self.beside.clone() {
            if path.first().is_some_and(|first| names.iter().any(|name| **name == **first))
                && let Some(found) = self.find_library(&folder, path)?
            {
                self.follow(path, &found, Some(&folder));
                return Ok(Some(found));
            }
        }
        Ok(self.nearly_named(path))
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        let path = Path::new(name);
        let found = match name.strip_prefix("modelica://") {
            Some(resource) => self.resource(resource)?,
            None => self.data.iter().map(|folder| folder.join(path)).find(|path| path.exists()),
        };
        let found = found.unwrap_or_else(|| path.to_path_buf());
        if !self.allow_outside && found.exists() {
            refuse_outside(name, &found, &self.data)?;
        }
        if found.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mat")) && found.is_file() {
            return matrices_as_text(&found).map_err(|sentence| format!("`{}`: {sentence}", found.display()));
        }
        let text = read_text(&found).map_err(|error| match self.data.first() {
            Some(folder) if matches!(error, TextError::Io { .. }) => format!("{error} in `{}`", folder.display()),
            _ => error.to_string(),
        })?;
        Ok(text.into())
    }

    fn remarks(&mut self) -> Vec<Diagnostic> {
        self.remarks.iter().cloned().chain(self.wrong_versions()).collect()
    }

    fn class_names(&mut self) -> Vec<String> {
        if let Some(names) = &self.names {
            return names.clone();
        }
        let mut names = Vec::new();
        for Root { prefix, folder, file, .. } in self.roots.clone() {
            match file {
                Some(_) => names.push(prefix.join(".")),
                None => self.collect_names(&folder, &prefix, &mut names),
            }
        }
        let built_in = STANDARD_LIBRARY.iter().filter_map(|(name, _)| {
            let stem = name.strip_suffix("/package.hyd").or_else(|| name.strip_suffix(".hyd"))?;
            Some(stem.replace('/', "."))
        });
        names.extend(built_in);
        self.names = Some(names.clone());
        names
    }
}

impl LibraryPath {
    /// The file that a resource of a library is (Modelica 3.6, section 13.5): `Library.Package/path` lies in the folder of the package.
    /// None where no folder is that of the package.
    fn resource(&mut self, name: &str) -> Result<Option<PathBuf>, String> {
        let Some((package, path)) = name.split_once('/') else { return Ok(None) };
        let names: Vec<&str> = package.split('.').collect();
        let beside =
            self.beside.iter().filter(|(used, _)| names.first().is_some_and(|name| used.iter().any(|own| own == name)));
        let beside: Vec<Root> = beside.map(|(_, folder)| Root::folder(Vec::new(), folder.clone())).collect();
        for root in self.roots.clone().into_iter().chain(beside) {
            let is_above = root.prefix.iter().map(String::as_str).eq(names.iter().take(root.prefix.len()).copied());
            if !is_above || names.len() < root.prefix.len() {
                continue;
            }
            let mut folder = Some(root.folder);
            for (k, name) in names.iter().enumerate().skip(root.prefix.len()) {
                folder = match folder {
                    Some(folder) if k == 0 => self.library_entry(&folder, name)?.map(|entry| folder.join(entry)),
                    Some(folder) => self.entry(&folder, name)?.map(|entry| folder.join(entry)),
                    None => None,
                };
            }
            if let Some(file) = folder.map(|folder| folder.join(path)).filter(|file| file.exists()) {
                return Ok(Some(file));
            }
        }
        Ok(None)
    }
}

/// Most names that are collected for suggestions.
const MOST_NAMES: usize = 5000;
/// Deepest folder that is looked into for suggestions.
const DEEPEST: usize = 8;

impl LibraryPath {
    /// Full names of the classes that stand as files in a folder and below.
    fn collect_names(&mut self, folder: &Path, prefix: &[String], names: &mut Vec<String>) {
        if prefix.len() > DEEPEST || names.len() > MOST_NAMES {
            return;
        }
        for entry in self.list(folder).unwrap_or_default() {
            let stem = EXTENSIONS.iter().find_map(|e| entry.strip_suffix(&format!(".{e}")));
            let mut full = prefix.to_vec();
            full.push(stem.unwrap_or(&entry).to_string());
            match stem {
                Some(stem) if !stem.eq_ignore_ascii_case("package") => names.push(full.join(".")),
                Some(_) => {}
                None if folder.join(&entry).is_dir() => {
                    let path = folder.join(&entry);
                    let package = self.list(&path).is_ok_and(|inner| file_of(&inner, "package").is_some());
                    if package {
                        names.push(full.join("."));
                        self.collect_names(&path, &full, names);
                    }
                }
                None => {}
            }
        }
    }
}

/// Names and texts of the built-in standard library, by name.
pub fn built_in_texts() -> impl Iterator<Item = (&'static str, &'static str)> {
    STANDARD_LIBRARY.iter().copied().filter(|(name, _)| name.ends_with(".hyd"))
}

/// What `package.order` beside a `package.hyd` of the built-in standard library says.
pub fn built_in_order(package: &str) -> &'static str {
    let wanted = package.strip_suffix("package.hyd").map(|folder| format!("{folder}package.order"));
    STANDARD_LIBRARY.iter().find(|(name, _)| wanted.as_deref() == Some(*name)).map_or("", |(_, text)| text)
}

/// Why a library or a class of one is not read.
fn encrypted(name: &str, file: &Path) -> String {
    format!("`{name}` is encrypted (`{}`): only the tool that it was made for can read it", file.display())
}

/// A text of the built-in standard library.
fn built_in(path: &[Arc<str>]) -> Option<SourceText> {
    let stem = path.join("/");
    let wanted = [format!("{stem}/package.hyd"), format!("{stem}.hyd")];
    wanted.iter().find_map(|wanted| {
        let &(name, text) = STANDARD_LIBRARY.iter().find(|(name, _)| name.eq_ignore_ascii_case(wanted))?;
        Some(SourceText { name: format!("<built-in>/{name}").into(), text: text.into() })
    })
}

fn starts_with(path: &[Arc<str>], prefix: &[String]) -> bool {
    path.len() >= prefix.len() && path.iter().zip(prefix).all(|(a, b)| **a == **b)
}

/// True if a text declares a class of this name, as far as its words tell.
fn declares(text: &str, name: &str) -> bool {
    let mut before = "";
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty()).any(|word| {
        let is_class =
            matches!(before, "model" | "block" | "class" | "record" | "connector" | "type" | "package" | "function");
        before = word;
        is_class && word == name
    })
}

/// The name that differs from this one in case and underscores only.
fn nearly_same_name(names: &[String], wanted: &str) -> Option<String> {
    fn bare(name: &str) -> impl Iterator<Item = u8> {
        name.bytes().filter(|&byte| byte != b'_').map(|byte| byte.to_ascii_lowercase())
    }
    names.iter().find(|name| bare(name).eq(bare(wanted))).cloned()
}

/// The name as written, else the first that differs in case only.
fn same_name(names: &[String], wanted: &str) -> Option<String> {
    fn lower(name: &str) -> impl Iterator<Item = char> {
        name.chars().flat_map(char::to_lowercase)
    }
    let exact = names.iter().find(|name| *name == wanted);
    exact.or_else(|| names.iter().find(|name| lower(name).eq(lower(wanted)))).cloned()
}

fn file_of(names: &[String], stem: &str) -> Option<String> {
    EXTENSIONS.iter().find_map(|extension| same_name(names, &format!("{stem}.{extension}")))
}

fn file_name(file: &Path) -> String {
    file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

fn folder_of(file: &Path) -> PathBuf {
    match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// The folder above: by name where the path shows it, else by `..`.
fn parent_of(folder: &Path) -> PathBuf {
    match folder.components().next_back() {
        Some(std::path::Component::Normal(_)) => folder_of(folder),
        _ => folder.join(".."),
    }
}

/// The matrices of a MAT file in the form in which tables of models are read, with all digits.
fn matrices_as_text(path: &Path) -> Result<Arc<str>, String> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    if bytes.starts_with(b"#1") {
        // A table as a text, whatever its name.
        return String::from_utf8(bytes).map(Into::into).map_err(|_| "it is not UTF-8 text".to_string());
    }
    let mut text = String::from("#1\n");
    for (name, rows) in hyd_results::mat_matrices(&bytes)? {
        let columns = rows.first().map_or(0, Vec::len);
        // Writing into a text cannot fail.
        let _ = writeln!(text, "double {name}({},{columns})", rows.len());
        for row in rows {
            for value in row {
                let _ = write!(text, "{value:e} ");
            }
            text.push('\n');
        }
    }
    Ok(text.into())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
