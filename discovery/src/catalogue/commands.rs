//! Places in the commands of a model to its valves and drives: variables that follow a course in time.
//!
//! They stand in the model's own class ([`hyd_compiler::commands`]), in its package, or in the equations of its components, as sources of
//! libraries do it (`y = offset + (if time < startTime then 0 else height)`), or they are recorded inputs that balances read as they come
//! ([`hyd_compiler::read_inputs`]).

use std::sync::Arc;

use hyd_compiler::{Act, Command, Course, InjectionSite, Opening, ReadInput, course, opened, read_inputs};
use hyd_system::{Place, Tables, ValueKind, Variability, VariableInfo};

use crate::catalogue::Site;
use crate::catalogue::door::Door;
use crate::catalogue::naming::shared;
use crate::variant::Workshop;

/// Id of the place that a course in time is.
const COMMAND: &str = "command";

/// The places that courses in time are, behind those that are known.
pub(super) fn commands(sites: &[InjectionSite], tables: &Tables, workshop: &Workshop<'_>, found: &mut Vec<Site>) {
    let is_number = |name: &str| tables.find(name).is_some_and(|(own, _)| own.kind == ValueKind::Real);
    for (file, text, class) in texts_of(workshop) {
        for own in hyd_compiler::commands(text, &class) {
            // Of a component's variable the text does not say what it is.
            if own.name.contains('.') && !is_number(&own.name) {
                continue;
            }
            let site = place(own, (workshop, file, text), found);
            found.extend(site);
        }
        for own in read_inputs(text, &class, &workshop.driven).into_iter().filter(|own| is_number(&own.name)) {
            let site = of_input(own, (workshop, file, text), found);
            found.extend(site);
        }
    }
    for site in sites.iter().filter(|site| site.refused.is_none() && site.count == 1 && !site.path.is_empty()) {
        let own = course(&site.text).and_then(|own| of_component(site, own, (tables, workshop), found));
        found.extend(own);
    }
}

/// The place that an equation of a component is.
fn of_component(
    site: &InjectionSite,
    Course { name, expression, names }: Course,
    (tables, workshop): (&Tables, &Workshop<'_>),
    known: &[Site],
) -> Option<Site> {
    let text = workshop.own_text(&site.file).or_else(|| workshop.library_text(&site.file))?;
    let full = |name: &str| format!("{}.{name}", site.path);
    // A name that is not a variable is that of a constant.
    let is_fixed =
        |&(from, to): &(usize, usize)| tables.find(&full(&expression[from..to])).is_none_or(|(own, _)| is_settled(own));
    let is_number = tables.find(&full(&name)).is_some_and(|(own, _)| own.kind == ValueKind::Real);
    if site.path.contains('[') || !is_number || !names.iter().all(is_fixed) {
        return None;
    }
    let opening = replacing((&site.file, site.line, &site.text), &name, (workshop, text), known)?;
    Some(Site {
        id: COMMAND.into(),
        words: Arc::from(format!("command: {} = {expression}", full(&name))),
        path: full(&name),
        channel: None,
        file: workshop.shown_file(&site.file).into(),
        line: site.line,
        scales: vec![("u".into(), full(&name))],
        array: None,
        door: Door::Command {
            variable: full(&opening.name),
            expression: full(&opening.source()),
            opening: Some(opening),
        },
    })
}

/// True of what changes at events only, or is known before the run (`Real T_width = period*width/100` of parameters).
fn is_settled(own: &VariableInfo) -> bool {
    own.variability <= Variability::Discrete || own.sources.iter().all(|own| !matches!(own.place, Place::Output(_)))
}

/// The user's own texts in which the model's class may stand: file, text, and its name there.
fn texts_of<'w>(workshop: &'w Workshop<'_>) -> Vec<(&'w str, &'w str, String)> {
    let parts: Vec<&str> = hyd_compiler::dotted(&workshop.class).collect();
    let mut found = vec![(workshop.name(), workshop.preamble.as_str(), workshop.class.clone())];
    let others = workshop.own_texts().filter(|(file, _)| *file != workshop.name());
    for (file, text) in others {
        let within = hyd_compiler::head(text).within;
        let is_around = within.len() < parts.len() && within.iter().zip(&parts).all(|(own, part)| own == part);
        if is_around {
            found.push((file, text, parts[within.len()..].join(".")));
        }
    }
    found
}

/// The place that a course in time is.
fn place(command: Command, (workshop, file, text): (&Workshop<'_>, &str, &str), known: &[Site]) -> Option<Site> {
    let Command { name, expression, line, equation, .. } = command;
    let opening = match equation {
        None => None,
        Some(equation) => Some(replacing((&file.into(), line, &equation), &name, (workshop, text), known)?),
    };
    let (variable, given) = match &opening {
        None => (name.clone(), expression.clone()),
        Some(opening) => (opening.name.clone(), opening.source()),
    };
    Some(Site {
        id: COMMAND.into(),
        words: Arc::from(format!("command: {name} = {expression}")),
        path: name.clone(),
        channel: None,
        file: workshop.shown_file(file).into(),
        line,
        scales: vec![("u".into(), name)],
        array: None,
        door: Door::Command { variable, expression: given, opening },
    })
}

/// The place that a recorded input is where balances read it: something stands in for it.
fn of_input(
    ReadInput { name, line }: ReadInput,
    (workshop, file, text): (&Workshop<'_>, &str, &str),
    known: &[Site],
) -> Option<Site> {
    let opening = opening((&file.into(), line, &name), (&name, Act::StandsIn), (workshop, text), known)?;
    // What asks for the past of an input (`change(u)`) may not do so of a variable.
    if file == workshop.name() {
        let preamble = opened(text, std::slice::from_ref(&opening))?;
        Workshop { preamble, ..workshop.clone() }.translate(&[]).ok()?;
    }
    Some(Site {
        id: COMMAND.into(),
        words: Arc::from(format!("command: {name}")),
        path: name.clone(),
        channel: None,
        file: workshop.shown_file(file).into(),
        line,
        scales: vec![("u".into(), name.clone())],
        array: None,
        door: Door::Command { variable: opening.name.clone(), expression: name, opening: Some(opening) },
    })
}

/// What takes the place of the right side of an equation (file, line, text); none where the equation cannot be opened.
fn replacing(
    equation: (&Arc<str>, u32, &str),
    name: &str,
    sources: (&Workshop<'_>, &str),
    known: &[Site],
) -> Option<Opening> {
    opening(equation, (name, Act::Replaces), sources, known)
}

/// A variable for what another one is given.
fn opening(
    (file, line, equation): (&Arc<str>, u32, &str),
    (name, act): (&str, Act),
    (workshop, text): (&Workshop<'_>, &str),
    known: &[Site],
) -> Option<Opening> {
    let opening = Opening {
        file: file.clone(),
        line,
        equation: equation.to_string(),
        name: format!("given_{}", name.replace('.', "_")),
        words: format!("what {name} is given"),
        factor: String::new(),
        act,
        elements: None,
    };
    let opening = shared(opening, (workshop, text), known)?;
    opened(text, std::slice::from_ref(&opening))?;
    Some(opening)
}
