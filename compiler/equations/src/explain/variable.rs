//! What became of one variable: where it is declared, what it equals, what it is solved from and why.
//!
//! Reads the sorted system and walks back to the text: the block of the block lower triangular form, the equation, the
//! component and line it stands in; for eliminated variables the chain of alias equations; for states and former states
//! what index reduction decided.  Nothing is computed anew but the linearity of the block.

use std::fmt::Write;

use hyd_flat::{Section, StateSelect, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Files, Origin, did_you_mean};
use hyd_symbolic::alias;
use rustc_hash::FxHashMap;

use crate::explain::faults::{counted, equation_text, first_of, variable_of};
use crate::explain::print::equation;
use crate::plan::linearity::{block_targets, is_linear};
use crate::sorted::{Assignment, Block, Plan, SortedSystem};
use crate::system::{EqId, EquationSystem, Resolution, Role, Selection};

/// Characters of a line; the place in the text follows anyway.
const LONGEST_LINE: usize = 200;
/// Names listed of a block.
const MOST_NAMED: usize = 12;

/// The explanation of a variable as text; a sentence if there is no such variable.
pub fn explain_variable(sorted: &SortedSystem, files: &Files, name: &str) -> Result<String, String> {
    let system = &sorted.system;
    let v = find(system, name).ok_or_else(|| {
        let names: Vec<String> = system.flat.variables.iter().map(|block| block.name.element(0)).collect();
        let hint = did_you_mean(name, names.iter().map(String::as_str)).map(|hint| format!("; {hint}"));
        format!("there is no variable `{name}` in the model{}", hint.unwrap_or_default())
    })?;
    let mut report = Report { sorted, system, files, text: format!("{name}\n") };
    report.declaration(v);
    let kept = report.resolution(v);
    if let Some(kept) = kept {
        report.role(kept);
        report.determined(kept);
    }
    Ok(report.text)
}

/// The scalar variable of that name.
fn find(system: &EquationSystem, name: &str) -> Option<VarId> {
    let name: String = name.chars().filter(|c| !c.is_whitespace()).collect();
    let name = name.strip_prefix("der(").and_then(|inner| inner.strip_suffix(')')).unwrap_or(&name);
    system.flat.variables.iter().find_map(|block| {
        let first = block.name.parts.first().map_or("", |(text, _)| text);
        let near = name.starts_with(first);
        let k = (0..block.count as usize).find(|&k| near && block.name.element(k) == name)?;
        Some(VarId(block.first.0 + k as u32))
    })
}

/// A neighbour, and the block and number of the equation that makes it equal.
type Edge = (VarId, (usize, usize));

struct Report<'a> {
    sorted: &'a SortedSystem,
    system: &'a EquationSystem,
    files: &'a Files,
    text: String,
}

