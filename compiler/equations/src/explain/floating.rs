//! Potentials that nothing fixes: a circuit without ground, a mechanism without anchor, a hydraulic line without tank.
//!
//! Such a part of a model matches all of its unknowns or misses one of them, and either way the equations at fault are a long list of
//! innocent ones.  What it really is: the potentials can change together, everything else staying as it is, and no equation notices.
//! Potentials that are equal are one node; the slopes of all equations with respect to the nodes, at points where nothing vanishes by
//! accident, are a matrix whose kernel is looked for by elimination (Golub and Van Loan 2013, *Matrix Computations*, section 3.4).
//! Its vectors with common nodes are one part of the model that floats.  Potentials whose derivative occurs, and delayed ones, have
//! values from before and do not float, nor do those of connectors of the model itself; slopes that branches decide count as numbers of their own.

use std::collections::BTreeMap;

use hyd_flat::{BlockId, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic, Edit, Severity, Span};
use hyd_symbolic::{Arena, Node, NodeId, SlotId, TemplateId, partial, post_order};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::algebra::Algebra;
use crate::explain::faults::list_names;
use crate::explain::references::{reference_for, words_for};
use crate::plan::bindings::sort_bindings;
use crate::roles::assign_roles;
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem};

/// Models with more nodes are not looked at.
const MOST_NODES: usize = 400;
/// Points at which slopes are taken.
const POINTS: u32 = 2;
/// What is left of a row counts as zero below this, relative to its largest entry.
const ZERO: f64 = 1e-9;
/// A node takes part in a vector of the kernel from this size on, relative to the largest.
const PARTAKES: f64 = 1e-6;
/// Most components that are marked.
const MOST_MARKED: usize = 8;

/// Potentials that can change together without any equation noticing.
struct Part {
    /// Position in `FlatModel::potentials`, and the variable.
    members: Vec<(usize, VarId)>,
    /// Number of different potentials among them.
    nodes: usize,
}

/// The messages for a system that is singular: what floats comes first.  A fault that floating potentials explain is replaced by them;
/// where the numbers of equations and unknowns differ, there is something else, too.
pub(crate) fn with_floating(system: &EquationSystem, fault: Diagnostic) -> Vec<Diagnostic> {
    let singular = fault.severity == Severity::Error && matches!(fault.code, Code::Singular | Code::Unbalanced);
    // A component is fixed where it is used.
    let singular = singular && system.flat.open_ends.is_empty();
    let parts = if singular { floating_parts(system) } else { Vec::new() };
    if parts.is_empty() {
        return vec![fault];
    }
    let mut messages: Vec<Diagnostic> = parts.iter().map(|part| message(system, part)).collect();
    if fault.code == Code::Unbalanced {
        messages.push(fault);
    }
    messages
}

/// The parts of a model that float, in the order of its text.
fn floating_parts(system: &EquationSystem) -> Vec<Part> {
    if system.flat.potentials.is_empty() {
        return Vec::new();
    }
    let mut plain = assign_roles(system.flat.clone());
    let mut algebra = Algebra::default();
    let Ok(bindings) = sort_bindings(&mut plain, &mut algebra) else { return Vec::new() };
    let points: Vec<StartPoint> =
        (0..POINTS).map(|seed| StartPoint::scattered(&mut plain, &bindings.assignments, seed)).collect();
    let Some(nodes) = Nodes::of(&plain) else { return Vec::new() };
    let rows = Rows { algebra: &mut algebra, partials: FxHashMap::default(), points: &points }.all(&mut plain, &nodes);
    let supports = joined(&kernel(rows, nodes.count), nodes.count);
    let mut parts: Vec<Part> = Vec::new();
    for support in supports {
        let members =
            members(&plain).filter(|(_, v)| nodes.of_variable[*v].is_some_and(|node| support.contains(&node)));
        parts.push(Part { members: members.collect(), nodes: support.len() });
    }
    // Where components meet in a single node, what is wrong is that their flows do not fit.
    parts.retain(|part| part.members.len() == 1 || part.nodes > 1);
    parts.sort_by_key(|part| part.members[0]);
    parts
}

/// All scalar potentials, each with its position in `FlatModel::potentials`.
fn members(system: &EquationSystem) -> impl Iterator<Item = (usize, VarId)> {
    system.flat.potentials.iter().enumerate().flat_map(|(k, potential)| {
        let block = &system.flat.variables[potential.block];
        (block.first.0..block.first.0 + block.count).map(move |v| (k, VarId(v)))
    })
}

