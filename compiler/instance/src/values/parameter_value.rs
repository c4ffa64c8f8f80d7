//! Values of parameters and constants at translation, each computed once, when it is asked for.
//!
//! Circles of parameters end in a message that shows the way round (Modelica 3.6, section 4.4.4).
//!
//! A parameter with `fixed = false` is found at the start (section 8.6).  Where it decides a size or a subscript and an initial algorithm of
//! its component computes it from parameters and constants alone, as the place of a name in a list of names, the algorithm is
//! run here; it stays in the model and gives the same value at the start.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{
    AlgorithmSection, BinaryOp, ClassBody, Expr, ExprKind, Name, Statement, StatementKind, Variability,
};

use crate::classes::modifier::Applied;
use crate::instantiation::instance::{InstId, ScalarType, Scope, full_dims, path};
use crate::instantiation::scopes::{Known, Scopes};
use crate::values::evaluate::Env;
use crate::values::override_value::read_value;
use crate::values::value::{Value, widen};

impl Scopes<'_> {
    /// The value of a parameter or constant: sizes of the arrays its binding is spread over first, own sizes after.
    pub fn value_of(&mut self, inst: InstId, span: Span) -> Result<Value, Reported> {
        match self.known.get(&inst) {
            Some(Known::Yes(value)) => return Ok(value.clone()),
            Some(Known::Open) => return Err(self.value_circle(inst, span)),
            _ if self.has_failed(inst) => return Err(Reported),
            _ => {}
        }
        self.known.insert(inst, Known::Open);
        self.open_values.push((inst, span));
        let value = self.compute(inst, span);
        self.open_values.pop();
        let known = value.clone().map_or(Known::Failed, Known::Yes);
        self.known.insert(inst, known);
        if let Some(guessed) = &mut self.guessed {
            guessed.push(inst);
        }
        value
    }

    /// A value that is needed to compute itself, with those on the way.
    fn value_circle(&mut self, inst: InstId, span: Span) -> Reported {
        let start = self.open_values.iter().position(|(open, _)| *open == inst).unwrap_or(0);
        let way: Vec<(InstId, Span)> = self.open_values[start..].to_vec();
        let name = path(&self.instances, inst);
        let declared = self.instances[inst].span;
        let message = format!("the value of `{name}` depends on itself");
        let mut diagnostic =
            Diagnostic::error(Code::CircularParameters, message).at(span, "").with(declared, "declared here");
        if way.len() > 1 {
            let mut chain: Vec<String> =
                way.iter().map(|(open, _)| format!("`{}`", path(&self.instances, *open))).collect();
            chain.push(format!("`{name}`"));
            for (_, needed) in way.iter().skip(1).filter(|(_, needed)| *needed != span) {
                diagnostic = diagnostic.with(*needed, "on the way");
            }
            diagnostic = diagnostic.help(format!("each needs the next: {}", chain.join(", ")));
        }
        self.table.report(diagnostic);
        Reported
    }

    fn compute(&mut self, inst: InstId, span: Span) -> Result<Value, Reported> {
        let name = path(&self.instances, inst);
        let instance = &self.instances[inst];
        let Some(primitive) = &instance.primitive else {
            if self.is_broken(inst) {
                return Err(Reported);
            }
            return Err(self.not_structural(span, format!("`{name}` is a component, not a value")));
        };
        if self.variability(inst) > Variability::Parameter {
            let declared = instance.span;
            // No variable of the run is a String: it only lacks the word `parameter`.
            let text = matches!(primitive.scalar, ScalarType::Text);
            let (message, help) = match text {
                true => {
                    (format!("the String `{name}` is not a parameter"), Some("write `parameter String`".to_string()))
                }
                false => (format!("`{name}` changes during the run"), None),
            };
            self.table.report(
                Diagnostic::error(Code::NotStructural, message)
                    .at(span, "needed before the run")
                    .with(declared, "declared here")
                    .maybe_help(help),
            );
            return Err(Reported);
        }
        if self.guessed.is_none() && self.is_free(inst) {
            let value = self.value_by_initial_algorithm(inst);
            return value.ok_or_else(|| self.found_at_start(inst, span));
        }
        let instance = &self.instances[inst];
        let Some(primitive) = &instance.primitive else { return Err(Reported) };
        let integer = matches!(primitive.scalar, ScalarType::Integer);
        let real = matches!(primitive.scalar, ScalarType::Real);
        let declared = instance.span;
        if let Some(known) = self.override_of(inst) {
            self.overrides[known].used |= self.guessed.is_none();
            let text = self.overrides[known].text.clone();
            return match read_value(&primitive.scalar, &text, &instance.dims, &self.sizes_as_written(inst)) {
                Ok(value) => {
                    let value = self.given_value_of(inst, value, span)?;
                    Ok(if real { widen(value) } else { value })
                }
                Err(reason) => {
                    let message = format!("`{name}` cannot be set to `{text}`: {reason}");
                    self.table.report(Diagnostic::error(Code::Value, message).with(declared, "declared here"));
                    Err(Reported)
                }
            };
        }
        if self.guessed.is_none() && self.is_set_by_element(inst) {
            return Err(self.set_by_element(inst, span));
        }
        let instance = &self.instances[inst];
        let Some(primitive) = &instance.primitive else { return Err(Reported) };
        let start = primitive.attributes.iter().find(|(n, _)| n.as_ref() == "start").map(|(_, a)| a.clone());
        let Some(applied) = primitive.binding.clone().or(start) else {
            let declared = instance.span;
            let own = instance.dims.clone();
            if full_dims(&self.instances, inst).contains(&0) {
                // Nobody asks for the value of an element that does not exist.
                return Ok(Value::filled(Value::Real(0.0), &own));
            }
            let message = Diagnostic::error(Code::NoValue, format!("the parameter `{name}` has no value"));
            let message = match self.users_line(inst) {
                Some(component) => message.at(component, "of this component").with(span, "needed here"),
                None => message.at(span, "needed here"),
            };
            self.table.report(message.with(declared, "declared here"));
            return Err(Reported);
        };
        let value = self.evaluate_applied(&applied)?;
        if integer && value.flatten().iter().any(|v| matches!(v, Value::Real(_))) {
            let binding = applied.tree.binding.as_ref();
            let place = binding.map_or(span, |b| b.span);
            let message = format!("`{name}` is an Integer and cannot take a Real value");
            let said = Diagnostic::error(Code::TypeMismatch, message).at(place, "");
            let said = match binding.map(|binding| &binding.kind) {
                Some(ExprKind::Binary(BinaryOp::Div, ..)) => {
                    said.help("`/` gives a Real: `div(a, b)` is the quotient of integers")
                }
                _ => said,
            };
            self.table.report(said);
            return Err(Reported);
        }
        Ok(if real { widen(value) } else { value })
    }

    /// The value of a parameter that an initial algorithm sets, if that can be said before the run; nothing is reported.
    fn value_by_initial_algorithm(&mut self, inst: InstId) -> Option<Value> {
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

    /// The value a modification gives, in its own scope.
    pub fn evaluate_applied(&mut self, applied: &Applied) -> Result<Value, Reported> {
        match &applied.tree.binding {
            Some(expr) if self.is_for_parts(applied) => self.value_for_parts(&expr.clone(), applied),
            Some(expr) => self.evaluate(&expr.clone(), applied.scope, &Env::default()),
            None => Err(Reported),
        }
    }

    /// Of the value that a modification gives to all elements: what it is for the parts in `spread`.  A value without the sizes of
    /// the array is left as it is.
    fn value_for_parts(&mut self, expr: &Arc<Expr>, applied: &Applied) -> Result<Value, Reported> {
        // Computed once for all of them, if it is not only a guess.
        let place = (Arc::as_ptr(expr) as usize, applied.scope);
        let known = self.values_for_parts.get(&place).filter(|_| self.guessed.is_none());
        let value = match known {
            Some((_, value)) => value.clone(),
            None => self.evaluate(expr, applied.scope, &Env::default())?,
        };
        if self.guessed.is_none() {
            self.values_for_parts.insert(place, (expr.clone(), value.clone()));
        }
        if value.shape().is_empty() {
            return Ok(value);
        }
        self.taken_apart(value, &applied.spread, expr.span)
    }

    /// The value a modification gives with the parameters as they are at translation, which it does not fix: good for what is
    /// no more than a scale, such as `nominal`.
    pub fn guess_applied(&mut self, applied: &Applied) -> Result<Value, Reported> {
        self.guess(|scopes| scopes.evaluate_applied(applied)).0
    }

    /// The value of a parameter or constant with the parameters as they are at translation, which it does not fix, and those that were
    /// taken for it.
    pub fn guess_value(&mut self, inst: InstId, span: Span) -> (Result<Value, Reported>, Vec<InstId>) {
        self.guess(|scopes| scopes.value_of(inst, span))
    }

    /// An answer that fixes no parameter, and the parameters that it takes.
    fn guess<T>(&mut self, question: impl FnOnce(&mut Self) -> T) -> (T, Vec<InstId>) {
        let outer = self.guessed.replace(Vec::new());
        let answer = question(self);
        let taken = std::mem::replace(&mut self.guessed, outer).unwrap_or_default();
        for inst in &taken {
            if !matches!(self.known.get(inst), Some(Known::Open)) {
                self.known.remove(inst);
            }
        }
        (answer, taken)
    }

    /// True for a parameter with `fixed = false`, or of whose elements one has it.
    pub fn is_free(&mut self, inst: InstId) -> bool {
        if self.variability(inst) != Variability::Parameter {
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
