//! What a model may lack: the effects that libraries declare, and the places of the model that they fit.
//!
//! Effects are classes with `annotation(__hyd(effect(...)))`, places replaceable components with
//! `annotation(__hyd(place(id = ...)))`; both are read as data, so that neither an effect nor a drive needs a line of Rust.
//! A [`Candidate`] is an effect at the place (or places) of one model.

mod commands;
pub(crate) mod considered;
pub(crate) mod door;
mod exchanged;
mod naming;
pub(crate) mod natural;
pub(crate) mod places;
pub(crate) mod same_ids;

use std::sync::Arc;

use hyd_compiler::did_you_mean;
use hyd_compiler::inquiry::{AnnotatedClass, AnnotatedComponent, Note};

use crate::Fault;
use crate::catalogue::door::Door;
use crate::unknowns::prior::Prior;

/// Is it the machine or the measurement?
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// The machine.
    Physics,
    /// The measuring chain.
    Sensor,
}

impl Kind {
    /// The word used in annotations and reports.
    pub fn word(self) -> &'static str {
        if self == Kind::Physics { "physics" } else { "sensor" }
    }
}

/// A parameter of an effect that is fitted.
#[derive(Clone, Debug)]
pub struct EffectParameter {
    /// Name in the class.
    pub name: Arc<str>,
    /// Prior.
    pub prior: Prior,
    /// Ends of what is plausible.
    pub range: Option<(f64, f64)>,
    /// Prior and range are shares of this, a formula of what the variables of the place show in the base model ([`crate::catalogue::natural`]).
    pub of: Option<Arc<str>>,
}

/// A parameter of an effect that is set to what suits the machine and is not fitted.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Name in the class.
    pub name: Arc<str>,
    /// Formula as for [`EffectParameter::of`].
    pub of: Arc<str>,
    /// Its value at a place; none before the base model has run.
    pub value: Option<f64>,
}

/// An effect of a library.
#[derive(Clone, Debug)]
pub struct Effect {
    /// Its name in reports.
    pub id: Arc<str>,
    /// Machine or measurement.
    pub kind: Kind,
    /// Full name of the class.
    pub class: String,
    /// Words for reports.
    pub words: Arc<str>,
    /// How it shows.
    pub signature: Arc<str>,
    /// Effects that it is easily taken for.
    pub rivals: Vec<Arc<str>>,
    /// Sets of places that it takes, of which it needs one.
    pub at: Vec<Vec<Arc<str>>>,
    /// Fitted parameters; the first carries its size.
    pub parameters: Vec<EffectParameter>,
    /// Parameters that are set once the place is known.
    pub references: Vec<Reference>,
    /// By what share of itself nature's number may differ from the law's, as its form is another one (one standard deviation).
    pub form: f64,
    /// Effects that cannot be at the same place of equations.
    pub excludes: Vec<Arc<str>>,
    /// Effects that it is with further numbers: with implausible ones it is no rival of them.
    pub refines: Vec<Arc<str>>,
    /// A variable of the place that must be an absolute temperature (K) for the law to mean anything.
    pub absolute: Option<Arc<str>>,
    /// Size at which the model is as without it, if there is one.
    pub zero: Option<f64>,
    /// A typical size.
    pub probe: f64,
    /// Sizes are shares of the range of the channel at the place.
    pub of_range: bool,
    /// It is a block that is given variables of a place and gives a term, not a component that is redeclared.
    pub is_law: bool,
    /// The variables that it is given where its place is an equation of the study's file.
    pub given: Vec<Arc<str>>,
    /// Its size is another one in every shot.
    pub per_shot: bool,
    /// The base model that lacks it, if only some do.
    pub base: Option<Arc<str>>,
    /// File of the class.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A place of a model.
#[derive(Clone, Debug)]
pub struct Site {
    /// Its id.
    pub id: Arc<str>,
    /// Instance path.
    pub path: String,
    /// Words.
    pub words: Arc<str>,
    /// Channel whose measuring chain it is.
    pub channel: Option<Arc<str>>,
    /// File of the declaration.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// How an effect comes in.
    pub door: Door,
    /// What may be asked of the base model for sizes: a name that effects use, and an expression of the model.
    pub scales: Vec<(String, String)>,
    /// The array of which the variable that the place belongs to is an element: `T` of `T[2]`.
    pub array: Option<Arc<str>>,
}

impl Site {
    /// Paths of the components or variables that it concerns: an exchange has two.
    pub fn components(&self) -> Vec<&str> {
        match &self.door {
            Door::Exchange { stored: [one, other], .. } => vec![one, other],
            _ => vec![&self.path],
        }
    }
}

/// An effect at places of a model.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The effect.
    pub effect: Arc<Effect>,
    /// Where: one place for each id that it takes at once, or one for each element of an array.
    pub sites: Vec<Site>,
}

