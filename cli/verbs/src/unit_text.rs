//! A unit of another tool as a block of a model: the text that declares what it is given, what it computes, and its parameters.
//!
//! Names are those of the unit: `spring.k` is `k` in a component `spring`, so that modifications and results look as if the unit were a text.
//! A name that is none in Modelica (`x[2].a`, `1st`) is written in quotes.  Each declaration says which variable of the unit it is, and the
//! class where the unit lies; nothing else of the text is known to the tool, so users may leave out and rename.

use std::collections::BTreeSet;
use std::fmt::Write;

use hyd_compiler::print_string;
use hyd_fmi_import::{Causality, Changes, Description, Kind, Number, Variable};

/// Stands for the name in a declaration until its place is known; no text of a description has such a sign.
const NAME: char = '\0';

/// What a text of a unit is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Purpose {
    /// A block among other components.
    Block,
    /// The model of a study: what the unit is given is a variable of its own, which effects can come between.
    Bench,
    /// A model to look at: what the unit is given is a parameter, from its start value.
    View,
}

/// A text, and what could not be written.
#[derive(Clone, Debug)]
pub struct UnitText {
    /// The text.
    pub text: String,
    /// Name of the class.
    pub class: String,
    /// Parameters that move with the trigger of a study: what the unit is given, and what that is by itself.
    pub moved: Vec<(String, String)>,
    /// Sentences on what is left out.
    pub notes: Vec<String>,
}

/// A declaration, or a component with declarations in it.
enum Node {
    Leaf(String),
    Inner(Vec<(String, Node)>),
}

/// Writes the text.  `file`: where the unit lies, seen from the text; `read`: variables that are read of it beside its outputs (for a bench: in
/// place of them); `late`: parameters of a bench that move with the trigger.
pub fn unit_text(
    description: &Description,
    file: &str,
    purpose: Purpose,
    (read, late): (&[String], &[String]),
) -> UnitText {
    let mut moved = Vec::new();
    let mut tree: Vec<(String, Node)> = Vec::new();
    let mut notes = Vec::new();
    let mut left_out: Vec<&str> = Vec::new();
    for variable in &description.variables {
        if description.is_start_free(variable) && is_real(variable) {
            let mut path = path(&variable.name);
            if let Some(last) = path.last_mut() {
                *last = identifier(&format!("{}_start", last.trim_matches('\'')));
            }
            // Where the name is taken, the unit keeps its own start.
            insert(&mut tree, &path, &start_value(variable));
        }
        let named = read.iter().any(|name| *name == *variable.name);
        let declaration = match variable.causality {
            Causality::Parameter => parameter(variable),
            Causality::Input if is_real(variable) => Some(declared("input Real", variable, &starts(variable))),
            // What a model hands over during a run are continuous numbers; the rest is set before.
            Causality::Input => parameter(variable),
            Causality::Output if is_real(variable) && (named || purpose == Purpose::Block) => {
                Some(declared("output Real", variable, &[]))
            }
            Causality::Local | Causality::Output if is_real(variable) && named => Some(declared("Real", variable, &[])),
            Causality::Output if purpose == Purpose::Bench => continue,
            Causality::Local if !named => continue,
            Causality::Structural | Causality::Calculated | Causality::Independent => continue,
            _ => None,
        };
        let Some(declaration) = declaration else {
            left_out.push(&variable.name);
            continue;
        };
        let is_input = variable.causality == Causality::Input && is_real(variable);
        if is_input && purpose == Purpose::View {
            let name = identifier(&variable.name);
            let value = variable.start.first().copied().filter(|value| value.is_finite()).unwrap_or(0.0);
            let held = format!("parameter Real {NAME}{} = {value:e}{};", attributes(variable, &[]), words(variable));
            if variable.sizes.is_empty() && insert(&mut tree, std::slice::from_ref(&name), &held) {
                let given = free(&identifier(&format!("{}_given", variable.name)), &tree);
                let of_unit = format!("Real {given}{} = {name} {}", attributes(variable, &[]), marked(variable));
                tree.push((given, Node::Leaf(of_unit)));
            } else {
                left_out.push(&variable.name);
            }
            continue;
        }
        if is_input && purpose == Purpose::Bench {
            // The input of the model is free of the unit; what the unit is given follows it until an effect comes between.
            insert(&mut tree, &[identifier(&variable.name)], &format!("{declaration};"));
            let name = identifier(&format!("{}_given", variable.name));
            let words = print_string(&format!("what the unit is given for {}", variable.name));
            let given = format!(
                "Real {name}{}{} = {} {words} {}",
                sizes(variable),
                attributes(variable, &[]),
                identifier(&variable.name),
                marked(variable)
            );
            tree.push((name, Node::Leaf(given)));
            continue;
        }
        if late.iter().any(|name| *name == *variable.name) && is_plain(&variable.name) && variable.sizes.is_empty() {
            insert(&mut tree, &[variable.name.to_string()], &format!("{declaration};"));
            let given = format!("{}_given", variable.name);
            let words = print_string(&format!("what the unit is given for {}", variable.name));
            let value = format!("parameter Real {given} = {} {words} {}", variable.name, marked(variable));
            tree.push((given.clone(), Node::Leaf(value)));
            moved.push((given, variable.name.to_string()));
            continue;
        }
        let whole = format!("{declaration} {}", marked(variable));
        if !insert(&mut tree, &path(&variable.name), &whole) {
            insert(&mut tree, &[quoted(&variable.name)], &whole);
        }
    }
    if !left_out.is_empty() {
        let names: Vec<String> = left_out.iter().take(6).map(|name| format!("`{name}`")).collect();
        let more = if left_out.len() > names.len() { ", ..." } else { "" };
        notes.push(format!(
            "left out of the block, because they are not continuous real numbers, or parameters without a start value: {}{more}",
            names.join(", ")
        ));
    }
    let class = match purpose {
        // Where the model stood within packages is nothing that a block among others needs.
        Purpose::Block => identifier(description.model.rsplit('.').next().unwrap_or(&description.model)),
        Purpose::Bench | Purpose::View => identifier(&description.model),
    };
    let kind = if purpose == Purpose::Block { "block" } else { "model" };
    let words = if description.description.is_empty() {
        format!("Unit of another tool in {file}")
    } else {
        description.description.clone()
    };
    let mut text = format!("{kind} {class} {}\n", print_string(&words));
    print(&tree, "", &connectors(description, read), &mut text);
    let _ = writeln!(text, "  annotation(__hyd(unit(file = {})){});", print_string(file), experiment(description));
    let _ = writeln!(text, "end {class};");
    UnitText { text, class, moved, notes }
}

