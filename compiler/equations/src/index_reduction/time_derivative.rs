//! Equations differentiated with respect to time, once per template.
//!
//! The derivative of a template is a template whose slots are those of the original and, for each slot that varies
//! continuously, one for its derivative; parameters, discrete values and `pre` are constant, `time` has derivative 1, and
//! piecewise expressions are differentiated branch by branch;
//! a delayed value has the delayed rate as its derivative.  Equations of one template whose slots vary alike share the
//! result, so that loops keep sharing code.

use hyd_flat::{Operand, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic};
use hyd_symbolic::{Node, SlotId, TemplateId, Templates, canonical, post_order, time_derivative};
use rustc_hash::FxHashMap;

use crate::explain::faults::mark_equations;
use crate::index_reduction::higher::Derivatives;
use crate::system::{EqId, Equation, EquationSystem};

/// What a slot reads while orders are still counted.
#[derive(Clone, Copy)]
enum Read {
    /// The derivative of a variable of some order, possibly negated.
    Varying { v: VarId, order: u32, negated: bool },
    /// The delayed value of a site, possibly negated; its derivative is the delayed rate, which has none.
    Delayed { site: u32, negated: bool },
    /// The value of an input that follows recorded samples, possibly negated; its derivative is its rate, which has none.
    Input { input: u32, negated: bool },
    /// Something without derivative.
    Fixed(Operand),
}

type Known = FxHashMap<(TemplateId, Vec<bool>), (TemplateId, Vec<SlotId>)>;

/// Operations of a derivative, and its growth beyond the equation itself, from which on it is refused: derivatives of
/// high order of products grow exponentially.
const MOST_OPERATIONS: usize = 100_000;
const MOST_GROWTH: usize = 50;

/// Why an equation cannot be differentiated as often as it must be.
pub(crate) enum NotDifferentiable {
    /// A delayed rate would have to be differentiated: the past is known with its first derivative only.
    DelayedRate(EqId),
    /// The derivative of this recorded input would have to be differentiated: samples give a slope only.
    InputRate(EqId, u32),
    /// The derivative of this order is too large.
    TooLarge(EqId, u32),
    /// The constraints ask for a derivative of this order.
    TooOften(EqId, u32),
}

impl NotDifferentiable {
    /// What the user is told.
    pub(crate) fn diagnostic(self, system: &EquationSystem) -> Diagnostic {
        let apart = "shorten the chain of derivatives, or make one of its variables a state";
        let (eq, message, help) = match self {
            Self::DelayedRate(eq) => {
                let message =
                    "a delayed value would have to be differentiated twice, because of constraints between states";
                (eq, message.to_string(), "delay the derivative itself: `delay(der(x), time)`")
            }
            Self::InputRate(eq, input) => {
                let name = system.flat.driven_variable(input).map_or_else(String::new, |v| system.flat.var_name(v));
                let message = format!(
                    "the recorded input `{name}` would have to be differentiated twice, because of constraints between states"
                );
                (eq, message, "put a second-order filter between the input and what it prescribes")
            }
            Self::TooLarge(eq, order) => {
                let message = format!(
                    "an equation would have to be differentiated {order} times, and its derivatives grow too large"
                );
                (eq, message, apart)
            }
            Self::TooOften(eq, order) => {
                (eq, format!("an equation would have to be differentiated {order} times"), apart)
            }
        };
        mark_equations(Diagnostic::error(Code::HighIndex, message).help(help), system, &[eq])
    }
}

/// Appends the derivatives of the given equations up to the given orders.
///
/// # Errors
/// The first equation for which that cannot be done.
pub(crate) fn append_derivatives(
    system: &mut EquationSystem,
    equations: &[(EqId, u32)],
    derivatives: &Derivatives,
) -> Result<(), NotDifferentiable> {
    let mut known = Known::default();
    for &(eq, order) in equations {
        let mut equation = system.equations[eq];
        let operands = system.operands_of(equation.operands);
        let mut reads: Vec<Read> = operands.iter().map(|&operand| read(system, operand)).collect();
        let most = MOST_OPERATIONS.max(MOST_GROWTH * size(&system.flat.templates, equation.template));
        for _ in 0..order {
            if equation.order > 0 && reads.iter().any(is_delayed_rate) {
                return Err(NotDifferentiable::DelayedRate(eq));
            }
            if let Some(input) = reads.iter().find_map(input_rate).filter(|_| equation.order > 0) {
                return Err(NotDifferentiable::InputRate(eq, input));
            }
            let varying: Vec<bool> = reads.iter().map(|read| !matches!(read, Read::Fixed(_))).collect();
            let templates = &mut system.flat.templates;
            let key = (equation.template, varying);
            if !known.contains_key(&key) {
                let new = differentiate(templates, equation.template, &key.1);
                if size(templates, new.0) > most {
                    return Err(NotDifferentiable::TooLarge(eq, equation.order + 1));
                }
                known.insert(key.clone(), new);
            }
            let (template, slots) = &known[&key];
            reads = slots.iter().map(|&slot| raise(&reads, slot)).collect();
            let operands: Vec<Operand> = reads.iter().map(|&read| operand(read, derivatives)).collect();
            let operands = crate::relations::append(system, &operands);
            let order = equation.order + 1;
            equation = Equation { template: *template, operands, order, ..equation };
            system.equations.push(equation);
        }
    }
    Ok(())
}

