//! What the two sides of an equation may be: types that fit, and something between them to determine.

use hyd_instance::ScalarType;
use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::Variability as Declared;
use hyd_system::Variability;
use hyd_typed::{Expr, Kind as Form};

use crate::state::context::Fail;
use crate::state::flattener::Flattener;
use crate::state::index::{Kind, SlotKey};
use crate::state::node::Typed;

impl Flattener<'_, '_> {
    pub(crate) fn check_sides(
        &mut self,
        equation: Span,
        left: &Expr,
        right: &Expr,
        a: &Typed,
        b: &Typed,
    ) -> Result<(), Fail> {
        let constant = |flat: &Self, t: &Typed| flat.model.templates.arena.as_constant(t.node).is_some();
        let fits = a.scalar == b.scalar
            || a.is_number() && b.is_number() && {
                // An Integer variable cannot equal a Real expression.
                let integer_left = matches!(a.scalar, ScalarType::Integer) && !constant(self, a);
                let integer_right = matches!(b.scalar, ScalarType::Integer) && !constant(self, b);
                let variable = |e: &Expr| matches!(e.kind, Form::Variable(_) | Form::Local(_));
                let taken = integer_left && variable(left) && self.is_discrete_ref(a)
                    || integer_right
                        && variable(right)
                        && self.is_discrete_ref(b)
                        && !self.changes_between_events(a.node);
                !taken
            };
        if fits {
            return Ok(());
        }
        let message =
            format!("the sides of this equation have different types: {} and {}", a.scalar.name(), b.scalar.name());
        self.report(
            Diagnostic::error(Code::TypeMismatch, message)
                .at(equation, "")
                .with(left.span, format!("this is {}", a.scalar.name()))
                .with(right.span, format!("this is {}", b.scalar.name())),
        );
        Err(Fail::Reported)
    }

    /// True if the node is a plain slot of a discrete variable (not of a parameter or a loop variable).
    pub(crate) fn is_discrete_ref(&self, typed: &Typed) -> bool {
        let Node::Slot(slot) = self.model.templates.arena.node(typed.node) else { return false };
        match &self.slots.keys[slot.0 as usize] {
            SlotKey::Variable(_, v, _) => self.variable_of(*v).variability >= Variability::Discrete,
            SlotKey::Number(_) | SlotKey::Quantity(_) => false,
        }
    }

    /// True for a variable that is discrete as far as its declaration says.
    pub(crate) fn is_discrete(&self, typed: &Typed) -> bool {
        let Node::Slot(slot) = self.model.templates.arena.node(typed.node) else { return false };
        match &self.slots.keys[slot.0 as usize] {
            SlotKey::Variable(Kind::Var, v, _) => self.variable_of(*v).variability == Variability::Discrete,
            _ => false,
        }
    }

    /// An equation whose sides are known before the run says nothing: a constant or parameter has its value from elsewhere.
    pub(crate) fn check_determines(
        &mut self,
        equation: Span,
        exprs: [&Expr; 2],
        sides: [&Typed; 2],
    ) -> Result<(), Fail> {
        let nodes = sides.map(|side| side.node);
        let arena = &self.model.templates.arena;
        let known = |key: &SlotKey| match key {
            SlotKey::Variable(Kind::Var, v, _) => self.variable_of(*v).variability <= Variability::Parameter,
            SlotKey::Variable(..) => false,
            SlotKey::Number(_) | SlotKey::Quantity(_) => true,
        };
        // Usually the first look finds what the equation determines.
        let unknown = |&node: &NodeId| match arena.node(node) {
            Node::Slot(slot) => !known(&self.slots.keys[slot.0 as usize]),
            _ => false,
        };
        if nodes.iter().any(unknown)
            || nodes.iter().any(|&node| hyd_symbolic::contains_time(arena, node))
            || !hyd_symbolic::slots(arena, &nodes).iter().all(|slot| known(&self.slots.keys[slot.0 as usize]))
        {
            return Ok(());
        }
        for expr in exprs {
            let Form::Variable(variable) = &expr.kind else { continue };
            let declared = &self.scopes.instances[variable.last()];
            let (kind, help) = match declared.variability {
                Declared::Constant => ("constant", "its value stands in the declaration or in a modification"),
                Declared::Parameter => (
                    "parameter",
                    "its value stands in the declaration or in a modification; one with `fixed = false` is determined by an `initial equation`",
                ),
                _ => continue,
            };
            let name = hyd_syntax::print_expr(&expr.written());
            let message = format!("`{name}` is a {kind}, which no equation of the run determines");
            let span = declared.span;
            self.report(
                Diagnostic::error(Code::Unbalanced, message).at(equation, "").with(span, "declared here").help(help),
            );
            return Err(Fail::Reported);
        }
        Ok(())
    }
}
