//! Work of a search that other machines do: what is submitted, and what a task is called with.
//!
//! Tasks call the verb `discover` again.  They read study, set, model and libraries where they are; other machines have to see them at the
//! same places, and the folder of the report as well.

use std::fs;
use std::path::{Path, PathBuf};

use hyd_cluster::{Engine, Patience, Work};
use hyd_results::write_whole;

use crate::Failure;
use crate::discover::{SearchOptions, unwritable};
use crate::share_out::{Sharing, engine};
use crate::study::StudyFiles;

/// In the folder of a work: what tasks say, and the program that they call.
pub(crate) const LOGS: &str = "logs";
pub(crate) const PROGRAM: &str = "hyd";

/// How a search is shared out.
#[derive(Clone, Debug)]
pub struct SharedSearch {
    /// By what, and to how many tasks.
    pub sharing: Sharing,
    /// The program whose verb `discover` a task calls.
    pub program: PathBuf,
    /// What stands in front of the verb.
    pub before: Vec<String>,
    /// Tasks call a copy of the program, beside the report.
    pub copied: bool,
}

/// The engine, and the work that a number of tasks does in a folder, which is made; of the same name for the same folder and the same
/// `identity`.  `last` stands in front of the number of a task.
///
/// # Errors
/// An engine that cannot be reached or takes fewer tasks, files that cannot be written.
pub(crate) fn submission(
    (files, options, shared): (&StudyFiles, &SearchOptions, &SharedSearch),
    (folder, identity): (&Path, &str),
    (tasks, last): (usize, &[String]),
) -> Result<(Box<dyn Engine>, Work), Failure> {
    let engine = engine(&shared.sharing, tasks)?;
    let logs = folder.join(LOGS);
    fs::create_dir_all(&logs).map_err(|error| unwritable(&logs, &error))?;
    let folder = folder.canonicalize().map_err(|error| unwritable(folder, &error))?;
    let program = match shared.copied {
        false => shared.program.clone(),
        true => copied(&shared.program, &folder.join(PROGRAM))?,
    };
    let name = format!("{} {identity}", folder.display());
    let work = Work {
        name: format!("hyd-{}", &hyd_run::hash(name.as_bytes())[..12]),
        program,
        arguments: arguments(files, options, shared)?.into_iter().chain(last.iter().cloned()).collect(),
        processors: shared.sharing.threads,
        logs: folder.join(LOGS),
        goes_on: None,
        folder,
    };
    Ok((engine, work))
}

/// How long is waited for files, how often something is tried.
pub(crate) fn patience(shared: &SharedSearch) -> Patience {
    let settle = shared.sharing.settle.unwrap_or(Patience::USUAL.settle);
    Patience { settle, ..Patience::USUAL }
}

/// A copy of the program that runs.
fn copied(program: &Path, copy: &Path) -> Result<PathBuf, Failure> {
    let bytes = fs::read(program).map_err(|error| unwritable(program, &error))?;
    // One that runs already must not be written over.
    if fs::read(copy).ok().as_ref() != Some(&bytes) {
        write_whole(copy, &bytes).map_err(|error| unwritable(copy, &error))?;
    }
    let rights = fs::metadata(program).and_then(|own| fs::set_permissions(copy, own.permissions()));
    rights.map_err(|error| unwritable(copy, &error))?;
    Ok(copy.to_path_buf())
}

/// The verb and its options.
fn arguments(files: &StudyFiles, options: &SearchOptions, shared: &SharedSearch) -> Result<Vec<String>, Failure> {
    let whole = |path: &Path| {
        let path = path.canonicalize().map_err(|error| Failure::Fault(format!("`{}`: {error}", path.display())))?;
        Ok(path.display().to_string())
    };
    let mut list = shared.before.clone();
    list.extend(["discover".to_string(), whole(&files.study)?, "--bench".to_string(), whole(&files.bench)?]);
    list.extend(["--report".to_string(), whole(&options.report)?]);
    let libraries = files.libraries.fixed();
    for folder in &libraries.folders {
        list.extend(["--library".to_string(), folder.display().to_string()]);
    }
    if libraries.allow_outside {
        list.push("--allow-outside".to_string());
    }
    list.extend(["--threads".to_string(), shared.sharing.threads.to_string()]);
    list.extend(["--seed".to_string(), options.seed.to_string()]);
    Ok(list)
}
