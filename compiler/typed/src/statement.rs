//! Statements of algorithms, and equations, over typed expressions.

use std::rc::Rc;

use hyd_source::{Diagnostic, Span};

use crate::expression::{Expr, Iterator};

/// A statement.
#[derive(Clone, Debug)]
pub struct Statement {
    /// What it does.
    pub kind: StatementKind,
    /// Its text.
    pub span: Span,
}

/// What a statement does.
#[derive(Clone, Debug)]
pub enum StatementKind {
    /// `target := value`
    Assign(Expr, Expr),
    /// `(a, , b) := call`
    AssignTuple(Vec<Option<Expr>>, Expr),
    /// A call whose results are not taken.
    Call(Expr),
    /// `assert(condition, text)`
    Assert(Assertion),
    /// `terminate(text)`
    Terminate(Expr),
    /// `reinit(state, value)`
    Reinit(Expr, Expr),
    /// `if`; a branch without condition is `else`.
    If(Vec<(Option<Expr>, Vec<Statement>)>),
    /// `for`
    For(Vec<Iterator>, Vec<Statement>),
    /// `while`
    While(Expr, Vec<Statement>),
    /// `when`
    When(Vec<(Expr, Vec<Statement>)>),
    /// `break`
    Break,
    /// `return`
    Return,
    /// What has no meaning, and why: said where it is reached.
    Failed(Rc<[Diagnostic]>),
}

/// What an `assert` says.
#[derive(Clone, Debug)]
pub struct Assertion {
    /// What must hold.
    pub condition: Expr,
    /// The message.
    pub text: Expr,
    /// An error, not a warning.
    pub error: bool,
}

/// An equation.
#[derive(Clone, Debug)]
pub struct Equation {
    /// What it says.
    pub kind: EquationKind,
    /// Its text.
    pub span: Span,
}

/// What an equation says.
#[derive(Clone, Debug)]
pub enum EquationKind {
    /// `left = right`
    Equal(Expr, Expr),
    /// An equation between records, taken apart: one for each field.
    Fields(Vec<Equation>),
    /// `(a, , b) = call`
    Outputs(Vec<Option<Expr>>, Expr),
    /// `connect(a, b)`
    Connect(Expr, Expr),
    /// What `Connections` has to say of overdetermined records.
    Overdetermined(Overdetermined),
    /// `for`
    For(Vec<Iterator>, Vec<Equation>),
    /// `if`; a branch without condition is `else`.
    If(Vec<(Option<Expr>, Vec<Equation>)>),
    /// `when`
    When(Vec<(Expr, Vec<Equation>)>),
    /// `assert(condition, text)`
    Assert(Assertion),
    /// `terminate(text)`
    Terminate(Expr),
    /// `reinit(state, value)`
    Reinit(Expr, Expr),
    /// A call whose results are not taken.
    Call(Expr),
    /// What has no meaning, and why: said where it is reached.
    Failed(Rc<[Diagnostic]>),
}

/// What is said of overdetermined records, which connections must not determine twice (Modelica 3.6, section 9.4.1).
#[derive(Clone, Debug)]
pub enum Overdetermined {
    /// `Connections.branch(a, b)`: equations of the component relate the two.
    Branch(Expr, Expr),
    /// `Connections.root(a)`: the component determines it.
    Root(Expr),
    /// `Connections.potentialRoot(a, priority)`: the component can determine it; the lowest priority does where nobody else does.
    PotentialRoot(Expr, i64),
}
