//! Sizes of what functions of the language give, from those of their arguments (Modelica 3.6, sections 10.3.1 to 10.3.5).

use hyd_source::{Code, Span};

use super::Builtin;

/// What the sizes of a call follow from: its arguments, looked at as far as needed.
pub trait SizesOf {
    /// Why a size is not known.
    type Fail;

    /// How many arguments there are.
    fn count(&self) -> usize;

    /// The sizes of argument `k`.
    ///
    /// # Errors
    /// When they are not known; reported.
    fn sizes(&mut self, k: usize) -> Result<Vec<usize>, Self::Fail>;

    /// Argument `k` as a size or a dimension.
    ///
    /// # Errors
    /// When it is no number from 0, or not known; reported.
    fn number(&mut self, k: usize) -> Result<usize, Self::Fail>;

    /// Reports a fault.
    fn fault(&mut self, fault: SizeFault) -> Self::Fail;
}

/// Why arguments do not go together.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SizeFault {
    /// How many arguments it takes, and how many there are.
    Count(usize, usize),
    /// There is no array to put together.
    NoArray,
    /// Argument with sizes that the function does not take, and what it takes.
    Argument(usize, Vec<usize>, &'static str),
    /// A dimension that arrays with so many dimensions do not have.
    Dimension(usize, usize),
    /// An argument with other sizes than those before it.
    Different(usize, Vec<usize>, Vec<usize>),
}

impl SizeFault {
    /// The message for a call of `function`.
    pub fn message(&self, function: Builtin) -> (Code, String) {
        let name = function.name();
        match self {
            SizeFault::Count(wanted, given) => {
                let plural = if *wanted == 1 { "" } else { "s" };
                (Code::BadArguments, format!("`{name}` takes {wanted} argument{plural}, not {given}"))
            }
            SizeFault::NoArray => (Code::BadArguments, format!("`{name}` takes a dimension and at least one array")),
            SizeFault::Argument(_, sizes, wanted) => {
                (Code::ArrayShape, format!("`{name}` takes {wanted}, but this has the sizes {}", sizes_text(sizes)))
            }
            SizeFault::Dimension(along, rank) => {
                (Code::ArrayShape, format!("`{name}` along dimension {along} of arrays with {rank} dimensions"))
            }
            SizeFault::Different(_, first, other) => {
                let (first, other) = (sizes_text(first), sizes_text(other));
                (Code::ArrayShape, format!("the arrays put together have different sizes: {first} and {other}"))
            }
        }
    }

    /// Where it is: the argument, or the call.
    pub fn place(&self, argument: impl Fn(usize) -> Span, call: Span) -> Span {
        match self {
            SizeFault::Count(..) | SizeFault::NoArray => call,
            SizeFault::Argument(k, ..) | SizeFault::Different(k, ..) => argument(*k),
            SizeFault::Dimension(..) => argument(0),
        }
    }
}

/// Sizes for messages: `[3, 4]`, `scalar`.
pub fn sizes_text(sizes: &[usize]) -> String {
    if sizes.is_empty() { "scalar".into() } else { format!("{sizes:?}") }
}

impl Builtin {
    /// The sizes of a call.
    ///
    /// # Errors
    /// When sizes of arguments are not known, or do not fit; reported by `arguments`.
    pub fn sizes<A: SizesOf>(self, arguments: &mut A) -> Result<Vec<usize>, A::Fail> {
        use Builtin::*;
        let numbers = |arguments: &mut A, from: usize| -> Result<Vec<usize>, A::Fail> {
            (from..arguments.count()).map(|k| arguments.number(k)).collect()
        };
        let nth = |arguments: &mut A, k: usize| match arguments.count() > k {
            true => arguments.sizes(k),
            false => Ok(Vec::new()),
        };
        match self {
            Zeros | Ones => numbers(arguments, 0),
            Fill => {
                let mut sizes = numbers(arguments, 1)?;
                sizes.extend(nth(arguments, 0)?);
                Ok(sizes)
            }
            Identity => match arguments.count() {
                1 => arguments.number(0).map(|n| vec![n, n]),
                given => Err(arguments.fault(SizeFault::Count(1, given))),
            },
            Linspace if arguments.count() > 2 => Ok(vec![arguments.number(2)?]),
            Size if arguments.count() == 1 => Ok(vec![arguments.sizes(0)?.len()]),
            Min | Max if arguments.count() == 1 => Ok(Vec::new()),
            Der | Pre | NoEvent | Edge | Change | Homotopy | Floored | Delay | InStream | ActualStream | Sample
            | Hold | Previous | SubSample | SuperSample | ShiftSample | BackSample | NoClock => nth(arguments, 0),
            Smooth => nth(arguments, 1),
            Size | Ndims | Linspace | Sum | Product | Initial | Terminal | Ordinal | Text | Reinit | Interval
            | FirstTick | Clock | Outside(_) => Ok(Vec::new()),
            Cat => sizes_of_cat(arguments),
            _ if self.is_array_function() => self.sizes_of_array_function(arguments),
            // Element by element; scalars go with all.
            _ => {
                for k in 0..arguments.count() {
                    let sizes = arguments.sizes(k)?;
                    if !sizes.is_empty() {
                        return Ok(sizes);
                    }
                }
                Ok(Vec::new())
            }
        }
    }

