//! Where the units of an equation do not fit: another variable in the place of one, a power that is missing or too much, a product for a
//! quotient.

use hyd_syntax::tree::{Arguments, BinaryOp, Expr, ExprKind};
use hyd_syntax::visit::{Visitor, walk_expr};

use super::{Found, Rank, is_named, number};

/// Variables that are tried in the place of one.
const MOST_OTHERS: usize = 20;

impl Found<'_> {
    /// Changes of quantities in one side of an equation.
    pub(super) fn other_quantities(&mut self, side: &Expr) {
        struct Quantities<'a, 'b>(&'a mut Found<'b>);
        impl Visitor for Quantities<'_, '_> {
            fn expr(&mut self, expr: &Expr) {
                self.0.other_quantity(expr);
                let is_power = matches!(expr.kind, ExprKind::Binary(BinaryOp::Pow, ..));
                let is_before =
                    matches!(&expr.kind, ExprKind::Call(function, Arguments::List { .. }) if is_named(function, "pre"));
                if !is_power && !is_before {
                    walk_expr(self, expr);
                }
            }
        }
        Quantities(self).expr(side);
    }

    fn other_quantity(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Ref(of) if of.parts.len() == 1 && of.parts[0].subscripts.is_empty() => {
                let name = of.parts[0].name.name.to_string();
                if !self.quantities.contains(&name) {
                    return;
                }
                let others = self.quantities.iter().filter(|own| **own != name).take(MOST_OTHERS);
                for other in others.cloned().collect::<Vec<_>>() {
                    self.write(Rank::Quantity, expr.span, &other);
                }
                self.write(Rank::Quantity, expr.span, &format!("{name}^2"));
            }
            ExprKind::Binary(BinaryOp::Pow, base, power) if number(power).is_some() => {
                let base = self.snippet(base.span).to_string();
                self.write(Rank::Quantity, expr.span, &base);
            }
            ExprKind::Binary(op @ (BinaryOp::Mul | BinaryOp::Div), a, b) => {
                let other = if *op == BinaryOp::Mul { "/" } else { "*" };
                let text = format!("{}{other}{}", self.snippet(a.span), self.snippet(b.span));
                self.write(Rank::Quantity, expr.span, &text);
            }
            _ => {}
        }
    }
}
