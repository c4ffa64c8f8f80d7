//! The launcher.  Everything is in the library beside it.

use std::process::ExitCode;

fn main() -> ExitCode {
    hyd_launcher::run(std::env::args_os())
}
