//! A law that no library knows, as the text of an effect.
//!
//! The search finds terms of one equation with their coefficients ([`crate::search`]).  Here they become a class that could stand in a
//! library: where the equation belongs to a component that the model lets exchange, a copy of its class with the terms in it, and where it
//! stands in the study's model file, a block that is given variables and gives a term.  Where its term has a memory, the class has the
//! states ([`crate::terms::dynamics`]).  From then on it is a candidate like others.

use std::fmt::Write;
use std::sync::Arc;

use hyd_compiler::{Act, Opening, SourceText, Sources, Variation, opened, print_string, varied};

use crate::catalogue::door::{self, Door, End};
use crate::catalogue::{Candidate, Effect, EffectParameter, Kind, Site};
use crate::elements::At;
use crate::terms::dictionary::Term;
use crate::terms::dynamics::{Dynamics, Names};
use crate::unknowns::prior::Prior;
use crate::variant::Workshop;

/// Name of the class, with a number where it is taken.
const CLASS: &str = "Proposed";
/// Id of the effect, with a number where a library has it.
pub(crate) const ID: &str = "proposed_law";
/// Names of what a block is given.
const GIVEN: [&str; 8] = ["u1", "u2", "u3", "u4", "u5", "u6", "u7", "u8"];
/// What a block gives.
const GIVES: &str = "term";
/// How the id of the place that an equation is begins.
pub(crate) const EQUATION: &str = "equation";
/// The place of an equation that belongs to no component.
const WHOLE: &str = "the model";
/// Rivals that a report names.
pub(crate) const RIVALS: usize = 5;
/// Spread of the logarithm of a memory's numbers, in the text of a law.
const KNOWN: f64 = 0.7;
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

/// The states of a term, with their numbers.
#[derive(Clone, Debug)]
pub struct LawMemory {
    /// The differential equations.
    pub equations: Vec<String>,
    /// Their numbers, behind the coefficient among the parameters of the effect.
    pub numbers: Vec<MemoryNumber>,
}

/// A number of the states of a term.
#[derive(Clone, Debug)]
pub struct MemoryNumber {
    /// Name of the parameter.
    pub name: String,
    /// What it is.
    pub words: &'static str,
    /// Unit, if it is known.
    pub unit: Option<String>,
    /// Fitted value.
    pub value: f64,
    /// What was expected of it before the fit.
    pub prior: Prior,
}

/// What a law consists of before it is text: terms of one equation, or one whose shape a form with memory gives, with what is expected
/// of the form's numbers.
pub(crate) struct Parts<'a> {
    pub terms: Vec<LawTerm>,
    pub memory: Option<(&'a Dynamics, Vec<Prior>)>,
}

/// The text of a form with memory in a class.
struct Written {
    dynamics: Dynamics,
    names: Names,
    memory: LawMemory,
}

impl Written {
    /// Under names that none of the texts of the equation has.
    fn new(dynamics: &Dynamics, priors: &[Prior], is_free: &dyn Fn(&str) -> bool) -> Self {
        let all = |names: &Names| names.states.iter().chain(&names.numbers).all(|name| is_free(name));
        let named = |k: u32| dynamics.names(&format!("_{k}"));
        // A text is finite, and there is an ending for every number.
        let names = (1..).map(named).find(all).unwrap_or_else(|| named(1));
        let number = |(((name, unit, words), &value), &prior)| MemoryNumber { name, words, unit, value, prior };
        let numbers = dynamics.numbers(&names).into_iter().zip(&dynamics.numbers).zip(priors).map(number).collect();
        let (_, equations) = dynamics.equations(&names, &dynamics.driver);
        let equations = equations.lines().map(|line| line.trim_end_matches(';').to_string()).collect();
        Self { dynamics: dynamics.clone(), names, memory: LawMemory { equations, numbers } }
    }

