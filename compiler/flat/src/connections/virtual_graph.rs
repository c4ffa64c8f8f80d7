//! The virtual connection graph: which connections determine overdetermined records twice, and what is a root (Modelica 3.6, section 9.4).
//!
//! Nodes are elements of records that declare `equalityConstraint`.  Components relate them (`Connections.branch`, always kept) or
//! determine them (`root`, `potentialRoot`); connections relate them, too, and one that closes a loop or joins two roots is *broken*: in
//! place of the equality of the records it gets the equations of `equalityConstraint` (`equality_constraints`).  What is left is
//! a forest with one root in each tree, found by union of sets in the order of the text, as Kruskal's algorithm does.

use std::collections::VecDeque;

use hyd_instance::{InstId, Instances, Rooting, Scope};
use hyd_source::{Code, Diagnostic, Span};
use hyd_typed::{Expr, Overdetermined};
use rustc_hash::FxHashMap;

use crate::sections::loops::Loops;
use crate::sections::section::MOST_CUTS;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, advance};

/// An element of an overdetermined record.
pub(crate) type Node = (InstId, u32);

/// What a text names: the first element, and how many there are.
struct Named {
    inst: InstId,
    place: Affine,
    count: u32,
}

/// A relation between two nodes, by their numbers.
struct Edge {
    ends: [u32; 2],
    span: Span,
}

/// A connection between overdetermined records.
pub(crate) struct Joint {
    edge: Edge,
    /// The faces that it joins.
    pub(crate) faces: [u32; 2],
    /// The place of the record among those of its connector, and its element in an element of the connector.
    pub(crate) record: (usize, u32),
    /// The equality of the records is replaced by that of their constraints.
    pub(crate) broken: bool,
}

/// What has been said of overdetermined records.
#[derive(Default)]
pub(crate) struct VirtualGraph {
    nodes: Vec<Node>,
    number: FxHashMap<Node, u32>,
    branches: Vec<Edge>,
    pub(crate) joints: Vec<Joint>,
    roots: Vec<(u32, Span)>,
    /// Nodes that can be roots, with their priorities.
    potential: Vec<(u32, i64)>,
}

impl VirtualGraph {
    /// True if the overdetermined records of two connectors are related, by way of others, too.
    pub(crate) fn relates(&self, instances: &Instances, one: InstId, other: InstId) -> bool {
        let of = |connector: InstId| self.nodes.iter().position(|node| instances[node.0].parent == Some(connector));
        let (Some(one), Some(other)) = (of(one), of(other)) else { return false };
        let mut trees = Trees { parent: (0..self.nodes.len() as u32).collect(), root: vec![None; self.nodes.len()] };
        for edge in self.branches.iter().chain(self.joints.iter().map(|joint| &joint.edge)) {
            let _ = trees.join(edge.ends);
        }
        trees.find(one as u32) == trees.find(other as u32)
    }
}

/// Sets of nodes, each with its root as far as one is known.
struct Trees {
    parent: Vec<u32>,
    root: Vec<Option<u32>>,
}

impl Trees {
    fn find(&mut self, mut k: u32) -> u32 {
        while self.parent[k as usize] != k {
            self.parent[k as usize] = self.parent[self.parent[k as usize] as usize];
            k = self.parent[k as usize];
        }
        k
    }

    /// Joins the trees of two nodes; the roots that stand against it, or nothing but the common tree.
    fn join(&mut self, [a, b]: [u32; 2]) -> Result<(), Option<[u32; 2]>> {
        let (a, b) = (self.find(a), self.find(b));
        if a == b {
            return Err(None);
        }
        let roots = (self.root[a as usize], self.root[b as usize]);
        if let (Some(first), Some(second)) = roots {
            return Err(Some([first, second]));
        }
        self.parent[b as usize] = a;
        self.root[a as usize] = roots.0.or(roots.1);
        Ok(())
    }
}