impl Candidate {
    /// Id, with the channel where several chains could have it, and the one that it hears.
    pub fn label(&self) -> String {
        let hears = |site: &Site| matches!(site.door, Door::Channel { heard: Some(_), .. });
        match self.sites.first().filter(|site| !hears(site)).and_then(|site| site.channel.as_ref()) {
            Some(channel) => format!("{} of {channel}", self.effect.id),
            None => match self.sites.first() {
                Some(site) if site.door != Door::Component => format!("{} of {}", self.effect.id, self.place()),
                _ => self.effect.id.to_string(),
            },
        }
    }

    /// Where it is, in a word: the path of its place, or the array whose elements all have it.
    pub fn place(&self) -> String {
        match &self.sites[..] {
            [Site { array: Some(array), door, .. }, _, ..] if *door != Door::Component => format!("each {array}"),
            [site, ..] => site.path.clone(),
            [] => String::new(),
        }
    }

    /// Paths of the components or variables that it concerns, where these were found in equations of those of an array.
    pub fn components(&self) -> Vec<&str> {
        let of = if self.is_found() { &self.sites[..] } else { &self.sites[..self.sites.len().min(1)] };
        of.iter().flat_map(Site::components).collect()
    }

    /// True if its place was found in the equations or is a channel, and not declared by the model.
    pub fn is_found(&self) -> bool {
        self.sites.iter().any(|site| site.door != Door::Component)
    }

    /// Path of the component that is the effect at a place.
    pub fn component(&self, site: &Site) -> String {
        match site.door {
            Door::Component => site.path.clone(),
            _ => {
                let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
                let plain = |text: &str| text.chars().map(plain).collect::<String>();
                format!("{}_of_{}", plain(&self.effect.id), plain(&site.path))
            }
        }
    }

    /// True if the two are the same effect at the same places.
    pub fn is_same(&self, other: &Candidate) -> bool {
        self.effect.id == other.effect.id
            && self.sites.len() == other.sites.len()
            && self.sites.iter().zip(&other.sites).all(|(own, other)| own.path == other.path)
    }

    /// True if it is the other one with further numbers at the same place, or the same in more elements of an array.
    pub fn refines(&self, other: &Candidate) -> bool {
        let is_of_more = || {
            let within = |site: &Site| self.sites.iter().any(|own| own.id == site.id && own.path == site.path);
            self.effect.id == other.effect.id
                && other.sites.len() < self.sites.len()
                && self.is_found()
                && other.sites.iter().all(within)
        };
        self.effect.refines.contains(&other.effect.id) && self.place() == other.place() || is_of_more()
    }

    /// What tells it from all others of one model.
    pub fn key(&self) -> String {
        let paths: Vec<&str> = self.sites.iter().map(|site| site.path.as_str()).collect();
        format!("{} at {}", self.effect.id, paths.join(", "))
    }

