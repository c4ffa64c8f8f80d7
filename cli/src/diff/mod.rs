//! `hyd diff A B`: what changed in the models of two texts, whatever changed in their layout, comments, order and graphics.
//!
//! Called by git as an external difference (`git config diff.hyd.command "hyd diff"`) it gets seven arguments, nine for a file that was renamed, and always
//! ends well.

mod facts;
mod page;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use self::facts::{Facts, Kind, compared, facts};
use crate::arguments::Diff;
use crate::{Failure, output};
use hyd_results::write_whole;
use hyd_run::{check_target, read_text};

/// What stands for a file that is not there, in calls by git.
const NOTHING: &str = "/dev/null";

/// Something that changed.
struct Change {
    class: String,
    kind: Kind,
    name: String,
    /// What was said, and what is said now; none where it is new or gone.
    before: Option<String>,
    after: Option<String>,
}

/// Runs the verb.
pub(crate) fn diff(arguments: &Diff) -> Result<(), Failure> {
    let (shown, first, second, by_git) = match &arguments.paths[..] {
        [first, second] => (None, first.clone(), second.clone(), false),
        // path old-file old-hex old-mode new-file new-hex new-mode
        [path, first, _, _, second, _, _] => (Some(path.clone()), first.clone(), second.clone(), true),
        // The same, then the new path and what git says of the renaming.
        [_, first, _, _, second, _, _, path, _] => (Some(path.clone()), first.clone(), second.clone(), true),
        _ => return Err(Failure::Usage("two files are compared: hyd diff A B".to_string())),
    };
    if let Some(path) = &arguments.html {
        check_target("--html", path, &[&first, &second])?;
    }
    let (before, mut after) = match (models(&first), models(&second)) {
        (Ok(before), Ok(after)) => (before, after),
        // Git would end there and show no other file.
        (Err(Failure::Fault(why)), _) | (_, Err(Failure::Fault(why))) if by_git => {
            let path = shown.as_ref().unwrap_or(&second).display();
            return output::print(&format!("{path}\n  not compared: {why}\n"));
        }
        (Err(failure), _) | (_, Err(failure)) => return Err(failure),
    };
    let renamed = renamed(&before, &mut after);
    let changes: Vec<Change> = renamed.into_iter().chain(changes(&before, &after)).collect();
    if let Some(path) = &arguments.html {
        let names = [&first, &second].map(|own| shown.as_ref().unwrap_or(own).display().to_string());
        let page = page::page(&changes, [&names[0], &names[1]]);
        let failed = |error: std::io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
        write_whole(path, page.as_bytes()).map_err(failed)?;
    }
    if arguments.json {
        let list: Vec<Value> = changes.iter().map(Change::json).collect();
        output::print(&format!(
            "{:#}\n",
            json!({"status": if list.is_empty() { "equal" } else { "different" }, "changes": list})
        ))?;
    } else {
        let title = shown.map(|path| format!("{}\n", path.display())).filter(|_| !changes.is_empty());
        output::print(&(title.unwrap_or_default() + &text(&changes)))?;
    }
    if changes.is_empty() || by_git { Ok(()) } else { Err(Failure::Reported) }
}

/// The facts of a file, or of all files of a folder.
fn models(path: &Path) -> Result<BTreeMap<String, Facts>, Failure> {
    if path.as_os_str() == NOTHING {
        return Ok(BTreeMap::new());
    }
    let mut files = BTreeSet::new();
    if path.is_dir() {
        collect(path, &mut files)?;
    } else {
        files.insert(path.to_path_buf());
    }
    let mut found = BTreeMap::new();
    for file in files {
        let text = read_text(&file).map_err(|error| Failure::Fault(error.to_string()))?;
        let own = facts(&text).map_err(|(line, sentence)| {
            Failure::Fault(format!(
                "`{}`, line {line}: {sentence}; only texts without syntax errors are compared",
                file.display()
            ))
        })?;
        found.extend(own);
    }
    Ok(found)
}

