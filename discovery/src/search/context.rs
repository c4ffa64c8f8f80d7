//! What a search is given, and how its fits are weighed and followed.

use super::ends::Ends;
use super::memory::Memory;
use crate::catalogue::Candidate;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::thresholds::NEEDED;
use crate::fault::Fault;
use crate::fit::{Effort, schedule};
use crate::problem::{Problem, Weighing};
use crate::setup::Setup;
use crate::tasks::{Answer, Task, Tasks};
use crate::variant::Workshop;

/// A search.
pub struct Search<'a> {
    /// Study and set.
    pub setup: &'a Setup,
    /// Writer of models.
    pub workshop: &'a Workshop<'a>,
    /// All that may be missing.
    pub candidates: Vec<Candidate>,
    /// Seed of random starts.
    pub seed: u64,
    /// Drop of the cost that a name needs: [`Search::NEEDED`], or more where [`crate::calibration`] says so.
    pub needed: f64,
    /// Told what is being done.
    pub progress: &'a dyn Fn(&str),
    /// Fits made before.
    pub memory: &'a dyn Memory,
    /// Where the round before ended; empty at first.
    pub ends: Ends,
    /// Who makes its tasks.
    pub tasks: Tasks<'a>,
}

impl Search<'_> {
    /// Drop of the cost that a name needs unless a calibration says more.
    pub const NEEDED: f64 = NEEDED;

    /// True weights over the fitted shots.
    pub(super) fn whole(&self) -> Weighing {
        Weighing::whole(&self.setup.train, self.setup.study.shots.time_tolerance)
    }

    /// Wide weights over them, under which fits begin.
    pub(super) fn wide(&self) -> Weighing {
        let whole = self.whole();
        Weighing { inflation: 3.5, tau: schedule::widened(whole.tau), ..whole }
    }

    /// The task of doing something with a model from these numbers.
    pub(super) fn task(&self, role: &str, hypothesis: &Hypothesis, from: &[&[f64]]) -> Task {
        // Terms have spreads, and laws of one place differ by what is expected of their numbers.
        let mut words = format!("{}{}", self.workshop.preamble, self.key(role, hypothesis));
        for law in hypothesis.inserts.iter().filter(|own| own.effect.is_law) {
            words += &format!(" {:?}", law.effect.parameters);
        }
        let spreads: Vec<f64> = hypothesis.terms.iter().map(|own| own.1).collect();
        from.iter().fold(Task::new(words).from(&spreads), |task, numbers| task.from(numbers))
    }

    /// Tasks that do not depend on each other.
    pub(super) fn each<T: Answer>(
        &self,
        count: usize,
        task: impl Fn(usize) -> Task,
        mut make: impl FnMut(usize) -> Result<T, Fault>,
    ) -> Result<Vec<T>, Fault> {
        self.tasks.each(count, &self.setup.watch, &task, &mut make)
    }

    /// A task by itself, which others wait for.
    pub(super) fn one<T: Answer>(
        &self,
        task: impl Fn() -> Task,
        make: impl Fn() -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        let all = self.tasks.each(1, &self.setup.watch, &|_| task(), &mut |_| make())?;
        all.into_iter().next().ok_or_else(|| Fault::run("a task has no answer"))
    }
}

/// How hard a fit is followed on: derivatives through delays are dear.
pub(super) fn patience(problem: &Problem<'_>) -> Effort {
    if problem.machine.is_fast() { Effort::LONG } else { Effort { reuse: 8, ..Effort::FULL } }
}
