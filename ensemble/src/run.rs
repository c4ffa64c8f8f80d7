//! Works off a share of an ensemble on several threads.
//!
//! Each thread has a system and a simulator of its own and takes the next chunk that nobody has; a chunk is written when all
//! its members have run.  Nothing depends on which thread does what, so results are the same for any number of threads.
//! A member in which rounding errors grow along a torn loop is run again by a system whose loops are whole, where there is one.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use hyd_runtime::{Options, Simulator, SolveError, Summary};
use hyd_system::{DaeSystem, VariableInfo};

use crate::chunk::{Ending, FAILED, Head, Recorder, Rows, Table, Taken, written};
use crate::failures::{Failure, Failures};
use crate::measure::Follower;
use crate::{Folder, Measure, MeasureError, Members, Resolved, Shard};

/// What is kept of each run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kept {
    /// The values at its end.
    Final,
    /// All rows as well.
    Rows,
}

/// For each varied parameter where it stands in `DaeSystem::parameters` (an array may take several places), with its sign.
pub type Places = Vec<Vec<(usize, f64)>>;

/// Makes a system with whole loops, ready but for the varied parameters, and says where these stand; none if there is none.
pub type WholeLoops<'a> = dyn Fn() -> Option<(Box<dyn DaeSystem>, Places)> + Sync + 'a;

/// A share of an ensemble.
pub struct Job<'a> {
    /// The values.
    pub members: &'a Members,
    /// Names of the varied parameters.
    pub names: Vec<String>,
    /// Where they stand.
    pub places: Places,
    /// Why the values of a system are not to be run, if they are not.
    pub refuse: &'a (dyn Fn(&mut dyn DaeSystem) -> Option<String> + Sync),
    /// Makes a system, ready but for the varied parameters.
    pub system: &'a (dyn Fn() -> Box<dyn DaeSystem> + Sync),
    /// Asked where a torn loop may be at fault.
    pub whole_loops: &'a WholeLoops<'a>,
    /// Times and tolerance of every run.
    pub options: Options,
    /// Which variables are kept.
    pub keep: &'a (dyn Fn(&VariableInfo, &str) -> bool + Sync),
    /// What is kept of each run.
    pub kept: Kept,
    /// What is measured of each run.
    pub measures: Vec<Measure>,
    /// Where results go.
    pub folder: &'a Folder,
    /// Which chunks.
    pub shard: Shard,
    /// Number of threads.
    pub threads: usize,
}

/// What came out.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// Members of the share.
    pub members: usize,
    /// Members that had been run before.
    pub before: usize,
    /// Members run now, failed ones included.
    pub now: usize,
    /// Members that failed, now or before.
    pub failed: usize,
    /// Why they did, the commonest reason first.
    pub failures: Vec<Failure>,
    /// Members, now or before, whose results come from the system with whole loops.
    pub whole_loops: usize,
    /// Members run now that failed where a torn loop may be at fault.
    pub rounding: usize,
    /// The caller asked to stop.
    pub interrupted: bool,
}