    /// True if the two cannot be in one model: they want the same component, or one of them says that the other cannot be beside it.
    pub fn excludes(&self, other: &Candidate) -> bool {
        let (own, others) = (&self.effect, &other.effect);
        let is_said = own.excludes.contains(&others.id) || others.excludes.contains(&own.id) || own.id == others.id;
        let clash = |site: &Site, taken: &Site| {
            let is_one = site.path == taken.path && site.id == taken.id;
            let redeclared = [site, taken].iter().filter(|own| own.door == Door::Component).count();
            if redeclared == 2 { site.path == taken.path } else { is_one && redeclared == 0 && is_said }
        };
        self.sites.iter().any(|site| other.sites.iter().any(|taken| clash(site, taken)))
    }
}

/// Reads the effects among annotated classes.
///
/// # Errors
/// A sentence on the first annotation that is not an effect's.
pub(crate) fn effects(classes: &[AnnotatedClass]) -> Result<Vec<Arc<Effect>>, Fault> {
    classes.iter().map(|class| effect(class).map(Arc::new)).collect()
}

/// Under this name a place states what is typical of it, as an expression of the model.
pub(crate) const SCALE: &str = "scale";

/// [`Effect::form`] where an effect does not say it: how well laws of textbooks describe parts of machines.
pub(crate) const USUAL_FORM: f64 = 0.05;

/// What an effect's annotation may say.
const KEYS: [&str; 23] = [
    "id",
    "kind",
    "words",
    "signature",
    "rivals",
    "at",
    "at_one_of",
    "adds",
    "prior",
    "range",
    "zero",
    "probe",
    "probe_of_range",
    "per_shot",
    "base",
    "channels",
    "of",
    "excludes",
    "refines",
    "law",
    "given",
    "form",
    "absolute",
];

