//! What both faces share at the border to C: handles, slices, texts, messages, and no panic beyond.
//!
//! A handle is a leaked box of a [`Component`]; the importer promises to use a handle only between instantiation and freeing, and by one thread at a
//! time (FMI 3.0.2, section 2.2.1).  Everything else that comes from outside is checked before it is used: null pointers where there should be
//! values, texts that are not UTF-8.  A panic is caught at the entry and told as an error; the instance then refuses further work, as it does
//! after every error that left the model without a solution.

#![allow(unsafe_code)]

use std::collections::HashSet;
use std::ffi::{CStr, CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::core::{Core, Kind, Manners};
use crate::exchange::Updated;
use crate::fault::{Fault, Status};
use crate::load::{inputs, load, texts};

/// Status of C.
pub(crate) type StatusCode = i32;
/// Status `warning`.
const WARNING: StatusCode = 1;

/// How the importer hears of messages.
#[derive(Clone, Copy)]
pub(crate) enum Logger {
    Two(Option<unsafe extern "C" fn(*mut c_void, *const c_char, StatusCode, *const c_char, *const c_char, ...)>),
    Three(Option<unsafe extern "C" fn(*mut c_void, StatusCode, *const c_char, *const c_char)>),
}

/// Where messages go.
pub(crate) struct Log {
    pub(crate) logger: Logger,
    pub(crate) environment: *mut c_void,
    pub(crate) name: CString,
    pub(crate) on: bool,
    /// Categories that are wanted; all if none is named.
    pub(crate) categories: HashSet<String>,
}

/// Categories of messages, as the description lists them.
pub(crate) const CATEGORIES: [&str; 3] = ["logStatusWarning", "logStatusError", "logEvents"];

impl Log {
    /// Passes on a message of a category; errors are passed on whether logging is on or not.
    pub(crate) fn tell(&self, status: StatusCode, category: &str, message: &str) {
        let wanted = self.on && (self.categories.is_empty() || self.categories.contains(category));
        if !wanted && status < Status::Error as StatusCode {
            return;
        }
        let (category, message) = (text(category), text(message));
        match self.logger {
            Logger::Two(Some(call)) => {
                // The message is a format of `printf`.
                let message = text(&message.to_string_lossy().replace('%', "%%"));
                // SAFETY: the importer gave this function for this environment; texts end with zero and live during the call.
                unsafe { call(self.environment, self.name.as_ptr(), status, category.as_ptr(), message.as_ptr()) };
            }
            Logger::Three(Some(call)) => {
                // SAFETY: as above.
                unsafe { call(self.environment, status, category.as_ptr(), message.as_ptr()) };
            }
            Logger::Two(None) | Logger::Three(None) => {}
        }
    }
}

/// A text for C, without zeros inside.
fn text(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// An instance.
pub(crate) struct Component {
    pub(crate) core: Core,
    pub(crate) log: Log,
    /// It refuses further work.
    pub(crate) broken: bool,
    /// Communication points (s) of version 2.0: the last one reached, and whether the model has ended the run.
    pub(crate) last: f64,
    /// Whom to tell of internal steps.
    pub(crate) update: Option<IntermediateUpdate>,
}

/// Callback of version 3.0 after an internal step.
pub(crate) type IntermediateUpdate =
    unsafe extern "C" fn(*mut c_void, f64, bool, bool, bool, bool, *mut bool, *mut f64);

/// Lets the importer look at the end of an internal step at `time` (s); true if he wants the whole step to end here, where it may.  No borrow of
/// the instance lives meanwhile, because he may call back.
pub(crate) fn tell_step(update: IntermediateUpdate, environment: *mut c_void, time: f64, may_return: bool) -> bool {
    let (mut wanted, mut wanted_time) = (false, time);
    // SAFETY: the importer gave this function for this environment; both places live during the call.
    unsafe { update(environment, time, false, true, true, may_return, &mut wanted, &mut wanted_time) };
    wanted && may_return
}

/// A saved state.
pub(crate) struct Saved(pub(crate) Core);

/// What an instance is made from.
pub(crate) struct Wish<'a> {
    pub(crate) kind: Kind,
    pub(crate) manners: Manners,
    pub(crate) token: &'a str,
    pub(crate) resources: Result<std::path::PathBuf, String>,
}

/// Makes an instance; null, with a message, if that is not possible.
pub(crate) fn instantiate(log: Log, wish: Wish<'_>, update: Option<IntermediateUpdate>) -> *mut c_void {
    let made = catch_unwind(AssertUnwindSafe(|| {
        let folder = wish.resources?;
        let (loaded, payload) = load(&folder, wish.token)?;
        let inputs = inputs(&folder, loaded.model.structure.inputs.len())?;
        Core::new((loaded, payload), (wish.kind, wish.manners), inputs, texts(&folder)?)
    }));
    match made {
        Ok(Ok(core)) => {
            let last = core.at;
            Box::into_raw(Box::new(Component { core, log, broken: false, last, update })).cast()
        }
        Ok(Err(reason)) => {
            log.tell(Status::Error as StatusCode, CATEGORIES[1], &reason);
            std::ptr::null_mut()
        }
        Err(_) => {
            log.tell(Status::Error as StatusCode, CATEGORIES[1], "an internal error of the unit");
            std::ptr::null_mut()
        }
    }
}

/// Frees an instance.
pub(crate) fn free(handle: *mut c_void) {
    if !handle.is_null() {
        // SAFETY: the handle came from `instantiate` and is given back once; nobody uses it any more.
        let component = unsafe { Box::from_raw(handle.cast::<Component>()) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(component)));
    }
}

