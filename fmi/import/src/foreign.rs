//! What both versions of the interface have in common as this program uses them: calls, how they end, what the unit says meanwhile.
//!
//! This and what stands on it runs in the process of the unit; for units of our own in that of the solver, several at a time.

use std::ffi::{CStr, CString, c_char};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::ThreadId;

use crate::area::{Area, CALL};
use crate::description::Number;
use crate::protocol::{Setup, Update};

/// Messages of the unit that are kept until somebody asks.
const MOST_MESSAGES: usize = 20;
/// Bytes of one message.
const LONGEST_MESSAGE: usize = 1000;

/// How a call ended short of success.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Halt {
    /// The unit has no value there: this function says so.
    Discarded(&'static str),
    /// The unit cannot go on: a sentence.
    Failed(String),
}

/// How a step of co-simulation ended.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct StepEnd {
    /// Time that the unit has reached (s).
    pub(crate) reached: f64,
    /// The unit wants the run to end.
    pub(crate) terminate: bool,
}

/// An instance of a unit.
pub(crate) trait Foreign {
    fn instantiate(&mut self, setup: &Setup) -> Result<(), Halt>;
    /// Wants to hear of warnings; a unit that will not go along is as silent as before.
    fn ask_for_warnings(&mut self);
    fn free(&mut self);
    fn get(&mut self, number: Number, references: &[u32], values: &mut [f64]) -> Result<(), Halt>;
    fn set(&mut self, number: Number, references: &[u32], values: &[f64]) -> Result<(), Halt>;
    fn set_text(&mut self, reference: u32, text: &CStr) -> Result<(), Halt>;
    /// From the start (s) with a tolerance, to a stop (s) where that is known.
    fn enter_initialization(&mut self, start: f64, stop: Option<f64>, tolerance: f64) -> Result<(), Halt>;
    fn exit_initialization(&mut self) -> Result<(), Halt>;
    fn terminate(&mut self) -> Result<(), Halt>;

    fn enter_events(&mut self) -> Result<(), Halt>;
    /// One update of discrete states; true if another one is needed.
    fn update(&mut self, update: &mut Update) -> Result<bool, Halt>;
    fn enter_continuous(&mut self) -> Result<(), Halt>;
    /// An event is wanted, the end is wanted.
    fn completed(&mut self) -> Result<(bool, bool), Halt>;
    fn set_time(&mut self, t: f64) -> Result<(), Halt>;
    fn set_states(&mut self, states: &[f64]) -> Result<(), Halt>;
    fn states(&mut self, out: &mut [f64]) -> Result<(), Halt>;
    fn nominals(&mut self, out: &mut [f64]) -> Result<(), Halt>;
    fn rates(&mut self, out: &mut [f64]) -> Result<(), Halt>;
    fn indicators(&mut self, out: &mut [f64]) -> Result<(), Halt>;
    fn directional(&mut self, of: (&[u32], &[u32]), seed: &[f64], out: &mut [f64]) -> Result<(), Halt>;

    fn set_slopes(&mut self, references: &[u32], slopes: &[f64]) -> Result<(), Halt>;
    fn step(&mut self, t: f64, h: f64) -> Result<StepEnd, Halt>;
}

static AREA: OnceLock<Arc<Area>> = OnceLock::new();
/// Messages beyond those that are kept.
static DROPPED: AtomicUsize = AtomicUsize::new(0);
/// There are messages.
static WAITING: AtomicBool = AtomicBool::new(false);
static MESSAGES: Mutex<Vec<(ThreadId, String)>> = Mutex::new(Vec::new());

/// From now on the other process can see which function runs.
pub(crate) fn announce_in(area: &Arc<Area>) {
    let _ = AREA.set(Arc::clone(area));
}

/// This function runs now, by its number from 1; 0: none.
#[inline]
pub(crate) fn announce(call: u64) {
    if let Some(area) = AREA.get() {
        area.set(CALL, call);
    }
}

/// Position of a name from 1, for tables made when this is compiled.
pub(crate) const fn position(names: &[&str], name: &str) -> u64 {
    let mut k = 0;
    while k < names.len() {
        if same(names[k].as_bytes(), name.as_bytes()) {
            return k as u64 + 1;
        }
        k += 1;
    }
    0
}

const fn same(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut k = 0;
    while k < a.len() {
        if a[k] != b[k] {
            return false;
        }
        k += 1;
    }
    true
}

/// Judges the status that a function gave back.
pub(crate) fn judge(call: &'static str, status: i32) -> Result<(), Halt> {
    match status {
        0 | 1 => Ok(()),
        2 => Err(Halt::Discarded(call)),
        3 => Err(Halt::Failed(format!("`{call}` reports an error"))),
        4 => Err(Halt::Failed(format!("`{call}` reports a fatal error"))),
        5 => Err(Halt::Failed(format!("`{call}` goes on in the background, which is not supported"))),
        other => Err(Halt::Failed(format!("`{call}` gives the status {other}, which is not one of the interface"))),
    }
}

/// The unit has no such function.
pub(crate) fn missing(call: &str) -> Halt {
    Halt::Failed(format!("its library has no function `{call}`"))
}

