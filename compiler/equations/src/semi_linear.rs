//! Chains of `semiLinear` with the same flow (Modelica 3.6, section 3.7.2.5).
//!
//! Two components that are connected say `y = semiLinear(x, a, s)` and `y = semiLinear(x, s, b)` of what flows from one into the other.  Where
//! `x` is 0 neither says what `s` is.  The specification has another form of such a chain that says so: all in between are upstream of the
//! flow, `s = if x >= 0 then a else b`, and `y = semiLinear(x, a, b)`.

use hyd_flat::{Operand, Section, Target};
use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, Node, NodeId, Relation, SlotId, Template, TemplateId};
use rustc_hash::FxHashMap;

use crate::relations::append;
use crate::system::{EqId, Equation, EquationSystem, Role};

/// An equation `y = semiLinear(x, a, b)`; `x` has no sign.
struct Link {
    eq: EqId,
    a: Operand,
    b: Operand,
}

/// Slots of a template that is `y = semiLinear(x, a, b)`.
#[derive(Clone, Copy)]
struct Slots {
    y: SlotId,
    x: SlotId,
    a: SlotId,
    b: SlotId,
}

/// Writes chains in the form that determines what is in between.
pub(crate) fn join_chains(system: &mut EquationSystem) {
    let mut forms: FxHashMap<TemplateId, Option<Slots>> = FxHashMap::default();
    let mut groups: Vec<((Operand, Operand), Vec<Link>)> = Vec::new();
    let mut places: FxHashMap<(Operand, Operand), usize> = FxHashMap::default();
    for (eq, equation) in system.equations.iter_enumerated() {
        if system.section(eq) != Section::Continuous {
            continue;
        }
        let templates = &system.flat.templates;
        let form = forms.entry(equation.template);
        let form = *form.or_insert_with(|| form_of(&templates.arena, &templates.get(equation.template)));
        let Some(Slots { y, x, a, b }) = form else { continue };
        let read = |slot: SlotId| system.operands_of(equation.operands)[slot.index()];
        let (mut y, mut x, mut a, mut b) = (read(y), read(x), read(a), read(b));
        if x.negated() {
            (y, x, a, b) = (y.signed(true), x.signed(true), b, a);
        }
        let place = *places.entry((y, x)).or_insert_with(|| {
            groups.push(((y, x), Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(Link { eq, a, b });
    }
    for ((y, x), links) in groups.iter().filter(|group| group.1.len() > 1) {
        join(system, (*y, *x), links);
    }
}

fn join(system: &mut EquationSystem, (y, x): (Operand, Operand), links: &[Link]) {
    let is_open = |system: &EquationSystem, operand: Operand| match operand.target() {
        Target::Var(v) => !operand.negated() && system.roles[v] == Role::Algebraic,
        _ => false,
    };
    let next_of = |link: &Link| {
        let mut found = links.iter().filter(|next| next.a == link.b);
        let only = found.next().filter(|next| found.next().is_none() && next.eq != link.eq);
        only.filter(|_| links.iter().filter(|other| other.b == link.b).count() == 1)
    };
    let next_of = |system: &EquationSystem, link: &Link| next_of(link).filter(|_| is_open(system, link.b));
    let is_first = |system: &EquationSystem, link: &Link| {
        !links.iter().any(|other| next_of(system, other).is_some_and(|next| next.eq == link.eq))
    };
    for first in links {
        if !is_first(system, first) {
            continue;
        }
        let mut chain = vec![first];
        while let Some(next) = next_of(system, chain[chain.len() - 1]) {
            chain.push(next);
        }
        let (a, b) = (first.a, chain[chain.len() - 1].b);
        if chain.len() == 1 || a == b {
            continue;
        }
        write(system, first.eq, &[y, x, a, b], semi_linear);
        for pair in chain.windows(2) {
            write(system, pair[1].eq, &[pair[0].b, x, a, b], upstream);
        }
    }
}

/// Puts another equation over these operands in the place of one.
fn write(system: &mut EquationSystem, eq: EqId, operands: &[Operand], right: fn(&mut Arena) -> NodeId) {
    let arena = &mut system.flat.templates.arena;
    let (left, right) = (arena.slot(SlotId(0)), right(arena));
    let template = system.flat.templates.intern(Template { left, right, arity: 4 });
    let operands = append(system, operands);
    let old = system.equations[eq];
    system.equations[eq] = Equation { template, operands, ..old };
}

fn semi_linear(arena: &mut Arena) -> NodeId {
    let [x, a, b] = [1, 2, 3].map(|k| arena.slot(SlotId(k)));
    let zero = arena.constant(0.0);
    let test = arena.compare(Relation::GreaterEqual, x, zero);
    let (up, down) = (arena.mul(a, x), arena.mul(b, x));
    arena.select(test, up, down)
}

fn upstream(arena: &mut Arena) -> NodeId {
    let [x, a, b] = [1, 2, 3].map(|k| arena.slot(SlotId(k)));
    let zero = arena.constant(0.0);
    let test = arena.intern(Node::Event(Relation::GreaterEqual, x, zero));
    arena.select(test, a, b)
}

fn form_of(arena: &Arena, template: &Template) -> Option<Slots> {
    let slot = |node: NodeId| match arena.node(node) {
        Node::Slot(slot) => Some(slot),
        _ => None,
    };
    let y = slot(template.left)?;
    let Node::If(test, up, down) = arena.node(template.right) else { return None };
    let (Node::Compare(Relation::GreaterEqual, x, zero) | Node::Event(Relation::GreaterEqual, x, zero)) =
        arena.node(test)
    else {
        return None;
    };
    let x = slot(x).filter(|_| arena.as_constant(zero) == Some(0.0))?;
    let other = |product: NodeId| {
        let Node::Mul(p, q) = arena.node(product) else { return None };
        let (p, q) = (slot(p)?, slot(q)?);
        if p == x { Some(q) } else { (q == x).then_some(p) }
    };
    let (a, b) = (other(up)?, other(down)?);
    let all = [y, x, a, b];
    let apart = (1..4).all(|k| !all[..k].contains(&all[k]));
    apart.then_some(Slots { y, x, a, b })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyd_symbolic::print_template;

    #[test]
    fn what_is_written_is_recognized() {
        let mut arena = Arena::default();
        let (left, right) = (arena.slot(SlotId(0)), semi_linear(&mut arena));
        let template = Template { left, right, arity: 4 };
        let form = form_of(&arena, &template).map(|slots| [slots.y, slots.x, slots.a, slots.b].map(|slot| slot.0));
        assert_eq!(form, Some([0, 1, 2, 3]), "{}", print_template(&arena, &template, &|slot| format!("{slot}")));
        let right = upstream(&mut arena);
        assert!(form_of(&arena, &Template { left, right, arity: 4 }).is_none());
    }
}
