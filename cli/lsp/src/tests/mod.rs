//! The server as a whole, over a connection in memory.

mod client;
mod random_edits;