/// Variables that are equal, as far as a potential is among them.
struct Nodes {
    of_variable: IndexVec<VarId, Option<usize>>,
    count: usize,
}

impl Nodes {
    /// `None` if there are too many.
    fn of(system: &EquationSystem) -> Option<Self> {
        let mut parent: IndexVec<VarId, VarId> = IndexVec::from_vec(system.roles.indices().collect());
        for eq in system.equations_in(Section::Continuous) {
            let template = system.flat.templates.get(system.equations[eq].template);
            let arena = &system.flat.templates.arena;
            let (Node::Slot(a), Node::Slot(b)) = (arena.node(template.left), arena.node(template.right)) else {
                continue;
            };
            let operands = system.operands_of(system.equations[eq].operands);
            let (a, b) = (operands[a.index()], operands[b.index()]);
            if let (Target::Var(x), Target::Var(y)) = (a.target(), b.target())
                && a.negated() == b.negated()
                && system.is_continuous(x)
                && system.is_continuous(y)
            {
                let (x, y) = (find(&mut parent, x), find(&mut parent, y));
                parent[x.max(y)] = x.min(y);
            }
        }
        let mut of_root: FxHashMap<VarId, usize> = FxHashMap::default();
        for (_, v) in members(system) {
            let next = of_root.len();
            of_root.entry(find(&mut parent, v)).or_insert(next);
        }
        let count = of_root.len();
        let variables: Vec<VarId> = system.roles.indices().collect();
        let of_variable: Vec<_> = variables.into_iter().map(|v| of_root.get(&find(&mut parent, v)).copied()).collect();
        (count <= MOST_NODES).then(|| Self { of_variable: IndexVec::from_vec(of_variable), count })
    }
}

fn find(parent: &mut IndexVec<VarId, VarId>, mut v: VarId) -> VarId {
    while parent[v] != v {
        parent[v] = parent[parent[v]];
        v = parent[v];
    }
    v
}

/// The slopes of all equations with respect to nodes.
struct Rows<'a> {
    algebra: &'a mut Algebra,
    partials: FxHashMap<(TemplateId, SlotId), (NodeId, bool)>,
    points: &'a [StartPoint],
}

impl Rows<'_> {
    fn all(&mut self, system: &mut EquationSystem, nodes: &Nodes) -> Vec<Vec<f64>> {
        let mut rows = Vec::new();
        for eq in system.equations_in(Section::Continuous) {
            for row in self.of_equation(system, nodes, eq) {
                let mut dense = vec![0.0; nodes.count];
                row.into_iter().for_each(|(node, slope)| dense[node] = slope);
                rows.push(dense);
            }
        }
        let delayed = system.flat.delays.iter().flat_map(|delay| (0..delay.count).map(|k| VarId(delay.source.0 + k)));
        // What is connected to the model itself is fixed where the model is used.
        let own = |k: usize, v: VarId| {
            let depth = system.flat.potentials[k].depth as usize;
            system.flat.var_name(v).split('.').count() <= depth
        };
        let outside = members(system).filter(|&(k, v)| own(k, v)).map(|(_, v)| v);
        for node in delayed.chain(outside).filter_map(|v| nodes.of_variable[v]) {
            rows.push(unit(node, nodes.count));
        }
        rows
    }

    /// One row for each point, and one for each potential whose derivative occurs.
    fn of_equation(&mut self, system: &mut EquationSystem, nodes: &Nodes, eq: EqId) -> Vec<BTreeMap<usize, f64>> {
        let equation = system.equations[eq];
        let slots = self.algebra.facts(&mut system.flat.templates, equation.template).slots.clone();
        let residual = self.algebra.facts(&mut system.flat.templates, equation.template).residual;
        let mut rows = vec![BTreeMap::new(); self.points.len()];
        for slot in slots {
            let operand = system.operands_of(equation.operands)[slot.index()];
            let node = match operand.target() {
                Target::Var(v) => nodes.of_variable[v],
                Target::Der(v) => {
                    rows.extend(nodes.of_variable[v].map(|node| BTreeMap::from([(node, 1.0)])));
                    continue;
                }
                _ => continue,
            };
            let Some(node) = node else { continue };
            let arena = &mut system.flat.templates.arena;
            let (slope, has_branches) = *self.partials.entry((equation.template, slot)).or_insert_with(|| {
                let slope = partial(arena, residual, slot);
                (slope, has_branches(arena, slope))
            });
            for (k, point) in self.points.iter().enumerate() {
                let value = if has_branches { f64::NAN } else { point.evaluate(system, slope, equation.operands) };
                let value = if value.is_finite() { value } else { point.made_up(eq.0 ^ slot.0) };
                *rows[k].entry(node).or_insert(0.0) += if operand.negated() { -value } else { value };
            }
        }
        rows.retain(|row| !row.is_empty());
        rows
    }
}

