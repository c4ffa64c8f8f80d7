//! A model as the generator thinks of it: what it computes, in an order in which it can be computed.
//!
//! The statements of a model define their variables one after the other, so that a direct evaluation needs no matching,
//! no sorting and no index reduction; the printed text is shuffled and says nothing of the order.  Components, arrays of
//! them and records own variables; an array of components gives each of its variables a first subscript.

mod expression;

pub use expression::{Expr, Operator, Range, Subscript};

/// Place of a variable in [`Model::variables`].
pub type Id = usize;
/// Place of a component in [`Model::components`].
pub type ComponentId = usize;

/// The literals of the one enumeration of a model, `Mode`.
pub const LITERALS: [&str; 3] = ["off", "slow", "fast"];

/// Type of a scalar.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// `Real`
    Real,
    /// `Integer`
    Integer,
    /// `Boolean`
    Boolean,
    /// The enumeration `Mode`; its values count from 1.
    Mode,
}

/// What determines a variable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// Its declaration, for good.
    Constant,
    /// Its declaration or whoever runs the model.
    Parameter,
    /// A parameter that decides sizes and loops.
    Structural,
    /// A parameter with `fixed = false`: the initial equations.
    Free,
    /// Its derivative.
    State,
    /// Statements, at every instant.
    Algebraic,
    /// `when`; it keeps its value between events.
    Discrete,
}

/// Where a start value comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Start {
    /// A condition: `fixed = true`.
    Fixed,
    /// A guess; initial equations determine the value.
    Guess,
    /// Nothing is said.
    None,
}

/// A variable or array of variables.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name without the component.
    pub name: String,
    /// Type.
    pub kind: Kind,
    /// Sizes, that of the array of components first.
    pub sizes: Vec<usize>,
    /// What determines it.
    pub role: Role,
    /// The component it belongs to.
    pub owner: Option<ComponentId>,
    /// Value of a parameter or constant, whole.
    pub value: Option<Expr>,
    /// Start value of all elements.
    pub start: f64,
    /// Start value by an expression over parameters, for a scalar.
    pub start_by: Option<Expr>,
    /// Meaning of the start value.
    pub fixed: Start,
    /// `stateSelect`, if any.
    pub select: Option<&'static str>,
    /// The size is printed as this structural parameter.
    pub size_by: Option<Id>,
    /// It is gone: nothing defines or reads it.
    pub dropped: bool,
}

/// What kind of class a component has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A model with the statements [`Statement::Each`].
    Model,
    /// A record.
    Record,
    /// Declared by the text of a network.
    Network,
}

/// A component or an array of components.
#[derive(Clone, Debug)]
pub struct Component {
    /// Name of the component.
    pub name: String,
    /// Name of the class.
    pub class: String,
    /// Number of elements of an array.
    pub count: Option<usize>,
    /// Kind of the class.
    pub shape: Shape,
    /// A record whose fields are parameters.
    pub parameter: bool,
    /// A value of a record as a whole.
    pub value: Option<Expr>,
    /// The parameters of the class are declared in a base class of it.
    pub inherits: bool,
    /// The elements of the array differ in a size that nothing else depends on.
    pub uneven: bool,
    /// It is gone with its variables.
    pub dropped: bool,
}

/// What is assigned.
#[derive(Clone, PartialEq, Debug)]
pub enum Target {
    /// A variable of the model.
    Name(Id, Vec<Subscript>),
    /// A variable of a function.
    Local(String, Vec<Subscript>),
    /// A field of a record in a function.
    Field(String, String),
}

/// How an equation is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// `x = e`
    Plain,
    /// `e = x`
    Turned,
    /// `x - (e) = 0`
    Difference,
    /// `2*x = 2*(e)`
    Doubled,
    /// `x + x = e + x`
    Both,
}

/// An equation of an algebraic loop.
#[derive(Clone, Debug)]
pub enum Equation {
    /// `a = b`
    Plain(Expr, Expr),
    /// `for i in r loop`
    Loop(String, Range, Vec<Equation>),
}

/// A statement of an algorithm.
#[derive(Clone, Debug)]
pub enum Step {
    /// `t := e`
    Assign(Target, Expr),
    /// `(a, b) := f(...)`
    Tuple(Vec<Target>, Expr),
    /// `if`
    If(Vec<(Expr, Vec<Step>)>, Vec<Step>),
    /// `for`
    For(String, Range, Vec<Step>),
    /// `while`
    While(Expr, Vec<Step>),
    /// `break`
    Break,
    /// `return`
    Return,
}

