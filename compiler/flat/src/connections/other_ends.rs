//! Where connectors of different kinds are joined: a connector of the right kind to which nothing is connected may have been meant.

use hyd_instance::InstId;
use hyd_source::{Diagnostic, Edit, Span};
use hyd_syntax::tree::ClassKind;

use crate::connections::connect::Leaf;
use crate::state::flattener::Flattener;

/// A connector that is joined where another one may have been meant.
pub(super) struct End<'a> {
    pub inst: InstId,
    /// As it stands in the text.
    pub span: Span,
    pub leaves: &'a [Leaf],
}

impl Flattener<'_, '_> {
    /// Proposes the only connector that fits one of two ends and is named nowhere else in the text.
    pub(super) fn propose_other_end(&self, diagnostic: Diagnostic, ends: [&End<'_>; 2]) -> Diagnostic {
        let mut found = Vec::new();
        for (kept, replaced) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            let Some(component) = self.scopes.instances[kept.inst].parent else { continue };
            let Some(around) = self.scopes.instances[component].parent else { continue };
            let Some(class) = self.scopes.instances[around].class else { continue };
            let connected = self.connects_of(class);
            for &other in self.scopes.instances[around].children.iter().filter(|&&own| own != component) {
                for &connector in &self.scopes.instances[other].children {
                    let own = &self.scopes.instances[connector];
                    if own.kind != ClassKind::Connector || own.absent || !own.dims.is_empty() {
                        continue;
                    }
                    let name = format!("{}.{}", self.scopes.instances[other].name, own.name);
                    if self.is_of_kind(connector, kept.leaves) && !connected.contains(&name) {
                        found.push((name, kept.span, replaced.span));
                    }
                }
            }
        }
        let [(name, kept, replaced)] = &found[..] else { return diagnostic };
        let snippet = |span: Span| self.scopes.table.files.snippet(span).to_string();
        let (kept, old) = (snippet(*kept), snippet(*replaced));
        let words =
            format!("nothing is connected to `{name}`, which is of the kind of `{kept}`: write `{name}` for `{old}`");
        diagnostic.help(words.clone()).propose(words, vec![Edit { span: *replaced, text: name.clone() }])
    }

    /// True for a connector with these elements.
    fn is_of_kind(&self, connector: InstId, leaves: &[Leaf]) -> bool {
        let own = self.leaves(connector);
        let alike = |a: &Leaf, b: &Leaf| (&a.path, a.flow, a.stream) == (&b.path, b.flow, b.stream);
        !own.is_empty() && own.len() == leaves.len() && own.iter().zip(leaves).all(|(a, b)| alike(a, b))
    }
}
