//! Derivatives of bodies, by carrying a tangent beside every register that varies.
//!
//! Forward mode on the steps themselves (Griewank and Walther 2008, "Evaluating Derivatives", section 3.1): the derived
//! body takes the arguments and then their derivatives, and gives the outputs and then theirs; branches and loops follow
//! the values.  Which registers vary is found by propagation to a fixed point.  A derivative that the author gives is
//! called instead.  Deriving a derived body gives the second derivative.

use std::sync::Arc;

use crate::body::{Body, BodyOutput, Step};
use crate::derivative::{Along, tangent};
use crate::node::{Arena, BodyId, Node, NodeId, SlotId};
use crate::occurs::slots;
use crate::substitute::renumber;

/// The derivative of an output of a call along the rates of its arguments; none if it is 0.
pub(crate) fn apply(
    arena: &mut Arena,
    (body, output): (BodyId, u32),
    along: Along,
    arguments: &[NodeId],
    rates: &[Option<NodeId>],
) -> Option<NodeId> {
    let zero = arena.constant(0.0);
    let rate = |k: u32| rates.get(k as usize).copied().flatten();
    let given = arena.body(body).derivatives.iter().find(|given| {
        let chained = given.chained.iter().all(|&(x, dx)| rate(x) == arguments.get(dx as usize).copied());
        chained && given.constant.iter().all(|&k| rate(k).is_none()) && (along == Along::Time || !given.along_time)
    });
    if let Some(given) = given {
        let (target, of) = (given.body, given.of.clone());
        if given.chained.is_empty() && of.iter().all(|&k| rate(k).is_none()) {
            return None;
        }
        let mut all = arguments.to_vec();
        all.extend(of.iter().map(|&k| rate(k).unwrap_or(zero)));
        let list = arena.argument_list(&all);
        return Some(arena.apply(target, output, list));
    }
    let real = arena.body(body).real_inputs.clone();
    if real.iter().zip(rates).all(|(&real, rate)| !real || rate.is_none()) {
        return None;
    }
    let derived = derive(arena, body);
    let shifted = arena.body(body).outputs.len() as u32 + output;
    if arena.body(derived).outputs.get(shifted as usize).is_some_and(|o| o.zero) {
        return None;
    }
    let mut all = arguments.to_vec();
    all.extend(real.iter().zip(rates).filter(|(real, _)| **real).map(|(_, rate)| rate.unwrap_or(zero)));
    let list = arena.argument_list(&all);
    Some(arena.apply(derived, shifted, list))
}

/// Where registers of the original stand in the derived body: arguments first, then the rates of the real ones, then the
/// other registers, then one rate for every original register.
struct Plan {
    inputs: u32,
    rates: u32,
    registers: u32,
    varies: Vec<bool>,
}

impl Plan {
    fn value(&self, r: u32) -> u32 {
        if r < self.inputs { r } else { r + self.rates }
    }

    fn rate(&self, r: u32) -> u32 {
        self.registers + self.rates + r
    }
}

