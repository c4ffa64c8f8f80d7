//! The stages in order, with their names, timings, checks and printers.

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_codegen::{CompiledModel, Jacobians};
use hyd_equations::{Combination, EquationSystem, Loops, PlanJacobian, SortedSystem};
use hyd_flat::{FlatModel, Injection, PerElement, VarId};
use hyd_instance::class::nested_classes;
use hyd_instance::{ClassId, ClassTable, Override, Sources, Trees};
use hyd_source::{Code, Diagnostic, FileId, Files, Outcome, Severity, did_you_mean};
use hyd_syntax::tree::{ClassDef, ClassKind, Name};

use crate::injection::refusals;
use crate::limits::{check_limits, check_starts};

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
    own_files: BTreeSet<FileId>,
    /// Timings.
    pub times: Vec<StageTime>,
}

impl Compilation {
    /// True when a message is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|d| d.severity == Severity::Error)
    }

    /// The connectors and inputs of a component that is balanced by itself and only lacks what is connected to it.  That is no fault, so
    /// what is said of numbers of equations and unknowns is withdrawn.  Nothing where anything else is at fault.
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

    fn new(files: Files, diagnostics: Vec<Diagnostic>) -> Self {
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
    fn stage<T>(&mut self, clock: fn() -> f64, name: &'static str, run: impl FnOnce(&mut Self) -> T) -> T {
        let start = clock();
        let result = run(self);
        self.times.push(StageTime { name, seconds: clock() - start });
        result
    }
}

/// Compiles `text` (shown in messages as `name`) with the libraries that `sources` knows.
pub fn compile(sources: &mut dyn Sources, name: &str, text: &str, options: &Options) -> Compilation {
    compile_with(sources, name, text, options, &[])
}

/// What a model is compiled with beside its text.
#[derive(Clone, Copy, Default)]
pub struct Extras<'a> {
    /// Terms added to equations.
    pub terms: &'a [Injection],
    /// What becomes of loops.
    pub loops: Loops,
    /// Names of inputs of the model itself that follow recorded samples, see [`hyd_flat::flatten`].
    pub driven: &'a [String],
    /// Units that do not fit are errors in libraries, too.
    pub strict_units: bool,
    /// Whoever runs the model joins it with the units of other tools that are blocks of it, see [`hyd_flat::ForeignBlock`].
    pub joined: bool,
}

/// As [`compile`], with all that a text does not say.
pub fn compile_extended(
    sources: &mut dyn Sources,
    name: &str,
    text: &str,
    options: &Options,
    extras: &Extras<'_>,
) -> Compilation {
    compile_loops((sources, None), name, text, options, extras)
}

/// The same over trees that are kept from one compilation to the next: only texts that have changed are parsed.
pub fn compile_over(
    sources: &mut dyn Sources,
    trees: &mut Trees,
    name: &str,
    text: &str,
    options: &Options,
    extras: &Extras<'_>,
) -> Compilation {
    compile_loops((sources, Some(trees)), name, text, options, extras)
}

/// The same with terms added to equations of the model.
pub fn compile_with(
    sources: &mut dyn Sources,
    name: &str,
    text: &str,
    options: &Options,
    terms: &[Injection],
) -> Compilation {
    compile_loops((sources, None), name, text, options, &Extras { terms, ..Extras::default() })
}

/// As [`compile`], with all variables of loops as unknowns of the solver: for values of the parameters with which rounding errors grow
/// along a torn loop.
pub fn compile_whole_loops(sources: &mut dyn Sources, name: &str, text: &str, options: &Options) -> Compilation {
    compile_loops((sources, None), name, text, options, &Extras { loops: Loops::Whole, ..Extras::default() })
}

