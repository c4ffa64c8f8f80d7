//! `documentation`: a class of the library, as its declaration and its words tell it.

use std::sync::Arc;

use hyd_compiler::{Sources, did_you_mean};
use hyd_doc::{Described, Inside, Item, Library, Source};
use hyd_verbs::library::{LibraryPath, built_in_order};
use serde_json::{Map, Value, json};

use super::Tool;
use crate::answer::Answer;
use crate::arguments::{Kind, optional};
use crate::calls::{Call, Workplace};

/// Names that are listed where a word is no name.
const MOST_FOUND: usize = 40;

pub(super) const TOOL: Tool = Tool {
    name: "documentation",
    title: "Look a class of the library up",
    says: "Tells what a class of the built-in library, or of the libraries of the server, is: description, documentation, bases, connectors, parameters with \
           units, defaults and limits, variables, and the classes within a package. A word that is no full name finds the classes whose name or \
           description has it; without a name the outermost packages are listed.",
    arguments: &[optional(
        "name",
        Kind::Text,
        "full name of a class, such as Hyd.Hydraulic, or a word to look for [default: the outermost packages]",
    )],
    is_reading: true,
    run: documentation,
};

fn documentation(call: &Call<'_>) -> Result<Answer, String> {
    let library = classes(call.workplace)?;
    let name = call.given.text("name").unwrap_or_default().trim().trim_start_matches('.');
    if name.is_empty() {
        let all = library.outermost();
        return Ok(Answer::done(list(&all), json!({"classes": all.iter().map(inside).collect::<Vec<_>>()})));
    }
    if let Some(class) = library.describe(name) {
        return Ok(Answer::done(text(&class), data(&class)));
    }
    let found = search(library, name);
    if found.is_empty() {
        let hint = did_you_mean(name, library.names()).or_else(|| {
            let last = name.rsplit('.').next().unwrap_or(name);
            let short = |full: &&str| full.rsplit('.').next().is_some_and(|own| own.eq_ignore_ascii_case(last));
            library.names().find(short).map(|full| format!("did you mean `{full}`?"))
        });
        let hint = hint.unwrap_or_else(|| "without a name the outermost packages are listed".to_string());
        return Err(format!(
            "`name`: no class is called `{name}`, and none has this word in its name or description; {hint}"
        ));
    }
    let shown = &found[..found.len().min(MOST_FOUND)];
    let mut said = format!("no class is called `{name}`; these have it in their name or description:\n{}", list(shown));
    if found.len() > shown.len() {
        said.push_str(&format!("  and {} more\n", found.len() - shown.len()));
    }
    let classes: Vec<Value> = shown.iter().map(inside).collect();
    Ok(Answer::done(said, json!({"found": classes, "found_in_all": found.len()})))
}

/// The classes that have a word in their name or description.
fn search(library: &Library, word: &str) -> Vec<Inside> {
    let word = word.to_lowercase();
    let mut found = Vec::new();
    let mut open = library.outermost();
    open.reverse();
    while let Some(class) = open.pop() {
        let mut inner = library.describe(&class.name).map(|own| own.classes).unwrap_or_default();
        inner.reverse();
        open.extend(inner);
        let last = class.name.rsplit('.').next().unwrap_or_default().to_lowercase();
        if last.contains(&word) || class.description.to_lowercase().contains(&word) {
            found.push(class);
        }
    }
    found
}

/// All classes of the libraries; their texts are read once.
fn classes(workplace: &Workplace) -> Result<&Library, String> {
    if let Some(library) = workplace.classes.get() {
        return Ok(library);
    }
    let mut path = LibraryPath::new();
    for folder in &workplace.libraries.folders {
        path.add_folder(folder)?;
    }
    let mut sources = Vec::new();
    let mut names = path.class_names();
    // A package comes before what is in it.
    names.sort();
    names.dedup();
    for name in names {
        let parts: Vec<Arc<str>> = name.split('.').map(Arc::from).collect();
        // A text that cannot be read has no classes.
        let Ok(Some(found)) = path.find(&parts) else { continue };
        let order = found.name.strip_prefix("<built-in>/").map(built_in_order).unwrap_or_default();
        let order = order.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_string).collect();
        sources.push(Source { name: found.name.to_string(), text: found.text.to_string(), shown: true, order });
    }
    Ok(workplace.classes.get_or_init(|| Library::new(sources)))
}

