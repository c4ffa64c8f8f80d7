//! Where class texts come from: a trait, so that the compiler opens no file itself.

use std::sync::Arc;

use hyd_source::Diagnostic;

/// One text of a library.
#[derive(Clone, Debug)]
pub struct SourceText {
    /// Name shown in messages.
    pub name: Arc<str>,
    /// The text.
    pub text: Arc<str>,
}

/// Finds the text that defines a class by its full name.
pub trait Sources {
    /// The text that defines class `path` (`["Hyd", "Units"]`): `Hyd/Units/package.hyd` or `Hyd/Units.hyd` of a
    /// library (`.mo` as well), file names compared without case; `None` if there is no such file, `Err` with a sentence
    /// if there is one that cannot be read.  Called once per name at most, and only for names the model uses.
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String>;

    /// The text of a data file that a model names, by a path relative to where the model stands.  `Err`: a sentence.
    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        Err(format!("there is no file `{name}`"))
    }

    /// Full dotted names of the classes that have a text of their own, for suggestions in messages.
    fn class_names(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// Warnings about what was found so far: a library of another version than the text uses.
    fn remarks(&mut self) -> Vec<Diagnostic> {
        Vec::new()
    }
}