    /// Numbers and states as declarations.
    fn declarations(&self) -> String {
        let mut text = String::new();
        for own in &self.memory.numbers {
            let unit = own.unit.as_ref().map_or(String::new(), |unit| format!("(unit = {})", print_string(unit)));
            let (a, b) = (figure(PLAUSIBLE.0 * own.value), figure(PLAUSIBLE.1 * own.value));
            let (name, value, words) = (&own.name, figure(own.value), print_string(own.words));
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "parameter Real {name}{unit} = {value} {words}\n  annotation(__hyd(prior = \"lognormal({value}, {KNOWN})\", range = {{{a}, {b}}}));"
            );
        }
        text + &self.dynamics.states(&self.names)
    }

    /// Initial equations and equations, for a variable of this name.
    fn equations(&self, variable: &str) -> (String, String) {
        self.dynamics.equations(&self.names, variable)
    }
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
    /// What the only term follows, if that has states of its own.
    pub memory: Option<LawMemory>,
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
        let memory = self.memory.iter().flat_map(|own| {
            let number = |own: &MemoryNumber| format!("{} = {:.3e}", own.name, own.value);
            own.equations.iter().cloned().chain(own.numbers.iter().map(number))
        });
        let with: Vec<String> = memory.collect();
        let with = if with.is_empty() { String::new() } else { format!(" with {}", with.join(", ")) };
        format!("{own}{}{with}", terms.collect::<String>())
    }

    /// What it adds, in names of the model that has it.
    pub(crate) fn expression(&self) -> Option<String> {
        let site = self.candidate.sites.first()?;
        if site.door != Door::Component {
            return Some(format!("{}.{GIVES}", self.candidate.component(site)));
        }
        let names: Vec<String> = self.candidate.effect.parameters.iter().map(|own| own.name.to_string()).collect();
        let sum = sum(&self.terms, &names, &|shape| shape.to_string());
        Some(replaced(&sum, &|name| format!("{}.{name}", site.path)))
    }

    /// Makes the text of a law from terms of one equation; none where it belongs to a component that cannot be exchanged and stands in a
    /// file that is not the study's.  `sites` are the places that the model declares, `files` names and texts of what it is made of.
    pub(crate) fn new(
        workshop: &Workshop<'_>,
        (sites, ids): (&[&Site], &[&str]),
        files: &[(String, String)],
        Parts { mut terms, memory }: Parts<'_>,
    ) -> Option<Self> {
        let is_free = |name: &str| texts_of(&terms, files).all(|text| !text.contains(name));
        let memory = memory.map(|(dynamics, priors)| Written::new(dynamics, &priors, &is_free));
        if let (Some(memory), Some(own)) = (&memory, terms.first_mut()) {
            own.term.shape = memory.dynamics.shape(&memory.names);
            own.term.unit =
                own.term.of_equation.as_ref().and_then(|equation| memory.dynamics.unit_of_coefficient(equation));
        }
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
                let mut declarations = declarations(&terms, &names);
                let mut sections = String::new();
                if let Some(own) = &memory {
                    let (initial, equations) = own.equations(&own.dynamics.driver);
                    declarations.push_str(&own.declarations());
                    sections = format!("initial equation\n{}equation\n{}", indented(&initial), indented(&equations));
                }
                let text = varied(
                    file,
                    &Variation {
                        line: first.line,
                        equation: &first.equation,
                        name: &name,
                        description: &sentence(&words),
                        declarations: &declarations,
                        term: &sum(&terms, &names, &|shape| shape.to_string()),
                        sections: &sections,
                        annotation: &annotation,
                    },
                )?;
                ((*site).clone(), text)
            }
            None => of_equation(workshop, (&name, &id, &words), (&terms, &names), memory.as_ref())?,
        };
        let is_law = site.door != Door::Component;
        let parameter = |(own, name): (&LawTerm, &String)| EffectParameter {
            name: name.as_str().into(),
            prior: Prior::Normal(0.0, own.spread),
            range: None,
            of: None,
        };
        let memory = memory.map(|own| own.memory);
        let numbers = memory.iter().flat_map(|own| &own.numbers).map(|own| EffectParameter {
            name: own.name.as_str().into(),
            prior: own.prior,
            range: None,
            of: None,
        });
        let effect = Effect {
            id: id.as_str().into(),
            kind,
            class: name.clone(),
            words: words.as_str().into(),
            signature: "".into(),
            rivals: Vec::new(),
            at: vec![vec![site.id.clone()]],
            parameters: terms.iter().zip(&names).map(parameter).chain(numbers).collect(),
            references: Vec::new(),
            excludes: Vec::new(),
            refines: Vec::new(),
            absolute: None,
            zero: Some(0.0),
            // What was made after the record is no idealised law.
            form: 0.0,
            probe: terms.first().map_or(1.0, |own| own.value.abs()),
            of_range: false,
            is_law,
            given: Vec::new(),
            per_shot: false,
            base: None,
            file: format!("{name}.hyd").into(),
            line: 1,
        };
        let candidate = Candidate { effect: Arc::new(effect), sites: vec![site] };
        Some(Self { name, text: text.into(), terms, memory, rivals: Vec::new(), candidate })
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
    let is_free = |name: &&&str| !texts_of(terms, files).any(|text| text.contains(&format!("{name}_")));
    ["c", "law", "coefficient"].iter().find(is_free).copied().unwrap_or("coefficient_of_law")
}

/// The texts that hold the equation of these terms.
fn texts_of<'a>(terms: &'a [LawTerm], files: &'a [(String, String)]) -> impl Iterator<Item = &'a str> {
    let own = files.iter().filter(|(name, _)| terms.iter().any(|own| *own.term.file == **name));
    own.map(|(_, text)| text.as_str())
}

