//! `EXE shard DIR I`: a share of a sweep that was shared out, worked off by the executable that was shipped with it.
//!
//! All that is needed stands in `DIR/submission`.  The file system is shared with other machines and may show a new folder late, so it is waited
//! for.  Nothing but chunks is written, and nothing is joined.

use std::num::NonZeroUsize;
use std::path::Path;
use std::time::{Duration, Instant};

use hyd_ensemble::{Folder, FolderError, Plan, Submission, SubmissionError};

use crate::arguments::{MessageFormat, SweepArguments};
use crate::sweep::{Prepared, Subject, prepare};
use crate::{Failure, InputArguments, InputTable, interrupt, output};

/// How long a folder may take to become visible.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(500);

/// A share, ready but for the model.
pub struct ShardOf {
    /// What was shared out.
    pub submission: Submission,
    /// What the plan sets for all runs.
    pub set: Vec<(String, String)>,
    /// Recorded inputs.
    pub table: Option<InputTable>,
    /// The payload of the model with whole loops.
    pub whole_loops: Option<Vec<u8>>,
    arguments: SweepArguments,
    plan: Plan,
}

impl ShardOf {
    /// Finds a share.  `threads`: if not as many as the submission says.
    ///
    /// # Errors
    /// The share does not exist, or files of the submission cannot be read.
    pub fn find(root: &Path, index: usize, threads: Option<NonZeroUsize>) -> Result<Self, Failure> {
        let fault = |error: SubmissionError| Failure::Fault(error.to_string());
        let submission = waited(|| Submission::read(root), |error| matches!(error, SubmissionError::None(_)));
        let submission = submission.map_err(fault)?;
        let folder = waited(|| Folder::existing(root), |error| matches!(error, FolderError::NoSweep(_)));
        folder.map_err(|error| Failure::Fault(error.to_string()))?;
        let manifest = &submission.manifest;
        let shards = manifest.shards;
        if index >= shards {
            return Err(Failure::Usage(format!("shard {index}: there are {shards}, the first of which is 0")));
        }
        let plan = Plan::parse(&manifest.plan).map_err(|error| Failure::Fault(format!("the plan: {error}")))?;
        let table = match &manifest.inputs {
            None => None,
            Some((shipped, holds)) => {
                let bytes = submission.bytes(shipped).map_err(fault)?;
                Some(InputTable::unpack(&submission.path(shipped), &bytes, holds)?)
            }
        };
        let whole_loops = manifest.whole_loops.as_ref().map(|shipped| submission.bytes(shipped));
        let whole_loops = whole_loops.transpose().map_err(fault)?;
        let arguments = SweepArguments {
            vary: Vec::new(),
            samples: None,
            method: None,
            seed: None,
            result: Some(root.to_path_buf()),
            rows: false,
            measure: Vec::new(),
            shard: Some(format!("{index}/{shards}")),
            inputs: InputArguments::default(),
            threads: threads.or(NonZeroUsize::new(manifest.threads)),
            variables: None,
            stop: None,
            tolerance: None,
            intervals: None,
            set: Vec::new(),
            parameters: None,
            message_format: MessageFormat::Text,
            json: false,
        };
        let set = plan.set.clone().into_iter().collect();
        Ok(Self { submission, set, table, whole_loops, arguments, plan })
    }

    /// The sweep of which this is a share.
    ///
    /// # Errors
    /// A plan that makes no sense.
    pub fn prepare(&self) -> Result<Prepared<'_>, Failure> {
        prepare(&self.arguments, self.plan.clone()).map(Prepared::into_shard)
    }
}

impl Prepared<'_> {
    /// Works a share off and prints how many runs it has; runs that fail are results.
    ///
    /// # Errors
    /// As [`Prepared::work`]; also an interrupt.
    pub fn run_shard(&self, subject: &Subject<'_>) -> Result<(), Failure> {
        interrupt::listen();
        let report = self.work(subject, &|_, _| {}, &interrupt::requested)?.report;
        if report.interrupted {
            return Err(Failure::Solver("interrupted; the same command goes on where it was stopped".to_string()));
        }
        let earlier = if report.before > 0 { format!(", {} of them before", report.before) } else { String::new() };
        output::print(&format!("{} runs done{earlier}; {} failed\n", report.members, report.failed))
    }
}

/// The same question until it has an answer, or `late` says that there is nothing to wait for, or for too long.
fn waited<T, E>(mut ask: impl FnMut() -> Result<T, E>, late: impl Fn(&E) -> bool) -> Result<T, E> {
    let begin = Instant::now();
    loop {
        match ask() {
            Err(error) if late(&error) && begin.elapsed() < PATIENCE && !interrupt::requested() => {
                std::thread::sleep(PAUSE);
            }
            answer => return answer,
        }
    }
}
