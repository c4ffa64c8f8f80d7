//! Clocks of a flat model: clocked equations become discrete equations that hold at ticks (Modelica 3.6, chapter 16).
//!
//! Variables that share an equation share a clock; what the operators of clocks relate are such *partitions* ([`partition`]).  Their
//! rates follow from the clocks that the text constructs and from the operators between them, exact in integers ([`rates`]).  Rates of
//! one base share one event per instant, so clocks that tick together do so in the same pass of the same event ([`ticks`]).  Within a
//! partition it is found out which equation determines which variable; `v = e` then holds at its ticks, and between them `v` keeps its
//! value: `v = if tick then e else pre(v)` ([`assignment`]).  Derivatives in a clocked partition are those of a method of one step
//! ([`discretised`]).  What comes after this stage knows no clocks.

mod assignment;
mod discretised;
mod equations;
mod operators;
mod partition;
mod rates;
mod ratio;
mod ticks;

use hyd_flat::FlatModel;
use hyd_source::{Diagnostic, Outcome, Severity};

use crate::partition::Partitions;

/// The same model without clocks; a model that has none as it is.  Where a clock cannot be found out the model stays as far as it came, with
/// messages.
pub fn resolve_clocks(mut flat: FlatModel) -> Outcome<FlatModel> {
    let mut diagnostics = Vec::new();
    if !flat.clocks.is_empty() {
        resolve(&mut flat, &mut diagnostics);
        flat.clocks.clear();
        flat.clocked.clear();
    }
    Outcome { value: flat, diagnostics }
}

fn resolve(flat: &mut FlatModel, diagnostics: &mut Vec<Diagnostic>) {
    let partitions = Partitions::of(flat);
    diagnostics.extend(partitions.faults(flat));
    let failed = |found: &[Diagnostic]| found.iter().any(|own| own.severity == Severity::Error);
    if failed(diagnostics) {
        return;
    }
    let rates = rates::infer(flat, &partitions, diagnostics);
    if failed(diagnostics) {
        return;
    }
    let mut rows = assignment::take_out(flat, &partitions);
    let ticks = ticks::make(flat, &partitions, &rates);
    let derivatives = discretised::discretise(flat, &ticks, &mut rows, diagnostics);
    operators::relate(flat, &partitions, &ticks);
    assignment::assign(flat, &partitions, &ticks, (&rows, &derivatives), diagnostics);
}