fn is_real(variable: &Variable) -> bool {
    matches!(variable.kind, Kind::Number(Number::Float64 | Number::Float32)) && variable.changes == Changes::Continuous
}

/// The declaration of a parameter; none where it has no value, or values that no text can give.
fn parameter(variable: &Variable) -> Option<String> {
    if variable.changes == Changes::Constant || variable.start.len() != variable.count() || variable.start.is_empty() {
        return None;
    }
    let (class, literal): (&str, fn(f64) -> String) = match variable.kind {
        Kind::Number(Number::Float64 | Number::Float32) => ("Real", |value| format!("{value:e}")),
        Kind::Number(Number::Boolean) => ("Boolean", |value| (value != 0.0).to_string()),
        Kind::Number(_) | Kind::Enumeration(_) => ("Integer", |value| format!("{value:.0}")),
        Kind::Text | Kind::Binary | Kind::Clock => return None,
    };
    if variable.start.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let values: Vec<String> = variable.start.iter().map(|&value| literal(value)).collect();
    let attributes = if class == "Boolean" { String::new() } else { attributes(variable, &[]) };
    let value = nested(&variable.sizes, &values);
    Some(format!("parameter {class} {NAME}{}{attributes} = {value}{}", sizes(variable), words(variable)))
}

/// The parameter of a block that a state of the unit begins with.
fn start_value(variable: &Variable) -> String {
    let value = variable.start.first().copied().unwrap_or(0.0);
    let words = print_string(&format!("start value of {}", variable.name));
    format!("parameter Real {NAME}{} = {value:e} {words} {}", attributes(variable, &[]), marked(variable))
}

fn declared(prefix: &str, variable: &Variable, further: &[String]) -> String {
    format!("{prefix} {NAME}{}{}{}", sizes(variable), attributes(variable, further), words(variable))
}

/// The start value of an input, which it keeps where nothing else gives it one.
fn starts(variable: &Variable) -> Vec<String> {
    match variable.start.first() {
        Some(value) if variable.sizes.is_empty() && value.is_finite() => vec![format!("start = {value:e}")],
        _ => Vec::new(),
    }
}

fn attributes(variable: &Variable, further: &[String]) -> String {
    let mut list = Vec::new();
    // Values of a unit are in the unit that it names; only one that is a unit of SI means the same here.
    if !variable.unit.is_empty() && hyd_compiler::is_unit(&variable.unit) {
        list.push(format!("unit = {}", print_string(&variable.unit)));
    }
    let each = if variable.sizes.is_empty() { "" } else { "each " };
    let is_real = matches!(variable.kind, Kind::Number(Number::Float64 | Number::Float32));
    for (name, value) in [("min", variable.min), ("max", variable.max)] {
        if value.is_finite() {
            list.push(if is_real { format!("{name} = {value:e}") } else { format!("{name} = {value:.0}") });
        }
    }
    if let Some(nominal) = variable.nominal.filter(|_| is_real) {
        list.push(format!("nominal = {nominal:e}"));
    }
    list.extend(further.iter().cloned());
    if list.is_empty() { String::new() } else { format!("({each}{})", list.join(&format!(", {each}"))) }
}

fn words(variable: &Variable) -> String {
    if variable.description.is_empty() { String::new() } else { format!(" {}", print_string(&variable.description)) }
}

fn marked(variable: &Variable) -> String {
    format!("annotation(__hyd(variable = {}));", print_string(&variable.name))
}

