//! A study of a bench: fits and searches, as `hyd fit` and `hyd discover` do them.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use hyd_run::Failure;
use hyd_verbs::Libraries;
use hyd_verbs::discover::{SearchOptions, discover};
use hyd_verbs::discovery_shared::SharedSearch;
use hyd_verbs::fit::{FitOptions, fit};
use hyd_verbs::next::{NextOptions, next};
use hyd_verbs::share_out::Sharing;
use hyd_verbs::study::{Opened, StudyFiles, open};
use pyo3::prelude::*;
use pyo3::types::PyList;

use crate::messages::{Kept, Message, failed, stopped, warn, warnings};
use crate::signals::watched;

/// `hyd.Study` below its documentation.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Study {
    files: StudyFiles,
}

impl Study {
    fn open(&self, py: Python<'_>) -> PyResult<(Opened, Vec<Message>)> {
        let kept = Kept::default();
        let opened = py.detach(|| open(&self.files, &kept));
        let messages = kept.take();
        match opened {
            Ok(opened) => Ok((opened, messages)),
            Err(failure) => Err(failed(py, &failure, &messages)),
        }
    }
}

/// Work on a study that can be interrupted; gives its messages, too, and what happened on the way goes to `progress`.
fn work<T: Send>(
    py: Python<'_>,
    (opened, first): (&Opened, Vec<Message>),
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Kept) -> Result<T, Failure> + Send,
) -> PyResult<(T, Vec<Message>)> {
    let kept = Kept::default();
    let told = |py: Python<'_>| -> PyResult<()> {
        for (seconds, text) in kept.take_progress() {
            if let Some(progress) = progress {
                progress.call1(py, (seconds, text))?;
            }
        }
        Ok(())
    };
    let stop = opened.setup.watch.stop.clone();
    let (result, caught) = watched(py, &stop, || work(&kept), &told)?;
    let mut messages = first;
    messages.extend(kept.take());
    if let Some(error) = caught {
        return Err(stopped(py, error, Some("interrupted"), &messages, None));
    }
    debug_assert!(!stop.load(Ordering::Relaxed), "invariant: only signals end the work");
    told(py)?;
    let result = result.map_err(|failure| failed(py, &failure, &messages))?;
    Ok((result, messages))
}

#[pymethods]
impl Study {
    #[new]
    fn new(
        py: Python<'_>,
        study: PathBuf,
        bench: PathBuf,
        folders: Vec<PathBuf>,
        allow_outside: bool,
        threads: Option<NonZeroUsize>,
    ) -> PyResult<Self> {
        let libraries = Libraries { folders, allow_outside, ..Libraries::default() }.fixed();
        let own = Self { files: StudyFiles { study, bench, libraries, threads, host: None } };
        let (_, messages) = own.open(py)?;
        warn(py, &messages)?;
        Ok(own)
    }

    /// Fits; gives text, JSON, the parameters as a file of parameters, whether the values are a minimum, and warnings.
    fn fit<'py>(
        &self,
        py: Python<'py>,
        profile: Vec<String>,
        seed: u64,
        files: (Option<PathBuf>, Option<PathBuf>),
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(String, String, String, bool, Bound<'py, PyList>)> {
        let (write_parameters, report) = files;
        let (opened, _) = self.open(py)?;
        let options = FitOptions { seed, profile, write_parameters, report };
        let (found, mut messages) =
            work(py, (&opened, Vec::new()), progress.as_ref(), |kept| fit(&opened, &options, kept))?;
        let converged = found.unconverged.is_none();
        messages.extend(found.unconverged.map(|said| Message::sentence(hyd_compiler::Severity::Warning, &said)));
        let said = warnings(py, &messages)?;
        Ok((found.text, found.json.to_string(), found.parameters, converged, said))
    }

    /// Proposes shots; gives text, JSON and warnings.
    fn next<'py>(
        &self,
        py: Python<'py>,
        wish: (Vec<String>, usize, Option<usize>),
        report: Option<PathBuf>,
        seed: u64,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(String, String, Bound<'py, PyList>)> {
        let (vary, shots, like) = wish;
        let (opened, _) = self.open(py)?;
        let options = NextOptions { vary, shots, like, report, seed };
        let (found, messages) =
            work(py, (&opened, Vec::new()), progress.as_ref(), |kept| next(&self.files, &opened, &options, kept))?;
        Ok((found.text, found.json, warnings(py, &messages)?))
    }

    /// Searches; gives text, JSON, the file of the model that was found, and warnings.
    fn discover<'py>(
        &self,
        py: Python<'py>,
        report: PathBuf,
        search: (bool, Option<NonZeroUsize>, u64),
        sharing: (Option<String>, Option<usize>, Option<f64>, PathBuf),
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(String, String, Option<PathBuf>, Bound<'py, PyList>)> {
        let (resume, calibrate, seed) = search;
        let (on, shards, settle, python) = sharing;
        let (opened, _) = self.open(py)?;
        let threads = self.files.threads.map(NonZeroUsize::get);
        let sharing = Sharing::read(on.as_deref(), shards, (resume, settle), threads);
        let sharing = sharing.map_err(|failure| failed(py, &failure, &[]))?;
        // Tasks run the package by this interpreter, which other machines have to see where it is.
        let shared = sharing.filter(|own| own.place.is_some()).map(|own| SharedSearch {
            sharing: Sharing { python: Some(python.clone().into_os_string()), ..own },
            program: python,
            before: vec!["-m".to_string(), "hyd".to_string()],
            copied: false,
        });
        let options = SearchOptions { report, resume, calibrate, shared, seed };
        let (found, messages) =
            work(py, (&opened, Vec::new()), progress.as_ref(), |kept| discover(&self.files, &opened, &options, kept))?;
        Ok((found.text, found.json, found.model, warnings(py, &messages)?))
    }
}
