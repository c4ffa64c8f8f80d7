//! Sets of joined connectors to equations: potentials are equal, flows sum to zero (Modelica 3.6, section 9.2).
//!
//! What connectors consist of is looked up once per connector, not per connection.  Equations of one form that come
//! from one `connect` are one block.

use std::rc::Rc;

use hyd_instance::InstId;
use hyd_source::{Origin, Span};
use hyd_symbolic::{NodeId, SlotId, TemplateId};
use hyd_syntax::tree::{ClassKind, Name};
use hyd_system::Variability;
use rustc_hash::FxHashMap;

use crate::connections::connect::OUTSIDE;
use crate::connections::equality_constraints::Record;
use crate::expressions::fold::{Fold, LONGEST};
use crate::model::{EquationBlock, Operand, Section, Target, VarId};
use crate::state::flattener::Flattener;

/// A variable of a connector with all that its equations need.
pub(crate) struct Member {
    pub(crate) path: Name,
    pub(crate) inst: InstId,
    pub(crate) flow: bool,
    pub(crate) stream: bool,
    /// Its first scalar, and how many belong to each element of the connector.
    pub(crate) first: VarId,
    pub(crate) count: u32,
    /// Changes at events only.
    pub(crate) discrete: bool,
    /// An input or output.
    pub(crate) directed: bool,
}

/// What is connected: connectors with the ranges of their elements, and the equations made so far.
pub(crate) struct Joints {
    pub(crate) order: Vec<(InstId, u32)>,
    /// Position in `order` of the connector of each element.
    pub(crate) owner: Vec<u32>,
    pub(crate) members: Vec<Vec<Member>>,
    /// Some connector that is part of another one was connected by itself.
    nested: bool,
    groups: FxHashMap<(TemplateId, Span), usize>,
    /// Connections of overdetermined records in sets where one of them is broken, by the first face of the set.
    broken: FxHashMap<u32, Vec<Cut>>,
}

/// A connection of overdetermined records in a set where such a connection is broken.
struct Cut {
    faces: [u32; 2],
    /// The records of the connector, and which of them it is, with its element in an element of the connector.
    records: Rc<[Record]>,
    place: usize,
    element: u32,
    broken: bool,
}

/// A scalar variable of a connector, seen from one side.
pub(crate) struct Leaf {
    pub(crate) variable: VarId,
    /// Seen from within the component of the connector.
    out: bool,
    flow: bool,
    discrete: bool,
    directed: bool,
    inst: InstId,
    joined_at: Span,
    span: Span,
}

/// Scalar variables joined so far.
#[derive(Default)]
struct Leaves {
    all: Vec<Leaf>,
    known: FxHashMap<(VarId, bool), usize>,
    parent: Vec<usize>,
}

impl Leaves {
    fn find(&mut self, mut k: usize) -> usize {
        while self.parent[k] != k {
            self.parent[k] = self.parent[self.parent[k]];
            k = self.parent[k];
        }
        k
    }

    /// Joins variables with each other.
    fn join(&mut self, leaves: impl Iterator<Item = Leaf>) {
        let mut head = None;
        for leaf in leaves {
            let next = self.all.len();
            let k = *self.known.entry((leaf.variable, leaf.out)).or_insert(next);
            if k == next {
                self.all.push(leaf);
                self.parent.push(k);
            }
            let root = self.find(k);
            match head {
                None => head = Some(root),
                // The one that was met first stays the head.
                Some(other) => {
                    let (low, high) = (root.min(other), root.max(other));
                    self.parent[high] = low;
                    head = Some(low);
                }
            }
        }
    }

    /// The sets, in the order of their first variables.
    fn sets(mut self) -> Vec<Vec<Leaf>> {
        let roots: Vec<usize> = (0..self.all.len()).map(|k| self.find(k)).collect();
        let mut sets: Vec<Vec<Leaf>> = Vec::new();
        let mut at: FxHashMap<usize, usize> = FxHashMap::default();
        for (leaf, root) in self.all.into_iter().zip(roots) {
            let k = *at.entry(root).or_insert_with(|| {
                sets.push(Vec::new());
                sets.len() - 1
            });
            sets[k].push(leaf);
        }
        sets
    }
}

