//! A translation of a model for given structural parameters and recorded inputs, with what its runs share.

use std::sync::{Arc, OnceLock};

use hyd_compiler::{Code, Compilation, CompiledModel, Diagnostic, Extras, Files, Goal, Severity};
use hyd_run::{clock, parameters};
use hyd_system::DaeSystem;
use hyd_system::given::Elements;
use hyd_verbs::{Request, compile_text, first_name, with_whole_loops};

use crate::messages::Message;
use crate::rows::LastLayout;
use crate::sources::Texts;

/// What a translation depends on beside the texts.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(crate) struct Key {
    /// Parameters that were set when the model was loaded, and those that decide sizes or structure.
    pub(crate) set: Vec<(String, String)>,
    /// Inputs that follow samples.
    pub(crate) driven: Vec<String>,
    /// Units that do not fit are errors in libraries, too.
    pub(crate) strict_units: bool,
}

/// A model that can be run.
pub(crate) struct Translated {
    pub(crate) key: Key,
    pub(crate) compilation: Compilation,
    /// Seconds of CPU time.
    pub(crate) translate_s: f64,
    pub(crate) layout: LastLayout,
    whole: OnceLock<Option<Arc<CompiledModel>>>,
}

impl Translated {
    /// Translates, and gives the warnings; or the messages that say what is wrong.
    pub(crate) fn new(texts: &Texts, class: Option<&str>, key: Key) -> Result<(Self, Vec<Message>), Vec<Message>> {
        let begin = clock::cpu_seconds();
        let refused = |sentence: String| vec![Message::of(&Files::new(), &file_access(sentence))];
        let mut sources = texts.sources().map_err(refused)?;
        let request = Request { class: class.map(str::to_string), set: key.set.clone(), goal: Goal::Run };
        let extras = Extras { driven: &key.driven, strict_units: key.strict_units, ..Extras::default() };
        let compilation = compile_text(&mut sources, &texts.name, &texts.text, &request, &extras);
        let messages = compilation.diagnostics.iter().map(|own| Message::of(&compilation.files, own)).collect();
        if compilation.has_errors() {
            return Err(messages);
        }
        if compilation.model.is_none() {
            return Err(vec![Message::sentence(Severity::Error, "the translation gave no code")]);
        }
        let translate_s = clock::cpu_seconds() - begin;
        let (layout, whole) = (LastLayout::default(), OnceLock::new());
        Ok((Self { key, compilation, translate_s, layout, whole }, messages))
    }

    /// The model with whole loops, translated when it is first asked for.
    pub(crate) fn whole(&self) -> Option<Arc<CompiledModel>> {
        self.whole.get_or_init(|| with_whole_loops(&self.compilation, &self.key.set)).clone()
    }

    /// Complaints about values that are set for a run which begins at `start` (s): they may put a parameter outside of its limits.
    pub(crate) fn outside(&self, set: &[(String, String)], start: f64) -> Option<Message> {
        let limits = &self.model().payload().parameters.limits;
        // What the translation knew it has looked at.
        if limits.is_empty() || set.iter().all(|own| self.key.set.contains(own)) {
            return None;
        }
        let mut system = self.model().instantiate();
        // Values that are not taken, or make no sense, are said by the run.
        parameters::apply(&mut system, set, &self.compilation.set_at_translation).ok()?;
        system.bind(start).ok()?;
        let sentence = parameters::outside(limits, &system)?;
        let declared = first_name(&sentence).and_then(|name| {
            let flat = self.compilation.flat.as_deref()?;
            flat.variables
                .raw
                .iter()
                .find(|block| Elements::of(&block.name, name).is_some())
                .map(|block| block.origin.span)
        });
        let diagnostic = Diagnostic::error(Code::Value, sentence);
        let diagnostic = match declared {
            Some(declared) => diagnostic.at(declared, "declared here"),
            None => diagnostic,
        };
        Some(Message::of(&self.compilation.files, &diagnostic))
    }

    /// The model.
    pub(crate) fn model(&self) -> &CompiledModel {
        self.compilation.model.as_ref().expect("invariant: a translation without code is refused")
    }
}

/// A file or folder that cannot be read.
pub(crate) fn file_access(sentence: String) -> Diagnostic {
    Diagnostic::error(hyd_compiler::Code::FileAccess, sentence)
}
