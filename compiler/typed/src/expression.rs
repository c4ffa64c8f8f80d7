//! Expressions with every name resolved and every type known.

use std::rc::Rc;
use std::sync::Arc;

use hyd_instance::{Builtin, EnumType, InstId, LocalClass, Scope};
use hyd_source::{Diagnostic, Span};
use hyd_syntax::tree::{self as text, Arguments, BinaryOp, ComponentRef, ExprKind, Ident, Name, UnaryOp};

use crate::types::Type;

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it is.
    pub kind: Kind,
    /// Its type.
    pub ty: Type,
    /// Its text.
    pub span: Span,
}

/// What an expression is.
#[derive(Clone, Debug)]
pub enum Kind {
    /// A number without point.
    Integer(i64),
    /// A number with point or exponent.
    Real(f64),
    /// `true`, `false`
    Boolean(bool),
    /// A String.
    Text(Name),
    /// A literal of an enumeration, counted from 1.
    Literal(Arc<EnumType>, u32, Rc<ComponentRef>),
    /// All values of an enumeration, or of Boolean, as a range or a size.
    Values(Option<Arc<EnumType>>, Rc<ComponentRef>),
    /// `time`
    Time,
    /// A variable, parameter or constant of the model or of a package, or a component.
    Variable(Variable),
    /// A variable of a function, or of a loop.
    Local(Local),
    /// A function or operator of the language.
    Builtin(Builtin, Vec<Expr>),
    /// `String(x, ...)`: the value, and all arguments as written.
    Format(Box<Expr>, Rc<Arguments>),
    /// `sum(... for ...)` and the like.
    Reduction(Builtin, Box<Expr>, Vec<Iterator>),
    /// A call of a user's function.
    Call(Box<Call>),
    /// `function f(a = 1)`: a function with inputs given by name.
    Function(Box<Call>),
    /// A call of the constructor of a record.
    Record(Box<Construction>),
    /// An operator with one operand.
    Unary(UnaryOp, Box<Expr>),
    /// An operator with two operands.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `if c then a elseif d then b else e`
    If(Vec<(Expr, Expr)>, Box<Expr>),
    /// `a:s:b`
    Range(Box<Expr>, Option<Box<Expr>>, Box<Expr>),
    /// `{a, b}`
    Array(Vec<Expr>),
    /// `{e for i in range}`
    ArrayFor(Box<Expr>, Vec<Iterator>),
    /// `[a, b; c, d]`
    Matrix(Vec<Vec<Expr>>),
    /// Several results, some left out.
    Tuple(Vec<Option<Expr>>),
    /// One field of a record that has no name of its own.
    Field(Box<Expr>, Ident),
    /// `:` as a subscript or size.
    Colon,
    /// `end` in a subscript.
    End,
    /// A class, where a value is needed or a function is named.
    Class(Box<LocalClass>, Rc<ComponentRef>),
    /// What has no meaning, and why: said where its value is needed, which a branch that is not taken never is.
    Failed(Rc<[Diagnostic]>, Rc<text::Expr>),
}

/// A component that a reference names.
#[derive(Clone, Debug)]
pub struct Variable {
    /// The components from the outermost named one inwards, each with the subscripts written there.
    pub steps: Vec<(InstId, Vec<Expr>)>,
    /// The text.
    pub reference: Rc<ComponentRef>,
}

impl Variable {
    /// The component itself.
    pub fn last(&self) -> InstId {
        self.steps[self.steps.len() - 1].0
    }

    /// True if no subscripts are written.
    pub fn is_whole(&self) -> bool {
        self.steps.iter().all(|(_, subscripts)| subscripts.is_empty())
    }
}

/// A local name with the fields and subscripts behind it.
#[derive(Clone, Debug)]
pub struct Local {
    /// The name and its fields, each with the subscripts written there.
    pub parts: Vec<(Ident, Vec<Expr>)>,
    /// The text.
    pub reference: Rc<ComponentRef>,
}

impl Local {
    /// The name.
    pub fn name(&self) -> &Name {
        &self.parts[0].0.name
    }
}

/// Which function is called.
#[derive(Clone, Debug)]
pub enum Callee {
    /// One that is declared.
    Class(LocalClass),
    /// The value of an input of the function around.
    Local(Local),
}

/// A call of a user's function.
#[derive(Clone, Debug)]
pub struct Call {
    /// The function.
    pub function: Callee,
    /// Its name as written.
    pub name: Rc<ComponentRef>,
    /// Arguments by position.
    pub positional: Vec<Expr>,
    /// Arguments by name.
    pub named: Vec<(Ident, Expr)>,
}

/// A call of the constructor of a record.  Which fields its arguments are is found out with their values, as defaults may stand in
/// other scopes.
#[derive(Clone, Debug)]
pub struct Construction {
    /// The record.
    pub record: LocalClass,
    /// Its name as written.
    pub name: Rc<ComponentRef>,
    /// The arguments as written.
    pub arguments: Rc<Arguments>,
    /// The same typed, for who wants to know what they read.
    pub given: Vec<Expr>,
    /// Where they are looked up.
    pub scope: Scope,
}

/// A loop variable and its values.
#[derive(Clone, Debug)]
pub struct Iterator {
    /// The variable.
    pub name: Ident,
    /// Its values.
    pub range: Expr,
}

impl Iterator {
    fn text(&self, purpose: For) -> text::Iterator {
        text::Iterator { name: self.name.clone(), range: Some(self.range.text(purpose)) }
    }
}

