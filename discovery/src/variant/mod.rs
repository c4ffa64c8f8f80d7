//! A model with effects in it, as text and translated.
//!
//! The text is what a user would write: a model that extends the base and redeclares the places.  For the comparison with a bench
//! a second model extends that one and gives every channel a variable of its own, so that a channel may be any expression
//! and is checked by the compiler.

pub(crate) mod composed;
pub(crate) mod data_files;
pub(crate) mod modifications;
pub(crate) mod other_files;
pub(crate) mod text_bundle;
pub(crate) mod translated;

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

use hyd_compiler::inquiry::annotated_components;
use hyd_compiler::render::render;
use hyd_compiler::{
    Diagnostic, Extras, Files, Goal, Injection, InjectionSite, Opening, Options, Sources, TermShape, compile,
    compile_extended, injection_sites, opened, print_string,
};

use crate::Fault;
use crate::catalogue::door::{Door, End, Law};
use crate::catalogue::{Candidate, Site, sites};
use crate::elements::At;
use crate::study::initial::{StartOf, declarations, equations};
use crate::terms::dictionary::Term;
use crate::variant::composed::Composed;
use crate::variant::modifications::{Modifications, last_name};
use crate::variant::other_files::{OpenedSources, OtherFiles, Owner};
use crate::variant::translated::{ChannelNames, Translated};

/// Names of the model with effects, of the one with channels, and of the one in which places are looked for; with a number where
/// the study's file has the name already.
const EXTENDED: &str = "Discovered";
const MEASURED: &str = "HydMeasured";
const PLACES: &str = "HydPlaces";
/// Name of a text that begins with no file of the user's.
const STUDY: &str = "study";
/// Coefficients of terms are parameters of this name and a number; no name in a text has such a sign.
const COEFFICIENT: &str = "$term";

/// Where texts come from and what the base is.
#[derive(Clone)]
pub struct Workshop<'a> {
    /// Name of the study's file.
    pub study: String,
    /// Makes a new way to the libraries.
    pub sources: &'a (dyn Fn() -> Box<dyn Sources> + Sync),
    /// Text that must come before the variants: that of the study's model file, if no library finds it.
    pub preamble: String,
    /// Name of the study's model file.
    pub file: String,
    /// The files beside that one.
    pub others: OtherFiles,
    /// Full name of the base model.
    pub class: String,
    /// Expressions of the channels.
    pub channels: Vec<String>,
    /// States whose beginning the study sets.
    pub starts: Vec<StartOf>,
    /// Names of the inputs that follow columns.
    pub driven: Vec<String>,
    /// Full names of the classes of the libraries.
    pub library_classes: Arc<[String]>,
    /// The model is nothing but a unit of another tool, whose equations nobody sees.
    pub opaque: Option<Opaque>,
}

/// What is known of a model that is nothing but a unit of another tool.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Opaque {
    /// Parameters that move with the trigger: what the unit is given, and what that is by itself.
    pub moved: Vec<(String, String)>,
}

/// A redeclaration with values of its parameters.
#[derive(Clone, Debug)]
pub struct Insert {
    /// The effect and its places.
    pub candidate: Candidate,
    /// Values in the order of the effect's parameters; none leaves all as declared.
    pub values: Vec<f64>,
}

/// Values of an effect's parameters, as modifications.
fn stated(Insert { candidate, values }: &Insert) -> Vec<String> {
    let effect = &candidate.effect;
    let fitted =
        effect.parameters.iter().zip(values).map(|(parameter, value)| format!("{} = {value:e}", parameter.name));
    let set = effect.references.iter().filter_map(|own| Some(format!("{} = {:e}", own.name, own.value?)));
    fitted.chain(set).collect()
}

