//! A compiled model: code, layout and tables, shared by all its instances.

use std::sync::Arc;

use hyd_equations::{Assignment, Plan, Redundant, SortedSystem, equation_text};
use hyd_flat::{MessagePart, Target, VarId};
use hyd_index::TypedIndex;
use hyd_payload::{
    Backend, Check, Checked, DataArea, Experiment, Identity, InitialTransfer, Instance, Loaded, MessagePiece, Model,
    Name, Names, OutputRow, Parameters, PlanRoutines, RowNames, Wrap,
};
use hyd_source::{Code, Diagnostic, Files};
use hyd_symbolic::{NodeId, contains_homotopy};
use hyd_system::{DelaySite, InitialStructure, InputSite, Pattern, Structure, Tables, ValueKind};

use crate::candidates::candidate_sets;
use crate::delay::{site_places, sites};
use crate::engine::code;
use crate::known::known_discrete;
use crate::layout::{Layout, Place};
use crate::lower::{self, Jacobians, Lowered, Options};
use crate::nominals::{learned_sizes, nominals};
use crate::program::Area;
use crate::shared::{CodeStatistics, Shared};
use crate::spans::span_of;
use crate::tables::{Describe, output_row, row_equations};
use crate::tangent::{self, Source};
use crate::tested::tested;

/// A model ready to run.  Clones share code and tables.
#[derive(Clone, Debug)]
pub struct CompiledModel {
    pub(crate) shared: Arc<Shared>,
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
            Diagnostic::error(Code::Codegen, format!("no code could be generated for `{name}`: {reason}"))
        },
    )
}

impl CompiledModel {
    /// The same model run by another backend; instances of this one stay as they are.
    ///
    /// # Errors
    /// A sentence, when the program is inconsistent.
    pub fn on(&self, backend: Backend) -> Result<CompiledModel, String> {
        if backend == self.shared.backend {
            return Ok(self.clone());
        }
        let (lowered, starts) = (self.shared.lowered.clone(), self.shared.source.starts.clone());
        let source = Arc::new(Source { lowered: lowered.clone(), starts, backend });
        let loaded = Arc::new(Loaded::with_source(self.payload().clone(), backend, source.clone())?);
        let code_bytes = loaded.engine.code_bytes;
        let statistics = CodeStatistics { code_bytes, ..self.shared.statistics };
        let shared = Shared { lowered, statistics, backend, source, loaded };
        Ok(CompiledModel { shared: Arc::new(shared) })
    }

    /// Sizes of the code.
    pub fn statistics(&self) -> CodeStatistics {
        self.shared.statistics
    }

    /// Names and places.
    pub fn tables(&self) -> &Arc<Tables> {
        &self.shared.loaded.model.tables
    }

    /// The model as plain data, to run without the compiler; without derivatives along directions.
    pub fn payload(&self) -> &Model {
        &self.shared.loaded.model
    }

    /// The model as plain data, to be stored, with derivatives along all that can be varied.
    ///
    /// # Errors
    /// A sentence, when no code can be made for the derivatives.
    pub fn stored(&self) -> Result<Model, String> {
        tangent::stored(self.payload(), &self.shared.source)
    }

    /// A further instance with its own memory; instances may run on different threads.
    pub fn instantiate(&self) -> Instance {
        self.shared.loaded.instantiate()
    }

    /// Why the code is interpreted although it was to run natively.
    pub fn fallback(&self) -> Option<&str> {
        self.shared.loaded.engine.fallback.as_deref()
    }
}

fn build(sorted: &SortedSystem, jacobians: Jacobians<'_>, files: &Files, options: &Options) -> Result<Shared, String> {
    let lowered = lower::lower(sorted, jacobians, options)?;
    let row = output_row(sorted, &lowered.layout);
    let (tables, limits) = Describe { sorted, lowered: &lowered, files, row: &row }.tables()?;
    let delays = site_places(sorted, &lowered.layout, [&lowered.places, &lowered.initial_places])?;
    let names = TargetNames { sorted };
    let model = Model {
        identity: identity(sorted, files),
        experiment: experiment(sorted),
        code: code(&lowered.program, options.backend)?,
        program: lowered.program.clone(),
        routines: lowered.routines.clone(),
        area: area(&lowered, &names),
        structure: structure(sorted, &lowered, &row, sites(&delays)),
        tables: Arc::new(tables),
        nominals: nominals(sorted, sorted.simulation.unknowns.iter().map(|u| u.target)),
        tested: tested(sorted),
        initial_nominals: nominals(sorted, sorted.initial.unknowns.iter().map(|u| u.target)),
        parameters: Parameters { limits, ..parameters(sorted, &lowered.layout) },
        checks: checks(sorted, files),
        initial: transfer(sorted, &lowered, &names),
        candidates: candidate_sets(sorted, &lowered.places)?,
        names: Names(sorted.system.flat.variables.iter().map(|block| block.name.clone()).collect()),
        rows: [rows(sorted, &sorted.simulation, &names), rows(sorted, &sorted.initial, &names)],
        row,
        delays,
        tangents: None,
    };
    let starts = starts(sorted, &lowered.layout, &model.row).into();
    let source = Arc::new(Source { lowered: Arc::new(lowered), starts, backend: options.backend });
    let loaded = Arc::new(Loaded::with_source(model, options.backend, source.clone())?);
    let statistics = statistics(sorted, &source.lowered, loaded.engine.code_bytes);
    Ok(Shared { lowered: source.lowered.clone(), statistics, backend: options.backend, source, loaded })
}

