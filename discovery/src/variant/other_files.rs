//! Texts beside the model's file: those of its package, and of libraries, which can be opened, too.
//!
//! A model whose file stands alone is put before what is made of it. One of a package is found by its name, as all classes are, and a text
//! that is opened takes the place of that which the sources find.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use hyd_compiler::{Diagnostic, Opening, SourceText, Sources, opened};

/// Whose a text is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Owner {
    /// The user's: it belongs to the package of the model's file.
    User,
    /// That of a library.
    Library,
}

/// Says whose a file is; none of what is built in.
type OwnerOf = dyn Fn(&str) -> Option<Owner> + Send + Sync;

/// The files that a model is made of beside its own.
#[derive(Clone, Default)]
pub struct OtherFiles {
    owner: Option<Arc<OwnerOf>>,
    texts: Arc<OnceLock<BTreeMap<String, (Owner, String)>>>,
}

impl OtherFiles {
    /// Those of which `owner` knows whose they are, by the names that messages have for files.
    pub fn of(owner: Arc<OwnerOf>) -> Self {
        Self { owner: Some(owner), texts: Arc::default() }
    }

    /// Their owners and texts by name, once `all` has said which files the model is made of.
    pub(crate) fn texts(&self, all: impl FnOnce() -> Vec<(String, String)>) -> &BTreeMap<String, (Owner, String)> {
        self.texts.get_or_init(|| {
            let Some(owner) = &self.owner else { return BTreeMap::new() };
            all().into_iter().filter_map(|(name, text)| Some((name.clone(), (owner(&name)?, text)))).collect()
        })
    }
}

/// Sources whose texts are opened.
pub(crate) struct OpenedSources {
    pub(crate) inner: Box<dyn Sources>,
    pub(crate) openings: Vec<Opening>,
}

impl Sources for OpenedSources {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        let Some(found) = self.inner.find(path)? else { return Ok(None) };
        let own: Vec<Opening> = self.openings.iter().filter(|own| *own.file == *found.name).cloned().collect();
        if own.is_empty() {
            return Ok(Some(found));
        }
        let text = opened(&found.text, &own).ok_or_else(|| {
            let equations: Vec<String> = own.iter().map(|own| format!("`{}`", own.equation)).collect();
            format!("`{}` has no place for a term in {}", found.name, equations.join(" or "))
        })?;
        Ok(Some(SourceText { name: found.name, text: text.into() }))
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        self.inner.data(name)
    }

    fn class_names(&mut self) -> Vec<String> {
        self.inner.class_names()
    }

    fn remarks(&mut self) -> Vec<Diagnostic> {
        self.inner.remarks()
    }
}
