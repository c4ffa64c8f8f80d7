//! The whole page: the tree of classes on the left, a section per class on the right.
//!
//! Pictures of examples are made by the caller.  Each stands in the page once, in the section of its example; the classes that the
//! example uses refer to it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use crate::html::escape;
use crate::library::{Library, Source, annotated, text_of};
use crate::sections::{Sections, kind};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
/// Pictures of examples that a class shows.
const MOST_PICTURES: usize = 2;

/// A model that can be run to show what its components do.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Example {
    /// Full name of the class.
    pub class: String,
    /// Variables to draw, as `annotation(__hyd(plot = {"a.b", "c"}))` lists them; empty if it does not.
    pub plot: Vec<String>,
}

/// A page in the making.
#[derive(Debug, Default)]
pub struct Page {
    /// Heading.
    pub title: String,
    /// SVG texts of examples, by the full name of the class.
    pub pictures: BTreeMap<String, String>,
}

impl Library {
    /// The models of the shown texts that say how they are run (`experiment`), in the order of the texts.
    pub fn examples(&self) -> Vec<Example> {
        let runs = |k: &usize| {
            let class = &self.entries[*k].class;
            let annotation = class.annotation.as_ref();
            !class.partial && annotated(annotation, &["experiment", "StopTime"]).is_some()
        };
        let example = |k: usize| {
            let listed = annotated(self.entries[k].class.annotation.as_ref(), &["__hyd", "plot"]);
            let plot = match listed.map(|expr| &expr.kind) {
                Some(hyd_syntax::tree::ExprKind::Array(values)) => {
                    values.iter().filter_map(|value| text_of(value).map(str::to_string)).collect()
                }
                _ => Vec::new(),
            };
            Example { class: self.entries[k].name.clone(), plot }
        };
        self.shown().filter(runs).map(example).collect()
    }

    /// The text that holds a class.
    pub fn source_of(&self, class: &str) -> Option<&Source> {
        let entry = &self.entries[*self.by_name.get(class)?];
        self.sources.get(entry.source)
    }

    /// Number of classes that the page shows.
    pub fn count(&self) -> usize {
        self.shown().count()
    }
}

impl Page {
    /// The page as HTML.
    pub fn html(&self, library: &Library) -> String {
        let uses = library.uses();
        let mut used_by = vec![BTreeSet::new(); library.entries.len()];
        for user in library.shown() {
            uses[user].iter().for_each(|used| {
                used_by[*used].insert(user);
            });
        }
        let sections = Sections { library, used_by, pictures: self.shown_pictures(library, &uses), page: self };
        let roots = library.shown().filter(|k| {
            let parent = library.entries[*k].parent.map(|parent| library.entries[parent].source);
            !parent.is_some_and(|source| library.sources[source].shown)
        });
        let roots: Vec<usize> = roots.collect();
        let tree: String = roots.iter().map(|root| node(library, *root)).collect();
        let mut order = Vec::new();
        roots.iter().for_each(|root| in_order(library, *root, &mut order));
        let all: String = order.into_iter().map(|class| sections.section(class)).collect();
        let title = escape(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>{title}</title>\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\
             <meta name=\"color-scheme\" content=\"light dark\"/><style>{STYLE}</style></head><body>\n\
             <nav><h1>{title}</h1><input id=\"find\" type=\"search\" placeholder=\"find a class\" aria-label=\"find a class\"/>\
             <ul id=\"tree\">{tree}</ul></nav>\n<main>{all}</main>\n<script>{SCRIPT}</script></body></html>\n"
        )
    }

    /// For each class the examples whose picture it shows: its own, or the first that use it, directly before through
    /// other classes.
    fn shown_pictures(&self, library: &Library, uses: &[BTreeSet<usize>]) -> Vec<Vec<usize>> {
        let mut shown = vec![Vec::new(); library.entries.len()];
        let examples: Vec<usize> =
            library.shown().filter(|k| self.pictures.contains_key(&library.entries[*k].name)).collect();
        for &example in &examples {
            shown[example] = vec![example];
        }
        let mut give = |class: usize, example: usize| {
            if !examples.contains(&class) && shown[class].len() < MOST_PICTURES && !shown[class].contains(&example) {
                shown[class].push(example);
            }
        };
        for &example in &examples {
            uses[example].iter().for_each(|class| give(*class, example));
        }
        for &example in &examples {
            for &class in &uses[example] {
                uses[class].iter().for_each(|inner| give(*inner, example));
            }
        }
        shown
    }

    /// The picture of an example: itself, or a reference to it.
    pub(crate) fn picture(&self, class: &str, here: bool) -> String {
        let Some(svg) = self.pictures.get(class) else { return String::new() };
        let svg = svg
            .trim_start()
            .strip_prefix("<?xml")
            .and_then(|rest| rest.split_once("?>"))
            .map_or(&**svg, |(_, rest)| rest);
        let id = format!("picture-{}", escape(class));
        if here {
            return svg.trim_start().replacen("<svg ", &format!("<svg id=\"{id}\" "), 1);
        }
        let size = |name: &str| {
            let after = svg.split_once(&format!(" {name}=\"")).map_or("", |(_, rest)| rest);
            after.split('"').next().and_then(|number| number.parse::<f64>().ok()).unwrap_or(600.0)
        };
        let (width, height) = (size("width"), size("height"));
        format!(
            "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"><use href=\"#{id}\"/></svg>"
        )
    }
}

/// A class and all in it, in the order of the tree.
fn in_order(library: &Library, class: usize, order: &mut Vec<usize>) {
    order.push(class);
    library.within(class).into_iter().for_each(|child| in_order(library, child, order));
}

/// A class in the tree, with those in it.
fn node(library: &Library, class: usize) -> String {
    let entry = &library.entries[class];
    let link = format!(
        "<a href=\"#{0}\" data-name=\"{1}\" title=\"{2}\">{3}</a>",
        escape(&entry.name),
        // Words of the description find it, too.
        escape(&format!("{} {}", entry.name, entry.class.description.as_deref().unwrap_or_default()).to_lowercase()),
        kind(library, class),
        escape(&entry.class.name.name)
    );
    let children = library.within(class);
    let mut out = String::new();
    if children.is_empty() {
        let _ = write!(out, "<li>{link}</li>");
    } else {
        let inner: String = children.iter().map(|child| node(library, *child)).collect();
        // What opens and what leads somewhere are two things, for keys and screen readers as well.
        let name = escape(&entry.class.name.name);
        let open = if entry.name.matches('.').count() < 1 { " open=\"\"" } else { "" };
        let _ = write!(
            out,
            "<li>{link}<details{open}><summary aria-label=\"classes in {name}\"></summary><ul>{inner}</ul></details></li>"
        );
    }
    out
}
