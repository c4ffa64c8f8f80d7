//! Requests and answers over an [`Area`]: numbers one after the other, and how either side waits.
//!
//! A request is posted by its number; the other side answers with the same one.  Whoever waits looks at the number for a short while,
//! because most calls take less than the system needs to put a process to sleep and wake it, and then sleeps until a byte comes over a
//! socket; where looking is in vain, it sleeps at once.  Sleeping is announced first and the number looked at again, and whoever posts looks for the announcement after posting, both
//! in one order for all (`SeqCst`), so that no wake-up is lost (Dekker's pattern).  The end of the other process closes the socket.

use std::io::{self, Read, Write};
#[cfg(not(unix))]
pub(crate) use std::net::TcpStream as Socket;
#[cfg(unix)]
pub(crate) use std::os::unix::net::UnixStream as Socket;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::area::{Area, DATA};

/// How long a waiter looks before it sleeps, where there is another processor.
const LOOK: Duration = Duration::from_micros(40);
/// Looks between two questions for the time.
const LOOKS: u32 = 64;
/// After so many looks in vain in a row nobody looks, but for one wait in so many: the other process has no processor of its own then, and
/// looking takes the time that it needs.
const VAIN: u32 = 3;
const TRIAL: u32 = 64;

/// How waiting ended.
pub(crate) enum Woken {
    /// The number is there.
    Posted,
    /// The other process is gone.
    Gone,
    /// A slice of time has passed.
    Later,
}

/// One end.
pub(crate) struct Channel {
    pub(crate) area: Arc<Area>,
    socket: Socket,
    looks: bool,
    vain: u32,
    waits: u32,
}

impl Channel {
    /// `slice`: after this time waiting comes back to ask what else is to be done; none: never.
    pub(crate) fn new(area: Arc<Area>, socket: Socket, slice: Option<Duration>) -> io::Result<Self> {
        socket.set_read_timeout(slice)?;
        let looks = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get) > 1;
        Ok(Self { area, socket, looks, vain: 0, waits: 0 })
    }

    /// Posts a number; wakes the other side where it sleeps.
    pub(crate) fn post(&mut self, word: usize, number: u64, sleeper: usize) {
        self.area.word(word).store(number, Ordering::SeqCst);
        if self.area.word(sleeper).swap(0, Ordering::SeqCst) == 1 {
            // Where this fails the other side is gone, which the next wait sees.
            let _ = self.socket.write_all(&[1]);
        }
    }

    /// Waits for a number.
    pub(crate) fn wait(&mut self, word: usize, number: u64, own: usize) -> Woken {
        self.waits = self.waits.wrapping_add(1);
        if self.looks && (self.vain < VAIN || self.waits.is_multiple_of(TRIAL)) {
            let begin = Instant::now();
            loop {
                for _ in 0..LOOKS {
                    if self.area.word(word).load(Ordering::Acquire) == number {
                        self.vain = 0;
                        return Woken::Posted;
                    }
                    std::hint::spin_loop();
                }
                if begin.elapsed() > LOOK {
                    self.vain = self.vain.saturating_add(1);
                    break;
                }
            }
        }
        self.sleep(word, number, own)
    }

    /// The same without looking first.
    pub(crate) fn sleep(&mut self, word: usize, number: u64, own: usize) -> Woken {
        let mut bytes = [0; 64];
        loop {
            self.area.word(own).store(1, Ordering::SeqCst);
            if self.area.word(word).load(Ordering::SeqCst) == number {
                self.area.word(own).store(0, Ordering::SeqCst);
                return Woken::Posted;
            }
            match self.socket.read(&mut bytes) {
                Ok(0) => return self.last_look(word, number),
                Ok(_) => {}
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return match self.area.word(word).load(Ordering::SeqCst) == number {
                        true => Woken::Posted,
                        false => Woken::Later,
                    };
                }
                Err(_) => return self.last_look(word, number),
            }
        }
    }

    /// What was posted before the end counts.
    fn last_look(&self, word: usize, number: u64) -> Woken {
        if self.area.word(word).load(Ordering::SeqCst) == number { Woken::Posted } else { Woken::Gone }
    }
}

/// Writes data one after the other.  What does not fit is left out, and said by [`Writer::fits`].
pub(crate) struct Writer<'a> {
    area: &'a Area,
    at: usize,
    fits: bool,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(area: &'a Area) -> Self {
        Self { area, at: DATA, fits: true }
    }

    pub(crate) fn fits(&self) -> bool {
        self.fits
    }

    #[inline]
    pub(crate) fn number(&mut self, value: u64) {
        if self.at < DATA + self.area.room() {
            self.area.set(self.at, value);
            self.at += 1;
        } else {
            self.fits = false;
        }
    }

    #[inline]
    pub(crate) fn real(&mut self, value: f64) {
        self.number(value.to_bits());
    }

    #[inline]
    pub(crate) fn reals(&mut self, values: &[f64]) {
        values.iter().for_each(|&value| self.real(value));
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.number(text.len() as u64);
        for chunk in text.as_bytes().chunks(8) {
            let mut bytes = [0; 8];
            bytes[..chunk.len()].copy_from_slice(chunk);
            self.number(u64::from_le_bytes(bytes));
        }
    }

    /// A text of which the end may be left out.
    pub(crate) fn clipped(&mut self, text: &str) {
        let room = 8 * (DATA + self.area.room()).saturating_sub(self.at + 1);
        let mut end = text.len().min(room);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.text(&text[..end]);
    }
}

/// Reads data one after the other; behind the end there are zeros, and [`Reader::fits`] is false.
pub(crate) struct Reader<'a> {
    area: &'a Area,
    at: usize,
    fits: bool,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(area: &'a Area) -> Self {
        Self { area, at: DATA, fits: true }
    }

    pub(crate) fn fits(&self) -> bool {
        self.fits
    }

    #[inline]
    pub(crate) fn number(&mut self) -> u64 {
        if self.at < DATA + self.area.room() {
            self.at += 1;
            self.area.get(self.at - 1)
        } else {
            self.fits = false;
            0
        }
    }

    /// A number of things that follow, each of at least one word.
    pub(crate) fn count(&mut self) -> usize {
        let count = usize::try_from(self.number()).unwrap_or(usize::MAX);
        if count > self.area.room() {
            self.fits = false;
            return 0;
        }
        count
    }

    #[inline]
    pub(crate) fn real(&mut self) -> f64 {
        f64::from_bits(self.number())
    }

    #[inline]
    pub(crate) fn reals(&mut self, out: &mut [f64]) {
        out.iter_mut().for_each(|value| *value = self.real());
    }

    pub(crate) fn text(&mut self) -> String {
        let length = usize::try_from(self.number()).unwrap_or(usize::MAX);
        if length > 8 * self.area.room() {
            self.fits = false;
            return String::new();
        }
        let mut bytes = Vec::with_capacity(length + 8);
        while bytes.len() < length {
            bytes.extend(self.number().to_le_bytes());
        }
        bytes.truncate(length);
        String::from_utf8_lossy(&bytes).into_owned()
    }
}
