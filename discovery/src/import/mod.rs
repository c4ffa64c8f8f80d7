//! Files of a lab as a set of shots: what is assumed about them, and the tables, the set and a first study that come of it.
//!
//! Assumptions are data ([`Plan`]): `assume` makes them of files about which nobody has said anything, a person may edit their text, and
//! `carry_out` follows them.  So everything that is assumed can be read and changed.  No file is opened here.

mod assume;
mod carry;
mod clocks;
mod decode;
mod fields;
mod layout;
mod plan;
mod raw;
mod stamp;
mod starter;
mod table;
#[cfg(test)]
mod tests;
mod unit;

pub use assume::Assumptions;
pub use carry::Imported;
pub use plan::Plan;
pub use raw::Content;

/// A file of a folder.
pub struct RawFile {
    /// Its name in the folder.
    pub name: String,
    /// What it holds.
    pub content: Content,
}

/// What a person has said about all files.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// Samples per second.
    pub rate: Option<f64>,
    /// Columns of times; those that look like it where there are none.
    pub time: Vec<String>,
    /// Column of the trigger.
    pub trigger: Option<String>,
    /// No column is taken for a trigger.
    pub no_trigger: bool,
    /// Rows whose time is that of the row before are left out.
    pub drop_repeated: bool,
    /// Columns that are left out.
    pub skip: Vec<String>,
}
