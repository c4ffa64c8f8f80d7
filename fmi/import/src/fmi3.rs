//! A unit of version 3.0, called by the functions of its library.
//!
//! Source: Functional Mock-up Interface 3.0.2, sections 2.2, 3.2 and 4.2.  Co-simulation runs without event mode: the unit handles its
//! events within its steps.

#![allow(unsafe_code)]

use std::ffi::{CStr, c_char, c_int, c_void};

use libloading::Library;

use crate::description::{Number, WARNINGS};
use crate::foreign::{Foreign, Halt, StepEnd, c_text, call, checked, continuous_calls, functions, keep, text_of};
use crate::protocol::{Setup, Update};

type Instance = *mut c_void;
type References = *const u32;
type Logger = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

functions! {
    instantiate_exchange = "fmi3InstantiateModelExchange":
        fn(*const c_char, *const c_char, *const c_char, bool, bool, *mut c_void, Logger) -> Instance;
    instantiate_stepping = "fmi3InstantiateCoSimulation": fn(
        *const c_char, *const c_char, *const c_char, bool, bool, bool, bool, References, usize, *mut c_void, Logger, *const c_void,
    ) -> Instance;
    set_logging = "fmi3SetDebugLogging": fn(Instance, bool, usize, *const *const c_char) -> c_int;
    free_instance = "fmi3FreeInstance": fn(Instance);
    enter_initialization = "fmi3EnterInitializationMode": fn(Instance, bool, f64, f64, bool, f64) -> c_int;
    exit_initialization = "fmi3ExitInitializationMode": fn(Instance) -> c_int;
    terminate = "fmi3Terminate": fn(Instance) -> c_int;
    get_float32 = "fmi3GetFloat32": fn(Instance, References, usize, *mut f32, usize) -> c_int;
    get_float64 = "fmi3GetFloat64": fn(Instance, References, usize, *mut f64, usize) -> c_int;
    get_int8 = "fmi3GetInt8": fn(Instance, References, usize, *mut i8, usize) -> c_int;
    get_uint8 = "fmi3GetUInt8": fn(Instance, References, usize, *mut u8, usize) -> c_int;
    get_int16 = "fmi3GetInt16": fn(Instance, References, usize, *mut i16, usize) -> c_int;
    get_uint16 = "fmi3GetUInt16": fn(Instance, References, usize, *mut u16, usize) -> c_int;
    get_int32 = "fmi3GetInt32": fn(Instance, References, usize, *mut i32, usize) -> c_int;
    get_uint32 = "fmi3GetUInt32": fn(Instance, References, usize, *mut u32, usize) -> c_int;
    get_int64 = "fmi3GetInt64": fn(Instance, References, usize, *mut i64, usize) -> c_int;
    get_uint64 = "fmi3GetUInt64": fn(Instance, References, usize, *mut u64, usize) -> c_int;
    get_boolean = "fmi3GetBoolean": fn(Instance, References, usize, *mut u8, usize) -> c_int;
    set_float32 = "fmi3SetFloat32": fn(Instance, References, usize, *const f32, usize) -> c_int;
    set_float64 = "fmi3SetFloat64": fn(Instance, References, usize, *const f64, usize) -> c_int;
    set_int8 = "fmi3SetInt8": fn(Instance, References, usize, *const i8, usize) -> c_int;
    set_uint8 = "fmi3SetUInt8": fn(Instance, References, usize, *const u8, usize) -> c_int;
    set_int16 = "fmi3SetInt16": fn(Instance, References, usize, *const i16, usize) -> c_int;
    set_uint16 = "fmi3SetUInt16": fn(Instance, References, usize, *const u16, usize) -> c_int;
    set_int32 = "fmi3SetInt32": fn(Instance, References, usize, *const i32, usize) -> c_int;
    set_uint32 = "fmi3SetUInt32": fn(Instance, References, usize, *const u32, usize) -> c_int;
    set_int64 = "fmi3SetInt64": fn(Instance, References, usize, *const i64, usize) -> c_int;
    set_uint64 = "fmi3SetUInt64": fn(Instance, References, usize, *const u64, usize) -> c_int;
    set_boolean = "fmi3SetBoolean": fn(Instance, References, usize, *const u8, usize) -> c_int;
    set_string = "fmi3SetString": fn(Instance, References, usize, *const *const c_char, usize) -> c_int;
    directional = "fmi3GetDirectionalDerivative":
        fn(Instance, References, usize, References, usize, *const f64, usize, *mut f64, usize) -> c_int;
    enter_events = "fmi3EnterEventMode": fn(Instance) -> c_int;
    update = "fmi3UpdateDiscreteStates":
        fn(Instance, *mut bool, *mut bool, *mut bool, *mut bool, *mut bool, *mut f64) -> c_int;
    enter_continuous = "fmi3EnterContinuousTimeMode": fn(Instance) -> c_int;
    completed = "fmi3CompletedIntegratorStep": fn(Instance, bool, *mut bool, *mut bool) -> c_int;
    set_time = "fmi3SetTime": fn(Instance, f64) -> c_int;
    set_states = "fmi3SetContinuousStates": fn(Instance, *const f64, usize) -> c_int;
    rates = "fmi3GetContinuousStateDerivatives": fn(Instance, *mut f64, usize) -> c_int;
    indicators = "fmi3GetEventIndicators": fn(Instance, *mut f64, usize) -> c_int;
    states = "fmi3GetContinuousStates": fn(Instance, *mut f64, usize) -> c_int;
    nominals = "fmi3GetNominalsOfContinuousStates": fn(Instance, *mut f64, usize) -> c_int;
    step = "fmi3DoStep": fn(Instance, f64, f64, bool, *mut bool, *mut bool, *mut bool, *mut f64) -> c_int;
}

