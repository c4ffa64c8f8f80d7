//! The C functions of FMI 3.0 (source: FMI 3.0.2, sections 2 to 4; the names and types are those of its headers).
//!
//! What the description does not offer stands in `fmi3_refused`.

// `no_mangle` alone: what is unsafe stands in `boundary`.
#![allow(unsafe_code)]
// Names and meaning are those of the interface.
#![allow(non_snake_case, missing_docs)]

use std::collections::HashSet;
use std::ffi::{CString, c_char, c_void};
use std::path::PathBuf;

use crate::boundary::{
    Component, IntermediateUpdate, Log, Logger, StatusCode, Wish, enter, enter_again, enter_beside, free, get_texts,
    give, instantiate, keep, read_text, release, saved, set_logging, set_texts, slice, slice_mut, tell_event,
    tell_step,
};
use crate::core::{Kind, Known, Manners, Setup};
use crate::fault::{Fault, Status};
use crate::stepping::Progress;
use crate::values::Wanted;

pub(crate) type Handle = *mut c_void;

pub(crate) type Text = *const c_char;

pub(crate) type Reference = u32;

pub(crate) type LogMessage = unsafe extern "C" fn(*mut c_void, StatusCode, Text, Text);

const VERSION: &std::ffi::CStr = c"3.0";

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetVersion() -> Text {
    VERSION.as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetDebugLogging(handle: Handle, on: bool, count: usize, categories: *const Text) -> StatusCode {
    enter(handle, |component| set_logging(component, on, count, categories))
}

pub(crate) fn log(name: Text, on: bool, environment: *mut c_void, logger: Option<LogMessage>) -> Log {
    let name = CString::new(read_text(name).as_bytes()).unwrap_or_default();
    Log { logger: Logger::Three(logger), environment, name, on, categories: HashSet::new() }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3InstantiateModelExchange(
    name: Text,
    token: Text,
    resources: Text,
    _visible: bool,
    logging: bool,
    environment: *mut c_void,
    logger: Option<LogMessage>,
) -> Handle {
    let log = log(name, logging, environment, logger);
    let (token, resources) = (read_text(token), Ok(PathBuf::from(&*read_text(resources))));
    instantiate(log, Wish { kind: Kind::Exchange, manners: Manners::default(), token: &token, resources }, None)
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3InstantiateCoSimulation(
    name: Text,
    token: Text,
    resources: Text,
    _visible: bool,
    logging: bool,
    event_mode: bool,
    early_return: bool,
    _intermediate: *const Reference,
    _count: usize,
    environment: *mut c_void,
    logger: Option<LogMessage>,
    update: Option<IntermediateUpdate>,
) -> Handle {
    let log = log(name, logging, environment, logger);
    let (token, resources) = (read_text(token), Ok(PathBuf::from(&*read_text(resources))));
    let manners = Manners { event_mode, early_return };
    instantiate(log, Wish { kind: Kind::Stepping, manners, token: &token, resources }, update)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3FreeInstance(handle: Handle) {
    free(handle);
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterInitializationMode(
    handle: Handle,
    tolerance_defined: bool,
    tolerance: f64,
    start: f64,
    stop_defined: bool,
    stop: f64,
) -> StatusCode {
    enter(handle, |component| {
        let setup =
            Setup { start, stop: stop_defined.then_some(stop), tolerance: tolerance_defined.then_some(tolerance) };
        component.core.set_up(setup)?;
        component.core.enter_initialization()
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3ExitInitializationMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.exit_initialization())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterEventMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.enter_event_mode())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Terminate(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.terminate())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3Reset(handle: Handle) -> StatusCode {
    enter_again(handle, |component| component.core.reset())
}

/// Reads values of a type; an array gives all its elements.
fn get<T>(
    handle: Handle,
    (references, count): (*const Reference, usize),
    (values, room): (*mut T, usize),
    wanted: Wanted,
    convert: impl Fn(f64) -> Option<T>,
) -> StatusCode {
    enter(handle, |component| get_each(component, slice(references, count)?, slice_mut(values, room)?, wanted, convert))
}

fn get_each<T>(
    component: &mut Component,
    references: &[Reference],
    values: &mut [T],
    wanted: Wanted,
    convert: impl Fn(f64) -> Option<T>,
) -> Result<(), Fault> {
    let sizes = sizes(component, references, values.len())?;
    let mut next = values.iter_mut();
    for (&reference, size) in references.iter().zip(sizes) {
        for value in component.core.values(reference, size, wanted)? {
            let converted = convert(value);
            let converted = converted
                .ok_or_else(|| Fault::usage(format!("{value} of the variable {reference} does not fit its type")))?;
            // There are as many as `sizes` has counted.
            if let Some(place) = next.next() {
                *place = converted;
            }
        }
    }
    Ok(())
}

/// How many values each reference stands for; their sum must be `room`.
fn sizes(component: &Component, references: &[Reference], room: usize) -> Result<Vec<usize>, Fault> {
    let size = |&reference: &Reference| {
        let size = component.core.known.size(reference);
        size.ok_or_else(|| Fault::usage(format!("there is no variable with the value reference {reference}")))
    };
    let sizes: Vec<usize> = references.iter().map(size).collect::<Result<_, _>>()?;
    let all: usize = sizes.iter().sum();
    match all == room {
        true => Ok(sizes),
        false => Err(Fault::usage(format!("the variables have {all} values, not {room}"))),
    }
}

fn set<T: Copy>(
    handle: Handle,
    (references, count): (*const Reference, usize),
    (values, given): (*const T, usize),
    wanted: Wanted,
    convert: impl Fn(T) -> f64,
) -> StatusCode {
    enter(handle, |component| {
        let (references, values) = (slice(references, count)?, slice(values, given)?);
        let sizes = sizes(component, references, given)?;
        let mut next = values.iter();
        for (&reference, size) in references.iter().zip(sizes) {
            for (offset, &value) in next.by_ref().take(size).enumerate() {
                component.core.set(reference, offset, convert(value), wanted)?;
            }
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetFloat64(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut f64,
    room: usize,
) -> StatusCode {
    enter(handle, |component| {
        let (list, out) = (slice(references, count)?, slice_mut(values, room)?);
        match component.core.real_list(list, Known::size, out)? {
            true => Ok(()),
            false => get_each(component, list, out, Wanted::Real, Some),
        }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetFloat64(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const f64,
    given: usize,
) -> StatusCode {
    set(handle, (references, count), (values, given), Wanted::Real, |value| value)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetInt64(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut i64,
    room: usize,
) -> StatusCode {
    get(handle, (references, count), (values, room), Wanted::Whole, |value| Some(value as i64))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetInt64(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const i64,
    given: usize,
) -> StatusCode {
    set(handle, (references, count), (values, given), Wanted::Whole, |value| value as f64)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetString(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut Text,
    room: usize,
) -> StatusCode {
    enter(handle, |component| {
        let (list, out) = (slice(references, count)?, slice_mut(values, room)?);
        sizes(component, list, room)?;
        get_texts(component, list, out)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetString(
    handle: Handle,
    references: *const Reference,
    count: usize,
    _values: *const Text,
    _given: usize,
) -> StatusCode {
    enter(handle, |component| set_texts(component, slice(references, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetBoolean(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut bool,
    room: usize,
) -> StatusCode {
    get(handle, (references, count), (values, room), Wanted::Truth, |value| Some(value != 0.0))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetBoolean(
    handle: Handle,
    references: *const Reference,
    count: usize,
    // A byte that need not be 0 or 1.
    values: *const u8,
    given: usize,
) -> StatusCode {
    set(handle, (references, count), (values, given), Wanted::Truth, |value| f64::from(u8::from(value != 0)))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetFMUState(handle: Handle, state: *mut *mut c_void) -> StatusCode {
    enter(handle, |component| keep(state, component.core.clone()))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetFMUState(handle: Handle, state: *mut c_void) -> StatusCode {
    enter_again(handle, |component| {
        component.core.take_state(&saved(state)?.0)?;
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3FreeFMUState(_handle: Handle, state: *mut *mut c_void) -> StatusCode {
    if state.is_null() || release(state).is_ok() { Status::Ok as StatusCode } else { Status::Error as StatusCode }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SerializedFMUStateSize(handle: Handle, state: *mut c_void, size: *mut usize) -> StatusCode {
    enter_beside(handle, |_| {
        give(size, saved(state)?.0.serialize()?.len());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SerializeFMUState(handle: Handle, state: *mut c_void, bytes: *mut u8, size: usize) -> StatusCode {
    enter_beside(handle, |_| {
        let written = saved(state)?.0.serialize()?;
        if written.len() > size {
            return Err(Fault::usage(format!("the state has {} bytes, and there is room for {size}", written.len())));
        }
        slice_mut(bytes, size)?[..written.len()].copy_from_slice(&written);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3DeserializeFMUState(
    handle: Handle,
    bytes: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> StatusCode {
    enter_beside(handle, |component| {
        let core = component.core.deserialize(slice(bytes, size)?)?;
        keep(state, core)
    })
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3GetDirectionalDerivative(
    handle: Handle,
    unknowns: *const Reference,
    unknown_count: usize,
    knowns: *const Reference,
    known_count: usize,
    seed: *const f64,
    seed_count: usize,
    sensitivity: *mut f64,
    sensitivity_count: usize,
) -> StatusCode {
    enter(handle, |component| {
        let (unknowns, knowns) = (slice(unknowns, unknown_count)?, slice(knowns, known_count)?);
        let unknowns = elements(component, unknowns, sensitivity_count)?;
        let knowns = elements(component, knowns, seed_count)?;
        let found = component.core.directional(&unknowns, &knowns, slice(seed, seed_count)?)?;
        slice_mut(sensitivity, sensitivity_count)?.copy_from_slice(&found);
        Ok(())
    })
}

/// The references of all elements.
fn elements(component: &Component, references: &[Reference], count: usize) -> Result<Vec<Reference>, Fault> {
    let sizes = sizes(component, references, count)?;
    Ok(references.iter().zip(sizes).flat_map(|(&first, size)| first..first + size as u32).collect())
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3UpdateDiscreteStates(
    handle: Handle,
    need_update: *mut bool,
    terminate: *mut bool,
    nominals_changed: *mut bool,
    values_changed: *mut bool,
    next_event_defined: *mut bool,
    next_event: *mut f64,
) -> StatusCode {
    enter(handle, |component| {
        let updated = component.core.update()?;
        tell_event(component, &updated);
        // The model settles within one update.
        give(need_update, false);
        give(terminate, updated.terminate);
        give(nominals_changed, updated.nominals_changed);
        give(values_changed, updated.values_changed);
        give(next_event_defined, updated.next_event.is_some());
        give(next_event, updated.next_event.unwrap_or(0.0));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterContinuousTimeMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.run_on())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterStepMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.run_on())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3CompletedIntegratorStep(
    handle: Handle,
    _no_set_state: bool,
    enter_event_mode: *mut bool,
    terminate: *mut bool,
) -> StatusCode {
    enter(handle, |component| {
        let event = component.core.complete_step()?;
        give(enter_event_mode, event);
        give(terminate, component.core.ended.is_some());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetTime(handle: Handle, time: f64) -> StatusCode {
    enter(handle, |component| component.core.set_time(time))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetContinuousStates(handle: Handle, states: *const f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.set_states(slice(states, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetContinuousStateDerivatives(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.derivatives(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetEventIndicators(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.indicators(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetContinuousStates(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.states(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetNominalsOfContinuousStates(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.nominals(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetNumberOfEventIndicators(handle: Handle, count: *mut usize) -> StatusCode {
    enter(handle, |component| {
        give(count, component.core.structure().roots);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetNumberOfContinuousStates(handle: Handle, count: *mut usize) -> StatusCode {
    enter(handle, |component| {
        give(count, component.core.state_count());
        Ok(())
    })
}

/// How far a step has come, for the importer.
#[derive(Clone, Copy, Default)]
struct Told {
    event: bool,
    terminate: bool,
    early: bool,
    last: f64,
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3DoStep(
    handle: Handle,
    from: f64,
    length: f64,
    _no_set_state: bool,
    event_needed: *mut bool,
    terminate: *mut bool,
    early: *mut bool,
    last: *mut f64,
) -> StatusCode {
    let mut told = Told { last: from, ..Told::default() };
    let status = do_step(handle, from, length, &mut told);
    give(event_needed, told.event);
    give(terminate, told.terminate);
    give(early, told.early);
    give(last, told.last);
    status
}

/// One internal step after the other; between them the importer may look, so nothing of the instance is borrowed then.
fn do_step(handle: Handle, from: f64, length: f64, told: &mut Told) -> StatusCode {
    let (mut to, mut callback, mut may_return) = (from, None, false);
    let status = enter(handle, |component| {
        to = component.core.begin_step(from, length)?;
        callback = component.update.map(|update| (update, component.log.environment));
        may_return = component.core.manners.early_return;
        Ok(())
    });
    if status != Status::Ok as StatusCode {
        return status;
    }
    loop {
        let mut progress = Progress::Done;
        let status = enter(handle, |component| {
            let result = component.core.advance(to);
            told.last = component.core.at;
            progress = result?;
            Ok(())
        });
        if status != Status::Ok as StatusCode {
            return status;
        }
        match progress {
            Progress::Event(t) => {
                // At the end of the step it is only needed, not early.
                (told.event, told.early, told.last) = (true, t < to, t);
                return status;
            }
            Progress::Ended(t) => {
                // Who does not want steps to end early learns of the end all the same.
                (told.terminate, told.early, told.last) = (true, may_return && t < to, t);
                return status;
            }
            Progress::Done | Progress::Further(_) => {}
        }
        if let Some((update, environment)) = callback {
            let wanted = tell_step(update, environment, told.last, may_return);
            if wanted && progress != Progress::Done {
                told.early = true;
                return status;
            }
        }
        if progress == Progress::Done {
            told.last = to;
            return status;
        }
    }
}
