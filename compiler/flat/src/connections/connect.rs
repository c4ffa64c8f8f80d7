//! Connections: which connector elements are joined (`connect_sets` makes the equations).
//!
//! Each element of a connector has two faces: inside (seen by the model that contains its component) and outside (seen from
//! within its own component).  `connect` joins faces; per set potentials are equal and flows sum to zero, inside
//! faces counted positive, outside ones negative; a face in no set has zero flow (Modelica 3.6, section 9.2).

use std::ops::Range;

use hyd_instance::{InstId, Scope};
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassKind, Name, Variability};
use hyd_typed::Expr;
use rustc_hash::FxHashMap;

use crate::connections::equality_constraints::Record;
use crate::sections::loops::Loops;
use crate::sections::section::MOST_CUTS;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, advance};

/// Faces of a connector element.
const INSIDE: u32 = 0;
pub(crate) const OUTSIDE: u32 = 1;

/// The faces joined so far (union by size with path halving).
#[derive(Default)]
pub(crate) struct Connections {
    /// The elements of each connector instance.
    base: FxHashMap<InstId, Range<u32>>,
    /// Connector instance of each element range, in the order met.
    pub(crate) order: Vec<(InstId, u32)>,
    parent: Vec<u32>,
    size: Vec<u32>,
    /// How often a face stands in a `connect`.
    degree: Vec<u32>,
    /// Text that first joined a face.
    pub(crate) span: Vec<Option<Span>>,
    pub(crate) elements: u32,
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
            self.degree[face as usize] += 1;
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

    /// How often each element of a connector stands in a `connect`, inside and outside of its component.
    pub(crate) fn counted(&self) -> FxHashMap<InstId, Vec<u32>> {
        let degree = |element: u32| self.degree[2 * element as usize] + self.degree[2 * element as usize + 1];
        self.ranges().map(|(inst, elements)| (inst, elements.map(degree).collect())).collect()
    }

    /// How many elements of a connector are connected at a face, and how many there are; `None` if no connect knows it.
    pub(crate) fn joined(&mut self, inst: InstId, face: u32) -> Option<(i64, i64)> {
        let elements = self.range(inst)?;
        let all = elements.len() as i64;
        let joined = elements.filter(|element| !self.is_alone(2 * element + face)).count();
        Some((joined as i64, all))
    }

    /// The elements of a connector; `None` if no connect knows it.
    pub(crate) fn range(&self, inst: InstId) -> Option<Range<u32>> {
        self.base.get(&inst).cloned()
    }

    /// All connectors met with their elements, in the order met.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (InstId, Range<u32>)> {
        self.order.iter().filter_map(|&(inst, _)| Some((inst, self.range(inst)?)))
    }

    /// Whether nothing is connected to an element from outside of its component.
    pub(crate) fn is_open(&self, element: u32) -> bool {
        self.is_alone(2 * element + INSIDE)
    }

    fn is_alone(&self, face: u32) -> bool {
        self.parent[face as usize] == face && self.size[face as usize] == 1
    }

    /// With how many other faces an element is connected from outside of its component.
    pub(crate) fn partners(&self, element: u32) -> u32 {
        let mut face = 2 * element + INSIDE;
        while self.parent[face as usize] != face {
            face = self.parent[face as usize];
        }
        self.size[face as usize] - 1
    }

    /// Whether two elements are in one set, seen from outside of their components.
    pub(crate) fn are_joined(&mut self, one: u32, other: u32) -> bool {
        self.find(2 * one + INSIDE) == self.find(2 * other + INSIDE)
    }

    /// The text that first connected an element from outside of its component.
    pub(crate) fn joined_at(&self, element: u32) -> Option<Span> {
        self.span[(2 * element + INSIDE) as usize]
    }

    /// The sets of joined faces, in the order of their first faces: where each starts in the list, and the list.
    pub(crate) fn sets(&mut self) -> (Vec<u32>, Vec<u32>) {
        let count = 2 * self.elements;
        let mut set_of_root = vec![u32::MAX; count as usize];
        let mut starts = vec![0];
        for face in 0..count {
            let root = self.find(face) as usize;
            if set_of_root[root] == u32::MAX {
                set_of_root[root] = starts.len() as u32 - 1;
                starts.push(starts[starts.len() - 1] + self.size[root]);
            }
        }
        let mut next = starts.clone();
        let mut faces = vec![0; count as usize];
        for face in 0..count {
            let place = &mut next[set_of_root[self.find(face) as usize] as usize];
            faces[*place as usize] = face;
            *place += 1;
        }
        (starts, faces)
    }

    pub(crate) fn register(&mut self, inst: InstId, count: u32) -> u32 {
        if let Some(known) = self.base.get(&inst) {
            return known.start;
        }
        let base = self.elements;
        self.base.insert(inst, base..base + count);
        self.order.push((inst, base));
        self.elements += count;
        for face in 2 * base..2 * self.elements {
            self.parent.push(face);
            self.size.push(1);
            self.degree.push(0);
            self.span.push(None);
        }
        base
    }
}

/// A variable of a connector: its path inside, the instance, elements per connector element.
pub(crate) struct Leaf {
    pub(crate) path: Name,
    pub(crate) inst: InstId,
    pub(crate) flow: bool,
    pub(crate) stream: bool,
}

/// One side of a connect: the connector, its elements, which face.
pub(crate) struct Side {
    pub(crate) inst: InstId,
    /// Number of its first element.
    base: u32,
    /// The elements from there, several where an array is connected as a whole.
    offsets: Vec<Affine>,
    pub(crate) shape: Vec<usize>,
    face: u32,
}

