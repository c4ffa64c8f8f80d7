//! Which expression of the text is about to lose its value: a divisor, or the argument of a root or logarithm, that approaches zero.
//!
//! Of a run that failed the values at the start and at the last point are known.  All divisors and arguments of that kind that vary are
//! evaluated at both; one that has shrunk to a small part of what it was, or has changed its sign, is what the run approached.  So are
//! conditions that cause no event (`sign`, `noEvent`) where their two sides come together, and the slope of an equation with
//! respect to the algebraic variable at fault, which vanishes where two solutions meet or one goes to infinity.  Those in equations of the variable at
//! fault come first.

use hyd_flat::{FlatModel, Operand, Section, Target};
use hyd_index::TypedIndex;
use hyd_source::Span;
use hyd_symbolic::{Evaluator, Node, NodeId, SlotId, Template, Templates, partial, post_order, slots};
use hyd_system::Variability;
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

use crate::explain::faults::variable_of;

/// An expression approaches zero when it is this part of its value at the start.
const SMALL: f64 = 1e-3;
/// Larger models are looked at only where the variable at fault occurs.
const MOST_EQUATIONS: usize = 5_000;
/// Most that are listed.
const MOST: usize = 2;

/// An expression that approached zero.
#[derive(Clone, PartialEq, Debug)]
pub struct Approach {
    /// What it is, to be followed by what approaches zero: "`gap` is divided by, and it".
    pub what: String,
    /// Its values at the start and at the last point.
    pub before: f64,
    /// See `before`.
    pub now: f64,
    /// Its values at the points between, the last steps.
    pub recent: Vec<f64>,
    /// Where its equation stands.
    pub span: Span,
    /// How it may be written where it does go on beyond zero.
    pub beyond: Option<String>,
}

/// What an expression is for.
#[derive(Clone, Copy)]
enum Use {
    Divisor,
    Root,
    Logarithm,
    Power,
    /// Both sides of a condition, or what `sign` is taken of.
    Jump,
    /// The slope of the equation with respect to the variable at fault.
    Slope,
}