/// Makes code once more of a model that has been compiled, with all variables of loops as unknowns of the solver; `flat` and `files` are
/// those of the compilation, which had no errors under the same options.
///
/// # Errors
/// What the compiler says of the model with whole loops.
pub fn with_whole_loops(
    flat: &FlatModel,
    files: &Files,
    options: &Options,
) -> Result<Arc<CompiledModel>, Vec<Diagnostic>> {
    let mut result = Compilation::new(files.clone(), Vec::new());
    sort(&mut result, flat, options, (&[], Loops::Whole));
    match result.model.take() {
        Some(model) if !result.has_errors() => Ok(model),
        _ => Err(result.diagnostics),
    }
}

/// Where texts come from, and their trees as far as they are kept.
type Texts<'s> = (&'s mut dyn Sources, Option<&'s mut Trees>);

fn compile_loops(sources: Texts<'_>, name: &str, text: &str, options: &Options, extras: &Extras<'_>) -> Compilation {
    let mut result = front_end(sources, name, text, options, extras);
    // What will feed a block does not matter before it runs.
    if options.goal < Goal::Run {
        result.diagnostics.retain(|diagnostic| diagnostic.code != Code::OpenInput);
    }
    if options.goal == Goal::Flat || result.has_errors() {
        return result;
    }
    let Some(flat) = result.flat.clone() else { return result };
    if let Some(block) = flat.foreign.first().filter(|_| options.goal == Goal::Run && !extras.joined) {
        let message = format!("the model holds the unit `{}` of another tool, which cannot be run here", block.file);
        let help = "models with units in them are run by `hyd simulate`, `hyd fit` and `hyd discover`";
        result.diagnostics.push(Diagnostic::error(Code::OutsideProfile, message).at(block.span, "").help(help));
        return result;
    }
    let units = result.stage(options.clock, "check units", |result| hyd_units::check_units(&flat, &result.files));
    result.undecided_units = units.undecided.into_iter().map(|found| (found.name, found.count as usize)).collect();
    result.inferred_units = units.inferred.into_iter().map(|found| (found.variable, found.unit)).collect();
    let own = result.own_files.clone();
    result.diagnostics.extend(units.diagnostics.into_iter().map(|found| match extras.strict_units {
        true => found,
        false => of_libraries_warned(found, &own),
    }));
    sort(&mut result, &flat, options, (extras.terms, extras.loops));
    result
}

/// A mismatch of units in a text that is not the user's own is a warning: other tools take such libraries.
fn of_libraries_warned(mut found: Diagnostic, own: &BTreeSet<FileId>) -> Diagnostic {
    let place = found.labels.iter().find(|label| label.primary).map(|label| label.span.file);
    if found.severity == Severity::Error && place.is_some_and(|file| !own.contains(&file)) {
        found.severity = Severity::Warning;
        found.notes.push("in a library this is a warning; `--strict-units` makes it an error".to_string());
    }
    found
}

/// Text to flat model; anew with arrays of components in parts, where their elements were found to differ.
fn front_end(
    (sources, mut trees): Texts<'_>,
    name: &str,
    text: &str,
    options: &Options,
    extras: &Extras<'_>,
) -> Compilation {
    let mut apart = BTreeSet::new();
    loop {
        let texts: Texts<'_> = (&mut *sources, trees.as_deref_mut());
        let (result, differing) = read(texts, (name, text), options, extras, apart.clone());
        let known = apart.len();
        apart.extend(differing);
        if !result.has_errors() || apart.len() == known {
            return result;
        }
    }
}

