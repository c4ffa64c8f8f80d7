//! The pass: equations to cases, cases to rows, rows to units, and what is left to reports.
//!
//! Cases are numbered in the order of the text.  When something contradicts and some array without unit shares one for all
//! its elements, everything is done again with one unit per element; that pass counts.

use hyd_flat::{BlockId, EquationBlock, FlatModel, Section, Target, UnitClaim, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Diagnostic, Files, Severity, Span};
use hyd_symbolic::{Function, Node, NodeId, TemplateId, contains, post_order, slots};
use hyd_system::ValueKind;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::class::{Classes, Declared, SlotClass, read_declared};
use crate::form::Fit;
use crate::infer::{Case, Literals, Row, Rule, SMALL, infer};
use crate::place::WholeNumbers;
use crate::report::Reporter;
use crate::solve::{Solution, solve};

/// Variables whose unit stays unknown.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Undecided {
    /// The variable or array.
    pub block: BlockId,
    /// Name of the first such element.
    pub name: String,
    /// Number of scalars.
    pub count: u32,
}

/// A unit found for a variable that declares none.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Inferred {
    /// The first scalar it holds for.
    pub variable: VarId,
    /// Name of that scalar.
    pub name: String,
    /// Number of scalars, neighbours in one array.
    pub count: u32,
    /// The unit as text.
    pub unit: String,
}

/// What unit checking says about a model.
#[derive(Clone, Debug, Default)]
pub struct UnitReport {
    /// Unreadable unit strings and mistakes, in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
    /// Real variables whose unit stays unknown, in the order of the model.
    pub undecided: Vec<Undecided>,
    /// Units found, in the order of the model.
    pub inferred: Vec<Inferred>,
}

impl UnitReport {
    /// Number of scalar variables whose unit stays unknown.
    pub fn undecided_scalars(&self) -> usize {
        self.undecided.iter().map(|u| u.count as usize).sum()
    }
}

/// Checks the units of a flat model; `files` are the texts that its origins point into.  What would fit if a number of the text stood for a
/// quantity is a warning.
pub fn check_units(flat: &FlatModel, files: &Files) -> UnitReport {
    check(flat, files, false)
}

/// The same; numbers of the text that are integers, simple fractions and multiples of pi have no unit, and all that does not fit is an error.
pub fn check_units_strictly(flat: &FlatModel, files: &Files) -> UnitReport {
    check(flat, files, true)
}

fn check(flat: &FlatModel, files: &Files, is_strict: bool) -> UnitReport {
    let mut declared = read_declared(flat, files);
    let mut report = UnitReport { diagnostics: std::mem::take(&mut declared.diagnostics), ..Default::default() };
    let mut pass = Pass::new(flat, files, &declared, false);
    let mut faults = pass.run();
    if !faults.is_empty() && pass.classes.could_split(flat) {
        pass = Pass::new(flat, files, &declared, true);
        faults = pass.run();
    }
    report.diagnostics.extend(pass.report(&faults, is_strict));
    pass.list(&mut report);
    report
}

/// Does a row hold with the units found?  `None` if it does or says nothing.
pub(crate) fn fault(row: &Row, solution: &Solution) -> Option<Fit> {
    let (left, right) = (solution.substitute(&row.left)?, solution.substitute(&row.right)?);
    if left.unknowns != right.unknowns || !(left.declared || right.declared) {
        return None;
    }
    match left.compare(&right) {
        Fit::Same => None,
        fit => Some(fit),
    }
}

/// A row at fault.
struct Found {
    equation: usize,
    k: usize,
    row: u32,
    fit: Fit,
    /// It would hold if a number of the text had a unit.
    is_open: bool,
}

/// A mistake only if a number of the text has no unit.
fn open(mut diagnostic: Diagnostic) -> Diagnostic {
    diagnostic.severity = Severity::Warning;
    diagnostic.help(
        "this is a warning because a number in it may stand for a quantity, such as a time constant: give that a name and a unit, as in \
         `parameter Real tau(unit = \"s\") = 10`; `--strict-units` makes it an error",
    )
}

/// What the nodes of a template ask for.
struct Traits {
    /// A slot stands in an exponent, so that its value matters.
    exponent: bool,
    /// Integers that may be constants with a unit.
    large: Vec<f64>,
}

/// Equation block `k`, claims counted behind the equations.
pub(crate) fn block_of(flat: &FlatModel, k: usize) -> &EquationBlock {
    let claim = |k: usize| &flat.claims[k - flat.equations.len()].equations;
    flat.equations.get(k).unwrap_or_else(|| claim(k))
}

/// True if the first place lies in the second.
fn inside(inner: Span, outer: Span) -> bool {
    inner.file == outer.file && outer.start <= inner.start && inner.end <= outer.end
}

