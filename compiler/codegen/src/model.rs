//! A compiled model: code, layout and tables, shared by all its instances.

use std::sync::{Arc, OnceLock};

use hyd_equations::{Plan, Redundant, SortedSystem, equation_text};
use hyd_flat::{MessagePart, Target, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic, Files};
use hyd_symbolic::{NodeId, contains_homotopy};
use hyd_system::{DelaySite, InitialStructure, NamePattern, Pattern, Structure, Tables, ValueKind};

use crate::delay::{SitePlaces, site_places, sites};
use crate::engine::Engine;
use crate::layout::{Given, Layout, Place};
use crate::lower::plan::PlanCode;
use crate::lower::{self, Jacobians, Lowered, Options};
use crate::program::Area;
use crate::selection::CandidateSet;
use crate::system::CompiledSystem;
use crate::tables::{Describe, OutputRow, row_equations, span_of};
use crate::tangent::{TangentCode, output_variables};

/// Sizes of the code.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CodeStatistics {
    /// Different expressions among assignments and residuals of the simulation.
    pub templates: usize,
    /// Kernels over all routines.
    pub kernels: usize,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
}

/// A model ready to run.  Clones share code and tables.
#[derive(Clone, Debug)]
pub struct CompiledModel {
    pub(crate) shared: Arc<Shared>,
}

/// What the instances share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub lowered: Lowered,
    pub engine: Engine,
    pub structure: Structure,
    pub tables: Arc<Tables>,
    pub row: OutputRow,
    pub nominals: Vec<f64>,
    /// Nominal values of the unknowns of the initial system.
    pub initial_nominals: Vec<f64>,
    pub parameters: Parameters,
    pub checks: Vec<CheckInfo>,
    pub initial: InitialTransfer,
    pub origins: Origins,
    pub candidates: Vec<CandidateSet>,
    pub delays: Vec<SitePlaces>,
    pub statistics: CodeStatistics,
    /// Interpret instead of running native code.
    pub interpret: bool,
    /// Variable behind each output whose start value can be varied.
    pub output_variables: Vec<Option<VarId>>,
    /// Made when first asked for.
    pub tangents: OnceLock<Result<Arc<TangentCode>, String>>,
}

/// What messages say of rows and variables.
#[derive(Debug)]
pub(crate) struct Origins {
    /// Rows of the simulation and of the initial system.
    pub plans: [PlanTrace; 2],
    names: Vec<(VarId, NamePattern)>,
}

/// Parameters as they can be set.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parameters {
    /// Type of each.
    pub kinds: Vec<ValueKind>,
    /// Those that no binding computes although they can be set: position in the data area.
    pub unbound: Vec<(u32, Given)>,
}

/// An assertion or termination.
#[derive(Clone, Debug)]
pub(crate) struct CheckInfo {
    pub message: Arc<str>,
    /// Pieces of the message if it shows values.
    pub parts: Vec<MessagePart>,
    /// Number of values that it shows, and where they begin in the results of `checks`.
    pub values: usize,
    pub first_value: usize,
    pub error: bool,
    pub terminate: bool,
    pub file: Arc<str>,
    pub line: u32,
}

/// What the solution of the initial system becomes.
#[derive(Clone, Debug, Default)]
pub(crate) struct InitialTransfer {
    /// Start value of each unknown of the initial system, none for derivatives (0).
    pub guess: Vec<Option<u32>>,
    /// Where each unknown `y` is found.
    pub states: Vec<Option<Place>>,
    /// Where each rate is found; algebraic unknowns have none.
    pub rates: Vec<Option<Place>>,
    /// Parameters and discrete variables that the initial system determines: from, to.
    pub values: Vec<(Place, u32)>,
    /// Conditions that follow from others, checked at the start.
    pub checked: Vec<Checked>,
    /// `homotopy` occurs in the initial system.
    pub homotopy: bool,
}

