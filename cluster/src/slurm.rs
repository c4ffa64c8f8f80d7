//! Slurm: a work is an array of jobs, by `sbatch`, `squeue` and `scancel`.
//!
//! Partition, account, time limit and the like are what the variables `SBATCH_...` of the environment say.  Tasks of nodes that fail are
//! requeued by Slurm itself.  Slurm starts the next task only when its scheduler looks again, which takes seconds; so a task that was short goes on
//! with others for a while, and what is left in the queue when all is done is taken back.

use std::collections::BTreeSet;
use std::process::Command;

use crate::engine::ask;
use crate::numbers::ranges;
use crate::{Engine, Work};

const NAME: &str = "Slurm";
/// Longest list of numbers that is passed on (bytes); Slurm takes lists of any length as long as they fit on a command line.
const LONGEST_LIST: usize = 60_000;

/// The Slurm that the programs of this machine belong to.
pub(crate) struct Slurm;

impl Engine for Slurm {
    fn most(&mut self) -> Result<Option<(usize, String)>, String> {
        let settings = ask(Command::new("scontrol").args(["show", "config"]), NAME, "")?;
        let most = settings.lines().find_map(|line| {
            let (name, value) = line.split_once('=')?;
            (name.trim() == "MaxArraySize").then(|| value.trim().parse::<usize>().ok())?
        });
        // The largest number of a task is one less.
        Ok(most.map(|most| (most, "MaxArraySize of this Slurm".to_string())))
    }

    fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String> {
        let script = format!("#!/bin/sh\n{}", work.script_that_goes_on("SLURM_ARRAY_TASK_ID"));
        let mut jobs = Vec::new();
        let mut rest = tasks;
        while !rest.is_empty() {
            let mut count = rest.len();
            while ranges(&rest[..count]).len() > LONGEST_LIST {
                count = count.div_ceil(2);
            }
            let mut command = Command::new("sbatch");
            command.args(["--parsable", "--requeue", "--ntasks=1", "--output=/dev/null", "--error=/dev/null"]);
            command.arg(format!("--job-name={}", work.name)).arg(format!("--array={}", ranges(&rest[..count])));
            command.arg(format!("--cpus-per-task={}", work.processors));
            command.arg("--chdir").arg(&work.folder);
            let job = ask(&mut command, NAME, &script)?;
            // Behind a semicolon stands the name of the cluster.
            jobs.push(job.trim().split(';').next().unwrap_or_default().to_string());
            rest = &rest[count..];
        }
        Ok(jobs)
    }

    fn active(&mut self, work: &Work) -> Result<BTreeSet<usize>, String> {
        let mut command = Command::new("squeue");
        command.args(["--noheader", "--array", "--format=%K"]).arg(format!("--name={}", work.name));
        let listed = ask(&mut command, NAME, "")?;
        Ok(listed.lines().filter_map(|line| line.trim().parse().ok()).collect())
    }

    fn cancel(&mut self, work: &Work) -> Result<(), String> {
        ask(Command::new("scancel").arg(format!("--name={}", work.name)), NAME, "").map(|_| ())
    }

    fn dismiss(&mut self, work: &Work) -> Result<(), String> {
        if !self.active(work)?.is_empty() {
            self.cancel(work)?;
        }
        // What stays behind is small, and does no harm: hints, and the empty logs of tasks that were ended when their files were there.
        let _ = std::fs::remove_dir_all(work.taken());
        for entry in std::fs::read_dir(&work.logs).into_iter().flatten().flatten() {
            let _ = std::fs::remove_file(entry.path());
        }
        Ok(())
    }
}
