//! Functions: what they take and give, and their algorithms over typed statements.

use std::rc::Rc;
use std::sync::Arc;

use hyd_instance::modifier::AstMod;
use hyd_instance::shape::Shape;
use hyd_instance::{InstId, LocalClass};
use hyd_source::Span;
use hyd_syntax::tree::{self as text, ClassDef, Component, Direction, ExprKind, Ident, Name, Variability};

use crate::expression::{Callee, Expr, Kind};
use crate::statement::{Statement, StatementKind};
use crate::types::{Base, Type};
use crate::walk::{any_local, mentions, walk_statements};

/// What a call needs to know of a function.
#[derive(Debug)]
pub struct Signature {
    /// Scope of its text.
    pub inst: InstId,
    /// Inputs in their order.
    pub inputs: Vec<(Name, Type)>,
    /// Outputs in their order.
    pub outputs: Vec<(Name, Type)>,
}

/// The external clause of a function.
#[derive(Debug)]
pub struct External {
    /// The clause as written.
    pub text: text::External,
    /// What takes the value of the function.
    pub output: Option<Expr>,
    /// The arguments.
    pub arguments: Vec<Expr>,
}

impl External {
    /// The name of the function in its language; empty where the clause has not the form of the language.
    pub fn name(&self) -> &str {
        self.text.call.as_ref().map_or("", |call| &call.name.name)
    }
}

/// An input, output or variable of a function.
#[derive(Debug)]
pub struct Declaration {
    /// Its name.
    pub name: Ident,
    /// The frame its text belongs to.
    pub frame: u32,
    /// `input`, `output`
    pub direction: Option<Direction>,
    /// `constant`, `parameter`, or not.
    pub variability: Variability,
    /// Its type.
    pub ty: Type,
    /// Its sizes as declared.
    pub dims: Vec<Expr>,
    /// The value that the declaration gives.
    pub value: Option<Expr>,
    /// The declaration as written.
    pub text: Component,
}

impl Declaration {
    /// Declared as `v[:]`: the size is that of the value.
    pub fn is_sized_by_value(&self) -> bool {
        self.dims.iter().any(|dim| matches!(dim.kind, Kind::Colon))
    }

    /// A scalar or array of a predefined type, of an enumeration, or of a `type` that is one of them.
    pub fn is_simple(&self) -> bool {
        matches!(self.ty.base, Base::Scalar(_))
    }

    /// It keeps the value it begins with.
    pub fn is_fixed(&self) -> bool {
        self.variability <= Variability::Parameter
    }

    /// A scalar or array of Real, or of a `type` that is Real.
    pub fn is_real(&self) -> bool {
        self.ty.base == Base::Scalar(hyd_instance::ScalarType::Real)
    }
}

/// A function with all its declarations and statements.
#[derive(Debug)]
pub struct Function {
    /// Scope of its text.
    pub inst: InstId,
    /// The class.
    pub class: LocalClass,
    /// Its text.
    pub def: Arc<ClassDef>,
    /// The class with everything inherited.
    pub shape: Rc<Shape>,
    /// Inputs, outputs and variables in the order of the text.
    pub variables: Vec<Declaration>,
    /// Algorithms, each with the frame its text belongs to.
    pub algorithms: Vec<(u32, Vec<Statement>)>,
    /// An `external` clause.
    pub external: Option<External>,
    /// An equation, which a function cannot hold.
    pub equation: Option<Span>,
    /// Positions of all variables but the inputs, see [`Function::others`].
    pub(crate) order: Vec<usize>,
}

impl Function {
    /// Its name.
    pub fn name(&self) -> &Name {
        &self.def.name.name
    }

    /// The inputs in their order.
    pub fn inputs(&self) -> impl Iterator<Item = &Declaration> {
        self.variables.iter().filter(|v| v.direction == Some(Direction::Input))
    }