impl Side {
    /// The face of an element for these values of the counters.
    fn face_at(&self, offset: &Affine, counters: &[i64]) -> u32 {
        2 * (self.base + offset.at(counters) as u32) + self.face
    }
}

impl Flattener<'_, '_> {
    pub(crate) fn connect(&mut self, span: Span, a: &Expr, b: &Expr, scope: Scope, loops: &Loops<'_>) {
        let start = Context { cuts_left: MOST_CUTS, ..self.context_of(scope) };
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            if cx.counts.contains(&0) {
                return Ok(());
            }
            let (left, right) = (flat.side(a, scope, cx)?, flat.side(b, scope, cx)?);
            flat.check_connectors(span, [a.span, b.span], &left, &right)?;
            flat.join_over_loops(span, &left, &right, &cx.loop_counts());
            Ok(())
        });
    }

    /// Joins the faces for all values of the counters.
    fn join_over_loops(&mut self, span: Span, left: &Side, right: &Side, counts: &[usize]) {
        let mut counters = vec![0i64; counts.len()];
        for _ in 0..counts.iter().product() {
            for (x, y) in left.offsets.iter().zip(&right.offsets) {
                self.connections.join(left.face_at(x, &counters), right.face_at(y, &counters), span);
            }
            advance(&mut counters, counts);
        }
        self.join_records(span, left, right, counts);
    }

    /// Notes the overdetermined records that a connection joins.
    fn join_records(&mut self, span: Span, left: &Side, right: &Side, counts: &[usize]) {
        let (ours, theirs) = (self.overdetermined_records(left.inst), self.overdetermined_records(right.inst));
        for (place, record) in ours.iter().enumerate() {
            let Some(other) = theirs.iter().find(|other| other.path == record.path) else { continue };
            let mut counters = vec![0i64; counts.len()];
            for _ in 0..counts.iter().product() {
                for (x, y) in left.offsets.iter().zip(&right.offsets) {
                    let faces = [left.face_at(x, &counters), right.face_at(y, &counters)];
                    for k in 0..record.count {
                        let node = |record: &Record, offset: &Affine| {
                            (record.inst, offset.at(&counters) as u32 * record.count + k)
                        };
                        self.graph.connect([node(record, x), node(other, y)], faces, (place, k), span);
                    }
                }
                advance(&mut counters, counts);
            }
        }
    }

    /// The connector an expression names.
    fn side(&mut self, expr: &Expr, scope: Scope, cx: &mut Context) -> Result<Side, Fail> {
        let Some(variable) = expr.variable() else { return Err(Fail::Reported) };
        let last = variable.last();
        if self.scopes.instances[last].kind != ClassKind::Connector && !self.is_of_bus(last) {
            if self.scopes.is_broken(last) {
                return Err(Fail::Reported);
            }
            let name = self.scopes.table.files.snippet(expr.span).to_string();
            let declared = self.scopes.instances[last].span;
            self.report(
                Diagnostic::error(Code::ConnectorMismatch, format!("`{name}` is not a connector"))
                    .at(expr.span, "")
                    .with(declared, "declared here"),
            );
            return Err(Fail::Reported);
        }
        let first = variable.steps[0].0;
        let own = self.scopes.instances[first].parent == Some(scope.inst)
            && self.scopes.instances[first].kind == ClassKind::Connector;
        let dims = hyd_instance::instance::full_dims(&self.scopes.instances, last);
        let count: usize = dims.iter().product();
        let base = self.connections.register(last, count as u32);
        let (offsets, shape) = self.connector_elements(expr.span, &variable.steps, cx)?;
        Ok(Side { inst: last, base, offsets, shape, face: if own { OUTSIDE } else { INSIDE } })
    }

    /// True for a variable of an expandable connector, which can be connected by itself.
    pub(crate) fn is_of_bus(&self, inst: InstId) -> bool {
        let instance = &self.scopes.instances[inst];
        let parent = instance.parent.map(|parent| &self.scopes.instances[parent]);
        parent.is_some_and(|parent| match instance.kind {
            ClassKind::Connector | ClassKind::Type => parent.expandable,
            _ => false,
        })
    }

    /// Positions of the connector elements named, and their sizes (whole arrays of connectors can be connected).
    fn connector_elements(
        &mut self,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
        cx: &mut Context,
    ) -> Result<(Vec<Affine>, Vec<usize>), Fail> {
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
            positions.push(self.position_of(span, steps, cx, &at)?.0);
        }
        Ok((positions, reference_shape))
    }

    /// The variables of a connector (itself, if it is one), in the order of the text.
    pub(crate) fn leaves(&self, inst: InstId) -> Vec<Leaf> {
        let mut result = Vec::new();
        self.collect_leaves(inst, None, false, &mut result);
        result
    }

    fn collect_leaves(&self, inst: InstId, path: Option<Name>, flow: bool, result: &mut Vec<Leaf>) {
        let instance = &self.scopes.instances[inst];
        let flow = flow || instance.flow;
        if instance.primitive.is_some() {
            // A parameter is not part of what is connected, but an input of the model that became one is.
            let varies = self.scopes.variability(inst) > Variability::Parameter || self.is_input_of_the_model(inst);
            if varies && self.blocks.contains_key(&inst) {
                result.push(Leaf { path: path.unwrap_or_default(), inst, flow, stream: instance.stream });
            }
            return;
        }
        for &child in &instance.children {
            let name: &Name = &self.scopes.instances[child].name;
            let below = match &path {
                None => name.clone(),
                Some(path) => format!("{path}.{name}").into(),
            };
            self.collect_leaves(child, Some(below), flow, result);
        }
    }
}
