//! The process of a unit: waits for requests, does them, and ends with the process that began it.
//!
//! Its standard input is the socket to that process, and what the unit prints goes to the standard error of both.

#![allow(unsafe_code)]

use std::path::{Path, PathBuf};
use std::sync::Arc;
#[cfg(unix)]
use std::time::Duration;

use crate::area::{ANSWER, Area, HEARD, HOST_SLEEPS, OPERATION, REQUEST, STATUS, WORKER_SLEEPS};
use crate::channel::{Channel, Reader, Socket, Woken, Writer};
use crate::foreign::{Halt, announce_in, has_messages, messages};
use crate::protocol::{Operation, Setup, Status};
use crate::session::Session;

#[cfg(unix)]
/// How often the process looks whether the one that began it is still there.
const WATCH: Duration = Duration::from_millis(500);

/// Serves a unit until there are no more requests.  `area`: the memory that both see; `folder`: the files of the unit, which are
/// removed where the process that began this one ends without doing so.
///
/// # Errors
/// A sentence: this process was not begun as it should be.
pub fn serve(area: &Path, folder: &Path) -> Result<(), String> {
    let opened = Area::open(area).map_err(|error| format!("the memory of the unit cannot be opened: {error}"))?;
    // Seen by both now, so that nobody needs its name.
    let _ = std::fs::remove_file(area);
    let area = Arc::new(opened);
    announce_in(&area);
    watch(folder.to_path_buf());
    let channel = own_socket().and_then(|socket| Channel::new(Arc::clone(&area), socket, None));
    let mut channel = channel.map_err(|error| format!("the socket of the unit cannot be used: {error}"))?;
    let mut session: Option<Session> = None;
    for number in 1.. {
        if !matches!(channel.wait(REQUEST, number, WORKER_SLEEPS), Woken::Posted) {
            break;
        }
        let operation = Operation::of(area.get(OPERATION));
        let status = perform(&area, operation, &mut session);
        area.set(STATUS, status as u64);
        channel.post(ANSWER, number, HOST_SLEEPS);
        if operation == Some(Operation::End) {
            break;
        }
    }
    if let Some(session) = &mut session {
        session.end();
    }
    Ok(())
}

/// Does what is asked for in a memory, and writes the answer there.
pub(crate) fn perform(area: &Area, operation: Option<Operation>, session: &mut Option<Session>) -> Status {
    let (mut request, mut answer) = (Reader::new(area), Writer::new(area));
    let done = match (operation, &mut *session) {
        (Some(Operation::Load), _) => match Setup::read(&mut request) {
            Some(setup) => Session::load(setup).map(|loaded| *session = Some(loaded)),
            None => Err(Halt::Failed("the setup makes no sense".to_string())),
        },
        (Some(Operation::Said), _) => {
            let said = messages();
            answer.number(said.len() as u64);
            said.iter().for_each(|text| answer.text(text));
            Ok(())
        }
        (Some(operation), Some(session)) => session.perform(operation, &mut request, &mut answer),
        _ => Err(Halt::Failed("the request makes no sense".to_string())),
    };
    area.set(HEARD, u64::from(has_messages()));
    match done {
        Ok(()) => Status::Done,
        Err(Halt::Discarded(call)) => {
            Writer::new(area).clipped(&with_messages(format!("`{call}` has no value there")));
            Status::Discarded
        }
        Err(Halt::Failed(sentence)) => {
            Writer::new(area).clipped(&with_messages(sentence));
            Status::Failed
        }
    }
}

fn with_messages(sentence: String) -> String {
    match messages().as_slice() {
        [] => sentence,
        said => format!("{sentence}: {}", said.join("; ")),
    }
}

/// The socket that is the standard input of this process.
#[cfg(unix)]
fn own_socket() -> std::io::Result<Socket> {
    use std::os::fd::{FromRawFd, OwnedFd};
    // SAFETY: the process that began this one has put a socket there, and nobody else here uses it.
    Ok(Socket::from(unsafe { OwnedFd::from_raw_fd(0) }))
}

#[cfg(not(unix))]
fn own_socket() -> std::io::Result<Socket> {
    Err(std::io::Error::other("units of other tools run on Linux and macOS only"))
}

/// Ends this process when the one that began it is gone, whatever the unit does meanwhile.
#[cfg(unix)]
fn watch(folder: PathBuf) {
    let parent = std::os::unix::process::parent_id();
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(WATCH);
            if std::os::unix::process::parent_id() != parent {
                let _ = std::fs::remove_dir_all(&folder);
                // All of the group that this process leads, what the unit has begun and this process itself.
                let _ = nix::sys::signal::killpg(nix::unistd::getpgrp(), nix::sys::signal::Signal::SIGKILL);
                std::process::exit(1);
            }
        }
    });
}

#[cfg(not(unix))]
fn watch(_folder: PathBuf) {}
