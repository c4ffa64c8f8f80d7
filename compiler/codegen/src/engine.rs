//! What runs a program: native code, or the interpreter where executable memory is refused or not wanted.

use std::sync::OnceLock;

use crate::memory::Memory;
use crate::native::{self, NativeCode};
use crate::program::{Program, RoutineId};
use crate::vm::{Fault, Registers, Vm};

/// A program that can run.
#[derive(Debug)]
pub struct Engine {
    native: Option<NativeCode>,
    interpreter: OnceLock<Option<Vm>>,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
}

impl Engine {
    /// Makes native code; interprets instead where asked to, on other machines, or without executable memory.
    ///
    /// # Errors
    /// A sentence, when the program is inconsistent.
    pub fn new(program: &Program, interpret: bool) -> Result<Self, String> {
        let interpreter = OnceLock::new();
        if interpret || !native::is_supported() {
            let vm = Vm::new(program)?;
            return Ok(Self { native: None, interpreter: OnceLock::from(Some(vm)), code_bytes: 0 });
        }
        let payload = native::compile(program)?;
        let code_bytes = payload.bytes().len();
        match NativeCode::map(payload) {
            Ok(code) => Ok(Self { native: Some(code), interpreter, code_bytes }),
            Err(_) => Self::new(program, true),
        }
    }

    /// Working space for [`Engine::run`].
    pub fn registers(&self) -> Registers {
        match (&self.native, self.interpreter.get()) {
            (None, Some(Some(vm))) => vm.registers(),
            _ => Registers::default(),
        }
    }

    /// Runs a routine.
    pub fn run(&self, routine: RoutineId, memory: &mut Memory<'_>, registers: &mut Registers) {
        match (&self.native, self.interpreter.get()) {
            (Some(code), _) => code.call(routine, memory),
            (None, Some(Some(vm))) => vm.call(routine, memory, registers),
            (None, _) => {}
        }
    }

    /// Interprets a routine and returns the first stored value that is not finite.
    pub fn first_fault(&self, program: &Program, routine: RoutineId, memory: &mut Memory<'_>) -> Option<Fault> {
        let vm = self.interpreter.get_or_init(|| Vm::new(program).ok());
        vm.as_ref().and_then(|vm| vm.first_fault(routine, memory))
    }
}