    /// The outputs in their order.
    pub fn outputs(&self) -> impl Iterator<Item = &Declaration> {
        self.variables.iter().filter(|v| v.direction == Some(Direction::Output))
    }

    /// All but the inputs, each behind those that its declaration reads.
    pub fn others(&self) -> impl Iterator<Item = &Declaration> {
        self.order.iter().map(|&k| &self.variables[k])
    }

    /// `annotation(GenerateEvents = true)`: relations inside cause events (Modelica 3.6, section 12.8).
    pub fn generates_events(&self) -> bool {
        let Some(annotation) = &self.def.annotation else { return false };
        let tree = AstMod::from_syntax(annotation);
        let said = tree.children.iter().find(|(name, _)| name.as_ref() == "GenerateEvents");
        let value = said.and_then(|(_, tree)| tree.binding.as_ref().map(|e| &e.kind));
        matches!(value, Some(ExprKind::Boolean(true)))
    }

    /// The derivatives that its annotation names (Modelica 3.6, section 12.7.1).
    pub fn derivatives(&self) -> Vec<Arc<AstMod>> {
        let Some(annotation) = &self.def.annotation else { return Vec::new() };
        let tree = AstMod::from_syntax(annotation);
        tree.children.into_iter().filter(|(name, _)| name.as_ref() == "derivative").map(|(_, tree)| tree).collect()
    }

    /// True if a variable or an output of it has a size that mentions the input.
    pub fn decides_sizes(&self, input: &Name) -> bool {
        self.sizing_names().iter().any(|(name, _)| name == input)
    }

    /// Names, and the fields of them, that sizes mention, and declared values of variables that sizes mention.
    fn sizing_names(&self) -> Vec<(Name, Option<Name>)> {
        let mut found: Vec<(Name, Option<Name>)> = Vec::new();
        let mut open: Vec<&Expr> = self.others().flat_map(|v| &v.dims).collect();
        while let Some(expr) = open.pop() {
            let mut new = Vec::new();
            any_local(expr, &mut |local| {
                let field = local.parts.get(1).map(|(field, _)| field.name.clone());
                let named = (local.name().clone(), field);
                if !found.contains(&named) {
                    new.push(named.0.clone());
                    found.push(named);
                }
                false
            });
            let of_new = |v: &&Declaration| new.contains(&v.name.name);
            open.extend(self.others().filter(of_new).filter_map(|v| v.value.as_ref()));
        }
        found
    }

    /// True if a declaration or a statement of it mentions the name.
    pub fn reads(&self, name: &Name) -> bool {
        let declared = |v: &Declaration| v.dims.iter().chain(&v.value).any(|expr| mentions(expr, name));
        let mut found = self.external.is_some() || self.variables.iter().any(declared);
        for (_, statements) in &self.algorithms {
            walk_statements(statements, &mut |expr| found |= mentions(expr, name), &mut |_| ());
        }
        found
    }

    /// The fields of an input that sizes of variables or outputs of it mention.
    pub fn sizing_fields(&self, input: &Name) -> Vec<Name> {
        self.sizing_names().into_iter().filter(|(name, _)| name == input).filter_map(|(_, field)| field).collect()
    }

    /// Whether a String is nothing but a text for people: it stands in messages, or goes to a function whose effect is outside of the
    /// model.  The inputs of other functions that it is handed on to, which must be no more than that; `None` if it is more.
    pub fn shows(&self, text: &Name) -> Option<Vec<HandedOn>> {
        let is_effect = |external: &External| hyd_instance::external::is_effect_only(external.name());
        let declared = self.variables.iter().filter_map(|v| v.value.as_ref()).any(|value| mentions(value, text));
        let mut handed = Vec::new();
        let shown = !declared
            && self.external.as_ref().is_none_or(is_effect)
            && self.algorithms.iter().all(|(_, statements)| only_shown(statements, text, &mut handed));
        shown.then_some(handed)
    }

