//! Connections: sets of connector elements, then equality and sum-to-zero equations.
//!
//! Each element of a connector has two faces: inside (seen by the model that contains its component) and outside (seen from
//! within its own component).  `connect` joins faces; per set potentials are equal and flows sum to zero, inside
//! faces counted positive, outside ones negative; a face in no set has zero flow (Modelica 3.6, section 9.2).

use hyd_instance::{InstId, Resolved, Scope};
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{NodeId, SlotId, TemplateId, canonical};
use hyd_syntax::tree::{ClassKind, ComponentRef, Expr, Name, Variability};
use rustc_hash::FxHashMap;

use crate::context::Fail;
use crate::flatten::Flattener;
use crate::fold::Fold;
use crate::index::Affine;
use crate::model::{EquationBlock, Operand, Section, Target, VarId};
use crate::section::Loops;

/// Faces of a connector element.
const INSIDE: u32 = 0;
const OUTSIDE: u32 = 1;

/// The faces joined so far (union by size with path halving).
#[derive(Default)]
pub(crate) struct Connections {
    /// First element of each connector instance.
    base: FxHashMap<InstId, u32>,
    /// Connector instance of each element range, in the order met.
    order: Vec<(InstId, u32)>,
    parent: Vec<u32>,
    size: Vec<u32>,
    /// Text that first joined a face.
    span: Vec<Option<Span>>,
    elements: u32,
}

impl Connections {
    fn find(&mut self, mut k: u32) -> u32 {
        while self.parent[k as usize] != k {
            let up = self.parent[self.parent[k as usize] as usize];
            self.parent[k as usize] = up;
            k = up;
        }
        k
    }

    fn join(&mut self, a: u32, b: u32, span: Span) {
        for face in [a, b] {
            self.span[face as usize].get_or_insert(span);
        }
        let (mut a, mut b) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        if self.size[a as usize] < self.size[b as usize] {
            std::mem::swap(&mut a, &mut b);
        }
        self.parent[b as usize] = a;
        self.size[a as usize] += self.size[b as usize];
    }

    /// How many elements of a connector are connected at a face, and how many there are; `None` if no connect knows it.
    pub(crate) fn joined(&mut self, inst: InstId, face: u32) -> Option<(i64, i64)> {
        let base = *self.base.get(&inst)?;
        let next = self.order.iter().map(|(_, base)| *base).filter(|&b| b > base).min();
        let end = next.unwrap_or(self.elements);
        let mut joined = 0;
        for element in base..end {
            let root = self.find(2 * element + face);
            joined += i64::from(self.size[root as usize] > 1);
        }
        Some((joined, i64::from(end - base)))
    }

    fn register(&mut self, inst: InstId, count: u32) -> u32 {
        if let Some(&base) = self.base.get(&inst) {
            return base;
        }
        let base = self.elements;
        self.base.insert(inst, base);
        self.order.push((inst, base));
        self.elements += count;
        for face in 2 * base..2 * self.elements {
            self.parent.push(face);
            self.size.push(1);
            self.span.push(None);
        }
        base
    }
}

/// A variable of a connector: its path inside, the instance, elements per connector element.
pub(crate) struct Leaf {
    pub(crate) path: String,
    pub(crate) inst: InstId,
    pub(crate) flow: bool,
}

/// One side of a connect: the connector, its elements for one value of the loops, which face.
pub(crate) struct Side {
    pub(crate) inst: InstId,
    elements: Vec<u32>,
    pub(crate) shape: Vec<usize>,
    face: u32,
}

impl Flattener<'_, '_> {
    pub(crate) fn connect(&mut self, span: Span, a: &ComponentRef, b: &ComponentRef, scope: Scope, loops: &Loops<'_>) {
        let counts = {
            let mut cx = self.context_of(scope);
            match self.enter_all(&mut cx, loops) {
                Ok(()) => cx.counts,
                Err(Fail::Reported | Fail::Opaque) => return,
                Err(Fail::NeedsExpansion | Fail::Split(..)) => {
                    self.connect_expanded(span, a, b, scope, loops, Vec::new());
                    return;
                }
            }
        };
        let total: usize = counts.iter().product();
        let mut counters = vec![0i64; counts.len()];
        for _ in 0..total {
            if self.connect_once(span, a, b, scope, loops, counters.clone()).is_err() {
                return;
            }
            for k in (0..counters.len()).rev() {
                counters[k] += 1;
                if (counters[k] as usize) < counts[k] {
                    break;
                }
                counters[k] = 0;
            }
        }
    }

