//! The stages in order, from the text to the flat model; what follows is in [`crate::back_end`].

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_codegen::CompiledModel;
use hyd_equations::Loops;
use hyd_flat::{FlatModel, Injection, VarId};
use hyd_instance::{ClassId, ClassTable, InstId, Override, Scopes, Sources, Trees};
use hyd_source::{Code, Diagnostic, FileId, Files, Outcome, Severity, Span};

use crate::back_end::sort;
use crate::choice::choose;
use crate::compilation::{Compilation, Goal, Options, StageTime};
use crate::unused::tell_unused;

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
    let units = result.stage(options.clock, "check units", |result| match extras.strict_units {
        true => hyd_units::check_units_strictly(&flat, &result.files),
        false => hyd_units::check_units(&flat, &result.files),
    });
    result.undecided_units = units.undecided.into_iter().map(|found| (found.name, found.count as usize)).collect();
    result.inferred_units = units.inferred.into_iter().map(|found| (found.variable, found.unit)).collect();
    let own = &result.own_files;
    let is_of_library = |found: &Diagnostic| {
        let place = found.labels.iter().find(|label| label.primary).map(|label| label.span.file);
        !extras.strict_units && place.is_some_and(|file| !own.contains(&file))
    };
    let (of_libraries, of_user): (Vec<Diagnostic>, Vec<Diagnostic>) =
        units.diagnostics.into_iter().partition(is_of_library);
    result.diagnostics.extend(of_user);
    sort(&mut result, &flat, options, (extras.terms, extras.loops));
    tell_unused(&mut result.diagnostics, &result.files, name);
    // Behind what users can mend.
    result.diagnostics.extend(libraries_warned(of_libraries));
    result
}

/// Mismatches of units in texts that are not the user's own are one warning: other tools take such libraries.
fn libraries_warned(found: Vec<Diagnostic>) -> Option<Diagnostic> {
    let others = found.len().saturating_sub(1);
    let mut first = found.into_iter().next()?;
    first.severity = Severity::Warning;
    first.labels.retain(|label| label.primary);
    first.notes.clear();
    first.proposals.clear();
    first.notes.push(match others {
        0 => "in a library this is a warning; `--strict-units` makes it an error".to_string(),
        1 => "units do not fit at 1 more place of libraries; `--strict-units` shows both, as errors".to_string(),
        _ => format!("units do not fit at {others} more places of libraries; `--strict-units` shows all, as errors"),
    });
    Some(first)
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
            flat.library_parts = library_parts(&scopes, tree.root, &own_files);
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

/// The components of a model that its own text declares and whose classes stand in libraries.
fn library_parts(scopes: &Scopes<'_>, root: InstId, own: &BTreeSet<FileId>) -> Vec<(Arc<str>, Span)> {
    let children = scopes.instances[root].children.iter().map(|&child| &scopes.instances[child]);
    let is_of_library = |class: ClassId| !own.contains(&scopes.table.class(class).def.name.span.file);
    children
        .filter(|child| own.contains(&child.span.file) && child.class.is_some_and(is_of_library))
        .map(|child| (child.name.clone(), child.span))
        .collect()
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

#[cfg(test)]
mod tests {
    use hyd_instance::SourceText;

    use super::*;

    struct Shelf;

    impl Sources for Shelf {
        fn find(&mut self, path: &[Arc<str>]) -> Result<Option<SourceText>, String> {
            let text = "package Shelf
  model Gain
    input Real u;
    Real y = 2*u;
  end Gain;
  model Strange
    Real x(unit = \"debye\") = 1;
  end Strange;
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
    fn an_inside_of_a_library_is_marked_where_the_user_declares_it() {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 };
        let made = compile(&mut Shelf, "use.mo", "model Use\n  Shelf.Gain gain;\nend Use;\n", &options);
        let error = made.diagnostics.iter().find(|found| found.code == Code::Unbalanced).expect("nothing feeds it");
        let span = error.labels[0].span;
        assert_eq!((&**made.files.name(span.file), made.files.location(span).line), ("use.mo", 2), "{error:?}");
        assert_eq!(error.labels.len(), 1, "{error:?}");
    }

    #[test]
    fn what_a_model_inherits_of_a_library_stands_in_the_library() {
        let options = Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 };
        let severity = |text: &str| {
            let made = compile(&mut Shelf, "use.mo", text, &options);
            let is_of_units = |found: &&Diagnostic| matches!(found.code, Code::UnitMismatch | Code::UnitSyntax);
            let mut units = made.diagnostics.iter().filter(is_of_units);
            units.next().map(|found| found.severity).filter(|_| units.next().is_none())
        };
        assert_eq!(severity("model Use\n  extends Shelf.Mixed;\nend Use;\n"), Some(Severity::Warning));
        // A unit that nobody can read, too; both together are one message.
        assert_eq!(severity("model Use\n  Shelf.Strange a;\nend Use;\n"), Some(Severity::Warning));
        assert_eq!(severity("model Use\n  Shelf.Strange a;\n  Shelf.Mixed b;\nend Use;\n"), Some(Severity::Warning));
        let own = "model Use\n  Real x(unit = \"m\") = 1;\n  Real y(unit = \"s\") = x;\nend Use;\n";
        assert_eq!(severity(own), Some(Severity::Error));
    }
}
