//! Functions and operators of the language: their names, their arguments, and how the sizes of their results follow.
//!
//! One table for all who ask (Modelica 3.6, sections 3.7, 10.3 and 12.2).  What they are on values known at translation stands in
//! [`values`], what sizes they give in [`sizes`], which elements arrays are put together of in [`elements`].

mod arrays;
mod elements;
mod sizes;
mod values;

use hyd_syntax::tree::ComponentRef;
use hyd_system::math::Function;

pub(crate) use arrays::matrix;
pub use elements::{Element, Place};
pub use sizes::{SizeFault, SizesOf, sizes_text};
pub(crate) use values::value;

/// A function or operator of the language.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Builtin {
    /// `der(x)`
    Der,
    /// `pre(x)`
    Pre,
    /// `edge(b)`
    Edge,
    /// `change(x)`
    Change,
    /// `initial()`
    Initial,
    /// `terminal()`
    Terminal,
    /// `sample(start, interval)`; `sample(u)`, `sample(u, clock)`
    Sample,
    /// `hold(u)`: a clocked value between its ticks
    Hold,
    /// `previous(u)`: a clocked value at the tick before
    Previous,
    /// `subSample(u, factor)`: at every so manieth tick
    SubSample,
    /// `superSample(u, factor)`: so many ticks for one
    SuperSample,
    /// `shiftSample(u, counter, resolution)`: later by a part of the interval
    ShiftSample,
    /// `backSample(u, counter, resolution)`: earlier by a part of the interval
    BackSample,
    /// `noClock(u)`: the value that is there, whatever its clock
    NoClock,
    /// `interval()`, `interval(u)`: time since the tick before
    Interval,
    /// `firstTick()`, `firstTick(u)`
    FirstTick,
    /// `Clock()`, `Clock(interval)`, `Clock(counter, resolution)`, `Clock(condition)`, `Clock(clock, solver method)`
    Clock,
    /// `delay(x, time)`, `delay(x, time, most)`
    Delay,
    /// `noEvent(x)`
    NoEvent,
    /// `smooth(order, x)`
    Smooth,
    /// `homotopy(actual, simplified)`
    Homotopy,
    /// `semiLinear(x, positive slope, negative slope)`
    SemiLinear,
    /// `inStream(v)`: what a stream variable is of that which flows in
    InStream,
    /// `actualStream(v)`: what a stream variable is of that which flows, in or out
    ActualStream,
    /// `reinit(x, value)`, which is a statement and no value
    Reinit,
    /// `size(array)`, `size(array, dimension)`
    Size,
    /// `ndims(array)`
    Ndims,
    /// `zeros(n, ...)`
    Zeros,
    /// `ones(n, ...)`
    Ones,
    /// `fill(value, n, ...)`
    Fill,
    /// `identity(n)`
    Identity,
    /// `array(a, b, ...)`, `array(... for ...)`: another way to write `{a, b, ...}` and `{... for ...}`
    Array,
    /// `linspace(first, last, n)`
    Linspace,
    /// `diagonal(v)`
    Diagonal,
    /// `cat(dimension, a, b, ...)`
    Cat,
    /// `vector(a)`
    Vector,
    /// `matrix(a)`
    Matrix,
    /// `scalar(a)`
    Scalar,
    /// `transpose(a)`
    Transpose,
    /// `symmetric(a)`
    Symmetric,
    /// `outerProduct(v, w)`
    OuterProduct,
    /// `cross(v, w)`
    Cross,
    /// `skew(v)`
    Skew,
    /// `sum(a)`, `sum(... for ...)`
    Sum,
    /// `product(a)`, `product(... for ...)`
    Product,
    /// `min(a)`, `min(a, b)`, `min(... for ...)`
    Min,
    /// `max(a)`, `max(a, b)`, `max(... for ...)`
    Max,
    /// `integer(x)`: the largest Integer not above
    Floored,
    /// `Integer(literal of an enumeration)`
    Ordinal,
    /// `String(value, ...)`
    Text,
    /// `getInstanceName()`: the path of the instance around
    InstanceName,
    /// `cardinality(c)`: how often a connector is connected
    Cardinality,
    /// `Connections.isRoot(r)`: whether an overdetermined record was chosen as a root
    IsRoot,
    /// `Connections.rooted(r)`: whether it is nearer to the root than the other one of its branch
    Rooted,
    /// An elementary function of one or two arguments, element by element; `min` and `max` are not among them
    Elementary(Function),
    /// What the language profile leaves out, and the sentence that says so
    Outside(&'static str),
}

