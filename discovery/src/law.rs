//! A law that no library knows, as the text of an effect.
//!
//! The search finds terms of one equation with their coefficients ([`crate::search`]).  Here they become a class that could stand in a
//! library: where the equation belongs to a component that the model lets exchange, a copy of its class with the terms in it, and where it
//! stands in the study's model file, a block that is given variables and gives a term.  From then on it is a candidate like others.

use std::fmt::Write;
use std::sync::Arc;

use hyd_compiler::{Opening, SourceText, Sources, Variation, opened, print_string, varied};

use crate::catalogue::{Candidate, Effect, EffectParameter, Kind, Site};
use crate::dictionary::Term;
use crate::door::{self, Door};
use crate::prior::Prior;
use crate::variant::Workshop;

/// Name of the class, with a number where it is taken.
const CLASS: &str = "Proposed";
/// Id of the effect, with a number where a library has it.
pub(crate) const ID: &str = "proposed_law";
/// Names of what a block is given.
const GIVEN: [&str; 8] = ["u1", "u2", "u3", "u4", "u5", "u6", "u7", "u8"];
/// What a block gives.
const GIVES: &str = "term";
/// The place of an equation that belongs to no component.
const WHOLE: &str = "the model";
/// Rivals that a report names.
pub(crate) const RIVALS: usize = 5;
/// Coefficients that a library calls plausible, by the fitted one.
const PLAUSIBLE: (f64, f64) = (0.2, 5.0);

/// A term of a law with its coefficient.
#[derive(Clone, Debug)]
pub struct LawTerm {
    /// The term.
    pub term: Term,
    /// Its coefficient.
    pub value: f64,
    /// Standard error of it.
    pub error: f64,
    /// Spread of the coefficient before the measurement.
    pub spread: f64,
}

/// Terms or an effect beside a law.
#[derive(Clone, Debug)]
pub struct Rival {
    /// The equation of terms; empty for an effect.
    pub equation: String,
    /// The shapes, or the effect.
    pub shape: String,
    /// By how much the cost is larger, in units of what the law leaves.
    pub behind: f64,
}

impl Rival {
    /// For messages.
    pub(crate) fn said(&self) -> String {
        match self.equation.trim_end_matches(';') {
            "" => self.shape.clone(),
            equation => format!("{} in `{equation}`", self.shape),
        }
    }
}

/// A law that was found.
#[derive(Clone, Debug)]
pub struct Law {
    /// Name of its class.
    pub name: String,
    /// The text of the class.
    pub text: Arc<str>,
    /// The terms at its equation.
    pub terms: Vec<LawTerm>,
    /// What else was fitted, the best first.
    pub rivals: Vec<Rival>,
    /// The effect at its place.
    pub candidate: Candidate,
}

impl Law {
    /// Name of the file that the text is written to.
    pub fn file(&self) -> String {
        format!("{}.hyd", self.name)
    }

    /// The shapes of its terms.
    pub(crate) fn shape(&self) -> String {
        self.terms.iter().map(|own| own.term.shape.as_str()).collect::<Vec<_>>().join(" + ")
    }

    /// The equation with what it lacks.
    pub fn equation(&self) -> String {
        let own = self.terms.first().map_or("", |own| own.term.equation.trim_end_matches(';'));
        let shape = |own: &LawTerm| match own.term.shape.as_str() {
            "1" => String::new(),
            shape => format!("*{shape}"),
        };
        let terms = self.terms.iter().map(|own| format!(" {} {:.3e}{}", sign(own.value), own.value.abs(), shape(own)));
        format!("{own}{}", terms.collect::<String>())
    }