fn effect(class: &AnnotatedClass) -> Result<Effect, Fault> {
    let wrong = |why: String| {
        Fault::new(format!("`{}` ({}:{}) is not a usable effect: {why}", class.name, class.file, class.line))
    };
    let note = class.note.get("effect").ok_or_else(|| wrong("its annotation has no `effect`".into()))?;
    if let Note::Record(entries) = note
        && let Some((key, _)) = entries.iter().find(|(key, _)| !KEYS.contains(&&**key))
    {
        let hint = did_you_mean(key, KEYS).map_or_else(String::new, |hint| format!("; {hint}"));
        return Err(wrong(format!("an effect has no `{key}`{hint}")));
    }
    type Wanted = (&'static [&'static str], &'static str, fn(&Note) -> bool);
    let wanted: [Wanted; 4] =
        [
            (&["per_shot", "probe_of_range", "law"], "`true` or `false`", |own| matches!(own, Note::Boolean(_))),
            (&["zero", "probe", "form"], "a number", |own| own.number().is_some_and(f64::is_finite)),
            (&["id", "kind", "words", "signature", "adds", "prior", "base", "of", "absolute"], "a text", |own| {
                own.text().is_some()
            }),
            (&["at", "at_one_of", "rivals", "channels", "excludes", "refines", "given"], "a list of texts", |own| {
                match own {
                    Note::List(list) => list.iter().all(|one| one.text().is_some()),
                    own => own.text().is_some(),
                }
            }),
        ];
    for (keys, what, is_wanted) in wanted {
        if let Some(key) = keys.iter().find(|key| note.get(key).is_some_and(|own| !is_wanted(own))) {
            return Err(wrong(format!("`{key}` must be {what}")));
        }
    }
    let text = |key: &str| note.get(key).and_then(Note::text).map(Arc::<str>::from);
    let needed = |key: &str| text(key).ok_or_else(|| wrong(format!("`{key}` is missing")));
    let number = |key: &str| note.get(key).and_then(Note::number);
    let flag = |key: &str| note.get(key) == Some(&Note::Boolean(true));
    let kind = match &*needed("kind")? {
        "physics" => Kind::Physics,
        "sensor" => Kind::Sensor,
        other => return Err(wrong(format!("the kind `{other}` is neither `physics` nor `sensor`"))),
    };
    let at = match (note.get("at"), note.get("at_one_of")) {
        (Some(at), None) => vec![at.texts()],
        (None, Some(several)) => several.texts().into_iter().map(|id| vec![id]).collect(),
        _ => return Err(wrong("one of `at` and `at_one_of` must say where it fits".into())),
    };
    if at.is_empty() || at.iter().any(Vec::is_empty) {
        return Err(wrong("`at` and `at_one_of` must name a place at least".into()));
    }
    if number("form").is_some_and(|form| !(0.0..1.0).contains(&form)) {
        return Err(wrong("`form` must be from 0 to less than 1, a share of the size".into()));
    }
    let range = |note: &Note| match note.get("range").map(Note::numbers).as_deref() {
        None => Ok(None),
        Some(&[from, to]) if from < to => Ok(Some((from, to))),
        Some(_) => Err(wrong("`range` must be two numbers, the smaller first".into())),
    };
    let prior = |text: &str| Prior::parse(text).map_err(|fault| wrong(fault.sentence));
    let mut parameters = vec![EffectParameter {
        name: needed("adds")?,
        prior: prior(&needed("prior")?)?,
        range: range(note)?,
        of: text("of"),
    }];
    let mut references = Vec::new();
    let size = parameters[0].name.clone();
    for component in class.components.iter().filter(|component| *component.path != *size) {
        let name: Arc<str> = component.path.as_str().into();
        let of = component.note.get("of").and_then(Note::text).map(Arc::<str>::from);
        if let Some(stated) = component.note.get("prior").and_then(Note::text) {
            let range = range(&component.note)?;
            parameters.push(EffectParameter { name, prior: prior(stated)?, range, of });
        } else if let Some(of) = of {
            references.push(Reference { name, of, value: None });
        }
    }
    Ok(Effect {
        id: needed("id")?,
        kind,
        class: class.name.clone(),
        words: text("words").unwrap_or_else(|| class.description.clone()),
        signature: text("signature").unwrap_or_default(),
        rivals: note.get("rivals").map(Note::texts).unwrap_or_default(),
        at,
        parameters,
        references,
        form: number("form").unwrap_or(USUAL_FORM),
        excludes: note.get("excludes").map(Note::texts).unwrap_or_default(),
        refines: note.get("refines").map(Note::texts).unwrap_or_default(),
        absolute: text("absolute"),
        zero: number("zero"),
        probe: number("probe").ok_or_else(|| wrong("`probe` must be a number".into()))?,
        of_range: flag("probe_of_range"),
        is_law: flag("law"),
        given: note.get("given").map(Note::texts).unwrap_or_default(),
        per_shot: flag("per_shot"),
        base: text("base"),
        file: class.file.clone(),
        line: class.line,
    })
}

/// Reads the places among annotated components.
pub(crate) fn sites(components: &[AnnotatedComponent]) -> Vec<Site> {
    let read = components.iter().filter_map(|component| {
        let place = component.note.get("place")?;
        Some(Site {
            id: place.get("id")?.text()?.into(),
            path: component.path.clone(),
            words: component.description.clone(),
            channel: place.get("channel").and_then(Note::text).map(Arc::from),
            file: component.file.clone(),
            line: component.line,
            door: Door::Component,
            scales: place
                .get("scale")
                .and_then(Note::text)
                .map(|text| (SCALE.into(), text.into()))
                .into_iter()
                .collect(),
            array: None,
        })
    });
    read.collect()
}

