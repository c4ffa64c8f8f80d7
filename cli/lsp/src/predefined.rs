//! What the functions and operators of the language take, for those who call them (Modelica 3.6, sections 3.7, 10.3 and 16).

/// A way to call a function.
pub(crate) struct Call {
    /// The function.
    pub(crate) name: &'static str,
    /// What it takes, in order; `...` stands for any number more.
    pub(crate) takes: &'static [&'static str],
    /// What it gives.
    pub(crate) gives: &'static str,
}

const fn call(name: &'static str, takes: &'static [&'static str], gives: &'static str) -> Call {
    Call { name, takes, gives }
}

/// All ways to call all of them, those of one function together.
const CALLS: &[Call] = &[
    call("abs", &["x"], "the amount of x"),
    call("sign", &["x"], "1, 0 or -1, as x is above, at or below zero"),
    call("sqrt", &["x"], "the square root of x, which must not be negative"),
    call("sin", &["angle in rad"], "the sine"),
    call("cos", &["angle in rad"], "the cosine"),
    call("tan", &["angle in rad"], "the tangent"),
    call("asin", &["x"], "the angle in rad whose sine is x, from -pi/2 to pi/2"),
    call("acos", &["x"], "the angle in rad whose cosine is x, from 0 to pi"),
    call("atan", &["x"], "the angle in rad whose tangent is x, from -pi/2 to pi/2"),
    call("atan2", &["y", "x"], "the angle in rad of the point (x, y), from -pi to pi"),
    call("sinh", &["x"], "the hyperbolic sine"),
    call("cosh", &["x"], "the hyperbolic cosine"),
    call("tanh", &["x"], "the hyperbolic tangent"),
    call("exp", &["x"], "e to the power of x"),
    call("log", &["x"], "the natural logarithm of x, which must be positive"),
    call("log10", &["x"], "the logarithm to the base 10 of x, which must be positive"),
    call("floor", &["x"], "the largest integer that is not above x, as a Real"),
    call("ceil", &["x"], "the smallest integer that is not below x, as a Real"),
    call("integer", &["x"], "the largest integer that is not above x, as an Integer"),
    call("div", &["x", "y"], "x/y without what is behind the point"),
    call("mod", &["x", "y"], "x - floor(x/y)*y"),
    call("rem", &["x", "y"], "x - div(x, y)*y"),
    call("der", &["x"], "the derivative of x with respect to time"),
    call("pre", &["x"], "the value of a discrete x before the event"),
    call("edge", &["b"], "true at the event at which b becomes true"),
    call("change", &["x"], "true at events at which the discrete x changes"),
    call("initial", &[], "true at the start"),
    call("terminal", &[], "true at the end of the run"),
    call("sample", &["start", "interval"], "true at start and after each interval"),
    call("sample", &["u", "clock"], "u at the ticks of a clock"),
    call("delay", &["x", "delayTime"], "x as it was so many seconds ago; the delay does not change"),
    call("delay", &["x", "delayTime", "delayMax"], "x as it was so many seconds ago, at most delayMax"),
    call("noEvent", &["x"], "x, whose relations cause no events"),
    call("smooth", &["order", "x"], "x, which has so many continuous derivatives: its relations need no events"),
    call("homotopy", &["actual", "simplified"], "actual; the start may be found from simplified"),
    call("semiLinear", &["x", "positiveSlope", "negativeSlope"], "x times the slope of its side of zero"),
    call("inStream", &["v"], "what a stream variable is when the flow goes into the component"),
    call("actualStream", &["v"], "what a stream variable is for the flow as it is"),
    call("reinit", &["x", "value"], "gives the state x another value at an event"),
    call("assert", &["condition", "message"], "ends the run with the message when the condition is false"),
    call("assert", &["condition", "message", "level"], "warns instead where the level is AssertionLevel.warning"),
    call("terminate", &["message"], "ends the run as planned"),
    call("size", &["A"], "the sizes of an array, as a vector"),
    call("size", &["A", "dimension"], "one of the sizes of an array"),
    call("ndims", &["A"], "how many dimensions an array has"),
    call("zeros", &["n", "..."], "an array of zeros of these sizes"),
    call("ones", &["n", "..."], "an array of ones of these sizes"),
    call("fill", &["value", "n", "..."], "an array of these sizes, each element of which is the value"),
    call("identity", &["n"], "the unit matrix of n rows"),
    call("array", &["a", "..."], "{a, ...}"),
    call("linspace", &["first", "last", "n"], "n numbers at equal distances"),
    call("diagonal", &["v"], "a matrix with the elements of v in its diagonal"),
    call("cat", &["dimension", "A", "..."], "arrays put together along a dimension"),
    call("vector", &["A"], "the elements of an array of which only one size is above 1"),
    call("matrix", &["A"], "an array with two dimensions"),
    call("scalar", &["A"], "the only element of an array"),
    call("transpose", &["A"], "rows and columns exchanged"),
    call("symmetric", &["A"], "the matrix whose lower half mirrors the upper half of A"),
    call("outerProduct", &["a", "b"], "the matrix of all products of two vectors"),
    call("cross", &["a", "b"], "the cross product of vectors of three elements"),
    call("skew", &["a"], "the matrix S for which S*b is cross(a, b)"),
    call("sum", &["A"], "the sum of all elements; also `sum(e for i in range)`"),
    call("product", &["A"], "the product of all elements; also `product(e for i in range)`"),
    call("min", &["A"], "the least element; also `min(e for i in range)`"),
    call("min", &["x", "y"], "the lesser one"),
    call("max", &["A"], "the greatest element; also `max(e for i in range)`"),
    call("max", &["x", "y"], "the greater one"),
    call("Integer", &["e"], "the number of a literal, from 1"),
    call("String", &["x", "significantDigits", "minimumLength", "leftJustified"], "x as a text"),
    call("connect", &["a", "b"], "joins two connectors"),
    call("cardinality", &["c"], "how many connections a connector has"),
    call("hold", &["u"], "a clocked value between its ticks"),
    call("previous", &["u"], "a clocked value at the tick before"),
    call("subSample", &["u", "factor"], "u at every so manieth tick"),
    call("superSample", &["u", "factor"], "u with so many ticks for one"),
    call("shiftSample", &["u", "shiftCounter", "resolution"], "u later by a part of its interval"),
    call("backSample", &["u", "backCounter", "resolution"], "u earlier by a part of its interval"),
    call("noClock", &["u"], "u as it is, whatever its clock"),
    call("interval", &["u"], "the time since the tick before"),
    call("firstTick", &["u"], "true at the first tick"),
    call("Clock", &["interval"], "a clock that ticks at equal distances of time"),
    call("Clock", &["intervalCounter", "resolution"], "a clock whose interval is intervalCounter/resolution seconds"),
    call("Clock", &["condition", "startInterval"], "a clock that ticks when the condition becomes true"),
    call("Clock", &["c", "solverMethod"], "the clock c, for equations that are solved by this method"),
];

/// The ways to call a function of the language.
pub(crate) fn calls(name: &str) -> impl Iterator<Item = &'static Call> {
    CALLS.iter().filter(move |call| call.name == name)
}

#[cfg(test)]
mod tests {
    use hyd_instance::Builtin;

    /// Each function that is proposed tells what it takes.
    #[test]
    fn all_functions_of_the_language_are_told() {
        let plain = |name: &&str| !name.contains('.') && !matches!(*name, "getInstanceName");
        let missing: Vec<&str> =
            Builtin::names().filter(plain).filter(|name| super::calls(name).next().is_none()).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }
}
