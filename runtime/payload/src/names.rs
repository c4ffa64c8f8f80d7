//! What messages call rows and variables: patterns of names, and who is which of them.
//!
//! Names of single elements are made when a message needs them; a model with a million rows stores a million small records.

use hyd_system::NamePattern;

/// What a variable stands for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wrap {
    /// Itself.
    Value,
    /// Its derivative.
    Rate,
    /// Its value before the event.
    Before,
    /// Its start value.
    Start,
}

/// One scalar: a pattern of [`Names`] and an element of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Name {
    /// Index of the pattern.
    pub pattern: u32,
    /// Element.
    pub element: u32,
    /// What of it.
    pub wrap: Wrap,
}

/// Patterns of all variables, those that reports do not show included.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Names(pub Vec<NamePattern>);

impl Names {
    /// The name in the user's words.
    pub fn text(&self, name: Name) -> String {
        let bare = self.0.get(name.pattern as usize).map_or_else(String::new, |p| p.element(name.element as usize));
        match name.wrap {
            Wrap::Value => bare,
            Wrap::Rate => format!("der({bare})"),
            Wrap::Before => format!("pre({bare})"),
            Wrap::Start => format!("{bare}.start"),
        }
    }
}

/// Where the rows of a plan come from: its assignments, then its residuals.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct RowNames {
    /// Index into `Tables::equations` of each row.
    pub equations: Vec<u32>,
    /// What each of them determines.
    pub targets: Vec<Option<Name>>,
}
