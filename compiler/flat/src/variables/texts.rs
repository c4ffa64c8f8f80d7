//! Strings of a model that leaves for other tools: they have no place in a run, and are shown with their values.
//!
//! A value is looked at without being fixed by that, so nothing can be set less than before.  One that follows from parameters that can be
//! set would be out of date as soon as somebody sets them; it is left out, by name.

use std::sync::Arc;

use hyd_instance::{InstId, ScalarType};
use hyd_syntax::tree::Variability;
use hyd_system::Settable;

use crate::model::TextBlock;
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// Looks at all Strings, once it is known what can be set.
    pub(crate) fn note_texts(&mut self) {
        let mut found = Vec::new();
        self.texts_of(self.tree.root, &mut found);
        for inst in found {
            let name = self.name_pattern(inst);
            let count = name.count();
            // One value that is said of each element is that of all.
            let spread = |values: Vec<Arc<str>>| match values.as_slice() {
                [only] => vec![only.clone(); count],
                _ => values,
            };
            match self.text_values(inst).map(spread).filter(|values| values.len() == count) {
                Some(values) => {
                    let instance = &self.scopes.instances[inst];
                    let is_final = instance.final_record || instance.primitive.as_ref().is_some_and(|p| p.is_final);
                    let is_open = !is_final && !instance.protected && instance.variability == Variability::Parameter;
                    let description = instance.description.clone();
                    self.model.texts.push(TextBlock { name, values, description, is_open });
                }
                None => {
                    let path = self.path(inst).to_string();
                    self.model.open_texts.push(path);
                }
            }
        }
    }

    /// A String that is set from outside is taken whether something asks for it or not.
    pub(crate) fn take_given_texts(&mut self) {
        if self.scopes.overrides.is_empty() {
            return;
        }
        let mut found = Vec::new();
        self.texts_of(self.tree.root, &mut found);
        for inst in found {
            if let Some(position) = self.scopes.override_of(inst) {
                self.scopes.overrides[position].used = true;
            }
        }
    }

    /// String parameters and constants of an instance and all below it.
    fn texts_of(&self, inst: InstId, found: &mut Vec<InstId>) {
        let instance = &self.scopes.instances[inst];
        if instance.absent {
            return;
        }
        match &instance.primitive {
            Some(primitive) => {
                if primitive.scalar == ScalarType::Text && self.scopes.variability(inst) <= Variability::Parameter {
                    found.push(inst);
                }
            }
            None => instance.children.iter().for_each(|&child| self.texts_of(child, found)),
        }
    }

    /// Its values; none where they depend on what can be set, or are not known before the run.
    fn text_values(&mut self, inst: InstId) -> Option<Vec<Arc<str>>> {
        let span = self.scopes.instances[inst].span;
        let (value, taken) = self.scopes.quietly(|scopes| scopes.guess_value(inst, span));
        let can_be_set = |inst: &InstId| {
            self.blocks.get(inst).is_some_and(|&block| self.model.variables[block].settable == Settable::Yes)
        };
        if taken.iter().any(can_be_set) {
            return None;
        }
        let text = |value: &hyd_instance::Value| match value {
            hyd_instance::Value::Text(text) => Some(text.clone()),
            _ => None,
        };
        value.ok()?.flatten().into_iter().map(text).collect()
    }
}
