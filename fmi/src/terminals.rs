//! The connectors of a model: `terminalsAndIcons.xml`.
//!
//! Source: Functional Mock-up Interface 3.0.2, section 2.4.9; units of version 2.0 carry the same file, which names the version that
//! defines it.  The kinds of the standard are for inputs, outputs and parameters alone; what can only be read has kinds of this program, and
//! connectors of components within are not meant to be connected.

use std::collections::BTreeMap;

use hyd_system::MemberKind;

use crate::facts::{Facts, Terminal, Version};
use crate::variables::{Causality, Entry};
use crate::xml::{Attributes, Document};

/// The version of the file where the unit is of an older one.
const DEFINED_BY: &str = "3.0";

/// Writes the file; none where there is no connector.  `names`: the entry and the name in it that stands for a variable and element.
pub(crate) fn write(facts: &Facts, version: Version, names: &Names<'_>) -> Option<Vec<u8>> {
    let written: Vec<(&Terminal, Vec<Member<'_>>)> = facts
        .terminals
        .iter()
        .map(|terminal| (terminal, members(terminal, names)))
        .filter(|(_, members)| !members.is_empty())
        .collect();
    if written.is_empty() {
        return None;
    }
    let mut document = Document::new();
    let defined = if version == Version::Three { version.text() } else { DEFINED_BY };
    document.element("fmiTerminalsAndIcons", Attributes::default().with("fmiVersion", defined), |document| {
        document.element("Terminals", Attributes::default(), |document| {
            for (terminal, members) in &written {
                let attributes = Attributes::default()
                    .with("name", &terminal.name)
                    .with("matchingRule", rule(terminal, members))
                    .text("terminalKind", &terminal.class)
                    .text("description", &terminal.description);
                document.element("Terminal", attributes, |document| {
                    for member in members {
                        let attributes = Attributes::default().with("variableName", member.variable);
                        let attributes = attributes.text("memberName", member.name).with("variableKind", member.kind);
                        document.empty("TerminalMemberVariable", attributes);
                    }
                });
            }
        });
    });
    Some(document.finish())
}

/// A variable of a connector as it is written.
struct Member<'a> {
    variable: &'a str,
    /// Empty where the connector is the variable.
    name: &'a str,
    kind: &'static str,
}

/// How connectors are to be matched: a single signal by its place, several variables by their names.
fn rule(terminal: &Terminal, members: &[Member<'_>]) -> &'static str {
    match terminal.outside {
        false => "none",
        true if members.iter().all(|member| member.name.is_empty()) => "sequence",
        true => "plug",
    }
}

fn members<'a>(terminal: &'a Terminal, names: &Names<'a>) -> Vec<Member<'a>> {
    let mut found: Vec<Member<'_>> = Vec::new();
    for &(position, kind) in &terminal.members {
        let Some((own, entry)) = names.of(position) else { continue };
        let name = own.strip_prefix(terminal.name.as_str()).and_then(|rest| rest.strip_prefix('.'));
        let (variable, name) = (entry.name.as_str(), name.unwrap_or_default());
        // The elements of an array are one variable.
        if found.iter().any(|other| (other.variable, other.name) == (variable, name)) {
            continue;
        }
        let open = matches!(entry.causality, Causality::Input | Causality::Output | Causality::Parameter);
        let kind = match kind {
            MemberKind::Signal | MemberKind::Potential if open => "signal",
            MemberKind::Flow if open => "inflow",
            MemberKind::Signal => "_hyd_signal",
            MemberKind::Potential => "_hyd_potential",
            MemberKind::Flow => "_hyd_inflow",
            MemberKind::Stream => "_hyd_stream",
        };
        found.push(Member { variable, name, kind });
    }
    found
}

/// Which entry, and which of its names, stands for a variable and element.
pub(crate) struct Names<'a>(BTreeMap<&'a str, &'a Entry>, &'a BTreeMap<(usize, usize), String>);

impl<'a> Names<'a> {
    /// `written`: the names in question.
    pub(crate) fn new(entries: &'a [Entry], written: &'a BTreeMap<(usize, usize), String>) -> Self {
        let mut found = BTreeMap::new();
        for entry in entries {
            found.extend(entry.aliases.iter().map(|(name, _)| (name.as_str(), entry)));
            found.insert(entry.name.as_str(), entry);
        }
        Self(found, written)
    }

    fn of(&self, position: (usize, usize)) -> Option<(&'a str, &'a Entry)> {
        let name = self.1.get(&position)?;
        self.0.get_key_value(name.as_str()).map(|(&name, &entry)| (name, entry))
    }
}
