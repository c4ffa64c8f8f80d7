//! One class as a section of the page.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use hyd_syntax::print_path;
use hyd_syntax::tree::{ClassBody, Path};

use crate::html::{documentation, escape};
use crate::library::{Library, annotated, text_of};
use crate::lookup::DEEPEST;
use crate::members::{Group, Member, literals, members, of_type};
use crate::{equations, page};

/// What the sections are made from.
pub(crate) struct Sections<'a> {
    pub(crate) library: &'a Library,
    /// By class: the classes that name it, shown ones only.
    pub(crate) used_by: Vec<BTreeSet<usize>>,
    /// By class: the examples whose picture it has.
    pub(crate) pictures: Vec<Vec<usize>>,
    pub(crate) page: &'a page::Page,
}

/// Headings of the groups, and whether their values have limits and defaults.
const GROUPS: [(Group, &str); 7] = [
    (Group::Connector, "Connectors"),
    (Group::Input, "Inputs"),
    (Group::Output, "Outputs"),
    (Group::Parameter, "Parameters"),
    (Group::Derived, "Values that follow from parameters"),
    (Group::Part, "Parts"),
    (Group::Variable, "Variables"),
];

impl Sections<'_> {
    /// The section of a class.
    pub(crate) fn section(&self, class: usize) -> String {
        let entry = &self.library.entries[class];
        let (outer, name) =
            entry.name.rsplit_once('.').map_or(("", entry.name.as_str()), |(outer, name)| (outer, name));
        let outer = if outer.is_empty() { String::new() } else { format!("{}.", escape(outer)) };
        let mut out = format!(
            "<section id=\"{0}\"><h2><small>{1}</small> <span class=\"outer\">{outer}</span>{2}</h2>\n",
            escape(&entry.name),
            kind(self.library, class),
            escape(name)
        );
        if let Some(description) = &entry.class.description {
            let _ = writeln!(out, "<p class=\"lead\">{}</p>", escape(description));
        }
        let info = annotated(entry.class.annotation.as_ref(), &["Documentation", "info"]).and_then(text_of);
        if let Some(info) = info {
            let _ = writeln!(out, "<div class=\"info\">{}</div>", documentation(info));
        }
        out += &self.inherited(class);
        out += &self.contents(class);
        out += &self.members(class);
        out += &self.equations(class);
        out += &self.pictures(class);
        out += &self.uses(class);
        let _ = writeln!(
            out,
            "<details><summary>Text</summary><pre>{}</pre></details></section>",
            escape(&self.text(class))
        );
        out
    }

    /// A link to a class, by the name under which the text knows it.
    fn link(&self, path: &Path, from: usize) -> String {
        self.link_to(self.library.find(path, from), &print_path(path))
    }

    fn link_to(&self, class: Option<usize>, shown: &str) -> String {
        let shown = escape(shown);
        match class.map(|class| &self.library.entries[class]) {
            Some(entry) if self.library.sources[entry.source].shown => {
                let description = entry.class.description.as_deref().unwrap_or_default();
                format!("<a href=\"#{}\" title=\"{}\">{shown}</a>", escape(&entry.name), escape(description))
            }
            _ => shown,
        }
    }

    fn inherited(&self, class: usize) -> String {
        let entry = &self.library.entries[class];
        match &entry.class.body {
            ClassBody::Long { elements, .. } => {
                let bases = elements.iter().filter_map(|element| match element {
                    hyd_syntax::tree::Element::Extends(extends) => Some(self.link(&extends.base, class)),
                    _ => None,
                });
                let bases: Vec<String> = bases.collect();
                if bases.is_empty() { String::new() } else { format!("<p>Extends {}.</p>\n", bases.join(", ")) }
            }
            ClassBody::Short { base, .. } => {
                let attributes = of_type(self.library, class);
                let mut says = vec![self.link(base, entry.parent.unwrap_or(class))];
                let mut say = |what: &str, value: &str| {
                    if !value.is_empty() {
                        says.push(format!("{what} {}", escape(value)));
                    }
                };
                say("unit", &attributes.unit.clone().unwrap_or_default());
                say("limits", &attributes.limits());
                say("of the size", &attributes.nominal.clone().unwrap_or_default());
                format!("<p>{}</p>\n", says.join(", "))
            }
            ClassBody::Enumeration(_) => {
                let mut out = String::from("<table>");
                for literal in literals(self.library, class) {
                    let description = literal.description.as_deref().unwrap_or_default();
                    let _ = write!(
                        out,
                        "<tr><td><code>{}</code></td><td>{}</td></tr>",
                        literal.name.name,
                        escape(description)
                    );
                }
                out + "</table>\n"
            }
            ClassBody::DerivativeOf(..) => String::new(),
        }
    }

    /// What a package holds.
    fn contents(&self, class: usize) -> String {
        let mut out = String::new();
        for child in self.library.within(class) {
            let entry = &self.library.entries[child];
            let description = entry.class.description.as_deref().unwrap_or_default();
            let mut unit = of_type(self.library, child).unit.unwrap_or_default();
            if !unit.is_empty() {
                unit = format!("<span class=\"unit\">{}</span>", escape(&unit));
            }
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{} {unit}</td></tr>",
                kind(self.library, child),
                self.link_to(Some(child), &entry.class.name.name),
                escape(description)
            );
        }
        if out.is_empty() { out } else { format!("<h3>Contents</h3><table>{out}</table>\n") }
    }

    fn members(&self, class: usize) -> String {
        let members = members(self.library, class);
        let mut out = String::new();
        for (group, title) in GROUPS {
            let rows: String = members
                .list
                .iter()
                .filter(|m| m.group(self.library) == group)
                .map(|m| self.member(m, class, group))
                .collect();
            if rows.is_empty() {
                continue;
            }
            let last = match group {
                Group::Parameter => "<th>default</th><th>unit</th><th>limits</th>",
                Group::Derived => "<th>value</th><th>unit</th>",
                Group::Part => "",
                _ => "<th>unit</th>",
            };
            let _ = writeln!(
                out,
                "<h3>{title}</h3><table><thead><tr><th>name</th><th>type</th>{last}<th>description</th></tr></thead><tbody>{rows}</tbody></table>"
            );
        }
        if members.is_cut {
            let _ = writeln!(out, "<p>What bases of bases have that are more than {DEEPEST} deep is left out.</p>");
        }
        out
    }

    /// A row of a table of components.
    fn member(&self, member: &Member<'_>, class: usize, group: Group) -> String {
        let component = member.component;
        let attributes = member.attributes(self.library);
        let dims: Vec<String> = component.dims.iter().map(hyd_syntax::print_expr).collect();
        let dims = if dims.is_empty() { String::new() } else { format!("[{}]", escape(&dims.join(", "))) };
        let mut cells = vec![
            format!("<code>{}{dims}</code>", escape(&component.name.name)),
            self.link(&component.class, member.owner),
        ];
        let unit = format!("<span class=\"unit\">{}</span>", escape(attributes.unit.as_deref().unwrap_or_default()));
        let value = attributes.value.as_deref().or(attributes.start.as_deref()).unwrap_or_default();
        let value = format!("<code>{}</code>", escape(value));
        match group {
            Group::Parameter => cells.extend([value, unit, escape(&attributes.limits())]),
            Group::Derived => cells.extend([value, unit]),
            Group::Part => {}
            _ => cells.push(unit),
        }
        let mut about = escape(component.description.as_deref().unwrap_or_default());
        if component.flow {
            about = format!("<em>flow</em> {about}");
        }
        if component.prefixes.replaceable {
            about = format!("<em>replaceable</em> {about}");
        }
        if member.owner != class {
            let owner = &self.library.entries[member.owner];
            let from = self.link_to(Some(member.owner), &owner.class.name.name);
            about = format!("{about} <span class=\"from\">from {from}</span>");
        }
        cells.push(about);
        let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
        format!("<tr>{cells}</tr>\n")
    }

    /// Its equations and those of its bases, each base once.
    fn equations(&self, class: usize) -> String {
        let mut out = equations::own(self.library, class);
        for base in self.all_bases(class) {
            let inherited = equations::own(self.library, base);
            if !inherited.is_empty() {
                let from = self.link_to(Some(base), &self.library.entries[base].class.name.name);
                let _ = write!(out, "<div class=\"from\">from {from}</div>{inherited}");
            }
        }
        if out.is_empty() { out } else { format!("<h3>Equations</h3>\n{out}") }
    }

    fn all_bases(&self, class: usize) -> Vec<usize> {
        let (mut open, mut seen, mut found) = (vec![class], BTreeSet::new(), Vec::new());
        while let Some(last) = open.pop() {
            if seen.insert(last) {
                found.push(last);
                open.extend(self.library.bases(last).iter().rev());
            }
        }
        found.split_off(1)
    }

    fn pictures(&self, class: usize) -> String {
        let mut out = String::new();
        for &example in &self.pictures[class] {
            let entry = &self.library.entries[example];
            let picture = self.page.picture(&entry.name, example == class);
            let caption = if example == class {
                "as it runs".to_string()
            } else {
                format!("in {}", self.link_to(Some(example), &entry.name))
            };
            let _ = writeln!(out, "<figure>{picture}<figcaption>{caption}</figcaption></figure>");
        }
        if out.is_empty() { out } else { format!("<h3>Example</h3>\n{out}") }
    }

    fn uses(&self, class: usize) -> String {
        let mut out = String::new();
        let calls: Vec<String> = self
            .library
            .called(class)
            .into_iter()
            .map(|called| self.link_to(Some(called), &self.library.entries[called].name))
            .collect();
        if !calls.is_empty() {
            let _ = writeln!(out, "<p class=\"uses\">Calls {}.</p>", calls.join(", "));
        }
        let links = self.used_by[class].iter().map(|user| self.link_to(Some(*user), &self.library.entries[*user].name));
        let links: Vec<String> = links.collect();
        if !links.is_empty() {
            let _ = writeln!(out, "<p class=\"uses\">Used by {}.</p>", links.join(", "));
        }
        out
    }

    /// Its own text, from the margin.
    fn text(&self, class: usize) -> String {
        let entry = &self.library.entries[class];
        let text = self.library.text(class);
        let span = entry.class.span;
        let (start, end) = (text.floor_char_boundary(span.start as usize), text.ceil_char_boundary(span.end as usize));
        let line = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let indent = text[line..start].len();
        let end = if text[end..].trim_start().starts_with(';') {
            end + text[end..].find(';').map_or(0, |at| at + 1)
        } else {
            end
        };
        let own = &text[start..end.max(start)];
        let strip = |line: &str| {
            let blanks = line.len() - line.trim_start_matches(' ').len();
            line[blanks.min(indent)..].to_string()
        };
        own.lines().enumerate().map(|(k, line)| if k == 0 { line.to_string() } else { strip(line) } + "\n").collect()
    }
}

/// The word that a class begins with.
pub(crate) fn kind(library: &Library, class: usize) -> String {
    let class = &library.entries[class].class;
    let word = class.kind.keyword();
    if class.partial { format!("partial {word}") } else { word.to_string() }
}
