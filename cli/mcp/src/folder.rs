//! The folder that a server works in: no name that a client sends leads out of it, be it by `..`, by a link or by its beginning, and nothing that
//! stood there before is written over.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use hyd_results::partial;
use hyd_verbs::inside::real;

/// The folder, and what was written in it.
#[derive(Debug)]
pub(crate) struct Folder {
    root: PathBuf,
    written: RefCell<BTreeSet<PathBuf>>,
}

impl Folder {
    /// Makes a folder the current one.
    pub(crate) fn enter(path: &Path) -> Result<Self, String> {
        let shown = path.display();
        let root = path.canonicalize().map_err(|error| format!("the folder `{shown}` cannot be served: {error}"))?;
        std::env::set_current_dir(&root).map_err(|error| format!("the folder `{shown}` cannot be served: {error}"))?;
        Ok(Self { root, written: RefCell::default() })
    }

    /// Where it is.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// The place of a name, relative to the folder; links are followed.  `argument`: who gives the name.
    fn place(&self, argument: &str, name: &str) -> Result<PathBuf, String> {
        if name.trim().is_empty() || name.contains('\0') {
            return Err(format!(
                "`{argument}` is the name of no file: give a path relative to the folder that is served"
            ));
        }
        let place = real(&self.root.join(name));
        let inside = place.strip_prefix(&self.root).map_err(|_| {
            format!(
                "`{argument}`: `{name}` lies outside of the folder that is served; names are relative to that folder and lead nowhere else"
            )
        })?;
        Ok(if inside.as_os_str().is_empty() { PathBuf::from(".") } else { inside.to_path_buf() })
    }

    /// A file that is to be read.
    pub(crate) fn file(&self, argument: &str, name: &str) -> Result<PathBuf, String> {
        let place = self.place(argument, name)?;
        if place.is_file() {
            return Ok(place);
        }
        if place.is_dir() {
            return Err(format!("`{argument}`: `{name}` is a folder, and a file is needed"));
        }
        let near = self.near(&place).map_or_else(String::new, |near| format!("; {near}"));
        Err(format!("`{argument}`: there is no file `{name}` in the folder that is served{near}"))
    }

    /// A folder with libraries that is to be read.
    pub(crate) fn library(&self, argument: &str, name: &str) -> Result<PathBuf, String> {
        let place = self.place(argument, name)?;
        match place.is_dir() {
            true => Ok(place),
            false => Err(format!("`{argument}`: there is no folder `{name}` in the folder that is served")),
        }
    }

    /// What a name that is not there may have meant.
    fn near(&self, place: &Path) -> Option<String> {
        let folder = self.root.join(place.parent()?);
        let entries = std::fs::read_dir(folder).ok()?;
        let names: Vec<String> = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
        hyd_source::did_you_mean(place.file_name()?.to_str()?, names.iter().map(String::as_str))
    }

    /// A file that is to be written: a new one, or one that this server has written.
    pub(crate) fn target(&self, argument: &str, name: &str, endings: &[&str]) -> Result<PathBuf, String> {
        let place = self.place(argument, name)?;
        let ending = place.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if !endings.contains(&ending.as_str()) {
            let endings: Vec<String> = endings.iter().map(|ending| format!(".{ending}")).collect();
            return Err(format!("`{argument}`: `{name}` must end in {}", endings.join(" or ")));
        }
        for path in [place.clone(), partial(&place)] {
            // A link that leads nowhere is something that stands there, too.
            if path.symlink_metadata().is_ok() && !self.written.borrow().contains(&path) {
                return Err(format!(
                    "`{argument}`: `{}` is there already, and this server did not write it; choose another name",
                    path.display()
                ));
            }
        }
        Ok(place)
    }

    /// From now on these may be written over.
    pub(crate) fn wrote(&self, place: &Path) {
        self.written.borrow_mut().extend([place.to_path_buf(), partial(place)]);
    }

    /// A folder that is to be filled: a new one, an empty one, or one that `mark` shows to be of the same kind.
    pub(crate) fn target_folder(&self, argument: &str, name: &str, mark: &str) -> Result<PathBuf, String> {
        let place = self.place(argument, name)?;
        if place == Path::new(".") {
            return Err(format!(
                "`{argument}`: the folder that is served itself is not written to; give the name of a folder in it"
            ));
        }
        let is_empty = std::fs::read_dir(&place).is_ok_and(|mut entries| entries.next().is_none());
        if place.symlink_metadata().is_err() || is_empty {
            return Ok(place);
        }
        if place.join(mark).is_file() {
            return match holds_link(&place) {
                false => Ok(place),
                true => Err(format!(
                    "`{argument}`: `{name}` holds a link, which may lead elsewhere; choose the name of a new folder"
                )),
            };
        }
        Err(format!(
            "`{argument}`: `{name}` is there already and holds no `{mark}` of an earlier call; choose the name of a new folder"
        ))
    }
}

/// Is there a link in a folder or below?
fn holds_link(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return true };
    entries.flatten().any(|entry| match entry.file_type() {
        Ok(kind) => kind.is_symlink() || kind.is_dir() && holds_link(&entry.path()),
        Err(_) => true,
    })
}