/// Keeps a message of the unit; those of plain information are none.
pub(crate) fn keep(status: i32, text: &str) {
    let text = text.trim();
    if status == 0 || text.is_empty() {
        return;
    }
    if let Ok(mut messages) = MESSAGES.lock() {
        let own = std::thread::current().id();
        let end = text.char_indices().nth(LONGEST_MESSAGE).map_or(text.len(), |(end, _)| end);
        let text = &text[..end];
        // Units repeat themselves.
        if messages.iter().any(|(thread, known)| *thread == own && known == text) {
            return;
        }
        if messages.iter().filter(|(thread, _)| *thread == own).count() == MOST_MESSAGES {
            // The last one is the reason where a call fails.
            let first = messages.iter().position(|(thread, _)| *thread == own);
            first.map(|first| messages.remove(first));
            DROPPED.fetch_add(1, Ordering::Relaxed);
        }
        messages.push((own, text.to_string()));
        WAITING.store(true, Ordering::Release);
    }
}

/// True if there may be messages for a question.
pub(crate) fn has_messages() -> bool {
    WAITING.load(Ordering::Acquire)
}

/// The messages since the last question: in the process of a unit all of them, else those of this thread.
pub(crate) fn messages() -> Vec<String> {
    let own = AREA.get().is_none().then(|| std::thread::current().id());
    let Ok(mut messages) = MESSAGES.lock() else { return Vec::new() };
    let asked = messages.extract_if(.., |(thread, _)| own.is_none_or(|own| *thread == own));
    let mut texts: Vec<String> = asked.map(|(_, text)| text).collect();
    if !texts.is_empty()
        && let more @ 1.. = DROPPED.swap(0, Ordering::Relaxed)
    {
        texts.push(format!("{more} more messages"));
    }
    WAITING.store(!messages.is_empty(), Ordering::Release);
    texts
}

/// A text that C gives; empty where there is none.
///
/// # Safety
/// The pointer is null or that of a text that ends with zero.
#[allow(unsafe_code)]
pub(crate) unsafe fn text_of(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: the caller says so.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// A text for C; what stands behind a zero in it is left out.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.split('\0').next().unwrap_or_default()).unwrap_or_default()
}

/// Makes the table of functions of a library, with their numbers and names.
macro_rules! functions {
    ($($field:ident = $name:literal: fn($($argument:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        /// Names of the functions; they are announced by their positions.
        pub(crate) const NAMES: &[&str] = &[$($name),*];

        #[allow(non_upper_case_globals)]
        mod number {
            $(pub(super) const $field: u64 = $crate::foreign::position(super::NAMES, $name);)*
        }

        struct Functions {
            $($field: Option<unsafe extern "C" fn($($argument),*) $(-> $result)?>),*
        }

        impl Functions {
            /// # Safety
            /// The functions of the library have the types that the standard gives to their names.
            unsafe fn of(library: &libloading::Library) -> Self {
                // SAFETY: the caller says so.
                unsafe {
                    Self { $($field: library.get(concat!($name, "\0").as_bytes()).ok().map(|symbol| *symbol)),* }
                }
            }
        }
    };
}

/// Calls a function of the table and announces it.
macro_rules! call {
    ($own:ident.$field:ident($($argument:expr),* $(,)?)) => {{
        let function = $own.functions.$field;
        let name = NAMES[number::$field as usize - 1];
        let function = function.ok_or_else(|| $crate::foreign::missing(name))?;
        $crate::foreign::announce(number::$field);
        // SAFETY: lengths are those of the slices handed over, and the instance is one of this library.
        let result = unsafe { function($($argument),*) };
        $crate::foreign::announce(0);
        (name, result)
    }};
}

/// The same for a function that gives a status, which is judged.
macro_rules! checked {
    ($own:ident.$field:ident($($argument:expr),* $(,)?)) => {{
        let (name, status) = call!($own.$field($($argument),*));
        $crate::foreign::judge(name, status)?;
    }};
}

/// The methods of [`Foreign`] whose functions have the same arguments in both versions.
macro_rules! continuous_calls {
    () => {
        fn enter_continuous(&mut self) -> Result<(), Halt> {
            checked!(self.enter_continuous(self.instance));
            Ok(())
        }

        fn set_time(&mut self, t: f64) -> Result<(), Halt> {
            checked!(self.set_time(self.instance, t));
            Ok(())
        }

        fn set_states(&mut self, states: &[f64]) -> Result<(), Halt> {
            checked!(self.set_states(self.instance, states.as_ptr(), states.len()));
            Ok(())
        }

        fn states(&mut self, out: &mut [f64]) -> Result<(), Halt> {
            checked!(self.states(self.instance, out.as_mut_ptr(), out.len()));
            Ok(())
        }

        fn nominals(&mut self, out: &mut [f64]) -> Result<(), Halt> {
            checked!(self.nominals(self.instance, out.as_mut_ptr(), out.len()));
            Ok(())
        }

        fn rates(&mut self, out: &mut [f64]) -> Result<(), Halt> {
            checked!(self.rates(self.instance, out.as_mut_ptr(), out.len()));
            Ok(())
        }

        fn indicators(&mut self, out: &mut [f64]) -> Result<(), Halt> {
            checked!(self.indicators(self.instance, out.as_mut_ptr(), out.len()));
            Ok(())
        }
    };
}

pub(crate) use {call, checked, continuous_calls, functions};