/// Does a call on an instance; what it ends in becomes a status and a message.
pub(crate) fn enter(handle: *mut c_void, work: impl FnOnce(&mut Component) -> Result<(), Fault>) -> StatusCode {
    if handle.is_null() {
        return Status::Error as StatusCode;
    }
    // SAFETY: the handle came from `instantiate` and has not been freed; no other call on it is running, and this borrow ends with
    // this function, before any callback that may call back.
    let component = unsafe { &mut *handle.cast::<Component>() };
    if component.broken {
        component.log.tell(
            Status::Error as StatusCode,
            CATEGORIES[1],
            "the instance refuses further work after an error; reset or free it",
        );
        return Status::Error as StatusCode;
    }
    finish(component, work)
}

/// The same also for an instance that refuses work, for calls that reset it.
pub(crate) fn enter_again(handle: *mut c_void, work: impl FnOnce(&mut Component) -> Result<(), Fault>) -> StatusCode {
    enter_broken(handle, true, work)
}

/// The same also for an instance that refuses work, which it goes on to do, for calls that look at states that were kept.
pub(crate) fn enter_beside(handle: *mut c_void, work: impl FnOnce(&mut Component) -> Result<(), Fault>) -> StatusCode {
    enter_broken(handle, false, work)
}

fn enter_broken(
    handle: *mut c_void,
    mends: bool,
    work: impl FnOnce(&mut Component) -> Result<(), Fault>,
) -> StatusCode {
    if handle.is_null() {
        return Status::Error as StatusCode;
    }
    // SAFETY: as in `enter`.
    let component = unsafe { &mut *handle.cast::<Component>() };
    let broken = std::mem::take(&mut component.broken);
    let status = finish(component, work);
    component.broken |= broken && !(mends && status == Status::Ok as StatusCode);
    status
}

fn finish(component: &mut Component, work: impl FnOnce(&mut Component) -> Result<(), Fault>) -> StatusCode {
    let result = catch_unwind(AssertUnwindSafe(|| work(component)));
    if component.core.has_reports() {
        for report in component.core.take_reports() {
            let place = match report.file.is_empty() {
                true => report.message,
                false => format!("{}:{}: {}", report.file, report.line, report.message),
            };
            component.log.tell(WARNING, CATEGORIES[0], &place);
        }
    }
    match result {
        Ok(Ok(())) => Status::Ok as StatusCode,
        Ok(Err(fault)) => {
            component.broken = !fault.harmless;
            component.log.tell(fault.status as StatusCode, CATEGORIES[1], &fault.message);
            fault.status as StatusCode
        }
        Err(_) => {
            component.broken = true;
            component.log.tell(Status::Error as StatusCode, CATEGORIES[1], "an internal error of the unit");
            Status::Error as StatusCode
        }
    }
}

/// Values that are read.
///
/// # Errors
/// A null pointer where there should be values.
pub(crate) fn slice<'a, T>(pointer: *const T, count: usize) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    match pointer.is_null() {
        true => Err(Fault::usage("a pointer to values is null")),
        // SAFETY: the importer promises `count` values there that nobody writes during the call.
        false => Ok(unsafe { std::slice::from_raw_parts(pointer, count) }),
    }
}

