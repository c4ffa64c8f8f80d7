//! Carries a work out: submits what is missing, waits, submits again what ended without leaving its files, gives up on what does so too often.
//!
//! What is done is read from files, what is still to come is asked of the engine, in this order: first the engine, then the files.  A task that
//! the engine no longer has and whose files are not there has failed, or its files are not visible yet; it is given time before it
//! counts as failed, but for one that has left a word.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use crate::work::said;
use crate::{Engine, Work};

/// Longest and shortest time between two questions.
const LONGEST: Duration = Duration::from_secs(5);
const SHORTEST: Duration = Duration::from_millis(200);
/// Part of the time that the work has taken so far after which the next question is asked.
const SHARE: u32 = 20;
/// An interrupt is noticed after this time.
const BEAT: Duration = Duration::from_millis(100);

/// How long is waited, and how often something is tried.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patience {
    /// Time that a file may take to become visible after its task has ended.
    pub settle: Duration,
    /// How often a task may end without its files.
    pub tries: usize,
    /// Time that the engine may be out of reach.
    pub outage: Duration,
}

impl Patience {
    /// Half a minute for files, three tries, five minutes for the engine.
    pub const USUAL: Patience =
        Patience { settle: Duration::from_secs(30), tries: 3, outage: Duration::from_secs(300) };
}

/// What the files say.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Done {
    /// For each task whether all is there that it should leave.
    pub tasks: Vec<bool>,
    /// Runs, or whatever tasks are made of, that are done.
    pub parts: usize,
}