/// A row of the table.
struct Row {
    name: &'static str,
    builtin: Builtin,
    /// A declaration of the same name hides it; operators with special meaning cannot be declared (3.7).
    hidden: bool,
    /// It has a value at translation where its arguments have one.
    before_run: bool,
}

/// The package of the language that overdetermined records are spoken of with.
const CONNECTIONS: &str = "Connections";

const fn operator(name: &'static str, builtin: Builtin) -> Row {
    Row { name, builtin, hidden: false, before_run: false }
}

const fn transparent(name: &'static str, builtin: Builtin) -> Row {
    Row { name, builtin, hidden: false, before_run: true }
}

const fn function(name: &'static str, builtin: Builtin) -> Row {
    Row { name, builtin, hidden: true, before_run: true }
}

/// Their names were free until clocks came, so declarations of the same name hide them.
const fn clocked(name: &'static str, builtin: Builtin) -> Row {
    Row { name, builtin, hidden: true, before_run: false }
}

const fn outside(name: &'static str, sentence: &'static str, hidden: bool) -> Row {
    Row { name, builtin: Builtin::Outside(sentence), hidden, before_run: false }
}

/// All but the elementary functions, whose table stands in `hyd_system::math`.
const TABLE: &[Row] = &[
    operator("der", Builtin::Der),
    operator("pre", Builtin::Pre),
    operator("edge", Builtin::Edge),
    operator("change", Builtin::Change),
    operator("initial", Builtin::Initial),
    operator("terminal", Builtin::Terminal),
    operator("sample", Builtin::Sample),
    operator("delay", Builtin::Delay),
    transparent("noEvent", Builtin::NoEvent),
    transparent("smooth", Builtin::Smooth),
    transparent("homotopy", Builtin::Homotopy),
    operator("semiLinear", Builtin::SemiLinear),
    operator("inStream", Builtin::InStream),
    operator("actualStream", Builtin::ActualStream),
    operator("reinit", Builtin::Reinit),
    function("size", Builtin::Size),
    function("ndims", Builtin::Ndims),
    function("zeros", Builtin::Zeros),
    function("ones", Builtin::Ones),
    function("fill", Builtin::Fill),
    function("identity", Builtin::Identity),
    function("array", Builtin::Array),
    function("linspace", Builtin::Linspace),
    function("diagonal", Builtin::Diagonal),
    function("cat", Builtin::Cat),
    function("vector", Builtin::Vector),
    function("matrix", Builtin::Matrix),
    function("scalar", Builtin::Scalar),
    function("transpose", Builtin::Transpose),
    function("symmetric", Builtin::Symmetric),
    function("outerProduct", Builtin::OuterProduct),
    function("cross", Builtin::Cross),
    function("skew", Builtin::Skew),
    function("sum", Builtin::Sum),
    function("product", Builtin::Product),
    function("min", Builtin::Min),
    function("max", Builtin::Max),
    function("integer", Builtin::Floored),
    transparent("Integer", Builtin::Ordinal),
    transparent("String", Builtin::Text),
    transparent("getInstanceName", Builtin::InstanceName),
    transparent("cardinality", Builtin::Cardinality),
    transparent("Connections.isRoot", Builtin::IsRoot),
    transparent("Connections.rooted", Builtin::Rooted),
    outside("spatialDistribution", "`spatialDistribution` is outside the language profile", false),
    clocked("hold", Builtin::Hold),
    clocked("previous", Builtin::Previous),
    clocked("subSample", Builtin::SubSample),
    clocked("superSample", Builtin::SuperSample),
    clocked("shiftSample", Builtin::ShiftSample),
    clocked("backSample", Builtin::BackSample),
    clocked("noClock", Builtin::NoClock),
    clocked("interval", Builtin::Interval),
    clocked("firstTick", Builtin::FirstTick),
    clocked("Clock", Builtin::Clock),
];

/// True for the name of an operator that says something of overdetermined records, as `Connections.branch`.
pub fn speaks_of_connections(function: &ComponentRef) -> bool {
    function.parts.len() == 2 && &*function.parts[0].name.name == CONNECTIONS
}

fn row(name: &str) -> Option<&'static Row> {
    TABLE.iter().find(|row| row.name == name)
}