    /// Variables of type String that are no inputs and no outputs.
    pub fn own_texts(&self) -> impl Iterator<Item = &Declaration> {
        let text = Base::Scalar(hyd_instance::ScalarType::Text);
        self.variables
            .iter()
            .filter(move |v| v.direction.is_none() && !v.is_fixed() && v.ty.base == text && v.ty.rank == 0)
    }

    /// True if a statement assigns to a variable, or to a part of it.
    pub fn assigns(&self, name: &Name) -> bool {
        self.algorithms.iter().any(|(_, statements)| assigns(statements, name))
    }

    /// What the first assignment to a variable as a whole gives it.
    pub fn first_value(&self, name: &Name) -> Option<&Expr> {
        self.algorithms.iter().find_map(|(_, statements)| first_assignment(statements, name))
    }
}

fn first_assignment<'f>(statements: &'f [Statement], name: &Name) -> Option<&'f Expr> {
    statements.iter().find_map(|statement| match &statement.kind {
        StatementKind::Assign(target, value) => match &target.kind {
            Kind::Local(local) => {
                let [(first, subscripts)] = local.parts.as_slice() else { return None };
                (subscripts.is_empty() && first.name == *name).then_some(value)
            }
            _ => None,
        },
        StatementKind::If(branches) => branches.iter().find_map(|(_, body)| first_assignment(body, name)),
        StatementKind::For(_, body) | StatementKind::While(_, body) => first_assignment(body, name),
        _ => None,
    })
}

fn assigns(statements: &[Statement], name: &Name) -> bool {
    let is_target = |target: &Expr| matches!(&target.kind, Kind::Local(local) if local.name() == name);
    statements.iter().any(|statement| match &statement.kind {
        StatementKind::Assign(target, _) => is_target(target),
        StatementKind::AssignTuple(targets, _) => targets.iter().flatten().any(is_target),
        StatementKind::If(branches) => branches.iter().any(|(_, body)| assigns(body, name)),
        StatementKind::For(_, body) | StatementKind::While(_, body) => assigns(body, name),
        _ => false,
    })
}

/// An input of another function that a text is handed on to.
#[derive(Clone, Debug)]
pub struct HandedOn {
    /// The function.
    pub function: LocalClass,
    /// Its input by position, or by name.
    pub input: Result<usize, Name>,
}

/// True if a name stands in texts of assertions only, in those of itself (`text := text + ...`), and in arguments of calls for their effect.
fn only_shown(statements: &[Statement], name: &Name, handed: &mut Vec<HandedOn>) -> bool {
    statements.iter().all(|statement| match &statement.kind {
        StatementKind::Assert(assertion) => !mentions(&assertion.condition, name),
        StatementKind::Assign(Expr { kind: Kind::Local(target), .. }, _) if target.name() == name => true,
        StatementKind::For(iterators, body) => {
            !iterators.iter().any(|own| mentions(&own.range, name)) && only_shown(body, name, handed)
        }
        StatementKind::While(condition, body) => !mentions(condition, name) && only_shown(body, name, handed),
        StatementKind::If(branches) => branches.iter().all(|(condition, body)| {
            !condition.as_ref().is_some_and(|condition| mentions(condition, name)) && only_shown(body, name, handed)
        }),
        StatementKind::Call(Expr { kind: Kind::Call(call), .. }) => {
            let Callee::Class(function) = &call.function else { return false };
            let positional = call.positional.iter().enumerate().map(|(k, given)| (Ok(k), given));
            let named = call.named.iter().map(|(input, given)| (Err(input.name.clone()), given));
            let own = positional.chain(named).filter(|(_, given)| mentions(given, name));
            handed.extend(own.map(|(input, _)| HandedOn { function: function.clone(), input }));
            true
        }
        _ => {
            let mut mentioned = false;
            walk_statements(std::slice::from_ref(statement), &mut |e| mentioned |= mentions(e, name), &mut |_| {});
            !mentioned
        }
    })
}
