//! The side of the solver: begins the process of a unit, asks it, and says what became of it.
//!
//! Code that is not foreign needs no process: a unit for model exchange with the library that this program itself puts into units is asked here,
//! in the same words.
//!
//! A unit that crashes, hangs or ends itself leaves a sentence with its name and the function that ran; every later question gets the same
//! answer at once.  Questions of a solver allocate nothing.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::area::{ANSWER, Area, CALL, HEARD, HOST_SLEEPS, OPERATION, REQUEST, STATUS, WORKER_SLEEPS};
use crate::channel::{Channel, Reader, Socket, Woken, Writer};
use crate::description::Version;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::protocol::{Operation, Setup, Status};
use crate::session::Session;
use crate::worker::perform;
use crate::{fmi2, fmi3};

/// How often a waiting process asks whether it should go on waiting.
const SLICE: Duration = Duration::from_millis(100);
/// A unit that is asked to stop gets so long to come back from what it does.
const GRACE: Duration = Duration::from_secs(1);
/// A process whose socket is closed ends within this time.
const ENDING: Duration = Duration::from_secs(2);
/// Words for messages.
const LEAST_ROOM: usize = 8192;

/// How the process of a unit is begun and how long it is waited for.
#[derive(Clone, Debug)]
pub struct Host {
    /// The program that calls [`crate::serve`].
    pub program: PathBuf,
    /// Its arguments, before those of [`crate::serve`].
    pub arguments: Vec<OsString>,
    /// A call that takes longer is given up.
    pub patience: Duration,
    /// Asked while a call takes its time; true gives it up.
    pub interrupted: fn() -> bool,
    /// The library that this program puts into units for others; a unit with the same one, byte by byte, runs in this process.
    pub own: Option<PathBuf>,
}

impl Host {
    /// True if a library is the one of this program.
    fn is_own(&self, library: &Path) -> bool {
        let Some(own) = &self.own else { return false };
        let length = |path: &Path| std::fs::metadata(path).map(|found| found.len()).ok();
        if length(own).is_none() || length(own) != length(library) {
            return false;
        }
        matches!((std::fs::read(own), std::fs::read(library)), (Ok(own), Ok(other)) if own == other)
    }
}

/// What a unit has been asked.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Questions to the process of the unit.
    pub calls: u64,
}

/// Why a question has no answer.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Refusal {
    /// The unit has no value there; a sentence stands in [`Remote::discarded`].
    Discarded,
    /// The unit cannot be used any more; a sentence stands in [`Remote::fault`].
    Lost,
}

/// A unit of our own, asked where the solver is.
struct Near {
    area: Area,
    session: Option<Session>,
}

// SAFETY: an instance of the library of this program belongs to no thread: it keeps no state outside of itself, and is asked by one at a
// time because asking needs it exclusively.
#[allow(unsafe_code)]
unsafe impl Send for Near {}

impl Drop for Near {
    fn drop(&mut self) {
        if let Some(session) = &mut self.session {
            session.end();
        }
    }
}

/// A unit in a process of its own.
struct Far {
    child: Child,
    channel: Channel,
}

/// Where a unit is.
enum Place {
    Near(Box<Near>),
    Far(Far),
}

/// A unit that can be asked.
pub(crate) struct Remote {
    place: Place,
    host: Host,
    name: String,
    version: Version,
    number: u64,
    /// Messages wait for being asked for.
    has_said: bool,
    /// Why the unit has no value at the point asked for last.
    pub(crate) discarded: Option<String>,
    /// Why it cannot be used any more.
    pub(crate) fault: Option<Fault>,
    is_gone: bool,
    _folder: Arc<Folder>,
}

