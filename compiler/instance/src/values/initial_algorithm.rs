//! Parameters that an initial algorithm sets from nothing but what is known at translation.
//!
//! A parameter with `fixed = false` is found at the start (Modelica 3.6, section 8.6).  Where it decides a size or a subscript and an
//! initial algorithm of its component computes it from parameters and constants alone, as the place of a name in a list of names,
//! the algorithm is run here; it stays in the model and gives the same value at the start.

use hyd_syntax::tree::{AlgorithmSection, ClassBody, Name, Statement, StatementKind};

use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::scopes::Scopes;
use crate::values::evaluate::Env;
use crate::values::value::Value;

impl Scopes<'_> {
    /// The value of a parameter that an initial algorithm sets, if that can be said before the run; nothing is reported.
    pub(crate) fn value_by_initial_algorithm(&mut self, inst: InstId) -> Option<Value> {
        let instance = &self.instances[inst];
        let (parent, name) = (instance.parent?, instance.name.clone());
        if !instance.dims.is_empty() {
            return None;
        }
        let class = self.instances[parent].class?;
        let shape = self.table.shape(class).ok()?;
        for frame in 0..shape.frames.len() as u32 {
            let def = shape.def(&self.table, frame).clone();
            let ClassBody::Long { algorithms, .. } = &def.body else { continue };
            let Some(section) = algorithms.iter().find(|section| section.initial && sets(&section.statements, &name))
            else {
                continue;
            };
            return self.run_quietly(section, Scope { inst: parent, frame }, &name);
        }
        None
    }

    fn run_quietly(&mut self, section: &AlgorithmSection, scope: Scope, name: &Name) -> Option<Value> {
        let mut env = Env::default();
        let run = self.quietly(|scopes| scopes.run_statements(&section.statements, scope, &mut env));
        run.ok()?;
        env.names.into_iter().rev().find(|(known, _)| known == name).map(|(_, value)| value)
    }
}

/// Whether a variable is set as a whole somewhere in these statements.
fn sets(statements: &[Statement], name: &Name) -> bool {
    statements.iter().any(|statement| match &statement.kind {
        StatementKind::Assign(target, _) => {
            matches!(target.parts.as_slice(), [only] if only.name.name == *name && only.subscripts.is_empty())
        }
        StatementKind::If(branches) => branches.iter().any(|(_, body)| sets(body, name)),
        StatementKind::For(_, body) | StatementKind::While(_, body) => sets(body, name),
        _ => false,
    })
}
