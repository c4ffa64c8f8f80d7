//! What an engine has to be able to do, and which one is meant by a text such as `slurm` or `dask=tcp://10.0.0.1:8786`.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::Work;
use crate::dask::Dask;
use crate::here::Here;
use crate::hyperqueue::HyperQueue;
use crate::slurm::Slurm;

/// Hands tasks out to machines.  Errors are sentences.
pub trait Engine {
    /// Most tasks of one work, and where that is said; none if there is no limit that users meet.
    ///
    /// # Errors
    /// The engine cannot be reached.
    fn most(&mut self) -> Result<Option<(usize, String)>, String>;

    /// Submits tasks, ascending; gives what the engine calls them.
    ///
    /// # Errors
    /// The engine cannot be reached or refuses them.
    fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String>;

    /// Tasks of a work that wait or run, whoever submitted them.
    ///
    /// # Errors
    /// The engine cannot be reached.
    fn active(&mut self, work: &Work) -> Result<BTreeSet<usize>, String>;

    /// Ends all tasks of a work that wait or run.
    ///
    /// # Errors
    /// The engine cannot be reached.
    fn cancel(&mut self, work: &Work) -> Result<(), String>;

    /// Takes back tasks of a work that is done, if some can still wait or run.
    ///
    /// # Errors
    /// The engine cannot be reached.
    fn dismiss(&mut self, work: &Work) -> Result<(), String>;
}

/// Which engine, and where it is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Place {
    /// HyperQueue; the folder of its server, if it is not the usual one.
    HyperQueue(Option<PathBuf>),
    /// Slurm; what else it needs to know (partition, account, time) stands in the variables of the environment that `sbatch` reads.
    Slurm,
    /// Dask; the address of its scheduler, if its settings do not have it.
    Dask(Option<String>),
    /// This machine.
    Here,
}

/// A text that names no engine.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PlaceError(String);

impl fmt::Display for PlaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is not an engine; expected hq, hq=SERVER_DIR, slurm, dask, dask=ADDRESS or here", self.0)
    }
}

impl Place {
    /// Reads `hq`, `hq=SERVER_DIR`, `slurm`, `dask`, `dask=ADDRESS` or `here`.
    ///
    /// # Errors
    /// Any other text.
    pub fn parse(text: &str) -> Result<Self, PlaceError> {
        let (name, at) = text.split_once('=').map_or((text, None), |(name, at)| (name, Some(at.trim())));
        match (name.trim(), at) {
            (_, Some("")) => Err(PlaceError(text.to_string())),
            ("hq", at) => Ok(Place::HyperQueue(at.map(PathBuf::from))),
            ("slurm", None) => Ok(Place::Slurm),
            ("dask", at) => Ok(Place::Dask(at.map(str::to_string))),
            ("here", None) => Ok(Place::Here),
            _ => Err(PlaceError(text.to_string())),
        }
    }

    /// The engine.  `python`: the interpreter that talks to Dask.
    ///
    /// # Errors
    /// It cannot be reached.
    pub fn engine(&self, python: &OsStr) -> Result<Box<dyn Engine>, String> {
        Ok(match self {
            Place::HyperQueue(folder) => Box::new(HyperQueue::new(folder.clone())),
            Place::Slurm => Box::new(Slurm),
            Place::Dask(address) => Box::new(Dask::connect(python, address.as_deref())?),
            Place::Here => Box::<Here>::default(),
        })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::HyperQueue(None) => write!(f, "hq"),
            Place::HyperQueue(Some(folder)) => write!(f, "hq={}", folder.display()),
            Place::Slurm => write!(f, "slurm"),
            Place::Dask(None) => write!(f, "dask"),
            Place::Dask(Some(address)) => write!(f, "dask={address}"),
            Place::Here => write!(f, "here"),
        }
    }
}

/// Runs a program of an engine with something on its standard input; gives what it prints.
pub(crate) fn ask(command: &mut Command, engine: &str, input: &str) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => {
            format!("there is no `{name}` on this machine, the program by which {engine} is reached")
        }
        _ => format!("`{name}` cannot be started: {error}"),
    })?;
    if let Some(mut stdin) = child.stdin.take() {
        // A program that does not read to the end says so by its exit code.
        let _ = stdin.write_all(input.as_bytes());
    }
    let output = child.wait_with_output().map_err(|error| format!("`{name}`: {error}"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let said = [&output.stderr, &output.stdout].map(|bytes| String::from_utf8_lossy(bytes).trim().to_string());
    let said = said.into_iter().find(|text| !text.is_empty()).unwrap_or_else(|| output.status.to_string());
    Err(format!("{engine} refuses: {said}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engines_are_named() {
        for text in ["hq", "hq=/var/hq", "slurm", "dask", "dask=tcp://10.0.0.1:8786"] {
            assert_eq!(Place::parse(text).map(|place| place.to_string()), Ok(text.to_string()));
        }
        for text in ["", "pbs", "slurm=gpu", "dask=", "HQ"] {
            assert_eq!(Place::parse(text), Err(PlaceError(text.to_string())));
        }
    }

    #[test]
    fn a_program_that_is_missing_or_refuses_is_told() {
        let missing = ask(&mut Command::new("no-such-program-here"), "Slurm", "");
        assert!(missing.is_err_and(|sentence| sentence.starts_with("there is no `no-such-program-here`")));
        if cfg!(unix) {
            let refused = ask(Command::new("sh").args(["-c", "read a; echo \"no $a\" >&2; exit 4"]), "Slurm", "room\n");
            assert_eq!(refused, Err("Slurm refuses: no room".to_string()));
        }
    }
}
