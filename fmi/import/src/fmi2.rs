//! A unit of version 2.0, called by the functions of its library.
//!
//! Source: Functional Mock-up Interface 2.0.4, sections 2.1, 3.2 and 4.2.

#![allow(unsafe_code)]

use std::ffi::{CStr, c_char, c_int, c_void};

use libloading::Library;

use crate::description::{Number, WARNINGS};
use crate::foreign::{
    Foreign, Halt, StepEnd, c_text, call, checked, continuous_calls, functions, judge, keep, messages, text_of,
};
use crate::protocol::{Setup, Update};

type Instance = *mut c_void;
type References = *const u32;

/// What the importer hands over for messages and memory.
#[repr(C)]
struct Callbacks {
    logger: *const c_void,
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: *const c_void,
    environment: *mut c_void,
}

/// What an update of discrete states gives.
#[repr(C)]
#[derive(Default)]
struct EventInfo {
    needed: c_int,
    terminate: c_int,
    nominals_changed: c_int,
    states_changed: c_int,
    next_defined: c_int,
    next: f64,
}

functions! {
    instantiate = "fmi2Instantiate": fn(*const c_char, c_int, *const c_char, *const c_char, *const Callbacks, c_int, c_int) -> Instance;
    set_logging = "fmi2SetDebugLogging": fn(Instance, c_int, usize, *const *const c_char) -> c_int;
    free_instance = "fmi2FreeInstance": fn(Instance);
    setup_experiment = "fmi2SetupExperiment": fn(Instance, c_int, f64, f64, c_int, f64) -> c_int;
    enter_initialization = "fmi2EnterInitializationMode": fn(Instance) -> c_int;
    exit_initialization = "fmi2ExitInitializationMode": fn(Instance) -> c_int;
    terminate = "fmi2Terminate": fn(Instance) -> c_int;
    get_real = "fmi2GetReal": fn(Instance, References, usize, *mut f64) -> c_int;
    get_integer = "fmi2GetInteger": fn(Instance, References, usize, *mut c_int) -> c_int;
    get_boolean = "fmi2GetBoolean": fn(Instance, References, usize, *mut c_int) -> c_int;
    set_real = "fmi2SetReal": fn(Instance, References, usize, *const f64) -> c_int;
    set_integer = "fmi2SetInteger": fn(Instance, References, usize, *const c_int) -> c_int;
    set_boolean = "fmi2SetBoolean": fn(Instance, References, usize, *const c_int) -> c_int;
    set_string = "fmi2SetString": fn(Instance, References, usize, *const *const c_char) -> c_int;
    directional = "fmi2GetDirectionalDerivative": fn(Instance, References, usize, References, usize, *const f64, *mut f64) -> c_int;
    enter_events = "fmi2EnterEventMode": fn(Instance) -> c_int;
    update = "fmi2NewDiscreteStates": fn(Instance, *mut EventInfo) -> c_int;
    enter_continuous = "fmi2EnterContinuousTimeMode": fn(Instance) -> c_int;
    completed = "fmi2CompletedIntegratorStep": fn(Instance, c_int, *mut c_int, *mut c_int) -> c_int;
    set_time = "fmi2SetTime": fn(Instance, f64) -> c_int;
    set_states = "fmi2SetContinuousStates": fn(Instance, *const f64, usize) -> c_int;
    rates = "fmi2GetDerivatives": fn(Instance, *mut f64, usize) -> c_int;
    indicators = "fmi2GetEventIndicators": fn(Instance, *mut f64, usize) -> c_int;
    states = "fmi2GetContinuousStates": fn(Instance, *mut f64, usize) -> c_int;
    nominals = "fmi2GetNominalsOfContinuousStates": fn(Instance, *mut f64, usize) -> c_int;
    set_slopes = "fmi2SetRealInputDerivatives": fn(Instance, References, usize, *const c_int, *const f64) -> c_int;
    step = "fmi2DoStep": fn(Instance, f64, f64, c_int) -> c_int;
    real_status = "fmi2GetRealStatus": fn(Instance, c_int, *mut f64) -> c_int;
    boolean_status = "fmi2GetBooleanStatus": fn(Instance, c_int, *mut c_int) -> c_int;
}

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

unsafe extern "C" fn allocate(count: usize, size: usize) -> *mut c_void {
    // SAFETY: any numbers are allowed.
    unsafe { calloc(count, size) }
}

unsafe extern "C" fn release(memory: *mut c_void) {
    // SAFETY: the unit gives back what it got from `allocate`, or nothing.
    unsafe { free(memory) }
}

/// Numbers of `fmi2StatusKind`.
const LAST_TIME: c_int = 2;
const TERMINATED: c_int = 3;
const DISCARD: c_int = 2;

/// A library with at most one instance.
pub(crate) struct Two {
    functions: Functions,
    callbacks: Box<Callbacks>,
    instance: Instance,
    integers: Vec<c_int>,
    orders: Vec<c_int>,
    _library: Library,
}

