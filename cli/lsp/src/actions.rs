//! Code actions: the changes that messages propose, one by one, and all that can be made together.

use std::collections::HashMap;

use lsp_types::{
    CodeAction, CodeActionContext, CodeActionKind, CodeActionOrCommand, Range, TextEdit, Uri, WorkspaceEdit,
};

use crate::check::Checked;
use crate::diagnostics::{Fix, Item};

/// The actions for a range of the document that was checked.
pub(crate) fn actions(checked: &Checked, range: Range, context: &CodeActionContext) -> Vec<CodeActionOrCommand> {
    let wants = |kind: &CodeActionKind| {
        let asked = context.only.as_ref();
        asked.is_none_or(|only| only.iter().any(|own| kind.as_str().starts_with(own.as_str())))
    };
    let mut found = Vec::new();
    if wants(&CodeActionKind::QUICKFIX) {
        for item in checked.items.iter().filter(|item| touches(item.diagnostic.range, range)) {
            found.extend(item.fixes.iter().enumerate().map(|(k, fix)| quick_fix(item, fix, k == 0)));
        }
    }
    if wants(&CodeActionKind::SOURCE_FIX_ALL) {
        let chosen = together(&checked.items);
        if !chosen.is_empty() {
            let count = chosen.len();
            found.push(CodeActionOrCommand::CodeAction(CodeAction {
                title: format!("Make the changes that {count} messages propose"),
                kind: Some(CodeActionKind::SOURCE_FIX_ALL),
                edit: Some(edit(chosen.iter().flat_map(|fix| fix.edits.iter()))),
                ..CodeAction::default()
            }));
        }
    }
    found
}

fn quick_fix(item: &Item, fix: &Fix, first: bool) -> CodeActionOrCommand {
    CodeActionOrCommand::CodeAction(CodeAction {
        title: fix.title.clone(),
        kind: Some(CodeActionKind::QUICKFIX),
        diagnostics: Some(vec![item.diagnostic.clone()]),
        edit: Some(edit(fix.edits.iter())),
        is_preferred: first.then_some(true),
        ..CodeAction::default()
    })
}

/// The first proposal of each message, as far as it touches no other.
fn together(items: &[Item]) -> Vec<&Fix> {
    let mut chosen: Vec<&Fix> = Vec::new();
    for fix in items.iter().filter_map(|item| item.fixes.first()) {
        let taken = |(uri, own): &(Uri, TextEdit)| {
            let known = chosen.iter().flat_map(|fix| &fix.edits);
            known.filter(|(other, _)| other == uri).any(|(_, other)| touches(own.range, other.range))
        };
        if !fix.edits.iter().any(taken) {
            chosen.push(fix);
        }
    }
    chosen
}

fn touches(a: Range, b: Range) -> bool {
    a.start <= b.end && b.start <= a.end
}

// The addresses are those of the protocol's own type, whose hash does not change.
#[allow(clippy::mutable_key_type)]
fn edit<'f>(edits: impl Iterator<Item = &'f (Uri, TextEdit)>) -> WorkspaceEdit {
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for (uri, edit) in edits {
        changes.entry(uri.clone()).or_default().push(edit.clone());
    }
    WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }
}
