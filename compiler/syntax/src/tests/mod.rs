//! The crate as its users see it: expressions, whole files, limits, and the messages for faulty texts.

mod expressions;
mod files;
mod limits;
mod messages;
mod messages_of_parts;
mod said;
