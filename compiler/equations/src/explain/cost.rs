//! What the equations of a text cost to evaluate, counted in operations.
//!
//! The operations of each template are counted once, as often as the text asks for them beside shared parts, and weighted by about how many additions
//! they take on processors of today (instruction tables of Agner Fog, and the functions of `libm`).  Measuring each equation by the
//! clock would cost more than most of them do.  What is eliminated or solved otherwise is counted as it is written.

use hyd_flat::{FlatModel, Section};
use hyd_source::Span;
use hyd_symbolic::{Arena, BodyId, Node, NodeId, Step, post_order};
use hyd_system::math::Function;
use rustc_hash::FxHashMap;

/// Additions that a division, a root, and any other function take.
const DIVISION: u64 = 4;
const ROOT: u64 = 5;
const FUNCTION: u64 = 20;
const POWER: u64 = 40;

/// Equations of one place of the text.
#[derive(Clone, PartialEq, Debug)]
pub struct Cost {
    /// The first of them as it is written.
    pub text: String,
    /// The component that they belong to, empty for the model itself.
    pub component: String,
    /// Where they stand.
    pub span: Span,
    /// How many they are.
    pub equations: u64,
    /// What one evaluation of all of them takes, in additions.
    pub operations: u64,
}

/// Costs of the continuous equations, block by block, the dearest first; equations that only say that two variables are equal cost nothing
/// and are left out.
pub fn costs(flat: &FlatModel) -> Vec<Cost> {
    let mut of_bodies = FxHashMap::default();
    let mut all = Vec::new();
    for block in flat.equations.iter().filter(|block| block.section == Section::Continuous && block.count > 0) {
        let template = flat.templates.get(block.template);
        let one = operations(&flat.templates.arena, &[template.left, template.right], &mut of_bodies);
        if one == 0 {
            continue;
        }
        let (left, right) = flat.written_sides(&template, block.operands_of(0, template.arity as usize));
        all.push(Cost {
            text: format!("{left} = {right}"),
            component: block.origin.path.to_string(),
            span: block.origin.span,
            equations: u64::from(block.count),
            operations: one * u64::from(block.count),
        });
    }
    all.sort_by_key(|own| std::cmp::Reverse(own.operations));
    all
}

/// Operations of expressions, shared parts once.
fn operations(arena: &Arena, roots: &[NodeId], of_bodies: &mut FxHashMap<BodyId, u64>) -> u64 {
    post_order(arena, roots).into_iter().map(|id| weight(arena, &arena.node(id), of_bodies)).sum()
}

fn weight(arena: &Arena, node: &Node, of_bodies: &mut FxHashMap<BodyId, u64>) -> u64 {
    match node {
        Node::Const(_) | Node::Slot(_) | Node::Time | Node::Initial | Node::Homotopy | Node::Pair(..) => 0,
        Node::Div(..) => DIVISION,
        Node::Call1(Function::Sqrt, _) => ROOT,
        Node::Call1(Function::Abs | Function::Sign, _) | Node::Call2(Function::Min | Function::Max, ..) => 1,
        Node::Call2(Function::Pow, ..) => POWER,
        Node::Call1(..) | Node::Call2(..) => FUNCTION,
        Node::Apply(body, ..) => of_body(arena, *body, of_bodies),
        _ => 1,
    }
}

/// Operations of a compiled function, each of its steps once: how often a loop runs is decided in the run.
fn of_body(arena: &Arena, id: BodyId, of_bodies: &mut FxHashMap<BodyId, u64>) -> u64 {
    if let Some(&known) = of_bodies.get(&id) {
        return known;
    }
    // A function that calls itself counts once.
    of_bodies.insert(id, 0);
    let mut sum = 0;
    let mut lists: Vec<&[Step]> = vec![&arena.body(id).steps];
    while let Some(steps) = lists.pop() {
        for step in steps {
            sum += operations(arena, &step.expressions(), of_bodies);
            if let Step::Call { body, .. } = step {
                sum += of_body(arena, *body, of_bodies);
            }
            lists.extend(step.inner());
        }
    }
    of_bodies.insert(id, sum);
    sum
}