unsafe extern "C" fn logger(_: *mut c_void, status: c_int, _category: *const c_char, message: *const c_char) {
    // SAFETY: the unit hands over a text.
    keep(status, &unsafe { text_of(message) });
}

/// Values on their way to and from the unit.
#[derive(Default)]
struct Scratch {
    float32: Vec<f32>,
    int8: Vec<i8>,
    uint8: Vec<u8>,
    int16: Vec<i16>,
    uint16: Vec<u16>,
    int32: Vec<i32>,
    uint32: Vec<u32>,
    int64: Vec<i64>,
    uint64: Vec<u64>,
}

/// A library with at most one instance.
pub(crate) struct Three {
    functions: Functions,
    instance: Instance,
    scratch: Scratch,
    _library: Library,
}

impl Three {
    pub(crate) fn new(library: Library) -> Self {
        // SAFETY: the description says that the library is one of a unit of version 3.0.
        let functions = unsafe { Functions::of(&library) };
        Self { functions, instance: std::ptr::null_mut(), scratch: Scratch::default(), _library: library }
    }
}

/// Reads values of one type by way of a list of that type.
macro_rules! read {
    ($own:ident.$field:ident, $list:ident, $references:ident, $values:ident) => {{
        $own.scratch.$list.clear();
        $own.scratch.$list.resize($values.len(), Default::default());
        let (pointer, count) = ($own.scratch.$list.as_mut_ptr(), $values.len());
        checked!($own.$field($own.instance, $references.as_ptr(), $references.len(), pointer, count));
        for (value, &own) in $values.iter_mut().zip(&$own.scratch.$list) {
            *value = own as f64;
        }
    }};
}

/// Writes values of one type by way of a list of that type; what its range does not hold becomes its nearest end.
macro_rules! write {
    ($own:ident.$field:ident, $list:ident: $kind:ty, $references:ident, $values:ident) => {{
        $own.scratch.$list.clear();
        $own.scratch.$list.extend($values.iter().map(|&value| value as $kind));
        let (pointer, count) = ($own.scratch.$list.as_ptr(), $values.len());
        checked!($own.$field($own.instance, $references.as_ptr(), $references.len(), pointer, count));
    }};
}

impl Foreign for Three {
    fn instantiate(&mut self, setup: &Setup) -> Result<(), Halt> {
        let (name, token, resources) = (c_text(&setup.name), c_text(&setup.token), c_text(&setup.resources));
        let (name, token, resources) = (name.as_ptr(), token.as_ptr(), resources.as_ptr());
        let (none, environment) = (std::ptr::null(), std::ptr::null_mut());
        let (call, made) = match setup.exchange {
            true => call!(self.instantiate_exchange(name, token, resources, false, false, environment, logger)),
            false => call!(self.instantiate_stepping(
                name,
                token,
                resources,
                false,
                false,
                false,
                false,
                none,
                0,
                environment,
                logger,
                std::ptr::null(),
            )),
        };
        if made.is_null() {
            return Err(Halt::Failed(format!("`{call}` gives no instance")));
        }
        self.instance = made;
        Ok(())
    }

    fn ask_for_warnings(&mut self) {
        let Some(function) = self.functions.set_logging else { return };
        let category = c_text(WARNINGS);
        let categories = [category.as_ptr()];
        crate::foreign::announce(number::set_logging);
        // SAFETY: the instance is one of this library, and it keeps no text of a caller.
        let _ = unsafe { function(self.instance, true, 1, categories.as_ptr()) };
        crate::foreign::announce(0);
    }

    fn free(&mut self) {
        let instance = std::mem::replace(&mut self.instance, std::ptr::null_mut());
        if let (false, Some(function)) = (instance.is_null(), self.functions.free_instance) {
            crate::foreign::announce(number::free_instance);
            // SAFETY: the instance is one of this library, and nobody uses it any more.
            unsafe { function(instance) };
            crate::foreign::announce(0);
        }
    }

