//! Symbolic expressions: build, print, simplify, differentiate, solve.
//!
//! One idea per file.  [`node`](Arena) is the table of operations, in which equal expressions are the same entry;
//! everything else reads it or adds to it.  [`post_order`] is the order all passes work in.  Constructors on
//! [`Arena`] (`add`, `mul`, `call1`, ...; [`simplify`]) keep expressions small as they are built.  [`eval`] gives
//! values, [`partial`] and [`gradient`] derivatives, [`solve_for`] isolates a slot, [`alias`] recognises trivial
//! equations, [`rewrite`] and [`canonical`] change and normalise, [`slots`] and its neighbours look inside, and
//! [`print()`] shows the result.  The crate knows nothing of models: what stands in a slot is the caller's affair.
//!
//! # Tutorial
//!
//! An orifice: the flow `q` follows from the pressure difference by `q = k*sqrt(p1 - p2)`.
//!
//! ```
//! use hyd_symbolic::{Arena, Function, SlotId, canonical, eval, gradient, print, print_template, solve_for};
//!
//! let mut arena = Arena::new();
//! let [q, k, p1, p2] = [0, 1, 2, 3].map(|slot| arena.slot(SlotId(slot)));
//! let difference = arena.sub(p1, p2);
//! let root = arena.call1(Function::Sqrt, difference);
//! let flow = arena.mul(k, root);
//!
//! // Names live outside; the same expression prints under any.
//! let name = |slot: SlotId| ["q", "k", "p1", "p2"][slot.0 as usize].to_string();
//! assert_eq!(print(&arena, flow, &name), "k*sqrt(p1 - p2)");
//!
//! // Equal expressions are the same node, however they came about.
//! let zero = arena.constant(0.0);
//! let again = arena.add(flow, zero);
//! assert_eq!(again, flow);
//!
//! // Values and derivatives.
//! let values = |slot: SlotId| [0.0, 2.0, 10.0, 1.0][slot.0 as usize];
//! assert_eq!(eval(&arena, flow, values, 0.0, false), 6.0);
//! let slopes: Vec<String> = gradient(&mut arena, flow)
//!     .into_iter()
//!     .map(|(slot, derivative)| format!("d/d{} = {}", name(slot), print(&arena, derivative, &name)))
//!     .collect();
//! assert_eq!(
//!     slopes,
//!     ["d/dk = sqrt(p1 - p2)", "d/dp1 = k*(0.5/sqrt(p1 - p2))", "d/dp2 = -k*(0.5/sqrt(p1 - p2))"]
//! );
//!
//! // The equation is linear in k, not in p1.
//! let solution = solve_for(&mut arena, q, flow, SlotId(1)).expect("linear in k");
//! assert_eq!(print(&arena, solution.value, &name), "q/sqrt(p1 - p2)");
//! assert_eq!(solution.divisors, [root]);
//! assert_eq!(solve_for(&mut arena, q, flow, SlotId(2)), None);
//!
//! // As a template: slots numbered in reading order, with the list of what they were.
//! let (template, old) = canonical(&mut arena, flow, q);
//! assert_eq!(print_template(&arena, &template, &|slot| format!("{slot}")), "s0*sqrt(s1 - s2) = s3");
//! assert_eq!(old, [SlotId(1), SlotId(2), SlotId(3), SlotId(0)]);
//! ```

mod alias;
mod body;
mod body_derivative;
mod derivative;
mod eval;
mod ignored;
mod machine;
mod node;
mod occurs;
mod order;
mod print;
mod simplify;
mod solve;
mod substitute;

#[cfg(test)]
mod tests;

pub use alias::{alias, constant_value};
pub use body::{Body, BodyOutput, Derivative, Step};
pub use derivative::{gradient, partial, partial_time, tangent, time_derivative};
pub use eval::{Evaluator, eval, operate};
pub use hyd_system::math::Function;
pub use ignored::without_ignored;
pub use machine::{Limits, MACHINE_LIMITS, Machine};
pub use node::{Arena, BodyId, Node, NodeId, Number, Relation, SlotId, Template, TemplateId, Templates};
pub use occurs::{
    contains, contains_event, contains_homotopy, contains_initial, contains_slot, contains_time, cost, size, slots,
};
pub use order::post_order;
pub use print::{LONGEST_TEXT, format_number, print, print_signed, print_template};
pub use simplify::simplify;
pub use solve::{Solution, isolate, solve_for};
pub use substitute::{canonical, renumber, replace_below, rewrite, substitute, substitute_one};