/// Text to flat model, and the paths of arrays whose elements differ where one instance cannot stand for all of them.
fn read(
    (sources, trees): Texts<'_>,
    (name, text): (&str, &str),
    options: &Options,
    extras: &Extras<'_>,
    apart: BTreeSet<String>,
) -> (Compilation, BTreeSet<String>) {
    let start = (options.clock)();
    let mut table = match trees {
        Some(trees) => ClassTable::over(sources, trees),
        None => ClassTable::new(sources),
    };
    let classes = table.add_main(name, text);
    let parsed = (options.clock)();
    let broken = table.messages.has_errors();
    let chosen = if broken { None } else { choose(&mut table, name, &classes, options.model.as_deref()) };
    let Some(class) = chosen else {
        return (Compilation::new(table.files, table.messages.into_given()), BTreeSet::new());
    };
    let overrides = options.set.iter();
    let overrides = overrides.map(|(path, text)| Override { path: path.clone(), text: text.clone(), used: false });
    let overrides = overrides.collect();
    let model_name: Arc<str> = table.full_name(class).into();
    let mut differing = BTreeSet::new();
    let mut result = match hyd_instance::instantiate_apart(table, class, overrides, apart) {
        Err(table) => Compilation::new(table.files, table.messages.into_given()),
        Ok((tree, mut scopes)) => {
            let instantiated = (options.clock)();
            debug_assert_eq!(scopes.verify(), Ok(()), "invariant of the instance tree");
            let Outcome { value: mut flat, diagnostics } =
                hyd_flat::flatten(&tree, &mut scopes, extras.terms, extras.driven);
            scopes.table.messages.report_all(diagnostics);
            if !scopes.table.messages.has_errors() {
                let Outcome { value, diagnostics } = hyd_clocks::resolve_clocks(flat);
                scopes.table.messages.report_all(diagnostics);
                flat = value;
            }
            flat.given = given(&flat, &options.set);
            debug_assert_eq!(hyd_flat::verify(&flat), Ok(()), "invariant of the flat model");
            if !scopes.table.messages.has_errors() {
                // What follows a mistake may only seem unused.
                scopes.table.advise(&classes);
            }
            differing.clone_from(scopes.differing());
            let own_files = own_files(&scopes.table, &classes);
            let used = scopes.overrides.iter().filter(|o| o.used).map(|o| o.path.clone()).collect();
            let mut result = Compilation::new(scopes.table.files, scopes.table.messages.into_given());
            result.set_at_translation = used;
            result.own_files = own_files;
            result.times.push(StageTime { name: "parse", seconds: parsed - start });
            result.times.push(StageTime { name: "instantiate", seconds: instantiated - parsed });
            result.times.push(StageTime { name: "flatten", seconds: (options.clock)() - instantiated });
            result.flat = Some(Arc::new(flat));
            result
        }
    };
    result.model_name = Some(model_name);
    (result, differing)
}

/// The files of the classes of the main text, and of all that stands in the same package at the top.
fn own_files(table: &ClassTable<'_>, classes: &[ClassId]) -> BTreeSet<FileId> {
    let top = |class: ClassId| table.class(class).path.first().cloned();
    let tops: BTreeSet<_> = classes.iter().filter_map(|&class| top(class)).collect();
    // What they inherit is read in them, but stands elsewhere.
    let around = |class: ClassId| std::iter::successors(Some(class), |&class| table.class(class).parent);
    let is_written = |class: ClassId| around(class).all(|class| table.class(class).written_in.is_none());
    let own =
        table.class_ids().filter(|&class| is_written(class) && top(class).is_some_and(|name| tops.contains(&name)));
    own.map(|class| table.class(class).def.name.span.file).chain(table.main).collect()
}

/// Numbers of `set` by scalar variable; names that mean no scalar are left to whoever applies them.
fn given(flat: &FlatModel, set: &[(String, String)]) -> Vec<(VarId, f64)> {
    let scalar = |name: &str| {
        flat.variables.iter().find_map(|block| {
            let k = (0..block.count as usize).find(|&k| block.name.element(k) == name)?;
            Some(VarId(block.first.0 + k as u32))
        })
    };
    set.iter().filter_map(|(name, text)| Some((scalar(name)?, text.trim().parse().ok()?))).collect()
}

