//! Strings of a model that leaves for other tools: they have no place in a run, and are shown with their values.
//!
//! A value is looked at without being fixed by that, so nothing can be set less than before.  One that follows from parameters that can be
//! set, or that the start finds, would be out of date as soon as somebody does; it is left out, by name.

use std::sync::Arc;

use hyd_instance::{InstId, ScalarType};
use hyd_syntax::tree::Variability;
use hyd_system::Settable;

use crate::model::{BlockId, TextBlock};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// Looks at all Strings, once it is known what can be set.
    pub(crate) fn note_texts(&mut self) {
        let mut found = Vec::new();
        self.texts_of(self.tree.root, &mut found);
        for inst in found {
            let name = self.name_pattern(inst);
            let path = self.path(inst).to_string();
            match self.text_values(inst, name.count()) {
                Known::Values(values) => {
                    let instance = &self.scopes.instances[inst];
                    let is_final = instance.final_record || instance.primitive.as_ref().is_some_and(|p| p.is_final);
                    let is_open = !is_final && !instance.protected && instance.variability == Variability::Parameter;
                    let description = instance.description.clone();
                    self.model.texts.push(TextBlock { name, values, description, is_open });
                }
                Known::Later => self.model.open_texts.push(path),
                Known::No => self.model.unknown_texts.push(path),
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

    /// Its values, as many as the name has elements.
    fn text_values(&mut self, inst: InstId, count: usize) -> Known {
        let span = self.scopes.instances[inst].span;
        let (value, taken) = self.scopes.quietly(|scopes| scopes.guess_value(inst, span));
        for taken in taken {
            let is_open = |block: &BlockId| self.model.variables[*block].settable == Settable::Yes;
            if self.blocks.get(&taken).is_some_and(is_open) || self.scopes.is_free(taken) {
                return Known::Later;
            }
        }
        let text = |value: &hyd_instance::Value| match value {
            hyd_instance::Value::Text(text) => Some(text.clone()),
            _ => None,
        };
        let values: Option<Vec<Arc<str>>> =
            value.ok().and_then(|value| value.flatten().into_iter().map(text).collect());
        let own = self.scopes.instances[inst].dims.iter().product::<usize>();
        match values {
            Some(values) if values.len() == count => Known::Values(values),
            // What the class says holds for each element of an array of components.
            Some(values) if values.len() == own && own > 0 && count.is_multiple_of(own) => {
                Known::Values(values.iter().cycle().take(count).cloned().collect())
            }
            _ => Known::No,
        }
    }
}

/// What is known of a String before the run.
enum Known {
    Values(Vec<Arc<str>>),
    /// It follows from what can be set, or is found at the start.
    Later,
    /// It has no value, or others in each element of an array of components.
    No,
}
