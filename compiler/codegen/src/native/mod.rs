//! Program to machine code without relocations, by Cranelift.
//!
//! Each routine becomes one function or several (cut between kernels, and within a long straight-line kernel between
//! stores), all of them `fn(*const Context)`.  The bytes of all functions stand one after the other in a [`Code`] that
//! runs wherever it is mapped: memory, slot tables and elementary functions are reached through the context.  A relocation
//! left in the code is an error.  Mapping and calling is the job of [`NativeCode`].

mod body;
mod expression;
mod groups;
mod isa;
mod kernel;
mod lanes;
mod split;
mod width;

use cranelift_codegen::Context as CodeContext;
use cranelift_codegen::control::ControlPlane;
use cranelift_codegen::ir::{
    AbiParam, Function as IrFunction, InstBuilder, MemFlagsData, Signature, Type, Value, types,
};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use hyd_index::IndexVec;
use hyd_symbolic::{BodyId, Node, NodeId, post_order};

use crate::memory::Extents;
use crate::program::{AREAS, Kernel, Program};
use expression::Calls;
use isa::Target;
use kernel::Frame;

pub use hyd_payload::{Code, NativeCode};

/// Functions start at multiples of this (a cache line; constants behind the code need 16).
const FUNCTION_ALIGNMENT: usize = 64;

/// Most instructions of a function whose registers are allocated with care.  The time for that grows with the square of the length;
/// only an expression that cannot be cut (see `split`), or a body of a function, gets so long.
const CAREFUL: usize = 12_000;

/// True if code can be made for the machine this process runs on.
pub fn is_supported() -> bool {
    isa::host().is_ok()
}

/// Makes code for the machine this process runs on.
///
/// # Errors
/// A sentence: an unsupported machine, an inconsistent program, or a relocation that remains.
pub fn compile(program: &Program) -> Result<Code, String> {
    let extents = Extents::of(program)?;
    let mut compiler = Compiler::new(program)?;
    let mut entries = IndexVec::new();
    for routine in program.routines.iter() {
        let mut starts = Vec::new();
        for kernels in split::functions(&program.arena, routine) {
            starts.push(compiler.function(&kernels).map_err(|e| format!("routine `{}`: {e}", routine.name))?);
        }
        entries.push(starts);
    }
    let mut bodies = vec![0; program.arena.body_count()];
    for id in called(program) {
        let name = &program.arena.body(id).name;
        bodies[id.0 as usize] = compiler.body(id).map_err(|e| format!("function `{name}`: {e}"))?;
    }
    let features = compiler.target.features;
    // SAFETY: these are functions of that type, made for this machine; `finish` refuses relocations; `Extents::of` is what they
    // touch, because they were made from this program.
    #[allow(unsafe_code)]
    let code = unsafe { Code::new(compiler.bytes, (entries, bodies), program.tables.clone(), extents, features) };
    Ok(code)
}

/// The bodies that the program calls.
fn called(program: &Program) -> Vec<BodyId> {
    let kernels = program.routines.iter().flat_map(|routine| &routine.kernels);
    let roots: Vec<NodeId> = kernels.flat_map(|kernel| &kernel.stores).map(|store| store.value).collect();
    let body = |id| match program.arena.node(id) {
        Node::Apply(body, ..) => Some(body),
        _ => None,
    };
    let direct: Vec<BodyId> = post_order(&program.arena, &roots).into_iter().filter_map(body).collect();
    program.arena.reachable(&direct)
}

struct Compiler<'a> {
    program: &'a Program,
    target: Target,
    code: CodeContext,
    builder: FunctionBuilderContext,
    bytes: Vec<u8>,
}

impl<'a> Compiler<'a> {
    fn new(program: &'a Program) -> Result<Self, String> {
        Ok(Self {
            program,
            target: isa::host()?,
            code: CodeContext::new(),
            builder: FunctionBuilderContext::new(),
            bytes: Vec::new(),
        })
    }

    /// Compiles kernels as one function; returns its position in the bytes.
    fn function(&mut self, kernels: &[Kernel]) -> Result<u32, String> {
        self.code.clear();
        self.code.func = IrFunction::new();
        self.code.func.signature = self.signature(&[types::I64], None);
        self.build(kernels);
        self.finish()
    }

