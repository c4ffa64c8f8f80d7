//! The library of every unit: the C functions of FMI 2.0 and 3.0 over a model that it reads from the resources of the unit.
//!
//! It is made once, with the workspace; `hyd build --fmu` puts a copy into each archive.  `core` is the unit itself, in safe Rust;
//! `fmi2` and `fmi3` are its faces, and `boundary` is what they share: handles, slices from outside, messages, and the rule that no panic
//! leaves.  There is no global state: an instance is what its handle points to.

mod boundary;
mod core;
mod derivatives;
mod exchange;
mod fault;
pub mod fmi2;
pub mod fmi3;
pub mod fmi3_refused;
mod load;
mod saved;
mod stepping;
mod values;

/// By this `hyd build` knows which payloads the library reads.
#[used]
static MARK: [u8; hyd_payload::executable::LIBRARY_MARK.len()] = {
    let mut mark = [0; hyd_payload::executable::LIBRARY_MARK.len()];
    mark.copy_from_slice(hyd_payload::executable::LIBRARY_MARK);
    mark
};
