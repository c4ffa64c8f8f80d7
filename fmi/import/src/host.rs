//! The side of the solver: begins the process of a unit, asks it, and says what became of it.
//!
//! A unit that crashes, hangs or ends itself leaves a sentence with its name and the function that ran; every later question gets the same
//! answer at once.  Questions of a solver allocate nothing.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::area::{ANSWER, Area, CALL, HOST_SLEEPS, OPERATION, REQUEST, STATUS, WORKER_SLEEPS};
use crate::channel::{Channel, Reader, Socket, Woken, Writer};
use crate::description::Version;
use crate::fault::Fault;
use crate::folder::Folder;
use crate::protocol::{Operation, Setup, Status};
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

/// A unit in its process.
pub(crate) struct Remote {
    child: Child,
    channel: Channel,
    host: Host,
    name: String,
    version: Version,
    number: u64,
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
        let (area, path) = Area::create(setup.words().max(room).max(LEAST_ROOM)).map_err(failed)?;
        let (own, other) = pair().inspect_err(|_| drop(std::fs::remove_file(&path))).map_err(failed)?;
        let begun = Command::new(&host.program)
            .args(&host.arguments)
            .arg(&path)
            .arg(folder.path())
            .stdin(other)
            .stdout(Stdio::from(std::io::stderr()))
            .spawn();
        let child = begun.inspect_err(|_| drop(std::fs::remove_file(&path))).map_err(failed)?;
        let channel = Channel::new(Arc::new(area), own, Some(SLICE)).map_err(failed)?;
        let mut remote = Self {
            child,
            channel,
            host: host.clone(),
            name: name.to_string(),
            version: setup.version,
            number: 0,
            discarded: None,
            fault: None,
            is_gone: false,
            _folder: Arc::clone(folder),
        };
        let loaded = remote.ask(Operation::Load, |writer| setup.write(writer)).map(|_| ());
        // Where the process has opened it, the name is gone already.
        let _ = std::fs::remove_file(&path);
        match loaded {
            Ok(()) => Ok(remote),
            Err(_) => Err(remote.why()),
        }
    }

    /// Number of questions so far.
    pub(crate) fn counts(&self) -> Counts {
        Counts { calls: self.number }
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
        let mut writer = Writer::new(&self.channel.area);
        write(&mut writer);
        if !writer.fits() {
            return Err(self.lose("what is to be set is too long"));
        }
        self.number += 1;
        self.channel.area.set(OPERATION, operation as u64);
        self.channel.post(REQUEST, self.number, WORKER_SLEEPS);
        let mut woken = self.channel.wait(ANSWER, self.number, HOST_SLEEPS);
        if !matches!(woken, Woken::Posted) {
            let begin = Instant::now();
            loop {
                match woken {
                    Woken::Posted => break,
                    Woken::Gone => return Err(self.gone()),
                    Woken::Later => self.is_patient(begin.elapsed())?,
                }
                woken = self.channel.sleep(ANSWER, self.number, HOST_SLEEPS);
            }
        }
        match self.channel.area.get(STATUS) {
            done if done == Status::Done as u64 => Ok(Reader::new(&self.channel.area)),
            discarded if discarded == Status::Discarded as u64 => {
                self.discarded = Some(Reader::new(&self.channel.area).text());
                Err(Refusal::Discarded)
            }
            _ => {
                let sentence = Reader::new(&self.channel.area).text();
                Err(self.lose(&sentence))
            }
        }
    }

    /// The function of the unit that runs now, or ran last.
    fn running(&self) -> String {
        let names = if self.version == Version::Two { fmi2::NAMES } else { fmi3::NAMES };
        let call = usize::try_from(self.channel.area.get(CALL)).ok().and_then(|call| call.checked_sub(1));
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
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.is_gone = true;
        Err(self.lose(&sentence))
    }

    /// The process is gone, or about to.
    fn gone(&mut self) -> Refusal {
        let begin = Instant::now();
        let mut ended = self.child.try_wait();
        while matches!(ended, Ok(None)) && begin.elapsed() < ENDING {
            std::thread::sleep(Duration::from_millis(1));
            ended = self.child.try_wait();
        }
        let how = match ended {
            Ok(Some(status)) => how(status),
            _ => {
                let _ = self.child.kill();
                let _ = self.child.wait();
                "closed its connection".to_string()
            }
        };
        self.is_gone = true;
        let running = self.running();
        self.lose(&format!("the unit {how} {running}"))
    }
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
        if self.is_gone {
            return;
        }
        // A unit that fails in its end has nobody left to tell.
        self.host.patience = self.host.patience.min(ENDING);
        if self.fault.is_some() {
            let _ = self.child.kill();
        } else {
            let _ = self.ask(Operation::End, |_| {});
        }
        if !self.is_gone {
            let begin = Instant::now();
            while matches!(self.child.try_wait(), Ok(None)) && begin.elapsed() < ENDING {
                std::thread::sleep(Duration::from_millis(1));
            }
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}
