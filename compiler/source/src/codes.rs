//! The table of error codes, by stage: `E01xx` syntax, `E02xx` names and types, `E03xx` units and connections,
//! `E04xx` structure, `E05xx` lowering and code, `W` warnings, `N` notes.  Each code has one paragraph that `hyd explain` prints.

use std::fmt;

macro_rules! codes {
    ($($name:ident = $number:literal, $title:literal, $text:literal;)*) => {
        /// A code of the table.
        #[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, PartialOrd, Ord)]
        pub enum Code {
            $(#[doc = $title] $name,)*
        }

        impl Code {
            /// All codes in the order of their numbers.
            pub const ALL: &'static [Code] = &[$(Code::$name),*];

            /// The code as printed, such as `E0101`.
            pub fn number(self) -> &'static str {
                match self { $(Code::$name => $number),* }
            }

            /// True if the text was not understood, so that what follows may be a consequence.
            pub fn is_syntax(self) -> bool {
                matches!(self, Code::Syntax | Code::OutsideProfile | Code::Limit | Code::EndName)
            }

            /// A few words.
            pub fn title(self) -> &'static str {
                match self { $(Code::$name => $title),* }
            }

            /// The explanation.
            pub fn explanation(self) -> &'static str {
                match self { $(Code::$name => $text),* }
            }
        }
    };
}

