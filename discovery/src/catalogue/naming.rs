//! Names at places that were found in texts: those of a component's equation as the model knows them, and new ones.

use hyd_compiler::Opening;
use hyd_system::Tables;

use crate::catalogue::Site;
use crate::variant::Workshop;

/// An opening with a name that is free, or the one of a known place that opens the same equation: the components of one class share what is opened in it.
pub(super) fn shared(opening: Opening, (workshop, text): (&Workshop<'_>, &str), known: &[Site]) -> Option<Opening> {
    let is_same = |own: &&Opening| Opening { name: opening.name.clone(), ..(*own).clone() } == opening;
    if let Some(own) = known.iter().flat_map(|site| site.door.openings()).find(is_same) {
        return Some(own.clone());
    }
    let name = free(&opening.name, (workshop, text), known)?;
    Some(Opening { name, ..opening })
}

/// A name that stands nowhere in the text, in the model's file and its package and that no other place has.
fn free(wanted: &str, (workshop, text): (&Workshop<'_>, &str), known: &[Site]) -> Option<String> {
    let taken = |name: &str| {
        text.contains(name)
            || workshop.preamble.contains(name)
            || workshop.own_texts().any(|(_, text)| text.contains(name))
            || known.iter().flat_map(|site| site.door.openings()).any(|opening| opening.name == name)
    };
    let numbered = (2_u32..).map(|k| format!("{wanted}_{k}"));
    std::iter::once(wanted.to_string()).chain(numbered).find(|name| !taken(name))
}

/// A term of a component's equation as it is asked for from outside, with the names of the model; none if it has no meaning there.
pub(super) fn outside(
    term: &str,
    names: &[(usize, usize)],
    full: &dyn Fn(&str) -> String,
    (tables, workshop): (&Tables, &Workshop<'_>),
) -> Option<String> {
    let mut names = names.to_vec();
    names.sort_unstable();
    let of_variables = |name: &str| Some(full(name)).filter(|own| tables.find(own).is_some());
    // What no component has as a variable is a constant: of the component, by a name that means something everywhere, or of a package around the model.
    let with = |constant: &dyn Fn(&str) -> String| {
        let mut text = term.to_string();
        for &(from, to) in names.iter().rev() {
            let name = &term[from..to];
            text.replace_range(from..to, &of_variables(name).unwrap_or_else(|| constant(name)));
        }
        text
    };
    if !term.replace("der(", "").contains('(')
        && names.iter().all(|&(from, to)| of_variables(&term[from..to]).is_some())
    {
        return Some(with(&|name| name.into()));
    }
    let mut ways = vec![with(full), with(&|name| name.into())];
    let parts: Vec<&str> = hyd_compiler::dotted(&workshop.class).collect();
    let packages = (1..parts.len()).rev().map(|count| parts[..count].join("."));
    ways.extend(packages.map(|package| with(&|name| format!("{package}.{name}"))));
    ways.into_iter().find(|text| Workshop { channels: vec![text.clone()], ..workshop.clone() }.translate(&[]).is_ok())
}
