//! Derivatives in a clocked partition: rates that a method of one step integrates from tick to tick (Modelica 3.6, section 16.8).
//!
//! `der(x)` becomes a clocked variable `r`.  With the explicit method of Euler the value at a tick follows from the tick before,
//! `x = previous(x) + interval()*previous(r)`; with the implicit one from itself, `x = previous(x) + interval()*r`; with the trapezoidal
//! rule from both.  At the first tick `x` has its start value: the rate from before is 0 there, and the interval of the implicit methods is.

use hyd_flat::{FlatModel, Operand, Target, VarId};
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{NodeId, Relation};
use hyd_system::ValueKind;
use rustc_hash::FxHashMap;

use crate::assignment::Row;
use crate::equations::{Slots, variable};
use crate::operators::interval;
use crate::ticks::{Tick, Ticks};

#[derive(Clone, Copy, PartialEq)]
enum Method {
    Explicit,
    Implicit,
    Trapezoid,
}

/// Takes derivatives out of clocked equations, with rows of their own that integrate them; the rates.
pub(crate) fn discretise(
    flat: &mut FlatModel,
    ticks: &Ticks,
    rows: &mut Vec<Row>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<VarId> {
    let mut rates: FxHashMap<VarId, VarId> = FxHashMap::default();
    for at in 0..rows.len() {
        for k in 0..rows[at].operands.len() {
            let operand = rows[at].operands[k];
            let Target::Der(v) = operand.target() else { continue };
            let Some(tick) = ticks.of(rows[at].partition).cloned() else { continue };
            let rate = match rates.get(&v) {
                Some(&known) => known,
                None => {
                    let origin = flat.equations[rows[at].block as usize].origin.clone();
                    let method = match ticks.methods[rows[at].partition].as_deref() {
                        Some("ExplicitEuler") => Method::Explicit,
                        Some("ImplicitEuler") => Method::Implicit,
                        Some("ImplicitTrapezoid") => Method::Trapezoid,
                        other => {
                            diagnostics.push(no_method(flat, v, other).at(origin.span, ""));
                            return Vec::new();
                        }
                    };
                    let rate = variable(flat, format!("der({})", flat.var_name(v)), ValueKind::Real, &origin);
                    rates.insert(v, rate);
                    let row = integrated(flat, (v, rate), &tick, method, &rows[at].clone());
                    rows.push(row);
                    rate
                }
            };
            rows[at].operands[k] = Operand::new(Target::Var(rate)).signed(operand.negated());
        }
    }
    let mut made: Vec<VarId> = rates.into_values().collect();
    made.sort_unstable();
    made
}

fn no_method(flat: &FlatModel, v: VarId, method: Option<&str>) -> Diagnostic {
    let name = flat.var_name(v);
    match method {
        Some(method) => {
            let message = format!("the solver method `{method}` of the clock of `{name}` is not supported");
            Diagnostic::error(Code::OutsideProfile, message)
                .help("there are \"ExplicitEuler\", \"ImplicitEuler\" and \"ImplicitTrapezoid\"")
        }
        None => {
            let message = format!("`{name}` has a clock and is differentiated, but its clock has no solver method");
            Diagnostic::error(Code::Clock, message)
                .help("`Clock(Clock(0.1), solverMethod = \"ExplicitEuler\")` has one")
        }
    }
}

/// The equation that gives `v` its next value.
fn integrated(flat: &mut FlatModel, (v, rate): (VarId, VarId), tick: &Tick, method: Method, of: &Row) -> Row {
    let mut slots = Slots::default();
    let step = interval(flat, &mut slots, tick);
    let (start, now) = (slots.read(flat, Target::Pre(v)), slots.read(flat, Target::Var(rate)));
    let before = slots.read(flat, Target::Pre(rate));
    let count = slots.read(flat, Target::Pre(tick.count));
    let arena = &mut flat.templates.arena;
    let (half, zero) = (arena.constant(0.5), arena.constant(0.0));
    let mean = |arena: &mut hyd_symbolic::Arena, a: NodeId, b: NodeId| {
        let both = arena.add(a, b);
        arena.mul(half, both)
    };
    let slope = match method {
        Method::Explicit => before,
        Method::Implicit => now,
        Method::Trapezoid => mean(arena, before, now),
    };
    let first = arena.compare(Relation::Less, count, half);
    let step = arena.select(first, zero, step);
    let way = arena.mul(step, slope);
    let value = arena.add(start, way);
    let left = slots.read(flat, Target::Var(v));
    Row::made(flat, left, value, &slots.0, of)
}
