//! The map of a library: texts in, one HTML page out, for `hyd doc`; or what there is to say of one class, as data (`described`).
//!
//! [`Library`] parses the texts and knows their classes by name (`library`, `lookup`); for each class the page (`page`) shows what it
//! inherits, its connectors, its parameters with units and limits (`members`), its equations typeset as MathML (`equations`,
//! `mathml`), its text, the pictures of examples that use it, and links both ways.  The page needs nothing but itself.
//! Names are looked up in the texts as far as links and units need it; nothing is instantiated, and whether the texts are
//! correct is for the compiler to say.

mod described;
mod entities;
mod equations;
pub mod html;
mod library;
mod lookup;
pub mod mathml;
mod members;
mod page;
mod sections;

pub use described::{Described, Inside, Item};
pub use library::{Library, Source};
pub use page::{Example, Page};
