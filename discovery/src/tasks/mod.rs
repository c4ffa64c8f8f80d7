//! Tasks of a search, which several processes can share.
//!
//! Every member of a [`Crew`] makes the same search from its beginning to its end.  Where it comes to tasks that do not depend on each
//! other, such as the fits of several candidates, it makes those that nobody else has taken, and takes the answers to all others
//! over; so no process gives orders, and none that dies is missed.  A task is named by all that decides its answer
//! ([`Task`]), and answers come back to the bit, so that neither the number of members nor the order in which they end can be seen in
//! what is found.  A search of one process, without a crew, makes the same tasks one after the other.

mod answer;

use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

pub(crate) use answer::{Answer, Reader, Writer};

use crate::fault::Fault;
use crate::fit::Fit;
use crate::watch::Watch;

/// Shortest and longest time between two looks at what others have made.
const BEAT: (Duration, Duration) = (Duration::from_millis(20), Duration::from_millis(500));
/// A task that somebody took is made here, too, once it has taken so many times as long as the longest one of this process.
const OVERDUE: u32 = 3;

/// Where processes that make the same search meet.
pub trait Crew {
    /// The position of this process among them, from 0.
    fn number(&self) -> usize;

    /// The answer to a task, if somebody has given it.
    fn answer(&self, task: &str) -> Option<Vec<u8>>;

    /// True if this process shall make the task: no other one has taken it.
    fn take(&self, task: &str) -> bool;

    /// Gives the answer to all others.
    ///
    /// # Errors
    /// It cannot be given.
    fn give(&self, task: &str, answer: &[u8]) -> Result<(), Fault>;

    /// How long a task that another process has taken is waited for at least, before it is made here as well.
    fn patience(&self) -> Duration;
}

/// What decides the answer to a task: words, and numbers to the bit.
pub(crate) struct Task {
    words: String,
    hash: u64,
}

impl Task {
    /// A task of these words.
    pub(crate) fn new(words: String) -> Self {
        let hash = words.bytes().fold(0xcbf2_9ce4_8422_2325, mixed);
        Self { words, hash }
    }

    /// The same from these numbers.
    pub(crate) fn from(self, numbers: &[f64]) -> Self {
        let words = numbers.iter().map(|number| number.to_bits()).chain([numbers.len() as u64]);
        Self { hash: words.fold(self.hash, mixed_word), ..self }
    }

    /// The same from this fit, with the derivatives that it has.
    pub(crate) fn with(self, fit: &Fit) -> Self {
        let task = self.from(&fit.xi).from(&[fit.cost, f64::from(u8::from(fit.fresh))]);
        match &fit.jacobian {
            Some(jacobian) => {
                let unknowns: Vec<f64> = jacobian.unknowns.iter().map(|&k| k as f64).collect();
                task.from(jacobian.matrix.as_slice()).from(&unknowns)
            }
            None => task,
        }
    }

    pub(crate) fn name(&self) -> String {
        format!("{:016x}", self.hash)
    }
}

/// One step of FNV-1a.
fn mixed(hash: u64, byte: u8) -> u64 {
    (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
}

/// The same of a word, because derivatives are megabytes.
fn mixed_word(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29)
}

/// Who makes the tasks of a search.
#[derive(Clone, Copy)]
pub struct Tasks<'a>(Option<&'a dyn Crew>);

impl<'a> Tasks<'a> {
    /// This process alone.
    pub const ALONE: Tasks<'static> = Tasks(None);

    /// This process and others.
    pub fn of(crew: &'a dyn Crew) -> Self {
        Self(Some(crew))
    }

    /// The answers to tasks that do not depend on each other, in their order.  `watch` counts the runs of all of them.
    ///
    /// # Errors
    /// Those of the tasks that are made here; an answer that cannot be given; an interrupt.
    pub(crate) fn each<T: Answer>(
        &self,
        count: usize,
        watch: &Watch,
        task: &dyn Fn(usize) -> Task,
        make: &mut dyn FnMut(usize) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        match self.0 {
            None => (0..count).map(make).collect(),
            Some(crew) => Shared { crew, watch, longest: Duration::ZERO }.each(count, task, make),
        }
    }
}

/// Tasks shared with others.
struct Shared<'a> {
    crew: &'a dyn Crew,
    watch: &'a Watch,
    /// Time that the longest task made here took.
    longest: Duration,
}