/// An expression, or the difference of two.
#[derive(Clone, Copy)]
struct Watched {
    use_of: Use,
    node: NodeId,
    minus: Option<NodeId>,
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
    // Slopes are made, and the model stays what it is.
    let mut templates = flat.templates.clone();
    let all: usize = flat.equations.iter().map(|block| block.count as usize).sum();
    let mut known: FxHashMap<(usize, String), f64> = FxHashMap::default();
    let mut found: Vec<(bool, f64, Approach)> = Vec::new();
    for block in flat.equations.iter().filter(|block| block.section == Section::Continuous) {
        let template = templates.get(block.template);
        let uses = uses(&templates, &template);
        if uses.is_empty() && variable.is_none() {
            continue;
        }
        for k in 0..block.count as usize {
            let operands = block.operands_of(k, template.arity as usize);
            let names = operands.iter().filter_map(|operand| variable_of(operand.target())).map(|v| flat.var_name(v));
            let touches = variable.is_some_and(|variable| names.into_iter().any(|name| name == variable));
            if !touches && all > MOST_EQUATIONS {
                continue;
            }
            let mut uses = uses.clone();
            if let Some(variable) = variable.filter(|_| touches) {
                uses.extend(slope(flat, &mut templates, &template, operands, variable));
            }
            for &Watched { use_of, node, minus } in &uses {
                if ![Some(node), minus].into_iter().flatten().any(|node| varies(flat, &templates, node, operands)) {
                    continue;
                }
                let roots: Vec<NodeId> = [Some(node), minus].into_iter().flatten().collect();
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
                    for slot in slots(&templates.arena, &roots) {
                        values[slot.index()] = read(operands[slot.index()], &mut known);
                    }
                    let slot = |slot: SlotId| values[slot.index()];
                    let mut evaluator = Evaluator::new(&templates.arena, &roots);
                    let found = evaluator.evaluate(slot, times[row], false);
                    found[0] - found.get(1).copied().unwrap_or(0.0)
                };
                let (before, now) = (at(0), at(last));
                let crossed = before * now < 0.0;
                let shrunk = now.abs() <= SMALL * before.abs();
                if !before.is_finite() || !now.is_finite() || before == 0.0 || !(crossed || shrunk) {
                    continue;
                }
                let (text, other) = match use_of {
                    // The slope is not in the text, but its equation is.
                    Use::Slope => flat.written_sides(&template, operands),
                    _ => {
                        flat.written_sides(&Template { left: node, right: minus.unwrap_or(node), ..template }, operands)
                    }
                };
                let what = match use_of {
                    Use::Jump if minus.is_some() => {
                        format!("`{text}` is compared with `{other}` without an event, and their difference")
                    }
                    Use::Jump => format!("`sign({text})` jumps without an event where `{text}`"),
                    Use::Slope => {
                        let name = variable.unwrap_or_default();
                        format!("`{text} = {other}` no longer determines `{name}`: its slope with respect to it")
                    }
                    Use::Divisor => format!("`{text}` is divided by, and it"),
                    Use::Root => format!("the square root of `{text}` is taken, and it"),
                    Use::Logarithm => format!("the logarithm of `{text}` is taken, and it"),
                    Use::Power => format!("`{text}` is the base of a power, and it"),
                };
                // A law that holds in both directions is the usual meaning.
                let beyond = match use_of {
                    Use::Power => Some(format!(
                        "if it should also hold for negative values, write `sign(x)*abs(x)^n` for `x^n`, with `{text}` for `x`"
                    )),
                    Use::Root if is_stored(flat, &templates, node, operands) => Some(format!(
                        "if it is used up here, let what takes from it end, as in `if {text} > 0 then ... else 0`"
                    )),
                    Use::Divisor => Some(format!(
                        "if the run is to go on, bound it, as in `{}({text}, limit)` with the value closest to zero that is meant",
                        if before > 0.0 { "max" } else { "min" }
                    )),
                    Use::Root => Some(format!(
                        "if it should also hold for negative values, write `sign(x)*sqrt(abs(x))` for `sqrt(x)`, with `{text}` for `x`"
                    )),
                    _ => None,
                };
                let recent = (1..last).map(&mut at).collect();
                let span = block.origin.span;
                let ratio = (now / before).abs();
                found.push((!touches, ratio, Approach { what, before, now, recent, span, beyond }));
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

/// True for an expression without a sum or difference whose variables are states: what drives a flow may change its direction, what is stored is used up.
fn is_stored(flat: &FlatModel, templates: &Templates, node: NodeId, operands: &[Operand]) -> bool {
    let arena = &templates.arena;
    if post_order(arena, &[node]).into_iter().any(|id| matches!(arena.node(id), Node::Add(..) | Node::Sub(..))) {
        return false;
    }
    let is_state = |v: hyd_flat::VarId| {
        let mut all = flat.equations.iter().filter(|block| block.section == Section::Continuous);
        all.any(|block| block.operands.iter().any(|operand| operand.target() == Target::Der(v)))
    };
    slots(arena, &[node]).into_iter().all(|slot| match operands[slot.index()].target() {
        Target::Var(v) => flat.variables[flat.locate(v).0].variability <= Variability::Parameter || is_state(v),
        _ => false,
    })
}

fn signed(value: f64, operand: Operand) -> f64 {
    if operand.negated() { -value } else { value }
}

/// Divisors and arguments of roots and logarithms in both sides.
fn uses(templates: &Templates, template: &Template) -> Vec<Watched> {
    let arena = &templates.arena;
    let is_whole = |node: NodeId| arena.as_constant(node).is_some_and(|power| power >= 0.0 && power.fract() == 0.0);
    let mut found: Vec<Watched> = Vec::new();
    for id in post_order(arena, &[template.left, template.right]) {
        let used = match arena.node(id) {
            Node::Div(_, divisor) => (Use::Divisor, divisor, None),
            Node::Call1(Function::Sqrt, argument) => (Use::Root, argument, None),
            Node::Call1(Function::Log | Function::Log10, argument) => (Use::Logarithm, argument, None),
            Node::Call2(Function::Pow, base, power) if !is_whole(power) => (Use::Power, base, None),
            Node::Call1(Function::Sign, argument) => (Use::Jump, argument, None),
            Node::Compare(_, left, right) => (Use::Jump, left, Some(right)),
            _ => continue,
        };
        let (use_of, node, minus) = used;
        if !found.iter().any(|known| known.node == node && known.minus == minus) {
            found.push(Watched { use_of, node, minus });
        }
    }
    found
}

/// The slope of an equation with respect to an algebraic variable, where it stands in one slot.
fn slope(
    flat: &FlatModel,
    templates: &mut Templates,
    template: &Template,
    operands: &[Operand],
    variable: &str,
) -> Option<Watched> {
    let is_it = |operand: &Operand| matches!(operand.target(), Target::Var(v) if flat.var_name(v) == variable);
    let mut places = (0..operands.len()).filter(|&k| is_it(&operands[k]));
    let place = places.next().filter(|_| places.next().is_none())?;
    // A state is given; its equations determine its derivative.
    let is_state = |operand: &Operand| matches!(operand.target(), Target::Der(v) if flat.var_name(v) == variable);
    let mut all = flat.equations.iter().filter(|block| block.section == Section::Continuous);
    if all.any(|block| block.operands.iter().any(is_state)) {
        return None;
    }
    let residual = templates.arena.sub(template.left, template.right);
    let node = partial(&mut templates.arena, residual, SlotId(place as u32));
    Some(Watched { use_of: Use::Slope, node, minus: None })
}

/// Whether an expression reads something that changes during the run.
fn varies(flat: &FlatModel, templates: &Templates, node: NodeId, operands: &[Operand]) -> bool {
    let arena = &templates.arena;
    let is_time = post_order(arena, &[node]).into_iter().any(|id| arena.node(id) == Node::Time);
    let changes = |slot: SlotId| match operands[slot.index()].target() {
        Target::Var(v) => flat.variables[flat.locate(v).0].variability > Variability::Parameter,
        Target::Der(_) => true,
        _ => false,
    };
    is_time || slots(arena, &[node]).into_iter().any(changes)
}