/// What a caller hears while the work goes on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Seen<'a> {
    /// So many parts are done.
    Parts(usize),
    /// Tasks have been submitted: how many, and what the engine calls them.
    Submitted(usize, &'a [String]),
    /// A task ended without its files: which, why, and whether it is tried again.
    Failed(usize, &'a str, bool),
    /// The engine is out of reach, for the first time in a row.
    Outage(&'a str),
    /// All is done, but tasks that are not needed could not be cancelled: a sentence.
    Left(&'a str),
}

/// A task that was given up.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Given {
    /// Its number.
    pub task: usize,
    /// What it said last.
    pub reason: String,
}

/// How a work ended.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Ended {
    /// All is there.
    Done,
    /// Some tasks were given up, all others are done.
    GivenUp(Vec<Given>),
    /// The caller asked to stop; what was waiting or running has been cancelled, or why that was not possible.
    Stopped(Result<(), String>),
}

/// Carries a work out.  `done` reads the files; `resumed` asks the engine first what it still has of an earlier submission.
///
/// # Errors
/// A sentence: the engine refuses, is out of reach for too long, or files cannot be read.
pub fn carry_out(
    engine: &mut dyn Engine,
    work: &Work,
    (patience, resumed): (Patience, bool),
    done: &mut dyn FnMut() -> Result<Done, String>,
    told: &mut dyn FnMut(Seen<'_>),
    stop: &dyn Fn() -> bool,
) -> Result<Ended, String> {
    let begin = Instant::now();
    let known = if resumed { engine.active(work)? } else { BTreeSet::new() };
    let mut state = done()?;
    let mut tasks = vec![Task::default(); state.tasks.len()];
    let missing: Vec<usize> = (0..tasks.len()).filter(|&k| !state.tasks[k] && !known.contains(&k)).collect();
    submit(engine, work, &missing, told)?;
    let mut outage: Option<Instant> = None;
    loop {
        told(Seen::Parts(state.parts));
        // Files of a task that was given up may have come after all.
        let missing: Vec<usize> = (0..tasks.len()).filter(|&task| !state.tasks[task]).collect();
        let given: Vec<Given> = missing.iter().filter_map(|&task| tasks[task].given(task)).collect();
        if given.len() == missing.len() {
            if !given.is_empty() {
                return Ok(Ended::GivenUp(given));
            }
            if let Err(sentence) = engine.dismiss(work) {
                let words = "jobs that are not needed any more could not be cancelled; they will find nothing to do";
                told(Seen::Left(&format!("{words} ({sentence})")));
            }
            return Ok(Ended::Done);
        }
        let pause = Instant::now() + (begin.elapsed() / SHARE).clamp(SHORTEST, LONGEST);
        while Instant::now() < pause && !stop() {
            std::thread::sleep(BEAT.min(pause.saturating_duration_since(Instant::now())));
        }
        if stop() {
            return Ok(Ended::Stopped(engine.cancel(work)));
        }
        let active = match engine.active(work) {
            Ok(active) => active,
            Err(sentence) => {
                let since = *outage.get_or_insert_with(|| {
                    told(Seen::Outage(&sentence));
                    Instant::now()
                });
                if since.elapsed() > patience.outage {
                    return Err(sentence);
                }
                state = done()?;
                continue;
            }
        };
        outage = None;
        state = done()?;
        let mut again = Vec::new();
        for (number, own) in tasks.iter_mut().enumerate().filter(|(number, _)| !state.tasks[*number]) {
            if own.reason.is_some() {
                continue;
            }
            if active.contains(&number) {
                own.gone = None;
                continue;
            }
            let gone = *own.gone.get_or_insert_with(Instant::now);
            let reason = match said(&work.log(number)) {
                Some(reason) => reason,
                None if gone.elapsed() >= patience.settle => SILENT.to_string(),
                None => continue,
            };
            own.gone = None;
            own.failures += 1;
            let is_last = own.failures >= patience.tries;
            told(Seen::Failed(number, &reason, !is_last));
            if is_last {
                own.reason = Some(reason);
            } else {
                again.push(number);
            }
        }
        submit(engine, work, &again, told)?;
    }
}

const SILENT: &str = "it ended without its results and without a word (killed from outside, or out of memory)";

/// What is known of a task.
#[derive(Clone, Default)]
struct Task {
    /// Since when the engine does not have it and its files are not there.
    gone: Option<Instant>,
    failures: usize,
    /// Why it was given up.
    reason: Option<String>,
}

impl Task {
    fn given(&self, task: usize) -> Option<Given> {
        self.reason.clone().map(|reason| Given { task, reason })
    }
}

fn submit(engine: &mut dyn Engine, work: &Work, tasks: &[usize], told: &mut dyn FnMut(Seen<'_>)) -> Result<(), String> {
    if tasks.is_empty() {
        return Ok(());
    }
    let jobs = engine.submit(work, tasks)?;
    told(Seen::Submitted(tasks.len(), &jobs));
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::cell::RefCell;
    use std::collections::BTreeMap;

    use super::*;

    /// What becomes of a task each time that it is submitted.
    #[derive(Clone, Copy, PartialEq)]
    enum Fate {
        Done,
        /// Its file is seen only after so many questions.
        Late(usize),
        Killed,
        Says(&'static str),
        /// Its file is seen all the same, after so many questions.
        SaysLate(&'static str, usize),
    }

    /// An engine that ends every task at the second question after its submission.
    struct Pretended<'a> {
        fates: BTreeMap<usize, Vec<Fate>>,
        running: BTreeMap<usize, (usize, Fate)>,
        files: &'a RefCell<BTreeMap<usize, usize>>,
        log: &'a RefCell<Vec<String>>,
        outages: usize,
    }

    impl Engine for Pretended<'_> {
        fn most(&mut self) -> Result<Option<(usize, String)>, String> {
            Ok(None)
        }

        fn submit(&mut self, work: &Work, tasks: &[usize]) -> Result<Vec<String>, String> {
            self.log.borrow_mut().push(format!("submit {tasks:?} of {}", work.name));
            for &task in tasks {
                let fates = self.fates.get_mut(&task).unwrap();
                let fate = if fates.len() > 1 { fates.remove(0) } else { fates[0] };
                self.running.insert(task, (2, fate));
            }
            Ok(vec!["1".to_string()])
        }

        fn active(&mut self, work: &Work) -> Result<BTreeSet<usize>, String> {
            if self.outages > 0 {
                self.outages -= 1;
                return Err("nobody answers".to_string());
            }
            let mut ended = Vec::new();
            for (&task, (left, fate)) in &mut self.running {
                *left -= 1;
                if *left == 0 {
                    ended.push(task);
                    match *fate {
                        Fate::Done => _ = self.files.borrow_mut().insert(task, 0),
                        Fate::Late(questions) => _ = self.files.borrow_mut().insert(task, questions),
                        Fate::Killed => {}
                        Fate::Says(words) => std::fs::write(work.log(task), words).unwrap(),
                        Fate::SaysLate(words, questions) => {
                            std::fs::write(work.log(task), words).unwrap();
                            self.files.borrow_mut().insert(task, questions);
                        }
                    }
                }
            }
            self.running.retain(|task, _| !ended.contains(task));
            Ok(self.running.keys().copied().collect())
        }

        fn cancel(&mut self, _work: &Work) -> Result<(), String> {
            self.log.borrow_mut().push("cancel".to_string());
            Ok(())
        }

        fn dismiss(&mut self, _work: &Work) -> Result<(), String> {
            self.log.borrow_mut().push("dismiss".to_string());
            Err("nobody answers at the end".to_string())
        }
    }

    fn run(fates: &[&[Fate]], outages: usize, stop_after: usize) -> (Result<Ended, String>, Vec<String>) {
        static COUNT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        let own = COUNT.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let logs = std::env::temp_dir().join(format!("hyd-watch-{}-{own}", std::process::id()));
        std::fs::create_dir_all(&logs).unwrap();
        let (files, log) = (RefCell::new(BTreeMap::new()), RefCell::new(Vec::new()));
        let fates: BTreeMap<usize, Vec<Fate>> = fates.iter().map(|own| own.to_vec()).enumerate().collect();
        let count = fates.len();
        let mut engine = Pretended { fates, running: BTreeMap::new(), files: &files, log: &log, outages };
        let work = Work {
            name: "w".into(),
            folder: logs.clone(),
            program: "p".into(),
            arguments: Vec::new(),
            processors: 1,
            logs: logs.clone(),
            goes_on: None,
        };
        let patience = Patience { settle: Duration::from_millis(900), tries: 3, outage: Duration::from_millis(700) };
        let questions = RefCell::new(0);
        let mut done = || {
            *questions.borrow_mut() += 1;
            let mut files = files.borrow_mut();
            let tasks: Vec<bool> = (0..count).map(|task| files.get(&task) == Some(&0)).collect();
            files.values_mut().for_each(|left| *left = left.saturating_sub(1));
            Ok(Done { parts: tasks.iter().filter(|&&done| done).count(), tasks })
        };
        let mut told = |seen: Seen<'_>| match seen {
            Seen::Failed(task, reason, again) => log.borrow_mut().push(format!("{task} failed: {reason} ({again})")),
            Seen::Outage(sentence) | Seen::Left(sentence) => log.borrow_mut().push(sentence.to_string()),
            _ => {}
        };
        let stop = || *questions.borrow() > stop_after;
        let ended = carry_out(&mut engine, &work, (patience, false), &mut done, &mut told, &stop);
        std::fs::remove_dir_all(&logs).unwrap();
        (ended, log.into_inner())
    }

    #[test]
    fn what_is_killed_or_fails_is_done_again_and_what_is_late_is_not() {
        let (ended, log) = run(
            &[&[Fate::Done], &[Fate::Killed, Fate::Done], &[Fate::Says("no room\n"), Fate::Done], &[Fate::Late(2)]],
            1,
            usize::MAX,
        );
        assert_eq!(ended, Ok(Ended::Done));
        let expected = [
            "submit [0, 1, 2, 3] of w",
            "nobody answers",
            "2 failed: no room (true)",
            "submit [2] of w",
            &format!("1 failed: {SILENT} (true)"),
            "submit [1] of w",
            "dismiss",
            "jobs that are not needed any more could not be cancelled; they will find nothing to do (nobody answers at the end)",
        ];
        assert_eq!(log, expected);
    }

    #[test]
    fn a_task_that_always_fails_is_given_up_and_the_others_are_done() {
        let (ended, log) = run(&[&[Fate::Says("no such file")], &[Fate::Done]], 0, usize::MAX);
        let given = Given { task: 0, reason: "no such file".to_string() };
        assert_eq!(ended, Ok(Ended::GivenUp(vec![given])));
        assert_eq!(log.iter().filter(|line| line.starts_with("submit")).count(), 3);
        assert!(!log.contains(&"dismiss".to_string()), "what was given up may still be made by a job that goes on");
    }

    #[test]
    fn a_task_whose_files_come_after_it_was_given_up_is_done() {
        let slow = [Fate::Killed, Fate::Killed, Fate::Done];
        let (ended, _) = run(&[&[Fate::SaysLate("late", 5)], &[Fate::Says("no such file")], &slow], 0, 100);
        let given = Given { task: 1, reason: "no such file".to_string() };
        assert_eq!(ended, Ok(Ended::GivenUp(vec![given])));
    }

    #[test]
    fn an_interrupt_cancels_and_a_long_outage_is_an_error() {
        let (ended, log) = run(&[&[Fate::Killed]], 0, 1);
        assert_eq!((ended, log.last().map(String::as_str)), (Ok(Ended::Stopped(Ok(()))), Some("cancel")));
        assert_eq!(run(&[&[Fate::Done]], 100, usize::MAX).0, Err("nobody answers".to_string()));
    }
}
