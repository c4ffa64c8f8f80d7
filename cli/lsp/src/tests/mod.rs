//! The server as a whole, over a connection in memory.

mod client;
mod completions;
mod desk;
mod hovers;
mod inlays;
mod outlines;
mod random_edits;
mod renames;
mod slips;