/// Flat model to sorted system with its derivatives, and to code if that is wanted.
fn sort(result: &mut Compilation, flat: &FlatModel, options: &Options, (terms, loops): (&[Injection], Loops)) {
    let attempt =
        hyd_equations::until_regular(|combinations| sort_once(result, flat, options, (terms, loops), combinations));
    result.diagnostics.extend(attempt.diagnostics);
    result.set_at_translation.extend(attempt.set_at_translation);
    result.system = attempt.system;
    result.reduced = attempt.reduced;
    let Some(mut sorted) = attempt.sorted else { return };
    let own = result.own_files.clone();
    let (messages, waived) = check_limits(&sorted, &options.set, &own);
    result.diagnostics.extend(messages);
    // What has been let pass here is not refused when it is run.
    for v in waived {
        let block = sorted.system.flat.locate(v).0;
        let variable = &mut sorted.system.flat.variables[block];
        (variable.min, variable.max) = (PerElement::All(f64::NEG_INFINITY), PerElement::All(f64::INFINITY));
    }
    result.diagnostics.extend(check_starts(&sorted));
    let jacobian = result.stage(options.clock, "differentiate", |_| {
        hyd_equations::differentiate(&mut sorted.system, &sorted.simulation)
    });
    if options.goal == Goal::Run {
        generate(result, &mut sorted, &jacobian, options);
    }
    result.jacobian = Some(jacobian);
    result.sorted = Some(Arc::new(sorted));
}

/// What became of a flat model whose equations were sorted in one way.
#[derive(Default)]
struct Sorting {
    diagnostics: Vec<Diagnostic>,
    set_at_translation: Vec<String>,
    system: Option<EquationSystem>,
    reduced: Option<EquationSystem>,
    sorted: Option<SortedSystem>,
}

/// One attempt, with sums in the place of some equations; which sum may help, if it fails.
fn sort_once(
    result: &mut Compilation,
    flat: &FlatModel,
    options: &Options,
    (terms, loops): (&[Injection], Loops),
    combinations: &[Combination],
) -> Result<Sorting, Box<(Sorting, Option<Combination>)>> {
    // Where code is made, stages in between are handed on: copies of a million equations are dear.
    let copy = |system: &EquationSystem| (options.goal < Goal::Run).then(|| system.clone());
    let mut made = Sorting::default();
    let build = |_: &mut Compilation| hyd_equations::build_combined(flat.clone(), combinations);
    let Some(system) = result.stage(options.clock, "eliminate aliases", build) else {
        return Err(Box::new((made, None)));
    };
    made.system = copy(&system);
    let Outcome { value, diagnostics } =
        result.stage(options.clock, "reduce index", |_| hyd_equations::reduce_index(system));
    made.diagnostics.extend(diagnostics);
    let Some(reduced) = value else { return Err(Box::new((made, None))) };
    made.diagnostics.extend(refusals(&reduced, terms));
    let fixed = reduced.reduction.fixed_at_zero.iter().map(|&v| reduced.flat.var_name(v));
    made.set_at_translation.extend(fixed.filter(|name| options.set.iter().any(|(set, _)| set == name)));
    made.reduced = copy(&reduced);
    let Outcome { value, diagnostics } =
        result.stage(options.clock, "sort", |_| hyd_equations::sort_system(reduced, loops));
    made.diagnostics.extend(diagnostics);
    match value {
        Ok(sorted) => {
            made.sorted = Some(sorted);
            Ok(made)
        }
        Err(next) => Err(Box::new((made, next))),
    }
}

/// Sorted system to code.
fn generate(result: &mut Compilation, sorted: &mut SortedSystem, jacobian: &PlanJacobian, options: &Options) {
    if result.has_errors() {
        return;
    }
    let made = result.stage(options.clock, "generate code", |result| {
        let initial = hyd_equations::differentiate(&mut sorted.system, &sorted.initial);
        let jacobians = Jacobians { simulation: jacobian, initial: &initial };
        hyd_codegen::generate(sorted, jacobians, &result.files, &hyd_codegen::Options::default())
    });
    match made {
        Ok(model) => result.model = Some(Arc::new(model)),
        Err(diagnostic) => result.diagnostics.push(diagnostic),
    }
}