fn collect(folder: &Path, files: &mut BTreeSet<PathBuf>) -> Result<(), Failure> {
    let wrong =
        |error: std::io::Error| Failure::Fault(format!("the folder `{}` cannot be read: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let entry = entry.map_err(wrong)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(wrong)?);
        if kind.is_dir() && !entry.file_name().to_string_lossy().starts_with('.') {
            collect(&path, files)?;
        } else if path.extension().is_some_and(|ending| ending == "hyd" || ending == "mo") {
            files.insert(path);
        }
    }
    Ok(())
}

/// Two texts of one class each, of different names, are one class that got another name: the second is then known by the name of the first.
fn renamed(before: &BTreeMap<String, Facts>, after: &mut BTreeMap<String, Facts>) -> Option<Change> {
    let only = |facts: &BTreeMap<String, Facts>| {
        let first = facts.keys().next()?.clone();
        let inner = format!("{first}.");
        facts.keys().skip(1).all(|name| name.starts_with(&inner)).then_some(first)
    };
    let (old, new) = (only(before)?, only(after)?);
    if old == new {
        return None;
    }
    *after = std::mem::take(after)
        .into_iter()
        .map(|(name, facts)| (format!("{old}{}", &name[new.len()..]), facts))
        .collect();
    Some(Change {
        class: old.clone(),
        kind: Kind::Class,
        name: "name".to_string(),
        before: Some(old),
        after: Some(new),
    })
}

/// What changed, class by class.
fn changes(before: &BTreeMap<String, Facts>, after: &BTreeMap<String, Facts>) -> Vec<Change> {
    let classes: BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let mut found = Vec::new();
    for class in classes {
        let change = |kind: Kind, name: &str, before: Option<String>, after: Option<String>| Change {
            class: class.clone(),
            kind,
            name: name.to_string(),
            before,
            after,
        };
        match (before.get(class), after.get(class)) {
            (Some(before), Some(after)) => {
                let keys: BTreeSet<&(Kind, String)> = before.keys().chain(after.keys()).collect();
                for key in keys {
                    let says = |facts: &Facts| -> Vec<(String, String)> {
                        let list = facts.get(key).into_iter().flatten();
                        list.map(|own| (own.clone(), compared(own))).collect()
                    };
                    let (mut gone, mut new) = (says(before), says(after));
                    // What is said on both sides, as often as it is.
                    gone.retain(|own| match new.iter().position(|other| other.1 == own.1) {
                        Some(place) => {
                            new.remove(place);
                            false
                        }
                        None => true,
                    });
                    let written =
                        |list: Vec<(String, String)>| -> Vec<String> { list.into_iter().map(|own| own.0).collect() };
                    let (gone, new) = (written(gone), written(new));
                    let (kind, name) = key;
                    if let ([before], [after]) = (&gone[..], &new[..])
                        && !name.is_empty()
                    {
                        found.push(change(*kind, name, Some(before.clone()), Some(after.clone())));
                        continue;
                    }
                    found.extend(gone.into_iter().map(|own| change(*kind, name, Some(own), None)));
                    found.extend(new.into_iter().map(|own| change(*kind, name, None, Some(own))));
                }
            }
            (Some(before), None) => found.push(change(Kind::Class, "", head(before), None)),
            (None, Some(after)) => {
                found.push(change(Kind::Class, "", None, head(after)));
                // Of a class that is new all is new; one that is gone takes with it what it said.
                let says = after.iter().filter(|((kind, name), _)| *kind != Kind::Class || !name.is_empty());
                let own = says.flat_map(|((kind, name), list)| list.iter().map(move |own| (*kind, name, own)));
                found.extend(own.map(|(kind, name, own)| change(kind, name, None, Some(own.clone()))));
            }
            (None, None) => {}
        }
    }
    found
}

/// The kind of a class.
fn head(facts: &Facts) -> Option<String> {
    facts.get(&(Kind::Class, String::new())).and_then(|list| list.first().cloned())
}

impl Change {
    fn json(&self) -> Value {
        let name = if self.name.is_empty() { Value::Null } else { json!(self.name) };
        json!({"class": self.class, "kind": self.kind.word(), "name": name, "before": self.before, "after": self.after})
    }

    /// A line of it for people.
    fn words(&self) -> String {
        let what = match self.kind {
            Kind::Value | Kind::Component => self.name.clone(),
            Kind::Class if !self.name.is_empty() => self.name.clone(),
            Kind::Class | Kind::Equation | Kind::Connection => String::new(),
            kind if self.name.is_empty() => kind.word().to_string(),
            kind => format!("{} {}", kind.word(), self.name),
        };
        let joined = |says: &str| match (what.is_empty(), self.kind) {
            (true, _) => says.to_string(),
            (false, Kind::Component) => format!("{says} {what}"),
            (false, Kind::Value) => format!("{what} = {says}"),
            (false, _) if says.is_empty() => what.clone(),
            (false, _) => format!("{what}: {says}"),
        };
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => format!("~ {what}: {before} -> {after}"),
            (Some(before), None) => format!("- {}", joined(before)),
            (None, Some(after)) => format!("+ {}", joined(after)),
            (None, None) => String::new(),
        }
    }
}

/// All changes for people.
fn text(changes: &[Change]) -> String {
    let mut text = String::new();
    let mut last = None;
    for change in changes {
        if last != Some(&change.class) {
            text.push_str(&format!("{}\n", change.class));
            last = Some(&change.class);
        }
        text.push_str(&format!("  {}\n", change.words()));
    }
    if changes.is_empty() { "the models are the same\n".to_string() } else { text }
}