impl VirtualGraph {
    fn node(&mut self, node: Node) -> u32 {
        *self.number.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            self.nodes.len() as u32 - 1
        })
    }

    /// Adds a connection of two records.
    pub(crate) fn connect(&mut self, [a, b]: [Node; 2], faces: [u32; 2], record: (usize, u32), span: Span) {
        let ends = [self.node(a), self.node(b)];
        self.joints.push(Joint { edge: Edge { ends, span }, faces, record, broken: false });
    }

    /// The broken connections: the nodes of each, and its text.
    pub(crate) fn broken(&self) -> Vec<([Node; 2], Span)> {
        let broken = self.joints.iter().filter(|joint| joint.broken);
        broken.map(|joint| (joint.edge.ends.map(|end| self.nodes[end as usize]), joint.edge.span)).collect()
    }

    /// Breaks connections and chooses roots: the roots, and what is wrong.
    fn settle(&mut self) -> (Vec<u32>, Vec<Fault>) {
        let count = self.nodes.len();
        let mut trees = Trees { parent: (0..count as u32).collect(), root: vec![None; count] };
        let mut faults = Vec::new();
        for &(root, span) in &self.roots {
            match trees.root[root as usize] {
                // Said twice of one record.
                Some(_) => faults.push(Fault::TwoRoots([root, root], span)),
                None => trees.root[root as usize] = Some(root),
            }
        }
        for branch in &self.branches {
            match trees.join(branch.ends) {
                Ok(()) => {}
                Err(None) => faults.push(Fault::Loop(branch.span)),
                Err(Some(roots)) => faults.push(Fault::TwoRoots(roots, branch.span)),
            }
        }
        for joint in &mut self.joints {
            joint.broken = trees.join(joint.edge.ends).is_err();
        }
        // The one of lowest priority, the first in the order of the text where there are several.
        let mut potential = self.potential.clone();
        potential.sort_by_key(|&(_, priority)| priority);
        for (node, _) in potential {
            let tree = trees.find(node) as usize;
            trees.root[tree].get_or_insert(node);
        }
        let mut roots = Vec::new();
        for node in 0..count as u32 {
            if trees.find(node) != node {
                continue;
            }
            match trees.root[node as usize] {
                Some(root) => roots.push(root),
                None => {
                    let joined = self.joints.iter().find(|joint| trees.find(joint.edge.ends[0]) == node);
                    faults.push(Fault::NoRoot(node, joined.map(|joint| joint.edge.span)));
                }
            }
        }
        (roots, faults)
    }

    /// How far each node is from the root of its tree.
    fn depths(&self, roots: &[u32]) -> Vec<u32> {
        let mut neighbours = vec![Vec::new(); self.nodes.len()];
        let kept = self.joints.iter().filter(|joint| !joint.broken).map(|joint| &joint.edge);
        for Edge { ends: [a, b], .. } in self.branches.iter().chain(kept) {
            neighbours[*a as usize].push(*b);
            neighbours[*b as usize].push(*a);
        }
        let mut depths = vec![u32::MAX; self.nodes.len()];
        let mut next: VecDeque<u32> = roots.iter().copied().collect();
        roots.iter().for_each(|&root| depths[root as usize] = 0);
        while let Some(node) = next.pop_front() {
            for &other in &neighbours[node as usize] {
                if depths[other as usize] == u32::MAX {
                    depths[other as usize] = depths[node as usize] + 1;
                    next.push_back(other);
                }
            }
        }
        depths
    }
}

/// What is wrong with a virtual connection graph.
enum Fault {
    /// Branches form a loop, which this one closes.
    Loop(Span),
    /// Two roots of one tree, by their numbers, and what joins them.
    TwoRoots([u32; 2], Span),
    /// A tree without root: one of its nodes, and a connection in it.
    NoRoot(u32, Option<Span>),
}

