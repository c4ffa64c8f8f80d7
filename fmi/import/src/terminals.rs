//! `terminalsAndIcons.xml`: connectors of a unit, as far as they say which variables belong together.

use crate::description::Terminal;
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
    let members = element.children().filter(|child| child.name().ends_with("MemberVariable"));
    let variables =
        members.map(|member| member.required("variableName").map(str::to_string)).collect::<Result<_, _>>()?;
    let kind = element.attribute("terminalKind").unwrap_or_default().to_string();
    found.push(Terminal { name: name.clone(), kind, variables });
    element.children().try_for_each(|child| collect(child, &name, depth - 1, found))
}