fn sizes(variable: &Variable) -> String {
    let sizes: Vec<String> = variable.sizes.iter().map(u32::to_string).collect();
    if sizes.is_empty() { String::new() } else { format!("[{}]", sizes.join(", ")) }
}

/// Values as nested arrays, the last subscript fastest.
fn nested(sizes: &[u32], values: &[String]) -> String {
    let Some((&first, rest)) = sizes.split_first() else { return values.first().cloned().unwrap_or_default() };
    let each = values.len() / (first as usize).max(1);
    let parts: Vec<String> = values.chunks(each.max(1)).map(|part| nested(rest, part)).collect();
    format!("{{{}}}", parts.join(", "))
}

fn experiment(description: &Description) -> String {
    let own = description.experiment;
    let stated =
        [("StartTime", own.start), ("StopTime", own.stop), ("Tolerance", own.tolerance), ("Interval", own.step)];
    let list: Vec<String> =
        stated.iter().filter_map(|(name, value)| value.map(|value| format!("{name} = {value:e}"))).collect();
    if list.is_empty() { String::new() } else { format!(",\n    experiment({})", list.join(", ")) }
}

/// The components that a name leads through, the last one the variable itself.
fn path(name: &str) -> Vec<String> {
    let parts: Vec<&str> = name.split('.').collect();
    if parts.iter().all(|part| is_plain(part)) {
        parts.into_iter().map(str::to_string).collect()
    } else {
        vec![identifier(name)]
    }
}

/// The whole name of a variable of a unit as a text has it.
pub(crate) fn written_name(name: &str) -> String {
    path(name).join(".")
}

/// A name as Modelica takes it.
pub(crate) fn identifier(name: &str) -> String {
    if is_plain(name) { name.to_string() } else { quoted(name) }
}

fn quoted(name: &str) -> String {
    format!("'{}'", name.replace('\\', "\\\\").replace('\'', "\\'"))
}

fn is_plain(name: &str) -> bool {
    let mut letters = name.chars();
    let begins = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
    begins
        && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !hyd_compiler::is_keyword(name)
        && name != "time"
}

/// Puts a declaration at a path; false where another declaration stands in the way.
fn insert(tree: &mut Vec<(String, Node)>, path: &[String], declaration: &str) -> bool {
    let Some((first, rest)) = path.split_first() else { return false };
    let known = tree.iter_mut().find(|(name, _)| name == first);
    match (known, rest.is_empty()) {
        (None, true) => {
            tree.push((first.clone(), Node::Leaf(declaration.replace(NAME, first))));
            true
        }
        (None, false) => {
            let mut inner = Vec::new();
            let done = insert(&mut inner, rest, declaration);
            tree.push((first.clone(), Node::Inner(inner)));
            done
        }
        (Some((_, Node::Inner(inner))), false) => insert(inner, rest, declaration),
        (Some(_), _) => false,
    }
}

/// Components of the text that are connectors: what the unit describes as such, if all that is in it goes in or comes out.
fn connectors(description: &Description, read: &[String]) -> BTreeSet<String> {
    let directed = |name: &str| {
        let of = |own: &&Variable| *own.name == *name && is_real(own);
        let variable = description.variables.iter().find(of);
        variable.is_some_and(|own| matches!(own.causality, Causality::Input | Causality::Output))
    };
    let whole = |terminal: &&hyd_fmi_import::Terminal| {
        let begin = format!("{}.", terminal.name);
        let mut others = description.variables.iter().filter(|own| own.name.starts_with(&begin));
        let lists = |name: &str| terminal.members.iter().any(|member| member.variable == name);
        terminal.rule != "none"
            && !terminal.members.is_empty()
            && terminal.members.iter().all(|member| member.variable.starts_with(&begin) && directed(&member.variable))
            && others.all(|own| {
                lists(&own.name) || own.causality == Causality::Local && !read.iter().any(|name| *name == *own.name)
            })
    };
    description.terminals.iter().filter(whole).map(|terminal| terminal.name.clone()).collect()
}

/// `place`: the component that the tree stands in, with a dot behind it; empty for the class itself.
fn print(tree: &[(String, Node)], place: &str, connectors: &BTreeSet<String>, text: &mut String) {
    let indent = "  ".repeat(1 + place.matches('.').count());
    for (name, node) in tree {
        match node {
            Node::Leaf(declaration) => {
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{indent}{declaration}");
            }
            Node::Inner(inner) => {
                let class = free(&format!("{name}_variables"), tree);
                let path = format!("{place}{name}");
                let kind = if connectors.contains(&path) { "connector" } else { "model" };
                let _ = writeln!(text, "{indent}{kind} {class}");
                print(inner, &format!("{path}."), connectors, text);
                let _ = writeln!(text, "{indent}end {class};\n{indent}{class} {name};");
            }
        }
    }
}

/// A name that no declaration beside it has.
fn free(wanted: &str, tree: &[(String, Node)]) -> String {
    let mut name = wanted.to_string();
    while tree.iter().any(|(own, _)| *own == name) {
        name.push('_');
    }
    name
}
