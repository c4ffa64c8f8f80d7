//! Derivatives that the author of a function gives: `annotation(derivative = f_der)` (Modelica 3.6, section 12.7.1).
//!
//! The body of the function learns which body computes its derivative and which inputs have a rate there; differentiation
//! then calls it.  `zeroDerivative` makes it valid only where an input does not vary, `noDerivative` leaves the rate of an
//! input out, which makes it valid along solutions of the model only, `order = 2` stands at the first derivative.  Functions of records
//! are differentiated by the compiler.

use std::rc::Rc;

use hyd_instance::modifier::AstMod;
use hyd_instance::{Env, ScalarType, Scope};
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyId, Derivative};
use hyd_syntax::tree::{ClassKind, Name};
use hyd_typed::{Declaration, Function, Kind};

use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::form::Form;

impl Flattener<'_, '_> {
    /// The derivatives that the annotation of the function names.
    pub(crate) fn give_derivatives(
        &mut self,
        span: Span,
        callee: &Function,
        position: usize,
        cx: &Context,
    ) -> Result<(), Fail> {
        let (id, inputs) = (self.bodies[position].id, self.bodies[position].inputs.clone());
        for tree in callee.derivatives() {
            if self.order(&tree) == 1
                && let Some((target, derivative)) = self.derivative_body(span, callee, &tree, &inputs, cx)?
            {
                let mut body = Body::clone(self.model.templates.arena.body(id));
                let count = body.inputs;
                let chained: Vec<(u32, u32)> = derivative.of.iter().zip(count..).map(|(&x, dx)| (x, dx)).collect();
                body.derivatives.push(derivative.clone());
                self.model.templates.arena.set_body(id, body);
                self.give_second(span, &target, (derivative.body, chained, count), cx)?;
            }
        }
        Ok(())
    }

    /// `annotation(derivative(order = 2) = g)` of a first derivative.
    fn give_second(
        &mut self,
        span: Span,
        first: &Function,
        (id, chained, count): (BodyId, Vec<(u32, u32)>, u32),
        cx: &Context,
    ) -> Result<(), Fail> {
        let Some(position) = self.bodies.iter().position(|body| body.id == id) else { return Ok(()) };
        let inputs = self.bodies[position].inputs.clone();
        for tree in first.derivatives() {
            if self.order(&tree) != 2 {
                continue;
            }
            let Some((_, derivative)) = self.derivative_body(span, first, &tree, &inputs, cx)? else { continue };
            let of: Vec<u32> = (count..count + chained.len() as u32).collect();
            let mut body = Body::clone(self.model.templates.arena.body(id));
            body.derivatives.push(Derivative { of, chained: chained.clone(), ..derivative });
            self.model.templates.arena.set_body(id, body);
        }
        Ok(())
    }

    /// The body of a derivative and what it takes; `None` for records, whose derivative is found by differentiation.
    fn derivative_body(
        &mut self,
        span: Span,
        callee: &Function,
        tree: &AstMod,
        inputs: &[Form],
        cx: &Context,
    ) -> Result<Option<(Rc<Function>, Derivative)>, Fail> {
        let Some(expr) = tree.binding.as_deref() else { return Ok(None) };
        let typed = self.typed_in(expr, Scope { inst: callee.inst, frame: 0 })?;
        let Kind::Class(local, _) = &typed.kind else {
            return Err(self.error(Code::BadArguments, expr.span, "`derivative` names a function"));
        };
        let kind = self.scopes.table.class(local.class).def.kind;
        if kind != ClassKind::Function || inputs.iter().any(|form| matches!(form, Form::Record(_))) {
            return Ok(None);
        }
        let named = |what: &str, name: &Name| {
            let says = |expr: &hyd_syntax::tree::Expr| hyd_syntax::print_expr(expr) == name.as_ref();
            tree.children.iter().any(|(n, child)| n.as_ref() == what && child.binding.as_deref().is_some_and(says))
        };
        let second = self.order(tree) == 2;
        let target = self.function(local, cx.scope)?;
        let mut forms = inputs.to_vec();
        let (mut of, mut constant, mut along_time, mut at) = (Vec::new(), Vec::new(), false, 0u32);
        let declared: Vec<&Declaration> = callee.inputs().collect();
        let wanted = target.inputs().count().saturating_sub(inputs.len());
        // A second derivative takes one more rate for each rate: the last inputs.
        let from = if second { inputs.len().saturating_sub(wanted) } else { 0 };
        for (k, (input, form)) in declared.iter().zip(inputs).enumerate() {
            let count = form.scalars().len() as u32;
            let real = form.scalars().contains(&ScalarType::Real);
            if named("zeroDerivative", &input.name.name) {
                constant.extend(at..at + count);
            } else if real && named("noDerivative", &input.name.name) {
                along_time = true;
            } else if real && k >= from {
                of.extend(at..at + count);
                forms.push(form.clone());
            }
            at += count;
        }
        if forms.len() != target.inputs().count() {
            let message = format!(
                "the derivative `{}` takes {} inputs, but {} are given by the inputs of `{}`",
                target.name(),
                target.inputs().count(),
                forms.len(),
                callee.name()
            );
            return Err(self.error(Code::BadArguments, expr.span, message));
        }
        let position = self.body_for(span, &target, forms, cx)?;
        let body = self.bodies[position].id;
        Ok(Some((target, Derivative { body, of, constant, along_time, chained: Vec::new() })))
    }

    /// The order of a derivative in an annotation, 1 if it does not say.
    fn order(&mut self, tree: &AstMod) -> i64 {
        let given = tree.children.iter().find(|(name, _)| name.as_ref() == "order");
        let Some(expr) = given.and_then(|(_, child)| child.binding.clone()) else { return 1 };
        let scope = Scope { inst: self.tree.root, frame: 0 };
        let value = self.scopes.quietly(|scopes| scopes.evaluate(&expr, scope, &Env::default()));
        value.ok().and_then(|value| value.as_integer()).unwrap_or(1)
    }
}
