//! Time for measurements: CPU seconds of this process, and seconds on the wall for what is too short to ask the system.
//!
//! CPU time compares runs on a busy machine; where the system does not tell it, wall time stands in.

use std::sync::OnceLock;
use std::time::Instant;

/// Seconds since an arbitrary origin.
pub fn cpu_seconds() -> f64 {
    process_time().unwrap_or_else(wall_seconds)
}

/// Seconds on the wall since an arbitrary origin; asking takes some ten nanoseconds, less than an evaluation of a small system.
pub fn wall_seconds() -> f64 {
    static ORIGIN: OnceLock<Instant> = OnceLock::new();
    ORIGIN.get_or_init(Instant::now).elapsed().as_secs_f64()
}

#[cfg(unix)]
fn process_time() -> Option<f64> {
    let time = nix::time::clock_gettime(nix::time::ClockId::CLOCK_PROCESS_CPUTIME_ID).ok()?;
    Some(time.tv_sec() as f64 + time.tv_nsec() as f64 * 1e-9)
}

#[cfg(not(unix))]
fn process_time() -> Option<f64> {
    None
}
