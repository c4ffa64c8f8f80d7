//! Dask: tasks are futures of a client that lives as long as the submitting process.
//!
//! Clients of Dask are Python; a script (`dask.py`) is handed to an interpreter and answers questions on its standard input, a line of JSON
//! each.  When the submitting process dies, so does the client, and the scheduler forgets what has not begun.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

use crate::{Engine, Work};

const NAME: &str = "Dask";
const SCRIPT: &str = include_str!("dask.py");

/// A client of a scheduler.
pub(crate) struct Dask {
    client: Child,
    questions: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Dask {
    /// Starts a client; without an address the settings of Dask have it.
    ///
    /// # Errors
    /// There is no Python, no Dask, or no scheduler.
    pub(crate) fn connect(python: &OsStr, address: Option<&str>) -> Result<Self, String> {
        let mut command = Command::new(python);
        command.args(["-c", SCRIPT]).args(address);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        detach(&mut command);
        let name = python.to_string_lossy();
        let mut client = command.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => format!(
                "there is no `{name}` on this machine, the program by which Dask is reached; HYD_PYTHON names another interpreter"
            ),
            _ => format!("`{name}` cannot be started: {error}"),
        })?;
        let (questions, answers) = (client.stdin.take(), client.stdout.take());
        let answers = answers.ok_or_else(|| format!("`{name}` has no output"))?;
        let mut own = Self { client, questions, answers: BufReader::new(answers) };
        own.answer().map(|_| own)
    }

    fn ask(&mut self, question: &Value) -> Result<Value, String> {
        let gone = |_| format!("{NAME}: the client has ended");
        let questions = self.questions.as_mut().ok_or_else(|| format!("{NAME}: the client has ended"))?;
        writeln!(questions, "{question}").and_then(|()| questions.flush()).map_err(gone)?;
        self.answer()
    }

    fn answer(&mut self) -> Result<Value, String> {
        let mut line = String::new();
        let read = self.answers.read_line(&mut line);
        let value: Option<Value> = read.ok().and_then(|_| serde_json::from_str(&line).ok());
        let value = value.ok_or_else(|| format!("{NAME}: the client has ended without a word"))?;
        match value["error"].as_str() {
            Some(error) => Err(format!("{NAME}: {error}")),
            None => Ok(value),
        }
    }
}

/// Ctrl-C at a terminal is for the submitting process, which cancels; the client must live to do so.
#[cfg(unix)]
fn detach(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
}

#[cfg(not(unix))]
fn detach(_command: &mut Command) {}

impl Engine for Dask {
    fn most(&mut self) -> Result<Option<(usize, String)>, String> {
        Ok(None)
    }

    fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String> {
        let question = json!({"submit": tasks, "name": work.name, "script": work.script("HYD_TASK"),
            "folder": work.folder.display().to_string(), "log": work.logs.display().to_string()});
        let answer = self.ask(&question)?;
        Ok(vec![answer["scheduler"].as_str().unwrap_or_default().to_string()])
    }

    fn active(&mut self, _work: &Work) -> Result<BTreeSet<usize>, String> {
        let answer = self.ask(&json!({"active": true}))?;
        let list = answer["active"].as_array().into_iter().flatten();
        Ok(list.filter_map(|number| Some(number.as_u64()? as usize)).collect())
    }

    fn cancel(&mut self, _work: &Work) -> Result<(), String> {
        self.ask(&json!({"cancel": true})).map(|_| ())
    }

    fn dismiss(&mut self, _work: &Work) -> Result<(), String> {
        Ok(())
    }
}

impl Drop for Dask {
    fn drop(&mut self) {
        // At the end of its input the client leaves; nothing is to be done about one that does not.
        self.questions = None;
        let _ = self.client.wait();
    }
}