    /// Loops whose ranges depend on each other.
    fn connect_expanded(
        &mut self,
        span: Span,
        a: &ComponentRef,
        b: &ComponentRef,
        scope: Scope,
        loops: &Loops<'_>,
        fixed: Vec<i64>,
    ) {
        let mut cx = self.context_of(scope);
        cx.fixed = Some(fixed.clone());
        match self.enter_all(&mut cx, loops) {
            Ok(()) if cx.counts.len() == fixed.len() => {
                let _ = self.connect_once(span, a, b, scope, loops, fixed);
            }
            Err(Fail::Reported) => {}
            _ => {
                let Some(&count) = cx.counts.get(fixed.len()) else { return };
                for k in 0..count as i64 {
                    let mut next = fixed.clone();
                    next.push(k);
                    self.connect_expanded(span, a, b, scope, loops, next);
                }
            }
        }
    }

    fn connect_once(
        &mut self,
        span: Span,
        a: &ComponentRef,
        b: &ComponentRef,
        scope: Scope,
        loops: &Loops<'_>,
        fixed: Vec<i64>,
    ) -> Result<(), Fail> {
        let mut cx = self.context_of(scope);
        cx.fixed = Some(fixed);
        self.enter_all(&mut cx, loops)?;
        let (Some(left), Some(right)) = (self.side(a, scope, &mut cx)?, self.side(b, scope, &mut cx)?) else {
            return Ok(());
        };
        self.check_connectors(span, a, b, &left, &right)?;
        for (&x, &y) in left.elements.iter().zip(&right.elements) {
            self.connections.join(2 * x + left.face, 2 * y + right.face, span);
        }
        Ok(())
    }

    /// The connector a reference names; `None` if it (or what it is in) does not exist.
    fn side(
        &mut self,
        reference: &ComponentRef,
        scope: Scope,
        cx: &mut crate::context::Context,
    ) -> Result<Option<Side>, Fail> {
        if self.leads_to_absent(reference, scope) {
            return Ok(None);
        }
        let Resolved::Variable(steps) = self.tree.resolve(scope, reference)? else {
            return Err(self.error(
                Code::ConnectorMismatch,
                reference.span,
                format!("`{}` is not a connector", self.tree.table.files.snippet(reference.span)),
            ));
        };
        let (last, _) = steps[steps.len() - 1];
        if self.tree.instances[last].absent {
            return Ok(None);
        }
        if self.tree.instances[last].kind != ClassKind::Connector {
            if self.tree.is_broken(last) {
                return Err(Fail::Reported);
            }
            let name = self.tree.table.files.snippet(reference.span).to_string();
            let declared = self.tree.instances[last].span;
            self.report(
                Diagnostic::error(Code::ConnectorMismatch, format!("`{name}` is not a connector"))
                    .at(reference.span, "")
                    .with(declared, "declared here"),
            );
            return Err(Fail::Reported);
        }
        let first = steps[0].0;
        let own = self.tree.instances[first].parent == Some(scope.inst)
            && self.tree.instances[first].kind == ClassKind::Connector;
        let dims = hyd_instance::instance::full_dims(&self.tree.instances, last);
        let count: usize = dims.iter().product();
        let base = self.connections.register(last, count as u32);
        let (offsets, shape) = self.connector_elements(reference.span, &steps, cx)?;
        let elements = offsets.into_iter().map(|k| base + k as u32).collect();
        Ok(Some(Side { inst: last, elements, shape, face: if own { OUTSIDE } else { INSIDE } }))
    }