impl Two {
    pub(crate) fn new(library: Library) -> Self {
        // SAFETY: the description says that the library is one of a unit of version 2.0.
        let functions = unsafe { Functions::of(&library) };
        let callbacks = Callbacks {
            logger: logger::pointer(),
            allocate,
            free: release,
            step_finished: std::ptr::null(),
            environment: std::ptr::null_mut(),
        };
        let callbacks = Box::new(callbacks);
        let (instance, integers, orders) = (std::ptr::null_mut(), Vec::new(), Vec::new());
        Self { functions, callbacks, instance, integers, orders, _library: library }
    }
}

impl Foreign for Two {
    fn instantiate(&mut self, setup: &Setup) -> Result<(), Halt> {
        let (name, token, resources) = (c_text(&setup.name), c_text(&setup.token), c_text(&setup.resources));
        let kind = c_int::from(!setup.exchange);
        let callbacks: *const Callbacks = &*self.callbacks;
        let (call, made) =
            call!(self.instantiate(name.as_ptr(), kind, token.as_ptr(), resources.as_ptr(), callbacks, 0, 0));
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
        let _ = unsafe { function(self.instance, 1, 1, categories.as_ptr()) };
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
        let (list, count) = (references.as_ptr(), references.len().min(values.len()));
        if number == Number::Float64 {
            checked!(self.get_real(self.instance, list, count, values.as_mut_ptr()));
            return Ok(());
        }
        self.integers.resize(count, 0);
        if number == Number::Boolean {
            checked!(self.get_boolean(self.instance, list, count, self.integers.as_mut_ptr()));
        } else {
            checked!(self.get_integer(self.instance, list, count, self.integers.as_mut_ptr()));
        }
        for (value, &integer) in values.iter_mut().zip(&self.integers) {
            *value = if number == Number::Boolean { f64::from(u8::from(integer != 0)) } else { f64::from(integer) };
        }
        Ok(())
    }

    fn set(&mut self, number: Number, references: &[u32], values: &[f64]) -> Result<(), Halt> {
        let (list, count) = (references.as_ptr(), references.len().min(values.len()));
        if number == Number::Float64 {
            checked!(self.set_real(self.instance, list, count, values.as_ptr()));
            return Ok(());
        }
        self.integers.clear();
        self.integers.extend(values.iter().map(|&value| value as c_int));
        if number == Number::Boolean {
            checked!(self.set_boolean(self.instance, list, count, self.integers.as_ptr()));
        } else {
            checked!(self.set_integer(self.instance, list, count, self.integers.as_ptr()));
        }
        Ok(())
    }

    fn set_text(&mut self, reference: u32, text: &CStr) -> Result<(), Halt> {
        let pointer = text.as_ptr();
        checked!(self.set_string(self.instance, &raw const reference, 1, &raw const pointer));
        Ok(())
    }

    fn enter_initialization(&mut self, start: f64, stop: Option<f64>, tolerance: f64) -> Result<(), Halt> {
        let (known, stop) = (c_int::from(stop.is_some()), stop.unwrap_or(0.0));
        checked!(self.setup_experiment(self.instance, 1, tolerance, start, known, stop));
        checked!(self.enter_initialization(self.instance));
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
        let mut info = EventInfo::default();
        checked!(self.update(self.instance, &raw mut info));
        update.terminate |= info.terminate != 0;
        update.states_changed |= info.states_changed != 0;
        update.next = if info.next_defined != 0 { info.next } else { f64::INFINITY };
        Ok(info.needed != 0)
    }

    continuous_calls!();

    fn completed(&mut self) -> Result<(bool, bool), Halt> {
        let (mut event, mut terminate) = (0, 0);
        checked!(self.completed(self.instance, 1, &raw mut event, &raw mut terminate));
        Ok((event != 0, terminate != 0))
    }

    fn directional(&mut self, (unknown, known): (&[u32], &[u32]), seed: &[f64], out: &mut [f64]) -> Result<(), Halt> {
        let count = |list: &[u32], values: usize| list.len().min(values);
        checked!(self.directional(
            self.instance,
            unknown.as_ptr(),
            count(unknown, out.len()),
            known.as_ptr(),
            count(known, seed.len()),
            seed.as_ptr(),
            out.as_mut_ptr(),
        ));
        Ok(())
    }

    fn set_slopes(&mut self, references: &[u32], slopes: &[f64]) -> Result<(), Halt> {
        self.orders.resize(references.len().max(self.orders.len()), 1);
        let count = references.len().min(slopes.len());
        checked!(self.set_slopes(self.instance, references.as_ptr(), count, self.orders.as_ptr(), slopes.as_ptr()));
        Ok(())
    }

