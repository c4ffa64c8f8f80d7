//! Parameters that the start determines (`fixed = false`): the initial equations give their value, the text only a guess
//! (Modelica 3.6, sections 8.6 and 4.4.4), so nothing that must be known at translation may ask for it.

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::Variability;

use crate::build::InstanceTree;
use crate::instance::{InstId, path};
use crate::value::Value;

impl InstanceTree<'_> {
    /// True for a parameter with `fixed = false`, or of whose elements one has it.
    pub fn is_free(&mut self, inst: InstId) -> bool {
        if self.instances[inst].variability != Variability::Parameter {
            return false;
        }
        let Some(primitive) = &self.instances[inst].primitive else { return false };
        let Some(applied) = primitive.attributes.iter().find(|(name, _)| name.as_ref() == "fixed") else {
            return false;
        };
        let applied = applied.1.clone();
        let Ok(value) = self.evaluate_applied(&applied) else { return false };
        value.flatten().iter().any(|value| matches!(value, Value::Boolean(false)))
    }

    /// Says that a value that is needed at translation is found by the start.
    pub(crate) fn found_at_start(&mut self, inst: InstId, span: Span) -> Reported {
        let (name, declared) = (path(&self.instances, inst), self.instances[inst].span);
        let message =
            format!("the value of `{name}` is found at the start (`fixed = false`), but decides sizes or structure");
        let diagnostic = Diagnostic::error(Code::NotStructural, message).at(span, "needed before the run");
        self.table.report(diagnostic.with(declared, "declared here"));
        Reported
    }
}