    /// Makes the text of a law from terms of one equation; none where it belongs to a component that cannot be exchanged and stands in a
    /// file that is not the study's.  `sites` are the places that the model declares, `files` names and texts of what it is made of.
    pub(crate) fn new(
        workshop: &Workshop<'_>,
        (sites, ids): (&[&Site], &[&str]),
        files: &[(String, String)],
        terms: Vec<LawTerm>,
    ) -> Option<Self> {
        let first = terms.first()?.term.clone();
        let name = workshop.free_name(CLASS);
        let id = (2_u32..).map(|k| format!("{ID}_{k}"));
        let id = std::iter::once(ID.to_string()).chain(id).find(|id| !ids.contains(&id.as_str()))?;
        let words = format!("a law that no library holds, in `{}`", first.equation.trim_end_matches(';'));
        let declared = sites.iter().find(|site| site.door == Door::Component && site.path == *first.component);
        let coefficient = coefficient_name(&terms, files);
        let names: Vec<String> = (1..=terms.len()).map(|k| format!("{coefficient}_{k}")).collect();
        let is_chain = declared.is_some_and(|site| site.channel.is_some());
        let kind = if is_chain { Kind::Sensor } else { Kind::Physics };
        let (site, text) = match declared {
            Some(site) => {
                let (_, file) = files.iter().find(|(name, _)| *name == *first.file)?;
                let annotation =
                    annotation((&id, &words), &terms, &names, (kind, &format!("at = {{\"{}\"}}, ", site.id)));
                let text = varied(
                    file,
                    &Variation {
                        line: first.line,
                        equation: &first.equation,
                        name: &name,
                        description: &sentence(&words),
                        declarations: &declarations(&terms, &names),
                        term: &sum(&terms, &names, &|shape| shape.to_string()),
                        annotation: &annotation,
                    },
                )?;
                ((*site).clone(), text)
            }
            None => of_equation(workshop, (&name, &id, &words), &terms, &names)?,
        };
        let is_law = site.door != Door::Component;
        let parameter = |(own, name): (&LawTerm, &String)| EffectParameter {
            name: name.as_str().into(),
            prior: Prior::Normal(0.0, own.spread),
            range: None,
            of: None,
        };
        let effect = Effect {
            id: id.as_str().into(),
            kind,
            class: name.clone(),
            words: words.as_str().into(),
            signature: "".into(),
            rivals: Vec::new(),
            at: vec![vec![site.id.clone()]],
            parameters: terms.iter().zip(&names).map(parameter).collect(),
            references: Vec::new(),
            excludes: Vec::new(),
            refines: Vec::new(),
            zero: Some(0.0),
            probe: terms.first().map_or(1.0, |own| own.value.abs()),
            of_range: false,
            is_law,
            per_shot: false,
            base: None,
            file: format!("{name}.hyd").into(),
            line: 1,
        };
        let candidate = Candidate { effect: Arc::new(effect), sites: vec![site] };
        Some(Self { name, text: text.into(), terms, rivals: Vec::new(), candidate })
    }

    /// Hands a workshop that finds the law beside all libraries to `work`.
    pub(crate) fn known_to<T>(&self, workshop: &Workshop<'_>, work: impl FnOnce(&Workshop<'_>) -> T) -> T {
        let (inner, name, file, text) = (workshop.sources, self.name.clone(), self.file(), self.text.clone());
        let sources = move || -> Box<dyn Sources> {
            let own = SourceText { name: file.as_str().into(), text: text.clone() };
            Box::new(With { inner: inner(), name: name.clone(), own })
        };
        work(&Workshop { sources: &sources, ..workshop.clone() })
    }
}

/// Libraries, and one class beside them.
struct With {
    inner: Box<dyn Sources>,
    name: String,
    own: SourceText,
}

impl Sources for With {
    fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        match path {
            [name] if **name == *self.name => Ok(Some(self.own.clone())),
            path => self.inner.find(path),
        }
    }

    fn data(&mut self, name: &str) -> Result<Arc<str>, String> {
        self.inner.data(name)
    }

    fn class_names(&mut self) -> Vec<String> {
        self.inner.class_names()
    }
}

/// A fitted number with as many digits as anybody reads.
fn figure(value: f64) -> String {
    format!("{value:.5e}")
}

fn sign(value: f64) -> char {
    if value < 0.0 { '-' } else { '+' }
}

