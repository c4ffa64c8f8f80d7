//! What a compilation is asked for, and what it gives: as far as it came, with all messages.

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_codegen::CompiledModel;
use hyd_equations::{EquationSystem, PlanJacobian, SortedSystem};
use hyd_flat::{FlatModel, VarId};
use hyd_source::{Code, Diagnostic, FileId, Files, Severity};

/// How far to go.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Goal {
    /// Up to the flat model.
    Flat,
    /// Up to the sorted system (checks types, balance and structure).
    Check,
    /// Up to code that runs.
    Run,
}

/// What to compile and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Class to instantiate, dotted; `None`: the last non-partial model of the file.
    pub model: Option<String>,
    /// `--set` values by instance path, as text (`1.2`, `true`, `{1, 2}`).
    pub set: Vec<(String, String)>,
    /// How far to go.
    pub goal: Goal,
    /// Clock for timings (seconds since any origin); the compiler reads none itself.
    pub clock: fn() -> f64,
}

/// A printable stage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stage {
    /// Flat model.
    Flat,
    /// Equation system after alias elimination.
    System,
    /// After index reduction.
    Reduced,
    /// Sorted and torn.
    Sorted,
    /// Partial derivatives and pattern.
    Jacobian,
    /// C of residual, Jacobian and events.
    C,
}

/// Time spent in one stage.
#[derive(Clone, Copy, Debug)]
pub struct StageTime {
    /// Name of the stage.
    pub name: &'static str,
    /// CPU or wall seconds, whatever the clock counts.
    pub seconds: f64,
}

/// Everything a compilation gives: as far as it came, with all messages.
pub struct Compilation {
    /// All texts read.
    pub files: Files,
    /// Messages of all stages in order.
    pub diagnostics: Vec<Diagnostic>,
    /// Full name of the class compiled.
    pub model_name: Option<Arc<str>>,
    /// Flat model.
    pub flat: Option<Arc<FlatModel>>,
    /// Equation system after alias elimination; kept where no code is made.
    pub system: Option<EquationSystem>,
    /// The same after index reduction; kept where no code is made.
    pub reduced: Option<EquationSystem>,
    /// Sorted system.
    pub sorted: Option<Arc<SortedSystem>>,
    /// Derivatives of the system to integrate.
    pub jacobian: Option<PlanJacobian>,
    /// Code.
    pub model: Option<Arc<CompiledModel>>,
    /// Paths of `set` that were used at translation (structural parameters); the others are run-time data.
    pub set_at_translation: Vec<String>,
    /// Variables whose unit is neither declared nor follows from others: name of the first element, number of scalars.
    pub undecided_units: Vec<(String, usize)>,
    /// Units that follow for variables that declare none: the first scalar they hold for, the unit.
    pub inferred_units: Vec<(VarId, String)>,
    /// Files of the text that is compiled and of its package; all others belong to libraries.
    pub(crate) own_files: BTreeSet<FileId>,
    /// Timings.
    pub times: Vec<StageTime>,
}

impl Compilation {
    /// True when a message is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    /// The connectors and inputs of a component that is balanced by itself and only lacks what is connected to it.  That is not a fault, so
    /// messages on numbers of equations and unknowns are withdrawn.  Nothing where anything else is at fault.
    pub fn forgive_open_ends(&mut self) -> Vec<Arc<str>> {
        let is_of_balance =
            |own: &Diagnostic| own.severity == Severity::Error && matches!(own.code, Code::Unbalanced | Code::Singular);
        let mut errors = self.diagnostics.iter().filter(|own| own.severity == Severity::Error).peekable();
        if errors.peek().is_none() || !errors.all(is_of_balance) {
            return Vec::new();
        }
        let ends: Vec<Arc<str>> = self.flat.iter().flat_map(|flat| flat.open_ends.iter().cloned()).collect();
        if !ends.is_empty() {
            self.diagnostics.retain(|own| !is_of_balance(own));
        }
        ends
    }

    /// Text of a stage, if the compilation came that far.
    pub fn print(&self, stage: Stage) -> Option<String> {
        match stage {
            Stage::Flat => self.flat.as_ref().map(|flat| flat.to_string()),
            Stage::System => self.system.as_ref().map(hyd_equations::print_system),
            Stage::Reduced => self.reduced.as_ref().map(hyd_equations::print_system),
            Stage::Sorted => self.sorted.as_ref().map(|sorted| hyd_equations::print_sorted(sorted)),
            Stage::C => self.model.as_ref().map(|model| model.c_text()),
            Stage::Jacobian => {
                let (sorted, jacobian) = (self.sorted.as_ref()?, self.jacobian.as_ref()?);
                Some(hyd_equations::print_jacobian(&sorted.system, &sorted.simulation, jacobian))
            }
        }
    }

    /// What became of a variable, as text; a sentence if there is none of that name.
    pub fn explain(&self, variable: &str) -> Option<Result<String, String>> {
        let sorted = self.sorted.as_ref()?;
        Some(hyd_equations::explain_variable(sorted, &self.files, variable))
    }

    /// A self-contained HTML page that shows the structure of the equations.
    pub fn page(&self) -> Option<String> {
        let (sorted, model) = (self.sorted.as_ref()?, self.model_name.as_deref().unwrap_or_default());
        Some(crate::page::page(model, sorted, &self.files))
    }

    pub(crate) fn new(files: Files, diagnostics: Vec<Diagnostic>) -> Self {
        Self {
            files,
            diagnostics,
            model_name: None,
            flat: None,
            system: None,
            reduced: None,
            sorted: None,
            jacobian: None,
            model: None,
            set_at_translation: Vec::new(),
            undecided_units: Vec::new(),
            inferred_units: Vec::new(),
            own_files: BTreeSet::new(),
            times: Vec::new(),
        }
    }

    /// Runs one stage and notes its time.
    pub(crate) fn stage<T>(&mut self, clock: fn() -> f64, name: &'static str, run: impl FnOnce(&mut Self) -> T) -> T {
        let start = clock();
        let result = run(self);
        self.times.push(StageTime { name, seconds: clock() - start });
        result
    }
}
