//! Relations that cause events leave the expressions: each becomes a held truth value and a root function.
//!
//! An `Event` node is replaced by a new slot that reads `Held(k)`; relation `k` knows how to compute its truth and where
//! its truth changes (Modelica 3.6, section 8.5).  Equal relations over equal operands share one entry.  Relations that
//! only events can change, that compare for equality, or that stand where no event is made (bindings, starts, initial
//! equations, assertions) are evaluated literally.  A relation between time and values fixed between events is a time event.
//!
//! Discrete equations, among them those of a `when`, are evaluated at events only, and have literal relations that cause none (section 8.5).
//! Where one of these is known as a cause of events elsewhere, as the condition of a `when`, it has the truth that is held: at the
//! crossing itself a comparison would be a matter of rounding.

use hyd_flat::{Operand, Section, Target};
use hyd_index::TypedIndex;
use hyd_symbolic::{
    Node, NodeId, Relation, SlotId, Template, TemplateId, Templates, canonical, contains_event, contains_initial,
    contains_time, partial_time, post_order, replace_below, rewrite, slots, solve_for,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::Known;
use crate::sorted::{EventRelation, Trigger};
use crate::system::{EqId, EquationSystem, OperandRange};

/// The system with `Held` operands, and the relations behind them.
pub fn extract_relations(mut system: EquationSystem) -> (EquationSystem, Vec<EventRelation>) {
    let mut pass = Pass::default();
    for eq in system.equations.indices() {
        pass.equation(&mut system, eq);
    }
    for eq in system.equations.indices() {
        pass.at_events(&mut system, eq);
    }
    (system, pass.relations)
}

/// An event node of a template.
struct EventNode {
    node: NodeId,
    /// Slots it reads other than through another event node, and whether it reads the time.
    slots: Vec<SlotId>,
    time: bool,
    equality: bool,
}

/// A relation taken out of a template.
#[derive(Clone)]
struct Extracted {
    truth: NodeId,
    root: NodeId,
    /// For each slot of `truth` the slot of the new template (those of relations taken out before included).
    slots: Vec<SlotId>,
    /// When it changes, if it is linear in time; an expression over the slots of `truth`.
    timed: Option<Trigger>,
}

#[derive(Clone)]
struct Rewritten {
    template: TemplateId,
    extracted: Vec<Extracted>,
}

#[derive(Default)]
struct Pass {
    relations: Vec<EventRelation>,
    events: FxHashMap<TemplateId, Vec<EventNode>>,
    rewritten: FxHashMap<(TemplateId, Vec<bool>), Rewritten>,
    /// Literal relations of templates, as causes of events.
    literals: FxHashMap<TemplateId, Vec<(NodeId, Extracted)>>,
    known: FxHashMap<(NodeId, Vec<Operand>), u32>,
}

impl Pass {
    fn equation(&mut self, system: &mut EquationSystem, eq: EqId) {
        let equation = system.equations[eq];
        let templates = &mut system.flat.templates;
        let events = self.events.entry(equation.template).or_insert_with(|| event_nodes(templates, equation.template));
        if events.is_empty() {
            return;
        }
        let literal = !matches!(
            system.section(eq),
            Section::Continuous | Section::Discrete | Section::Reinit | Section::AssertOnce(_) | Section::Terminate(_)
        );
        let operands = system.operands_of(equation.operands);
        let varies = |slot: &SlotId| is_continuous(system, operands[slot.index()]);
        let held: Vec<bool> =
            events.iter().map(|e| !literal && !e.equality && (e.time || e.slots.iter().any(varies))).collect();
        let templates = &mut system.flat.templates;
        let key = (equation.template, held);
        if !self.rewritten.contains_key(&key) {
            let new = take_out(templates, equation.template, events, &key.1);
            self.rewritten.insert(key.clone(), new);
        }
        let Rewritten { template, extracted } = self.rewritten[&key].clone();
        let mut operands = operands_of(system, equation.operands);
        for relation in &extracted {
            let index = self.enter(system, eq, relation, &operands);
            operands.push(Operand::new(Target::Held(index)));
        }
        system.equations[eq].template = template;
        system.equations[eq].operands =
            if extracted.is_empty() { equation.operands } else { append(system, &operands) };
    }

    /// Held truths in the place of the literal relations of what is evaluated at events only.
    fn at_events(&mut self, system: &mut EquationSystem, eq: EqId) {
        let section = system.section(eq);
        if !matches!(section, Section::Discrete | Section::Reinit | Section::AssertOnce(_) | Section::Terminate(_)) {
            return;
        }
        let equation = system.equations[eq];
        let templates = &mut system.flat.templates;
        let literals = self.literals.entry(equation.template).or_insert_with(|| literals(templates, equation.template));
        if literals.is_empty() {
            return;
        }
        let mut operands = operands_of(system, equation.operands);
        let mut replaced: FxHashMap<NodeId, NodeId> = FxHashMap::default();
        for (node, relation) in literals.clone() {
            let own: Vec<Operand> = relation.slots.iter().map(|slot| operands[slot.index()]).collect();
            if self.known.contains_key(&(relation.truth, own)) {
                let index = self.enter(system, eq, &relation, &operands);
                replaced.insert(node, system.flat.templates.arena.slot(SlotId::new(operands.len())));
                operands.push(Operand::new(Target::Held(index)));
            }
        }
        if replaced.is_empty() {
            return;
        }
        let templates = &mut system.flat.templates;
        let Template { left, right, .. } = templates.get(equation.template);
        let mut side = |root: NodeId| match replaced.get(&root) {
            Some(&held) => held,
            None => replace_below(&mut templates.arena, root, &replaced),
        };
        let (left, right) = (side(left), side(right));
        let template = templates.intern(Template { left, right, arity: operands.len() as u32 });
        system.equations[eq].template = template;
        system.equations[eq].operands = append(system, &operands);
    }

    /// The index of a relation with the given operands of its equation.
    fn enter(&mut self, system: &mut EquationSystem, eq: EqId, relation: &Extracted, operands: &[Operand]) -> u32 {
        let own: Vec<Operand> = relation.slots.iter().map(|slot| operands[slot.index()]).collect();
        let next = self.relations.len() as u32;
        match self.known.entry((relation.truth, own)) {
            std::collections::hash_map::Entry::Occupied(entry) => *entry.get(),
            std::collections::hash_map::Entry::Vacant(entry) => {
                let own = entry.key().1.clone();
                entry.insert(next);
                let fixed = own.iter().all(|&operand| is_fixed_between_events(system, operand));
                let trigger = relation.timed.filter(|_| fixed).unwrap_or(Trigger::State);
                let operands = append(system, &own);
                let (truth, root) = (relation.truth, relation.root);
                self.relations.push(EventRelation { truth, root, operands, trigger, equation: eq });
                next
            }
        }
    }
}

/// Makes time events of relations that were found to read nothing that varies between events.
pub(crate) fn find_time_events(system: &mut EquationSystem, relations: &mut [EventRelation], known: &Known) {
    for relation in relations.iter_mut().filter(|r| r.trigger == Trigger::State) {
        let operands = system.operands_of(relation.operands);
        if operands.iter().all(|&o| known.is_known(o) || is_fixed_between_events(system, o))
            && let Some(timed) = timed(&mut system.flat.templates, relation.truth, relation.root, relation.operands.len)
        {
            relation.trigger = timed;
        }
    }
}

fn operands_of(system: &EquationSystem, range: OperandRange) -> Vec<Operand> {
    system.operands_of(range).to_vec()
}

/// Stores operands behind all others.
pub(crate) fn append(system: &mut EquationSystem, operands: &[Operand]) -> OperandRange {
    let first = system.operands.len() as u32;
    system.operands.extend_from_slice(operands);
    OperandRange { first, len: operands.len() as u32 }
}

fn is_continuous(system: &EquationSystem, operand: Operand) -> bool {
    match operand.target() {
        Target::Var(v) => system.roles[v].is_continuous(),
        Target::Der(_) | Target::Delayed(_) | Target::DelayedRate(_) | Target::Input(_) | Target::InputRate(_) => true,
        _ => false,
    }
}

pub(crate) fn is_fixed_between_events(system: &EquationSystem, operand: Operand) -> bool {
    match operand.target() {
        Target::Held(_) | Target::Chosen(_) => false,
        _ => !is_continuous(system, operand),
    }
}

/// The event nodes of a template, inner ones first.
fn event_nodes(templates: &Templates, template: TemplateId) -> Vec<EventNode> {
    let (arena, template) = (&templates.arena, templates.get(template));
    let mut found = Vec::new();
    for node in post_order(arena, &[template.left, template.right]) {
        if let Node::Event(relation, a, b) = arena.node(node) {
            let (slots, time) = reads_outside_events(templates, a, b);
            let equality = matches!(relation, Relation::Equal | Relation::NotEqual);
            found.push(EventNode { node, slots, time, equality });
        }
    }
    found
}

/// The literal relations of a template with what they would be as causes of events.
fn literals(templates: &mut Templates, template: TemplateId) -> Vec<(NodeId, Extracted)> {
    let Template { left, right, .. } = templates.get(template);
    let mut found = Vec::new();
    for node in post_order(&templates.arena, &[left, right]) {
        let Node::Compare(relation, ..) = templates.arena.node(node) else { continue };
        if !matches!(relation, Relation::Equal | Relation::NotEqual) {
            found.push((node, extract(templates, node)));
        }
    }
    found
}

fn reads_outside_events(templates: &Templates, a: NodeId, b: NodeId) -> (Vec<SlotId>, bool) {
    let mut seen = FxHashSet::default();
    let (mut slots, mut time, mut stack) = (Vec::new(), false, vec![a, b]);
    while let Some(id) = stack.pop() {
        if !seen.insert(id) {
            continue;
        }
        match templates.arena.node(id) {
            Node::Slot(slot) => slots.push(slot),
            Node::Time => time = true,
            Node::Event(..) => {}
            node => stack.extend(node.operands()),
        }
    }
    (slots, time)
}

/// The template with the event nodes replaced: by a new slot where `held`, else by the literal relation.
fn take_out(templates: &mut Templates, old: TemplateId, events: &[EventNode], held: &[bool]) -> Rewritten {
    let Template { left, right, mut arity } = templates.get(old);
    let mut extracted = Vec::new();
    let mut replaced: FxHashMap<NodeId, NodeId> = FxHashMap::default();
    for (event, &held) in events.iter().zip(held) {
        let literal = replace_events(templates, event.node, &replaced, true);
        // Simplification may have left nothing that changes.
        let varies = !slots(&templates.arena, &[literal]).is_empty() || contains_time(&templates.arena, literal);
        let new = if held && varies {
            extracted.push(extract(templates, literal));
            arity += 1;
            templates.arena.slot(SlotId(arity - 1))
        } else {
            literal
        };
        replaced.insert(event.node, new);
    }
    let left = replace_events(templates, left, &replaced, false);
    let right = replace_events(templates, right, &replaced, false);
    debug_assert!(!contains_event(&templates.arena, left) && !contains_event(&templates.arena, right));
    Rewritten { template: templates.intern(Template { left, right, arity }), extracted }
}

/// Rewrites an expression with the replacements found so far; with `top`, the event at its root becomes literal.
fn replace_events(templates: &mut Templates, root: NodeId, replaced: &FxHashMap<NodeId, NodeId>, top: bool) -> NodeId {
    // `rewrite` shows nodes with rewritten operands, so the replacement is by position in the original's post-order.
    let order = post_order(&templates.arena, &[root]);
    let mut position = 0;
    rewrite(&mut templates.arena, root, |arena, node| {
        let original = order[position];
        position += 1;
        match (replaced.get(&original), node) {
            (Some(&new), _) => Some(new),
            (None, Node::Event(relation, a, b)) if top && original == root => Some(arena.compare(relation, a, b)),
            _ => None,
        }
    })
}

fn extract(templates: &mut Templates, literal: NodeId) -> Extracted {
    let arena = &mut templates.arena;
    let zero = arena.constant(0.0);
    let (form, slots) = canonical(arena, literal, zero);
    let truth = form.left;
    let root = match arena.node(truth) {
        Node::Compare(Relation::Less | Relation::LessEqual, a, b) => arena.sub(b, a),
        Node::Compare(_, a, b) => arena.sub(a, b),
        _ => truth,
    };
    let timed = timed(templates, truth, root, form.arity);
    Extracted { truth, root, slots, timed }
}

/// When a comparison changes, if its root function is linear in time with a number as its slope: where that is zero.
fn timed(templates: &mut Templates, truth: NodeId, root: NodeId, arity: u32) -> Option<Trigger> {
    let arena = &mut templates.arena;
    let Node::Compare(relation, ..) = arena.node(truth) else { return None };
    if !contains_time(arena, root) || contains_initial(arena, root) {
        return None;
    }
    let slope = partial_time(arena, root);
    let rises = arena.as_constant(slope).filter(|&slope| slope != 0.0)? > 0.0;
    // Where both sides are equal it is already what it becomes, or still what it was.
    let at_equality = matches!(relation, Relation::LessEqual | Relation::GreaterEqual);
    let time = SlotId(arity);
    let named = rewrite(arena, root, |arena, node| (node == Node::Time).then(|| arena.slot(time)));
    let zero = arena.constant(0.0);
    let solution = solve_for(arena, named, zero, time)?;
    let right_after = at_equality != rises;
    solution.divisors.is_empty().then_some(Trigger::Time { instant: solution.value, rises, right_after })
}