fn is_delayed_rate(read: &Read) -> bool {
    matches!(read, Read::Fixed(operand) if matches!(operand.target(), Target::DelayedRate(_)))
}

fn input_rate(read: &Read) -> Option<u32> {
    match read {
        Read::Fixed(operand) => match operand.target() {
            Target::InputRate(input) => Some(input),
            _ => None,
        },
        _ => None,
    }
}

/// Lets the first `count` operands read what stands for a derivative now.
pub(crate) fn replace_rates(system: &mut EquationSystem, count: usize, derivatives: &Derivatives) {
    for operand in &mut system.operands[..count] {
        if let Target::Der(v) = operand.target() {
            *operand = Operand::new(derivatives.target(v, 1)).signed(operand.negated());
        }
    }
}

/// The template of `d(left)/dt = d(right)/dt`.  Its list of slots counts the slots of the original first and then,
/// beginning at its arity, the derivatives of each.
fn differentiate(templates: &mut Templates, id: TemplateId, varying: &[bool]) -> (TemplateId, Vec<SlotId>) {
    let template = templates.get(id);
    let arena = &mut templates.arena;
    let one = arena.constant(1.0);
    let rates: Vec<_> = (0..varying.len()).map(|k| arena.slot(SlotId::new(varying.len() + k))).collect();
    let seed = |leaf: Node| match leaf {
        Node::Slot(slot) if varying[slot.index()] => Some(rates[slot.index()]),
        Node::Time => Some(one),
        _ => None,
    };
    let left = time_derivative(arena, template.left, seed);
    let right = time_derivative(arena, template.right, seed);
    let (new, slots) = canonical(arena, left, right);
    (templates.intern(new), slots)
}

/// Number of different operations and leaves.
fn size(templates: &Templates, id: TemplateId) -> usize {
    let template = templates.get(id);
    post_order(&templates.arena, &[template.left, template.right]).len()
}

/// What a slot of the derivative reads.
fn raise(reads: &[Read], slot: SlotId) -> Read {
    match (reads.get(slot.index()), slot.index().checked_sub(reads.len()).map(|k| reads[k])) {
        (Some(&read), _) => read,
        (None, Some(Read::Varying { v, order, negated })) => Read::Varying { v, order: order + 1, negated },
        (None, Some(Read::Delayed { site, negated })) => {
            Read::Fixed(Operand::new(Target::DelayedRate(site)).signed(negated))
        }
        (None, Some(Read::Input { input, negated })) => {
            Read::Fixed(Operand::new(Target::InputRate(input)).signed(negated))
        }
        (None, Some(fixed)) => fixed,
        (None, None) => unreachable!("invariant: a slot is below the arity or one of the derivatives above"),
    }
}

fn read(system: &EquationSystem, operand: Operand) -> Read {
    let negated = operand.negated();
    match operand.target() {
        Target::Var(v) if system.roles[v].is_continuous() => Read::Varying { v, order: 0, negated },
        Target::Der(v) => Read::Varying { v, order: 1, negated },
        Target::Delayed(site) => Read::Delayed { site, negated },
        Target::Input(input) => Read::Input { input, negated },
        _ => Read::Fixed(operand),
    }
}

fn operand(read: Read, derivatives: &Derivatives) -> Operand {
    match read {
        Read::Varying { v, order, negated } => Operand::new(derivatives.target(v, order)).signed(negated),
        Read::Delayed { site, negated } => Operand::new(Target::Delayed(site)).signed(negated),
        Read::Input { input, negated } => Operand::new(Target::Input(input)).signed(negated),
        Read::Fixed(operand) => operand,
    }
}
