//! Stream variables: what a flow carries where it leaves a component, and what flows in (Modelica 3.6, chapter 15).
//!
//! A stream variable is what its component would let out; of what flows in `inStream` tells.  Each stream variable has a second variable for
//! that, so loops and arrays of components refer to it like to any other; its equation follows from what is connected: what the others let
//! out, mixed in the proportion in which they do.  A connector that is seen from within its component lets out what the others inside
//! mix to.  Where nothing flows the mixture is that of equal parts, which keeps the equations regular.

use hyd_instance::InstId;
use hyd_source::{Code, Span};
use hyd_symbolic::{Arena, Node, NodeId, Relation, SlotId};
use hyd_syntax::tree::ClassKind;
use hyd_system::math::Function;
use hyd_typed::{Expr, Kind as Form, Variable};

use crate::connections::connect::OUTSIDE;
use crate::connections::connect_sets::Joints;
use crate::expressions::builtin_call::BuiltinCall;
use crate::model::{Operand, Section, Target, VarId};
use crate::state::context::Fail;
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::node::Typed;

/// Flows that are small beside any that matter, in the unit of the flow: below, the proportions of a mixture go over to equal parts (the `eps`
/// of section 15.2).
const SMALL_FLOW: f64 = 1e-7;

/// A connector of a set as the streams see it.
struct Port {
    /// What it lets into the set, of a connector seen from within its component what it lets in from outside.
    lets: VarId,
    /// What is to be determined.
    takes: VarId,
    /// The flow into the set.
    flow: Operand,
    /// Something may flow into the set.
    may_flow: bool,
    outside: bool,
}

impl Flattener<'_, '_> {
    /// The equations of scalar `k` of a stream variable of joined connectors, the variable given by its place in one of them.
    pub(crate) fn stream_equations(
        &mut self,
        set: &[u32],
        (connector, place, k): (usize, usize, u32),
        span: Span,
        joints: &mut Joints,
    ) {
        let mut ports = Vec::with_capacity(set.len());
        for &face in set {
            match self.port(face, (connector, place, k), joints) {
                Some(port) => ports.push(port),
                None => {
                    let message = "a connector with stream variables needs one flow variable that is a scalar";
                    let declared = self.scopes.instances[joints.order[connector].0].span;
                    let _ = self.error(Code::ConnectorMismatch, declared, message);
                    return;
                }
            }
        }
        for at in 0..ports.len() {
            let own = &ports[at];
            let others = || ports.iter().enumerate().filter(|&(other, port)| other != at && port.may_flow);
            let sources: Vec<(Operand, VarId)> = others().map(|(_, port)| (port.flow, port.lets)).collect();
            // Where nothing can flow in, what comes out stands for it.
            let alone = own.lets;
            let (takes, made) = (Operand::new(Target::Var(own.takes)), !own.outside);
            let mut operands = vec![takes];
            let arena = &mut self.model.templates.arena;
            let right = match sources.as_slice() {
                [] => {
                    operands.push(Operand::new(Target::Var(alone)));
                    arena.slot(SlotId(1))
                }
                [(_, only)] => {
                    operands.push(Operand::new(Target::Var(*only)));
                    arena.slot(SlotId(1))
                }
                all => {
                    operands.extend(all.iter().flat_map(|&(flow, value)| [flow, Operand::new(Target::Var(value))]));
                    mixture(arena, all.len())
                }
            };
            let left = arena.slot(SlotId(0));
            self.add_connection((Section::Continuous, made), (left, right), &operands, span, joints);
        }
    }

    /// The connector of a face; none if it has no flow of its own.
    fn port(&self, face: u32, (connector, place, k): (usize, usize, u32), joints: &Joints) -> Option<Port> {
        let path = &joints.members[connector][place].path;
        let (member, element) = joints.same(face, place, path)?;
        let at = element * member.count + k;
        let value = VarId(member.first.0 + at);
        let inflow = VarId(self.in_streams.get(&member.inst)?.0 + at);
        let owner = joints.owner[(face / 2) as usize] as usize;
        let mut flows = joints.members[owner].iter().filter(|member| member.flow && member.count == 1);
        let flow = flows.next().filter(|_| flows.next().is_none())?;
        let outside = face % 2 == OUTSIDE;
        let v = VarId(flow.first.0 + element);
        let (block, scalar) = self.model.locate(v);
        let block = &self.model.variables[block];
        let may_flow = if outside { block.max.get(scalar) > 0.0 } else { block.min.get(scalar) < 0.0 };
        let (lets, takes) = if outside { (inflow, value) } else { (value, inflow) };
        Some(Port { lets, takes, flow: Operand::new(Target::Var(v)).signed(!outside), may_flow, outside })
    }
}

