//! Units for other tools by the Functional Mock-up Interface, versions 2.0 and 3.0 (Modelica Association, fmi-standard.org).
//!
//! A unit is an archive: a description of the model as XML, a shared library and what the library needs.  The library is prebuilt and
//! the same for all models; it reads the payload of the model from the folder `resources`.  Here stands what both sides share: which number names
//! which variable ([`Catalogue`]), and what only the maker needs: the descriptions ([`describe`]) and the archive ([`pack`]).
//! Nothing is known of texts of models, of their translation or of how they are solved.

mod archive;
mod around;
mod catalogue;
mod dependencies;
mod description;
mod facts;
mod terminals;
mod types;
mod units;
mod variables;
mod xml;

pub use archive::{INPUTS, PAYLOAD, Parts, TEXTS, identifier, pack, token};
pub use catalogue::{Catalogue, Meaning, Starts, TIME};
pub use description::{Descriptions, describe};
pub use facts::{Bounds, DeclaredType, End, Facts, KnownUnit, Terminal, Text, Version};
