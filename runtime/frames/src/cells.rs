//! The values of a column.

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// 64-bit floating point numbers.
    Number,
    /// 64-bit integers.
    Whole,
    /// UTF-8 texts.
    Text,
}

/// A part of a column.
#[derive(Clone, PartialEq, Debug)]
pub enum Cells {
    /// Floating point numbers.
    Numbers(Vec<f64>),
    /// Integers.
    Wholes(Vec<i64>),
    /// Texts.
    Texts(Vec<String>),
}

impl Cells {
    /// An empty column.
    pub fn new(kind: Kind) -> Self {
        match kind {
            Kind::Number => Cells::Numbers(Vec::new()),
            Kind::Whole => Cells::Wholes(Vec::new()),
            Kind::Text => Cells::Texts(Vec::new()),
        }
    }

    /// What it holds.
    pub fn kind(&self) -> Kind {
        match self {
            Cells::Numbers(_) => Kind::Number,
            Cells::Wholes(_) => Kind::Whole,
            Cells::Texts(_) => Kind::Text,
        }
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Cells::Numbers(values) => values.len(),
            Cells::Wholes(values) => values.len(),
            Cells::Texts(values) => values.len(),
        }
    }

    /// Appends cells of the same kind; false, and nothing is appended, if they are of another one.
    pub fn append(&mut self, other: Cells) -> bool {
        match (self, other) {
            (Cells::Numbers(own), Cells::Numbers(mut other)) => own.append(&mut other),
            (Cells::Wholes(own), Cells::Wholes(mut other)) => own.append(&mut other),
            (Cells::Texts(own), Cells::Texts(mut other)) => own.append(&mut other),
            _ => return false,
        }
        true
    }

    /// Takes the first `count` values away, or all if there are fewer.
    pub fn split_first(&mut self, count: usize) -> Cells {
        fn first<T>(values: &mut Vec<T>, count: usize) -> Vec<T> {
            let rest = values.split_off(count.min(values.len()));
            std::mem::replace(values, rest)
        }
        match self {
            Cells::Numbers(values) => Cells::Numbers(first(values, count)),
            Cells::Wholes(values) => Cells::Wholes(first(values, count)),
            Cells::Texts(values) => Cells::Texts(first(values, count)),
        }
    }

    /// True without values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