    fn sizes_of_array_function<A: SizesOf>(self, arguments: &mut A) -> Result<Vec<usize>, A::Fail> {
        use Builtin::*;
        let count = if matches!(self, OuterProduct | Cross) { 2 } else { 1 };
        let given = arguments.count();
        if given != count {
            return Err(arguments.fault(SizeFault::Count(count, given)));
        }
        let sizes = arguments.sizes(0)?;
        let long = sizes.iter().filter(|&&size| size > 1).count();
        let wanted = match self {
            Diagonal if sizes.len() == 1 => return Ok(vec![sizes[0]; 2]),
            Diagonal => "a vector",
            Vector if long <= 1 => return Ok(vec![sizes.iter().product()]),
            Vector => "an array with at most one size above 1",
            Matrix if sizes.iter().skip(2).all(|&size| size == 1) => {
                return Ok((0..2).map(|k| sizes.get(k).copied().unwrap_or(1)).collect());
            }
            Matrix => "an array whose third and further sizes are 1",
            Scalar if sizes.iter().all(|&size| size == 1) => return Ok(Vec::new()),
            Scalar => "an array with one element",
            Transpose if sizes.len() >= 2 => {
                let mut turned = sizes;
                turned.swap(0, 1);
                return Ok(turned);
            }
            Transpose => "a matrix",
            Symmetric if sizes.len() == 2 && sizes[0] == sizes[1] => return Ok(sizes),
            Symmetric => "a square matrix",
            Skew if sizes == [3] => return Ok(vec![3, 3]),
            Skew => "a vector of 3 elements",
            _ => {
                let other = arguments.sizes(1)?;
                for (k, own) in [&sizes, &other].into_iter().enumerate() {
                    let wanted = if self == Cross { "vectors of 3 elements" } else { "vectors" };
                    if self == Cross && own != &[3] || own.len() != 1 {
                        return Err(arguments.fault(SizeFault::Argument(k, own.clone(), wanted)));
                    }
                }
                return Ok(if self == Cross { sizes } else { vec![sizes[0], other[0]] });
            }
        };
        Err(arguments.fault(SizeFault::Argument(0, sizes, wanted)))
    }
}

/// `cat(k, a, b, ...)`: all sizes but the k-th agree.
fn sizes_of_cat<A: SizesOf>(arguments: &mut A) -> Result<Vec<usize>, A::Fail> {
    if arguments.count() < 2 {
        return Err(arguments.fault(SizeFault::NoArray));
    }
    let along = arguments.number(0)?;
    let mut sizes = arguments.sizes(1)?;
    let Some(k) = along.checked_sub(1).filter(|&k| k < sizes.len()) else {
        return Err(arguments.fault(SizeFault::Dimension(along, sizes.len())));
    };
    for part in 2..arguments.count() {
        let other = arguments.sizes(part)?;
        let mut fitting = other.clone();
        if let Some(size) = fitting.get_mut(k) {
            *size = sizes[k];
        }
        if sizes != fitting {
            return Err(arguments.fault(SizeFault::Different(part, sizes, fitting)));
        }
        sizes[k] += other[k];
    }
    Ok(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Arguments with these sizes; those of one size are numbers, too.
    struct Given(&'static [&'static [usize]]);

    impl SizesOf for Given {
        type Fail = SizeFault;

        fn count(&self) -> usize {
            self.0.len()
        }

        fn sizes(&mut self, k: usize) -> Result<Vec<usize>, SizeFault> {
            Ok(self.0[k].to_vec())
        }

        fn number(&mut self, k: usize) -> Result<usize, SizeFault> {
            Ok(self.0[k][0])
        }

        fn fault(&mut self, fault: SizeFault) -> SizeFault {
            fault
        }
    }

    /// Sizes from the definitions of section 10.3.
    #[test]
    fn sizes_follow_their_definitions() {
        let of = |name: &str, given: &'static [&'static [usize]]| {
            Builtin::from_name(name).expect("a function of the language").sizes(&mut Given(given))
        };
        assert_eq!(of("fill", &[&[2], &[3], &[4]]), Ok(vec![3, 4, 2]));
        assert_eq!(of("identity", &[&[3]]), Ok(vec![3, 3]));
        assert_eq!(of("cat", &[&[2], &[3, 4], &[3, 5]]), Ok(vec![3, 9]));
        assert_eq!(of("cat", &[&[3], &[3, 4]]), Err(SizeFault::Dimension(3, 2)));
        assert_eq!(of("cat", &[&[1], &[3, 4], &[2, 5]]), Err(SizeFault::Different(2, vec![3, 4], vec![3, 5])));
        assert_eq!(of("transpose", &[&[3, 4]]), Ok(vec![4, 3]));
        assert_eq!(of("outerProduct", &[&[3], &[4]]), Ok(vec![3, 4]));
        assert_eq!(of("cross", &[&[3], &[4]]), Err(SizeFault::Argument(1, vec![4], "vectors of 3 elements")));
        assert_eq!(of("scalar", &[&[1, 1]]), Ok(vec![]));
        assert_eq!(of("min", &[&[3]]), Ok(vec![]));
        assert_eq!(of("min", &[&[], &[3]]), Ok(vec![3]));
        assert_eq!(of("atan2", &[&[2], &[]]), Ok(vec![2]));
    }
}
