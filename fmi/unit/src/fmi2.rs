//! The C functions of FMI 2.0 (source: FMI 2.0.4, sections 2 to 4; the names and types are those of its headers).
//!
//! Memory functions of the importer are not used, which the description says.  A co-simulation of version 2.0 knows no event mode: events happen
//! within its steps.

// `no_mangle` alone: what is unsafe stands in `boundary`.
#![allow(unsafe_code)]
// Names and meaning are those of the interface.
#![allow(non_snake_case, missing_docs)]

use std::collections::HashSet;
use std::ffi::{CString, c_char, c_void};

use crate::boundary::{
    Component, Log, Logger, StatusCode, Wish, enter, enter_again, enter_beside, free, get_texts, give, instantiate,
    keep, read_text, release, saved, set_logging, set_texts, slice, slice_mut, structure, tell_event,
};
use crate::core::{Kind, Manners, Mode, Setup};
use crate::fault::{Fault, Status};
use crate::load::folder;
use crate::stepping::Progress;
use crate::values::Wanted;

type Handle = *mut c_void;
type Text = *const c_char;
type Reference = u32;
type Truth = i32;

/// `fmi2CoSimulation`; 0 is model exchange.
const CO_SIMULATION: i32 = 1;
/// `fmi2LastSuccessfulTime` and `fmi2Terminated` among the kinds of a status.
const LAST_SUCCESSFUL_TIME: i32 = 2;
const TERMINATED: i32 = 3;

const VERSION: &std::ffi::CStr = c"2.0";
const PLATFORM: &std::ffi::CStr = c"default";

/// What the importer offers.
#[repr(C)]
pub struct Callbacks {
    logger: Option<unsafe extern "C" fn(*mut c_void, Text, StatusCode, Text, Text, ...)>,
    allocate: *mut c_void,
    free: *mut c_void,
    step_finished: *mut c_void,
    environment: *mut c_void,
}

