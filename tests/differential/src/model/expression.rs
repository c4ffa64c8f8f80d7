//! Expressions of a model.

use super::{ComponentId, Id};

/// A subscript.
#[derive(Clone, PartialEq, Debug)]
pub enum Subscript {
    /// One element.
    At(Expr),
    /// `a:b` or `a:s:b`.
    Slice(Box<Range>),
    /// `:`
    All,
}

/// `from:step:to`; a step of 1 is not written.
#[derive(Clone, PartialEq, Debug)]
pub struct Range {
    /// First value.
    pub from: Expr,
    /// Step, if not 1.
    pub step: Option<i64>,
    /// Last value at most.
    pub to: Expr,
}

/// Operators of two operands that are written between them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    MultiplyEach,
    DivideEach,
    PowerEach,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    And,
    Or,
}

impl Operator {
    /// Those that compare an order.
    pub const ORDERS: [Operator; 4] = [Operator::Less, Operator::LessEqual, Operator::Greater, Operator::GreaterEqual];

    /// As it is written.
    pub fn text(self) -> &'static str {
        match self {
            Operator::Add => "+",
            Operator::Subtract => "-",
            Operator::Multiply => "*",
            Operator::Divide => "/",
            Operator::Power => "^",
            Operator::MultiplyEach => ".*",
            Operator::DivideEach => "./",
            Operator::PowerEach => ".^",
            Operator::Less => "<",
            Operator::LessEqual => "<=",
            Operator::Greater => ">",
            Operator::GreaterEqual => ">=",
            Operator::Equal => "==",
            Operator::NotEqual => "<>",
            Operator::And => "and",
            Operator::Or => "or",
        }
    }

    /// Whether it compares an order, which causes events.
    pub fn is_order(self) -> bool {
        matches!(self, Operator::Less | Operator::LessEqual | Operator::Greater | Operator::GreaterEqual)
    }

    /// Whether it gives a Boolean.
    pub fn is_relation(self) -> bool {
        self.is_order() || matches!(self, Operator::Equal | Operator::NotEqual)
    }
}

/// An expression.
#[derive(Clone, PartialEq, Debug)]
pub enum Expr {
    /// A number.
    Number(f64),
    /// `true`, `false`
    Truth(bool),
    /// A literal of `Mode`, from 1.
    Literal(usize),
    /// `time`
    Time,
    /// A variable of the model.
    Name(Id, Vec<Subscript>),
    /// A variable of a function or an iterator.
    Local(String, Vec<Subscript>),
    /// A field of a record that is a variable of a function.
    Field(Box<Expr>, String),
    /// A record of the model as a whole.
    Record(ComponentId),
    /// A record by its class and the values of all fields, by name or by place.
    Construct(String, Vec<(String, Expr)>, bool),
    /// `pre(x)`
    Pre(Id, Vec<Subscript>),
    /// `edge(b)`
    Edge(Id, Vec<Subscript>),
    /// `change(x)`
    Change(Id, Vec<Subscript>),
    /// `der(e)`
    Der(Box<Expr>),
    /// `-e`
    Minus(Box<Expr>),
    /// `not e`
    Not(Box<Expr>),
    /// `a op b`
    Binary(Operator, Box<Expr>, Box<Expr>),
    /// `if c then a elseif ... else b`
    If(Vec<(Expr, Expr)>, Box<Expr>),
    /// `{a, b}`
    Array(Vec<Expr>),
    /// `{e for i in r}`, `sum(e for i in r)`; the last iterator is the outermost.
    For(Option<&'static str>, Box<Expr>, Vec<(String, Range)>),
    /// A function of the language.
    Builtin(&'static str, Vec<Expr>),
    /// A function of the model, by name.
    Call(String, Vec<Expr>),
    /// `noEvent(e)`
    NoEvent(Box<Expr>),
    /// `delay(e, T)`
    Delay(Box<Expr>, f64),
    /// `sample(start, interval)`
    Sample(f64, f64),
    /// `initial()`
    Initial,
}

impl Range {
    /// `from:to`
    pub fn new(from: i64, to: i64) -> Self {
        Self { from: Expr::Number(from as f64), step: None, to: Expr::Number(to as f64) }
    }
}

impl Expr {
    /// `a op b`
    pub fn binary(operator: Operator, a: Expr, b: Expr) -> Self {
        Expr::Binary(operator, Box::new(a), Box::new(b))
    }

    /// A variable of a function or an iterator.
    pub fn local(name: &str) -> Self {
        Expr::Local(name.to_string(), Vec::new())
    }

    /// A scalar or a whole array.
    pub fn name(id: Id) -> Self {
        Expr::Name(id, Vec::new())
    }

    /// An element.
    pub fn at(id: Id, subscripts: Vec<Expr>) -> Self {
        Expr::Name(id, subscripts.into_iter().map(Subscript::At).collect())
    }

    /// A call of a function of the language.
    pub fn call(name: &'static str, arguments: Vec<Expr>) -> Self {
        Expr::Builtin(name, arguments)
    }
}

impl std::ops::Add for Expr {
    type Output = Expr;
    fn add(self, other: Expr) -> Expr {
        Expr::binary(Operator::Add, self, other)
    }
}

impl std::ops::Sub for Expr {
    type Output = Expr;
    fn sub(self, other: Expr) -> Expr {
        Expr::binary(Operator::Subtract, self, other)
    }
}

impl std::ops::Mul for Expr {
    type Output = Expr;
    fn mul(self, other: Expr) -> Expr {
        Expr::binary(Operator::Multiply, self, other)
    }
}

impl std::ops::Div for Expr {
    type Output = Expr;
    fn div(self, other: Expr) -> Expr {
        Expr::binary(Operator::Divide, self, other)
    }
}

impl From<f64> for Expr {
    fn from(value: f64) -> Expr {
        Expr::Number(value)
    }
}