struct Pass<'a> {
    flat: &'a FlatModel,
    files: &'a Files,
    declared: &'a Declared,
    classes: Classes,
    cases: FxHashMap<Box<[SlotClass]>, u32>,
    traits: FxHashMap<TemplateId, Traits>,
    rows: Vec<Row>,
    solution: Solution,
    /// Equation block and position of the first equation of each case.
    first: Vec<(u32, u32)>,
}

impl<'a> Pass<'a> {
    fn new(flat: &'a FlatModel, files: &'a Files, declared: &'a Declared, split: bool) -> Self {
        Self {
            flat,
            files,
            declared,
            classes: Classes::new(flat, declared, split),
            cases: FxHashMap::default(),
            traits: FxHashMap::default(),
            rows: Vec::new(),
            solution: solve(&[], 0),
            first: Vec::new(),
        }
    }

    /// Infers and solves; the rows at fault by case.
    fn run(&mut self) -> FxHashMap<u32, Vec<(u32, Fit)>> {
        self.visit(|pass, key, equation, k| {
            if !pass.cases.contains_key(key) {
                pass.add_case(key, equation, k);
            }
        });
        self.solution = solve(&self.rows, self.classes.unknowns.len());
        let mut faults: FxHashMap<u32, Vec<(u32, Fit)>> = FxHashMap::default();
        for (k, row) in self.rows.iter().enumerate() {
            let coupled = self.solution.coupled.binary_search(&(k as u32)).is_ok();
            if let Some(fit) = fault(row, &self.solution).or(coupled.then_some(Fit::Dimension)) {
                faults.entry(row.case).or_default().push((k as u32, fit));
            }
        }
        faults
    }

    /// Calls `f` with the key of each equation, neighbours with equal keys only once.
    fn visit(&mut self, mut f: impl FnMut(&mut Self, &[SlotClass], usize, usize)) {
        let flat = self.flat;
        let (mut key, mut last): (Vec<SlotClass>, Vec<SlotClass>) = (Vec::new(), Vec::new());
        let claims = flat.claims.iter().map(|claim| &claim.equations);
        for (e, block) in flat.equations.iter().chain(claims).enumerate() {
            let arity = flat.templates.get(block.template).arity as usize;
            let (exponent, visible) = self.traits_of(block.template, block.origin.span);
            let alone = matches!(block.section, Section::Assert(_) | Section::AssertOnce(_) | Section::Terminate(_));
            let claim = e >= flat.equations.len();
            last.clear();
            for k in 0..block.count as usize {
                key.clear();
                let marks = u64::from(claim) << 2 | u64::from(alone) << 1 | u64::from(visible);
                key.push((block.template.index() as u64) << 3 | marks);
                key.extend(block.operands_of(k, arity).iter().map(|&o| self.classes.of(o, exponent)));
                if key != last {
                    f(self, &key, e, k);
                    std::mem::swap(&mut key, &mut last);
                }
            }
        }
    }

    /// Is a slot in an exponent; do all large numbers stand in the text?
    fn traits_of(&mut self, template: TemplateId, span: Span) -> (bool, bool) {
        let flat = self.flat;
        let traits = self.traits.entry(template).or_insert_with(|| traits(flat, template));
        if traits.large.is_empty() {
            return (traits.exponent, true);
        }
        let numbers = WholeNumbers::of(self.files.snippet(span));
        (traits.exponent, traits.large.iter().all(|&value| numbers.has(value)))
    }

    fn add_case(&mut self, key: &[SlotClass], equation: usize, k: usize) {
        let number = self.cases.len() as u32;
        let rows = self.rows_of(key, (equation, k), number, Literals::AsUsual);
        self.rows.extend(rows);
        self.cases.insert(key.into(), number);
        self.first.push((equation as u32, k as u32));
    }

    /// The rows of equation `k` of a block.
    fn rows_of(&self, key: &[SlotClass], (equation, k): (usize, usize), number: u32, literals: Literals) -> Vec<Row> {
        let block = block_of(self.flat, equation);
        let rule = if equation < self.flat.equations.len() { Rule::Equation } else { Rule::Claim };
        let template = self.flat.templates.get(block.template);
        let operands = block.operands_of(k, template.arity as usize);
        let value = |o: &hyd_flat::Operand| match o.target() {
            Target::Const(c) => Some(if o.negated() { -self.flat.constants[c] } else { self.flat.constants[c] }),
            _ => None,
        };
        let case = Case {
            arena: &self.flat.templates.arena,
            slots: key[1..].iter().map(|&class| self.classes.form(class)).collect(),
            values: operands.iter().map(value).collect(),
            conversions: self.declared.scaled,
            results: &self.declared.of_result,
            visible: key[0] & 1 == 1,
            literals,
            number,
        };
        let mut rows = Vec::new();
        infer(&case, &template, (key[0] & 2 == 2, rule), &mut rows);
        if rule == Rule::Claim {
            // What stands inside is part of an equation, and looked at there.
            rows.retain(|row| row.rule == Rule::Claim);
        }
        rows
    }