codes! {
    Syntax = "E0101", "syntax error",
        "The text is not what the grammar allows at this place. The message says what was expected; reading goes on after the next `;`, so that one run shows several errors.";
    OutsideProfile = "E0102", "outside the language profile",
        "The text is legal Modelica, but this feature is outside the profile that this tool reads. It is rejected by name and never ignored.";
    Limit = "E0103", "a limit was exceeded",
        "Nesting, array sizes, recursion and total size are bounded so that every text ends in an answer. The message names the limit.";
    EndName = "E0104", "the name after `end` differs",
        "A class must end with its own name: `model Pump ... end Pump;`.";
    FileAccess = "E0105", "a file cannot be read",
        "A file or folder that was named, or that a name leads to, is missing or unreadable.";
    UnknownName = "E0201", "unknown name",
        "A name is used that no declaration in the class, its base classes, its enclosing packages or its imports provides.";
    UnknownClass = "E0202", "unknown class",
        "A type or model is named that cannot be found from here.";
    UnknownModifier = "E0203", "a modifier names nothing",
        "A modification addresses an element that the modified class does not have.";
    TypeMismatch = "E0204", "types do not fit",
        "Both sides of an equation, the arguments of an operator or a binding have types that do not go together, for example Boolean and Real.";
    Redefinition = "E0205", "a name is declared twice",
        "Two elements of one class have the same name.";
    NotStructural = "E0206", "a value is needed before the run",
        "Array sizes, conditions of components and loop ranges must be known at translation: literals, constants and parameters with values.";
    ArrayShape = "E0207", "array sizes do not fit",
        "The sizes of two arrays that meet in an equation, a binding or an operator differ, or an index lies outside its array.";
    CircularClass = "E0208", "circular inheritance or nesting",
        "A class extends itself or contains a component of its own class, directly or through others.";
    FinalModified = "E0209", "a final element is modified",
        "The element was declared `final`, so no modification or redeclaration from outside is allowed.";
    Redeclaration = "E0210", "a redeclaration does not fit",
        "Only elements declared `replaceable` can be redeclared, and the new class must offer what the constraining class offers.";
    CircularParameters = "E0211", "parameters depend on each other in a cycle",
        "The values of parameters and constants are computed in the order of their dependence; a circle has no such order.";
    PartialClass = "E0212", "a partial class cannot be instantiated",
        "A `partial` class is a base for others; components and simulated models need a complete one.";
    NoValue = "E0213", "a parameter has no value",
        "A parameter without a binding and without a `start` value was used. Give it a value in the text or with `--set`.";
    BadArguments = "E0214", "arguments do not fit",
        "A function or operator was called with the wrong number or kind of arguments.";
    NoSuchParameter = "E0215", "no such parameter",
        "The name given on the command line is not a parameter of the model that can be set.";
    Misplaced = "E0216", "not allowed here",
        "The construct exists, but not at this place, such as `reinit` outside a `when`.";
    Value = "E0217", "a value is out of range",
        "A value violates a limit stated in the text (`min`, `max`) or has no meaning, such as a negative size or, given on the command line, one of another type.";
    DiscreteTime = "E0218", "not a discrete-time expression",
        "Integer, Boolean and enumeration variables, and those declared `discrete`, change at events only. Outside a `when` they take values made of discrete variables, parameters and relations, which cause events (Modelica 3.6, section 3.8.3). A relation in `noEvent` or inside a function causes none, so its value may change at any time.";
    OpenInput = "E0219", "an input has no value",
        "Nothing gives an input of the model a value, so it keeps its `start` value, or 0. Set it with `--set`, or put the block into a model that feeds it.";
    Clock = "E0220", "clocks do not fit",
        "What has a clock changes at its ticks only, and which clock that is must follow from the model: from `Clock(...)` in a `when` or in `sample(u, clock)`, and from there along equations and operators. `sample` leads from continuous time to a clock, `hold` back, `subSample`, `superSample`, `shiftSample`, `backSample` and `noClock` from one clock to another (Modelica 3.6, chapter 16).";
    UnitMismatch = "E0301", "units do not fit",
        "Both sides of an equation, a sum or a connection have different physical dimensions. Where a number that is a factor could make up for it (`time/10`), it may stand for a quantity, and this is a warning: give the quantity a name and a unit, as in `parameter Real tau(unit = \"s\") = 10`. In libraries of others it is a warning, too; `--strict-units` makes all of them errors.";
    UnitSyntax = "E0302", "not a unit",
        "A `unit` string cannot be read as a product of powers of SI units.";
    ConnectorMismatch = "E0303", "connectors do not fit",
        "Both ends of a `connect` must be connectors with the same elements: names, flow or not, types and sizes.";
    ConnectionRule = "E0304", "a rule of a connector is broken",
        "The library says of a connector that it must be connected (`mustBeConnected`), or to one other connector only (`mayOnlyConnectOnce`), and gives the reason (Modelica 3.6, section 18.5).";
    VirtualGraph = "E0305", "roots of connected records do not fit",
        "Records with more variables than degrees of freedom, such as the orientation of a frame, are determined from roots along connections and `Connections.branch` (Modelica 3.6, section 9.4). Where everything is connected there must be exactly one root; branches alone must form no loop and join no two roots.";
    Unbalanced = "E0401", "number of equations and unknowns differ",
        "A model can be solved only if it has as many equations as unknowns. The message names the smallest part that is over- or under-determined.";
    Singular = "E0402", "structurally singular",
        "The numbers of equations and unknowns agree, but some equations determine the same unknowns more than once while others are left open. Potentials that nothing fixes, as in a circuit without ground or a mechanism without anchor, are named as that, and so are ideal sources that prescribe the same potential or flow twice.";
    HighIndex = "E0403", "constraints between states remain",
        "Some states depend on each other through constraints, so that the constraints must be differentiated before the system can be solved.";
    InitialUnbalanced = "E0404", "initial conditions do not fit",
        "Start values and initial equations determine the start more than once, or not at all.";
    DiscreteLoop = "E0405", "discrete variables depend on each other in a cycle",
        "The values of discrete variables are computed in the order of their dependence at an event; a circle without `pre` has no such order.";
    Injection = "E0406", "a term cannot be injected here",
        "A term can be added to an equation that is written as `left = right` and holds at all times, found by the path of its component and its line, unless the equation has to be differentiated to solve the system.";
    Codegen = "E0501", "code could not be made",
        "The translated model could not be turned into code for this machine.";
    Run = "E0601", "the run failed",
        "The model was translated, but the solver could not go on: an equation has no finite value, the equations have no solution or do not determine all unknowns, the step size collapsed, or an assertion does not hold. The message names time, equation and variable, and the last good values. The exit code is 3 (1 for an assertion of the model's own).";
    Unused = "W0201", "unused",
        "An import, a protected element or a variable inside a function is declared and never used, or assigned and never read. Public elements, inputs of functions and loop variables are not looked at, libraries neither. Remove it, or use it where it was meant.";
    Hidden = "W0202", "a name hides another",
        "A loop variable or a component has the name of a component, an import or an outer constant, which cannot be reached by its name from there on. That is legal, but readers may take one for the other: rename one of them.";
    LibraryVersion = "W0203", "a library has another version than the text uses",
        "The text, or a library that was named, says by `annotation(uses(Name(version = \"...\")))` which version of a library it was written for, and the one that was found is older or has another main number. Where a folder of libraries holds several versions (`Name 1.2.0`, `Name 2.0.0`), the one that is used is taken, else the folder without a version, else the latest. Put the right version beside it, or change `uses`.";
    AddedInner = "W0204", "an `inner` element was added",
        "A component looks for an `inner` element of a name (a world, an ambient, a system of defaults), and no model around it declares one. Where all that look for the name want one class that is not partial, an element of that class is added at the top of the model, with its default values (Modelica 3.6, section 5.4). Declare it in the model that is run, `inner World world;`, and set what should differ from the defaults. If one is declared further down, or under another name, that is another one.";
    OpenConnector = "W0301", "nothing is connected to a connector",
        "A connector with flow variables that nothing is connected to has zero flow (Modelica 3.6, section 9.2), so a connection that was forgotten is simulated as a closed end, an open circuit or a free flange. Connect it, close it with a component that says so (such as `Hyd.Hydraulic.Components.Plug`), or mark it as open on purpose: `annotation(__hyd(open = true))` at the declaration of the component, or `open = {\"n\"}` for some of its connectors. Libraries mark in the same way connectors that may well stay open, such as the flange of a mass. Components declared inside libraries are not looked at, nor the connectors of the model itself.";
    ShortCircuit = "W0302", "the two ends of a component are connected to each other",
        "A component with two connectors of one kind (a damper, a resistance, a pipe) has both in one set of connections: their potentials are equal, and as a rule what goes in at one end comes out at the other, as if the component were not there. Usually one of the two connections was meant for a neighbour. Components declared inside libraries are not looked at, nor those with more than two connectors of a kind (an operational amplifier whose output is fed back) and those that store something.";
    UnseenEvents = "W0401", "events may be missed",
        "A condition of time alone is enclosed over intervals, so that no event of it is lost. Of a function that is compiled, because it has loops or would be a very large expression, nothing is known between two points: a change that lasts less than a step of the solver may be passed over. Write the condition as an expression, or with `sample` where it recurs.";
    JumpDifferentiated = "W0402", "the derivative of what jumps",
        "An equation had to be differentiated, because states depend on each other through it or because a derivative of its variables is asked for, and one side of it jumps at events. The derivative is right between the jumps; at a jump it would be an impulse, which is left out: a mass whose position is prescribed by a step gets no speed by it. Prescribe a smooth position (a ramp, a filter of second order), or set the state by `reinit` where the jump is meant.";
    RealEquality = "W0403", "real numbers are compared for equality",
        "Two numbers that vary continuously are equal at single instants at most, and no event can be looked for there: a `when h == 0.5` acts if a step happens to meet the value to the last bit, that is, never. Modelica 3.6 (section 3.5) allows `==` and `<>` of real numbers in functions only. Write `>=` or `<=`, or compare the distance with a tolerance.";
    Chosen = "N0401", "a choice was made",
        "The text leaves something open, and the tool chose as Modelica tools do. The message says what.";
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.number())
    }
}
