//! A folder for one test, and programs run from it with an empty environment.

use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// A folder of its own, removed at the end.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    pub(crate) fn new() -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("hyd-exe-{}-{number}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// `hyd` with its launcher and its library of units.
    pub(crate) fn hyd(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
        command.env_remove("HYD_LIBRARY").env_remove("MODELICAPATH").env("NO_COLOR", "1");
        command.env("HYD_LAUNCHER", env!("CARGO_BIN_EXE_hyd-launcher-under-test"));
        command.env("HYD_UNIT", crate::unit_client::library());
        self.output(command.args(arguments))
    }

    /// A program of this folder, without any environment.
    pub(crate) fn bare(&self, program: &str, arguments: &[&str]) -> Output {
        self.output(Command::new(self.file(program)).env_clear().env("PATH", "").args(arguments))
    }

    fn output(&self, command: &mut Command) -> Output {
        command.current_dir(&self.0).stdin(Stdio::null());
        loop {
            match command.output() {
                // A test beside this one was just starting a program while the file was still open for writing here.
                Err(error) if error.kind() == ErrorKind::ExecutableFileBusy => thread::sleep(Duration::from_millis(5)),
                outcome => return outcome.unwrap(),
            }
        }
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Standard error as text.
pub(crate) fn messages(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Standard output as text.
pub(crate) fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}
