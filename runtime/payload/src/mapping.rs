//! Mapping machine code executable and calling it: here stands all `unsafe` but the two calls of [`Code::new`].
//!
//! These calls, in `format.rs` and in the code generator, promise that the bytes are code that the compiler made.
//! The bytes are written to fresh pages which then become executable, never both at once.  Each call checks the sizes
//! of its memory against what the routine touches, so that [`NativeCode::call`] is safe for its callers.

#![allow(unsafe_code)]

use std::sync::Arc;

use hyd_index::IndexVec;
use hyd_system::angles::{self, Angles};
use hyd_system::powers::{self, Powers};
use memmap2::{Mmap, MmapMut};

use crate::functions::{self, COUNT};
use crate::memory::{Extents, Memory};
use crate::program::{AREAS, RoutineId};

/// What generated code receives.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct Context {
    /// Start of each area, in the order of `Area`.
    pub areas: [*mut f64; AREAS],
    /// Slot tables.
    pub tables: *const u32,
    /// Elementary functions in the order of [`functions::table`].
    pub functions: *const usize,
    /// Addresses of the bodies of functions, by their ids.
    pub bodies: *const usize,
}

type Entry = unsafe extern "C" fn(*const Context);
type Grouped<T> = unsafe extern "C" fn(usize, *mut T);

/// What generated code calls for groups of angles.
unsafe extern "C" fn sines_and_cosines(count: usize, groups: *mut Angles) {
    // SAFETY: the generator of code reserves this many groups, aligned for numbers, in the frame of the caller, which nothing
    // else refers to during the call, and writes all angles before it; what stands where sines and cosines go is only
    // written, and numbers whatever its bytes are.
    let groups = unsafe { std::slice::from_raw_parts_mut(groups, count) };
    angles::sines_and_cosines(groups);
}

/// What generated code calls for groups of powers.
unsafe extern "C" fn raised(count: usize, groups: *mut Powers) {
    // SAFETY: as above, with bases and exponents in place of angles, and values in place of sines and cosines.
    let groups = unsafe { std::slice::from_raw_parts_mut(groups, count) };
    powers::powers(groups);
}

/// Machine code of a program, independent of where it is mapped.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Code {
    /// Code and its constants.
    bytes: Vec<u8>,
    /// Start of each routine's functions in `bytes`, to be called in order.
    entries: IndexVec<RoutineId, Vec<u32>>,
    /// Start of each body in `bytes`, 0 for those that nothing calls.
    bodies: Vec<u32>,
    tables: Vec<u32>,
    extents: Extents,
    features: u32,
}

impl Code {
    /// Takes over code.
    ///
    /// # Safety
    /// `entries` are positions of functions of type `fn(*const Context)`, made for the calling convention of this machine and
    /// the extensions `features` (see [`crate::target`]), without relocations, that stay inside the areas as far as `extents`
    /// says and write neither unknowns nor rates; `bodies` likewise.  Those of the compiler are; those of a file are if its hash is
    /// that of what the compiler wrote.
    pub unsafe fn new(
        bytes: Vec<u8>,
        (entries, bodies): (IndexVec<RoutineId, Vec<u32>>, Vec<u32>),
        tables: Vec<u32>,
        extents: Extents,
        features: u32,
    ) -> Self {
        Self { bytes, entries, bodies, tables, extents, features }
    }

    /// The machine code with its constants.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Positions in the code of the functions of a routine, to be called in order.
    pub fn entries(&self, routine: RoutineId) -> &[u32] {
        &self.entries[routine]
    }

    /// The same of all routines.
    pub(crate) fn all_entries(&self) -> &IndexVec<RoutineId, Vec<u32>> {
        &self.entries
    }

    /// Positions in the code of the bodies of functions.
    pub fn bodies(&self) -> &[u32] {
        &self.bodies
    }

    /// The slot tables.
    pub fn tables(&self) -> &[u32] {
        &self.tables
    }

    /// The memory that each routine needs.
    pub fn extents(&self) -> &Extents {
        &self.extents
    }

    /// The extensions that it uses, see [`crate::target`].
    pub fn features(&self) -> u32 {
        self.features
    }
}

/// Executable code of a program.
#[derive(Debug)]
pub struct NativeCode {
    pages: Option<Mmap>,
    code: Arc<Code>,
    functions: [usize; COUNT],
    bodies: Vec<usize>,
}

impl NativeCode {
    /// Maps code in this process.
    ///
    /// # Errors
    /// A sentence, when the system refuses executable memory.
    pub fn map(code: Arc<Code>) -> Result<Self, String> {
        let pages = if code.bytes.is_empty() {
            None
        } else {
            let refused = |e: std::io::Error| format!("no executable memory: {e}");
            let mut pages = MmapMut::map_anon(code.bytes.len()).map_err(refused)?;
            pages[..code.bytes.len()].copy_from_slice(&code.bytes);
            Some(pages.make_exec().map_err(refused)?)
        };
        let start = pages.as_ref().map_or(0, |pages| pages.as_ptr() as usize);
        let bodies = code.bodies.iter().map(|&position| start + position as usize).collect();
        let grouped = [sines_and_cosines as Grouped<Angles> as usize, raised as Grouped<Powers> as usize];
        Ok(Self { pages, code, functions: functions::table(grouped), bodies })
    }

    /// Bytes of machine code.
    pub fn bytes(&self) -> usize {
        self.code.bytes.len()
    }

    /// Runs a routine.  Panics when an area is shorter than the program's layout says.
    pub fn call(&self, routine: RoutineId, memory: &mut Memory<'_>) {
        self.code.extents.check(routine, memory);
        let Some(pages) = &self.pages else { return };
        let context = Context {
            areas: [
                memory.data.as_mut_ptr(),
                memory.unknown.as_ptr().cast_mut(),
                memory.rate.as_ptr().cast_mut(),
                memory.work.as_mut_ptr(),
                memory.out.as_mut_ptr(),
                memory.out2.as_mut_ptr(),
            ],
            tables: self.code.tables.as_ptr(),
            functions: self.functions.as_ptr(),
            bodies: self.bodies.as_ptr(),
        };
        for &start in &self.code.entries[routine] {
            // SAFETY: `start` is the position of a function of type `Entry` that was compiled for this machine without
            // relocations, and the pages are executable and outlive the call.
            let entry = unsafe { std::mem::transmute::<*const u8, Entry>(pages.as_ptr().add(start as usize)) };
            // SAFETY: the code stays inside the areas, because `check` compared their lengths with the highest positions
            // it touches, table entries included; it never writes unknowns and rates (`Extents::of` refuses that); bodies of
            // functions touch only their own frames and those of their callers, with a check of every computed place and a
            // limit on their depth; the context outlives the call.
            unsafe { entry(&raw const context) };
        }
    }
}