impl Report<'_> {
    fn line(&mut self, title: &str, content: &str) {
        let cut = content.char_indices().nth(LONGEST_LINE).map(|(at, _)| at);
        let (content, more) = cut.map_or((content, ""), |at| (&content[..at], " ..."));
        let _ = writeln!(self.text, "  {title:<12} {content}{more}");
    }

    /// A place in the text with the line that stands there.
    fn place(&mut self, origin: &Origin) {
        let location = self.files.location(origin.span);
        let text = self.files.text(origin.span.file);
        let excerpt = text.lines().nth(location.line as usize - 1).unwrap_or_default().trim();
        let component = if origin.path.is_empty() { String::new() } else { format!(", component {}", origin.path) };
        let name = self.files.name(origin.span.file).clone();
        self.line("", &format!("{name}:{}{component}", location.line));
        self.line("", &format!("| {excerpt}"));
    }

    fn declaration(&mut self, v: VarId) {
        let block = &self.system.flat.variables[self.system.flat.locate(v).0];
        let unit = block.unit.as_ref().map(|unit| format!(", in {unit}")).unwrap_or_default();
        let by = if block.made.is_some() { "by the translation, for the following" } else { "by the following" };
        self.line("declared", &format!("{by}{unit}"));
        self.place(&block.origin.clone());
    }

    /// Says what an eliminated variable equals; the variable that stands for it, if any.
    fn resolution(&mut self, v: VarId) -> Option<VarId> {
        let name = |v| self.system.flat.var_name(v);
        match self.system.resolution[v] {
            Resolution::Own => Some(v),
            Resolution::Alias { of, negated } => {
                self.line("equals", &format!("{}{}", if negated { "-" } else { "" }, name(of)));
                for (block, k) in self.alias_chain(v, of) {
                    let text = self.system.flat.equation_text(&self.system.flat.equations[block], k);
                    self.line("because", &text);
                    self.place(&self.system.flat.equations[block].origin.clone());
                }
                Some(of)
            }
            Resolution::Value(c) => {
                self.line("is always", &hyd_symbolic::format_number(self.system.flat.constants[c]));
                None
            }
        }
    }

    /// The shortest chain of equations `a = b` or `a = -b` between two variables.
    fn alias_chain(&self, from: VarId, to: VarId) -> Vec<(usize, usize)> {
        let flat = &self.system.flat;
        let mut edges: FxHashMap<VarId, Vec<Edge>> = FxHashMap::default();
        for (number, block) in flat.equations.iter().enumerate() {
            let template = flat.templates.get(block.template);
            if !matches!(block.section, Section::Continuous | Section::Discrete) {
                continue;
            }
            let Some((a, b, _)) = alias(&flat.templates.arena, &template) else { continue };
            for k in 0..block.count as usize {
                let operands = block.operands_of(k, template.arity as usize);
                if let (Target::Var(x), Target::Var(y)) = (operands[a.index()].target(), operands[b.index()].target()) {
                    edges.entry(x).or_default().push((y, (number, k)));
                    edges.entry(y).or_default().push((x, (number, k)));
                }
            }
        }
        let mut came: FxHashMap<VarId, Edge> = FxHashMap::default();
        let mut queue = std::collections::VecDeque::from([from]);
        while let Some(v) = queue.pop_front() {
            if v == to {
                break;
            }
            for &(next, edge) in edges.get(&v).into_iter().flatten() {
                if next != from && !came.contains_key(&next) {
                    came.insert(next, (v, edge));
                    queue.push_back(next);
                }
            }
        }
        let (mut chain, mut at) = (Vec::new(), to);
        while let Some(&(before, edge)) = came.get(&at).filter(|_| at != from) {
            chain.push(edge);
            at = before;
        }
        chain.reverse();
        chain
    }

    /// What the variable is for the solver, and why.
    fn role(&mut self, v: VarId) {
        let reduction = &self.system.reduction;
        let block = &self.system.flat.variables[self.system.flat.locate(v).0];
        let wish = match block.state_select_of(v) {
            StateSelect::Default => String::new(),
            other => format!(", stateSelect = {}", format!("{other:?}").to_lowercase()),
        };
        let fixed = block.fixed.get(self.system.flat.locate(v).1);
        let role = match self.system.roles[v] {
            Role::State => format!(
                "a state: its derivative occurs, and no constraint determines it{}{wish}",
                if fixed { "; its start is fixed" } else { "" }
            ),
            Role::Candidate => {
                format!("a candidate: constraints leave fewer states than candidates; {}", self.candidates(v))
            }
            Role::Algebraic if reduction.demoted.contains(&v) => {
                format!("not a state although its derivative occurs: a constraint determines it{wish}")
            }
            Role::Algebraic if reduction.dummies.contains(&v) => {
                "a dummy derivative: an algebraic variable for the derivative of a variable that a constraint determines"
                    .to_string()
            }
            Role::Algebraic => "an algebraic variable".to_string(),
            Role::Discrete => "a discrete variable: it changes at events only".to_string(),
            Role::Parameter if fixed => "a parameter: known before the run".to_string(),
            Role::Parameter => "a parameter found at the start (fixed = false)".to_string(),
            Role::Constant => "a constant".to_string(),
        };
        self.line("is", &role);
        self.size(v);
        if reduction.demoted.contains(&v) || self.system.roles[v] == Role::Candidate {
            self.constraints(v);
        }
    }

    /// What the absolute tolerance of a state is made of.
    fn size(&mut self, v: VarId) {
        let (block, k) = self.system.flat.locate(v);
        let block = &self.system.flat.variables[block];
        match (block.nominal.get(k), self.system.roles[v]) {
            (Some(nominal), Role::State | Role::Candidate | Role::Algebraic) => {
                let unit = block.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
                self.line("size", &format!("{}{unit}, its nominal value", hyd_symbolic::format_number(nominal.abs())));
            }
            (None, Role::State | Role::Candidate) => {
                let shared = if block.count > 1 { " of the array" } else { "" };
                let learned = format!(
                    "learned during the run: a tenth of the largest value{shared} so far, at least 1e-3 and at most 1"
                );
                self.line("size", &learned);
            }
            _ => {}
        }
    }

    /// The set a candidate belongs to.
    fn candidates(&self, v: VarId) -> String {
        let own = |candidate: VarId| match self.system.resolution[candidate] {
            Resolution::Alias { of, .. } => of,
            _ => candidate,
        };
        let holds = |selection: &&Selection| selection.candidates.iter().any(|c| own(c.variable) == v);
        let Some(selection) = self.system.reduction.selections.iter().find(holds) else {
            return "which of them are states is chosen during the run".to_string();
        };
        let names: Vec<String> = selection.candidates.iter().map(|c| self.system.flat.var_name(c.variable)).collect();
        let states = selection.states();
        format!("{states} of {} {} chosen during the run", names.join(", "), if states == 1 { "is" } else { "are" })
    }

    /// The constraints that were differentiated and contain the variable.
    fn constraints(&mut self, v: VarId) {
        let system = self.system;
        let mut times: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        for equation in system.equations.iter() {
            let order = times.entry((equation.block, equation.element)).or_default();
            *order = (*order).max(equation.order);
        }
        let reads = |eq: &EqId| {
            let operands = system.operands_of(system.equations[*eq].operands);
            operands.iter().any(|operand| variable_of(operand.target()) == Some(v))
        };
        let own: Vec<EqId> = system.equations.indices().filter(|&eq| system.equations[eq].order == 0).collect();
        for eq in own {
            let order = times[&(system.equations[eq].block, system.equations[eq].element)];
            if order > 0 && reads(&eq) {
                let text =
                    format!("{}   (differentiated {})", equation_text(system, eq), counted(order as usize, "time"));
                self.line("constraint", &text);
                self.place(&system.flat.equations[system.equations[eq].block as usize].origin.clone());
            }
        }
    }

    /// The equation it is solved from and the block that holds it.
    fn determined(&mut self, v: VarId) {
        let is_state = matches!(self.system.roles[v], Role::State | Role::Candidate);
        if let Some(a) = self.sorted.bindings.iter().find(|a| a.target == Target::Var(v)) {
            return self.assigned("before the run", a);
        }
        if let Some(a) = self.sorted.discrete.iter().find(|a| a.target == Target::Var(v)) {
            return self.assigned("at events", a);
        }
        let target = if is_state { Target::Der(v) } else { Target::Var(v) };
        if is_state {
            let name = self.system.flat.var_name(v);
            self.line("integrated", &format!("from der({name}), which is found as follows"));
        }
        let plan = &self.sorted.simulation;
        let Some((number, block)) = block_of(plan, target) else {
            self.line("value", "from its start value; no equation determines it");
            return;
        };
        match plan.assignments.iter().find(|a| a.target == target) {
            Some(a) => self.assigned("during the run", a),
            None if block.unknowns.len() + block.assignments.len() == 1 => self.line("iterated", "by the solver"),
            None => self.line("iterated", "by the solver, together with the other unknowns of its block"),
        }
        self.block(plan, number, block);
    }

    fn assigned(&mut self, when: &str, a: &Assignment) {
        let value =
            self.system.flat.print_as(self.system.flat.kind_of(a.target), a.value, self.system.operands_of(a.operands));
        let target = self.system.flat.operand_name(hyd_flat::Operand::new(a.target));
        self.line("computed", &format!("{when}: {target} := {value}"));
        self.from(a.equation);
    }

    /// An equation and where it stands.
    fn from(&mut self, eq: EqId) {
        let order = self.system.equations[eq].order as usize;
        let text = equation_text(self.system, eq);
        match order {
            0 => self.line("from", &text),
            _ => {
                self.line("from", &equation(self.system, eq));
                self.line("that is", &format!("the derivative ({}) of {text}", counted(order, "time")));
            }
        }
        let origin = self.system.flat.equations[self.system.equations[eq].block as usize].origin.clone();
        self.place(&origin);
    }

    fn block(&mut self, plan: &Plan, number: usize, block: Block<'_>) {
        let size = block.assignments.len() + block.residuals.len();
        let total = plan.blocks.len();
        if size == 1 && block.residuals.is_empty() {
            return self.line("block", &format!("{} of {total}: alone", number + 1));
        }
        let kind = if is_linear(self.system, plan, block) { "linear" } else { "nonlinear" };
        let names: Vec<String> = block_targets(plan, block)
            .map(|target| self.system.flat.operand_name(hyd_flat::Operand::new(target)))
            .collect();
        let list = first_of(&names, MOST_NAMED);
        let iterated = counted(block.unknowns.len(), "unknown");
        let text = format!(
            "{} of {total}: {kind}, {} for {list}; {iterated} left to the solver after tearing",
            number + 1,
            counted(size, "equation")
        );
        self.line("block", &text);
        let equations = block.residuals.iter().map(|&r| plan.residuals[r as usize].equation);
        let torn = block.assignments.iter().map(|&a| plan.assignments[a as usize].equation);
        for eq in equations.chain(torn).take(MOST_NAMED).collect::<Vec<_>>() {
            self.from(eq);
        }
    }
}

fn block_of(plan: &Plan, target: Target) -> Option<(usize, Block<'_>)> {
    plan.blocks.iter().enumerate().find(|&(_, block)| block_targets(plan, block).any(|own| own == target))
}