fn identity(sorted: &SortedSystem, files: &Files) -> Identity {
    Identity {
        compiler: env!("CARGO_PKG_VERSION").into(),
        sources: fingerprint(files),
        description: sorted.system.flat.description.clone().unwrap_or_else(|| "".into()),
        templates: templates(sorted) as u32,
    }
}

/// A number that is another one, all but surely, when a text of the model is (Fowler, Noll, Vo: FNV-1a).
fn fingerprint(files: &Files) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    for byte in files.ids().flat_map(|file| files.text(file).bytes()) {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
    hash
}

fn experiment(sorted: &SortedSystem) -> Experiment {
    let hyd_flat::Experiment { start, stop, tolerance, interval } = sorted.system.flat.experiment;
    Experiment { start, stop, tolerance, interval }
}

/// Names of targets for messages.
struct TargetNames<'a> {
    sorted: &'a SortedSystem,
}

impl TargetNames<'_> {
    fn of(&self, target: Target) -> Option<Name> {
        let (v, wrap) = match target {
            Target::Var(v) => (v, Wrap::Value),
            Target::Der(v) => (v, Wrap::Rate),
            Target::Pre(v) => (v, Wrap::Before),
            Target::Start(v) => (v, Wrap::Start),
            _ => return None,
        };
        let (block, element) = self.sorted.system.flat.locate(v);
        Some(Name { pattern: block.index() as u32, element: element as u32, wrap })
    }

    fn variable(&self, v: VarId, wrap: Wrap) -> Name {
        let (block, element) = self.sorted.system.flat.locate(v);
        Name { pattern: block.index() as u32, element: element as u32, wrap }
    }
}

fn area(lowered: &Lowered, names: &TargetNames<'_>) -> DataArea {
    let layout = &lowered.layout;
    let before = |&(v, index): &(VarId, u32)| Some((lowered.places.get(Target::Var(v))?, index));
    DataArea {
        length: layout.data,
        parameters: layout.parameters.clone(),
        given: layout.given.clone(),
        parameter_names: layout.parameter_vars.iter().map(|&v| names.variable(v, Wrap::Value)).collect(),
        discrete: layout.discrete.clone(),
        discrete_starts: layout.discrete_vars.iter().map(|&v| layout.start(v)).collect(),
        pre: layout.pre.clone(),
        pre_continuous: layout.pre_continuous.iter().filter_map(before).collect(),
        held: layout.held.clone(),
        chosen: layout.chosen.clone(),
        delayed: layout.delayed.clone(),
        delayed_rates: layout.delayed_rates.clone(),
        inputs: layout.inputs.clone(),
        input_rates: layout.input_rates.clone(),
        preset: layout.preset.clone(),
        starts: layout.starts().map(|(v, index)| (index, names.variable(v, Wrap::Start))).collect(),
    }
}

/// For each output the position of its start value, where that may be varied: of unknowns and discrete variables.
fn starts(sorted: &SortedSystem, layout: &Layout, row: &OutputRow) -> Vec<Option<u32>> {
    let plan = &sorted.simulation;
    let targets = plan.assignments.iter().map(|a| a.target).chain(plan.unknowns.iter().map(|u| u.target));
    let start = |target: Target| match target {
        Target::Var(v) => layout.start(v),
        _ => None,
    };
    let mut list: Vec<Option<u32>> = targets.map(start).collect();
    list.resize(list.len() + row.states.len(), None);
    list.extend(layout.discrete_vars.iter().map(|&v| layout.start(v)));
    list
}

fn statistics(sorted: &SortedSystem, lowered: &Lowered, code_bytes: usize) -> CodeStatistics {
    let kernels = lowered.program.routines.iter().map(|routine| routine.kernels.len()).sum();
    CodeStatistics { templates: templates(sorted), kernels, code_bytes }
}

/// Different expressions among assignments and residuals of the simulation.
fn templates(sorted: &SortedSystem) -> usize {
    let plan = &sorted.simulation;
    let values = plan.assignments.iter().map(|a| a.value).chain(plan.residuals.iter().map(|r| r.value));
    let mut templates: Vec<NodeId> = values.collect();
    templates.sort_unstable();
    templates.dedup();
    templates.len()
}

fn structure(sorted: &SortedSystem, lowered: &Lowered, row: &OutputRow, delays: Vec<DelaySite>) -> Structure {
    let plan = &sorted.simulation;
    let patterns =
        |code: &PlanRoutines| -> (Pattern, Pattern) { (code.state_pattern.clone(), code.rate_pattern.clone()) };
    let (state_pattern, rate_pattern) = patterns(&lowered.routines.simulation);
    Structure {
        unknowns: plan.unknowns.len(),
        differential: plan.unknowns.iter().map(|u| u.differential).collect(),
        sizes: learned_sizes(sorted),
        state_pattern,
        rate_pattern,
        roots: lowered.routines.events.rooted.len() + delays.iter().filter(|site| site.varying).count(),
        outputs: row.len(),
        initial: InitialStructure {
            unknowns: sorted.initial.unknowns.len(),
            pattern: lowered.routines.initial.state_pattern.clone(),
        },
        delays,
        inputs: inputs(sorted),
    }
}