/// With a capital, as descriptions begin.
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// A name for coefficients that none of the texts of the equation holds.
fn coefficient_name(terms: &[LawTerm], files: &[(String, String)]) -> &'static str {
    let texts = || {
        let own = files.iter().filter(|(name, _)| terms.iter().any(|own| *own.term.file == **name));
        own.map(|(_, text)| text.as_str())
    };
    let is_free = |name: &&&str| !texts().any(|text| text.contains(&format!("{name}_")));
    ["c", "law", "coefficient"].iter().find(is_free).copied().unwrap_or("coefficient_of_law")
}

/// The coefficients as parameters.
fn declarations(terms: &[LawTerm], names: &[String]) -> String {
    let mut text = String::new();
    for (k, (own, name)) in terms.iter().zip(names).enumerate() {
        let unit = own.term.unit.as_ref().map_or(String::new(), |unit| format!("(unit = {})", print_string(unit)));
        let words = print_string(&format!("coefficient of {}", own.term.shape));
        // The size carries its prior in the annotation of the class.
        let note = if k == 0 { String::new() } else { format!("\n  annotation(__hyd({}))", prior(own)) };
        let _ = writeln!(text, "parameter Real {name}{unit} = {} {words}{note};", figure(own.value));
    }
    text
}

fn prior(own: &LawTerm) -> String {
    let (a, b) = (PLAUSIBLE.0 * own.value, PLAUSIBLE.1 * own.value);
    let (value, spread) = (figure(own.value), figure(own.value.abs()));
    format!("prior = \"normal({value}, {spread})\", range = {{{:.1e}, {:.1e}}}", a.min(b), a.max(b))
}

/// The terms with their coefficients, to be added.
fn sum(terms: &[LawTerm], names: &[String], shape: &dyn Fn(&str) -> String) -> String {
    let one = |(own, name): (&LawTerm, &String)| match own.term.shape.as_str() {
        "1" => name.clone(),
        own => format!("{name}*{}", shape(own)),
    };
    terms.iter().zip(names).map(one).collect::<Vec<_>>().join(" + ")
}

/// What stands in the annotation of the class.
fn annotation((id, words): (&str, &str), terms: &[LawTerm], names: &[String], (kind, place): (Kind, &str)) -> String {
    let (Some(first), Some(name)) = (terms.first(), names.first()) else { return String::new() };
    format!(
        "__hyd(effect(id = {}, kind = \"{}\", {place}adds = {name}, zero = 0,\n    probe = {}, {},\n    words = {}))",
        print_string(id),
        kind.word(),
        figure(first.value.abs()),
        prior(first),
        print_string(words)
    )
}

/// A block that gives a term to an equation of the study's file.
fn of_equation(
    workshop: &Workshop<'_>,
    (name, id, words): (&str, &str, &str),
    terms: &[LawTerm],
    names: &[String],
) -> Option<(Site, String)> {
    let first = &terms.first()?.term;
    if workshop.preamble.is_empty() || *first.file != *workshop.name() || first.component.contains('[') {
        return None;
    }
    let mut given: Vec<String> = Vec::new();
    for own in terms {
        for variable in variables(&own.term.shape) {
            if !given.contains(&variable) {
                given.push(variable);
            }
        }
    }
    if given.len() > GIVEN.len() {
        return None;
    }
    let mut text = format!("block {name} {}\n", print_string(&sentence(words)));
    for (variable, input) in given.iter().zip(GIVEN) {
        let _ = writeln!(text, "  input Real {input} {};", print_string(variable));
    }
    for line in declarations(terms, names).lines() {
        let _ = writeln!(text, "  {line}");
    }
    let shape = |own: &str| {
        replaced(own, &|variable| {
            given.iter().position(|known| known == variable).map_or(variable, |k| GIVEN[k]).to_string()
        })
    };
    let _ = writeln!(
        text,
        "  output Real {GIVES} \"what is added\";\nequation\n  {GIVES} = {};",
        sum(terms, names, &shape)
    );
    let _ = writeln!(
        text,
        "  annotation({});\nend {name};",
        annotation((id, words), terms, names, (Kind::Physics, "law = true, at = {\"equation\"}, "))
    );
    let opening = Opening {
        line: first.line,
        equation: first.equation.clone(),
        name: free(&workshop.preamble)?,
        words: "what no library holds".to_string(),
        replaces: false,
    };
    opened(&workshop.preamble, std::slice::from_ref(&opening))?;
    let full = |variable: &str| match first.component.is_empty() {
        true => variable.to_string(),
        false => format!("{}.{variable}", first.component),
    };
    let inputs = given.iter().zip(GIVEN).map(|(variable, input)| (input, Some(full(variable)))).collect();
    let law = door::Law { inputs, output: GIVES };
    let site = Site {
        id: "equation".into(),
        path: if first.component.is_empty() { WHOLE.to_string() } else { first.component.to_string() },
        words: first.equation.trim_end_matches(';').into(),
        channel: None,
        file: workshop.shown_file(&first.file).into(),
        line: first.line,
        door: Door::Equation { opening, path: first.component.clone(), is_reversed: false, law },
        scales: Vec::new(),
    };
    Some((site, text))
}

