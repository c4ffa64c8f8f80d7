//! Mapping a payload executable and calling it: the only place with `unsafe`.
//!
//! The bytes are written to fresh pages which then become executable, never both at once.  Each call checks the sizes
//! of its memory against what the routine touches, so that [`NativeCode::call`] is safe for its callers.

#![allow(unsafe_code)]

use memmap2::{Mmap, MmapMut};

use super::Payload;
use super::functions::{self, COUNT};
use crate::memory::{Extents, Memory};
use crate::program::{AREAS, RoutineId};
use hyd_index::IndexVec;

/// What generated code receives.
#[repr(C)]
#[derive(Debug)]
pub struct Context {
    /// Start of each area, in the order of `Area`.
    pub areas: [*mut f64; AREAS],
    /// Slot tables.
    pub tables: *const u32,
    /// Elementary functions in the order of `Function::ALL`.
    pub functions: *const usize,
    /// Addresses of the bodies of functions, by their ids.
    pub bodies: *const usize,
}

type Entry = unsafe extern "C" fn(*const Context);

/// Executable code of a program.
#[derive(Debug)]
pub struct NativeCode {
    pages: Option<Mmap>,
    entries: IndexVec<RoutineId, Vec<u32>>,
    tables: Vec<u32>,
    functions: [usize; COUNT],
    bodies: Vec<usize>,
    extents: Extents,
}

impl NativeCode {
    /// Maps a payload made by [`super::compile`] in this process.
    ///
    /// # Errors
    /// A sentence, when the system refuses executable memory.
    pub fn map(payload: Payload) -> Result<Self, String> {
        let pages = if payload.bytes.is_empty() {
            None
        } else {
            let refused = |e: std::io::Error| format!("no executable memory: {e}");
            let mut pages = MmapMut::map_anon(payload.bytes.len()).map_err(refused)?;
            pages[..payload.bytes.len()].copy_from_slice(&payload.bytes);
            Some(pages.make_exec().map_err(refused)?)
        };
        let Payload { entries, bodies, tables, extents, .. } = payload;
        let start = pages.as_ref().map_or(0, |pages| pages.as_ptr() as usize);
        let bodies = bodies.into_iter().map(|position| start + position as usize).collect();
        Ok(Self { pages, entries, tables, functions: functions::table(), bodies, extents })
    }

    /// Runs a routine.  Panics when an area is shorter than the program's layout says.
    pub fn call(&self, routine: RoutineId, memory: &mut Memory<'_>) {
        self.extents.check(routine, memory);
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
            tables: self.tables.as_ptr(),
            functions: self.functions.as_ptr(),
            bodies: self.bodies.as_ptr(),
        };
        for &start in &self.entries[routine] {
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
