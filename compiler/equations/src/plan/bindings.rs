//! What is known before the run: parameters, constants and variables that depend on nothing else, in order.
//!
//! Binding equations are sorted by dependence (Kahn 1962, "Topological sorting of large networks"); a cycle is an error
//! that names its members.  Continuous equations that contain one unknown and otherwise only known values are then
//! peeled off one after the other.  Parameters found at the start (`fixed = false`) and what depends on them are left to the
//! initial system.

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Code, Diagnostic};
use hyd_structure::components::{Digraph, strongly_connected_components};
use hyd_structure::{Row, Transpose};
use hyd_symbolic::SlotId;

use crate::algebra::{Algebra, Known};
use crate::alias::representative::block_of_variable;
use crate::balance::simulation_unknowns;
use crate::explain::faults::{list_names, mark_equations};
use crate::incidence::{Pattern, pattern};
use crate::plan::levels::order_by_level;
use crate::relations::append;
use crate::sorted::Assignment;
use crate::system::{EqId, EquationSystem, Role};

/// The part of the system that is computed once.
pub(crate) struct Bindings {
    /// In order.
    pub assignments: Vec<Assignment>,
    /// What they and the parameters make known before the start.
    pub known: Known,
    /// Continuous equations that went into `assignments`.
    pub used: IndexVec<EqId, bool>,
    /// Parameters that the initial system determines.
    pub late: Vec<VarId>,
    /// Binding equations among them.
    pub late_equations: Vec<EqId>,
}

/// Sorts what is known before the run.
pub(crate) fn sort_bindings(system: &mut EquationSystem, algebra: &mut Algebra) -> Result<Bindings, Diagnostic> {
    let mut known = Known::parameters(system);
    let binding = Binding::collect(system);
    let (order, level) = binding.order(system)?;
    let mut late = free_parameters(system);
    let mut bindings = Bindings {
        assignments: Vec::new(),
        known: Known { bound: IndexVec::new() },
        used: IndexVec::filled(false, system.equations.len()),
        late: Vec::new(),
        late_equations: Vec::new(),
    };
    for node in order {
        let (eq, target) = binding.nodes[node as usize];
        let reads_late = |v: &VarId| late[*v];
        if late[target] || binding.reads(system, node).any(|v| reads_late(&v)) {
            late[target] = true;
            bindings.late_equations.push(eq);
        } else {
            bindings.assignments.extend(assignment(system, eq, level[node as usize]));
        }
    }
    bindings.late = late.iter_enumerated().filter(|(_, late)| **late).map(|(v, _)| v).collect();
    for &v in &bindings.late {
        known.bound[v] = false;
    }
    bindings.known = known;
    let mut variable_level = IndexVec::filled(0, system.roles.len());
    for (node, &(_, target)) in binding.nodes.iter().enumerate() {
        variable_level[target] = level[node] + 1;
    }
    peel(system, algebra, &mut bindings, variable_level);
    order_by_level(&mut bindings.assignments);
    bindings.late_equations.sort_unstable();
    Ok(bindings)
}

/// The assignment an equation makes to what stands on its left side.
pub(crate) fn assignment(system: &mut EquationSystem, eq: EqId, level: u32) -> Option<Assignment> {
    let slot = system.left_slot(eq)?;
    let operands = system.equations[eq].operands;
    let operand = system.operands_of(operands)[slot.index()];
    let right = system.flat.templates.get(system.equations[eq].template).right;
    let value = match operand.negated() {
        false => right,
        true => system.flat.templates.arena.neg(right),
    };
    let target = operand.target();
    // A number is data: assignments of numbers share one expression, whatever the numbers are.
    if let Some(number) = system.flat.templates.arena.as_constant(value) {
        let number = system.flat.constants.push(number);
        let operands = append(system, &[Operand::new(target), Operand::new(Target::Const(number))]);
        let value = system.flat.templates.arena.slot(SlotId(1));
        return Some(Assignment { target, value, operands, equation: eq, level });
    }
    Some(Assignment { target, value, operands, equation: eq, level })
}