impl Shared<'_> {
    fn each<T: Answer>(
        &mut self,
        count: usize,
        task: &dyn Fn(usize) -> Task,
        make: &mut dyn FnMut(usize) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        let tasks: Vec<Task> = (0..count).map(task).collect();
        let names: BTreeSet<String> = tasks.iter().map(Task::name).collect();
        debug_assert_eq!(names.len(), count, "two tasks of one name: {}", tasks[0].words);
        let mut answers: Vec<Option<T>> = (0..count).map(|_| None).collect();
        // Each begins elsewhere, so that few reach for the same one.
        let order = || (0..count).map(|k| (k + self.crew.number()) % count);
        let order: Vec<usize> = order().collect();
        let (mut last, mut beat) = (Instant::now(), BEAT.0);
        loop {
            let mut is_new = false;
            for &k in &order {
                if answers[k].is_some() {
                    continue;
                }
                answers[k] = self.taken_over(&tasks[k]);
                if answers[k].is_none() && self.crew.take(&tasks[k].name()) {
                    answers[k] = Some(self.made(&tasks[k], &mut || make(k))?);
                }
                is_new |= answers[k].is_some();
            }
            let Some(&missing) = order.iter().find(|&&k| answers[k].is_none()) else { break };
            if self.watch.stopped() {
                return Err(Fault::run("interrupted"));
            }
            if is_new {
                (last, beat) = (Instant::now(), BEAT.0);
            } else if last.elapsed() > self.crew.patience().max(OVERDUE * self.longest) {
                // Whoever took it may be gone.
                answers[missing] = Some(self.made(&tasks[missing], &mut || make(missing))?);
                last = Instant::now();
            } else {
                std::thread::sleep(beat);
                beat = (2 * beat).min(BEAT.1);
            }
        }
        Ok(answers.into_iter().flatten().collect())
    }

    /// An answer of another process, with the runs that it took; none where there is none, or not to this task.
    fn taken_over<T: Answer>(&self, task: &Task) -> Option<T> {
        let bytes = self.crew.answer(&task.name())?;
        let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(8)?)?;
        if checksum(body).to_le_bytes() != *sum {
            return None;
        }
        let mut reader = Reader::new(body);
        if String::read(&mut reader)? != task.words {
            return None;
        }
        let (runs, whole_loops) = <(usize, usize)>::read(&mut reader)?;
        let answer = T::read(&mut reader)?;
        self.watch.runs.fetch_add(runs, Ordering::Relaxed);
        self.watch.whole_loops.fetch_add(whole_loops, Ordering::Relaxed);
        Some(answer)
    }

    /// The answer made here, and given to the others.
    fn made<T: Answer>(&mut self, task: &Task, make: &mut dyn FnMut() -> Result<T, Fault>) -> Result<T, Fault> {
        let begin = Instant::now();
        let counts = || (self.watch.runs(), self.watch.whole_loops.load(Ordering::Relaxed));
        let before = counts();
        let answer = make()?;
        // What was ended in the middle is no answer.
        if self.watch.stopped() {
            return Err(Fault::run("interrupted"));
        }
        let after = counts();
        self.longest = self.longest.max(begin.elapsed());
        let mut writer = Writer::default();
        task.words.write(&mut writer);
        (after.0 - before.0, after.1 - before.1).write(&mut writer);
        answer.write(&mut writer);
        let mut bytes = writer.0;
        bytes.extend(checksum(&bytes).to_le_bytes());
        self.crew.give(&task.name(), &bytes)?;
        Ok(answer)
    }
}

fn checksum(bytes: &[u8]) -> u64 {
    let word = |part: &[u8]| part.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
    bytes.chunks(8).fold(bytes.len() as u64, |sum, part| mixed_word(sum, word(part)))
}