/// What a text made from an expression is for.
#[derive(Clone, Copy, PartialEq)]
enum For {
    /// To be read by people.
    People,
    /// To be evaluated in the scope that it was typed in.  Functions of the language have a leading dot, as a declaration there may
    /// hide their names.
    Evaluation,
}

fn all(list: &[Expr], purpose: For) -> Vec<text::Expr> {
    list.iter().map(|e| e.text(purpose)).collect()
}

fn boxed(expr: &Expr, purpose: For) -> Box<text::Expr> {
    Box::new(expr.text(purpose))
}

impl Expr {
    /// The expression inside parentheses.
    pub fn bare(&self) -> &Expr {
        match &self.kind {
            Kind::Tuple(items) => match items.as_slice() {
                [Some(only)] => only.bare(),
                _ => self,
            },
            _ => self,
        }
    }

    /// The variable that the expression is.
    pub fn variable(&self) -> Option<&Variable> {
        match &self.kind {
            Kind::Variable(variable) => Some(variable),
            _ => None,
        }
    }

    /// The expression as it is written, for messages.
    pub fn written(&self) -> text::Expr {
        self.text(For::People)
    }

    /// The expression as a text whose value can be asked for in its scope.
    pub fn evaluable(&self) -> text::Expr {
        self.text(For::Evaluation)
    }

    fn text(&self, purpose: For) -> text::Expr {
        let of_language = |name: &str| {
            let hidden = Builtin::from_name(name).is_some_and(Builtin::can_be_hidden);
            ComponentRef { global: hidden && purpose == For::Evaluation, ..named(name, self.span) }
        };
        let call = |name: ComponentRef, list: &[Expr]| {
            ExprKind::Call(name, Arguments::List { positional: all(list, purpose), named: Vec::new() })
        };
        let kind = match &self.kind {
            Kind::Integer(k) => ExprKind::Integer(*k),
            Kind::Real(x) => ExprKind::Real(*x),
            Kind::Boolean(b) => ExprKind::Boolean(*b),
            Kind::Text(text) => ExprKind::Text(text.clone()),
            Kind::Literal(.., name) | Kind::Values(_, name) | Kind::Class(_, name) => {
                ExprKind::Ref(ComponentRef::clone(name))
            }
            Kind::Variable(variable) => ExprKind::Ref(ComponentRef::clone(&variable.reference)),
            Kind::Local(local) => ExprKind::Ref(ComponentRef::clone(&local.reference)),
            Kind::Time => ExprKind::Ref(named("time", self.span)),
            Kind::Builtin(builtin, list) => call(of_language(builtin.name()), list),
            Kind::Format(_, arguments) => ExprKind::Call(of_language("String"), Arguments::clone(arguments)),
            Kind::Reduction(builtin, body, iterators) => {
                let iterators = iterators.iter().map(|i| i.text(purpose)).collect();
                ExprKind::Call(of_language(builtin.name()), Arguments::Reduction(boxed(body, purpose), iterators))
            }
            Kind::Call(call) => {
                let named = call.named.iter().map(|(name, expr)| (name.clone(), expr.text(purpose))).collect();
                let arguments = Arguments::List { positional: all(&call.positional, purpose), named };
                ExprKind::Call(ComponentRef::clone(&call.name), arguments)
            }
            Kind::Function(call) => {
                let given = call.named.iter().map(|(name, expr)| (name.clone(), expr.text(purpose))).collect();
                ExprKind::Partial(ComponentRef::clone(&call.name), given)
            }
            Kind::Record(made) => ExprKind::Call(ComponentRef::clone(&made.name), Arguments::clone(&made.arguments)),
            Kind::Unary(op, a) => ExprKind::Unary(*op, boxed(a, purpose)),
            Kind::Binary(op, a, b) => ExprKind::Binary(*op, boxed(a, purpose), boxed(b, purpose)),
            Kind::If(branches, otherwise) => {
                let branches = branches.iter().map(|(c, e)| (c.text(purpose), e.text(purpose))).collect();
                ExprKind::If(branches, boxed(otherwise, purpose))
            }
            Kind::Range(a, step, b) => {
                ExprKind::Range(boxed(a, purpose), step.as_deref().map(|e| boxed(e, purpose)), boxed(b, purpose))
            }
            Kind::Array(items) => ExprKind::Array(all(items, purpose)),
            Kind::ArrayFor(body, iterators) => {
                ExprKind::ArrayFor(boxed(body, purpose), iterators.iter().map(|i| i.text(purpose)).collect())
            }
            Kind::Matrix(rows) => ExprKind::Matrix(rows.iter().map(|row| all(row, purpose)).collect()),
            Kind::Tuple(items) => ExprKind::Tuple(items.iter().map(|e| e.as_ref().map(|e| e.text(purpose))).collect()),
            Kind::Field(record, name) => ExprKind::Field(boxed(record, purpose), name.clone()),
            Kind::Colon => ExprKind::Colon,
            Kind::End => ExprKind::End,
            Kind::Failed(_, text) => text.kind.clone(),
        };
        text::Expr { kind, span: self.span }
    }
}

fn named(name: &str, span: Span) -> ComponentRef {
    let part = text::RefPart { name: Ident { name: name.into(), span }, subscripts: Vec::new() };
    ComponentRef { global: false, parts: vec![part], span }
}