impl Remote {
    /// Begins the process and loads the library.  `room`: words that the beginning of a run may need.
    pub(crate) fn begin(
        host: &Host,
        (name, folder): (&str, &Arc<Folder>),
        setup: &Setup,
        room: usize,
    ) -> Result<Self, Fault> {
        let failed = |error: std::io::Error| Fault::of(name, format!("no process can be begun for the unit: {error}"));
        let words = setup.words().max(room).max(LEAST_ROOM);
        let made = |place: Place| Self {
            place,
            host: host.clone(),
            name: name.to_string(),
            version: setup.version,
            number: 0,
            has_said: false,
            discarded: None,
            fault: None,
            is_gone: false,
            _folder: Arc::clone(folder),
        };
        let load = |mut remote: Self, library: &str| {
            let setup = Setup { library: library.to_string(), ..setup.clone() };
            match remote.ask(Operation::Load, |writer| setup.write(writer)).map(|_| ()) {
                Ok(()) => Ok(remote),
                Err(_) => Err(remote.why()),
            }
        };
        let is_own = || *folder.is_own.get_or_init(|| host.is_own(Path::new(&setup.library)));
        if setup.exchange
            && is_own()
            && let Some(own) = &host.own
        {
            // The same code, from where nobody else writes.
            let area = Area::private(words).map_err(failed)?;
            return load(made(Place::Near(Box::new(Near { area, session: None }))), &own.display().to_string());
        }
        let (area, path) = Area::create(words).map_err(failed)?;
        let (own, other) = pair().inspect_err(|_| drop(std::fs::remove_file(&path))).map_err(failed)?;
        let mut command = Command::new(&host.program);
        // What the unit begins for itself ends with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let begun = command
            .args(&host.arguments)
            .arg(&path)
            .arg(folder.path())
            .stdin(other)
            .stdout(Stdio::from(std::io::stderr()))
            .spawn();
        let child = begun.inspect_err(|_| drop(std::fs::remove_file(&path))).map_err(failed)?;
        let channel = Channel::new(Arc::new(area), own, Some(SLICE)).map_err(failed)?;
        let loaded = load(made(Place::Far(Far { child, channel })), &setup.library);
        // Where the process has opened it, the name is gone already.
        let _ = std::fs::remove_file(&path);
        loaded
    }

    /// Number of questions so far.
    pub(crate) fn counts(&self) -> Counts {
        Counts { calls: self.number }
    }

    /// Words of data that a question or an answer may have.
    pub(crate) fn room(&self) -> usize {
        self.area().room()
    }

    /// True if it has a process of its own.
    pub(crate) fn is_far(&self) -> bool {
        matches!(self.place, Place::Far(_))
    }

    /// What to say where a question had no answer.
    pub(crate) fn why(&self) -> Fault {
        let discarded = || Fault::of(&self.name, self.discarded.as_deref().unwrap_or("the unit gives no answer"));
        self.fault.clone().unwrap_or_else(discarded)
    }

    /// Asks a question; the answer is read before the next one.
    pub(crate) fn ask(
        &mut self,
        operation: Operation,
        write: impl FnOnce(&mut Writer<'_>),
    ) -> Result<Reader<'_>, Refusal> {
        self.discarded = None;
        if self.fault.is_some() {
            return Err(Refusal::Lost);
        }
        let mut writer = Writer::new(self.area());
        write(&mut writer);
        if !writer.fits() {
            return Err(self.lose("what is to be set is too long"));
        }
        self.number += 1;
        let status = match &mut self.place {
            Place::Near(near) => perform(&near.area, Some(operation), &mut near.session) as u64,
            Place::Far(_) => self.ask_far(operation)?,
        };
        self.has_said = self.area().get(HEARD) != 0;
        match status {
            done if done == Status::Done as u64 => Ok(Reader::new(self.area())),
            discarded if discarded == Status::Discarded as u64 => {
                self.discarded = Some(Reader::new(self.area()).text());
                Err(Refusal::Discarded)
            }
            _ => {
                let sentence = Reader::new(self.area()).text();
                Err(self.lose(&sentence))
            }
        }
    }

    /// What the unit has said since the last question; what it said where a question had no answer stands in the reason for that.
    pub(crate) fn said(&mut self) -> Vec<String> {
        if !self.has_said {
            return Vec::new();
        }
        let Ok(mut reader) = self.ask(Operation::Said, |_| {}) else { return Vec::new() };
        let count = reader.count();
        (0..count).map(|_| reader.text()).collect()
    }

    /// Posts a request, and waits for its status.
    fn ask_far(&mut self, operation: Operation) -> Result<u64, Refusal> {
        let Place::Far(Far { channel, .. }) = &mut self.place else { return Err(Refusal::Lost) };
        channel.area.set(OPERATION, operation as u64);
        channel.post(REQUEST, self.number, WORKER_SLEEPS);
        let mut woken = channel.wait(ANSWER, self.number, HOST_SLEEPS);
        let begin = Instant::now();
        loop {
            match woken {
                Woken::Posted => return Ok(self.area().get(STATUS)),
                Woken::Gone => return Err(self.gone()),
                Woken::Later => self.is_patient(begin.elapsed())?,
            }
            let Place::Far(Far { channel, .. }) = &mut self.place else { return Err(Refusal::Lost) };
            woken = channel.sleep(ANSWER, self.number, HOST_SLEEPS);
        }
    }