impl Builtin {
    /// The function or operator of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        row(name).map(|row| row.builtin).or_else(|| Function::from_name(name).map(Builtin::Elementary))
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Builtin::Elementary(function) => function.name(),
            _ => TABLE.iter().find(|row| row.builtin == self).map_or("", |row| row.name),
        }
    }

    /// Names of all that gives a value, for suggestions.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let own = TABLE.iter().filter(|row| !matches!(row.builtin, Builtin::Reinit | Builtin::Outside(_)));
        let elementary = Function::ALL.iter().filter(|&&f| Function::from_name(f.name()).is_some()).map(|f| f.name());
        own.map(|row| row.name).chain(elementary.filter(|name| row(name).is_none()))
    }

    /// True if a declaration of its name hides what the language means by it.
    pub fn can_be_hidden(self) -> bool {
        matches!(self, Builtin::Elementary(_)) || row(self.name()).is_some_and(|row| row.hidden)
    }

    /// True if it has a value at translation where its arguments have one.
    pub fn is_known_before_run(self) -> bool {
        matches!(self, Builtin::Elementary(_)) || row(self.name()).is_some_and(|row| row.before_run)
    }

    /// True if its value comes from the run, whatever its arguments are.
    pub fn reads_run(self) -> bool {
        use Builtin::{ActualStream, Change, Der, Edge, InStream, Initial, Pre, Sample, Terminal};
        matches!(self, Der | Pre | Edge | Change | Initial | Terminal | Sample | InStream | ActualStream)
            || self.is_of_clocks()
    }

    /// True if clocks are what it is about; `sample` may be, too.
    pub fn is_of_clocks(self) -> bool {
        use Builtin::{BackSample, Clock, FirstTick, Hold, Interval, NoClock, Previous};
        use Builtin::{ShiftSample, SubSample, SuperSample};
        matches!(
            self,
            Hold | Previous
                | SubSample
                | SuperSample
                | ShiftSample
                | BackSample
                | NoClock
                | Interval
                | FirstTick
                | Clock
        )
    }

    /// True if its value depends on the sizes of its first argument only.
    pub fn asks_for_sizes(self) -> bool {
        matches!(self, Builtin::Size | Builtin::Ndims)
    }

    /// True if the value of its first argument does not matter.
    pub fn asks_for_no_value(self) -> bool {
        self.asks_for_sizes() || self.asks_for_connections()
    }

    /// True if its value follows from how its argument is connected.
    pub fn asks_for_connections(self) -> bool {
        matches!(self, Builtin::Cardinality | Builtin::IsRoot | Builtin::Rooted)
    }

    /// True for the name of a function that does not look at the value of its first argument; no declaration may hide those.
    pub fn of_sizes(function: &ComponentRef) -> bool {
        Self::named_by(function).is_some_and(Self::asks_for_no_value)
    }

    /// The function or operator of the language that a name means where no declaration hides it.
    pub fn named_by(function: &ComponentRef) -> Option<Self> {
        match function.parts.as_slice() {
            [only] => Self::from_name(&only.name.name),
            [_, name] if speaks_of_connections(function) => {
                Self::from_name(&format!("{CONNECTIONS}.{}", name.name.name))
            }
            _ => None,
        }
    }

    /// True if it reduces an array to a scalar.
    pub fn is_fold(self) -> bool {
        matches!(self, Builtin::Sum | Builtin::Product | Builtin::Min | Builtin::Max)
    }

    /// True if it rearranges arrays, each element being one of an argument.
    pub fn is_array_function(self) -> bool {
        use Builtin::{Cat, Cross, Diagonal, Matrix, OuterProduct, Scalar, Skew, Symmetric, Transpose, Vector};
        matches!(self, Diagonal | Cat | Vector | Matrix | Scalar | Transpose | Symmetric | OuterProduct | Cross | Skew)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_name_stands_once_and_is_found() {
        let names: Vec<&str> = Builtin::names().collect();
        for (k, name) in names.iter().enumerate() {
            assert!(!names[..k].contains(name), "{name}");
            assert_eq!(Builtin::from_name(name).map(Builtin::name), Some(*name));
        }
        assert_eq!(Builtin::from_name("sin"), Some(Builtin::Elementary(Function::Sin)));
        assert_eq!(Builtin::from_name("pow"), None);
    }
}
