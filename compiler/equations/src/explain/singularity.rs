//! Which expression of the text is about to lose its value: a divisor, or the argument of a root or logarithm, that approaches zero.
//!
//! Of a run that failed the values at the start and at the last point are known.  All divisors and arguments of that kind that vary are
//! evaluated at both; one that has shrunk to a small part of what it was, or has changed its sign, is what the run approached.  Those
//! in equations of the variable at fault come first.

use hyd_flat::{FlatModel, Operand, Section, Target};
use hyd_index::TypedIndex;
use hyd_source::Span;
use hyd_symbolic::{Evaluator, Node, NodeId, SlotId, Template, post_order, slots};
use hyd_system::Variability;
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

use crate::explain::faults::variable_of;

/// An expression approaches zero when it is this part of its value at the start.
const SMALL: f64 = 1e-3;
/// Larger models are looked at only where the variable at fault occurs.
const MOST_EQUATIONS: usize = 5_000;
/// Most that are told.
const MOST: usize = 2;

/// An expression that approached zero.
#[derive(Clone, PartialEq, Debug)]
pub struct Approach {
    /// What it is: "`gap` is divided by".
    pub what: String,
    /// Its values at the start and at the last point.
    pub before: f64,
    /// See `before`.
    pub now: f64,
    /// Where its equation stands.
    pub span: Span,
}

/// What an expression is for.
#[derive(Clone, Copy)]
enum Use {
    Divisor,
    Root,
    Logarithm,
    Power,
}

/// The expressions that approached zero on the way from row 0 to the last of `rows`, the most likely first.  `value` gives the value of
/// a variable or derivative by its name, `times` the time of each row (s).
pub fn approaches(
    flat: &FlatModel,
    variable: Option<&str>,
    times: &[f64],
    value: &dyn Fn(usize, &str) -> Option<f64>,
) -> Vec<Approach> {
    let Some(last) = times.len().checked_sub(1).filter(|last| *last > 0) else { return Vec::new() };
    let all: usize = flat.equations.iter().map(|block| block.count as usize).sum();
    let mut known: FxHashMap<(usize, String), f64> = FxHashMap::default();
    let mut found: Vec<(bool, f64, Approach)> = Vec::new();
    for block in flat.equations.iter().filter(|block| block.section == Section::Continuous) {
        let template = flat.templates.get(block.template);
        let uses = uses(flat, &template);
        if uses.is_empty() {
            continue;
        }
        for k in 0..block.count as usize {
            let operands = block.operands_of(k, template.arity as usize);
            let names = operands.iter().filter_map(|operand| variable_of(operand.target())).map(|v| flat.var_name(v));
            let touches = variable.is_some_and(|variable| names.into_iter().any(|name| name == variable));
            if !touches && all > MOST_EQUATIONS {
                continue;
            }
            for &(use_of, node) in &uses {
                if !varies(flat, node, operands) {
                    continue;
                }
                let mut at = |row: usize| {
                    let read = |operand: Operand, known: &mut FxHashMap<(usize, String), f64>| {
                        let name = match operand.target() {
                            Target::Var(v) => flat.var_name(v),
                            Target::Der(v) => format!("der({})", flat.var_name(v)),
                            Target::Const(c) => return signed(flat.constants[c], operand),
                            _ => return f64::NAN,
                        };
                        let own = known.entry((row, name.clone()));
                        signed(*own.or_insert_with(|| value(row, &name).unwrap_or(f64::NAN)), operand)
                    };
                    let mut values = vec![f64::NAN; operands.len()];
                    for slot in slots(&flat.templates.arena, &[node]) {
                        values[slot.index()] = read(operands[slot.index()], &mut known);
                    }
                    let slot = |slot: SlotId| values[slot.index()];
                    Evaluator::new(&flat.templates.arena, &[node]).evaluate(slot, times[row], false)[0]
                };
                let (before, now) = (at(0), at(last));
                let crossed = before * now < 0.0;
                let shrunk = now.abs() <= SMALL * before.abs();
                if !before.is_finite() || !now.is_finite() || before == 0.0 || !(crossed || shrunk) {
                    continue;
                }
                let text = flat.written_sides(&Template { left: node, right: node, ..template }, operands).0;
                let what = match use_of {
                    Use::Divisor => format!("`{text}` is divided by"),
                    Use::Root => format!("the square root of `{text}` is taken"),
                    Use::Logarithm => format!("the logarithm of `{text}` is taken"),
                    Use::Power => format!("`{text}` is the base of a power"),
                };
                let span = block.origin.span;
                let ratio = (now / before).abs();
                found.push((!touches, ratio, Approach { what, before, now, span }));
            }
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut told: Vec<Approach> = Vec::new();
    for (_, _, approach) in found {
        if told.len() < MOST && told.iter().all(|known| known.what != approach.what) {
            told.push(approach);
        }
    }
    told
}

fn signed(value: f64, operand: Operand) -> f64 {
    if operand.negated() { -value } else { value }
}

/// Divisors and arguments of roots and logarithms in both sides.
fn uses(flat: &FlatModel, template: &Template) -> Vec<(Use, NodeId)> {
    let arena = &flat.templates.arena;
    let is_whole = |node: NodeId| arena.as_constant(node).is_some_and(|power| power >= 0.0 && power.fract() == 0.0);
    let mut found: Vec<(Use, NodeId)> = Vec::new();
    for id in post_order(arena, &[template.left, template.right]) {
        let used = match arena.node(id) {
            Node::Div(_, divisor) => (Use::Divisor, divisor),
            Node::Call1(Function::Sqrt, argument) => (Use::Root, argument),
            Node::Call1(Function::Log | Function::Log10, argument) => (Use::Logarithm, argument),
            Node::Call2(Function::Pow, base, power) if !is_whole(power) => (Use::Power, base),
            _ => continue,
        };
        if !found.iter().any(|(_, known)| *known == used.1) {
            found.push(used);
        }
    }
    found
}

/// Whether an expression reads something that changes during the run.
fn varies(flat: &FlatModel, node: NodeId, operands: &[Operand]) -> bool {
    let arena = &flat.templates.arena;
    let is_time = post_order(arena, &[node]).into_iter().any(|id| arena.node(id) == Node::Time);
    let changes = |slot: SlotId| match operands[slot.index()].target() {
        Target::Var(v) => flat.variables[flat.locate(v).0].variability > Variability::Parameter,
        Target::Der(_) => true,
        _ => false,
    };
    is_time || slots(arena, &[node]).into_iter().any(changes)
}
