//! Executables of `hyd build`: every model of the repository from a bare environment, the command line, damaged files.
//!
//! An executable is judged by the bytes of its results: they are those of `hyd simulate`.

#![allow(clippy::unwrap_used)]

mod command_line;
mod every_model;
mod kills;
mod launcher_parts;
mod payloads;
mod scratch;
#[cfg(unix)]
mod shared_sweeps;