impl Joints {
    /// The faces of a set whose variables of this path, scalar `k` of `count` in an element of the connector, are equal: all of them but for
    /// an overdetermined record that connections determine twice.
    fn equal_parts(&self, set: &[u32], path: &Name, k: u32, count: u32) -> Vec<Vec<u32>> {
        let own = |cut: &&Cut| {
            let record = &cut.records[cut.place];
            record.has(path) && k / (count / record.count.max(1)).max(1) == cut.element
        };
        let cuts: Vec<&Cut> = self.broken.get(&set[0]).into_iter().flatten().filter(own).collect();
        if !cuts.iter().any(|cut| cut.broken) {
            return vec![set.to_vec()];
        }
        let mut parts: Vec<Vec<u32>> = set.iter().map(|&face| vec![face]).collect();
        for cut in cuts.into_iter().filter(|cut| !cut.broken) {
            let at = |parts: &[Vec<u32>], face: u32| parts.iter().position(|part| part.contains(&face));
            let (Some(a), Some(b)) = (at(&parts, cut.faces[0]), at(&parts, cut.faces[1])) else { continue };
            if a != b {
                let (low, high) = (a.min(b), a.max(b));
                let joined = parts.remove(high);
                parts[low].extend(joined);
            }
        }
        parts
    }

    /// The variable of the connector of a face that has this place and path in another connector, and the element of the face.
    pub(crate) fn same(&self, face: u32, place: usize, path: &Name) -> Option<(&Member, u32)> {
        let owner = self.owner[(face / 2) as usize] as usize;
        let members = &self.members[owner];
        let likely = members.get(place).filter(|member| member.path == *path);
        let found = likely.or_else(|| members.iter().find(|member| member.path == *path))?;
        Some((found, face / 2 - self.order[owner].1))
    }
}

impl Flattener<'_, '_> {
    /// The equations of all connections, and zero flow for connectors left open.
    pub(crate) fn connect_all(&mut self) {
        self.register_all(self.tree.root);
        let order = self.connections.order.clone();
        let elements = self.connections.elements as usize;
        let mut owner: Vec<u32> = vec![0; elements];
        for (k, (_, base)) in order.iter().enumerate() {
            let end = order.get(k + 1).map_or(elements, |(_, next)| *next as usize);
            owner[*base as usize..end].fill(k as u32);
        }
        let members = order.iter().map(|(inst, _)| self.members(*inst)).collect();
        let nested = order
            .iter()
            .any(|(inst, _)| self.connector_around(*inst).is_some() || self.scopes.instances[*inst].expandable);
        let (starts, faces) = self.connections.sets();
        let broken = self.cuts(&starts, &faces);
        let mut joints = Joints { order, owner, members, nested, groups: FxHashMap::default(), broken };
        let sets = starts.windows(2).map(|range| &faces[range[0] as usize..range[1] as usize]);
        match joints.nested {
            true => self.equations_by_leaf(sets, &mut joints),
            false => sets.for_each(|set| self.set_equations(set, &mut joints)),
        }
        self.model.connects = joints.groups.keys().map(|(_, span)| *span).collect();
        self.model.connects.sort_unstable();
        self.model.connects.dedup();
    }

    /// The connections of overdetermined records in sets where one is broken.
    fn cuts(&mut self, starts: &[u32], faces: &[u32]) -> FxHashMap<u32, Vec<Cut>> {
        let mut cuts: FxHashMap<u32, Vec<Cut>> = FxHashMap::default();
        if !self.graph.joints.iter().any(|joint| joint.broken) {
            return cuts;
        }
        let mut first_of: FxHashMap<u32, u32> = FxHashMap::default();
        for range in starts.windows(2) {
            let set = &faces[range[0] as usize..range[1] as usize];
            first_of.extend(set.iter().map(|&face| (face, set[0])));
        }
        let connectors: FxHashMap<u32, InstId> =
            self.connections.ranges().flat_map(|(inst, elements)| elements.map(move |e| (e, inst))).collect();
        for k in 0..self.graph.joints.len() {
            let joint = &self.graph.joints[k];
            let (faces, (place, element), broken) = (joint.faces, joint.record, joint.broken);
            let (Some(&first), Some(&connector)) = (first_of.get(&faces[0]), connectors.get(&(faces[0] / 2))) else {
                continue;
            };
            let records = self.overdetermined_records(connector);
            cuts.entry(first).or_default().push(Cut { faces, records, place, element, broken });
        }
        cuts.retain(|_, cuts| cuts.iter().any(|cut| cut.broken));
        cuts
    }

    fn members(&self, connector: InstId) -> Vec<Member> {
        let member = |leaf: crate::connections::connect::Leaf| {
            let block = &self.model.variables[self.blocks[&leaf.inst]];
            Member {
                path: leaf.path,
                inst: leaf.inst,
                flow: leaf.flow,
                stream: leaf.stream,
                first: block.first,
                count: self.count_below(leaf.inst, connector),
                discrete: block.variability == Variability::Discrete,
                directed: self.direction_of(leaf.inst).is_some(),
            }
        };
        self.leaves(connector).into_iter().map(member).collect()
    }