    fn step(&mut self, t: f64, h: f64) -> Result<StepEnd, Halt> {
        let (name, status) = call!(self.step(self.instance, t, h, 1));
        if status != DISCARD {
            judge(name, status)?;
            return Ok(StepEnd { reached: t + h, terminate: false });
        }
        // The unit may want to end within the step.
        let (mut reached, mut terminated) = (t, 0);
        checked!(self.boolean_status(self.instance, TERMINATED, &raw mut terminated));
        checked!(self.real_status(self.instance, LAST_TIME, &raw mut reached));
        match terminated != 0 {
            true => Ok(StepEnd { reached, terminate: true }),
            false => {
                let said = messages().join("; ");
                let said = if said.is_empty() { String::new() } else { format!(": {said}") };
                Err(Halt::Failed(format!("`{name}` got no farther than {reached} s of {} s{said}", t + h)))
            }
        }
    }
}

/// Takes a message whose format has been filled in.
fn take(status: c_int, text: &str) {
    keep(status, text);
}

/// The logger has a variable list of arguments, which the stable language cannot declare.  By the calling conventions of Linux on these
/// processors such arguments come where those of a function with as many fixed ones of their kinds would, so they are declared as those,
/// and read only as far as the format asks for them.
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod logger {
    use super::{c_char, c_int, c_void, take, text_of};

    /// Whole arguments and reals that are read.
    const WHOLE: usize = 8;
    const REALS: usize = 8;

    #[allow(clippy::too_many_arguments)]
    unsafe extern "C" fn logger(
        _environment: *mut c_void,
        _instance: *const c_char,
        status: c_int,
        _category: *const c_char,
        message: *const c_char,
        a: usize,
        b: usize,
        c: usize,
        d: usize,
        e: usize,
        f: usize,
        g: usize,
        h: usize,
        r: f64,
        s: f64,
        t: f64,
        u: f64,
        v: f64,
        w: f64,
        x: f64,
        y: f64,
    ) {
        // SAFETY: the unit hands over a text.
        let format = unsafe { text_of(message) };
        take(status, &filled(&format, [a, b, c, d, e, f, g, h], [r, s, t, u, v, w, x, y]));
    }

    pub(super) fn pointer() -> *const c_void {
        logger as *const c_void
    }

    /// The message with its arguments, as `printf` writes them, widths and precisions aside.
    fn filled(format: &str, whole: [usize; WHOLE], reals: [f64; REALS]) -> String {
        let (mut text, mut rest) = (String::new(), format);
        let (mut whole, mut reals) = (whole.into_iter(), reals.into_iter());
        while let Some(at) = rest.find('%') {
            text.push_str(&rest[..at]);
            let after = &rest[at + 1..];
            let length = after.find(|c: char| c.is_ascii_alphabetic() && !"hlzjtL".contains(c) || c == '%');
            let Some(end) = length else {
                rest = &rest[at..];
                break;
            };
            let long = after[..end].contains(['l', 'z', 'j', 't']);
            let kind = after.as_bytes()[end];
            match kind {
                b'%' => text.push('%'),
                b's' => {
                    // SAFETY: the format says that a text stands here.
                    let own = whole.next().map(|pointer| unsafe { text_of(pointer as *const c_char) });
                    text.push_str(&own.unwrap_or_default());
                }
                b'd' | b'i' => {
                    let value = whole.next().unwrap_or_default();
                    text.push_str(&if long { (value as i64).to_string() } else { (value as i32).to_string() });
                }
                b'u' => {
                    let value = whole.next().unwrap_or_default();
                    text.push_str(&if long { value.to_string() } else { (value as u32).to_string() });
                }
                b'x' | b'X' | b'p' => text.push_str(&format!("{:x}", whole.next().unwrap_or_default())),
                b'c' => text.push(char::from(whole.next().unwrap_or_default() as u8)),
                b'e' | b'E' | b'f' | b'F' | b'g' | b'G' => {
                    text.push_str(&reals.next().map(|value| value.to_string()).unwrap_or_default());
                }
                _ => text.push('?'),
            }
            rest = &after[end + 1..];
        }
        text + rest
    }

    #[cfg(test)]
    mod tests {
        use std::ffi::CString;

        use super::filled;

        #[test]
        fn formats_are_filled_in() {
            let name = CString::new("valve").expect("a text");
            let whole = [name.as_ptr() as usize, 42usize, usize::MAX, 0, 0, 0, 0, 0];
            let text = filled("%s: %d of %ld at %g s, 100%% %5.3f%", whole, [0.5, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            assert_eq!(text, "valve: 42 of -1 at 0.5 s, 100% 2%");
        }
    }
}

/// Elsewhere the message is shown with its format.
#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
mod logger {
    use super::{c_char, c_int, c_void, take, text_of};

    unsafe extern "C" fn logger(
        _environment: *mut c_void,
        _instance: *const c_char,
        status: c_int,
        _category: *const c_char,
        message: *const c_char,
    ) {
        // SAFETY: the unit hands over a text.
        take(status, &unsafe { text_of(message) });
    }

    pub(super) fn pointer() -> *const c_void {
        logger as *const c_void
    }
}