/// A slope that is another one elsewhere.
fn has_branches(arena: &Arena, slope: NodeId) -> bool {
    let branches = |node| matches!(node, Node::If(..) | Node::Compare(..) | Node::Event(..) | Node::Apply(..));
    post_order(arena, &[slope]).into_iter().any(|id| branches(arena.node(id)))
}

fn unit(node: usize, count: usize) -> Vec<f64> {
    let mut row = vec![0.0; count];
    row[node] = 1.0;
    row
}

/// Vectors that all rows map to zero, one for each column without pivot.
fn kernel(rows: Vec<Vec<f64>>, count: usize) -> Vec<Vec<f64>> {
    let mut pivots: Vec<(usize, Vec<f64>)> = Vec::new();
    for mut row in rows {
        let size = row.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        if size == 0.0 {
            continue;
        }
        row.iter_mut().for_each(|value| *value /= size);
        for (column, pivot) in &pivots {
            let factor = row[*column];
            if factor != 0.0 {
                row.iter_mut().zip(pivot).for_each(|(value, pivot)| *value -= factor * pivot);
                row[*column] = 0.0;
            }
        }
        let best = (0..count).max_by(|&a, &b| row[a].abs().total_cmp(&row[b].abs()));
        let Some(column) = best.filter(|&best| row[best].abs() > ZERO) else { continue };
        let pivot = row[column];
        row.iter_mut().for_each(|value| *value /= pivot);
        pivots.push((column, row));
    }
    let free = (0..count).filter(|column| pivots.iter().all(|(pivot, _)| pivot != column));
    free.map(|column| {
        let mut vector = unit(column, count);
        for (pivot, row) in pivots.iter().rev() {
            let sum: f64 = (0..count).filter(|j| j != pivot).map(|j| row[j] * vector[j]).sum();
            vector[*pivot] = -sum;
        }
        vector
    })
    .collect()
}

/// The nodes of each vector; vectors with common nodes are one set.
fn joined(vectors: &[Vec<f64>], count: usize) -> Vec<Vec<usize>> {
    let mut sets: Vec<Vec<usize>> = Vec::new();
    for vector in vectors {
        let largest = vector.iter().fold(0.0_f64, |size, value| size.max(value.abs()));
        let mut set: Vec<usize> = (0..count).filter(|&node| vector[node].abs() > PARTAKES * largest).collect();
        let (common, apart): (Vec<_>, Vec<_>) =
            sets.into_iter().partition(|other| other.iter().any(|node| set.contains(node)));
        set.extend(common.into_iter().flatten());
        set.sort_unstable();
        set.dedup();
        sets = apart;
        sets.push(set);
    }
    sets
}

