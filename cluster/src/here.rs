//! This machine: as many tasks at a time as it has processors for, the others wait.
//!
//! Tasks are processes, each awaited by a thread of its own.  They end with the submitting process, unless that is killed or interrupted twice; then they
//! go on to their ends.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs::File;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::{Engine, Work};

/// Time after which is asked again whether a process has ended.
const BEAT: Duration = Duration::from_millis(20);

/// Tasks of this process.
#[derive(Default)]
pub(crate) struct Here(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    waiting: VecDeque<(Arc<Work>, usize)>,
    running: BTreeMap<usize, Child>,
    /// Threads that take the next one when theirs has ended.
    threads: usize,
}

fn locked(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Here {
    fn end(&self) {
        let mut state = locked(&self.0);
        state.waiting.clear();
        for child in state.running.values_mut() {
            // One that has ended by itself cannot be killed.
            let _ = child.kill();
        }
    }
}

impl Engine for Here {
    fn most(&mut self) -> Result<Option<(usize, String)>, String> {
        Ok(None)
    }

    fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String> {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let most = (processors / work.processors.max(1)).max(1);
        let mut state = locked(&self.0);
        let work = Arc::new(work.clone());
        state.waiting.extend(tasks.iter().map(|&task| (work.clone(), task)));
        while state.threads < most.min(state.waiting.len() + state.running.len()) {
            state.threads += 1;
            let own = self.0.clone();
            std::thread::spawn(move || while next(&own) {});
        }
        Ok(vec![std::process::id().to_string()])
    }

    fn active(&mut self, _work: &Work) -> Result<BTreeSet<usize>, String> {
        let state = locked(&self.0);
        Ok(state.waiting.iter().map(|own| own.1).chain(state.running.keys().copied()).collect())
    }

    fn cancel(&mut self, _work: &Work) -> Result<(), String> {
        self.end();
        Ok(())
    }

    fn dismiss(&mut self, _work: &Work) -> Result<(), String> {
        Ok(())
    }
}

impl Drop for Here {
    fn drop(&mut self) {
        self.end();
    }
}

/// Runs the next task to its end; false where there is none.
fn next(state: &Mutex<State>) -> bool {
    let mut own = locked(state);
    let Some((work, task)) = own.waiting.pop_front() else {
        own.threads -= 1;
        return false;
    };
    let log = work.log(task);
    match start(&work, task) {
        Ok(child) => own.running.insert(task, child),
        Err(error) => {
            // Who asks for the task finds neither its files nor the task.
            let _ = std::fs::write(&log, format!("`{}` cannot be started: {error}\n", work.program.display()));
            return true;
        }
    };
    drop(own);
    loop {
        std::thread::sleep(BEAT);
        let mut own = locked(state);
        let ended = own.running.get_mut(&task).map_or(Ok(None), Child::try_wait);
        let Some(status) = ended.transpose() else { continue };
        said(&log, status);
        own.running.remove(&task);
        return true;
    }
}

/// Takes the log away where all is well, and adds how the process has ended where it is not.
fn said(log: &std::path::Path, status: io::Result<ExitStatus>) {
    // Without a log the reason is missing; that the task has failed is seen by its files.
    let _ = match status {
        Ok(status) if status.success() => std::fs::remove_file(log),
        Ok(status) => File::options().append(true).open(log).and_then(|mut file| writeln!(file, "{status}")),
        Err(error) => File::options().append(true).open(log).and_then(|mut file| writeln!(file, "{error}")),
    };
}

fn start(work: &Work, task: usize) -> io::Result<Child> {
    let log = File::create(work.log(task))?;
    let mut command = Command::new(&work.program);
    command.args(&work.arguments).arg(task.to_string()).current_dir(&work.folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
    // An interrupt is for the submitting process, which ends its tasks.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::work::said;

    #[test]
    fn tasks_run_are_waited_for_and_are_ended() {
        let folder = std::env::temp_dir().join(format!("hyd-here-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let work = |script: &str| Work {
            name: "n".into(),
            folder: folder.clone(),
            program: "/bin/sh".into(),
            arguments: ["-c", script, "task"].map(String::from).to_vec(),
            processors: 1,
            logs: folder.clone(),
            goes_on: None,
        };
        let wait = |here: &mut Here, own: &Work| {
            let begin = Instant::now();
            while !here.active(own).unwrap().is_empty() {
                assert!(begin.elapsed() < Duration::from_secs(20));
                std::thread::sleep(Duration::from_millis(5));
            }
        };
        let mut here = Here::default();
        let own = work("[ $1 != 2 ] || { echo wrong >&2; exit 3; }; : >done.$1");
        here.submit(&own, &[0, 1, 2, 3, 4, 5, 6, 7]).unwrap();
        wait(&mut here, &own);
        let done: Vec<usize> = (0..8).filter(|k| folder.join(format!("done.{k}")).exists()).collect();
        assert_eq!(done, [0, 1, 3, 4, 5, 6, 7]);
        assert_eq!((said(&own.log(2)).unwrap().as_str(), said(&own.log(3))), ("wrong\nexit status: 3", None));
        let long = work("exec sleep 60");
        here.submit(&long, &[0, 1, 2, 3, 4, 5, 6, 7]).unwrap();
        assert_eq!(here.active(&long).unwrap().len(), 8);
        here.cancel(&long).unwrap();
        wait(&mut here, &long);
        let none = Work { program: "/no/such/program".into(), ..own };
        here.submit(&none, &[5]).unwrap();
        wait(&mut here, &none);
        assert!(said(&none.log(5)).unwrap().starts_with("`/no/such/program` cannot be started: "));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
