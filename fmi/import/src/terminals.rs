//! `terminalsAndIcons.xml`: connectors of a unit, as far as they say which variables belong together.

use crate::description::{Member, Terminal};
use crate::fault::Fault;
use crate::xml::{self, Element};

/// Terminals stand within each other no deeper.
const DEEPEST: usize = 32;

/// Reads the list.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Terminal>, Fault> {
    const PLACE: &str = "terminalsAndIcons.xml";
    let document = xml::read(xml::text(bytes, PLACE)?, PLACE)?;
    let root = Element::root(&document, PLACE);
    let mut found = Vec::new();
    for element in root.child("Terminals").into_iter().flat_map(Element::children) {
        collect(element, "", DEEPEST, &mut found)?;
    }
    Ok(found)
}

fn collect(element: Element<'_>, outer: &str, depth: usize, found: &mut Vec<Terminal>) -> Result<(), Fault> {
    if element.name() != "Terminal" {
        return Ok(());
    }
    if depth == 0 {
        return Err(element.fault(format!("terminals stand within each other more than {DEEPEST} deep")));
    }
    let own = element.required("name")?;
    let name = if outer.is_empty() { own.to_string() } else { format!("{outer}.{own}") };
    let mut members = Vec::new();
    for child in element.children() {
        // What streams in and what streams out are two variables.
        let own: &[_] = match child.name() {
            "TerminalMemberVariable" => &[("variableName", "memberName", child.attribute("variableKind"))],
            "TerminalStreamMemberVariable" => &[
                ("inStreamVariableName", "inStreamMemberName", Some("stream in")),
                ("outStreamVariableName", "outStreamMemberName", Some("stream out")),
            ],
            _ => continue,
        };
        for &(variable, name, kind) in own {
            let words = |text: Option<&str>| text.unwrap_or_default().to_string();
            let variable = child.required(variable)?.to_string();
            members.push(Member { variable, name: words(child.attribute(name)), kind: words(kind) });
        }
    }
    let kind = element.attribute("terminalKind").unwrap_or_default().to_string();
    let rule = element.attribute("matchingRule").unwrap_or_default().to_string();
    found.push(Terminal { name: name.clone(), kind, rule, members });
    element.children().try_for_each(|child| collect(child, &name, depth - 1, found))
}