/// Runs what is left of the share.  `progress` gets the numbers of members done and of the whole share; when `stop` says so,
/// chunks that are not done are given up and done anew next time.
///
/// # Errors
/// When a result cannot be written; what was written before stays.
pub fn run(
    job: &Job<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> io::Result<Report> {
    let share: Vec<usize> = (0..job.folder.chunks()).filter(|&chunk| job.shard.holds(chunk)).collect();
    let size = |chunks: &[usize]| chunks.iter().map(|&chunk| job.folder.members_of(chunk).len()).sum::<usize>();
    let (before, left): (Vec<usize>, Vec<usize>) = share.iter().partition(|&&chunk| job.folder.is_done(chunk));
    let mut report = Report { members: size(&share), ..Report::default() };
    report.before = size(&before);

    // Who goes on with a sweep wants to know how all of it went.
    let mut earlier = Failures::default();
    for chunk in before {
        let written = written(&job.folder.members_file(chunk));
        report.whole_loops += written.again;
        for (member, message) in written.failed {
            report.failed += 1;
            earlier.add(member, &message);
        }
    }

    let (next, done, failed) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(report.failed));
    let (whole_loops, rounding) = (AtomicUsize::new(report.whole_loops), AtomicUsize::new(0));
    let failures = Mutex::new(earlier);
    let halted = AtomicBool::new(false);
    let fault: Mutex<Option<io::Error>> = Mutex::new(None);
    let halt = || halted.load(Ordering::Relaxed) || stop();
    let counted = |member: usize, ending: &Ending| {
        whole_loops.fetch_add(usize::from(ending.rounding && ending.status != FAILED), Ordering::Relaxed);
        if ending.status == FAILED {
            failed.fetch_add(1, Ordering::Relaxed);
            rounding.fetch_add(usize::from(ending.rounding), Ordering::Relaxed);
            failures.lock().unwrap_or_else(PoisonError::into_inner).add(member, &ending.message);
        }
        let now = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress(report.before + now, report.members);
    };
    std::thread::scope(|scope| {
        for _ in 0..job.threads.clamp(1, left.len().max(1)) {
            scope.spawn(|| {
                let mut worker = match Worker::new(job) {
                    Ok(worker) => worker,
                    Err(error) => {
                        let error = io::Error::other(error.to_string());
                        fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                        return;
                    }
                };
                while let Some(&chunk) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if halt() {
                        break;
                    }
                    if let Err(error) = worker.chunk(chunk, &counted, &halt) {
                        fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                        halted.store(true, Ordering::Relaxed);
                    }
                }
            });
        }
    });
    if let Some(error) = fault.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    report.now = done.into_inner();
    report.failed = failed.into_inner();
    report.whole_loops = whole_loops.into_inner();
    report.rounding = rounding.into_inner();
    report.failures = failures.into_inner().unwrap_or_else(PoisonError::into_inner).ranked();
    report.interrupted = stop();
    Ok(report)
}

/// What a thread works with.
struct Worker<'a> {
    job: &'a Job<'a>,
    torn: Runner,
    /// Made when it is needed first; none where there is none.
    whole: Option<Option<Runner>>,
}

/// A system with all that runs of it need.
struct Runner {
    system: Box<dyn DaeSystem>,
    simulator: Simulator,
    head: Head,
    measures: Vec<Resolved>,
    places: Places,
    options: Options,
}

impl<'a> Worker<'a> {
    fn new(job: &'a Job<'a>) -> Result<Self, MeasureError> {
        Ok(Self { job, torn: Runner::new(job, (job.system)(), job.places.clone())?, whole: None })
    }

    fn chunk(&mut self, chunk: usize, counted: &dyn Fn(usize, &Ending), halt: &dyn Fn() -> bool) -> io::Result<()> {
        let job = self.job;
        let mut table = Table::new(&self.torn.head);
        let (mut rows, mut again) = (Rows::default(), 0);
        for member in job.folder.members_of(chunk) {
            let values = job.members.values(member);
            let Some((ending, last)) = self.member((member, &values), &mut rows, halt)? else { return Ok(()) };
            counted(member, &ending);
            again += usize::from(ending.rounding && ending.status != FAILED);
            table.push(member, &values, ending, last);
        }
        job.folder.make_place(chunk)?;
        if job.kept == Kept::Rows {
            rows.write(&job.folder.rows_file(chunk), &self.torn.head)?;
        }
        table.write(&job.folder.members_file(chunk), &self.torn.head, again)
    }

    /// How a member ended and what was taken of it; its rows are added where rows are kept.  `None` if it was stopped from outside.
    fn member(
        &mut self,
        member: (usize, &[f64]),
        rows: &mut Rows,
        halt: &dyn Fn() -> bool,
    ) -> io::Result<Option<(Ending, Taken)>> {
        let job = self.job;
        let mut own = Rows::default();
        let Some(mut run) = self.torn.one(job, member, &mut own, halt)? else { return Ok(None) };
        if run.0.rounding
            && let Some(whole) = self.whole()
        {
            let mut again = Rows::default();
            let Some(other) = whole.one(job, member, &mut again, halt)? else { return Ok(None) };
            // Where that fails, too, the loops are not to blame.
            if other.0.status != FAILED {
                (run, own) = ((Ending { rounding: true, ..other.0 }, other.1), again);
            }
        }
        rows.append(own);
        Ok(Some(run))
    }