/// A statement of the model.
#[derive(Clone, Debug)]
pub enum Statement {
    /// Gives a variable, or a whole array, its value.
    Define(Target, Expr, Form),
    /// The value stands in the declaration of the variable, whole.
    Declare(Id, Expr),
    /// A record as a whole.
    DefineRecord(ComponentId, Expr),
    /// `(a, b) = f(...)`
    Tuple(Vec<Target>, Expr),
    /// Gives a state its derivative.
    Derive(Target, Expr, Form),
    /// Variables, whole, that equations determine together.
    Implicit(Vec<Id>, Vec<Equation>),
    /// `for`
    For(String, Range, Vec<Statement>),
    /// `if`; all branches define the same.
    If(Vec<(Expr, Vec<Statement>)>, Vec<Statement>),
    /// `when`; a branch has one condition or several.
    When(Vec<(Vec<Expr>, Vec<Statement>)>),
    /// `reinit(x, e)`, in a `when`.
    Reinit(Target, Expr),
    /// An algorithm section.
    Algorithm(Vec<Step>),
    /// A `when` in an algorithm section.
    Acts(Vec<(Vec<Expr>, Vec<Statement>)>),
    /// Statements of the class of a component; the subscript of its array is the iterator [`SELF`].
    Each(ComponentId, Vec<Statement>),
    /// A network of components that are connected, and what that means.
    Network(Box<Network>),
}

/// The iterator that goes over the components of an array in [`Statement::Each`].
pub const SELF: &str = "self";

/// Masses that links with conductances connect: written with connectors, meant as the statements.
#[derive(Clone, Debug)]
pub struct Network {
    /// Classes, before the model.
    pub classes: String,
    /// Declarations in the model.
    pub declarations: String,
    /// Equations of the model, one per element.
    pub connections: Vec<String>,
    /// Further equations of the model.
    pub equations: Vec<Statement>,
    /// The same computed directly.
    pub meaning: Vec<Statement>,
}

/// A variable of a function.
#[derive(Clone, Debug)]
pub struct Local {
    /// Its name.
    pub name: String,
    /// Its type; a record by the name of its class.
    pub kind: Type,
    /// Sizes; `None` is `:`.
    pub sizes: Vec<Option<usize>>,
    /// Its value at the beginning, or its default.
    pub value: Option<Expr>,
}

/// Type of a variable of a function.
#[derive(Clone, PartialEq, Debug)]
pub enum Type {
    /// A scalar.
    Of(Kind),
    /// A record.
    Record(String),
}

/// A function.
#[derive(Clone, Debug)]
pub struct Function {
    /// Its name.
    pub name: String,
    /// What is given.
    pub inputs: Vec<Local>,
    /// What comes back.
    pub outputs: Vec<Local>,
    /// Protected variables.
    pub locals: Vec<Local>,
    /// What is done.
    pub body: Vec<Step>,
}

/// A record class: names of its fields with their defaults.
#[derive(Clone, Debug)]
pub struct RecordClass {
    /// Its name.
    pub name: String,
    /// Fields, all Real.
    pub fields: Vec<(String, f64)>,
    /// The defaults are written.
    pub defaults: bool,
    /// A base class that has the same fields with this other default of the first one.
    pub derived: Option<f64>,
}

/// A model.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Variables.
    pub variables: Vec<Variable>,
    /// Components.
    pub components: Vec<Component>,
    /// Functions, each after those that it calls.
    pub functions: Vec<Function>,
    /// Record classes.
    pub records: Vec<RecordClass>,
    /// What is computed, in order.
    pub statements: Vec<Statement>,
    /// Initial equations.
    pub initial: Vec<(Expr, Expr)>,
    /// Order in which the text is shuffled.
    pub order: u64,
    /// Length of the run (s).
    pub stop: f64,
}

impl Variable {
    /// A scalar Real of this role.
    pub fn new(name: impl Into<String>, role: Role) -> Self {
        Self {
            name: name.into(),
            kind: Kind::Real,
            sizes: Vec::new(),
            role,
            owner: None,
            value: None,
            start: 0.0,
            start_by: None,
            fixed: Start::None,
            select: None,
            size_by: None,
            dropped: false,
        }
    }

    /// The same as an array.
    #[must_use]
    pub fn sized(self, sizes: &[usize]) -> Self {
        Self { sizes: sizes.to_vec(), ..self }
    }

    /// The same with another type.
    #[must_use]
    pub fn of(self, kind: Kind) -> Self {
        Self { kind, ..self }
    }

    /// The same with a value.
    #[must_use]
    pub fn valued(self, value: Expr) -> Self {
        Self { value: Some(value), ..self }
    }

    /// The same with a start value that is a condition.
    #[must_use]
    pub fn starting(self, start: f64) -> Self {
        Self { start, fixed: Start::Fixed, ..self }
    }

    /// Number of scalars.
    pub fn count(&self) -> usize {
        self.sizes.iter().product()
    }
}

impl Model {
    /// Adds a variable.
    pub fn add(&mut self, variable: Variable) -> Id {
        self.variables.push(variable);
        self.variables.len() - 1
    }
}
