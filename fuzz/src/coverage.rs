//! Which edges of the program's control flow a case has gone along, and how often, in powers of two.
//!
//! A build with the flags of `fuzz/README.md` has a counter of 8 bits for every edge, put there by LLVM's pass
//! `sancov-module`, which tells their place before `main` begins (LLVM documentation, "SanitizerCoverage", section
//! "Inline 8bit-counters").  The classes of counts are those of greybox fuzzing (Miller and others, "The Fuzzing Book",
//! chapter "Greybox Fuzzing").  Without the flags there are no counters.

#![allow(unsafe_code)]

use std::sync::atomic::{AtomicPtr, AtomicUsize, Ordering};

static START: AtomicPtr<u8> = AtomicPtr::new(std::ptr::null_mut());
static LENGTH: AtomicUsize = AtomicUsize::new(0);

/// Called by every module that has counters; one linked program has one table of them, told many times.
///
/// # Safety
/// Called by code that the compiler makes, with the bounds of the table.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn __sanitizer_cov_8bit_counters_init(start: *mut u8, stop: *mut u8) {
    START.store(start, Ordering::Relaxed);
    LENGTH.store((stop as usize).saturating_sub(start as usize), Ordering::Relaxed);
}

/// Counters that are looked at together.
const CHUNK: usize = 64;

/// Edges and classes of counts that were seen.
#[derive(Default)]
pub(crate) struct Seen(Vec<u8>);

impl Seen {
    /// Takes what was counted since the last call and sets the counters to zero; the number of edges seen for the first
    /// time with such a count.
    pub(crate) fn take(&mut self) -> usize {
        let start = START.load(Ordering::Relaxed);
        if start.is_null() {
            return 0;
        }
        let length = LENGTH.load(Ordering::Relaxed);
        self.0.resize(length, 0);
        let mut new = 0;
        for (chunk, seen) in self.0.chunks_mut(CHUNK).enumerate() {
            let mut counts = [0; CHUNK];
            // SAFETY: `seen` is as long as what is left of the table of counters, which lives as long as the program;
            // counters are plain bytes that only instrumented code adds to: none of it runs here but the watch, whose
            // few counts may be lost.
            unsafe {
                let place = start.add(chunk * CHUNK);
                place.copy_to_nonoverlapping(counts.as_mut_ptr(), seen.len());
                // Nearly all are zero.
                if counts == [0; CHUNK] {
                    continue;
                }
                place.write_bytes(0, seen.len());
            }
            for (seen, count) in seen.iter_mut().zip(counts) {
                let class = class(count);
                if class & !*seen != 0 {
                    *seen |= class;
                    new += 1;
                }
            }
        }
        new
    }

    /// True if there are counters.
    pub(crate) fn are_counted() -> bool {
        LENGTH.load(Ordering::Relaxed) > 0
    }

    /// Edges that were seen at all, and all edges.
    pub(crate) fn edges(&self) -> (usize, usize) {
        (self.0.iter().filter(|seen| **seen != 0).count(), self.0.len())
    }
}

/// One bit for each class of counts; none for a count of zero.
fn class(count: u8) -> u8 {
    match count {
        0 => 0,
        1 => 1,
        2 => 2,
        3 => 4,
        4..8 => 8,
        8..16 => 16,
        16..32 => 32,
        32..128 => 64,
        128.. => 128,
    }
}