fn free_parameters(system: &EquationSystem) -> IndexVec<VarId, bool> {
    let block = block_of_variable(&system.flat);
    let free = |v: VarId| {
        let block = &system.flat.variables.raw[block[v] as usize];
        system.roles[v] == Role::Parameter && !block.fixed.get((v.0 - block.first.0) as usize)
    };
    IndexVec::from_vec(system.roles.indices().map(free).collect())
}

/// The binding equations as a graph.
struct Binding {
    nodes: Vec<(EqId, VarId)>,
    node_of: IndexVec<VarId, Option<u32>>,
}

impl Binding {
    fn collect(system: &EquationSystem) -> Self {
        let mut nodes = Vec::new();
        let mut node_of = IndexVec::filled(None, system.roles.len());
        for eq in system.equations_in(Section::Binding) {
            if let Some(Target::Var(v)) = system.left_operand(eq).map(|operand| operand.target()) {
                node_of[v] = Some(nodes.len() as u32);
                nodes.push((eq, v));
            }
        }
        Self { nodes, node_of }
    }

    /// The variables on the right side of a binding.
    fn reads<'a>(&self, system: &'a EquationSystem, node: u32) -> impl Iterator<Item = VarId> + use<'a> {
        let (eq, _) = self.nodes[node as usize];
        let left = system.left_slot(eq).map_or(usize::MAX, TypedIndex::index);
        let operands = system.operands_of(system.equations[eq].operands).iter().enumerate();
        let right = system.flat.templates.get(system.equations[eq].template).right;
        let arena = &system.flat.templates.arena;
        let itself = move || hyd_symbolic::contains_slot(arena, right, hyd_symbolic::SlotId(left as u32));
        operands.filter(move |&(k, _)| k != left || itself()).filter_map(|(_, operand)| match operand.target() {
            Target::Var(v) => Some(v),
            _ => None,
        })
    }

    /// Nodes in the order of dependence, and the level of each.
    fn order(&self, system: &EquationSystem) -> Result<(Vec<u32>, Vec<u32>), Diagnostic> {
        let count = self.nodes.len();
        let mut graph = Digraph::new();
        let (mut waiting, mut users) = (vec![0_u32; count], vec![Vec::new(); count]);
        for node in 0..count as u32 {
            let before: Vec<u32> = self.reads(system, node).filter_map(|v| self.node_of[v]).collect();
            for &other in &before {
                users[other as usize].push(node);
            }
            waiting[node as usize] = before.len() as u32;
            graph.push_node(before);
        }
        let mut level = vec![0_u32; count];
        let mut order: Vec<u32> = (0..count as u32).filter(|&node| waiting[node as usize] == 0).collect();
        let mut head = 0;
        while let Some(&node) = order.get(head) {
            head += 1;
            for &user in &users[node as usize] {
                level[user as usize] = level[user as usize].max(level[node as usize] + 1);
                waiting[user as usize] -= 1;
                if waiting[user as usize] == 0 {
                    order.push(user);
                }
            }
        }
        if order.len() == count { Ok((order, level)) } else { Err(self.cycle(system, &graph)) }
    }

    fn cycle(&self, system: &EquationSystem, graph: &Digraph) -> Diagnostic {
        let components = strongly_connected_components(graph);
        let mut ranges = components.starts.windows(2).map(|w| &components.nodes[w[0] as usize..w[1] as usize]);
        let members =
            ranges.find(|nodes| nodes.len() > 1 || graph.successors(nodes[0]).contains(&nodes[0])).unwrap_or_default();
        let names = list_names(members.iter().map(|&node| system.flat.var_name(self.nodes[node as usize].1)));
        let message = match members.len() {
            1 => format!("{names} depends on itself"),
            _ => format!("{names} depend on each other in a cycle"),
        };
        let equations: Vec<EqId> = members.iter().map(|&node| self.nodes[node as usize].0).collect();
        let help = match members.len() {
            1 => "give it a value that does not depend on it".to_string(),
            _ => format!("give one of them, {names}, a number instead"),
        };
        mark_equations(Diagnostic::error(Code::CircularParameters, message).help(help), system, &equations)
    }
}

