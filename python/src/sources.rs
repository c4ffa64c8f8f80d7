//! Texts of a model that remember what was asked for, so that a model can be translated again where its files are not.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use hyd_compiler::{SourceText, Sources};
use hyd_verbs::{Libraries, LibraryPath};
use serde_json::{Map, Value, json};

/// What a translation has asked for, with the answers.
#[derive(Clone, Default)]
struct Answers {
    classes: BTreeMap<String, Option<SourceText>>,
    data: BTreeMap<String, Arc<str>>,
}

/// The text of a model and where its classes come from.
pub(crate) struct Texts {
    /// Name in messages.
    pub(crate) name: String,
    /// The text.
    pub(crate) text: Arc<str>,
    /// Its file; none for a text from memory.
    file: Option<PathBuf>,
    /// The folder of the process when the text was loaded: messages name files from here.
    base: Option<PathBuf>,
    libraries: Libraries,
    /// Came by pickle, with its texts; folders may be elsewhere.
    travelled: bool,
    answers: Mutex<Answers>,
}

impl Texts {
    /// Files and folders are found again when the process has gone to another folder.
    pub(crate) fn new(name: String, text: String, file: Option<PathBuf>, libraries: &Libraries) -> Self {
        let base = std::env::current_dir().ok();
        // A text from memory stands in the folder of the process.
        let file = file.map(|file| std::path::absolute(&file).unwrap_or(file));
        let (libraries, answers) = (libraries.fixed(), Mutex::default());
        Self { name, text: text.into(), file, base, libraries, travelled: false, answers }
    }

    /// The way to the classes.  What was asked before is answered as before.
    ///
    /// # Errors
    /// Why a folder of libraries cannot be used.
    pub(crate) fn sources(&self) -> Result<Remembering<'_>, String> {
        let known = self.answers.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let beside = self.base.as_deref().unwrap_or(Path::new("")).join("text");
        // A model that came by pickle brings its texts along; what else it asks for says which folder is missing.
        let (mut inner, missing) = match self.libraries.path(self.file.as_deref().unwrap_or(&beside), &self.text) {
            Err(missing) if self.travelled => (LibraryPath::new(), Some(missing)),
            other => (other?, None),
        };
        if let Some(base) = &self.base {
            inner.name_from(base);
        }
        Ok(Remembering { texts: self, known, inner, missing })
    }

    /// Everything as JSON.
    pub(crate) fn state(&self) -> Value {
        let answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        let text = |text: &SourceText| json!([*text.name, *text.text]);
        let classes =
            answers.classes.iter().map(|(name, found)| (name.clone(), found.as_ref().map_or(Value::Null, text)));
        let data = answers.data.iter().map(|(name, text)| (name.clone(), json!(**text)));
        // A path that is no Unicode text is none elsewhere.
        let path = |path: &PathBuf| path.to_string_lossy().into_owned();
        let folders: Vec<String> = self.libraries.folders.iter().map(path).collect();
        json!({"name": self.name, "text": *self.text, "file": self.file.as_ref().map(path), "base": self.base.as_ref().map(path),
            "folders": folders, "allow_outside": self.libraries.allow_outside, "classes": classes.collect::<Map<_, _>>(), "data": data.collect::<Map<_, _>>()})
    }

    /// From what `state` gave.  None for anything else.
    pub(crate) fn from_state(state: &Value) -> Option<Self> {
        let text = |value: &Value| value.as_str().map(str::to_string);
        let classes = state["classes"].as_object()?.iter().map(|(name, found)| {
            let found = match found {
                Value::Null => None,
                own => Some(SourceText { name: own[0].as_str()?.into(), text: own[1].as_str()?.into() }),
            };
            Some((name.clone(), found))
        });
        let data = state["data"].as_object()?.iter().map(|(name, text)| Some((name.clone(), text.as_str()?.into())));
        let answers = Answers { classes: classes.collect::<Option<_>>()?, data: data.collect::<Option<_>>()? };
        let folders = state["folders"].as_array()?.iter().map(|folder| text(folder).map(PathBuf::from));
        let (folders, allow_outside) = (folders.collect::<Option<_>>()?, state["allow_outside"].as_bool()?);
        Some(Self {
            name: text(&state["name"])?,
            text: text(&state["text"])?.into(),
            file: text(&state["file"]).map(PathBuf::from),
            base: text(&state["base"]).map(PathBuf::from),
            libraries: Libraries { folders, complete: true, allow_outside, fence: None },
            travelled: true,
            answers: Mutex::new(answers),
        })
    }
}

/// Sources that remember.
pub(crate) struct Remembering<'a> {
    texts: &'a Texts,
    known: Answers,
    inner: LibraryPath,
    /// Why the folders cannot be used.
    missing: Option<String>,
}

impl Remembering<'_> {
    /// True for the classes of a package that the built-in library has given before.
    fn is_built_in(&self, path: &[Arc<str>]) -> bool {
        let first = path.first().and_then(|name| self.known.classes.get(&**name));
        matches!(first, Some(Some(text)) if text.name.starts_with("<built-in>"))
    }
}

impl Sources for Remembering<'_> {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let name = path.join(".");
        if let Some(found) = self.known.classes.get(&name) {
            return Ok(found.clone());
        }
        if let Some(missing) = self.missing.as_ref().filter(|_| !self.is_built_in(path)) {
            return Err(missing.clone());
        }
        let found = self.inner.find(path)?;
        self.texts.answers.lock().unwrap_or_else(PoisonError::into_inner).classes.insert(name, found.clone());
        Ok(found)
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        if let Some(text) = self.known.data.get(name) {
            return Ok(text.clone());
        }
        if let Some(missing) = &self.missing {
            return Err(missing.clone());
        }
        let text = self.inner.data(name)?;
        let mut answers = self.texts.answers.lock().unwrap_or_else(PoisonError::into_inner);
        answers.data.insert(name.to_string(), text.clone());
        Ok(text)
    }

    fn class_names(&mut self) -> Vec<String> {
        self.inner.class_names()
    }
}