/// A name for what is let into the equation.
fn free(text: &str) -> Option<String> {
    let numbered = (2_u32..).map(|k| format!("further_{k}"));
    std::iter::once("further".to_string()).chain(numbered).find(|name| !text.contains(name.as_str()))
}

/// Names in an expression that are not those of functions.
fn variables(shape: &str) -> Vec<String> {
    let mut found = Vec::new();
    words(shape, &mut |word, is_name| {
        if is_name {
            found.push(word.to_string());
        }
    });
    found
}

/// The expression with other names for its variables.
fn replaced(shape: &str, name: &dyn Fn(&str) -> String) -> String {
    let mut text = String::new();
    words(shape, &mut |word, is_name| match is_name {
        true => text.push_str(&name(word)),
        false => text.push_str(word),
    });
    text
}

/// The words of an expression and what stands between them; true for names of variables.
fn words(shape: &str, each: &mut dyn FnMut(&str, bool)) {
    let mut rest = shape;
    while !rest.is_empty() {
        let is_inside = |c: char| c.is_alphanumeric() || "_.".contains(c);
        let begins = rest.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let is_quoted = rest.starts_with('\'');
        let end = match (begins, is_quoted) {
            (_, true) => rest[1..].find('\'').map_or(rest.len(), |at| at + 2),
            (true, _) => rest.find(|c: char| !is_inside(c)).unwrap_or(rest.len()),
            // A number with its exponent, or a sign.
            _ if rest.starts_with(|c: char| c.is_ascii_digit()) => {
                let digits = |c: char| c.is_ascii_digit() || c == '.';
                let mantissa = rest.find(|c: char| !digits(c)).unwrap_or(rest.len());
                let exponent = rest[mantissa..].strip_prefix(['e', 'E']).map_or(0, |tail| {
                    let sign = usize::from(tail.starts_with(['+', '-']));
                    1 + sign + tail[sign..].find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len() - sign)
                });
                mantissa + exponent
            }
            _ => rest.chars().next().map_or(1, char::len_utf8),
        };
        let (word, after) = rest.split_at(end);
        each(word, (begins || is_quoted) && !after.starts_with('('));
        rest = after;
    }
}

#[cfg(test)]
mod tests {
    use super::{replaced, variables};

    #[test]
    fn variables_are_told_from_functions_and_numbers() {
        let shape = "noEvent(max(port.q - (2.5e-3), 0))*abs(v)/sqrt(abs('p 1') + 1e+4*e)";
        assert_eq!(variables(shape), ["port.q", "v", "'p 1'", "e"]);
        let other = replaced(shape, &|name| format!("<{name}>"));
        assert_eq!(other, "noEvent(max(<port.q> - (2.5e-3), 0))*abs(<v>)/sqrt(abs(<'p 1'>) + 1e+4*<e>)");
    }
}
