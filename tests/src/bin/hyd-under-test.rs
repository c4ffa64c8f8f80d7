//! The command `hyd` once more, as a binary of this package.
//!
//! Cargo builds the binaries of a package before its tests and tells them where they are (`CARGO_BIN_EXE_hyd-under-test`), so
//! that the tests of the command line run the state of the sources and never an older `target/debug/hyd`.

use std::process::ExitCode;

fn main() -> ExitCode {
    hyd::run(std::env::args_os())
}
