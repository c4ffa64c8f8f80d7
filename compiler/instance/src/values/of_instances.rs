//! What functions of the language tell of instances: `getInstanceName`, `cardinality`, `Connections.isRoot` and `rooted`
//! (Modelica 3.6, sections 3.7.4.3, 3.7.4.4 and 9.4.1).

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{Expr, ExprKind};

use crate::builtins::Builtin;
use crate::instantiation::instance::{InstId, Scope, chain, path};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::{Rooting, Scopes};
use crate::values::value::Value;

impl Scopes<'_> {
    /// `getInstanceName()`: the path of the instance around, the name of the model in front.
    pub(crate) fn instance_name(&mut self, span: Span, scope: Scope) -> Result<Value, Reported> {
        let around = chain(&self.instances, scope.inst);
        if around.iter().any(|&inst| !self.instances[inst].dims.is_empty()) {
            return Err(
                self.not_structural(span, "`getInstanceName()` differs between the elements of an array".into())
            );
        }
        let model = self.instances[around[0]].class.map(|class| self.table.full_name(class)).unwrap_or_default();
        let inside = path(&self.instances, scope.inst);
        let name = if inside.is_empty() { model } else { format!("{model}.{inside}") };
        Ok(Value::Text(name.into()))
    }

    /// The component that a question about connections names: the instances on the way to it, with their subscripts; there is at
    /// least one.
    pub(crate) fn connected_component(
        &mut self,
        asked: Builtin,
        span: Span,
        arguments: &[Expr],
        scope: Scope,
    ) -> Result<Vec<(InstId, Vec<Expr>)>, Reported> {
        if let [Expr { kind: ExprKind::Ref(reference), .. }] = arguments
            && let Resolved::Variable(steps) = self.resolve(scope, reference)?
        {
            return Ok(steps.into_iter().map(|(inst, subscripts)| (inst, subscripts.to_vec())).collect());
        }
        let what = if asked == Builtin::Cardinality { "a connector" } else { "a variable of a connector" };
        let message = format!("`{}` takes {what}", asked.name());
        Err(self.error(Code::BadArguments, span, message))
    }

    /// What is known of each element; empty where nothing has been said of any.
    pub(crate) fn known_of_connections(
        &mut self,
        asked: Builtin,
        span: Span,
        inst: InstId,
    ) -> Result<Vec<Value>, Reported> {
        let known = match asked {
            Builtin::Cardinality => self.found.connected.as_ref().map(|connected| {
                let degrees = connected.get(&inst).map_or(&[][..], Vec::as_slice);
                degrees.iter().map(|&degree| Value::Integer(i64::from(degree))).collect()
            }),
            _ => self.found.rooting.as_ref().map(|rooting| {
                let rooting = rooting.get(&inst).map_or(&[][..], Vec::as_slice);
                let told = |r: &Rooting| if asked == Builtin::IsRoot { r.is_root } else { r.rooted };
                rooting.iter().map(|rooting| Value::Boolean(told(rooting))).collect()
            }),
        };
        known.ok_or_else(|| self.not_structural(span, format!("`{}` is known in equations only", asked.name())))
    }

    /// Sizes and subscripts on the way from the model to a component; where an array around it has no subscript, it is noted to be made in
    /// parts.
    pub(crate) fn subscripts_of_chain(
        &mut self,
        asked: Builtin,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
    ) -> Result<Vec<(usize, Expr)>, Reported> {
        let mut all = Vec::new();
        for inst in chain(&self.instances, steps[steps.len() - 1].0) {
            let dims = self.instances[inst].dims.clone();
            let written = steps.iter().find(|(step, _)| *step == inst).map_or(&[][..], |(_, s)| s.as_slice());
            if written.len() != dims.len() {
                self.differing.insert(path(&self.instances, inst));
                return Err(
                    self.not_structural(span, format!("`{}` differs between the elements of an array", asked.name()))
                );
            }
            all.extend(dims.into_iter().zip(written.iter().cloned()));
        }
        Ok(all)
    }
}
