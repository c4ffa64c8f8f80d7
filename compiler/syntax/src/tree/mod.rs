//! The syntax tree: what the text says, with spans, before any name is looked up.
//!
//! One type per construct of the Modelica 3.6 grammar (appendix A) as far as the profile goes.  Comments and layout are
//! not kept here.

mod expression;

use std::sync::Arc;

use hyd_source::Span;

pub use expression::{Arguments, BinaryOp, ComponentRef, Expr, ExprKind, RefPart, UnaryOp};

/// An identifier or a string constant; quoted identifiers keep their quotes.
pub type Name = Arc<str>;

/// An identifier with its place.
#[derive(Clone, Debug)]
pub struct Ident {
    /// The identifier.
    pub name: Name,
    /// Its place.
    pub span: Span,
}

/// A dotted name such as `Hyd.Units.Pressure`, with a leading dot when `global`.
#[derive(Clone, Debug)]
pub struct Path {
    /// Starts with a dot: looked up from the top.
    pub global: bool,
    /// The identifiers, at least one.
    pub parts: Vec<Ident>,
    /// The whole name.
    pub span: Span,
}

/// One file.
#[derive(Clone, Debug)]
pub struct StoredDefinition {
    /// `within P;`: `Some(None)` for an empty `within;`.
    pub within: Option<Option<Path>>,
    /// Top-level classes.
    pub classes: Vec<Arc<ClassDef>>,
}

/// The kind of a class.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ClassKind {
    /// `class`
    Class,
    /// `model`
    Model,
    /// `block`
    Block,
    /// `connector`
    Connector,
    /// `record`
    Record,
    /// `type`
    Type,
    /// `package`
    Package,
    /// `function`
    Function,
    /// `operator`: the functions of one operator of a record.
    Operator,
}

impl ClassKind {
    /// The word that such a class begins with.
    pub fn keyword(self) -> &'static str {
        match self {
            ClassKind::Class => "class",
            ClassKind::Model => "model",
            ClassKind::Block => "block",
            ClassKind::Connector => "connector",
            ClassKind::Record => "record",
            ClassKind::Type => "type",
            ClassKind::Package => "package",
            ClassKind::Function => "function",
            ClassKind::Operator => "operator",
        }
    }
}

/// A class definition.
#[derive(Clone, Debug)]
pub struct ClassDef {
    /// Kind.
    pub kind: ClassKind,
    /// Prefixes `encapsulated`, `partial`, `expandable`.
    pub encapsulated: bool,
    /// `partial`
    pub partial: bool,
    /// `expandable`
    pub expandable: bool,
    /// `pure`/`impure` functions: `Some(false)` for `impure`.
    pub pure: Option<bool>,
    /// Name.
    pub name: Ident,
    /// Description string.
    pub description: Option<Name>,
    /// What it consists of.
    pub body: ClassBody,
    /// The class annotation.
    pub annotation: Option<Modification>,
    /// The whole definition.
    pub span: Span,
}

/// The three forms of a class.
#[derive(Clone, Debug)]
pub enum ClassBody {
    /// `model A ... end A;` and `model extends A (...) ... end A;` (then `extends_from` is set).
    Long {
        /// Elements in the order of the text.
        elements: Vec<Element>,
        /// Equation sections.
        equations: Vec<EquationSection>,
        /// Algorithm sections.
        algorithms: Vec<AlgorithmSection>,
        /// The external clause of a function.
        external: Option<External>,
        /// `class extends Name(modification)`.
        extends_from: Option<Modification>,
    },
    /// `type A = flow B[3](unit = "m");`
    Short {
        /// Base prefix: `input`, `output`, or none.
        direction: Option<Direction>,
        /// `flow` prefix of a short connector definition.
        flow: bool,
        /// The class named on the right.
        base: Path,
        /// Array dimensions.
        dims: Vec<Expr>,
        /// Modification.
        modification: Modification,
    },
    /// `type A = enumeration(x, y "..");` (`None` for `enumeration(:)`).
    Enumeration(Option<Vec<EnumLiteral>>),
    /// `function A = der(f, x)`; outside the profile.
    DerivativeOf(Path, Vec<Ident>),
}