    fn area(&self) -> &Area {
        match &self.place {
            Place::Near(near) => &near.area,
            Place::Far(far) => &far.channel.area,
        }
    }

    /// The function of the unit that runs now, or ran last.
    fn running(&self) -> String {
        let names = if self.version == Version::Two { fmi2::NAMES } else { fmi3::NAMES };
        let call = usize::try_from(self.area().get(CALL)).ok().and_then(|call| call.checked_sub(1));
        match call.and_then(|call| names.get(call)) {
            Some(name) => format!("in `{name}`"),
            None => "outside of its functions".to_string(),
        }
    }

    fn lose(&mut self, sentence: &str) -> Refusal {
        self.fault = Some(Fault::of(&self.name, sentence));
        Refusal::Lost
    }

    fn is_patient(&mut self, waited: Duration) -> Result<(), Refusal> {
        let sentence = if (self.host.interrupted)() && waited > GRACE {
            format!("the unit was ended {} because of the interruption", self.running())
        } else if waited > self.host.patience {
            let seconds = self.host.patience.as_secs_f64();
            format!("the unit hangs {}: it has not come back for {seconds} s and was ended", self.running())
        } else {
            return Ok(());
        };
        if let Place::Far(Far { child, .. }) = &mut self.place {
            end(child);
        }
        self.is_gone = true;
        Err(self.lose(&sentence))
    }

    /// The process is gone, or about to.
    fn gone(&mut self) -> Refusal {
        let Place::Far(Far { child, .. }) = &mut self.place else { return Refusal::Lost };
        let begin = Instant::now();
        let mut ended = child.try_wait();
        while matches!(ended, Ok(None)) && begin.elapsed() < ENDING {
            std::thread::sleep(Duration::from_millis(1));
            ended = child.try_wait();
        }
        let how = match ended {
            Ok(Some(status)) => how(status),
            _ => "closed its connection".to_string(),
        };
        end(child);
        self.is_gone = true;
        let running = self.running();
        self.lose(&format!("the unit {how} {running}"))
    }
}

/// Ends a process with all that it has begun.
fn end(child: &mut Child) {
    #[cfg(unix)]
    if let Ok(id) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, killpg};
        // An error says that nobody is left.
        let _ = killpg(nix::unistd::Pid::from_raw(id), Signal::SIGKILL);
    }
    let _ = child.kill();
    let _ = child.wait();
}

/// A socket and its other end as the standard input of a process.
#[cfg(unix)]
fn pair() -> std::io::Result<(Socket, Stdio)> {
    let (own, other) = Socket::pair()?;
    Ok((own, Stdio::from(std::os::fd::OwnedFd::from(other))))
}

#[cfg(not(unix))]
fn pair() -> std::io::Result<(Socket, Stdio)> {
    Err(std::io::Error::other("units of other tools run on Linux and macOS only"))
}

/// The signal that ended a process.
fn signal(status: ExitStatus) -> Option<i32> {
    #[cfg(unix)]
    return std::os::unix::process::ExitStatusExt::signal(&status);
    #[cfg(not(unix))]
    return None;
}

/// How a process ended.
fn how(status: ExitStatus) -> String {
    match (signal(status), status.code()) {
        (Some(signal), _) => {
            let word = match signal {
                4 => ", an instruction that is not one",
                6 => ", it gave up by itself",
                7 | 11 => ", an access to memory that is not its own",
                8 => ", an arithmetic error",
                9 => ", ended from outside",
                _ => "",
            };
            format!("crashed (signal {signal}{word})")
        }
        (None, Some(code)) => format!("ended its process (exit code {code})"),
        _ => "ended its process".to_string(),
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        if self.is_gone || matches!(self.place, Place::Near(_)) {
            return;
        }
        // A unit that fails in its end has nobody left to tell.
        self.host.patience = self.host.patience.min(ENDING);
        let is_lost = self.fault.is_some();
        if !is_lost {
            let _ = self.ask(Operation::End, |_| {});
        }
        let Place::Far(Far { child, .. }) = &mut self.place else { return };
        if !self.is_gone {
            let begin = Instant::now();
            while !is_lost && matches!(child.try_wait(), Ok(None)) && begin.elapsed() < ENDING {
                std::thread::sleep(Duration::from_millis(1));
            }
            end(child);
        }
    }
}
