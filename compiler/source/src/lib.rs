//! Where things stand in the text, and what is said about them.
//!
//! A file table ([`Files`]), byte spans in a file ([`Span`]), the origin of a variable or an equation ([`Origin`]), and
//! diagnostics as plain data ([`Diagnostic`]) with codes from one table ([`codes`]).  Knows no stage and no renderer.

pub mod codes;
mod diagnostic;
mod dotted;
mod files;
mod messages;

pub use codes::Code;
pub use diagnostic::{
    Diagnostic, Edit, Label, Outcome, Proposal, Reported, Severity, closest, did_you_mean, edit_distance,
};
pub use dotted::dotted;
pub use files::{FileId, Files, Location, Origin, Span};
pub use messages::Messages;
