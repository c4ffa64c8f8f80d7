//! Variables that a `when` sets: they change at events only, wherever in the text they are asked for (Modelica 3.6, section 4.5.3).

use hyd_syntax::tree::{
    ClassBody, ComponentRef, Equation, EquationKind, Expr, ExprKind, Name, Statement, StatementKind,
};

use crate::instantiation::instance::InstId;
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// True if the class around a component, or one that it inherits from, sets it in a `when`.
    pub fn is_set_in_when(&self, inst: InstId) -> bool {
        let instance = &self.instances[inst];
        let Some(shape) = instance.parent.and_then(|parent| self.instances[parent].shape.as_ref()) else {
            return false;
        };
        (0..shape.frames.len() as u32).any(|frame| match &shape.def(&self.table, frame).body {
            ClassBody::Long { equations, algorithms, .. } => {
                equations.iter().any(|section| by_equations(&section.equations, &instance.name, false))
                    || algorithms.iter().any(|section| by_statements(&section.statements, &instance.name, false))
            }
            _ => false,
        })
    }
}

fn is_named(reference: &ComponentRef, name: &Name) -> bool {
    matches!(reference.parts.as_slice(), [only] if only.name.name == *name)
}

fn sets(target: &Expr, name: &Name) -> bool {
    match &target.kind {
        ExprKind::Ref(reference) => is_named(reference, name),
        ExprKind::Tuple(parts) => parts.iter().flatten().any(|part| sets(part, name)),
        _ => false,
    }
}

fn by_equations(equations: &[Equation], name: &Name, inside: bool) -> bool {
    equations.iter().any(|equation| match &equation.kind {
        EquationKind::Equal(left, _) => inside && sets(left, name),
        EquationKind::For(_, body) => by_equations(body, name, inside),
        EquationKind::If(branches) => branches.iter().any(|(_, body)| by_equations(body, name, inside)),
        EquationKind::When(branches) => branches.iter().any(|(_, body)| by_equations(body, name, true)),
        EquationKind::Connect(..) | EquationKind::Call(..) => false,
    })
}

fn by_statements(statements: &[Statement], name: &Name, inside: bool) -> bool {
    statements.iter().any(|statement| match &statement.kind {
        StatementKind::Assign(target, _) => inside && is_named(target, name),
        StatementKind::AssignTuple(targets, ..) => {
            inside && targets.iter().flatten().any(|target| is_named(target, name))
        }
        StatementKind::If(branches) => branches.iter().any(|(_, body)| by_statements(body, name, inside)),
        StatementKind::For(_, body) | StatementKind::While(_, body) => by_statements(body, name, inside),
        StatementKind::When(branches) => branches.iter().any(|(_, body)| by_statements(body, name, true)),
        StatementKind::Call(..) | StatementKind::Break | StatementKind::Return => false,
    })
}