/// All ways to put the effects into a model with these places.  Effects of other base models and measuring chains of channels
/// that are not measured are left out.
pub(crate) fn candidates(
    effects: &[Arc<Effect>],
    sites: &[Site],
    base_model: Option<&str>,
    measured: &dyn Fn(&str) -> bool,
) -> Vec<Candidate> {
    let (mut found, mut found_at) = (Vec::new(), Vec::new());
    for effect in effects {
        if effect.base.as_deref().is_some_and(|base| Some(base) != base_model) {
            continue;
        }
        for ids in &effect.at {
            if let [id] = &ids[..] {
                // Each place that was found in the equations is one of its own.
                let fits = |site: &&Site| match site.door {
                    Door::Component => false,
                    Door::Channel { .. } | Door::Moved(_) => !effect.is_law,
                    Door::Balance { ref law, .. } if !effect.given.is_empty() => effect.is_law && is_given(effect, law),
                    _ => effect.is_law,
                };
                let found: Vec<&Site> = sites.iter().filter(|site| site.id == *id).filter(fits).collect();
                for sites in apart_and_together(&found) {
                    found_at.push(Candidate { effect: effect.clone(), sites: sites.into_iter().cloned().collect() });
                }
            }
            if effect.is_law {
                continue;
            }
            let sites: Vec<&Site> = sites.iter().filter(|site| site.door == Door::Component).collect();
            let taken: Vec<Site> = ids
                .iter()
                .filter_map(|id| sites.iter().find(|site| site.id == *id).map(|site| (*site).clone()))
                .collect();
            let missing_channel =
                taken.iter().any(|site| site.channel.as_ref().is_some_and(|channel| !measured(channel)));
            if taken.len() == ids.len() && !taken.is_empty() && !missing_channel {
                found.push(Candidate { effect: effect.clone(), sites: taken });
            }
        }
    }
    found.append(&mut found_at);
    found
}

/// Larger arrays have effects in all elements only, and not in one of them.
const MOST_APART: usize = 8;

/// Each place by itself, and all places of an array at once.
fn apart_and_together<'s>(sites: &[&'s Site]) -> Vec<Vec<&'s Site>> {
    let of = |site: &Site| -> Vec<&'s Site> {
        sites.iter().filter(|own| site.array.is_some() && own.array == site.array).copied().collect()
    };
    let mut found = Vec::new();
    for (k, site) in sites.iter().enumerate() {
        let all = of(site);
        if all.len() <= MOST_APART {
            found.push(vec![*site]);
        }
        let is_last = !sites[k + 1..].iter().any(|other| site.array.is_some() && other.array == site.array);
        if is_last && all.len() > 1 {
            found.push(all);
        }
    }
    found
}

/// Sentences on effects that could be laws at places of the model that were found, but do not say that they are laws.
pub(crate) fn not_laws(effects: &[Arc<Effect>], sites: &[Site], all: &[Candidate]) -> Vec<String> {
    let takes_laws = |site: &&Site| !site.door.ends().is_empty() || matches!(site.door, Door::Command { .. });
    let is_tried = |effect: &Effect| all.iter().any(|own| own.effect.class == effect.class);
    let sentence = |effect: &Arc<Effect>| {
        let ids = effect.at.iter().filter_map(|ids| if let [id] = &ids[..] { Some(id) } else { None });
        let mut sites = ids.filter_map(|id| sites.iter().filter(takes_laws).find(|site| site.id == *id));
        let site = sites.next().filter(|_| !effect.is_law && !is_tried(effect))?;
        let Effect { class, file, line, .. } = &**effect;
        Some(format!(
            "`{class}` ({file}:{line}) is not tried: the place `{}` of this model takes laws; write `law = true` in its annotation, `effect(id = \"{}\", law = true, ...)`",
            site.id, effect.id
        ))
    };
    effects.iter().filter_map(sentence).collect()
}