fn data(class: &Described) -> Value {
    let mut data = json!({"name": class.name, "kind": class.kind, "description": class.description});
    let Value::Object(fields) = &mut data else { return data };
    let mut add = |name: &str, value: Value, is_there: bool| {
        if is_there {
            fields.insert(name.to_string(), value);
        }
    };
    add("documentation", plain(&class.info).into(), !class.info.is_empty());
    add("extends", json!(class.bases), !class.bases.is_empty());
    add("unit", json!(class.unit), !class.unit.is_empty());
    let literals = class.literals.iter().map(|(name, description)| json!({"name": name, "description": description}));
    add("literals", literals.collect(), !class.literals.is_empty());
    for (title, items) in &class.groups {
        add(title, items.iter().map(item).collect(), true);
    }
    add("classes", class.classes.iter().map(inside).collect(), !class.classes.is_empty());
    data
}

fn item(item: &Item) -> Value {
    let texts = [
        ("name", &item.name),
        ("type", &item.class),
        ("description", &item.description),
        ("unit", &item.unit),
        ("default", &item.value),
        ("min", &item.min),
        ("max", &item.max),
    ];
    let mut fields = Map::new();
    for (name, text) in texts.into_iter().filter(|(_, text)| !text.is_empty()) {
        fields.insert(name.to_string(), json!(text));
    }
    if item.is_flow {
        fields.insert("flow".to_string(), true.into());
    }
    fields.into()
}

fn inside(class: &Inside) -> Value {
    json!({"name": class.name, "kind": class.kind, "description": class.description})
}

fn list(classes: &[Inside]) -> String {
    classes.iter().map(|own| line(&format!("  {} {}", own.kind, own.name), &own.description)).collect()
}

/// Something and its description.
fn line(what: &str, description: &str) -> String {
    if description.is_empty() { format!("{what}\n") } else { format!("{what}: {description}\n") }
}

fn text(class: &Described) -> String {
    let mut text = line(&format!("{} {}", class.kind, class.name), &class.description);
    if !class.bases.is_empty() {
        text.push_str(&format!("extends {}\n", class.bases.join(", ")));
    }
    if !class.unit.is_empty() {
        text.push_str(&format!("unit {}\n", class.unit));
    }
    if !class.info.is_empty() {
        text.push_str(&format!("\n{}\n", plain(&class.info)));
    }
    for (title, items) in &class.groups {
        text.push_str(&format!("\n{title}\n"));
        for item in items {
            let mut what = format!("  {} {}", item.class, item.name);
            for (word, value) in
                [(" = ", &item.value), (" in ", &item.unit), (", min ", &item.min), (", max ", &item.max)]
            {
                if !value.is_empty() {
                    what.push_str(&format!("{word}{value}"));
                }
            }
            text.push_str(&line(&what, &item.description));
        }
    }
    if !class.literals.is_empty() {
        text.push_str("\nliterals\n");
        class.literals.iter().for_each(|(name, says)| text.push_str(&line(&format!("  {name}"), says)));
    }
    if !class.classes.is_empty() {
        text.push_str(&format!("\nclasses\n{}", list(&class.classes)));
    }
    text
}

/// A text without its markup.
fn plain(info: &str) -> String {
    let mut text = String::new();
    let mut rest = info;
    while let Some(at) = rest.find('<') {
        text.push_str(&rest[..at]);
        let is_tag = rest[at + 1..].starts_with(|c: char| c.is_ascii_alphabetic() || c == '/' || c == '!');
        match rest[at..].find('>').filter(|_| is_tag) {
            Some(end) => rest = &rest[at + end + 1..],
            None => {
                text.push('<');
                rest = &rest[at + 1..];
            }
        }
    }
    text.push_str(rest);
    for (written, meant) in [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&nbsp;", " "), ("&amp;", "&")] {
        text = text.replace(written, meant);
    }
    let lines: Vec<String> = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    let mut out = String::new();
    for line in lines {
        // One empty line stays where there were some.
        if !line.is_empty() || !out.is_empty() && !out.ends_with("\n\n") {
            out.push_str(&line);
            out.push('\n');
        }
    }
    out.trim_end().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_goes_and_text_stays() {
        assert_eq!(plain("<html>\n<p>a &lt; b</p>\n\n\n<p class=\"x\">c  d</p></html>"), "a < b\n\nc d");
        assert_eq!(plain("x < 3 and y<z"), "x < 3 and y<z");
    }
}