    /// The system with whole loops, if there is one with the same columns.
    fn whole(&mut self) -> Option<&mut Runner> {
        let (job, torn) = (self.job, &self.torn);
        let make = || {
            let (system, places) = (job.whole_loops)()?;
            let runner = Runner::new(job, system, places).ok()?;
            runner.head.is_like(&torn.head).then_some(runner)
        };
        self.whole.get_or_insert_with(make).as_mut()
    }
}

impl Runner {
    fn new(job: &Job<'_>, system: Box<dyn DaeSystem>, places: Places) -> Result<Self, MeasureError> {
        let simulator = Simulator::new(system.structure());
        let tables = system.tables();
        let measures = job.measures.iter().map(|measure| measure.resolve(tables)).collect::<Result<Vec<_>, _>>()?;
        let head = Head::new(tables, job.names.clone(), &job.measures, |variable, name| (job.keep)(variable, name));
        let measured: Vec<u32> = measures.iter().flat_map(Resolved::outputs).collect();
        let recorded = head.outputs().chain(measured.iter().copied()).collect();
        let (needed_outputs, needed_within) = (Some(recorded), Some(measured));
        let options = Options { needed_outputs, needed_within, ..job.options.clone() };
        Ok(Self { system, simulator, head, measures, places, options })
    }

    /// One run and what was taken of it; `None` if it was stopped from outside.
    fn one(
        &mut self,
        job: &Job<'_>,
        (member, values): (usize, &[f64]),
        rows: &mut Rows,
        halt: &dyn Fn() -> bool,
    ) -> io::Result<Option<(Ending, Taken)>> {
        let kept = (job.kept == Kept::Rows).then_some(rows);
        let mut recorder = Recorder::new(&self.head.columns, kept, Follower::new(&self.measures), member);
        let Some(ending) = run_one(
            &mut *self.system,
            &mut self.simulator,
            (job, &self.options, &self.places),
            values,
            &mut recorder,
            halt,
        )?
        else {
            return Ok(None);
        };
        Ok(Some((ending, recorder.taken())))
    }
}

/// One run; `None` if it was stopped from outside.
fn run_one(
    system: &mut dyn DaeSystem,
    simulator: &mut Simulator,
    (job, options, places): (&Job<'_>, &Options, &Places),
    values: &[f64],
    recorder: &mut Recorder<'_>,
    halt: &dyn Fn() -> bool,
) -> io::Result<Option<Ending>> {
    let start = options.start;
    let refused = |message: String| Ending { status: FAILED, message, time: start, rounding: false };
    for ((name, places), &value) in job.names.iter().zip(places).zip(values) {
        for &(place, sign) in places {
            if system.set_parameter(place, sign * value).is_err() {
                return Ok(Some(refused(format!("`{name}` cannot be set to {value}"))));
            }
        }
    }
    if let Some(message) = (job.refuse)(system) {
        return Ok(Some(refused(message)));
    }
    Ok(Some(match simulator.run(system, options, recorder, halt) {
        Ok(Summary { terminated: Some(message), time, .. }) => {
            Ending { status: "terminated", message, time, rounding: false }
        }
        Ok(Summary { time, rescue, undetermined, .. }) => {
            let said = rescue.iter().map(ToString::to_string).chain(undetermined.iter().map(ToString::to_string));
            let message = said.collect::<Vec<_>>().join("; ");
            Ending { status: "done", message, time, rounding: false }
        }
        Err(SolveError::Interrupted { .. }) => return Ok(None),
        Err(SolveError::Sink { error, .. }) => return Err(error),
        Err(error) => {
            let (time, rounding) = (error.time().unwrap_or(start), error.may_be_of_loops());
            Ending { status: FAILED, message: error.to_string(), time, rounding }
        }
    }))
}