    fn leads_to_absent(&self, reference: &ComponentRef, scope: Scope) -> bool {
        let mut current = scope.inst;
        for part in &reference.parts {
            match self.tree.instances[current].by_name.get(&part.name.name) {
                Some(&next) => current = next,
                None => return false,
            }
            if self.tree.instances[current].absent {
                return true;
            }
        }
        false
    }

    /// Positions of the connector elements named, and their sizes (whole arrays of connectors can be connected).
    fn connector_elements(
        &mut self,
        span: Span,
        steps: &[(InstId, &[Expr])],
        cx: &mut crate::context::Context,
    ) -> Result<(Vec<usize>, Vec<usize>), Fail> {
        let reference_shape = self.steps_shape(steps, cx)?;
        let total: usize = reference_shape.iter().product();
        let mut positions = Vec::with_capacity(total);
        for k in 0..total {
            let mut rest = k;
            let mut at = vec![Affine::constant(0); reference_shape.len()];
            for (position, &size) in reference_shape.iter().enumerate().rev() {
                at[position] = Affine::constant((rest % size) as i64);
                rest /= size;
            }
            let (offset, _) = self.position_of(span, steps, cx, &at)?;
            positions.push(offset.as_constant().ok_or(Fail::NeedsExpansion)? as usize);
        }
        Ok((positions, reference_shape))
    }

    /// The variables of a connector (itself, if it is one), in the order of the text.
    pub(crate) fn leaves(&self, inst: InstId) -> Vec<Leaf> {
        let mut result = Vec::new();
        self.collect_leaves(inst, String::new(), false, &mut result);
        result
    }

    fn collect_leaves(&self, inst: InstId, path: String, flow: bool, result: &mut Vec<Leaf>) {
        let instance = &self.tree.instances[inst];
        let flow = flow || instance.flow;
        if instance.primitive.is_some() {
            // A parameter is no part of what is connected, but an input of the model that became one is.
            let varies = instance.variability > Variability::Parameter || self.is_input_of_the_model(inst);
            if varies && self.blocks.contains_key(&inst) {
                result.push(Leaf { path, inst, flow });
            }
            return;
        }
        for &child in &instance.children {
            let name: &Name = &self.tree.instances[child].name;
            let below = if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
            self.collect_leaves(child, below, flow, result);
        }
    }

    /// The equations of all connections, and zero flow for connectors left open.
    pub(crate) fn connect_all(&mut self) {
        self.register_all(self.tree.root);
        let elements = self.connections.elements as usize;
        let mut owner: Vec<u32> = vec![0; elements];
        let order = self.connections.order.clone();
        for (k, (_, base)) in order.iter().enumerate() {
            let end = order.get(k + 1).map_or(elements, |(_, next)| *next as usize);
            owner[*base as usize..end].fill(k as u32);
        }
        let leaves: Vec<Vec<Leaf>> = order.iter().map(|(inst, _)| self.leaves(*inst)).collect();
        let mut sets: FxHashMap<u32, usize> = FxHashMap::default();
        let mut members: Vec<Vec<u32>> = Vec::new();
        for face in 0..2 * elements as u32 {
            let root = self.connections.find(face);
            let set = *sets.entry(root).or_insert_with(|| {
                members.push(Vec::new());
                members.len() - 1
            });
            members[set].push(face);
        }
        let mut groups: FxHashMap<(TemplateId, Span), usize> = FxHashMap::default();
        for set in &members {
            self.set_equations(set, &order, &owner, &leaves, &mut groups);
        }
    }

