//! The launcher of executables once more, as a binary of this package, so that tests never use an older one.

use std::process::ExitCode;

fn main() -> ExitCode {
    hyd_launcher::run(std::env::args_os())
}