/// The class to instantiate: the one named, else the last complete model of the text.
pub(crate) fn choose(
    table: &mut ClassTable<'_>,
    file: &str,
    classes: &[ClassId],
    wanted: Option<&str>,
) -> Option<ClassId> {
    match wanted {
        Some(name) => find(table, classes, name),
        None => {
            let found = classes.iter().rev().find_map(|&class| last_model(table, class));
            if found.is_none() {
                let (message, help) = match classes {
                    [] => (format!("`{file}` holds no model: it is empty"), None),
                    _ => (
                        format!("`{file}` holds no complete model, only packages, functions or partial classes"),
                        Some("`--model` takes a model from a library".to_string()),
                    ),
                };
                table.report(Diagnostic::error(Code::UnknownClass, message).maybe_help(help));
            }
            found
        }
    }
}

fn complete_model(def: &ClassDef) -> bool {
    matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) && !def.partial
}

/// The last complete model in a class of the text: itself, or for packages the last inside.
fn last_model(table: &mut ClassTable<'_>, class: ClassId) -> Option<ClassId> {
    let def = table.class(class).def.clone();
    if complete_model(&def) {
        return Some(class);
    }
    if def.kind != ClassKind::Package {
        return None;
    }
    let names: Vec<Name> = nested_classes(&def).map(|n| n.class.name.name.clone()).collect();
    names.iter().rev().find_map(|name| {
        let child = table.child(class, name)?;
        last_model(table, child)
    })
}

/// A class by its name in the text or its full name.
fn find(table: &mut ClassTable<'_>, classes: &[ClassId], name: &str) -> Option<ClassId> {
    let parts: Vec<Name> = name.split('.').map(Name::from).collect();
    let mut found = classes.iter().copied().find(|&class| table.class(class).def.name.name == parts[0]);
    if found.is_none() {
        found = table.top(&parts[0]);
    }
    let mut current = found;
    for part in &parts[1..] {
        current = current.and_then(|class| table.member_class(class, part));
    }
    if current.is_none() {
        let mut names: Vec<String> = Vec::new();
        for &class in classes {
            let own = table.class(class).def.name.name.to_string();
            names.extend(table.child_names(class).iter().map(|child| format!("{own}.{child}")));
            names.push(own);
        }
        let mut help = did_you_mean(name, names.iter().map(String::as_str));
        if help.is_none() {
            // Perhaps only the package before the name is missing.
            let last = |full: &'_ String| full.rsplit('.').next().unwrap_or_default().to_string();
            let ends: Vec<String> = names.iter().map(last).collect();
            let close = did_you_mean(name, ends.iter().map(String::as_str));
            let full = names
                .iter()
                .zip(&ends)
                .find(|(_, end)| close.as_ref().is_some_and(|c| c.contains(&format!("`{end}`"))));
            help = full.map(|(full, _)| format!("did you mean `{full}`?"));
        }
        let message = format!("there is no class `{name}` in the text or the libraries");
        table.report(Diagnostic::error(Code::UnknownClass, message).maybe_help(help));
    }
    current
}

#[cfg(test)]
mod tests {
    use hyd_instance::SourceText;

    use super::*;

    struct Shelf;

    impl Sources for Shelf {
        fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
            let text = "package Shelf
  model Mixed
    model Part
      Real x(unit = \"m\") = 1;
      Real y(unit = \"s\") = x;
    end Part;
    Part part;
  end Mixed;
end Shelf;
";
            let named = |name: &str| SourceText { name: name.into(), text: text.into() };
            Ok((path.len() == 1 && &*path[0] == "Shelf").then(|| named("Shelf.mo")))
        }
    }

    #[test]
    fn what_a_model_inherits_of_a_library_stands_in_the_library() {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 };
        let severity = |text: &str| {
            let made = compile(&mut Shelf, "use.mo", text, &options);
            let units = made.diagnostics.iter().find(|found| found.code == Code::UnitMismatch);
            units.map(|found| found.severity)
        };
        assert_eq!(severity("model Use\n  extends Shelf.Mixed;\nend Use;\n"), Some(Severity::Warning));
        let own = "model Use\n  Real x(unit = \"m\") = 1;\n  Real y(unit = \"s\") = x;\nend Use;\n";
        assert_eq!(severity(own), Some(Severity::Error));
    }
}
