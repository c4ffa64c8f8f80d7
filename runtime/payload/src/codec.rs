//! Plain data to bytes and back: little-endian numbers, lengths before lists, a number before each choice.
//!
//! Reading never trusts a length: a list ends where the bytes do, and what cannot be is [`Damage`].  The order of the fields is the
//! format, so a change of any type that is written here is a new [`crate::format::VERSION`].

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use hyd_index::{IndexVec, TypedIndex};

/// The bytes are not what was written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Damage;

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("its contents cannot be read")
    }
}

/// Bytes that are still to be read.
pub(crate) struct Input<'a>(pub &'a [u8]);

impl<'a> Input<'a> {
    /// The next `count` bytes.
    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(Damage)?;
        self.0 = rest;
        Ok(taken)
    }

    /// The number before a list; every element takes a byte at least.
    fn length(&mut self) -> Result<usize, Damage> {
        let length = u64::get(self)?;
        usize::try_from(length).ok().filter(|&length| length <= self.0.len()).ok_or(Damage)
    }
}

/// What can be written and read.
pub(crate) trait Stored: Sized {
    /// Appends the value.
    fn put(&self, out: &mut Vec<u8>);
    /// Reads a value.
    fn get(input: &mut Input<'_>) -> Result<Self, Damage>;
}

macro_rules! numbers {
    ($($type:ty),*) => {$(
        impl Stored for $type {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }
            fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
                let bytes = input.take(size_of::<$type>())?;
                bytes.try_into().map(<$type>::from_le_bytes).map_err(|_| Damage)
            }
        }
    )*};
}
numbers!(u8, u32, i32, u64, f64);

/// Fields in their order, for structures.
macro_rules! stored {
    ($($type:ty { $($field:ident),* $(,)? })*) => {$(
        impl $crate::codec::Stored for $type {
            fn put(&self, out: &mut Vec<u8>) {
                $(self.$field.put(out);)*
            }
            fn get(input: &mut $crate::codec::Input<'_>) -> Result<Self, $crate::codec::Damage> {
                Ok(Self { $($field: $crate::codec::Stored::get(input)?),* })
            }
        }
    )*};
}

/// A number for each choice, then its fields.
macro_rules! choices {
    ($type:ident { $($number:literal => $variant:ident $(($($field:ident),*))?),* $(,)? }) => {
        impl $crate::codec::Stored for $type {
            fn put(&self, out: &mut Vec<u8>) {
                match self {
                    $($type::$variant $(($($field),*))? => {
                        out.push($number);
                        $($($field.put(out);)*)?
                    })*
                }
            }
            fn get(input: &mut $crate::codec::Input<'_>) -> Result<Self, $crate::codec::Damage> {
                match u8::get(input)? {
                    $($number => {
                        $($(let $field = $crate::codec::Stored::get(input)?;)*)?
                        Ok($type::$variant $(($($field),*))?)
                    })*
                    _ => Err($crate::codec::Damage),
                }
            }
        }
    };
}
pub(crate) use {choices, stored};

impl Stored for bool {
    fn put(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        match u8::get(input)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Damage),
        }
    }
}

impl Stored for usize {
    fn put(&self, out: &mut Vec<u8>) {
        (*self as u64).put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        usize::try_from(u64::get(input)?).map_err(|_| Damage)
    }
}

impl Stored for Arc<str> {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        // Most units and descriptions are empty, and the empty text is there already.
        match input.length()? {
            0 => Ok(Self::default()),
            length => std::str::from_utf8(input.take(length)?).map(Self::from).map_err(|_| Damage),
        }
    }
}

impl Stored for String {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        out.extend_from_slice(self.as_bytes());
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Arc::<str>::get(input).map(|text| text.to_string())
    }
}

impl<T: Stored> Stored for Option<T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.is_some().put(out);
        if let Some(value) = self {
            value.put(out);
        }
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        if bool::get(input)? { T::get(input).map(Some) } else { Ok(None) }
    }
}

impl<T: Stored> Stored for Vec<T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        self.iter().for_each(|value| value.put(out));
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        let length = input.length()?;
        (0..length).map(|_| T::get(input)).collect()
    }
}

impl<T: Stored> Stored for Arc<[T]> {
    fn put(&self, out: &mut Vec<u8>) {
        self.len().put(out);
        self.iter().for_each(|value| value.put(out));
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Vec::<T>::get(input).map(Arc::from)
    }
}

impl<I: TypedIndex, T: Stored> Stored for IndexVec<I, T> {
    fn put(&self, out: &mut Vec<u8>) {
        self.raw.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Vec::get(input).map(Self::from_vec)
    }
}

impl<A: Stored, B: Stored> Stored for (A, B) {
    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
        self.1.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        Ok((A::get(input)?, B::get(input)?))
    }
}

impl<T: Stored, const N: usize> Stored for [T; N] {
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.put(out));
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        let list = (0..N).map(|_| T::get(input)).collect::<Result<Vec<T>, Damage>>()?;
        list.try_into().map_err(|_| Damage)
    }
}

impl Stored for Range<u32> {
    fn put(&self, out: &mut Vec<u8>) {
        self.start.put(out);
        self.end.put(out);
    }

    fn get(input: &mut Input<'_>) -> Result<Self, Damage> {
        let range = u32::get(input)?..u32::get(input)?;
        if range.start <= range.end { Ok(range) } else { Err(Damage) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_and_a_length_is_not_trusted() {
        let value: Vec<(Option<f64>, Arc<str>)> = vec![(Some(-0.0), "a\u{e9}".into()), (None, "".into())];
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        assert_eq!(Vec::get(&mut Input(&bytes)), Ok(value));
        for end in 0..bytes.len() {
            assert_eq!(Vec::<(Option<f64>, Arc<str>)>::get(&mut Input(&bytes[..end])), Err(Damage), "{end}");
        }
        assert_eq!(Vec::<u8>::get(&mut Input(&u64::MAX.to_le_bytes())), Err(Damage));
        assert_eq!(bool::get(&mut Input(&[2])), Err(Damage));
        assert_eq!(Range::<u32>::get(&mut Input(&[2, 0, 0, 0, 1, 0, 0, 0])), Err(Damage));
    }
}