/// The body that computes outputs and their derivatives.
fn derive(arena: &mut Arena, id: BodyId) -> BodyId {
    if let Some(&known) = arena.derived.get(&id) {
        return known;
    }
    let body = arena.body(id).clone();
    let rates = body.real_inputs.iter().filter(|&&real| real).count() as u32;
    let mut real_inputs = body.real_inputs.clone();
    real_inputs.extend(std::iter::repeat_n(true, rates as usize));
    let name: Arc<str> = format!("der_{}", body.name).into();
    let derived = arena.reserve_body(name.clone(), real_inputs.clone());
    arena.derived.insert(id, derived);
    let plan = Plan { inputs: body.inputs, rates, registers: body.registers, varies: varying(arena, &body) };
    let output = |o: &BodyOutput, register: u32, prefix: &str, zero: bool| BodyOutput {
        name: format!("{prefix}{}", o.name).into(),
        register,
        zero,
    };
    let mut outputs: Vec<BodyOutput> =
        body.outputs.iter().map(|o| output(o, plan.value(o.register), "", o.zero)).collect();
    outputs.extend(
        body.outputs.iter().map(|o| output(o, plan.rate(o.register), "der_", !plan.varies[o.register as usize])),
    );
    let empty = Body {
        name,
        inputs: body.inputs + rates,
        real_inputs,
        registers: 2 * body.registers + rates,
        steps: Vec::new(),
        outputs,
        derivatives: Vec::new(),
    };
    // Known before its steps are, so that a function that calls itself finds it.
    arena.set_body(derived, empty.clone());
    let mut steps = Vec::new();
    let real = (0..body.inputs).filter(|&k| body.real_inputs[k as usize]);
    for (k, source) in real.zip(body.inputs..) {
        let source = arena.slot(SlotId(source));
        steps.push(Step::Set(plan.rate(k), source));
    }
    steps.extend(derive_steps(arena, &body.steps, &plan));
    arena.set_body(derived, Body { steps, ..empty });
    derived
}

/// Which registers may vary with the real arguments.
fn varying(arena: &Arena, body: &Body) -> Vec<bool> {
    let mut varies = vec![false; body.registers as usize];
    varies[..body.real_inputs.len()].copy_from_slice(&body.real_inputs);
    loop {
        let before = varies.clone();
        let mut todo: Vec<&[Step]> = vec![&body.steps];
        while let Some(steps) = todo.pop() {
            for step in steps {
                spread(arena, step, &mut varies);
                todo.extend(step.inner());
            }
        }
        if varies == before {
            return varies;
        }
    }
}

fn spread(arena: &Arena, step: &Step, varies: &mut [bool]) {
    let depends = |varies: &[bool], node: NodeId| slots(arena, &[node]).iter().any(|slot| varies[slot.0 as usize]);
    let range = |first: u32, count: u32| first as usize..(first + count) as usize;
    match step {
        Step::Set(to, node) => varies[*to as usize] |= depends(varies, *node),
        Step::Load { to, first, count, .. } => {
            let any = varies[range(*first, *count)].contains(&true);
            varies[range(*first, *count)].fill(any);
            varies[*to as usize] |= any;
        }
        Step::Store { first, count, value, .. } => {
            let any = varies[range(*first, *count)].contains(&true) || depends(varies, *value);
            varies[range(*first, *count)].fill(any);
        }
        Step::Call { arguments, results, .. } => {
            if arguments.iter().any(|&argument| depends(varies, argument)) {
                results.iter().for_each(|&to| varies[to as usize] = true);
            }
        }
        Step::If(..) | Step::Loop(_) | Step::Break | Step::Return | Step::Check(..) => {}
    }
}

fn derive_steps(arena: &mut Arena, steps: &[Step], plan: &Plan) -> Vec<Step> {
    let mut new = Vec::new();
    for step in steps {
        derive_step(arena, step, plan, &mut new);
    }
    new
}

/// An expression over the registers of the derived body.
fn moved(arena: &mut Arena, node: NodeId, plan: &Plan) -> NodeId {
    renumber(arena, node, &|slot| SlotId(plan.value(slot.0)))
}

/// The derivative of an expression over the registers of the derived body.
fn rate_of(arena: &mut Arena, node: NodeId, plan: &Plan) -> NodeId {
    let there = moved(arena, node, plan);
    let mut rates = Vec::new();
    for slot in slots(arena, &[node]) {
        if plan.varies[slot.0 as usize] {
            rates.push((SlotId(plan.value(slot.0)), arena.slot(SlotId(plan.rate(slot.0)))));
        }
    }
    tangent(arena, there, |leaf| match leaf {
        Node::Slot(slot) => rates.iter().find(|(s, _)| *s == slot).map(|(_, rate)| *rate),
        _ => None,
    })
}

