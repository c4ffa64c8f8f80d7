//! What runs a program: native code, or the interpreter where executable memory is refused or not wanted.

use std::sync::{Arc, OnceLock};

use crate::mapping::{Code, NativeCode};
use crate::memory::Memory;
use crate::program::{Program, RoutineId};
use crate::target;
use crate::vm::{Fault, Registers, Vm};

/// What is to run a program.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Backend {
    /// Machine code, interpreted where there is none or the system refuses executable memory.
    #[default]
    Native,
    /// The interpreter.
    Vm,
}

/// A program that can run.
#[derive(Debug)]
pub struct Engine {
    native: Option<NativeCode>,
    program: Arc<Program>,
    interpreter: OnceLock<Option<Vm>>,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
    /// Why the code is interpreted although it was to run natively.
    pub fallback: Option<String>,
}

impl Engine {
    /// Maps the code; interprets instead where asked to, without code, or without executable memory.
    ///
    /// # Errors
    /// A sentence, when the program is inconsistent.
    pub fn new(code: Option<Arc<Code>>, program: Arc<Program>, backend: Backend) -> Result<Self, String> {
        let mapped = match (code, backend) {
            (Some(code), Backend::Native) => {
                let missing = target::missing(code.features());
                match missing.is_empty() {
                    true => NativeCode::map(code),
                    false => Err(format!("this processor lacks {}", missing.join(", "))),
                }
            }
            (None, Backend::Native) => Err("no code can be generated for this machine".to_string()),
            (_, Backend::Vm) => Err(String::new()),
        };
        match mapped {
            Ok(code) => {
                let code_bytes = code.bytes();
                let interpreter = OnceLock::new();
                Ok(Self { native: Some(code), program, interpreter, code_bytes, fallback: None })
            }
            Err(reason) => {
                let interpreter = OnceLock::from(Some(Vm::new(&program)?));
                let fallback = Some(reason).filter(|reason| !reason.is_empty());
                Ok(Self { native: None, program, interpreter, code_bytes: 0, fallback })
            }
        }
    }

    /// What runs.
    pub fn backend(&self) -> Backend {
        if self.native.is_some() { Backend::Native } else { Backend::Vm }
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

    /// The interpreter, made when it is first asked for.
    pub(crate) fn interpreter(&self) -> Option<&Vm> {
        self.interpreter.get_or_init(|| Vm::new(&self.program).ok()).as_ref()
    }

    /// Interprets a routine and returns the first stored value that is not finite.
    pub fn first_fault(&self, routine: RoutineId, memory: &mut Memory<'_>) -> Option<Fault> {
        self.interpreter().and_then(|vm| vm.first_fault(routine, memory))
    }
}