/// True if an equation gives a law the variables that it names.
fn is_given(effect: &Effect, law: &crate::catalogue::door::Law) -> bool {
    let is_one = |(given, (_, expression)): (&Arc<str>, &(&'static str, Option<String>))| {
        let rest = expression.as_deref().and_then(|own| own.strip_suffix(&**given));
        rest.is_some_and(|rest| rest.is_empty() || rest.ends_with('.'))
    };
    law.inputs.len() == effect.given.len() && effect.given.iter().zip(&law.inputs).all(is_one)
}

/// A sentence on places of one id, of which effects take the first only.
pub(crate) fn same_places(sites: &[Site]) -> Option<String> {
    let declared = sites.iter().enumerate().filter(|(_, site)| site.door == Door::Component);
    let (k, site) = declared.into_iter().find(|(k, site)| sites[..*k].iter().any(|other| other.id == site.id))?;
    let first = sites[..k].iter().find(|other| other.id == site.id)?;
    let (id, one, other) = (&site.id, &first.path, &site.path);
    Some(format!("`{one}` and `{other}` are both the place `{id}`; effects are tried in `{one}` only"))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(crate) mod tests {
    use hyd_compiler::inquiry::{AnnotatedClass, Note};

    use super::effects;

    /// An effect whose plausible sizes lie between these ends.
    pub(crate) fn with_range(ends: &[f64]) -> AnnotatedClass {
        let text = |text: &str| Note::Text(text.into());
        let list = ends.iter().map(|&end| Note::Number(end)).collect();
        let entries = [
            ("id", text("seeping")),
            ("kind", text("physics")),
            ("at", Note::List(vec![text("leakage")])),
            ("adds", text("k")),
            ("probe", Note::Number(1.0)),
            ("prior", text("lognormal(1, 0.5)")),
            ("range", Note::List(list)),
        ];
        let entries = entries.into_iter().map(|(key, note)| (key.into(), note)).collect();
        let note = Note::Record(vec![("effect".into(), Note::Record(entries))]);
        let (name, description) = ("Own.Seep".to_string(), "".into());
        AnnotatedClass { name, description, note, components: Vec::new(), file: "own.hyd".into(), line: 3 }
    }

    #[test]
    fn ends_of_what_is_plausible_come_in_their_order() {
        assert_eq!(effects(&[with_range(&[0.5, 2.0])]).unwrap()[0].parameters[0].range, Some((0.5, 2.0)));
        for ends in [&[2.0, 0.5][..], &[1.0], &[1.0, 1.0], &[0.5, f64::NAN]] {
            let fault = effects(&[with_range(ends)]).unwrap_err();
            assert!(fault.sentence.contains("own.hyd:3") && fault.sentence.contains("`range`"), "{}", fault.sentence);
        }
    }

    #[test]
    fn what_an_effect_says_wrongly_is_told() {
        for (key, value, expected) in [
            ("per_shto", Note::Boolean(true), "an effect has no `per_shto`; did you mean `per_shot`?"),
            ("per_shot", Note::Number(1.0), "`per_shot` must be `true` or `false`"),
            ("zero", Note::Record(Vec::new()), "`zero` must be a number"),
            ("rivals", Note::List(vec![Note::Number(1.0)]), "`rivals` must be a list of texts"),
            ("words", Note::Number(1.0), "`words` must be a text"),
            ("form", Note::Number(1.5), "`form` must be from 0 to less than 1, a share of the size"),
        ] {
            let mut class = with_range(&[0.5, 2.0]);
            if let Note::Record(all) = &mut class.note
                && let Note::Record(entries) = &mut all[0].1
            {
                entries.push((key.into(), value));
            }
            let fault = effects(&[class]).unwrap_err();
            assert!(fault.sentence.ends_with(expected), "{}", fault.sentence);
        }
        let mut class = with_range(&[0.5, 2.0]);
        if let Note::Record(all) = &mut class.note
            && let Note::Record(entries) = &mut all[0].1
        {
            entries.iter_mut().filter(|(key, _)| &**key == "at").for_each(|own| own.1 = Note::List(Vec::new()));
        }
        let fault = effects(&[class]).unwrap_err();
        assert!(fault.sentence.ends_with("`at` and `at_one_of` must name a place at least"), "{}", fault.sentence);
        let mut class = with_range(&[0.5, 2.0]);
        if let Note::Record(all) = &mut class.note
            && let Note::Record(entries) = &mut all[0].1
        {
            entries.push(("rivals".into(), Note::List(Vec::new())));
        }
        assert!(effects(&[class]).unwrap()[0].rivals.is_empty());
    }
}
