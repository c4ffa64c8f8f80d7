//! Typed indices and the tables they address.
//!
//! An entity (equation, variable, template, block …) is identified by a small typed index and never by a bare
//! `usize` or a string, so that mixing up two tables is a type error.  `IndexVec<I, T>` is a `Vec<T>` that only
//! accepts `I`.  Nothing else lives here.

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

/// An index into one kind of table.  Made by [`typed_index!`].
pub trait TypedIndex: Copy + Eq + Ord + fmt::Debug {
    /// From a position; positions beyond `u32::MAX` are a programming error and panic.
    fn new(position: usize) -> Self;
    /// The position in the table.
    fn index(self) -> usize;
}

/// Declares a `u32` index type: `typed_index!(EqId, "eq")` prints as `eq12`.
#[macro_export]
macro_rules! typed_index {
    ($(#[$meta:meta])* $name:ident, $prefix:literal) => {
        $(#[$meta])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $crate::TypedIndex for $name {
            #[inline]
            fn new(position: usize) -> Self {
                assert!(position <= u32::MAX as usize, "invariant: tables hold at most 2^32 entries");
                Self(position as u32)
            }
            #[inline]
            fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl ::std::fmt::Debug for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                write!(f, concat!($prefix, "{}"), self.0)
            }
        }

        impl ::std::fmt::Display for $name {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                write!(f, concat!($prefix, "{}"), self.0)
            }
        }
    };
}

/// A vector addressed by one typed index.
#[derive(Clone, PartialEq, Eq)]
pub struct IndexVec<I, T> {
    /// The entries, in index order.
    pub raw: Vec<T>,
    marker: PhantomData<fn(I) -> I>,
}

impl<I: TypedIndex, T> IndexVec<I, T> {
    /// An empty table.
    pub fn new() -> Self {
        Self::from_vec(Vec::new())
    }

    /// A table over the given entries.
    pub fn from_vec(raw: Vec<T>) -> Self {
        Self { raw, marker: PhantomData }
    }

    /// `count` copies of `value`.
    pub fn filled(value: T, count: usize) -> Self
    where
        T: Clone,
    {
        Self::from_vec(vec![value; count])
    }

    /// Appends an entry and returns its index.
    pub fn push(&mut self, value: T) -> I {
        let id = I::new(self.raw.len());
        self.raw.push(value);
        id
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.raw.len()
    }

    /// True without entries.
    pub fn is_empty(&self) -> bool {
        self.raw.is_empty()
    }

    /// The index the next pushed entry will get.
    pub fn next_index(&self) -> I {
        I::new(self.raw.len())
    }

    /// All indices in order.
    pub fn indices(&self) -> impl DoubleEndedIterator<Item = I> + use<I, T> {
        (0..self.raw.len()).map(I::new)
    }

    /// All entries in order.
    pub fn iter(&self) -> std::slice::Iter<'_, T> {
        self.raw.iter()
    }

    /// All entries with their indices.
    pub fn iter_enumerated(&self) -> impl DoubleEndedIterator<Item = (I, &T)> {
        self.raw.iter().enumerate().map(|(k, value)| (I::new(k), value))
    }

    /// The entry, if the index is inside the table.
    pub fn get(&self, id: I) -> Option<&T> {
        self.raw.get(id.index())
    }
}

impl<I: TypedIndex, T> Default for IndexVec<I, T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<I: TypedIndex, T> Index<I> for IndexVec<I, T> {
    type Output = T;
    #[inline]
    fn index(&self, id: I) -> &T {
        &self.raw[id.index()]
    }
}

impl<I: TypedIndex, T> IndexMut<I> for IndexVec<I, T> {
    #[inline]
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.raw[id.index()]
    }
}

impl<I, T: fmt::Debug> fmt::Debug for IndexVec<I, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(&self.raw).finish()
    }
}