/// Moves continuous equations with a single unknown that depends on nothing but known values.
fn peel(system: &mut EquationSystem, algebra: &mut Algebra, bindings: &mut Bindings, level: IndexVec<VarId, u32>) {
    let unknowns = simulation_unknowns(system);
    let rows = system.equations_in(Section::Continuous);
    let pattern = pattern(system, algebra, rows, &unknowns);
    let transpose = pattern.incidence.transpose();
    let mut peeling = Peeling { system, algebra, bindings, level, pattern: &pattern, transpose, open: Vec::new() };
    peeling.count();
    let mut queue: Vec<u32> = (0..peeling.open.len() as u32).filter(|&row| peeling.open[row as usize] == 1).collect();
    while let Some(row) = queue.pop() {
        if let Some(v) = peeling.bind(Row(row))
            && let Some(column) = unknowns.column(Target::Var(v))
        {
            for &row in peeling.transpose.rows(column) {
                peeling.open[row.index()] -= 1;
                if peeling.open[row.index()] == 1 {
                    queue.push(row.0);
                }
            }
        }
    }
}

struct Peeling<'a> {
    system: &'a mut EquationSystem,
    algebra: &'a mut Algebra,
    bindings: &'a mut Bindings,
    /// Level at which a variable may be read.
    level: IndexVec<VarId, u32>,
    pattern: &'a Pattern,
    transpose: Transpose,
    /// Slots of each row that read something unknown; none for rows that read the clock.
    open: Vec<u32>,
}

impl Peeling<'_> {
    fn count(&mut self) {
        for &eq in &self.pattern.rows {
            let equation = self.system.equations[eq];
            let facts = self.algebra.facts(&mut self.system.flat.templates, equation.template);
            let operands = self.system.operands_of(equation.operands);
            let known = &self.bindings.known;
            let open = facts.slots.iter().filter(|slot| !known.is_known(operands[slot.index()])).count() as u32;
            // A clock never becomes known: count it as one more unknown that stays.
            self.open.push(open + if facts.clocked { 1 << 16 } else { 0 });
        }
    }

    /// Binds the one unknown of a row, if it is an algebraic variable that can be solved for.
    fn bind(&mut self, row: Row) -> Option<VarId> {
        let eq = self.pattern.rows[row.index()];
        let equation = self.system.equations[eq];
        let facts = self.algebra.facts(&mut self.system.flat.templates, equation.template);
        let operands = self.system.operands_of(equation.operands);
        let known = &self.bindings.known;
        let slot = *facts.slots.iter().find(|slot| !known.is_known(operands[slot.index()]))?;
        let Target::Var(v) = operands[slot.index()].target() else { return None };
        if self.system.roles[v] != Role::Algebraic {
            return None;
        }
        let read = facts.slots.iter().filter_map(|slot| match operands[slot.index()].target() {
            Target::Var(other) if other != v => Some(self.level[other]),
            _ => None,
        });
        let level = read.max().unwrap_or(0);
        if !self.algebra.solvability(self.system, &self.bindings.known, eq, slot).is_safe() {
            return None;
        }
        let value = self.algebra.value(self.system, eq, slot)?;
        let operands = equation.operands;
        let target = Target::Var(v);
        self.bindings.assignments.push(Assignment { target, value, operands, equation: eq, level });
        self.bindings.known.bound[v] = true;
        self.bindings.used[eq] = true;
        self.level[v] = level + 1;
        Some(v)
    }
}