impl Flattener<'_, '_> {
    /// Notes what a text says of overdetermined records, for all elements of the arrays and loops around it.
    pub(crate) fn overdetermined(&mut self, span: Span, said: &Overdetermined, scope: Scope, loops: &Loops<'_>) {
        let start = Context { cuts_left: MOST_CUTS, ..self.context_of(scope) };
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            if cx.counts.contains(&0) {
                return Ok(());
            }
            let mut node = |expr: &Expr| flat.records_named(expr, cx);
            let (first, second) = match said {
                Overdetermined::Branch(a, b) => (node(a)?, Some(node(b)?)),
                Overdetermined::Root(a) | Overdetermined::PotentialRoot(a, _) => (node(a)?, None),
            };
            if second.as_ref().is_some_and(|second| second.count != first.count) {
                let message = "the two that a branch relates have different sizes";
                return Err(flat.error(Code::ArrayShape, span, message));
            }
            let counts = cx.loop_counts();
            let mut counters = vec![0i64; counts.len()];
            for _ in 0..counts.iter().product() {
                for k in 0..first.count {
                    let at = |named: &Named| (named.inst, named.place.at(&counters) as u32 + k);
                    let graph = &mut flat.graph;
                    let one = graph.node(at(&first));
                    match (said, &second) {
                        (Overdetermined::Root(_), _) => graph.roots.push((one, span)),
                        (Overdetermined::PotentialRoot(_, priority), _) => graph.potential.push((one, *priority)),
                        (_, Some(second)) => {
                            let ends = [one, graph.node(at(second))];
                            graph.branches.push(Edge { ends, span });
                        }
                        _ => {}
                    }
                }
                advance(&mut counters, &counts);
            }
            Ok(())
        });
    }

    /// The record that an expression names, or all elements of an array of records.
    fn records_named(&mut self, expr: &Expr, cx: &mut Context) -> Result<Named, Fail> {
        let Some(variable) = expr.variable() else { return Err(Fail::Reported) };
        let (inst, shape) = (variable.last(), self.steps_shape(&variable.steps, cx)?);
        if shape != self.scopes.instances[inst].dims && !shape.is_empty() {
            let message = "a record or a whole array of them is needed here, not a part of an array";
            return Err(self.error(Code::ArrayShape, expr.span, message));
        }
        let count = shape.iter().product::<usize>() as u32;
        // The elements of the array itself stand in a row.
        let first = vec![Affine::constant(0); shape.len()];
        let place = match count {
            0 => Affine::constant(0),
            _ => self.position_of(expr.span, &variable.steps, cx, &first)?.0,
        };
        Ok(Named { inst, place, count })
    }

    /// Breaks what connections determine twice, and says where each record stands, for equations that ask.
    pub(crate) fn settle_virtual_graph(&mut self) {
        let (roots, faults) = self.graph.settle();
        faults.into_iter().for_each(|fault| self.report_fault(fault));
        let depths = self.graph.depths(&roots);
        let mut rooting: FxHashMap<InstId, Vec<Rooting>> = FxHashMap::default();
        for &(inst, _) in &self.graph.nodes {
            let count: usize = hyd_instance::instance::full_dims(&self.scopes.instances, inst).iter().product();
            rooting.entry(inst).or_insert_with(|| vec![Rooting::default(); count]);
        }
        let mut note = |node: u32, note: &dyn Fn(&mut Rooting)| {
            let (inst, element) = self.graph.nodes[node as usize];
            rooting.get_mut(&inst).and_then(|all| all.get_mut(element as usize)).map(note);
        };
        roots.iter().for_each(|&root| note(root, &|rooting| rooting.is_root = true));
        for Edge { ends: [a, b], .. } in &self.graph.branches {
            let nearer = if depths[*a as usize] <= depths[*b as usize] { *a } else { *b };
            note(nearer, &|rooting| rooting.rooted = true);
        }
        self.scopes.found.rooting = Some(rooting);
    }

    fn report_fault(&mut self, fault: Fault) {
        let name = |flat: &mut Self, node: u32| {
            let (inst, _) = flat.graph.nodes[node as usize];
            flat.path(inst)
        };
        let error = |message: String| Diagnostic::error(Code::VirtualGraph, message);
        let diagnostic = match fault {
            Fault::Loop(span) => {
                let message = "this `Connections.branch` closes a loop of branches, which no connection can open";
                error(message.into()).at(span, "")
            }
            Fault::TwoRoots([a, b], span) if a == b => {
                let name = name(self, a);
                error(format!("`{name}` is made a root twice")).at(span, "")
            }
            Fault::TwoRoots([a, b], span) => {
                let (a, b) = (name(self, a), name(self, b));
                error(format!("`{a}` and `{b}` are both roots, and branches relate one to the other")).at(span, "")
            }
            Fault::NoRoot(node, span) => {
                let declared = self.scopes.instances[self.graph.nodes[node as usize].0].span;
                let name = name(self, node);
                let message = format!("nothing that is connected to `{name}` determines it: there is no root");
                let help =
                    "connect a component with `Connections.root` or `Connections.potentialRoot`, such as a ground";
                error(message).at(span.unwrap_or(declared), "").help(help)
            }
        };
        self.report(diagnostic);
    }
}