/// The modifications that put effects into a model.
fn modifications(inserts: &[Insert], extra: &[(String, String)], starts: &[StartOf]) -> String {
    let mut tree = Modifications::default();
    let mut terms: BTreeMap<String, Vec<(At, String)>> = BTreeMap::new();
    let mut commands: BTreeMap<&str, String> = BTreeMap::new();
    for insert in inserts {
        let candidate = &insert.candidate;
        let stated = stated(insert);
        for site in &candidate.sites {
            match &site.door {
                Door::Component => {
                    let (class, name) = (&candidate.effect.class, last_name(&site.path));
                    tree.insert(&site.path, format!("redeclare {class} {name}"), stated.clone());
                }
                Door::Balance { law, .. } | Door::Exchange { law, .. } => {
                    for (k, end) in site.door.ends().iter().enumerate() {
                        let End::Equation { opening, path, is_reversed, element } = end else { continue };
                        let path =
                            if path.is_empty() { opening.name.clone() } else { format!("{path}.{}", opening.name) };
                        // What comes into the first is taken from the second.
                        let sign = if *is_reversed == (k == 0) { "-" } else { "" };
                        let term = format!("{sign}{}.{}", candidate.component(site), law.output);
                        terms.entry(path).or_default().push((element.clone(), term));
                    }
                }
                // Of several in a chain the last one gives the value.
                Door::Command { variable, .. } => {
                    commands.insert(variable, format!("{}.y", candidate.component(site)));
                }
                Door::Moved(moved) => {
                    let late = candidate.effect.parameters.first().map_or("", |own| &own.name);
                    for (variable, value) in moved {
                        let value = format!("{variable} = {value} + {}.{late}", candidate.component(site));
                        tree.insert(variable, value, Vec::new());
                    }
                }
                Door::Channel { .. } => {}
            }
        }
    }
    for (path, terms) in terms {
        // Effects at one equation add up.
        let sum = |at: &[usize]| {
            let own: Vec<&str> =
                terms.iter().filter(|(own, _)| own.subscripts == at).map(|(_, term)| term.as_str()).collect();
            if own.is_empty() { "0".to_string() } else { own.join(" + ").replace("+ -", "- ") }
        };
        let Some((first, _)) = terms.first() else { continue };
        tree.insert(&path, format!("{} = {}", last_name(&path), first.array(&sum)), Vec::new());
    }
    for (variable, value) in commands {
        tree.insert(variable, format!("{} = {value}", last_name(variable)), Vec::new());
    }
    for (path, value) in extra {
        tree.insert(path, format!("{} = {value}", last_name(path)), Vec::new());
    }
    for (state, modifications) in StartOf::modifications(starts) {
        tree.insert(&state, last_name(&state).to_string(), modifications);
    }
    tree.print()
}

/// Declarations and equations of the effects that come in at equations, connectors and channels.
fn additions(inserts: &[Insert]) -> String {
    let (mut declared, mut equations) = (String::new(), String::new());
    // Chains by what goes through them: an expression that is measured, or what a variable is given.
    let mut chains: BTreeMap<(&str, &str), String> = BTreeMap::new();
    // Writing to a String cannot fail.
    for insert in inserts {
        let candidate = &insert.candidate;
        let stated = stated(insert);
        let list = if stated.is_empty() { String::new() } else { format!("({})", stated.join(", ")) };
        for site in &candidate.sites {
            let name = candidate.component(site);
            let law = match &site.door {
                Door::Component => continue,
                Door::Moved(_) => &Law { inputs: Vec::new(), output: "y" },
                Door::Balance { law, .. } | Door::Exchange { law, .. } => {
                    for (k, end) in site.door.ends().iter().enumerate() {
                        let End::Connector { connector, adapter, socket } = end else { continue };
                        let (at, sign) = if k == 0 { ("at", "") } else { ("from", "-") };
                        let _ = writeln!(declared, "  {adapter} {name}_{at};");
                        let _ = writeln!(equations, "  connect({name}_{at}.{socket}, {connector});");
                        let _ = writeln!(equations, "  {name}_{at}.term = {sign}{name}.{};", law.output);
                    }
                    law
                }
                Door::Channel { expression, .. } | Door::Command { expression, .. } => {
                    let given = if let Door::Command { variable, .. } = &site.door { variable.as_str() } else { "" };
                    let before = chains
                        .insert((given, expression), format!("{name}.y"))
                        .unwrap_or_else(|| format!("({expression})"));
                    let _ = writeln!(equations, "  {name}.u = {before};");
                    if let Door::Channel { heard: Some(heard), .. } = &site.door {
                        let _ = writeln!(equations, "  {name}.v = {heard};");
                    }
                    &Law { inputs: Vec::new(), output: "y" }
                }
            };
            let words = print_string(&candidate.effect.words);
            let _ = writeln!(declared, "  {} {name}{list} {words};", candidate.effect.class);
            for (input, expression) in &law.inputs {
                match expression {
                    Some(expression) => {
                        let _ = writeln!(equations, "  {name}.{input} = {expression};");
                    }
                    // A speed whose way the model does not count.
                    None => {
                        let rate = law.inputs.iter().find_map(|(_, expression)| expression.as_deref()).unwrap_or("0");
                        let _ = writeln!(declared, "  Real {name}_{input}(start = 0, fixed = true);");
                        let _ =
                            writeln!(equations, "  der({name}_{input}) = {rate};\n  {name}.{input} = {name}_{input};");
                    }
                }
            }
        }
    }
    if equations.is_empty() { declared } else { format!("{declared}equation\n{equations}") }
}