    /// Elements of a connector variable per element of the connector.
    fn count_below(&self, leaf: InstId, connector: InstId) -> u32 {
        let (mut at, mut count) = (leaf, 1);
        while at != connector {
            count *= self.scopes.instances[at].dims.iter().product::<usize>();
            let Some(parent) = self.scopes.instances[at].parent else { break };
            at = parent;
        }
        count as u32
    }

    fn set_equations(&mut self, set: &[u32], joints: &mut Joints) {
        let first = set[0];
        // The outside face of a connector is seen only by connects inside its own component.
        if set.len() == 1 && first % 2 == OUTSIDE {
            return;
        }
        let connector = joints.owner[(first / 2) as usize] as usize;
        let declared = self.scopes.instances[joints.order[connector].0].span;
        let span = set.iter().find_map(|&f| self.connections.span[f as usize]).unwrap_or(declared);
        for place in 0..joints.members[connector].len() {
            let Member { count, .. } = joints.members[connector][place];
            for k in 0..count {
                if joints.members[connector][place].stream {
                    self.stream_equations(set, (connector, place, k), span, joints);
                    continue;
                }
                if !joints.broken.contains_key(&first) {
                    self.variable_equations(set, (connector, place, k), span, joints);
                    continue;
                }
                let path = joints.members[connector][place].path.clone();
                for part in joints.equal_parts(set, &path, k, count) {
                    self.variable_equations(&part, (connector, place, k), span, joints);
                }
            }
        }
    }

    /// The equations of scalar `k` of a variable of joined connectors, the variable given by its place in one of them.
    fn variable_equations(
        &mut self,
        set: &[u32],
        (connector, place, k): (usize, usize, u32),
        span: Span,
        joints: &mut Joints,
    ) {
        let mut variables: Vec<(VarId, bool)> = Vec::with_capacity(set.len());
        let mut discrete: Vec<bool> = Vec::with_capacity(set.len());
        let mut directed = false;
        let Member { count, flow, .. } = joints.members[connector][place];
        let path = &joints.members[connector][place].path;
        for &face in set {
            let Some((same, element)) = joints.same(face, place, path) else { continue };
            directed |= same.directed;
            discrete.push(same.discrete);
            variables.push((VarId(same.first.0 + element * count + k), face % 2 == OUTSIDE));
        }
        if flow {
            self.flow_sum(&variables, span, joints);
        } else if !(directed && self.sources_meet(set, span, path, &variables, joints)) {
            for (&(v, _), &other) in variables.iter().zip(&discrete).skip(1) {
                let section = if discrete[0] || other { Section::Discrete } else { Section::Continuous };
                self.potential_equality(section, variables[0].0, v, span, joints);
            }
        }
    }

