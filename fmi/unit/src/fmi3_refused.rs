//! The C functions of FMI 3.0 for what no unit offers: they must be there, and say so.
//!
//! Types that no variable of a unit has (for no variables at all they succeed, as the interface wants), clocks, scheduled execution, adjoint
//! derivatives, derivatives of outputs, structural parameters.

// `no_mangle` alone: what is unsafe stands in `boundary`.
#![allow(unsafe_code)]
// Names and meaning are those of the interface.
#![allow(non_snake_case, missing_docs)]

use std::ffi::c_void;

use crate::boundary::{StatusCode, enter};
use crate::fault::{Fault, Status};
use crate::fmi3::{Handle, LogMessage, Reference, Text, log};

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3InstantiateScheduledExecution(
    name: Text,
    _token: Text,
    _resources: Text,
    _visible: bool,
    logging: bool,
    environment: *mut c_void,
    logger: Option<LogMessage>,
    _clock: *mut c_void,
    _lock: *mut c_void,
    _unlock: *mut c_void,
) -> Handle {
    let log = log(name, logging, environment, logger);
    log.tell(Status::Error as StatusCode, "logStatusError", "the unit has no scheduled execution");
    std::ptr::null_mut()
}

/// Functions for types that no variable of a unit has: they succeed for nothing and refuse everything else.
macro_rules! no_variables {
    ($($get:ident, $set:ident, $type:ty;)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $get(
            handle: Handle,
            _references: *const Reference,
            count: usize,
            _values: *mut $type,
            _room: usize,
        ) -> StatusCode {
            none_of_them(handle, count, stringify!($get))
        }

        #[unsafe(no_mangle)]
        pub extern "C" fn $set(
            handle: Handle,
            _references: *const Reference,
            count: usize,
            _values: *const $type,
            _given: usize,
        ) -> StatusCode {
            none_of_them(handle, count, stringify!($set))
        }
    )*};
}

no_variables! {
    fmi3GetFloat32, fmi3SetFloat32, f32;
    fmi3GetInt8, fmi3SetInt8, i8;
    fmi3GetUInt8, fmi3SetUInt8, u8;
    fmi3GetInt16, fmi3SetInt16, i16;
    fmi3GetUInt16, fmi3SetUInt16, u16;
    fmi3GetInt32, fmi3SetInt32, i32;
    fmi3GetUInt32, fmi3SetUInt32, u32;
    fmi3GetUInt64, fmi3SetUInt64, u64;
}

fn none_of_them(handle: Handle, count: usize, name: &str) -> StatusCode {
    enter(handle, |_| match count {
        0 => Ok(()),
        _ => Err(Fault::usage(format!("{name}: the unit has no variables of this type"))),
    })
}

fn refuse(handle: Handle, what: &str) -> StatusCode {
    enter(handle, |_| Err(Fault::usage(format!("the unit does not offer {what}"))))
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetBinary(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _sizes: *mut usize,
    _values: *mut *const u8,
    _room: usize,
) -> StatusCode {
    none_of_them(handle, count, "fmi3GetBinary")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetBinary(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _sizes: *const usize,
    _values: *const *const u8,
    _given: usize,
) -> StatusCode {
    none_of_them(handle, count, "fmi3SetBinary")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetClock(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _values: *mut bool,
) -> StatusCode {
    none_of_them(handle, count, "fmi3GetClock")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetClock(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _values: *const u8,
) -> StatusCode {
    none_of_them(handle, count, "fmi3SetClock")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetNumberOfVariableDependencies(
    handle: Handle,
    _reference: Reference,
    _count: *mut usize,
) -> StatusCode {
    refuse(handle, "dependencies of elements")
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3GetVariableDependencies(
    handle: Handle,
    _dependent: Reference,
    _elements: *mut usize,
    _independents: *mut Reference,
    _of_independents: *mut usize,
    _kinds: *mut i32,
    _count: usize,
) -> StatusCode {
    refuse(handle, "dependencies of elements")
}

#[unsafe(no_mangle)]
#[allow(clippy::too_many_arguments)] // As the interface has it.
pub extern "C" fn fmi3GetAdjointDerivative(
    handle: Handle,
    _unknowns: *const Reference,
    _unknown_count: usize,
    _knowns: *const Reference,
    _known_count: usize,
    _seed: *const f64,
    _seed_count: usize,
    _sensitivity: *mut f64,
    _sensitivity_count: usize,
) -> StatusCode {
    refuse(handle, "adjoint derivatives")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EnterConfigurationMode(handle: Handle) -> StatusCode {
    refuse(handle, "structural parameters: what decides sizes was fixed when the unit was made")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3ExitConfigurationMode(handle: Handle) -> StatusCode {
    refuse(handle, "structural parameters: what decides sizes was fixed when the unit was made")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetIntervalDecimal(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _intervals: *mut f64,
    _qualifiers: *mut i32,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetIntervalFraction(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _counters: *mut u64,
    _resolutions: *mut u64,
    _qualifiers: *mut i32,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetShiftDecimal(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _shifts: *mut f64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetShiftFraction(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _counters: *mut u64,
    _resolutions: *mut u64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetIntervalDecimal(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _intervals: *const f64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetIntervalFraction(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _counters: *const u64,
    _resolutions: *const u64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetShiftDecimal(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _shifts: *const f64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3SetShiftFraction(
    handle: Handle,
    _references: *const Reference,
    _count: usize,
    _counters: *const u64,
    _resolutions: *const u64,
) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3ActivateModelPartition(handle: Handle, _clock: Reference, _time: f64) -> StatusCode {
    refuse(handle, "clocks")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3EvaluateDiscreteStates(handle: Handle) -> StatusCode {
    refuse(handle, "an evaluation of discrete states without an update")
}

#[unsafe(no_mangle)]
pub extern "C" fn fmi3GetOutputDerivatives(
    handle: Handle,
    _references: *const Reference,
    count: usize,
    _orders: *const i32,
    _values: *mut f64,
    _room: usize,
) -> StatusCode {
    none_of_them(handle, count, "fmi3GetOutputDerivatives")
}