/// What an update at an event has led to.
#[repr(C)]
pub struct EventInfo {
    new_discrete_states_needed: Truth,
    terminate: Truth,
    nominals_changed: Truth,
    values_changed: Truth,
    next_event_defined: Truth,
    next_event: f64,
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetTypesPlatform() -> Text {
    PLATFORM.as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetVersion() -> Text {
    VERSION.as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetDebugLogging(handle: Handle, on: Truth, count: usize, categories: *const Text) -> StatusCode {
    enter(handle, |component| set_logging(component, on != 0, count, categories))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2Instantiate(
    name: Text,
    kind: i32,
    guid: Text,
    resources: Text,
    functions: *const Callbacks,
    _visible: Truth,
    logging: Truth,
) -> Handle {
    let functions = structure(functions);
    let name = CString::new(read_text(name).as_bytes()).unwrap_or_default();
    let log = Log {
        logger: Logger::Two(functions.and_then(|functions| functions.logger)),
        environment: functions.map_or(std::ptr::null_mut(), |functions| functions.environment),
        name,
        on: logging != 0,
        categories: HashSet::new(),
    };
    let kind = if kind == CO_SIMULATION { Kind::Stepping } else { Kind::Exchange };
    let (token, resources) = (read_text(guid), folder(&read_text(resources)));
    instantiate(log, Wish { kind, manners: Manners::default(), token: &token, resources }, None)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeInstance(handle: Handle) {
    free(handle);
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetupExperiment(
    handle: Handle,
    tolerance_defined: Truth,
    tolerance: f64,
    start: f64,
    stop_defined: Truth,
    stop: f64,
) -> StatusCode {
    enter(handle, |component| {
        let setup = Setup {
            start,
            stop: (stop_defined != 0).then_some(stop),
            tolerance: (tolerance_defined != 0).then_some(tolerance),
        };
        component.core.set_up(setup)
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterInitializationMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.enter_initialization())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2ExitInitializationMode(handle: Handle) -> StatusCode {
    enter(handle, |component| {
        component.core.exit_initialization()?;
        component.last = component.core.at;
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2Terminate(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.terminate())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2Reset(handle: Handle) -> StatusCode {
    enter_again(handle, |component| component.core.reset())
}

fn get<T>(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut T,
    wanted: Wanted,
    convert: impl Fn(f64) -> Option<T>,
) -> StatusCode {
    enter(handle, |component| {
        for (&reference, place) in slice(references, count)?.iter().zip(slice_mut(values, count)?) {
            let value = component.core.value(reference, wanted)?;
            let converted = convert(value);
            *place = converted
                .ok_or_else(|| Fault::usage(format!("{value} of the variable {reference} does not fit its type")))?;
        }
        Ok(())
    })
}

fn set<T: Copy>(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const T,
    wanted: Wanted,
    convert: impl Fn(T) -> f64,
) -> StatusCode {
    enter(handle, |component| {
        for (&reference, &value) in slice(references, count)?.iter().zip(slice(values, count)?) {
            component.core.set(reference, 0, convert(value), wanted)?;
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetReal(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut f64,
) -> StatusCode {
    enter(handle, |component| {
        let (list, out) = (slice(references, count)?, slice_mut(values, count)?);
        if component.core.real_list(list, |_, _| Some(1), out)? {
            return Ok(());
        }
        for (&reference, place) in list.iter().zip(out) {
            *place = component.core.value(reference, Wanted::Real)?;
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetReal(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const f64,
) -> StatusCode {
    set(handle, references, count, values, Wanted::Real, |value| value)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetInteger(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut i32,
) -> StatusCode {
    let whole = |value: f64| (value.abs() <= f64::from(i32::MAX)).then_some(value as i32);
    get(handle, references, count, values, Wanted::Whole, whole)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetInteger(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const i32,
) -> StatusCode {
    set(handle, references, count, values, Wanted::Whole, f64::from)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetBoolean(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut Truth,
) -> StatusCode {
    get(handle, references, count, values, Wanted::Truth, |value| Some(Truth::from(value != 0.0)))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetBoolean(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *const Truth,
) -> StatusCode {
    set(handle, references, count, values, Wanted::Truth, |value| f64::from(u8::from(value != 0)))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetString(
    handle: Handle,
    references: *const Reference,
    count: usize,
    values: *mut Text,
) -> StatusCode {
    enter(handle, |component| get_texts(component, slice(references, count)?, slice_mut(values, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetString(
    handle: Handle,
    references: *const Reference,
    count: usize,
    _values: *const Text,
) -> StatusCode {
    enter(handle, |component| set_texts(component, slice(references, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetFMUstate(handle: Handle, state: *mut *mut c_void) -> StatusCode {
    enter(handle, |component| keep(state, component.core.clone()))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetFMUstate(handle: Handle, state: *mut c_void) -> StatusCode {
    enter_again(handle, |component| {
        component.core.take_state(&saved(state)?.0)?;
        component.last = component.core.at;
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2FreeFMUstate(_handle: Handle, state: *mut *mut c_void) -> StatusCode {
    if state.is_null() || release(state).is_ok() { Status::Ok as StatusCode } else { Status::Error as StatusCode }
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SerializedFMUstateSize(handle: Handle, state: *mut c_void, size: *mut usize) -> StatusCode {
    enter_beside(handle, |_| {
        give(size, saved(state)?.0.serialize()?.len());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SerializeFMUstate(handle: Handle, state: *mut c_void, bytes: *mut u8, size: usize) -> StatusCode {
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
pub extern "C" fn fmi2DeSerializeFMUstate(
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
pub extern "C" fn fmi2GetDirectionalDerivative(
    handle: Handle,
    unknowns: *const Reference,
    unknown_count: usize,
    knowns: *const Reference,
    known_count: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> StatusCode {
    enter(handle, |component| {
        let (unknowns, knowns) = (slice(unknowns, unknown_count)?, slice(knowns, known_count)?);
        let found = component.core.directional(unknowns, knowns, slice(seed, known_count)?)?;
        slice_mut(sensitivity, unknown_count)?.copy_from_slice(&found);
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterEventMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.enter_event_mode())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2NewDiscreteStates(handle: Handle, info: *mut EventInfo) -> StatusCode {
    enter(handle, |component| {
        let updated = component.core.update()?;
        tell_event(component, &updated);
        give(
            info,
            EventInfo {
                // The model settles within one update.
                new_discrete_states_needed: 0,
                terminate: updated.terminate.into(),
                nominals_changed: updated.nominals_changed.into(),
                values_changed: updated.values_changed.into(),
                next_event_defined: updated.next_event.is_some().into(),
                next_event: updated.next_event.unwrap_or(0.0),
            },
        );
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2EnterContinuousTimeMode(handle: Handle) -> StatusCode {
    enter(handle, |component| component.core.run_on())
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2CompletedIntegratorStep(
    handle: Handle,
    _no_set_state: Truth,
    enter_event_mode: *mut Truth,
    terminate: *mut Truth,
) -> StatusCode {
    enter(handle, |component| {
        let event = component.core.complete_step()?;
        give(enter_event_mode, event.into());
        give(terminate, component.core.ended.is_some().into());
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetTime(handle: Handle, time: f64) -> StatusCode {
    enter(handle, |component| component.core.set_time(time))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetContinuousStates(handle: Handle, states: *const f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.set_states(slice(states, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetDerivatives(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.derivatives(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetEventIndicators(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.indicators(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetContinuousStates(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.states(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetNominalsOfContinuousStates(handle: Handle, out: *mut f64, count: usize) -> StatusCode {
    enter(handle, |component| component.core.nominals(slice_mut(out, count)?))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2SetRealInputDerivatives(
    handle: Handle,
    references: *const Reference,
    count: usize,
    orders: *const i32,
    values: *const f64,
) -> StatusCode {
    enter(handle, |component| {
        let lists = (slice(references, count)?, slice(orders, count)?, slice(values, count)?);
        for ((&reference, &order), &slope) in lists.0.iter().zip(lists.1).zip(lists.2) {
            if order != 1 {
                return Err(Fault::usage(format!(
                    "inputs are straight lines: there is no derivative of order {order}"
                )));
            }
            component.core.set_slope(reference, slope)?;
        }
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetRealOutputDerivatives(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _orders: *const i32,
    _values: *mut f64,
) -> StatusCode {
    enter(handle, |_| match count {
        0 => Ok(()),
        _ => Err(Fault::usage("the unit does not offer derivatives of outputs")),
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2DoStep(handle: Handle, from: f64, length: f64, _no_set_state: Truth) -> StatusCode {
    enter(handle, |component| {
        let to = component.core.begin_step(from, length)?;
        loop {
            let progress = component.core.advance(to);
            component.last = component.core.at;
            match progress? {
                Progress::Done => {
                    component.last = to;
                    return Ok(());
                }
                Progress::Further(_) | Progress::Event(_) => {}
                Progress::Ended(t) => {
                    let message = component.core.ended.clone().unwrap_or_default();
                    let message = format!("the model has ended the run at {t} s: {message}");
                    return Err(Fault { status: Status::Discard, message, harmless: true });
                }
            }
        }
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2CancelStep(handle: Handle) -> StatusCode {
    enter(handle, |_| Err(Fault::usage("no step is running: steps are done when their call returns")))
}

fn status<T>(handle: Handle, kind: i32, place: *mut T, of: impl FnOnce(&Component, i32) -> Option<T>) -> StatusCode {
    enter(handle, |component| match of(component, kind) {
        Some(value) => {
            give(place, value);
            Ok(())
        }
        None => Err(Fault {
            status: Status::Discard,
            message: format!("there is no status of the kind {kind}"),
            harmless: true,
        }),
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStatus(handle: Handle, kind: i32, place: *mut StatusCode) -> StatusCode {
    status(handle, kind, place, |_, _| None)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetRealStatus(handle: Handle, kind: i32, place: *mut f64) -> StatusCode {
    status(handle, kind, place, |component, kind| (kind == LAST_SUCCESSFUL_TIME).then_some(component.last))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetIntegerStatus(handle: Handle, kind: i32, place: *mut i32) -> StatusCode {
    status(handle, kind, place, |_, _| None)
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetBooleanStatus(handle: Handle, kind: i32, place: *mut Truth) -> StatusCode {
    let ended = |component: &Component| component.core.ended.is_some() || component.core.mode == Mode::Terminated;
    status(handle, kind, place, |component, kind| (kind == TERMINATED).then(|| ended(component).into()))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi2GetStringStatus(handle: Handle, kind: i32, place: *mut Text) -> StatusCode {
    status(handle, kind, place, |_, _| None)
}
