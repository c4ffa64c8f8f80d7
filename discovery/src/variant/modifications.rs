//! Modifications of the components of a model, as a tree by name and as text.
//!
//! Several parts of what is put into a model modify one component: an effect redeclares it, a fitted number changes a parameter in it.  In a text
//! each name stands once.

use std::collections::BTreeMap;

/// Modifications of the components of a model, by name.
#[derive(Default)]
pub(crate) struct Modifications {
    inside: BTreeMap<String, Modifications>,
    /// What stands in the place of the name alone, and modifications behind it.
    leaf: Option<(String, Vec<String>)>,
}

impl Modifications {
    /// Puts `leaf` in the place of the name at a path, with modifications behind it.
    pub(crate) fn insert(&mut self, path: &str, leaf: String, stated: Vec<String>) {
        let (first, rest) = first_name(path);
        let own = self.inside.entry(first.to_string()).or_default();
        match rest {
            None => own.leaf = Some((leaf, stated)),
            Some(rest) => own.insert(rest, leaf, stated),
        }
    }

    /// All of it, as it stands between brackets.
    pub(crate) fn print(&self) -> String {
        let parts = self.inside.iter().map(|(name, own)| {
            let (head, mut list) = own.leaf.clone().unwrap_or_else(|| (name.clone(), Vec::new()));
            if !own.inside.is_empty() {
                list.push(own.print());
            }
            if list.is_empty() { head } else { format!("{head}({})", list.join(", ")) }
        });
        parts.collect::<Vec<_>>().join(",\n    ")
    }
}

/// The first name of a path and what follows its dot; dots within quotes are part of a name.
fn first_name(path: &str) -> (&str, Option<&str>) {
    let (mut is_quoted, mut is_escaped) = (false, false);
    for (at, c) in path.char_indices() {
        match c {
            _ if is_escaped => is_escaped = false,
            '\\' if is_quoted => is_escaped = true,
            '\'' => is_quoted = !is_quoted,
            '.' if !is_quoted => return (&path[..at], Some(&path[at + 1..])),
            _ => {}
        }
    }
    (path, None)
}

/// The last name of a path.
pub(crate) fn last_name(path: &str) -> &str {
    match first_name(path) {
        (name, None) => name,
        (_, Some(rest)) => last_name(rest),
    }
}