/// The tasks of a list in waves: one, then two, then four, and so on.  Those of a wave do not depend on each other, and see what the waves
/// before have found, so that little work is done in vain however many make it.
pub(crate) fn waves(count: usize) -> impl Iterator<Item = Range<usize>> {
    let ends = (0..usize::BITS).map(|k| (1_usize << k) - 1).take_while(move |&first| first < count);
    ends.map(move |first| first..(2 * first + 1).min(count))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::cell::{Cell, RefCell};
    use std::collections::BTreeMap;

    use super::*;

    #[derive(Default)]
    struct Table {
        answers: RefCell<BTreeMap<String, Vec<u8>>>,
        taken: RefCell<BTreeSet<String>>,
    }

    struct Member<'a>(&'a Table, usize);

    impl Crew for Member<'_> {
        fn number(&self) -> usize {
            self.1
        }

        fn answer(&self, task: &str) -> Option<Vec<u8>> {
            self.0.answers.borrow().get(task).cloned()
        }

        fn take(&self, task: &str) -> bool {
            self.0.taken.borrow_mut().insert(task.to_string())
        }

        fn give(&self, task: &str, answer: &[u8]) -> Result<(), Fault> {
            self.0.answers.borrow_mut().insert(task.to_string(), answer.to_vec());
            Ok(())
        }

        fn patience(&self) -> Duration {
            Duration::from_millis(50)
        }
    }

    fn squares(member: &Member<'_>, watch: &Watch, made: &Cell<usize>) -> Vec<f64> {
        let task = |k: usize| Task::new("square".to_string()).from(&[k as f64]);
        let mut make = |k: usize| {
            made.set(made.get() + 1);
            watch.runs.fetch_add(10, Ordering::Relaxed);
            Ok((k * k) as f64)
        };
        Tasks::of(member).each(5, watch, &task, &mut make).unwrap()
    }

    #[test]
    fn answers_of_others_are_taken_over_with_their_runs() {
        let (table, made) = (Table::default(), Cell::new(0));
        let first = Watch::default();
        assert_eq!(squares(&Member(&table, 1), &first, &made), [0.0, 1.0, 4.0, 9.0, 16.0]);
        assert_eq!((made.get(), first.runs()), (5, 50));
        let second = Watch::default();
        assert_eq!(squares(&Member(&table, 2), &second, &made), [0.0, 1.0, 4.0, 9.0, 16.0]);
        assert_eq!((made.get(), second.runs()), (5, 50));
    }

    #[test]
    fn what_somebody_took_and_never_made_is_made_after_a_while() {
        let (table, made) = (Table::default(), Cell::new(0));
        let task = Task::new("square".to_string()).from(&[3.0]).name();
        table.taken.borrow_mut().insert(task);
        let begin = Instant::now();
        assert_eq!(squares(&Member(&table, 0), &Watch::default(), &made).len(), 5);
        assert!(made.get() == 5 && begin.elapsed() >= Duration::from_millis(50));
    }

    #[test]
    fn damaged_answers_and_those_to_something_else_are_none() {
        let (table, made) = (Table::default(), Cell::new(0));
        squares(&Member(&table, 0), &Watch::default(), &made);
        let names: Vec<String> = table.answers.borrow().keys().cloned().collect();
        let other = table.answers.borrow()[&names[1]].clone();
        table.answers.borrow_mut().get_mut(&names[0]).unwrap()[9] ^= 1;
        table.answers.borrow_mut().get_mut(&names[2]).unwrap().truncate(11);
        // A bit of the number itself, in front of the sum.
        let place = table.answers.borrow()[&names[3]].len() - 10;
        table.answers.borrow_mut().get_mut(&names[3]).unwrap()[place] ^= 1;
        let shared = Shared { crew: &Member(&table, 0), watch: &Watch::default(), longest: Duration::ZERO };
        let read = |bytes: Vec<u8>, words: &str| {
            let task = Task::new(words.to_string());
            table.answers.borrow_mut().insert(task.name(), bytes);
            shared.taken_over::<f64>(&task)
        };
        assert!(read(other.clone(), "cube").is_none() && read(other, "square").is_some());
        assert_eq!(squares(&Member(&table, 0), &Watch::default(), &made), [0.0, 1.0, 4.0, 9.0, 16.0]);
        assert_eq!(made.get(), 8);
    }

    #[test]
    fn an_interrupted_task_gives_no_answer() {
        let (table, watch) = (Table::default(), Watch::default());
        let mut make = |_| {
            watch.stop.store(true, Ordering::Relaxed);
            Ok(1.0)
        };
        let all = Tasks::of(&Member(&table, 0)).each(2, &watch, &|k| Task::new(k.to_string()), &mut make);
        assert!(all.is_err() && table.answers.borrow().is_empty());
    }

    #[test]
    fn waves_hold_everything_once() {
        let of = |count: usize| waves(count).map(|wave| (wave.start, wave.end)).collect::<Vec<_>>();
        assert_eq!((of(0), of(1), of(2)), (vec![], vec![(0, 1)], vec![(0, 1), (1, 2)]));
        assert_eq!(of(9), [(0, 1), (1, 3), (3, 7), (7, 9)]);
    }
}