    fn get(&mut self, number: Number, references: &[u32], values: &mut [f64]) -> Result<(), Halt> {
        match number {
            Number::Float64 => checked!(self.get_float64(
                self.instance,
                references.as_ptr(),
                references.len(),
                values.as_mut_ptr(),
                values.len()
            )),
            Number::Float32 => read!(self.get_float32, float32, references, values),
            Number::Int8 => read!(self.get_int8, int8, references, values),
            Number::UInt8 => read!(self.get_uint8, uint8, references, values),
            Number::Int16 => read!(self.get_int16, int16, references, values),
            Number::UInt16 => read!(self.get_uint16, uint16, references, values),
            Number::Int32 => read!(self.get_int32, int32, references, values),
            Number::UInt32 => read!(self.get_uint32, uint32, references, values),
            Number::Int64 => read!(self.get_int64, int64, references, values),
            Number::UInt64 => read!(self.get_uint64, uint64, references, values),
            // A truth value of C is a byte that need not be 0 or 1 here.
            Number::Boolean => {
                read!(self.get_boolean, uint8, references, values);
                values.iter_mut().for_each(|value| *value = f64::from(u8::from(*value != 0.0)));
            }
        }
        Ok(())
    }

    fn set(&mut self, number: Number, references: &[u32], values: &[f64]) -> Result<(), Halt> {
        match number {
            Number::Float64 => checked!(self.set_float64(
                self.instance,
                references.as_ptr(),
                references.len(),
                values.as_ptr(),
                values.len()
            )),
            Number::Float32 => write!(self.set_float32, float32: f32, references, values),
            Number::Int8 => write!(self.set_int8, int8: i8, references, values),
            Number::UInt8 => write!(self.set_uint8, uint8: u8, references, values),
            Number::Int16 => write!(self.set_int16, int16: i16, references, values),
            Number::UInt16 => write!(self.set_uint16, uint16: u16, references, values),
            Number::Int32 => write!(self.set_int32, int32: i32, references, values),
            Number::UInt32 => write!(self.set_uint32, uint32: u32, references, values),
            Number::Int64 => write!(self.set_int64, int64: i64, references, values),
            Number::UInt64 => write!(self.set_uint64, uint64: u64, references, values),
            Number::Boolean => {
                self.scratch.uint8.clear();
                self.scratch.uint8.extend(values.iter().map(|&value| u8::from(value != 0.0)));
                let pointer = self.scratch.uint8.as_ptr();
                checked!(self.set_boolean(self.instance, references.as_ptr(), references.len(), pointer, values.len()));
            }
        }
        Ok(())
    }

    fn set_text(&mut self, reference: u32, text: &CStr) -> Result<(), Halt> {
        let pointer = text.as_ptr();
        checked!(self.set_string(self.instance, &raw const reference, 1, &raw const pointer, 1));
        Ok(())
    }

    fn enter_initialization(&mut self, start: f64, stop: Option<f64>, tolerance: f64) -> Result<(), Halt> {
        let (known, stop) = (stop.is_some(), stop.unwrap_or(0.0));
        checked!(self.enter_initialization(self.instance, true, tolerance, start, known, stop));
        Ok(())
    }

    fn exit_initialization(&mut self) -> Result<(), Halt> {
        checked!(self.exit_initialization(self.instance));
        Ok(())
    }

    fn terminate(&mut self) -> Result<(), Halt> {
        checked!(self.terminate(self.instance));
        Ok(())
    }

    fn enter_events(&mut self) -> Result<(), Halt> {
        checked!(self.enter_events(self.instance));
        Ok(())
    }

    fn update(&mut self, update: &mut Update) -> Result<bool, Halt> {
        let (mut needed, mut terminate, mut nominals, mut states, mut defined) = (false, false, false, false, false);
        let mut next = 0.0;
        checked!(self.update(
            self.instance,
            &raw mut needed,
            &raw mut terminate,
            &raw mut nominals,
            &raw mut states,
            &raw mut defined,
            &raw mut next,
        ));
        update.terminate |= terminate;
        update.states_changed |= states;
        update.next = if defined { next } else { f64::INFINITY };
        Ok(needed)
    }

    continuous_calls!();

    fn completed(&mut self) -> Result<(bool, bool), Halt> {
        let (mut event, mut terminate) = (false, false);
        checked!(self.completed(self.instance, true, &raw mut event, &raw mut terminate));
        Ok((event, terminate))
    }

    fn directional(&mut self, (unknown, known): (&[u32], &[u32]), seed: &[f64], out: &mut [f64]) -> Result<(), Halt> {
        checked!(self.directional(
            self.instance,
            unknown.as_ptr(),
            unknown.len(),
            known.as_ptr(),
            known.len(),
            seed.as_ptr(),
            seed.len(),
            out.as_mut_ptr(),
            out.len(),
        ));
        Ok(())
    }

    fn set_slopes(&mut self, _references: &[u32], _slopes: &[f64]) -> Result<(), Halt> {
        // 3.0 has no such function.
        Ok(())
    }

    fn step(&mut self, t: f64, h: f64) -> Result<StepEnd, Halt> {
        let (mut event, mut terminate, mut early) = (false, false, false);
        let mut reached = t + h;
        checked!(self.step(
            self.instance,
            t,
            h,
            true,
            &raw mut event,
            &raw mut terminate,
            &raw mut early,
            &raw mut reached,
        ));
        if early && !terminate {
            return Err(Halt::Failed(format!(
                "`fmi3DoStep` returned early at {reached} s, which it was not allowed to"
            )));
        }
        // Some units leave the time as it was; without an early return the step is whole.
        Ok(StepEnd { reached: if early || terminate { reached } else { t + h }, terminate })
    }
}
