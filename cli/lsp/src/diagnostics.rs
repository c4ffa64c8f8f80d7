//! Messages of the compiler as messages of the protocol, with the changes that they propose.

use hyd_source::{Code, Diagnostic, Files, Proposal, Severity, Span};
use lsp_types::{
    CodeDescription, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location, NumberOrString, Range,
    TextEdit, Uri,
};
use serde_json::json;

use crate::documents::Document;
use crate::session::Session;

/// A message with its changes.
#[derive(Clone, Debug)]
pub(crate) struct Item {
    /// The message.
    pub(crate) diagnostic: lsp_types::Diagnostic,
    /// Changes that heal it, the best first.
    pub(crate) fixes: Vec<Fix>,
    /// The class whose translation says it; none where the text alone does.
    pub(crate) of: Option<String>,
}

/// A change that heals a message.
#[derive(Clone, Debug)]
pub(crate) struct Fix {
    /// What it does.
    pub(crate) title: String,
    /// All that has to be changed together.
    pub(crate) edits: Vec<(Uri, TextEdit)>,
}

/// A message as the protocol has it.  One about another file stands at `place`, which is the name of the class that was checked.
pub(crate) fn item(
    session: &Session,
    document: &Document,
    files: &Files,
    said: &Diagnostic,
    place: Option<Span>,
) -> Item {
    let name = document.path.display().to_string();
    let is_own = |span: &Span| **files.name(span.file) == *name;
    let primary = said.labels.iter().position(|label| label.primary && is_own(&label.span));
    let shown = primary.or_else(|| said.labels.iter().position(|label| is_own(&label.span)));
    let span = shown.map(|at| said.labels[at].span).or(place);
    let range = span.map_or_else(Range::default, |span| session.range(document, span));
    let mut message = said.message.clone();
    if let Some(label) = shown.map(|at| &said.labels[at]).filter(|label| !label.message.is_empty()) {
        message.push_str(&format!("\n{}", label.message));
    }
    said.notes.iter().for_each(|note| message.push_str(&format!("\n{note}")));
    let others = said.labels.iter().enumerate().filter(|(at, _)| Some(*at) != shown);
    let related = others.filter_map(|(_, label)| {
        let location: Location = session.location(files, label.span)?;
        let message = if label.message.is_empty() { said.message.clone() } else { label.message.clone() };
        Some(DiagnosticRelatedInformation { location, message })
    });
    let related: Vec<DiagnosticRelatedInformation> = related.collect();
    let diagnostic = lsp_types::Diagnostic {
        range,
        severity: Some(match said.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
            Severity::Note => DiagnosticSeverity::INFORMATION,
        }),
        code: Some(NumberOrString::String(said.code.number().to_string())),
        code_description: session.page(said.code).map(|href| CodeDescription { href }),
        source: Some("hyd".into()),
        message,
        related_information: (!related.is_empty()).then_some(related),
        tags: (said.code == Code::Unused).then(|| vec![DiagnosticTag::UNNECESSARY]),
        data: Some(json!({ "explain": format!("hyd explain {}", said.code.number()) })),
    };
    let fixes = said.proposals.iter().filter_map(|own| fix(session, files, own)).collect();
    Item { diagnostic, fixes, of: None }
}

/// A proposal, where all that it changes can be named.
fn fix(session: &Session, files: &Files, proposal: &Proposal) -> Option<Fix> {
    let edit = |edit: &hyd_source::Edit| {
        if !session.is_own(files.name(edit.span.file)) {
            return None;
        }
        let Location { uri, range } = session.location(files, edit.span)?;
        Some((uri, TextEdit { range, new_text: edit.text.clone() }))
    };
    let edits: Option<Vec<_>> = proposal.edits.iter().map(edit).collect();
    edits.filter(|edits| !edits.is_empty()).map(|edits| Fix { title: capitalised(&proposal.message), edits })
}

fn capitalised(text: &str) -> String {
    let mut rest = text.chars();
    rest.next().map_or_else(String::new, |first| first.to_uppercase().collect::<String>() + rest.as_str())
}