/// Values that are written.
///
/// # Errors
/// A null pointer where there should be values.
pub(crate) fn slice_mut<'a, T>(pointer: *mut T, count: usize) -> Result<&'a mut [T], Fault> {
    if count == 0 {
        return Ok(&mut []);
    }
    match pointer.is_null() {
        true => Err(Fault::usage("a pointer to values is null")),
        // SAFETY: the importer promises room for `count` values there that nobody else uses during the call.
        false => Ok(unsafe { std::slice::from_raw_parts_mut(pointer, count) }),
    }
}

/// One value that is written; nothing happens where nobody wants it.
pub(crate) fn give<T>(pointer: *mut T, value: T) {
    if !pointer.is_null() {
        // SAFETY: the importer promises room for a value there.
        unsafe { pointer.write(value) };
    }
}

/// A structure that the importer keeps as long as the instance lives; none for null.
pub(crate) fn structure<'a, T>(pointer: *const T) -> Option<&'a T> {
    // SAFETY: where it is not null the importer promises such a structure.
    unsafe { pointer.as_ref() }
}

/// A text from outside; null is empty.
pub(crate) fn read_text<'a>(pointer: *const c_char) -> std::borrow::Cow<'a, str> {
    if pointer.is_null() {
        return "".into();
    }
    // SAFETY: the importer promises a text that ends with zero and lives during the call.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy()
}

/// Strings by number.
///
/// # Errors
/// A number that is not that of a String.
pub(crate) fn get_texts(component: &Component, references: &[u32], out: &mut [*const c_char]) -> Result<(), Fault> {
    for (place, &reference) in out.iter_mut().zip(references) {
        *place = component.core.text(reference)?.as_ptr();
    }
    Ok(())
}

/// Strings cannot be set.
///
/// # Errors
/// Why, where there is one to be set.
pub(crate) fn set_texts(component: &Component, references: &[u32]) -> Result<(), Fault> {
    references.iter().try_for_each(|&reference| component.core.set_text(reference))
}

/// The state behind a pointer to a saved state.
///
/// # Errors
/// It is null.
pub(crate) fn saved<'a>(state: *mut c_void) -> Result<&'a Saved, Fault> {
    match state.is_null() {
        true => Err(Fault::usage("there is no saved state")),
        // SAFETY: the importer promises a state that this library has given and that has not been freed.
        false => Ok(unsafe { &*state.cast::<Saved>() }),
    }
}

/// Keeps a state for the importer: in the place that `target` points to, which may already hold one of this instance.
///
/// # Errors
/// `target` is null.
pub(crate) fn keep(target: *mut *mut c_void, core: Core) -> Result<(), Fault> {
    let [place] = slice_mut(target, 1)? else { return Err(Fault::usage("a pointer to a state is null")) };
    if place.is_null() {
        *place = Box::into_raw(Box::new(Saved(core))).cast();
    } else {
        // SAFETY: what is not null there came from this library (FMI 3.0.2, section 2.2.6.4).
        unsafe { *(*place).cast::<Saved>() = Saved(core) };
    }
    Ok(())
}

/// Frees the state in the place that `target` points to.
///
/// # Errors
/// `target` is null.
pub(crate) fn release(target: *mut *mut c_void) -> Result<(), Fault> {
    let [place] = slice_mut(target, 1)? else { return Err(Fault::usage("a pointer to a state is null")) };
    let state = std::mem::replace(place, std::ptr::null_mut());
    if !state.is_null() {
        // SAFETY: the state came from `keep` and is given back once.
        drop(unsafe { Box::from_raw(state.cast::<Saved>()) });
    }
    Ok(())
}

/// Tells of an event that has been settled.
pub(crate) fn tell_event(component: &Component, updated: &Updated) {
    let t = component.core.time();
    let states = if updated.values_changed { ", states have new values" } else { "" };
    let next = updated.next_event.map_or_else(String::new, |next| format!(", the next one is known to be at {next} s"));
    component.log.tell(Status::Ok as StatusCode, CATEGORIES[2], &format!("event at {t} s{states}{next}"));
}

/// Turns logging on or off for some categories, all if none is named.
///
/// # Errors
/// A category that is not in the description.
pub(crate) fn set_logging(
    component: &mut Component,
    on: bool,
    count: usize,
    categories: *const *const c_char,
) -> Result<(), Fault> {
    let names: HashSet<String> = slice(categories, count)?.iter().map(|&name| read_text(name).into_owned()).collect();
    let unknown = names.iter().find(|name| !CATEGORIES.contains(&name.as_str()) && *name != "logAll");
    if let Some(name) = unknown {
        return Err(Fault::usage(format!("there is no category `{name}` of messages")));
    }
    component.log.on = on;
    component.log.categories = if names.contains("logAll") { HashSet::new() } else { names };
    Ok(())
}
