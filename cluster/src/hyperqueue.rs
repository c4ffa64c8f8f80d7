//! HyperQueue: a work is one or more arrays of tasks, by the program `hq`.
//!
//! Tasks of workers that die are started again by HyperQueue itself, until one has taken several workers with it.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

use crate::engine::ask;
use crate::numbers::{numbers, ranges};
use crate::{Engine, Work};

const NAME: &str = "HyperQueue";
/// Longest list of numbers of one array (bytes): it is an argument of a command.
const LONGEST_LIST: usize = 60_000;

/// The server that is running in a folder.
pub(crate) struct HyperQueue {
    folder: Option<PathBuf>,
}

impl HyperQueue {
    pub(crate) fn new(folder: Option<PathBuf>) -> Self {
        Self { folder }
    }

    fn command(&self, mode: &str) -> Command {
        let mut command = Command::new("hq");
        command.args(["--output-mode", mode, "--colors", "never"]);
        if let Some(folder) = &self.folder {
            command.arg("--server-dir").arg(folder);
        }
        command
    }

    /// Arrays of the work that are not at their end.
    fn jobs(&self, work: &Work) -> Result<Vec<String>, String> {
        let text = ask(self.command("json").args(["job", "list", "--all"]), NAME, "")?;
        let list: Value = serde_json::from_str(&text).map_err(|_| format!("{NAME}: `hq job list` is not JSON"))?;
        let jobs = list.as_array().into_iter().flatten().filter(|job| {
            let left = |state: &str| job["task_stats"][state].as_u64().unwrap_or(0);
            job["name"] == work.name.as_str() && left("running") + left("waiting") > 0
        });
        Ok(jobs.filter_map(|job| Some(job["id"].as_u64()?.to_string())).collect())
    }
}

impl Engine for HyperQueue {
    fn most(&mut self) -> Result<Option<(usize, String)>, String> {
        // Is there a server at all?
        ask(self.command("json").args(["server", "info"]), NAME, "").map(|_| None)
    }

    fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String> {
        let mut jobs = Vec::new();
        let mut rest = tasks;
        while !rest.is_empty() {
            let mut count = rest.len();
            while ranges(&rest[..count]).len() > LONGEST_LIST {
                count = count.div_ceil(2);
            }
            let mut command = self.command("quiet");
            command.args(["submit", "--name", &work.name, "--array", &ranges(&rest[..count])]);
            command.args(["--cpus", &work.processors.to_string(), "--stdout", "none", "--stderr", "none", "--cwd"]);
            command.arg(&work.folder).args(["--", "/bin/sh", "-c", &work.script("HQ_TASK_ID")]);
            jobs.push(ask(&mut command, NAME, "")?.trim().to_string());
            rest = &rest[count..];
        }
        Ok(jobs)
    }

    fn active(&mut self, work: &Work) -> Result<BTreeSet<usize>, String> {
        let mut active = BTreeSet::new();
        for job in self.jobs(work)? {
            let mut command = self.command("cli");
            let listed = ask(command.args(["job", "task-ids", &job, "--filter", "waiting,running"]), NAME, "")?;
            let read = numbers(listed.trim());
            active.extend(read.ok_or_else(|| format!("{NAME}: `{}` are not numbers of tasks", listed.trim()))?);
        }
        Ok(active)
    }

    fn cancel(&mut self, work: &Work) -> Result<(), String> {
        let jobs = self.jobs(work)?;
        if jobs.is_empty() {
            return Ok(());
        }
        ask(self.command("cli").args(["job", "cancel", &jobs.join(",")]), NAME, "").map(|_| ())
    }

    fn dismiss(&mut self, _work: &Work) -> Result<(), String> {
        Ok(())
    }
}