    /// True if a row at fault would hold if numbers of its text had units that are not written.
    fn holds_with_quantities(&self, key: &[SlotClass], at: (usize, usize), row: &Row) -> bool {
        let others = self.rows_of(key, at, row.case, Literals::Quantities);
        let mut others = others.iter().filter(|other| other.nodes == row.nodes && other.rule == row.rule);
        others.all(|other| fault(other, &self.solution).is_none())
    }

    /// Messages for the rows at fault: each text once per pair of units.
    fn report(&mut self, faults: &FxHashMap<u32, Vec<(u32, Fit)>>, is_strict: bool) -> Vec<Diagnostic> {
        let mut found: Vec<Found> = Vec::new();
        if !faults.is_empty() {
            self.visit(|pass, key, equation, k| {
                let case = pass.cases.get(key).and_then(|case| faults.get(case));
                for &(row, fit) in case.into_iter().flatten() {
                    // A factor between units of one dimension is a mistake, whatever a number means; and what a function gives has a unit.
                    let span = block_of(pass.flat, equation).origin.span;
                    let is_open = !is_strict
                        && fit == Fit::Dimension
                        && !pass.flat.claims.iter().any(|claim| inside(claim.call, span))
                        && pass.holds_with_quantities(key, (equation, k), &pass.rows[row as usize]);
                    found.push(Found { equation, k, row, fit, is_open });
                }
            });
        }
        self.leave_out_consequences(&mut found);
        let reporter = Reporter {
            flat: self.flat,
            files: self.files,
            declared: self.declared,
            classes: &self.classes,
            solution: &self.solution,
            rows: &self.rows,
            first: &self.first,
        };
        let mut seen: FxHashSet<(Span, String)> = FxHashSet::default();
        let mut diagnostics = Vec::new();
        for Found { equation, k, row, fit, is_open } in found {
            let origin = &block_of(self.flat, equation).origin;
            let (left, right) = reporter.texts(&self.rows[row as usize]);
            if seen.insert((origin.span, format!("{left} {right}"))) {
                let diagnostic = reporter.diagnostic(equation, k, &self.rows[row as usize], fit);
                diagnostics.push(if is_open { open(diagnostic) } else { diagnostic });
            }
        }
        diagnostics
    }

    /// What a call gives cannot fit where something wrong is given to it, or where its own inside is at fault.
    fn leave_out_consequences(&self, found: &mut Vec<Found>) {
        let claim = |equation: usize| equation.checked_sub(self.flat.equations.len()).map(|k| &self.flat.claims[k]);
        let at_fault: Vec<&UnitClaim> = found.iter().filter_map(|own| claim(own.equation)).collect();
        if at_fault.is_empty() {
            return;
        }
        found.retain(|found| match claim(found.equation) {
            Some(own) => own.given || !at_fault.iter().any(|other| other.given && inside(other.call, own.call)),
            None => {
                let span = self.flat.equations[found.equation].origin.span;
                !at_fault.iter().any(|other| inside(other.call, span))
            }
        });
    }

    /// Fills in the units found and those that stay unknown.
    fn list(&self, report: &mut UnitReport) {
        for (id, block) in self.flat.variables.iter_enumerated() {
            let open = block.kind == ValueKind::Real && block.unit.as_ref().is_none_or(|t| t.is_empty());
            if !open || block.made.is_some() {
                continue;
            }
            let step = if self.classes.split { 1 } else { block.count.max(1) };
            for k in (0..block.count).step_by(step as usize) {
                let variable = VarId(block.first.0 + k);
                let found = self.classes.unknown_of(variable).and_then(|u| self.solution.units[u as usize].as_ref());
                match found {
                    Some(product) => {
                        let unit = self.declared.names.text(&product.unit());
                        match report.inferred.last_mut() {
                            Some(last) if last.variable.0 + last.count == variable.0 && last.unit == unit && k > 0 => {
                                last.count += step;
                            }
                            _ => {
                                let name = block.name.element(k as usize);
                                report.inferred.push(Inferred { variable, name, count: step, unit });
                            }
                        }
                    }
                    None => match report.undecided.last_mut() {
                        Some(last) if last.block == id => last.count += step,
                        _ => {
                            let name = block.name.element(k as usize);
                            report.undecided.push(Undecided { block: id, name, count: step });
                        }
                    },
                }
            }
        }
    }
}

fn traits(flat: &FlatModel, template: TemplateId) -> Traits {
    let arena = &flat.templates.arena;
    let template = flat.templates.get(template);
    let nodes: Vec<NodeId> = post_order(arena, &[template.left, template.right]);
    let exponent = nodes.iter().any(|&id| match arena.node(id) {
        Node::Call2(Function::Pow, _, b) => !slots(arena, &[b]).is_empty() && !contains(arena, b, |n| n == Node::Time),
        _ => false,
    });
    let large = |id: &NodeId| arena.as_constant(*id).map(f64::abs).filter(|v| *v > SMALL && v.fract() == 0.0);
    Traits { exponent, large: nodes.iter().filter_map(large).collect() }
}