/// Lines of a section.
fn indented(lines: &str) -> String {
    lines.lines().map(|line| format!("  {line}\n")).collect()
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
    (terms, names): (&[LawTerm], &[String]),
    memory: Option<&Written>,
) -> Option<(Site, String)> {
    let first = &terms.first()?.term;
    if workshop.own_text(&first.file).is_none() || first.component.contains('[') {
        return None;
    }
    let mut given: Vec<String> = Vec::new();
    for own in terms {
        let followed = memory.map_or(&own.term.shape, |memory| &memory.dynamics.driver);
        for variable in variables(followed) {
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
    let own = declarations(terms, names) + &memory.map_or(String::new(), Written::declarations);
    text.push_str(&indented(&own));
    let shape = |own: &str| {
        replaced(own, &|variable| {
            given.iter().position(|known| known == variable).map_or(variable, |k| GIVEN[k]).to_string()
        })
    };
    let _ = writeln!(text, "  output Real {GIVES} \"what is added\";");
    let (initial, equations) = memory.map(|own| own.equations(&shape(&own.dynamics.driver))).unwrap_or_default();
    if !initial.is_empty() {
        let _ = writeln!(text, "initial equation\n{}", indented(&initial).trim_end());
    }
    let _ = writeln!(text, "equation\n  {GIVES} = {};", sum(terms, names, &shape));
    text.push_str(&indented(&equations));
    let at = print_string(&place_id(&first.component, &first.equation));
    let list: Vec<String> = given.iter().map(|own| print_string(own)).collect();
    let place = format!("law = true, at = {{{at}}},\n    given = {{{}}}, ", list.join(", "));
    let _ = writeln!(
        text,
        "  annotation({});\nend {name};",
        annotation((id, words), terms, names, (Kind::Physics, &place))
    );
    let given: Vec<Arc<str>> = given.iter().map(|own| own.as_str().into()).collect();
    let site = site_of((&first.component, &first.file, first.line, &first.equation), &given, workshop)?;
    Some((site, text))
}

/// The id of the place that an equation of the study's file is.
pub(crate) fn place_id(component: &str, equation: &str) -> String {
    let of = if component.is_empty() { String::new() } else { format!(" of {component}") };
    format!("{EQUATION}{of}: {}", equation.trim_end_matches(';'))
}

/// The place that an equation (component, file, line, text) of the study's file, or of its package, is, for a block that is given these variables of the
/// component; none where the equation cannot be opened.
pub(crate) fn site_of(
    (component, file, line, equation): (&Arc<str>, &str, u32, &str),
    given: &[Arc<str>],
    workshop: &Workshop<'_>,
) -> Option<Site> {
    let text = workshop.own_text(file)?;
    let opening = Opening {
        file: file.into(),
        line,
        equation: equation.to_string(),
        name: free(text, line)?,
        words: "what no library holds".to_string(),
        factor: String::new(),
        act: Act::Adds,
        elements: None,
    };
    opened(text, std::slice::from_ref(&opening))?;
    let full = |variable: &Arc<str>| match component.is_empty() {
        true => variable.to_string(),
        false => format!("{component}.{variable}"),
    };
    let inputs = given.iter().zip(GIVEN).map(|(variable, input)| (input, Some(full(variable)))).collect();
    Some(Site {
        id: place_id(component, equation).into(),
        path: if component.is_empty() { WHOLE.to_string() } else { component.to_string() },
        words: equation.trim_end_matches(';').into(),
        channel: None,
        file: workshop.shown_file(file).into(),
        line,
        door: Door::Balance {
            end: End::Equation { opening, path: component.clone(), is_reversed: false, element: At::default() },
            law: door::Law { inputs, output: GIVES },
        },
        scales: Vec::new(),
        array: None,
    })
}

/// A name for what is let into the equation of this line: the same for all that is added to it, and another one for every equation.
fn free(text: &str, line: u32) -> Option<String> {
    let name = format!("further_{line}");
    let longer = std::iter::successors(Some(name), |name| Some(format!("{name}_")));
    longer.take(text.len()).find(|name| !text.contains(name.as_str()))
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
    use super::{free, replaced, variables};

    #[test]
    fn every_equation_has_a_name_of_its_own_for_what_is_added() {
        let text = "model M\n  Real further_3;\n  Real further_31;\nend M;\n";
        assert_eq!(free(text, 10).as_deref(), Some("further_10"));
        assert_eq!(free(text, 3).as_deref(), Some("further_3_"));
        assert_eq!(free(text, 31).as_deref(), Some("further_31_"));
    }

    #[test]
    fn variables_are_told_from_functions_and_numbers() {
        let shape = "noEvent(max(port.q - (2.5e-3), 0))*abs(v)/sqrt(abs('p 1') + 1e+4*e)";
        assert_eq!(variables(shape), ["port.q", "v", "'p 1'", "e"]);
        let other = replaced(shape, &|name| format!("<{name}>"));
        assert_eq!(other, "noEvent(max(<port.q> - (2.5e-3), 0))*abs(<v>)/sqrt(abs(<'p 1'>) + 1e+4*<e>)");
    }
}