/// An initial condition whose sides must agree.
#[derive(Clone, Debug)]
pub(crate) struct Checked {
    /// Index into `Tables::equations`.
    pub equation: u32,
    /// The equation as it is written.
    pub text: String,
    /// The variable whose fixed start value this is.
    pub start_of: Option<VarId>,
}

/// Where the rows of a plan come from.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlanTrace {
    /// Index into `Tables::equations` per assignment, then per residual.
    pub equations: Vec<u32>,
    /// What each of them determines.
    pub targets: Vec<Option<Target>>,
}

/// Makes code for a sorted system.
///
/// `jacobians` are the derivatives of its plans; `files` holds the texts that origins point into.
///
/// # Errors
/// A diagnostic with code [`Code::Codegen`], when the machine is not supported or the system inconsistent.
pub fn generate(
    sorted: &SortedSystem,
    jacobians: Jacobians<'_>,
    files: &Files,
    options: &Options,
) -> Result<CompiledModel, Diagnostic> {
    build(sorted, jacobians, files, options).map(|shared| CompiledModel { shared: Arc::new(shared) }).map_err(
        |reason| {
            let name = &sorted.system.flat.name;
            Diagnostic::error(Code::Codegen, format!("no code could be made for `{name}`: {reason}"))
        },
    )
}

impl CompiledModel {
    /// A further instance with its own memory; instances may run on different threads.
    pub fn instantiate(&self) -> CompiledSystem {
        CompiledSystem::new(self.shared.clone())
    }

    /// Sizes of the code.
    pub fn statistics(&self) -> CodeStatistics {
        self.shared.statistics
    }

    /// Names and places.
    pub fn tables(&self) -> &Arc<Tables> {
        &self.shared.tables
    }
}

impl Origins {
    /// The name of a target, in the user's words.
    pub fn target_name(&self, target: Target) -> String {
        let name = |v: VarId| {
            let block = self.names.partition_point(|(first, _)| *first <= v) - 1;
            self.names[block].1.element((v.0 - self.names[block].0.0) as usize)
        };
        match target {
            Target::Var(v) => name(v),
            Target::Der(v) => format!("der({})", name(v)),
            Target::Pre(v) => format!("pre({})", name(v)),
            Target::Start(v) => format!("{}.start", name(v)),
            Target::Const(_) => "a number".into(),
            Target::Held(r) => format!("relation {}", r + 1),
            Target::Chosen(k) => format!("chosen {}", k + 1),
            Target::Delayed(_) | Target::DelayedRate(_) => "a delayed value".into(),
        }
    }
}

fn build(sorted: &SortedSystem, jacobians: Jacobians<'_>, files: &Files, options: &Options) -> Result<Shared, String> {
    let lowered = lower::lower(sorted, jacobians, options)?;
    let engine = Engine::new(&lowered.program, options.interpret)?;
    let row = OutputRow::new(sorted, &lowered.layout);
    let tables = Describe { sorted, lowered: &lowered, files, row: &row }.tables()?;
    let delays = site_places(sorted, &lowered.layout, [&lowered.places, &lowered.initial_places])?;
    let flat = &sorted.system.flat;
    Ok(Shared {
        structure: structure(sorted, &lowered, &row, sites(&delays)),
        tables: Arc::new(tables),
        nominals: nominals(sorted, &sorted.simulation.unknowns),
        initial_nominals: nominals(sorted, &sorted.initial.unknowns),
        parameters: parameters(sorted, &lowered.layout),
        checks: checks(sorted, files),
        initial: transfer(sorted, &lowered),
        candidates: CandidateSet::all(sorted, &lowered.places)?,
        origins: Origins {
            plans: [trace(sorted, &sorted.simulation), trace(sorted, &sorted.initial)],
            names: flat.variables.iter().map(|block| (block.first, block.name.clone())).collect(),
        },
        statistics: statistics(sorted, &lowered, engine.code_bytes),
        interpret: options.interpret,
        output_variables: outputs(sorted, &lowered.layout, &row),
        tangents: OnceLock::new(),
        lowered,
        engine,
        row,
        delays,
    })
}