/// The step on rates, then the step itself: an expression may read the register it is stored to.
fn derive_step(arena: &mut Arena, step: &Step, plan: &Plan, new: &mut Vec<Step>) {
    match step {
        Step::Set(to, node) => {
            if plan.varies[*to as usize] {
                let rate = rate_of(arena, *node, plan);
                new.push(Step::Set(plan.rate(*to), rate));
            }
            new.push(Step::Set(plan.value(*to), moved(arena, *node, plan)));
        }
        Step::Load { to, first, count, index } => {
            let index = moved(arena, *index, plan);
            if plan.varies[*first as usize] {
                new.push(Step::Load { to: plan.rate(*to), first: plan.rate(*first), count: *count, index });
            } else if plan.varies[*to as usize] {
                new.push(Step::Set(plan.rate(*to), arena.constant(0.0)));
            }
            new.push(Step::Load { to: plan.value(*to), first: plan.value(*first), count: *count, index });
        }
        Step::Store { first, count, index, value } => {
            let index = moved(arena, *index, plan);
            if plan.varies[*first as usize] {
                let value = rate_of(arena, *value, plan);
                new.push(Step::Store { first: plan.rate(*first), count: *count, index, value });
            }
            let value = moved(arena, *value, plan);
            new.push(Step::Store { first: plan.value(*first), count: *count, index, value });
        }
        Step::Call { body, arguments, results } => derive_call(arena, *body, arguments, results, plan, new),
        Step::If(condition, yes, no) => {
            let condition = moved(arena, *condition, plan);
            let (yes, no) = (derive_steps(arena, yes, plan), derive_steps(arena, no, plan));
            new.push(Step::If(condition, yes, no));
        }
        Step::Loop(steps) => {
            let steps = derive_steps(arena, steps, plan);
            new.push(Step::Loop(steps));
        }
        Step::Check(condition, text) => new.push(Step::Check(moved(arena, *condition, plan), text.clone())),
        Step::Break => new.push(Step::Break),
        Step::Return => new.push(Step::Return),
    }
}

fn derive_call(
    arena: &mut Arena,
    body: BodyId,
    arguments: &[NodeId],
    results: &[u32],
    plan: &Plan,
    new: &mut Vec<Step>,
) {
    let zero = arena.constant(0.0);
    let values: Vec<NodeId> = arguments.iter().map(|&argument| moved(arena, argument, plan)).collect();
    let rates: Vec<NodeId> = arguments.iter().map(|&argument| rate_of(arena, argument, plan)).collect();
    let to_values: Vec<u32> = results.iter().map(|&r| plan.value(r)).collect();
    let to_rates: Vec<u32> = results.iter().map(|&r| plan.rate(r)).collect();
    if rates.iter().all(|&rate| rate == zero) {
        new.push(Step::Call { body, arguments: values, results: to_values });
        new.extend(to_rates.into_iter().map(|to| Step::Set(to, zero)));
        return;
    }
    let usable = |constant: &[u32]| constant.iter().all(|&k| rates.get(k as usize) == Some(&zero));
    let mut all = arena.body(body).derivatives.iter();
    let given = all.find(|d| d.chained.is_empty() && !d.along_time && usable(&d.constant)).cloned();
    if let Some(given) = given {
        let mut all = values.clone();
        all.extend(given.of.iter().map(|&k| rates[k as usize]));
        new.push(Step::Call { body: given.body, arguments: all, results: to_rates });
        new.push(Step::Call { body, arguments: values, results: to_values });
        return;
    }
    let derived = derive(arena, body);
    let real = arena.body(body).real_inputs.clone();
    let mut all = values;
    all.extend(real.iter().zip(&rates).filter(|(real, _)| **real).map(|(_, rate)| *rate));
    let results = to_values.into_iter().chain(to_rates).collect();
    new.push(Step::Call { body: derived, arguments: all, results });
}
