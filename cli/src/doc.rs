//! `hyd doc [DIR]`: the map of a library as one HTML page, with the pictures of its examples.
//!
//! Texts come from the built-in library or from a folder; `hyd-doc` makes the page.  The models that say how they are
//! run are run here, and drawn with the variables that `annotation(__hyd(plot = {...}))` names, else with their first
//! few.  An example that does not run is named in a message and has no picture.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use hyd_compiler::{Goal, Options, compile};
use hyd_doc::{Example, Library, Page, Source};
use hyd_report::{Curve, Figure};
use hyd_results::{Trajectory, write_whole};
use hyd_run::{Selection, check_target, interrupt, read_text};
use hyd_runtime::Simulator;
use hyd_system::DaeSystem;

use crate::arguments::{Doc, MessageFormat};
use crate::fmt::collect;
use crate::{Failure, clock, output, translate};
use hyd_verbs::library::{LibraryPath, built_in_order, built_in_texts};

/// Curves of a picture when the example does not say which.
const FEW: usize = 6;
/// The text of a package, and the file beside it that orders its classes.
const PACKAGE: &str = "package.hyd";
const ORDER: &str = "package.order";
/// Intervals of a picture; more points than it has pixels.
const INTERVALS: usize = 1000;

/// Runs the verb.
pub(crate) fn doc(arguments: &Doc) -> Result<(), Failure> {
    let sources = sources(arguments.library.as_deref())?;
    check_target("--output", &arguments.output, &[])?;
    let library = Library::new(sources.clone());
    if library.count() == 0 {
        return Err(Failure::Fault("the folder holds no classes".to_string()));
    }
    let title = match &arguments.library {
        None => "Library Hyd".to_string(),
        Some(folder) => {
            let name = folder.canonicalize().ok().and_then(|path| path.file_name().map(|name| name.to_os_string()));
            format!("Library {}", name.unwrap_or_default().to_string_lossy())
        }
    };
    let mut pictures = BTreeMap::new();
    if !arguments.no_pictures {
        interrupt::listen();
        for example in library.examples() {
            match picture(&example, &library, arguments.library.as_deref()) {
                Ok(svg) => {
                    pictures.insert(example.class, svg);
                }
                Err(_) if interrupt::requested() => return Err(Failure::Solver("stopped".to_string())),
                Err(reason) => {
                    let sentence = format!("`{}` has no picture: {reason}", example.class);
                    output::sentence("warning", &sentence, MessageFormat::Text);
                }
            }
        }
    }
    let count = (library.count(), pictures.len());
    let page = Page { title, pictures }.html(&library);
    let path = &arguments.output;
    write_whole(path, page.as_bytes())
        .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display())))?;
    output::print(&format!("{} classes, {} pictures of examples in {}\n", count.0, count.1, path.display()))
}

/// The texts to show, and the built-in library to look things up in.
fn sources(folder: Option<&Path>) -> Result<Vec<Source>, Failure> {
    let mut sources = Vec::new();
    if let Some(folder) = folder {
        if !folder.is_dir() {
            return Err(Failure::Fault(format!("there is no folder `{}`", folder.display())));
        }
        let mut files = BTreeSet::new();
        collect(folder, &mut files).map_err(Failure::Fault)?;
        let (packages, others): (Vec<_>, Vec<_>) = files.into_iter().partition(|file| is_package(file));
        for file in packages.into_iter().chain(others) {
            let text = read_text(&file).map_err(|error| Failure::Fault(error.to_string()))?;
            let order = match file.with_file_name(ORDER) {
                beside if is_package(&file) && beside.is_file() => {
                    names(&read_text(&beside).map_err(|error| Failure::Fault(error.to_string()))?)
                }
                _ => Vec::new(),
            };
            sources.push(Source { name: file.display().to_string(), text, shown: true, order });
        }
    }
    let shown = folder.is_none();
    let (packages, others): (Vec<_>, Vec<_>) = built_in_texts().partition(|(name, _)| name.ends_with(PACKAGE));
    let built_in = packages.into_iter().chain(others);
    sources.extend(built_in.map(|(name, text)| Source {
        name: format!("<built-in>/{name}"),
        text: text.into(),
        shown,
        order: names(built_in_order(name)),
    }));
    Ok(sources)
}

/// A file that holds the package its folder is.
fn is_package(file: &Path) -> bool {
    file.file_stem().is_some_and(|stem| stem == "package")
}

/// The names that a `package.order` lists, one a line.
fn names(text: &str) -> Vec<String> {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).map(String::from).collect()
}

/// Runs an example and draws it; `Err`: why that is not possible.
fn picture(example: &Example, library: &Library, folder: Option<&Path>) -> Result<String, String> {
    let source = library.source_of(&example.class).ok_or("its text is not there")?;
    let mut classes = LibraryPath::new();
    if let Some(folder) = folder {
        classes.add_main_file(Path::new(&source.name), &source.text);
        classes.add_folder(folder)?;
    }
    let options =
        Options { model: Some(example.class.clone()), set: Vec::new(), goal: Goal::Run, clock: clock::cpu_seconds };
    let compilation = compile(&mut classes, &source.name, &source.text, &options);
    let Some(model) = compilation.model.clone().filter(|_| !compilation.has_errors()) else {
        translate::report(&compilation.files, &compilation.diagnostics, MessageFormat::Text);
        return Err("it has errors".to_string());
    };
    let mut system = model.instantiate();
    let experiment = compilation.flat.as_ref().map(|flat| flat.experiment.clone()).unwrap_or_default();
    let start = experiment.start.unwrap_or(0.0);
    let mut run = hyd_runtime::Options::new(start, experiment.stop.unwrap_or(start + 1.0));
    run.tolerance = experiment.tolerance.unwrap_or(run.tolerance);
    run.intervals = INTERVALS;
    let mut trajectory = Trajectory::new();
    let mut simulator = Simulator::new(system.structure());
    simulator.run(&mut system, &run, &mut trajectory, &interrupt::requested).map_err(|error| error.to_string())?;
    let pattern = example.plot.iter().map(|name| regex::escape(name)).collect::<Vec<_>>().join("|");
    let pattern = (!pattern.is_empty()).then(|| format!("^({pattern})$"));
    let mut shown =
        Selection::new(pattern.as_deref()).map_err(|_| "its list of variables is too long")?.shown(system.tables());
    if pattern.is_none() {
        shown.truncate(FEW);
    }
    if shown.is_empty() {
        return Err("it has no variables of the names that it lists".to_string());
    }
    let times: std::sync::Arc<[f64]> = trajectory.times().into();
    let curves = shown.into_iter().map(|shown| {
        let values = trajectory.series_of(shown.column.source).values();
        (shown.unit, Curve { name: shown.column.name, run: 0, times: times.clone(), values })
    });
    Ok(Figure { title: Some(example.class.clone()), ..Figure::by_unit(Vec::new(), curves) }.draw().svg())
}