fn outputs(sorted: &SortedSystem, layout: &Layout, row: &OutputRow) -> Vec<Option<VarId>> {
    let plan = &sorted.simulation;
    let assigned: Vec<Target> = plan.assignments.iter().map(|a| a.target).collect();
    let unknowns: Vec<Target> = plan.unknowns.iter().map(|u| u.target).collect();
    output_variables(&assigned, &unknowns, &row.states, &layout.discrete_vars)
}

fn statistics(sorted: &SortedSystem, lowered: &Lowered, code_bytes: usize) -> CodeStatistics {
    let plan = &sorted.simulation;
    let values = plan.assignments.iter().map(|a| a.value).chain(plan.residuals.iter().map(|r| r.value));
    let mut templates: Vec<NodeId> = values.collect();
    templates.sort_unstable();
    templates.dedup();
    let kernels = lowered.program.routines.iter().map(|routine| routine.kernels.len()).sum();
    CodeStatistics { templates: templates.len(), kernels, code_bytes }
}

fn structure(sorted: &SortedSystem, lowered: &Lowered, row: &OutputRow, delays: Vec<DelaySite>) -> Structure {
    let plan = &sorted.simulation;
    let patterns = |code: &PlanCode| -> (Pattern, Pattern) { (code.state_pattern.clone(), code.rate_pattern.clone()) };
    let (state_pattern, rate_pattern) = patterns(&lowered.simulation);
    Structure {
        unknowns: plan.unknowns.len(),
        differential: plan.unknowns.iter().map(|u| u.differential).collect(),
        state_pattern,
        rate_pattern,
        roots: lowered.events.rooted.len() + delays.iter().filter(|site| site.varying).count(),
        outputs: row.len(),
        initial: InitialStructure {
            unknowns: sorted.initial.unknowns.len(),
            pattern: lowered.initial.state_pattern.clone(),
        },
        delays,
    }
}

/// Nominal values of unknowns, one where the text gives none.
fn nominals(sorted: &SortedSystem, unknowns: &[hyd_equations::Unknown]) -> Vec<f64> {
    let flat = &sorted.system.flat;
    let nominal = |target: Target| match target {
        Target::Var(v) => {
            let (block, k) = flat.locate(v);
            flat.variables[block].nominal.get(k)
        }
        _ => None,
    };
    let positive = |value: &f64| value.is_finite() && *value > 0.0;
    unknowns.iter().map(|u| nominal(u.target).map(f64::abs).filter(positive).unwrap_or(1.0)).collect()
}

fn parameters(sorted: &SortedSystem, layout: &Layout) -> Parameters {
    let flat = &sorted.system.flat;
    let kind = |&v: &VarId| flat.variables[flat.locate(v).0].kind.clone();
    let mut bound = vec![false; flat.scalars as usize];
    for binding in &sorted.bindings {
        if let Target::Var(v) = binding.target {
            bound[v.index()] = true;
        }
    }
    let places = layout.parameters.clone().zip(&layout.parameter_vars).zip(&layout.given);
    let unbound = places.filter_map(|((index, v), given)| given.filter(|_| !bound[v.index()]).map(|g| (index, g)));
    Parameters { kinds: layout.parameter_vars.iter().map(kind).collect(), unbound: unbound.collect() }
}

fn checks(sorted: &SortedSystem, files: &Files) -> Vec<CheckInfo> {
    let mut first_value = sorted.checks.len();
    let info = |(check, values): (&hyd_equations::Check, Vec<_>)| {
        let message = sorted.system.flat.messages.get(check.message as usize);
        let span = span_of(sorted, check.condition.equation);
        let first = first_value;
        first_value += values.len();
        CheckInfo {
            message: message.map_or_else(|| "".into(), |m| m.text.clone()),
            parts: message.map_or_else(Vec::new, |m| m.parts.clone()),
            values: values.len(),
            first_value: first,
            error: message.is_none_or(|m| m.error),
            terminate: check.terminate,
            file: files.name(span.file).clone(),
            line: files.location(span).line,
        }
    };
    sorted.checks.iter().zip(lower::message_values(sorted)).map(info).collect()
}

