//! A block whose input is connected to its own output, while the output of another block goes nowhere.
//!
//! A block that is fed back to itself is not by itself a fault, nor is an output that nobody takes.  Both at once are what a connection with
//! the wrong end leaves behind.

use hyd_instance::InstId;
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassKind, Direction};

use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// A warning on connected inputs and outputs: for each its connector, whether it is seen from outside, and the `connect`.
    pub(crate) fn feeds_itself(&mut self, leaves: &[(InstId, bool, Span)]) {
        let instances = &self.scopes.instances;
        let own = |leaf: InstId, direction: Direction| {
            (self.direction_of(leaf) == Some(direction)).then_some(instances[leaf].parent).flatten()
        };
        let of = |direction: Direction| {
            leaves.iter().filter(|own| !own.1).filter_map(move |&(leaf, _, at)| Some((leaf, own(leaf, direction)?, at)))
        };
        let Some((output, component, _)) = of(Direction::Output).next() else { return };
        let Some((input, _, at)) = of(Direction::Input).find(|&(_, parent, _)| parent == component) else { return };
        // The elements of an array are one instance: the output of one may be the input of the next.
        let is_here = Some(at.file) == self.scopes.table.main && instances[component].dims.is_empty();
        let Some(around) = instances[component].parent.filter(|_| is_here) else {
            return;
        };
        let text = self.scopes.table.files.text(at.file);
        let is_written = |name: &str| {
            text.lines().any(|line| line.split("//").next().is_some_and(|own| own.replace(' ', "").contains(name)))
        };
        // All outputs beside it that the text never names.
        let mut free = Vec::new();
        for &beside in instances[around].children.iter().filter(|&&beside| beside != component) {
            let is_block = matches!(instances[beside].kind, ClassKind::Block | ClassKind::Model);
            // What a base class declares in a text of its own it may connect there.
            let is_block = is_block && Some(instances[beside].span.file) == self.scopes.table.main;
            for &end in instances[beside].children.iter().filter(|_| is_block && instances[beside].dims.is_empty()) {
                let name = format!("{}.{}", instances[beside].name, instances[end].name);
                if instances[end].direction == Some(Direction::Output) && !is_written(&name) {
                    free.push(name);
                }
            }
        }
        let [free] = &free[..] else { return };
        let named = |inst: InstId| format!("{}.{}", instances[component].name, instances[inst].name);
        let (taken, given) = (named(input), named(output));
        let message = format!(
            "`{taken}` is connected to `{given}`, the output of the same component, and nothing takes `{free}`"
        );
        if self.scopes.table.messages.iter().any(|own| own.message == message) {
            return;
        }
        let mut warning = Diagnostic::warning(Code::ConnectionRule, message).at(at, "");
        warning = warning.help(format!("is `{free}` meant at `{taken}`?"));
        self.report(warning);
    }
}
