//! Texts of a model that remember what was asked for, so that a model can be translated again where its files are not.

use std::collections::BTreeMap;
use std::path::PathBuf;
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
    libraries: Libraries,
    answers: Mutex<Answers>,
}

impl Texts {
    pub(crate) fn new(name: String, text: String, file: Option<PathBuf>, libraries: Libraries) -> Self {
        Self { name, text: text.into(), file, libraries, answers: Mutex::default() }
    }

    /// The way to the classes.  What was asked before is answered as before.
    ///
    /// # Errors
    /// Why a folder of libraries cannot be used.
    pub(crate) fn sources(&self) -> Result<Remembering<'_>, String> {
        let known = self.answers.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let libraries = match &self.file {
            Some(file) => self.libraries.path(file, &self.text),
            None => self.libraries.path(&PathBuf::from("."), &self.text),
        };
        // A model that came by pickle brings its texts along; the folders may be elsewhere.
        let inner = match libraries {
            Err(_) if !known.classes.is_empty() => LibraryPath::new(),
            other => other?,
        };
        Ok(Remembering { texts: self, known, inner })
    }

    /// Everything as JSON.
    pub(crate) fn state(&self) -> Value {
        let answers = self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        let text = |text: &SourceText| json!([*text.name, *text.text]);
        let classes =
            answers.classes.iter().map(|(name, found)| (name.clone(), found.as_ref().map_or(Value::Null, text)));
        let data = answers.data.iter().map(|(name, text)| (name.clone(), json!(**text)));
        json!({"name": self.name, "text": *self.text, "file": self.file, "folders": self.libraries.folders,
            "allow_outside": self.libraries.allow_outside, "classes": classes.collect::<Map<_, _>>(), "data": data.collect::<Map<_, _>>()})
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
        let libraries =
            Libraries { folders: folders.collect::<Option<_>>()?, allow_outside: state["allow_outside"].as_bool()? };
        let file = text(&state["file"]).map(PathBuf::from);
        let texts = Self::new(text(&state["name"])?, text(&state["text"])?, file, libraries);
        Some(Self { answers: Mutex::new(answers), ..texts })
    }
}

/// Sources that remember.
pub(crate) struct Remembering<'a> {
    texts: &'a Texts,
    known: Answers,
    inner: LibraryPath,
}

impl Sources for Remembering<'_> {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let name = path.join(".");
        if let Some(found) = self.known.classes.get(&name) {
            return Ok(found.clone());
        }
        let found = self.inner.find(path)?;
        self.texts.answers.lock().unwrap_or_else(PoisonError::into_inner).classes.insert(name, found.clone());
        Ok(found)
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        if let Some(text) = self.known.data.get(name) {
            return Ok(text.clone());
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