impl CheckInfo {
    /// The message with the values that it shows; `out` holds the results of the routine `checks`.
    pub fn text(&self, out: &[f64]) -> String {
        if self.parts.is_empty() {
            return self.message.to_string();
        }
        let mut values = out[self.first_value..].iter();
        let piece = |part: &MessagePart| match part {
            MessagePart::Text(text) => text.to_string(),
            MessagePart::Value(format, kind) => {
                values.next().map_or_else(String::new, |&value| format.text(value, kind))
            }
        };
        self.parts.iter().map(piece).collect()
    }
}

fn transfer(sorted: &SortedSystem, lowered: &Lowered) -> InitialTransfer {
    let (layout, places) = (&lowered.layout, &lowered.initial_places);
    let guess = |target: Target| match target {
        Target::Var(v) => layout.start(v),
        _ => None,
    };
    let state = |target: Target| {
        let start = || guess(target).map(|index| Place { area: Area::Data, index });
        places.get(target).or_else(start)
    };
    let rate = |u: &hyd_equations::Unknown| match u.target {
        Target::Var(v) if u.differential => places.get(Target::Der(v)),
        _ => None,
    };
    let known = layout.parameter_vars.iter().chain(&layout.discrete_vars);
    let value = |&v: &VarId| {
        let from = places.get(Target::Var(v)).filter(|place| place.area != Area::Data)?;
        Some((from, layout.value(v)?.index))
    };
    // No `when` has set a discrete variable yet that the initial system determines: its `pre` has the same value.
    let before = |(k, &v): (usize, &VarId)| Some((value(&v)?.0, layout.pre.start + k as u32));
    let values = known.filter_map(value).chain(layout.discrete_vars.iter().enumerate().filter_map(before));
    let unknowns = &sorted.simulation.unknowns;
    let checked = |r: &Redundant| Checked {
        equation: sorted.system.equations[r.left.equation].block,
        text: equation_text(&sorted.system, r.left.equation),
        start_of: r.start_of,
    };
    InitialTransfer {
        homotopy: uses_homotopy(sorted),
        checked: sorted.redundant.iter().map(checked).collect(),
        guess: sorted.initial.unknowns.iter().map(|u| guess(u.target)).collect(),
        states: unknowns.iter().map(|u| state(u.target)).collect(),
        rates: unknowns.iter().map(rate).collect(),
        values: values.collect(),
    }
}

fn uses_homotopy(sorted: &SortedSystem) -> bool {
    let (plan, arena) = (&sorted.initial, &sorted.system.flat.templates.arena);
    let mut values: Vec<NodeId> =
        plan.assignments.iter().map(|a| a.value).chain(plan.residuals.iter().map(|r| r.value)).collect();
    values.sort_unstable();
    values.dedup();
    values.into_iter().any(|value| contains_homotopy(arena, value))
}

fn trace(sorted: &SortedSystem, plan: &Plan) -> PlanTrace {
    let mut targets: Vec<Option<Target>> = plan.assignments.iter().map(|a| Some(a.target)).collect();
    targets.resize(plan.assignments.len() + plan.residuals.len(), None);
    for block in &plan.blocks {
        for (&residual, &unknown) in block.residuals.iter().zip(&block.unknowns) {
            targets[plan.assignments.len() + residual as usize] = plan.unknowns.get(unknown as usize).map(|u| u.target);
        }
    }
    PlanTrace { equations: row_equations(sorted, plan), targets }
}

/// True if the parameter of this type may take the value.
pub(crate) fn fits(kind: &ValueKind, value: f64) -> bool {
    value.is_finite()
        && match kind {
            ValueKind::Real => true,
            ValueKind::Integer => value.fract() == 0.0,
            ValueKind::Boolean => value == 0.0 || value == 1.0,
            ValueKind::Enumeration(literals) => value.fract() == 0.0 && value >= 1.0 && value <= literals.len() as f64,
        }
}