/// The inputs that follow recorded samples.
fn inputs(sorted: &SortedSystem) -> Vec<InputSite> {
    let system = &sorted.system;
    let rates: Vec<u32> = system
        .operands
        .iter()
        .filter_map(|operand| if let Target::InputRate(k) = operand.target() { Some(k) } else { None })
        .collect();
    let name = |k: u32| system.flat.driven_variable(k).map_or_else(String::new, |v| system.flat.var_name(v));
    (0..system.flat.driven_inputs())
        .map(|k| InputSite { name: name(k).into(), differentiated: rates.contains(&k) })
        .collect()
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
    Parameters {
        kinds: layout.parameter_vars.iter().map(kind).collect(),
        unbound: unbound.collect(),
        ..Parameters::default()
    }
}

fn checks(sorted: &SortedSystem, files: &Files) -> Vec<Check> {
    let mut first_value = sorted.checks.len();
    let info = |(check, values): (&hyd_equations::Check, Vec<_>)| {
        let message = sorted.system.flat.messages.get(check.message as usize);
        let span = span_of(sorted, check.condition.equation);
        let first = first_value;
        first_value += values.len();
        let piece = |part: &MessagePart| match part {
            MessagePart::Text(text) => MessagePiece::Text(text.clone()),
            MessagePart::Value(format, kind) => MessagePiece::Value(format.clone(), kind.clone()),
        };
        Check {
            message: message.map_or_else(|| "".into(), |m| m.text.clone()),
            pieces: message.map_or_else(Vec::new, |m| m.parts.iter().map(piece).collect()),
            values: (first as u32, values.len() as u32),
            error: message.is_none_or(|m| m.error),
            kind: check.kind,
            file: files.name(span.file).clone(),
            line: files.location(span).line,
        }
    };
    sorted.checks.iter().zip(lower::message_values(sorted)).map(info).collect()
}

fn transfer(sorted: &SortedSystem, lowered: &Lowered, names: &TargetNames<'_>) -> InitialTransfer {
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
        text: equation_text(&sorted.system, r.left.equation).into(),
        start_of: r.start_of.map(|v| names.variable(v, Wrap::Value)),
        others: r.others.as_ref().map(|others| others.iter().map(|own| own.as_str().into()).collect()),
    };
    InitialTransfer {
        homotopy: uses_homotopy(sorted),
        checked: sorted.redundant.iter().map(checked).collect(),
        guess: sorted.initial.unknowns.iter().map(|u| guess(u.target)).collect(),
        states: unknowns.iter().map(|u| state(u.target)).collect(),
        rates: unknowns.iter().map(rate).collect(),
        values: values.collect(),
        decided: decided(sorted, lowered),
        late_reals: has_late_reals(sorted),
    }
}

/// Positions of the discrete variables that are known before the initial system is solved.
fn decided(sorted: &SortedSystem, lowered: &Lowered) -> Vec<u32> {
    let known = known_discrete(sorted);
    let positions = (0u32..).zip(&lowered.layout.discrete_vars);
    positions.filter(|(_, v)| known.contains(v)).map(|(k, _)| k).collect()
}

/// True if the start value of a discrete Real waits for what is found at the start.
fn has_late_reals(sorted: &SortedSystem) -> bool {
    let flat = &sorted.system.flat;
    let is_real = |a: &Assignment| match a.target {
        Target::Start(v) => flat.variables[flat.locate(v).0].kind == ValueKind::Real,
        _ => false,
    };
    sorted.late_starts.iter().any(is_real)
}

fn uses_homotopy(sorted: &SortedSystem) -> bool {
    let (plan, arena) = (&sorted.initial, &sorted.system.flat.templates.arena);
    let mut values: Vec<NodeId> =
        plan.assignments.iter().map(|a| a.value).chain(plan.residuals.iter().map(|r| r.value)).collect();
    values.sort_unstable();
    values.dedup();
    values.into_iter().any(|value| contains_homotopy(arena, value))
}

fn rows(sorted: &SortedSystem, plan: &Plan, names: &TargetNames<'_>) -> RowNames {
    let mut targets: Vec<Option<Name>> = plan.assignments.iter().map(|a| names.of(a.target)).collect();
    targets.resize(plan.assignments.len() + plan.residuals.len(), None);
    for block in plan.blocks.iter() {
        for (&residual, &unknown) in block.residuals.iter().zip(block.unknowns) {
            let unknown = plan.unknowns.get(unknown as usize);
            targets[plan.assignments.len() + residual as usize] = unknown.and_then(|u| names.of(u.target));
        }
    }
    RowNames { equations: row_equations(sorted, plan), targets }
}