/// The mean of values weighed by flows: slots 1, 3, ... are the flows and 2, 4, ... the values.
fn mixture(arena: &mut Arena, count: usize) -> NodeId {
    let zero = arena.constant(0.0);
    let one = arena.constant(1.0);
    let small = arena.constant(SMALL_FLOW);
    let slot = |arena: &mut Arena, k: usize| arena.slot(SlotId(k as u32));
    let flows: Vec<NodeId> = (0..count)
        .map(|k| {
            let flow = slot(arena, 2 * k + 1);
            arena.call2(Function::Max, flow, zero)
        })
        .collect();
    let sum = flows[1..].iter().fold(flows[0], |sum, &flow| arena.add(sum, flow));
    // From 0 to 1 where the flows together go from none to the small one.
    let part = arena.div(sum, small);
    let part = arena.call2(Function::Min, part, one);
    let (two, three) = (arena.constant(2.0), arena.constant(3.0));
    let (square, double) = (arena.mul(part, part), arena.mul(two, part));
    let rest = arena.sub(three, double);
    let share = arena.mul(square, rest);
    let missing = arena.sub(one, share);
    let least = arena.mul(missing, small);
    let (mut above, mut below) = (zero, zero);
    for (k, &flow) in flows.iter().enumerate() {
        let flow = arena.mul(share, flow);
        let weight = arena.add(flow, least);
        let value = slot(arena, 2 * k + 2);
        let carried = arena.mul(weight, value);
        above = if k == 0 { carried } else { arena.add(above, carried) };
        below = if k == 0 { weight } else { arena.add(below, weight) };
    }
    arena.div(above, below)
}

impl BuiltinCall<'_, '_, '_> {
    /// `inStream(v)` is the variable made for what flows in.
    pub(crate) fn lower_in_stream(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let variable = self.stream_variable("inStream")?;
        let span = self.list[0].span;
        let first = self.flat.in_streams[&variable.last()];
        let (offset, taken) = self.flat.position_of(span, &variable.steps, self.cx, index)?;
        if taken != index.len() {
            return Err(self.flat.error(Code::ArrayShape, span, "a scalar stands where an array is needed"));
        }
        let slot = self.flat.slots.slot(SlotKey::Variable(Kind::Var, first, offset));
        Ok(Typed::real(self.flat.model.templates.arena.slot(slot)))
    }

    /// `actualStream(v)` is `if flow > 0 then inStream(v) else v`; what is carried is zero where the flow is, so no event is made.
    pub(crate) fn lower_actual_stream(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let variable = self.stream_variable("actualStream")?;
        let flow = self.flow_beside(&variable)?;
        let rank = self.flat.steps_shape(&flow, self.cx)?.len();
        let carried =
            self.flat.lower_variable(self.list[0].span, &flow, Kind::Var, self.cx, index.get(..rank).unwrap_or(&[]))?;
        let inside = self.flat.lower(&self.list[0], self.cx, index)?;
        let outside = self.lower_in_stream(index)?;
        let arena = &mut self.flat.model.templates.arena;
        let zero = arena.constant(0.0);
        let test = arena.intern(Node::Compare(Relation::Greater, carried.node, zero));
        Ok(Typed::real(arena.select(test, outside.node, inside.node)))
    }

    /// The argument, which must be a stream variable.
    fn stream_variable(&mut self, name: &str) -> Result<Variable, Fail> {
        self.expect_arguments(name, 1)?;
        let argument = &self.list[0];
        match &argument.kind {
            Form::Variable(variable) if self.flat.in_streams.contains_key(&variable.last()) => Ok(variable.clone()),
            _ => {
                let message = format!("`{name}` needs a stream variable of a connector");
                Err(self.flat.error(Code::BadArguments, argument.span, message))
            }
        }
    }

    /// The steps to the flow variable of the connector that a stream variable belongs to.
    fn flow_beside(&mut self, variable: &Variable) -> Result<Vec<(InstId, Vec<Expr>)>, Fail> {
        let instances = &self.flat.scopes.instances;
        let mut connector = variable.last();
        while let Some(above) = instances[connector].parent {
            connector = above;
            if instances[connector].kind == ClassKind::Connector {
                break;
            }
        }
        let children = instances[connector].children.iter().copied();
        let mut flows = children.filter(|&child| instances[child].flow && instances[child].dims.is_empty());
        let Some(flow) = flows.next().filter(|_| flows.next().is_none()) else {
            let message = "a connector with stream variables needs one flow variable that is a scalar";
            return Err(self.flat.error(Code::ConnectorMismatch, self.list[0].span, message));
        };
        let depth = hyd_instance::instance::chain(instances, connector);
        let mut steps: Vec<_> = variable.steps.iter().filter(|(inst, _)| depth.contains(inst)).cloned().collect();
        steps.push((flow, Vec::new()));
        Ok(steps)
    }
}
