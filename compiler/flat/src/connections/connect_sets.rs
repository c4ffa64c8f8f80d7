//! Sets of joined connectors to equations: potentials are equal, flows sum to zero (Modelica 3.6, section 9.2).
//!
//! What connectors consist of is looked up once per connector, not per connection.  Equations of one form that come
//! from one `connect` are one block.

use hyd_instance::InstId;
use hyd_source::{Origin, Span};
use hyd_symbolic::{NodeId, SlotId, TemplateId};
use hyd_syntax::tree::{ClassKind, Name};
use hyd_system::Variability;
use rustc_hash::FxHashMap;

use crate::connections::connect::OUTSIDE;
use crate::expressions::fold::{Fold, LONGEST};
use crate::model::{EquationBlock, Operand, Section, Target, VarId};
use crate::state::flattener::Flattener;

/// A variable of a connector with all that its equations need.
struct Member {
    path: Name,
    inst: InstId,
    flow: bool,
    /// Its first scalar, and how many belong to each element of the connector.
    first: VarId,
    count: u32,
    /// Changes at events only.
    discrete: bool,
    /// An input or output.
    directed: bool,
}

/// What is connected: connectors with the ranges of their elements, and the equations made so far.
struct Joints {
    order: Vec<(InstId, u32)>,
    /// Position in `order` of the connector of each element.
    owner: Vec<u32>,
    members: Vec<Vec<Member>>,
    /// Some connector that is part of another one was connected by itself.
    nested: bool,
    groups: FxHashMap<(TemplateId, Span), usize>,
}

impl Joints {
    /// The variable of the connector of a face that has this place and path in another connector, and the element of the face.
    fn same(&self, face: u32, place: usize, path: &Name) -> Option<(&Member, u32)> {
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
        let nested = order.iter().any(|(inst, _)| self.connector_around(*inst).is_some());
        let mut joints = Joints { order, owner, members, nested, groups: FxHashMap::default() };
        let (starts, faces) = self.connections.sets();
        for range in starts.windows(2) {
            self.set_equations(&faces[range[0] as usize..range[1] as usize], &mut joints);
        }
        self.model.connects = joints.groups.keys().map(|(_, span)| *span).collect();
        self.model.connects.sort_unstable();
        self.model.connects.dedup();
    }

    fn members(&self, connector: InstId) -> Vec<Member> {
        let member = |leaf: crate::connections::connect::Leaf| {
            let block = &self.model.variables[self.blocks[&leaf.inst]];
            Member {
                path: leaf.path,
                inst: leaf.inst,
                flow: leaf.flow,
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
            count *= self.tree.instances[at].dims.iter().product::<usize>();
            let Some(parent) = self.tree.instances[at].parent else { break };
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
        let declared = self.tree.instances[joints.order[connector].0].span;
        let span = set.iter().find_map(|&f| self.connections.span[f as usize]).unwrap_or(declared);
        let mut variables: Vec<(VarId, bool)> = Vec::with_capacity(set.len());
        let mut discrete: Vec<bool> = Vec::with_capacity(set.len());
        for place in 0..joints.members[connector].len() {
            let Member { count, flow, .. } = joints.members[connector][place];
            for k in 0..count {
                variables.clear();
                discrete.clear();
                let mut directed = false;
                let path = &joints.members[connector][place].path;
                for &face in set {
                    let Some((same, element)) = joints.same(face, place, path) else { continue };
                    directed |= same.directed;
                    discrete.push(same.discrete);
                    variables.push((VarId(same.first.0 + element * count + k), face % 2 == OUTSIDE));
                }
                if flow && set.len() == 1 && joints.nested && self.flows_elsewhere(first / 2, (place, k), joints) {
                    continue;
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
        }
    }

    /// Whether the flow of a connector that is open as such is that of another connection: of the connector that it is part of, or
    /// of one that is part of it.
    fn flows_elsewhere(&self, element: u32, (place, k): (usize, u32), joints: &Joints) -> bool {
        let owner = joints.owner[element as usize] as usize;
        let (connector, base) = joints.order[owner];
        // The whole is left open or connected as one.
        if self.connector_around(connector).is_some() {
            return true;
        }
        let Member { inst, count, .. } = joints.members[owner][place];
        let scalar = (element - base) * count + k;
        let mut at = inst;
        while at != connector {
            if let Some(range) = self.connections.range(at)
                && !self.connections.is_open(range.start + scalar / self.count_below(inst, at).max(1))
            {
                return true;
            }
            let Some(parent) = self.tree.instances[at].parent else { break };
            at = parent;
        }
        false
    }

    /// The connector that a connector is part of.
    fn connector_around(&self, connector: InstId) -> Option<InstId> {
        self.tree.instances[connector].parent.filter(|&above| self.tree.instances[above].kind == ClassKind::Connector)
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
        self.add_connection(section, (x, y), &operands, span, joints);
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
        self.add_connection(Section::Continuous, (sum, zero), &operands, span, joints);
    }

    fn add_connection(
        &mut self,
        section: Section,
        (left, right): (NodeId, NodeId),
        operands: &[Operand],
        span: Span,
        joints: &mut Joints,
    ) {
        let (id, order) = self.template(left, right);
        let ordered = order.iter().map(|s| operands[s.0 as usize]);
        let known = joints.groups.get(&(id, span)).copied();
        match known.filter(|&k| self.model.equations[k].section == section) {
            Some(k) => {
                let block = &mut self.model.equations[k];
                block.count += 1;
                block.operands.extend(ordered);
            }
            None => {
                joints.groups.insert((id, span), self.model.equations.len());
                let origin = Origin { path: self.path(self.tree.root), span };
                let operands = ordered.collect();
                self.model.equations.push(EquationBlock {
                    section,
                    made: false,
                    template: id,
                    count: 1,
                    operands,
                    origin,
                });
            }
        }
    }

    /// Connectors that no connect names take part with their open faces.
    fn register_all(&mut self, inst: InstId) {
        let instance = &self.tree.instances[inst];
        if instance.absent {
            return;
        }
        if instance.kind == ClassKind::Connector {
            let parent = instance.parent.map(|p| self.tree.instances[p].kind);
            // A connector inside a connector is part of it, unless it was connected by itself.
            if parent != Some(ClassKind::Connector) {
                let count: usize = hyd_instance::instance::full_dims(&self.tree.instances, inst).iter().product();
                self.connections.register(inst, count as u32);
            }
            return;
        }
        for child in instance.children.clone() {
            self.register_all(child);
        }
    }
}