/// What a channel shows: its expression, or what the last measuring chain behind it gives.
fn shown_by(inserts: &[Insert], expression: &str) -> String {
    let sites = inserts.iter().flat_map(|insert| insert.candidate.sites.iter().map(|site| (&insert.candidate, site)));
    let mut own =
        sites.filter(|(_, site)| matches!(&site.door, Door::Channel { expression: own, .. } if own == expression));
    own.next_back()
        .map_or_else(|| expression.to_string(), |(candidate, site)| format!("{}.y", candidate.component(site)))
}

impl Workshop<'_> {
    /// A name that stands nowhere in the study's model, nor at the top of a library: a model that an earlier search has written may be
    /// the next base.
    pub(crate) fn free_name(&self, wanted: &str) -> String {
        let is_top = |name: &str| self.library_classes.iter().any(|class| class.split('.').next() == Some(name));
        let is_taken = |name: &str| self.preamble.contains(name) || self.class.contains(name) || is_top(name);
        let numbered = (2_u32..).map(|k| format!("{wanted}{k}"));
        // A text is finite, and there is a name for every number.
        std::iter::once(wanted.to_string()).chain(numbered).find(|name| !is_taken(name)).unwrap_or_default()
    }

    /// Name of the model with effects.
    pub fn extended_name(&self) -> String {
        self.free_name(EXTENDED)
    }

    /// Text of the model with effects in it and with parameter values `extra`, literals by path; those of beginnings are what these
    /// are where nobody sets them.
    pub fn extended(
        &self,
        inserts: &[Insert],
        description: &str,
        extra: &[(String, String)],
        annotation: &str,
    ) -> String {
        let (begun, extra): (Vec<_>, Vec<_>) = extra.iter().cloned().partition(|(name, _)| StartOf::is_parameter(name));
        let (inside, added) = (modifications(inserts, &extra, &self.starts), additions(inserts));
        let (starts, initial) = (declarations(&self.starts, &self.preamble, &begun), equations(&self.starts));
        let class = &self.class;
        let list = if inside.is_empty() { String::new() } else { format!("(\n    {inside})") };
        let description = print_string(description);
        let name = self.extended_name();
        format!(
            "model {name} {description}\n  extends {class}{list};\n{starts}{added}{initial}{annotation}end {name};\n"
        )
    }

    /// The text of the user's own with this name: the model's file, or one of its package.
    pub(crate) fn own_text(&self, file: &str) -> Option<&str> {
        match !self.preamble.is_empty() && file == self.name() {
            true => Some(&self.preamble),
            false => self.text_of(file, Owner::User),
        }
    }

    /// The text of a library with this name, but for what is built in.
    pub(crate) fn library_text(&self, file: &str) -> Option<&str> {
        self.text_of(file, Owner::Library)
    }

    fn text_of(&self, file: &str, owner: Owner) -> Option<&str> {
        self.other_texts().get(file).filter(|(own, _)| *own == owner).map(|(_, text)| text.as_str())
    }

    /// The texts of the package that the model's file belongs to, by the names of their files.
    pub(crate) fn own_texts(&self) -> impl Iterator<Item = (&str, &str)> {
        let own = self.other_texts().iter().filter(|(_, (owner, _))| *owner == Owner::User);
        own.map(|(name, (_, text))| (name.as_str(), text.as_str()))
    }

    fn other_texts(&self) -> &BTreeMap<String, (Owner, String)> {
        // Without the base model's files nothing can be found in it, which those say who translate it.
        self.others.texts(|| self.files(&[]).unwrap_or_default())
    }

    /// The study's model file with the equations opened that effects add terms to, and what is opened in other files.
    ///
    /// # Errors
    /// An equation that is not in the file.
    fn preamble(&self, inserts: &[Insert]) -> Result<(Cow<'_, str>, Vec<Opening>), Fault> {
        let mut openings: Vec<Opening> = Vec::new();
        for site in inserts.iter().flat_map(|insert| &insert.candidate.sites) {
            for opening in site.door.openings() {
                if !openings.contains(opening) {
                    openings.push(opening.clone());
                }
            }
        }
        let is_here = |opening: &Opening| !self.preamble.is_empty() && *opening.file == *self.name();
        let (here, elsewhere): (Vec<Opening>, Vec<Opening>) = openings.into_iter().partition(is_here);
        if here.is_empty() {
            return Ok((Cow::Borrowed(&self.preamble), elsewhere));
        }
        let text = opened(&self.preamble, &here);
        text.map(|text| (Cow::Owned(text), elsewhere)).ok_or_else(|| {
            let equations: Vec<String> = here.iter().map(|own| format!("`{}`", own.equation)).collect();
            Fault::new(format!("`{}` has no place for a term in {}", self.file, equations.join(" or ")))
        })
    }

    /// A new way to the libraries, with what is opened in their texts.
    fn opened_sources(&self, openings: &[Opening]) -> Box<dyn Sources> {
        let inner = (self.sources)();
        if openings.is_empty() { inner } else { Box::new(OpenedSources { inner, openings: openings.to_vec() }) }
    }

    /// The same with what effects in measuring chains make of the channels.
    pub(crate) fn shown(&self, inserts: &[Insert]) -> Self {
        let channels = self.channels.iter().map(|expression| shown_by(inserts, expression)).collect();
        Self { channels, ..self.clone() }
    }

    /// Translates a model with effects whose parameters are set at run time.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn translate(&self, inserts: &[Insert]) -> Result<Translated, Fault> {
        self.translate_with_terms(inserts, &[])
    }

    /// The same with terms at equations; the coefficient of term `k` is the parameter [`coefficient`]`(k)`.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn translate_with_terms(&self, inserts: &[Insert], terms: &[Term]) -> Result<Translated, Fault> {
        let extended = self.extended(inserts, "with effects", &[], "");
        let (preamble, openings) = self.preamble(inserts)?;
        let texts = (&*preamble, &*extended, &*openings);
        self.shown(inserts).translate_with(texts, (terms, &self.words(inserts))).map(|(model, _)| model)
    }

    fn options(&self) -> Options {
        Options { model: Some(self.free_name(MEASURED)), set: Vec::new(), goal: Goal::Run, clock: || 0.0 }
    }

    /// What is put together, for messages.
    fn words(&self, inserts: &[Insert]) -> String {
        let one = |insert: &Insert| {
            let paths: Vec<String> = insert.candidate.sites.iter().map(|site| format!("`{}`", site.path)).collect();
            format!("the effect `{}` in {}", insert.candidate.effect.class, paths.join(" and "))
        };
        let effects: Vec<String> = inserts.iter().map(one).collect();
        let with = if effects.is_empty() { String::new() } else { format!(" with {}", effects.join(", ")) };
        format!("the model `{}`{with}", self.class)
    }

    /// The name of the texts that are put together: of lines of the user's file messages say that file.
    pub(crate) fn name(&self) -> &str {
        if self.preamble.is_empty() { STUDY } else { &self.file }
    }

    /// The name under which users know a file.
    pub fn shown_file<'b>(&'b self, file: &'b str) -> &'b str {
        if file == STUDY { &self.file } else { file }
    }

    /// The places of the base model.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn places(&self) -> Result<Vec<Site>, Fault> {
        // A model of its own, so that a class of a library is found the same way as one of the study's file.
        let name = self.free_name(PLACES);
        let text = format!("{}model {name}\n  extends {};\nend {name};\n", self.preamble, self.class);
        let own = self.preamble.len();
        let composed = self.composed(text, own, (Vec::new(), Vec::new()), &self.words(&[]));
        let found =
            annotated_components(&mut *(self.sources)(), (&composed.name, &composed.text), Some(&name), "place");
        let found =
            found.map_err(|(files, diagnostics)| self.refused(&composed, &files, &diagnostics, &self.words(&[])))?;
        Ok(sites(&found))
    }

    /// Equations of the model with effects to which terms can be added; `names` are those of its channels when it was translated.
    pub fn injection_sites(&self, inserts: &[Insert], names: &ChannelNames) -> Vec<InjectionSite> {
        if self.opaque.is_some() {
            return Vec::new();
        }
        let Ok((preamble, openings)) = self.preamble(inserts) else { return Vec::new() };
        let (text, _) =
            self.shown(inserts).measured(&preamble, &self.extended(inserts, "with effects", &[], ""), names);
        let (sites, _) = injection_sites(&mut *self.opened_sources(&openings), self.name(), &text, &self.options());
        let own = self.preamble.lines().count();
        sites.into_iter().filter(|site| *site.file != *self.name() || site.line as usize <= own).collect()
    }

    /// Translates a text that defines the model with effects and all that it needs, with the channels added.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn translate_whole(&self, whole: &str, inserts: &[Insert]) -> Result<Translated, Fault> {
        let model = self.shown(inserts).translate_with(("", whole, &[]), (&[], "the model of the report"));
        model.map(|(model, _)| model)
    }

    /// Texts that a model with effects is made of, except its own and those that `built_in` knows by their names.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn texts(&self, inserts: &[Insert], built_in: &dyn Fn(&str) -> bool) -> Result<Vec<String>, Fault> {
        let (preamble, openings) = self.preamble(inserts)?;
        let extended = self.extended(inserts, "", &[], "");
        let own = (&*preamble, &*extended, &*openings);
        let (_, files) = self.shown(inserts).translate_with(own, (&[], &self.words(inserts)))?;
        let mut texts = if preamble.is_empty() { Vec::new() } else { vec![preamble.to_string()] };
        texts
            .extend(files.into_iter().filter(|(name, _)| name != self.name() && !built_in(name)).map(|(_, text)| text));
        Ok(texts)
    }

    /// Names and texts of all files that a model with effects is made of, as users know them: of the text that is
    /// compiled only what stands in the study's model file, and nothing where a library finds that file.
    ///
    /// # Errors
    /// The messages of the compiler.
    pub fn files(&self, inserts: &[Insert]) -> Result<Vec<(String, String)>, Fault> {
        let (preamble, openings) = self.preamble(inserts)?;
        let extended = self.extended(inserts, "", &[], "");
        let own = (&*preamble, &*extended, &*openings);
        let (_, mut files) = self.shown(inserts).translate_with(own, (&[], &self.words(inserts)))?;
        files.retain(|(name, _)| name != self.name());
        for (name, text) in files.iter_mut().filter(|(name, _)| openings.iter().any(|own| *own.file == **name)) {
            // As it stands in the file.
            if let Some((_, own)) = self.other_texts().get(name) {
                text.clone_from(own);
            }
        }
        if !self.preamble.is_empty() {
            files.insert(0, (self.file.clone(), self.preamble.clone()));
        }
        Ok(files)
    }

    /// A text with the channels added, and where they end.
    fn measured(&self, preamble: &str, extended: &str, names: &ChannelNames) -> (String, Vec<(usize, String)>) {
        let (name, base) = (self.free_name(MEASURED), self.extended_name());
        let mut text = format!("{preamble}{extended}model {name}\n  extends {base};\n");
        let mut ends = vec![(text.len(), String::new())];
        for (k, expression) in self.channels.iter().enumerate() {
            // In brackets it is one expression or none.  Writing to a String cannot fail.
            let _ = writeln!(text, "  Real {} = ({expression});", names.of(k));
            ends.push((text.len(), format!("the channel `{expression}` of the study `{}`", self.study)));
        }
        let _ = writeln!(text, "end {name};");
        (text, ends)
    }

    /// A text that begins with `own` bytes of the user's, in which channels with these ends and variables stand and all else is `words`.
    fn composed(
        &self,
        text: String,
        own: usize,
        (ends, channels): (Vec<(usize, String)>, Vec<String>),
        words: &str,
    ) -> Composed {
        let words = format!("{words} of the study `{}`", self.study);
        let mut parts = ends;
        parts.push((text.len(), String::new()));
        parts.iter_mut().filter(|(_, said)| said.is_empty()).for_each(|(_, said)| said.clone_from(&words));
        let names = [EXTENDED, MEASURED, PLACES].map(|name| (self.free_name(name), self.class.clone())).to_vec();
        Composed { name: self.name().to_string(), text, own, parts, names, channels }
    }

    /// Why a text that was put together cannot be translated.
    fn refused(&self, composed: &Composed, files: &Files, diagnostics: &[Diagnostic], words: &str) -> Fault {
        let is_syntax = |diagnostic: &Diagnostic| diagnostic.code.is_syntax();
        let heading = format!("{words} of the study `{}` cannot be translated", self.study);
        if diagnostics.iter().any(is_syntax) && composed.own > 0 {
            // A file whose last `end` is missing goes on in what was put behind it; on its own it tells what is wrong.
            let options = Options { model: Some(self.class.clone()), goal: Goal::Flat, ..self.options() };
            let alone = compile(&mut *(self.sources)(), &self.file, &composed.text[..composed.own], &options);
            let wrong: Vec<Diagnostic> = alone.diagnostics.iter().filter(|own| is_syntax(own)).cloned().collect();
            if !wrong.is_empty() {
                return Fault::new(format!("{heading}\n{}", render(&alone.files, &wrong, false)));
            }
        }
        Fault::new(format!("{heading}\n{}", composed.told(files, diagnostics)))
    }

    /// Translates a text that defines the model with effects, with the channels added; `words` say what it is.
    #[allow(clippy::type_complexity, reason = "names and texts of files, used twice")]
    fn translate_with(
        &self,
        (preamble, extended, openings): (&str, &str, &[Opening]),
        (terms, words): (&[Term], &str),
    ) -> Result<(Translated, Vec<(String, String)>), Fault> {
        let terms: Vec<Injection> = terms.iter().enumerate().map(|(k, term)| injection(k, term)).collect();
        let compiled = |names: &ChannelNames| {
            let (text, channels) = self.measured(preamble, extended, names);
            let extras = Extras { terms: &terms, driven: &self.driven, joined: true, ..Extras::default() };
            let compilation =
                compile_extended(&mut *self.opened_sources(openings), self.name(), &text, &self.options(), &extras);
            (text, channels, compilation)
        };
        let mut names =
            ChannelNames::free([preamble, extended].into_iter().chain(self.channels.iter().map(String::as_str)));
        let (mut text, mut channels, mut compilation) = compiled(&names);
        let files = &compilation.files;
        let read: Vec<Arc<str>> = files.ids().map(|id| files.text(id).clone()).filter(|own| **own != *text).collect();
        let read = || read.iter().map(|text| &**text);
        if names.stands_in(read()) {
            // A text of a library, which is known only now.
            let own = [preamble, extended].into_iter().chain(self.channels.iter().map(String::as_str));
            names = ChannelNames::free(own.chain(read()));
            (text, channels, compilation) = compiled(&names);
        }
        if compilation.model.is_none() || compilation.has_errors() {
            let variables = (0..self.channels.len()).map(|k| names.of(k)).collect();
            let composed = self.composed(text, preamble.len(), (channels, variables), words);
            return Err(self.refused(&composed, &compilation.files, &compilation.diagnostics, words));
        }
        let files = &compilation.files;
        let variables = (0..self.channels.len()).map(|k| names.of(k)).collect();
        let composed = self.composed(text, preamble.len(), (channels, variables), words);
        let warnings = composed.warnings(files, &compilation.diagnostics);
        let files = files.ids().map(|id| (files.name(id).to_string(), files.text(id).to_string())).collect();
        let translated = Translated::new(compilation, (names, warnings), self.options());
        translated.map(|translated| (translated, files)).ok_or_else(|| Fault::new("the translation gave no code"))
    }
}

/// Name of the parameter that is the coefficient of a term.
pub(crate) fn coefficient(term: usize) -> String {
    format!("{COEFFICIENT}{term}")
}

fn injection(k: usize, term: &Term) -> Injection {
    let shape = match term.shape.as_str() {
        "1" => TermShape::Constant,
        shape => TermShape::Expression(shape.to_string()),
    };
    let file = Some(term.file.to_string());
    Injection { path: term.component.to_string(), file, line: term.line, name: coefficient(k), shape }
}