    fn set_equations(
        &mut self,
        set: &[u32],
        order: &[(InstId, u32)],
        owner: &[u32],
        leaves: &[Vec<Leaf>],
        groups: &mut FxHashMap<(TemplateId, Span), usize>,
    ) {
        let first = set[0];
        let alone = set.len() == 1;
        // The outside face of a connector is seen only by connects inside its own component.
        if alone && first % 2 == OUTSIDE {
            return;
        }
        let connector = owner[(first / 2) as usize] as usize;
        let declared = self.tree.instances[order[connector].0].span;
        let span = set.iter().find_map(|&f| self.connections.span[f as usize]).unwrap_or(declared);
        for leaf in &leaves[connector] {
            let count = self.own_count(leaf.inst, order[connector].0);
            for k in 0..count {
                let mut variables = Vec::with_capacity(set.len());
                let mut same_leaves = Vec::with_capacity(set.len());
                for &face in set {
                    let other = owner[(face / 2) as usize] as usize;
                    let Some(same) = leaves[other].iter().find(|l| l.path == leaf.path) else { continue };
                    let element = face / 2 - order[other].1;
                    let base = self.model.variables[self.blocks[&same.inst]].first.0;
                    let joined_at = self.connections.span[face as usize].unwrap_or(span);
                    same_leaves.push((same.inst, face % 2 == OUTSIDE, joined_at));
                    variables.push((VarId(base + element * count as u32 + k as u32), face % 2 == OUTSIDE));
                }
                if !leaf.flow && self.has_two_sources(&same_leaves, &variables) {
                    continue;
                }
                if leaf.flow {
                    self.flow_sum(&variables, span, groups);
                } else {
                    for &(v, _) in &variables[1..] {
                        self.potential_equality(variables[0].0, v, span, groups);
                    }
                }
            }
        }
    }

    /// Elements of a connector variable per element of the connector.
    fn own_count(&self, leaf: InstId, connector: InstId) -> usize {
        let all: usize = hyd_instance::instance::full_dims(&self.tree.instances, leaf).iter().product();
        let outer: usize = hyd_instance::instance::full_dims(&self.tree.instances, connector).iter().product();
        all.checked_div(outer).unwrap_or(0)
    }

    fn potential_equality(
        &mut self,
        a: VarId,
        b: VarId,
        span: Span,
        groups: &mut FxHashMap<(TemplateId, Span), usize>,
    ) {
        if a == b {
            return;
        }
        let arena = &mut self.model.templates.arena;
        let (x, y) = (arena.slot(SlotId(0)), arena.slot(SlotId(1)));
        let discrete = {
            let variability = |v| self.model.variables[self.model.locate(v).0].variability;
            [a, b].into_iter().any(|v| variability(v) == hyd_system::Variability::Discrete)
        };
        let section = if discrete { Section::Discrete } else { Section::Continuous };
        self.add_connection(section, x, y, &[Operand::new(Target::Var(a)), Operand::new(Target::Var(b))], span, groups);
    }

    fn flow_sum(&mut self, variables: &[(VarId, bool)], span: Span, groups: &mut FxHashMap<(TemplateId, Span), usize>) {
        let operands = variables.iter().map(|&(v, out)| Operand::new(Target::Var(v)).signed(out)).collect();
        let origin = Origin { path: self.path(self.tree.root), span };
        let operands = self.bounded_sum(operands, &origin);
        let arena = &mut self.model.templates.arena;
        let nodes: Vec<NodeId> = (0..operands.len()).map(|k| arena.slot(SlotId(k as u32))).collect();
        let sum = Fold::Sum.combine(arena, nodes);
        let zero = arena.constant(0.0);
        self.add_connection(Section::Continuous, sum, zero, &operands, span, groups);
    }

    fn add_connection(
        &mut self,
        section: Section,
        left: NodeId,
        right: NodeId,
        operands: &[Operand],
        span: Span,
        groups: &mut FxHashMap<(TemplateId, Span), usize>,
    ) {
        let (template, order) = canonical(&mut self.model.templates.arena, left, right);
        let id = self.model.templates.intern(template);
        let ordered: Vec<Operand> = order.iter().map(|s| operands[s.0 as usize]).collect();
        let known = groups.get(&(id, span)).copied().filter(|&k| self.model.equations[k].section == section);
        match known {
            Some(k) => {
                let block = &mut self.model.equations[k];
                block.count += 1;
                block.operands.extend(ordered);
            }
            None => {
                groups.insert((id, span), self.model.equations.len());
                let origin = Origin { path: self.path(self.tree.root), span };
                self.model.equations.push(EquationBlock { section, template: id, count: 1, operands: ordered, origin });
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
