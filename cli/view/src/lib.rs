//! The view, `hyd view`: a model or results as one page, served on the loopback or written as a file.
//!
//! Data flow one way: files become a `session` (a model translated, with the diagrams that `diagram` reads from its instances and annotations, and
//! results, the `finding` of a search and the shots of a bench `beside` it), that becomes data and a `page`; `server` answers what the page asks while somebody looks at it (runs with other parameters, as
//! bytes of `encode`) over `http`, and `guard` says who may ask.  Nothing is written but what `--output` names, and nothing leaves the machine.

mod beside;
mod diagram;
mod encode;
mod finding;
mod guard;
mod http;
mod page;
mod planned;
mod reading;
mod server;
mod session;
mod variables;

use std::path::{Path, PathBuf};

use hyd_compiler::Severity;
use hyd_results::{note_read, write_whole};
use hyd_run::{Failure, check_target, interrupt, read_text};
use hyd_verbs::{Host, Libraries, Listener};

use guard::Guard;
use reading::Reading;
use serde_json::Value;
use server::Served;
use session::{Chosen, Session};

/// What the command line says.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// A model, with results that are overlaid and the report of a search; or a study; or results; or the report of a search.
    pub files: Vec<PathBuf>,
    /// The class to take; none: the last complete model of the file.
    pub class: Option<String>,
    /// Parameters by full name, with their values as text.
    pub set: Vec<(String, String)>,
    /// Where runs end (s); none: as the model says.
    pub stop: Option<f64>,
    /// Where classes come from.
    pub libraries: Libraries,
    /// Units that do not fit are errors in libraries, too.
    pub strict_units: bool,
    /// The file to write; none: the page is served.
    pub output: Option<PathBuf>,
    /// The port of the loopback; 0: a free one.
    pub port: u16,
    /// The set of shots of a study.
    pub bench: Option<PathBuf>,
    /// How processes of units of other tools are begun; none where they cannot be.
    pub host: Option<Host>,
}

/// The report of a search, in the folder that `hyd discover --report` writes, and the shots to make next, which `hyd next --report` writes.
const REPORT: &str = "report.html";
const NEXT: &str = "next.html";

/// Writes the page, or serves it until Ctrl-C.  `tell`: takes what goes to standard output.
///
/// # Errors
/// Wrong usage, files that cannot be read, models with errors, a port that is taken.
pub fn view(
    options: &Options,
    listener: &dyn Listener,
    tell: &dyn Fn(&str) -> Result<(), Failure>,
) -> Result<(), Failure> {
    if let Some(path) = report(&options.files) {
        if options.output.is_some() {
            let path = path.display();
            return Err(Failure::Usage(format!("`{path}` is a page in one file already")));
        }
        let dropped = [("--bench", options.bench.is_some()), ("--model", options.class.is_some())];
        if let Some((option, _)) = dropped.into_iter().find(|(_, is_given)| *is_given) {
            return Err(Failure::Usage(format!(
                "{option} says nothing of a report, which knows its model and its shots"
            )));
        }
        let page = read_text(&path).map_err(|error| Failure::Fault(error.to_string()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let reading = written(options, folder, listener);
        let dropped = [("--set", !options.set.is_empty()), ("--stop", options.stop.is_some())];
        if let Some((option, _)) = dropped.into_iter().find(|(_, is_given)| *is_given && reading.is_none()) {
            let path = path.display();
            return Err(Failure::Usage(format!("{option}: `{path}` has no model beside it that could be run")));
        }
        let served = Served { is_report: true, report: Some(page), next: next(folder)?, reading };
        return serve(options.port, &path.display().to_string(), served, tell);
    }
    if let Some(output) = &options.output {
        let texts: Vec<&Path> = options.files.iter().map(PathBuf::as_path).collect();
        check_target("--output", output, &texts)?;
    }
    let (session, data) = open(options, listener)?;
    let Some(output) = &options.output else {
        let title = session.title.clone();
        let mut folders =
            options.files.iter().filter_map(|file| finding::report_of(file)?.parent().map(Path::to_path_buf));
        let folder = folders.next_back();
        let page = folder.as_ref().map(|folder| folder.join(REPORT)).filter(|page| page.is_file());
        let report =
            page.map(|page| read_text(&page)).transpose().map_err(|error| Failure::Fault(error.to_string()))?;
        let next = folder.map_or(Ok(None), |folder| next(&folder))?;
        let reading = Some(Reading::new(options.clone(), session, data));
        return serve(options.port, &title, Served { is_report: false, report, next, reading }, tell);
    };
    // Only now is it known which files are read.
    check_target("--output", output, &[])?;
    interrupt::listen();
    let html = page::html(&session, &data, &page::Shown::Written);
    if interrupt::requested() {
        return Err(Failure::Solver("stopped".to_string()));
    }
    write_whole(output, html.as_bytes())
        .map_err(|error| Failure::Fault(format!("`{}` cannot be written: {error}", output.display())))?;
    tell(&format!("{} in {}, {} kB\n", session.title, output.display(), html.len().div_ceil(1000)))
}

/// Reads and translates what is looked at.
fn open(options: &Options, listener: &dyn Listener) -> Result<(Session, Value), Failure> {
    let chosen = Chosen {
        class: options.class.as_deref(),
        set: &options.set,
        stop: options.stop,
        libraries: &options.libraries,
        strict_units: options.strict_units,
        bench: options.bench.as_deref(),
        host: options.host.as_ref(),
    };
    let session = Session::open(&options.files, &chosen, listener)?;
    let data = page::data(&session);
    Ok((session, data))
}

/// The page of the shots to make next, if a folder has one.
fn next(folder: &Path) -> Result<Option<String>, Failure> {
    let page = Some(folder.join(NEXT)).filter(|page| page.is_file());
    page.map(|page| read_text(&page)).transpose().map_err(|error| Failure::Fault(error.to_string()))
}

/// The model that a report has written, beside its shots.  None where there is none, and, with a warning, where it can no longer be translated:
/// the report can be read all the same.
fn written(options: &Options, folder: &Path, listener: &dyn Listener) -> Option<Reading> {
    let model = folder.join(hyd_verbs::shots::WRITTEN_MODEL);
    if !model.is_file() || finding::report_of(folder).is_none() {
        return None;
    }
    let own = Options { files: vec![model, folder.to_path_buf()], class: None, ..options.clone() };
    match open(&own, listener) {
        Ok((session, data)) => Some(Reading::new(own, session, data)),
        Err(failure) => {
            if let Failure::Fault(text) | Failure::Usage(text) | Failure::Solver(text) = failure {
                listener.sentence(Severity::Warning, &text);
            }
            None
        }
    }
}

/// The page of a report that is meant: itself, or the folder that holds it.
fn report(files: &[PathBuf]) -> Option<PathBuf> {
    let [file] = files else { return None };
    let page = if file.is_dir() { file.join(REPORT) } else { file.clone() };
    let is_page = page.extension().is_some_and(|ending| ending == "html") && page.is_file();
    let page = Some(page).filter(|_| is_page)?;
    note_read(&page);
    Some(page)
}

fn serve(port: u16, title: &str, served: Served, tell: &dyn Fn(&str) -> Result<(), Failure>) -> Result<(), Failure> {
    let (listener, port) = server::listen(port).map_err(Failure::Fault)?;
    let guard = Guard::new(port).map_err(Failure::Fault)?;
    tell(&format!("{title}: http://127.0.0.1:{port}/?token={}\nCtrl-C ends it\n", guard.token()))?;
    server::serve(listener, guard, served).map_err(Failure::Fault)
}
