//! Data files that a model reads when it is translated, and a model whose files have other names.
//!
//! A model may read tables (`csvColumn`) from files beside it or in folders of libraries.  Which ones it reads is known once it has been
//! translated: the way to the libraries is watched.

use std::collections::BTreeMap;
use std::path::{Component, Path};
use std::sync::{Arc, Mutex, PoisonError};

use hyd_compiler::{SourceText, Sources, print_string};

use crate::Fault;
use crate::variant::{Insert, Workshop};

/// Folder for copies of files that cannot keep their names.
const FOLDER: &str = "data";

/// Texts of data files by the names under which a model reads them.
pub type DataFiles = BTreeMap<String, Arc<str>>;

/// A way to libraries that keeps what data is read, and knows data of its own.
struct Watched {
    inner: Box<dyn Sources>,
    own: Arc<DataFiles>,
    read: Arc<Mutex<DataFiles>>,
}

impl Sources for Watched {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        self.inner.find(path)
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        let text = match self.own.get(name) {
            Some(text) => text.clone(),
            None => self.inner.data(name)?,
        };
        self.read.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_string(), text.clone());
        Ok(text)
    }

    fn class_names(&mut self) -> Vec<String> {
        self.inner.class_names()
    }
}

/// What `work` makes of a workshop that finds `own` data before that of the libraries, and the data that was read meanwhile.
///
/// # Errors
/// Those of `work`.
pub(crate) fn watched<T>(
    workshop: &Workshop<'_>,
    own: &DataFiles,
    work: &dyn Fn(&Workshop<'_>) -> Result<T, Fault>,
) -> Result<(T, DataFiles), Fault> {
    let (read, own) = (Arc::<Mutex<DataFiles>>::default(), Arc::new(own.clone()));
    let make = || -> Box<dyn Sources> {
        Box::new(Watched { inner: (workshop.sources)(), own: own.clone(), read: read.clone() })
    };
    let made = work(&Workshop { sources: &make, ..workshop.clone() })?;
    let files = read.lock().unwrap_or_else(PoisonError::into_inner).clone();
    Ok((made, files))
}

impl Workshop<'_> {
    /// The data files that a model with effects reads.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn data_files(&self, inserts: &[Insert]) -> Result<DataFiles, Fault> {
        watched(self, &DataFiles::new(), &|watched| watched.files(inserts)).map(|(_, files)| files)
    }
}

/// True for a name that leads to a file in a folder or below, whatever the folder is.
pub fn is_below(name: &str) -> bool {
    let path = Path::new(name);
    !name.contains('\\') && path.components().all(|part| matches!(part, Component::Normal(_)))
}

/// A text whose data files can stand in one folder and below, those files by their names there, and the names of files that the
/// text does not spell out and that cannot be there for this reason.  `is_taken`: names of other files of that folder.
pub(crate) fn settled(
    text: &str,
    files: &DataFiles,
    is_taken: &dyn Fn(&str) -> bool,
) -> (String, DataFiles, Vec<String>) {
    let stays = |name: &str| is_below(name) && !is_taken(name);
    let (mut text, mut lost) = (text.to_string(), Vec::new());
    let mut settled: DataFiles =
        files.iter().filter(|(name, _)| stays(name)).map(|(a, b)| (a.clone(), b.clone())).collect();
    for (name, content) in files.iter().filter(|(name, _)| !stays(name)) {
        let spelled = print_string(name);
        if !text.contains(&spelled) {
            lost.push(name.clone());
            continue;
        }
        let last =
            name.rsplit(['/', '\\']).next().filter(|last| !last.is_empty() && is_below(last)).unwrap_or("table.csv");
        let numbered = (2_u32..).map(|k| format!("{FOLDER}/{k}_{last}"));
        let mut names = std::iter::once(format!("{FOLDER}/{last}")).chain(numbered);
        // There is a name for every number.
        let free = names.find(|free| !settled.contains_key(free) && !is_taken(free)).unwrap_or_default();
        text = text.replace(&spelled, &print_string(&free));
        settled.insert(free, content.clone());
    }
    (text, settled, lost)
}

#[cfg(test)]
mod tests {
    use super::{DataFiles, settled};

    #[test]
    fn files_keep_their_names_where_these_lead_nowhere_else() {
        let names = ["data/u.csv", "/lab/u.csv", "../u.csv", "report.json", "made/by/parts.csv/../x"];
        let files: DataFiles = names.iter().map(|name| (name.to_string(), format!("of {name}").into())).collect();
        let text = names[..4].iter().map(|name| format!("t(\"{name}\");\n")).collect::<String>();
        let (text, found, lost) = settled(&text, &files, &|name| name == "report.json");
        assert_eq!(text, "t(\"data/u.csv\");\nt(\"data/3_u.csv\");\nt(\"data/2_u.csv\");\nt(\"data/report.json\");\n");
        let found: Vec<(&str, &str)> = found.iter().map(|(name, text)| (name.as_str(), &**text)).collect();
        let wanted = [
            ("data/2_u.csv", "of ../u.csv"),
            ("data/3_u.csv", "of /lab/u.csv"),
            ("data/report.json", "of report.json"),
            ("data/u.csv", "of data/u.csv"),
        ];
        assert_eq!(found, wanted);
        assert_eq!(lost, ["made/by/parts.csv/../x"]);
    }
}
