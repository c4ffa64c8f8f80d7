//! The command `hyd`.  Everything is in the library beside it.

use std::process::ExitCode;

fn main() -> ExitCode {
    hyd::run(std::env::args_os())
}
