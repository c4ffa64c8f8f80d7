//! Many runs on all cores, as `hyd sweep` does them; their tables come back as columns.

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use hyd_compiler::Severity;
use hyd_frames::{Cells, Frame};
use hyd_run::{
    DrawMethod, Failure, InputArguments, InputTable, MessageFormat, SweepArguments, Swept, failures_told,
    override_plan, prepare, runs_done_again,
};
use hyd_verbs::share_out::{Model, Shared, Sharing, share_out};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::array::Array;
use crate::messages::{Kept, Message, exception, failed, stopped, warnings};
use crate::signals::watched;
use crate::translated::Translated;

/// Keywords; none: as the command line has it.
#[derive(FromPyObject, Clone, Debug)]
#[pyo3(from_item_all)]
pub(crate) struct SweepOptions {
    vary: Vec<(String, String)>,
    result: PathBuf,
    /// The folder is the caller's, not a temporary one.
    kept: bool,
    samples: Option<usize>,
    method: Option<String>,
    seed: Option<u64>,
    rows: bool,
    measure: Vec<String>,
    threads: Option<NonZeroUsize>,
    variables: Option<String>,
    stop: Option<f64>,
    tolerance: Option<f64>,
    intervals: Option<usize>,
    /// By what the sweep is shared out, to how many shards, and how.
    on: Option<String>,
    shards: Option<usize>,
    resume: bool,
    settle: Option<f64>,
    /// The interpreter that talks to Dask.
    python: String,
}

impl SweepOptions {
    /// Names of what varies.
    pub(crate) fn varied(&self) -> impl Iterator<Item = String> {
        self.vary.iter().map(|(name, _)| name.clone())
    }

    /// How the sweep is shared out, if it is.
    fn sharing(&self) -> Result<Option<Sharing>, Failure> {
        let how = (self.resume, self.settle);
        let sharing = Sharing::read(self.on.as_deref(), self.shards, how, self.threads.map(NonZeroUsize::get))?;
        Ok(sharing.map(|own| Sharing { python: Some(OsString::from(&self.python)), ..own }))
    }

    fn arguments(self, set: Vec<(String, String)>) -> Result<SweepArguments, Failure> {
        let method = match self.method.as_deref() {
            None => None,
            Some("lhs") => Some(DrawMethod::Lhs),
            Some("random") => Some(DrawMethod::Random),
            Some(other) => return Err(Failure::Usage(format!("method: `{other}` is not lhs or random"))),
        };
        Ok(SweepArguments {
            vary: self.vary,
            samples: self.samples,
            method,
            seed: self.seed,
            result: Some(self.result),
            rows: self.rows,
            measure: self.measure,
            shard: None,
            inputs: InputArguments::default(),
            threads: self.threads,
            variables: self.variables,
            stop: self.stop,
            tolerance: self.tolerance,
            intervals: self.intervals,
            set,
            parameters: None,
            message_format: MessageFormat::Text,
            json: false,
        })
    }
}

