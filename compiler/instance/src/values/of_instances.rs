//! What functions of the language tell of instances: `getInstanceName` and `cardinality` (Modelica 3.6, sections 3.7.4.3 and 3.7.4.4).

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Expr, ExprKind};

use crate::instantiation::instance::{InstId, Scope, chain, path};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::tree::InstanceTree;
use crate::values::value::Value;

impl InstanceTree<'_> {
    /// `getInstanceName()`: the path of the instance around, the name of the model in front.
    pub(crate) fn instance_name(&mut self, span: Span, scope: Scope) -> Result<Value, Reported> {
        let around = chain(&self.instances, scope.inst);
        if around.iter().any(|&inst| !self.instances[inst].dims.is_empty()) {
            self.not_structural(span, "`getInstanceName()` differs between the elements of an array".into());
            return Err(Reported);
        }
        let model = self.instances[around[0]].class.map(|class| self.table.full_name(class)).unwrap_or_default();
        let inside = path(&self.instances, scope.inst);
        let name = if inside.is_empty() { model } else { format!("{model}.{inside}") };
        Ok(Value::Text(name.into()))
    }

    /// The connector that `cardinality` is asked of: the instances on the way to it, with their subscripts; there is at least one.
    pub(crate) fn connector_of(
        &mut self,
        span: Span,
        arguments: &[Expr],
        scope: Scope,
    ) -> Result<Vec<(InstId, Vec<Expr>)>, Reported> {
        if let [Expr { kind: ExprKind::Ref(reference), .. }] = arguments
            && let Resolved::Variable(steps) = self.resolve(scope, reference)?
        {
            return Ok(steps.into_iter().map(|(inst, subscripts)| (inst, subscripts.to_vec())).collect());
        }
        self.table.report(Diagnostic::error(Code::BadArguments, "`cardinality` takes a connector").at(span, ""));
        Err(Reported)
    }

    /// How often each element of a connector is connected; empty where none is.
    pub(crate) fn connections_of(&mut self, span: Span, connector: InstId) -> Result<Vec<u32>, Reported> {
        let Some(connected) = &self.connected else {
            self.not_structural(span, "`cardinality` is known in equations only".into());
            return Err(Reported);
        };
        Ok(connected.get(&connector).cloned().unwrap_or_default())
    }

    /// Sizes and subscripts on the way from the model to a connector.
    pub(crate) fn subscripts_of_chain(
        &mut self,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
    ) -> Result<Vec<(usize, Expr)>, Reported> {
        let mut all = Vec::new();
        for inst in chain(&self.instances, steps[steps.len() - 1].0) {
            let dims = self.instances[inst].dims.clone();
            let written = steps.iter().find(|(step, _)| *step == inst).map_or(&[][..], |(_, s)| s.as_slice());
            if written.len() != dims.len() {
                self.not_structural(span, "`cardinality` differs between the elements of an array".into());
                return Err(Reported);
            }
            all.extend(dims.into_iter().zip(written.iter().cloned()));
        }
        Ok(all)
    }
}