/// `nothing fixes the potentials of ...`, with what would.
fn message(system: &EquationSystem, part: &Part) -> Diagnostic {
    let potential = |k: usize| &system.flat.potentials[k];
    let mut components: Vec<(String, Span)> = Vec::new();
    for &(k, v) in &part.members {
        let (component, _) = split(&system.flat.var_name(v), potential(k).depth);
        if !components.iter().any(|(known, _)| *known == component) {
            components.push((component, potential(k).declared));
        }
    }
    let (first, v) = part.members[0];
    let unit = unit_of(system, potential(first).block);
    let what = words_for(&unit);
    let names = list_names(components.iter().map(|(name, _)| name.clone()));
    let alone = components.len() == 1 && part.members.len() == 1;
    if alone && potential(first).open {
        let connector = system.flat.var_name(v);
        let connector = connector.rsplit_once('.').map_or(connector.as_str(), |(connector, _)| connector);
        let message =
            format!("nothing is connected to `{connector}`, and nothing fixes its {}", what.trim_end_matches('s'));
        let diagnostic = Diagnostic::error(Code::Singular, message).at(potential(first).declared, "");
        return diagnostic.help("connect it to what it belongs to");
    }
    let what_alone = what.trim_end_matches('s');
    let message = match alone {
        true => format!("nothing fixes the {what_alone} of {names}"),
        false => format!("nothing fixes the {what} of {names}"),
    };
    let mut diagnostic = Diagnostic::error(Code::Singular, message);
    let mut marked: Vec<Span> = Vec::new();
    for (_, span) in &components {
        if !marked.contains(span) && marked.len() < MOST_MARKED {
            marked.push(*span);
            diagnostic = diagnostic.at(*span, "");
        }
    }
    let together = match alone {
        true => format!("`{}` may have any value without an equation noticing", system.flat.var_name(v)),
        false => format!(
            "these {} {what} can change together without an equation noticing: only their differences are determined",
            part.members.len()
        ),
    };
    diagnostic = diagnostic.help(together);
    // What is counted from is best the end that is called negative.
    let is_last = |v: VarId| {
        let name = system.flat.var_name(v);
        name.split('.')
            .rev()
            .nth(1)
            .is_some_and(|connector| matches!(connector, "n" | "port_b" | "flange_b" | "port_n"))
    };
    let mut in_order = part.members.clone();
    in_order.sort_by_key(|(_, v)| *v);
    let &(k, at) = in_order.iter().find(|(_, v)| is_last(*v)).unwrap_or(&part.members[0]);
    let (component, rest) = split(&system.flat.var_name(at), potential(k).depth);
    let inside = rest.rsplit_once('.').map_or("", |(connector, _)| connector);
    let end = if component.is_empty() { inside.to_string() } else { format!("{component}.{inside}") };
    let Some(reference) = reference_for(&potential(k).connector) else {
        return diagnostic.help(format!("connect a component that fixes one of them, at `{end}` for example"));
    };
    let name = free_name(system, reference.name);
    let declaration = format!("{} {name};", reference.class);
    let connection = format!("connect({name}.{}, {end});", reference.connector);
    let diagnostic = diagnostic
        .help(format!("add `{declaration}` and `{connection}`, or connect another component that fixes one of them"));
    // Only in the model's own text: what is inside of its components is their matter.
    match system.flat.gaps.filter(|_| !component.contains('.')) {
        None => diagnostic,
        Some(gaps) => {
            let before =
                |span: Span, text: &str| Edit { span: Span { end: span.start, ..span }, text: format!("{text}\n  ") };
            let edits = vec![before(gaps.declaration, &declaration), before(gaps.equation, &connection)];
            diagnostic.propose(format!("connect `{end}` to `{}`", reference.class), edits)
        }
    }
}

/// A name that no variable of the model begins with.
fn free_name(system: &EquationSystem, wanted: &str) -> String {
    let heads = |block: &hyd_flat::VariableBlock| block.name.parts.first().map(|(text, _)| text.clone());
    let taken: FxHashSet<String> = system
        .flat
        .variables
        .iter()
        .filter_map(heads)
        .filter_map(|text| text.split(['.', '[']).next().map(str::to_string))
        .collect();
    let numbered = (2..).map(|k| format!("{wanted}{k}"));
    let mut names = std::iter::once(wanted.to_string()).chain(numbered);
    names.find(|name| !taken.contains(name)).unwrap_or_else(|| wanted.to_string())
}

fn unit_of(system: &EquationSystem, block: BlockId) -> String {
    system.flat.variables[block].unit.as_deref().unwrap_or_default().to_string()
}

/// The name of the component, and what stands behind it: `r` and `p.v` of `r.p.v`.
fn split(name: &str, depth: u32) -> (String, String) {
    let parts: Vec<&str> = name.split('.').collect();
    let at = parts.len().saturating_sub(depth as usize);
    (parts[..at].join("."), parts[at..].join("."))
}

#[cfg(test)]
mod tests {
    use super::{joined, kernel};

    #[test]
    fn a_ground_on_one_side_of_a_transformer_leaves_the_other_side_floating() {
        // Nodes: 0, 1 of the primary, 2, 3 of the secondary side, with ten times as many turns on the primary.
        let rows = vec![
            vec![1.0, -1.0, -10.0, 10.0],
            vec![1.0, -1.0, 0.0, 0.0],
            vec![0.0, 0.0, 1.0, -1.0],
            vec![0.0, 1.0, 0.0, 0.0],
        ];
        let found = kernel(rows.clone(), 4);
        assert_eq!(found, [vec![0.0, 0.0, 1.0, 1.0]]);
        assert_eq!(joined(&found, 4), [[2, 3]]);
        assert_eq!(kernel(rows[..3].to_vec(), 4).len(), 2);
        assert!(kernel([rows, vec![vec![0.0, 0.0, 0.0, 2.0]]].concat(), 4).is_empty());
    }
}
