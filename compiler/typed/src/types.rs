//! Types of expressions: what one element is, and how many dimensions there are.
//!
//! Sizes are values: they may depend on parameters, on loop counters and on the arguments of a call, and are asked for where these are
//! known.  The number of dimensions is part of the type (Modelica 3.6, chapter 10).

use std::rc::Rc;

use hyd_instance::{ClassId, InstId, ScalarType};
use hyd_syntax::tree::Name;

/// What one element is.
#[derive(Clone, PartialEq, Debug)]
pub enum Base {
    /// A value of a predefined type or an enumeration.
    Scalar(ScalarType),
    /// A record.
    Record(Rc<RecordType>),
    /// A function, by the type of its first result.
    Function(Rc<Type>),
    /// No value, or one whose type a message speaks of already.
    None,
}

/// The fields of a record.
#[derive(PartialEq, Debug)]
pub struct RecordType {
    /// Name of its class.
    pub name: String,
    /// Its class, where that is known.
    pub class: Option<ClassId>,
    /// The scope of its text, where it is one that a declaration names: what its fields are declared with is asked by it.
    pub inst: Option<InstId>,
    /// Fields in the order of the text.
    pub fields: Vec<(Name, Type)>,
}

/// The type of an expression.
#[derive(Clone, PartialEq, Debug)]
pub struct Type {
    /// What one element is.
    pub base: Base,
    /// Number of dimensions.
    pub rank: usize,
}

impl Type {
    /// No value.
    pub const NONE: Type = Type { base: Base::None, rank: 0 };

    /// A scalar.
    pub const fn scalar(scalar: ScalarType) -> Self {
        Self { base: Base::Scalar(scalar), rank: 0 }
    }

    /// The same elements with another number of dimensions.
    pub fn with_rank(&self, rank: usize) -> Self {
        Self { base: self.base.clone(), rank }
    }

    /// True for a record or an array of records.
    pub fn is_record(&self) -> bool {
        matches!(self.base, Base::Record(_))
    }

    /// True for a String or an array of Strings.
    pub fn is_text(&self) -> bool {
        self.base == Base::Scalar(ScalarType::Text)
    }

    /// True for an external object.
    pub fn is_object(&self) -> bool {
        self.base == Base::Scalar(ScalarType::Object)
    }

    /// True for a function.
    pub fn is_function(&self) -> bool {
        matches!(self.base, Base::Function(_))
    }

    /// True for Integers.
    pub fn is_integer(&self) -> bool {
        self.base == Base::Scalar(ScalarType::Integer)
    }

    /// The type of a field, with the dimensions of the record in front of its own.
    pub fn field(&self, name: &str) -> Option<Type> {
        let Base::Record(record) = &self.base else { return None };
        let (_, ty) = record.fields.iter().find(|(field, _)| field.as_ref() == name)?;
        Some(ty.with_rank(self.rank + ty.rank))
    }

    /// What an expression is that is either of two: numbers of both kinds are Real.
    pub fn join(&self, other: &Type) -> Type {
        use ScalarType::{Integer, Real};
        let rank = self.rank.max(other.rank);
        match (&self.base, &other.base) {
            (Base::None, _) => other.with_rank(rank),
            (Base::Scalar(Integer), Base::Scalar(Real)) => other.with_rank(rank),
            _ => self.with_rank(rank),
        }
    }
}

/// The scalar type of a base that is a value; Real for all others.
pub fn scalar_of(base: &Base) -> ScalarType {
    match base {
        Base::Scalar(scalar) => scalar.clone(),
        _ => ScalarType::Real,
    }
}