    /// The equations where connectors that are part of others were connected by themselves: a variable may then stand in several sets, of
    /// the part and of the whole, which are one.
    fn equations_by_leaf<'f>(&mut self, sets: impl Iterator<Item = &'f [u32]>, joints: &mut Joints) {
        let mut leaves = Leaves::default();
        for set in sets {
            let first = set[0];
            if set.len() == 1 && first % 2 == OUTSIDE {
                continue;
            }
            let connector = joints.owner[(first / 2) as usize] as usize;
            let declared = self.scopes.instances[joints.order[connector].0].span;
            let span = set.iter().find_map(|&f| self.connections.span[f as usize]).unwrap_or(declared);
            for place in 0..joints.members[connector].len() {
                if joints.members[connector][place].stream {
                    for k in 0..joints.members[connector][place].count {
                        self.stream_equations(set, (connector, place, k), span, joints);
                    }
                }
            }
            for (place, Member { count, path, .. }) in joints.members[connector].iter().enumerate() {
                if joints.members[connector][place].stream {
                    continue;
                }
                for k in 0..*count {
                    for part in joints.equal_parts(set, path, k, *count) {
                        let same = part.iter().filter_map(|&face| {
                            let (member, element) = joints.same(face, place, path)?;
                            let joined_at = self.connections.span[face as usize].unwrap_or(span);
                            Some(Leaf {
                                variable: VarId(member.first.0 + element * count + k),
                                out: face % 2 == OUTSIDE,
                                flow: member.flow,
                                discrete: member.discrete,
                                directed: member.directed,
                                inst: member.inst,
                                joined_at,
                                span,
                            })
                        });
                        leaves.join(same);
                    }
                }
            }
        }
        let sets = leaves.sets();
        self.idle_buses(&sets, joints);
        for set in sets {
            let variables: Vec<(VarId, bool)> = set.iter().map(|leaf| (leaf.variable, leaf.out)).collect();
            let span = set[0].span;
            if set[0].flow {
                self.flow_sum(&variables, span, joints);
                continue;
            }
            let ends: Vec<_> = set.iter().map(|leaf| (leaf.inst, leaf.out, leaf.joined_at)).collect();
            if set.iter().any(|leaf| leaf.directed) && self.has_two_sources(&ends, &variables) {
                continue;
            }
            for leaf in &set[1..] {
                let section = if set[0].discrete || leaf.discrete { Section::Discrete } else { Section::Continuous };
                self.potential_equality(section, set[0].variable, leaf.variable, span, joints);
            }
        }
    }

    /// The connector that a connector is part of.
    fn connector_around(&self, connector: InstId) -> Option<InstId> {
        self.scopes.instances[connector]
            .parent
            .filter(|&above| self.scopes.instances[above].kind == ClassKind::Connector)
    }

    /// True, with a message, if several of the variables give a value.
    fn sources_meet(
        &mut self,
        set: &[u32],
        span: Span,
        path: &Name,
        variables: &[(VarId, bool)],
        joints: &Joints,
    ) -> bool {
        let leaf = |&face: &u32| {
            let (same, _) = joints.same(face, 0, path)?;
            let joined_at = self.connections.span[face as usize].unwrap_or(span);
            Some((same.inst, face % 2 == OUTSIDE, joined_at))
        };
        let leaves: Vec<_> = set.iter().filter_map(leaf).collect();
        self.has_two_sources(&leaves, variables)
    }

    fn potential_equality(&mut self, section: Section, a: VarId, b: VarId, span: Span, joints: &mut Joints) {
        if a == b {
            return;
        }
        let arena = &mut self.model.templates.arena;
        let (x, y) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
        let operands = [a, b].map(|v| Operand::new(Target::Var(v)));
        self.add_connection((section, false), (x, y), &operands, span, joints);
    }

    fn flow_sum(&mut self, variables: &[(VarId, bool)], span: Span, joints: &mut Joints) {
        let mut operands: Vec<Operand> =
            variables.iter().map(|&(v, out)| Operand::new(Target::Var(v)).signed(out)).collect();
        if operands.len() > LONGEST {
            let origin = Origin { path: self.path(self.tree.root), span };
            operands = self.bounded_sum(operands, &origin);
        }
        let arena = &mut self.model.templates.arena;
        let nodes: Vec<NodeId> = (0..operands.len()).map(|k| arena.slot(SlotId(k as u32))).collect();
        let sum = Fold::Sum.combine(arena, nodes);
        let zero = arena.constant(0.0);
        self.add_connection((Section::Continuous, false), (sum, zero), &operands, span, joints);
    }

    pub(crate) fn add_connection(
        &mut self,
        (section, made): (Section, bool),
        (left, right): (NodeId, NodeId),
        operands: &[Operand],
        span: Span,
        joints: &mut Joints,
    ) {
        let (id, order) = self.template(left, right);
        let ordered = order.iter().map(|s| operands[s.0 as usize]);
        let known = joints.groups.get(&(id, span)).copied();
        let like = |&k: &usize| (self.model.equations[k].section, self.model.equations[k].made) == (section, made);
        match known.filter(like) {
            Some(k) => {
                let block = &mut self.model.equations[k];
                block.count += 1;
                block.operands.extend(ordered);
            }
            None => {
                joints.groups.insert((id, span), self.model.equations.len());
                let origin = Origin { path: self.path(self.tree.root), span };
                let operands = ordered.collect();
                self.model.equations.push(EquationBlock { section, made, template: id, count: 1, operands, origin });
            }
        }
    }

    /// Connectors that no connect names take part with their open faces.
    fn register_all(&mut self, inst: InstId) {
        let instance = &self.scopes.instances[inst];
        if instance.absent {
            return;
        }
        if instance.kind == ClassKind::Connector {
            let parent = instance.parent.map(|p| self.scopes.instances[p].kind);
            // A connector inside a connector is part of it, unless it was connected by itself.
            if parent != Some(ClassKind::Connector) {
                let count: usize = hyd_instance::instance::full_dims(&self.scopes.instances, inst).iter().product();
                self.connections.register(inst, count as u32);
            }
            return;
        }
        for child in instance.children.clone() {
            self.register_all(child);
        }
    }
}
