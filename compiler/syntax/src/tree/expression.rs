//! Expressions of the syntax tree: references, calls, literals, operators (Modelica 3.6, appendix A.2.7).

use hyd_source::Span;

use super::{Ident, Iterator, Name};

/// A reference to a component or class: `a[1].b.c[i, :]`.
#[derive(Clone, Debug)]
pub struct ComponentRef {
    /// Starts with a dot.
    pub global: bool,
    /// The parts, at least one.
    pub parts: Vec<RefPart>,
    /// The whole reference.
    pub span: Span,
}

/// One part of a reference.
#[derive(Clone, Debug)]
pub struct RefPart {
    /// Name.
    pub name: Ident,
    /// Subscripts, empty if none.
    pub subscripts: Vec<Expr>,
}

/// Arguments of a call.
#[derive(Clone, Debug)]
pub enum Arguments {
    /// `f(a, b, c = d)`
    List {
        /// Positional arguments.
        positional: Vec<Expr>,
        /// Named arguments.
        named: Vec<(Ident, Expr)>,
    },
    /// `f(e for i in r)`
    Reduction(Box<Expr>, Vec<Iterator>),
}

/// An expression.
#[derive(Clone, Debug)]
pub struct Expr {
    /// What it says.
    pub kind: ExprKind,
    /// Its place.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Clone, Debug)]
pub enum ExprKind {
    /// `42`: an unsigned integer literal.
    Integer(i64),
    /// `1.5e3`: an unsigned real literal.
    Real(f64),
    /// `"text"`, unescaped.
    Text(Name),
    /// `true`, `false`
    Boolean(bool),
    /// A reference; also `time`.
    Ref(ComponentRef),
    /// A call; `der`, `initial`, `pure` and operators with special meaning are calls too.
    Call(ComponentRef, Arguments),
    /// `function f(a = 1)`: a function with some of its inputs given, as an argument of a call.
    Partial(ComponentRef, Vec<(Ident, Expr)>),
    /// `-a`, `+a`, `not a` and the element-wise signs.
    Unary(UnaryOp, Box<Expr>),
    /// `a + b` and so on.
    Binary(BinaryOp, Box<Expr>, Box<Expr>),
    /// `if c then a elseif d then b else e`
    If(Vec<(Expr, Expr)>, Box<Expr>),
    /// `a : b` or `a : step : b` (start, step, stop).
    Range(Box<Expr>, Option<Box<Expr>>, Box<Expr>),
    /// `{a, b}`
    Array(Vec<Expr>),
    /// `{e for i in r}`
    ArrayFor(Box<Expr>, Vec<Iterator>),
    /// `[a, b; c, d]`
    Matrix(Vec<Vec<Expr>>),
    /// `(a, b)` as a result list; one element in parentheses is just that element.
    Tuple(Vec<Option<Expr>>),
    /// One field of a record expression; never written, made where record bindings and equations are taken apart.
    Field(Box<Expr>, Ident),
    /// `:` as a subscript or array size.
    Colon,
    /// `end` in a subscript.
    End,
}

impl Expr {
    /// A number as it could stand in the text.
    pub fn number(value: f64, span: Span) -> Self {
        let size = Expr { kind: ExprKind::Real(value.abs()), span };
        match value.is_sign_negative() {
            true => Expr { kind: ExprKind::Unary(UnaryOp::Minus, Box::new(size)), span },
            false => size,
        }
    }

    /// What a string literal says; none for any other expression.
    pub fn text(&self) -> Option<&Name> {
        match &self.kind {
            ExprKind::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// Unary operators.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UnaryOp {
    /// `-`
    Minus,
    /// `+`
    Plus,
    /// `not`
    Not,
}

/// Binary operators.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BinaryOp {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `^`
    Pow,
    /// `.+`
    ElementAdd,
    /// `.-`
    ElementSub,
    /// `.*`
    ElementMul,
    /// `./`
    ElementDiv,
    /// `.^`
    ElementPow,
    /// `==`
    Equal,
    /// `<>`
    NotEqual,
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `and`
    And,
    /// `or`
    Or,
}

impl BinaryOp {
    /// The name of the function that an operator record declares for it (Modelica 3.6, section 14.5).
    pub fn function_name(self) -> &'static str {
        match self {
            BinaryOp::Add | BinaryOp::ElementAdd => "'+'",
            BinaryOp::Sub | BinaryOp::ElementSub => "'-'",
            BinaryOp::Mul | BinaryOp::ElementMul => "'*'",
            BinaryOp::Div | BinaryOp::ElementDiv => "'/'",
            BinaryOp::Pow | BinaryOp::ElementPow => "'^'",
            BinaryOp::Equal => "'=='",
            BinaryOp::NotEqual => "'<>'",
            BinaryOp::Less => "'<'",
            BinaryOp::LessEqual => "'<='",
            BinaryOp::Greater => "'>'",
            BinaryOp::GreaterEqual => "'>='",
            BinaryOp::And => "'and'",
            BinaryOp::Or => "'or'",
        }
    }

    /// True for the operators with a dot, which are for elements (section 10.6.3).
    pub fn is_element_by_element(self) -> bool {
        use BinaryOp::{ElementAdd, ElementDiv, ElementMul, ElementPow, ElementSub};
        matches!(self, ElementAdd | ElementSub | ElementMul | ElementDiv | ElementPow)
    }
}