    /// Compiles a body of a function; returns its position in the bytes.
    fn body(&mut self, id: BodyId) -> Result<u32, String> {
        self.code.clear();
        self.code.func = IrFunction::new();
        self.code.func.signature = self.signature(&BODY_ARGUMENTS, None);
        let signatures = self.signatures();
        let mut fb = FunctionBuilder::new(&mut self.code.func, &mut self.builder);
        let entry = fb.create_block();
        fb.append_block_params_for_function_params(entry);
        fb.switch_to_block(entry);
        fb.seal_block(entry);
        let context = fb.block_params(entry)[0];
        let mut calls = calls(&mut fb, signatures, context, self.target.rounds_inline);
        calls.account = Some(fb.block_params(entry)[3]);
        body::emit(&mut fb, &self.program.arena, id, calls, entry);
        fb.finalize(self.target.isa.frontend_config());
        self.finish()
    }

    /// Turns the function that was built into bytes.
    fn finish(&mut self) -> Result<u32, String> {
        let mut plane = ControlPlane::default();
        let long = self.code.func.dfg.num_insts() > CAREFUL;
        let isa = if long { &self.target.hasty } else { &self.target.isa };
        let compiled = self.code.compile(isa.as_ref(), &mut plane).map_err(|e| format!("{e:?}"))?;
        if !compiled.buffer.relocs().is_empty() {
            return Err(format!("the code contains {} relocations", compiled.buffer.relocs().len()));
        }
        if compiled.buffer.alignment as usize > FUNCTION_ALIGNMENT {
            return Err("the code requires a larger alignment".into());
        }
        let start = self.bytes.len().next_multiple_of(FUNCTION_ALIGNMENT);
        self.bytes.resize(start, 0);
        self.bytes.extend_from_slice(compiled.code_buffer());
        u32::try_from(start).map_err(|_| "the code exceeds 4 GB".into())
    }

    /// Signatures of elementary functions of one and two arguments, of bodies, and of the functions for groups.
    fn signatures(&self) -> [Signature; 4] {
        let unary = self.signature(&[types::F64], Some(types::F64));
        let binary = self.signature(&[types::F64, types::F64], Some(types::F64));
        [unary, binary, self.signature(&BODY_ARGUMENTS, None), self.signature(&[types::I64; 2], None)]
    }

    fn signature(&self, arguments: &[Type], result: Option<Type>) -> Signature {
        let mut signature = Signature::new(self.target.convention);
        signature.params.extend(arguments.iter().map(|&t| AbiParam::new(t)));
        signature.returns.extend(result.map(AbiParam::new));
        signature
    }

    fn build(&mut self, kernels: &[Kernel]) {
        let signatures = self.signatures();
        let mut fb = FunctionBuilder::new(&mut self.code.func, &mut self.builder);
        let entry = fb.create_block();
        fb.append_block_params_for_function_params(entry);
        fb.switch_to_block(entry);
        fb.seal_block(entry);
        let context = fb.block_params(entry)[0];
        let areas = std::array::from_fn(|area| field(&mut fb, context, area));
        let calls = calls(&mut fb, signatures, context, self.target.rounds_inline);
        let tables = field(&mut fb, context, AREAS);
        let written = split::written(kernels);
        let frame = Frame { arena: &self.program.arena, areas, written, tables, calls };
        for kernel in kernels {
            frame.emit(&mut fb, kernel);
        }
        fb.ins().return_(&[]);
        fb.finalize(self.target.isa.frontend_config());
    }
}

/// What expressions need, from the context.
fn calls(fb: &mut FunctionBuilder<'_>, signatures: [Signature; 4], context: Value, rounds_inline: bool) -> Calls {
    let [unary, binary, body, grouped] = signatures.map(|signature| fb.import_signature(signature));
    Calls {
        table: field(fb, context, AREAS + 1),
        unary,
        binary,
        grouped,
        rounds_inline,
        pointer_bytes: POINTER_BYTES,
        bodies: field(fb, context, AREAS + 2),
        body,
        context,
        account: None,
    }
}

/// Context, arguments, place of the outputs, account of limits.
const BODY_ARGUMENTS: [Type; 4] = [types::I64; 4];

const POINTER_BYTES: i32 = 8;

/// Loads the pointer at a position of the context.
fn field(fb: &mut FunctionBuilder<'_>, context: Value, position: usize) -> Value {
    let flags = MemFlagsData::trusted().with_readonly().with_can_move();
    fb.ins().load(types::I64, flags, context, position as i32 * POINTER_BYTES)
}