/// Runs a sweep; gives its numbers, and its tables as columns.
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    (translated, set): (&Arc<Translated>, Vec<(String, String)>),
    options: SweepOptions,
    table: Option<&InputTable>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let is_kept = options.kept;
    let sharing = options.sharing().map_err(|failure| failed(py, &failure, &[]))?;
    let arguments = options.arguments(set.clone()).map_err(|failure| failed(py, &failure, &[]))?;
    let (kept, stop) = (Kept::default(), AtomicBool::new(false));
    let (done, all) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || {
        let class = translated.compilation.model_name.as_deref().map(str::to_string);
        let mut plan = hyd_run::Plan { class, ..hyd_run::Plan::default() };
        override_plan(&mut plan, &arguments)?;
        let prepared = prepare(&arguments, plan)?;
        hyd_verbs::sweep::sweep((&translated.compilation, &set), table, &prepared, &kept, |subject| {
            let count = |now: usize, of: usize| {
                done.store(now, Ordering::Relaxed);
                all.store(of, Ordering::Relaxed);
            };
            let stop = || stop.load(Ordering::Relaxed);
            let Some(sharing) = &sharing else { return prepared.work(subject, &count, &stop) };
            let launcher = || hyd::launcher(&prepared.root().join("submission"));
            let model = Model { compilation: &translated.compilation, set: &set, table, launcher: &launcher };
            match share_out(&model, (&prepared, subject), sharing, &kept, &count, &stop)? {
                Shared::All(before) => {
                    let mut swept = prepared.work(subject, &|_, _| {}, &stop)?;
                    swept.credit(before);
                    Ok(swept)
                }
                // Without an engine it is not called.
                Shared::Ready(..) => Err(Failure::Usage("--shards: --on is needed, too".to_string())),
            }
        })
    };
    let told = |py: Python<'_>| -> PyResult<()> {
        let Some(progress) = &progress else { return Ok(()) };
        let of = all.load(Ordering::Relaxed);
        // Nothing is known before the runs begin.
        if of == 0 {
            return Ok(());
        }
        progress.call1(py, (done.load(Ordering::Relaxed), of)).map(|_| ())
    };
    let (swept, caught) = watched(py, &stop, work, &told)?;
    let messages = kept.take();
    if let Some(error) = caught {
        let sentence = match is_kept {
            true => "interrupted; the same call with the same result folder goes on where it was stopped",
            false => {
                "interrupted; with a folder for the results (result=...) the same call would go on where it was stopped"
            }
        };
        return Err(stopped(py, error, Some(sentence), &messages, None));
    }
    let swept: Swept = swept.map_err(|failure| failed(py, &failure, &messages))?;
    told(py)?;
    let report = &swept.report;
    let mut said = messages;
    if report.whole_loops > 0 {
        said.push(Message::sentence(Severity::Warning, &runs_done_again(report.whole_loops)));
    }
    let failures: Vec<Message> = failures_told(report)
        .into_iter()
        .map(|(severity, text)| {
            let severity = match severity {
                "error" => Severity::Error,
                "warning" => Severity::Warning,
                _ => Severity::Note,
            };
            Message::sentence(severity, &text)
        })
        .collect();
    if failures.iter().any(|message| message.severity == Severity::Error) {
        said.extend(failures);
        return Err(exception(py, "run", None, &said, None));
    }
    said.extend(failures);
    let dict = PyDict::new(py);
    dict.set_item("warnings", warnings(py, &said)?)?;
    dict.set_item("members", report.members)?;
    dict.set_item("before", report.before)?;
    dict.set_item("now", report.now)?;
    dict.set_item("failed", report.failed)?;
    let reasons = report.failures.iter().map(|own| (own.count, own.member, own.message.clone()));
    dict.set_item("failures", reasons.collect::<Vec<_>>())?;
    let files = swept.files.unwrap_or_default();
    for (name, file) in ["table", "rows"].into_iter().zip(&files) {
        let (columns, units) = frame(py, file)?;
        dict.set_item(name, columns)?;
        dict.set_item("units", units)?;
    }
    Ok(dict)
}

/// The columns of a file, and their units as JSON.
fn frame<'py>(py: Python<'py>, file: &Path) -> PyResult<(Bound<'py, PyList>, Option<String>)> {
    let frame = py.detach(|| Frame::read(file));
    let frame = frame.map_err(|error| failed(py, &Failure::Fault(format!("`{}`: {error}", file.display())), &[]))?;
    let units = frame.metadata.into_iter().find(|(key, _)| key == "units").map(|(_, text)| text);
    let list = PyList::empty(py);
    for (name, cells) in frame.columns {
        let cells = match cells {
            Cells::Numbers(values) => Py::new(py, Array::vector(values))?.into_any(),
            Cells::Wholes(values) => values.into_pyobject(py)?.into_any().unbind(),
            Cells::Texts(values) => values.into_pyobject(py)?.into_any().unbind(),
        };
        list.append(PyTuple::new(py, [name.into_pyobject(py)?.into_any().unbind(), cells])?)?;
    }
    Ok((list, units))
}