/// `external "C" y = f(a, b);`
#[derive(Clone, Debug)]
pub struct External {
    /// The language as written, without quotes; `None` where it is left out.
    pub language: Option<Name>,
    /// The call, where one is written and has the form of the language.
    pub call: Option<ExternalCall>,
    /// The clause.
    pub span: Span,
}

/// The call of an external clause.
#[derive(Clone, Debug)]
pub struct ExternalCall {
    /// What takes the value of the function.
    pub output: Option<ComponentRef>,
    /// The name of the function in its language.
    pub name: Ident,
    /// The arguments; a variable that is an output of the Modelica function is set by the call.
    pub arguments: Vec<Expr>,
}

/// A literal of an enumeration.
#[derive(Clone, Debug)]
pub struct EnumLiteral {
    /// Name.
    pub name: Ident,
    /// Description.
    pub description: Option<Name>,
}

/// `input` or `output`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Direction {
    /// `input`
    Input,
    /// `output`
    Output,
}

/// Variability prefix of a component.
#[derive(Clone, Copy, PartialEq, Eq, Debug, PartialOrd, Ord)]
pub enum Variability {
    /// `constant`
    Constant,
    /// `parameter`
    Parameter,
    /// `discrete`
    Discrete,
    /// No prefix.
    Continuous,
}

/// Prefixes that components and classes share.
#[derive(Clone, Debug, Default)]
pub struct ElementPrefixes {
    /// In a `protected` section.
    pub protected: bool,
    /// `redeclare`
    pub redeclare: bool,
    /// `final`
    pub is_final: bool,
    /// `inner`
    pub inner: bool,
    /// `outer`
    pub outer: bool,
    /// `replaceable`
    pub replaceable: bool,
}

/// An element of a class.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "most elements are components, the largest variant")]
pub enum Element {
    /// `import ...;`
    Import(Import),
    /// `extends A(...);`
    Extends(Extends),
    /// A nested class.
    Class(NestedClass),
    /// A component declaration; `Real x, y;` gives two.
    Component(Component),
}

/// A nested class with its prefixes.
#[derive(Clone, Debug)]
pub struct NestedClass {
    /// Prefixes.
    pub prefixes: ElementPrefixes,
    /// The class.
    pub class: Arc<ClassDef>,
    /// `constrainedby A(...)`.
    pub constrained_by: Option<Constraint>,
}

/// `constrainedby Path(modification)`.
#[derive(Clone, Debug)]
pub struct Constraint {
    /// Constraining class.
    pub base: Path,
    /// Modification.
    pub modification: Modification,
}

/// An import clause.
#[derive(Clone, Debug)]
pub struct Import {
    /// The package or class named.
    pub path: Path,
    /// What becomes visible.
    pub what: ImportKind,
    /// The clause.
    pub span: Span,
}

/// What an import clause makes visible.
#[derive(Clone, Debug)]
pub enum ImportKind {
    /// `import A.B;` as `B`.
    Qualified,
    /// `import D = A.B;` as `D`.
    Renamed(Ident),
    /// `import A.*;`
    All,
    /// `import A.{B, C};`
    Several(Vec<Ident>),
}

/// An `extends` clause.
#[derive(Clone, Debug)]
pub struct Extends {
    /// The base class.
    pub base: Path,
    /// Its modification.
    pub modification: Modification,
    /// In a `protected` section.
    pub protected: bool,
    /// Annotation.
    pub annotation: Option<Modification>,
    /// The clause.
    pub span: Span,
}

/// One declared component.
#[derive(Clone, Debug)]
pub struct Component {
    /// Prefixes.
    pub prefixes: ElementPrefixes,
    /// `flow`
    pub flow: bool,
    /// `stream`; outside the profile.
    pub stream: bool,
    /// Variability.
    pub variability: Variability,
    /// `input`/`output`.
    pub direction: Option<Direction>,
    /// The class named.
    pub class: Path,
    /// Array dimensions of the type and of the name together, outermost first: those after the name come first.
    pub dims: Vec<Expr>,
    /// Name.
    pub name: Ident,
    /// Modification with binding.
    pub modification: Modification,
    /// `if condition`.
    pub condition: Option<Expr>,
    /// `constrainedby`.
    pub constrained_by: Option<Constraint>,
    /// Description string.
    pub description: Option<Name>,
    /// Annotation.
    pub annotation: Option<Modification>,
    /// The declaration (type to last token).
    pub span: Span,
}

/// A modification: `(arguments) = binding`.  Empty when nothing was written.
#[derive(Clone, Debug, Default)]
pub struct Modification {
    /// The arguments in parentheses.
    pub arguments: Vec<Argument>,
    /// `= expression` or `:= expression`.
    pub binding: Option<Expr>,
    /// The whole modification, if one was written.
    pub span: Option<Span>,
}

/// One argument of a modification.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "nearly all arguments are plain modifications, the largest variant")]
pub enum Argument {
    /// `each final a.b(...) = e`
    Modify(ElementModification),
    /// `redeclare Type name(...)`, or `replaceable Type name` in a modification.
    RedeclareComponent {
        /// `each`
        each: bool,
        /// `redeclare` was written (not only `replaceable`).
        redeclare: bool,
        /// The new declaration.
        component: Box<Component>,
    },
    /// `redeclare model A = B(...)`
    RedeclareClass {
        /// `each`
        each: bool,
        /// `redeclare` was written (not only `replaceable`).
        redeclare: bool,
        /// The new class.
        class: Box<NestedClass>,
    },
}

/// `each final a.b(...) = e`
#[derive(Clone, Debug)]
pub struct ElementModification {
    /// `each`
    pub each: bool,
    /// `final`
    pub is_final: bool,
    /// The element addressed: `a` or `a.b`.
    pub target: Path,
    /// What it becomes.
    pub modification: Modification,
    /// Description string.
    pub description: Option<Name>,
    /// The argument.
    pub span: Span,
}

/// An equation section.
#[derive(Clone, Debug)]
pub struct EquationSection {
    /// `initial equation`.
    pub initial: bool,
    /// Its equations.
    pub equations: Vec<Equation>,
}

/// An algorithm section.
#[derive(Clone, Debug)]
pub struct AlgorithmSection {
    /// `initial algorithm`.
    pub initial: bool,
    /// Its statements.
    pub statements: Vec<Statement>,
    /// The section.
    pub span: Span,
}

/// An equation.
#[derive(Clone, Debug)]
pub struct Equation {
    /// What it says.
    pub kind: EquationKind,
    /// Description string.
    pub description: Option<Name>,
    /// The equation without its `;`.
    pub span: Span,
}

/// The kinds of equations.
#[derive(Clone, Debug)]
pub enum EquationKind {
    /// `left = right`
    Equal(Expr, Expr),
    /// `connect(a, b)`
    Connect(ComponentRef, ComponentRef),
    /// `for i in 1:n, j loop ... end for`
    For(Vec<Iterator>, Vec<Equation>),
    /// `if c then ... elseif d then ... else ... end if`; the last branch has no condition when there is an `else`.
    If(Vec<(Option<Expr>, Vec<Equation>)>),
    /// `when c then ... elsewhen d then ... end when`
    When(Vec<(Expr, Vec<Equation>)>),
    /// A call as an equation: `assert`, `terminate`, `reinit` or a function without result.
    Call(ComponentRef, Arguments),
}

/// `i in range` (the range may be left out).
#[derive(Clone, Debug)]
pub struct Iterator {
    /// Loop variable.
    pub name: Ident,
    /// Range.
    pub range: Option<Expr>,
}

/// A statement of an algorithm.
#[derive(Clone, Debug)]
pub struct Statement {
    /// What it does.
    pub kind: StatementKind,
    /// The statement without its `;`.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Clone, Debug)]
pub enum StatementKind {
    /// `a := e`
    Assign(ComponentRef, Expr),
    /// `(a, , b) := f(...)`
    AssignTuple(Vec<Option<ComponentRef>>, ComponentRef, Arguments),
    /// `f(...)`: `assert`, `terminate`, `reinit` or a function.
    Call(ComponentRef, Arguments),
    /// `if`
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
}
