//! `hyd build FILE -o EXE`: the model as an executable that needs neither `hyd` nor a compiler.
//!
//! The executable is a prebuilt launcher with the compiled model behind it.  The launcher stands beside `hyd`, where
//! `cargo build --release` puts both; `HYD_LAUNCHER` names another one.  With `--fmu` it is a unit for other tools (`build_fmu`), whose
//! prebuilt library is found in the same way; `HYD_UNIT` names another one.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use hyd_compiler::{Compilation, CompiledModel, Extras, FlatModel, Goal, Loops};
use hyd_payload::{Model, executable, format};
use hyd_results::write_whole;
use hyd_source::did_you_mean;
use hyd_system::DaeSystem;

use crate::arguments::Build;
use crate::translate::translate_with;
use crate::{Failure, build_fmu, output};
use hyd_run::{BUILT_WHOLE, check_target, interrupt, parameters};
use hyd_verbs::whole_loops_for_the_start;

/// A program or library that was made with this one: its file name, the variable of the environment that names another file, what it
/// is called, and how it is distinguished from other files.
pub(crate) struct Prebuilt {
    pub(crate) file: &'static str,
    pub(crate) variable: &'static str,
    pub(crate) name: &'static str,
    pub(crate) is_it: fn(&[u8]) -> bool,
}

pub(crate) const LAUNCHER: Prebuilt = Prebuilt {
    file: if cfg!(windows) { "hyd-launcher.exe" } else { "hyd-launcher" },
    variable: "HYD_LAUNCHER",
    name: "launcher",
    is_it: executable::is_launcher,
};

/// Folder of programs that were made with this one, where it is not that of the running program.
static PREBUILT: OnceLock<PathBuf> = OnceLock::new();

/// Names the folder of programs that were made with this one; the first call counts.
pub fn prebuilt_in(folder: PathBuf) {
    let _ = PREBUILT.set(folder);
}

/// The bytes of the program that executables are copies of; `output`: what is to be written, which must not be it.
///
/// # Errors
/// It is missing, or one of another version.
pub fn launcher(output: &Path) -> Result<Vec<u8>, Failure> {
    LAUNCHER.read(output)
}

/// Runs the verb.
pub(crate) fn build(arguments: &Build) -> Result<(), Failure> {
    check_target("-o", &arguments.output, &[&arguments.model.file])?;
    if let Some(version) = arguments.fmu {
        return build_fmu::build(arguments, version);
    }
    let launcher = LAUNCHER.read(&arguments.output)?;
    let driven = arguments.input.clone().unwrap_or_default().0;
    let (compilation, payload) = translated(arguments, &driven)?;
    let sites = &payload.structure.inputs;
    if let Some(name) = driven.iter().find(|name| sites.iter().all(|site| *site.name != ***name)) {
        let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
        let hint = did_you_mean(name, known.iter().map(String::as_str));
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        return Err(Failure::Usage(format!("--input: the model has no input `{name}` of type Real at its top{hint}")));
    }
    let bytes = executable::join(&launcher, &format::write(&payload));
    let path = &arguments.output;
    write_whole(path, &bytes).map_err(|error| not_written(path, &error))?;
    allow_execution(path).map_err(|error| not_written(path, &error))?;
    let code = model_of(&compilation)?.statistics();
    let name = &payload.tables.model;
    output::print(&match arguments.json {
        true => format!(
            "{}\n",
            serde_json::json!({"status": "done", "model": **name, "executable": path.display().to_string(), "bytes": bytes.len(),
                "code_bytes": code.code_bytes, "templates": code.templates, "sources": format!("{:016x}", payload.identity.sources)})
        ),
        false => format!(
            "{name}: executable in {}, {} kB, {} bytes of code\n",
            path.display(),
            bytes.len() >> 10,
            code.code_bytes
        ),
    })
}

/// The file that could not be written.
pub(crate) fn not_written(path: &Path, error: &std::io::Error) -> Failure {
    Failure::Fault(format!("`{}` cannot be written: {error}", path.display()))
}

/// Code of a translation.
pub(crate) fn model_of(compilation: &Compilation) -> Result<&CompiledModel, Failure> {
    compilation.model.as_deref().ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))
}

/// The translation of the model, and what is carried of it, with the values that were set; `driven`: inputs that stay open.
pub(crate) fn translated(arguments: &Build, driven: &[String]) -> Result<(Compilation, Model), Failure> {
    let loops = if arguments.whole_loops { Loops::Whole } else { Loops::Torn };
    let extras = Extras { loops, driven, ..Extras::default() };
    let mut compilation = translate_with(&arguments.model, Goal::Run, &extras, &[])?;
    let whole = whole_loops_for_the_start(&compilation, &arguments.model.set, &interrupt::requested);
    if whole.is_some() {
        output::sentence("note", BUILT_WHOLE, arguments.model.message_format);
        compilation.model = whole;
    }
    let model = model_of(&compilation)?;
    let mut payload = match arguments.fmu {
        // A unit has no use for derivatives along parameters.
        Some(_) => model.payload().clone(),
        None => model.stored().map_err(|reason| {
            let name = &model.tables().model;
            Failure::Fault(format!("no code could be generated for the derivatives of `{name}`: {reason}"))
        })?,
    };
    let changes = parameters::changes(model.tables(), &arguments.model.set, &compilation.set_at_translation);
    payload.parameters.preset = changes.map_err(Failure::Fault)?;
    // What it begins with must be what a run could be given.
    let mut system = model.instantiate();
    for &(index, value) in &payload.parameters.preset {
        let refused = |_| Failure::Fault(format!("a parameter cannot be set to {value}"));
        system.set_parameter(index as usize, value).map_err(refused)?;
    }
    Ok((compilation, payload))
}

impl Prebuilt {
    /// Its bytes; `output` must not be it, nor this program.
    pub(crate) fn read(&self, output: &Path) -> Result<Vec<u8>, Failure> {
        let name = self.name;
        let path = self.place()?;
        let own = std::env::current_exe().unwrap_or_default();
        check_target("-o", output, &[&path, &own])?;
        let bytes = std::fs::read(&path)
            .map_err(|error| Failure::Fault(format!("the {name} `{}` cannot be read: {error}", path.display())))?;
        match (self.is_it)(&bytes) {
            true => Ok(bytes),
            false => Err(Failure::Fault(format!(
                "`{}` is not a {name} for this version of hyd; `cargo build --release` builds both again",
                path.display()
            ))),
        }
    }

    /// Where it is: as its variable says, else as for this program.
    pub(crate) fn place(&self) -> Result<PathBuf, Failure> {
        match std::env::var_os(self.variable).filter(|path| !path.is_empty()) {
            Some(path) => Ok(PathBuf::from(path)),
            None => self.beside_us(),
        }
    }

    /// It in the folder that was named for it, in that of this program, or in the one above (where programs of tests stand a level deeper).
    fn beside_us(&self) -> Result<PathBuf, Failure> {
        let (file, variable) = (self.file, self.variable);
        let own = std::env::current_exe();
        let own = own.map_err(|error| Failure::Fault(format!("the place of this program is not known: {error}")))?;
        let folders = PREBUILT.get().map(PathBuf::as_path).into_iter().chain(own.ancestors().skip(1).take(2));
        let found = folders.map(|folder| folder.join(file)).find(|path| path.is_file());
        found.ok_or_else(|| {
            let folder = own.parent().unwrap_or(Path::new("")).display().to_string();
            Failure::Fault(format!(
                "there is no `{file}` in `{folder}`; `cargo build --release` makes it, and {variable} may name another place"
            ))
        })
    }
}

#[cfg(unix)]
fn allow_execution(path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path)?.permissions().mode();
    // Who may read may run.
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode | (mode & 0o444) >> 2))
}

#[cfg(not(unix))]
fn allow_execution(_path: &Path) -> std::io::Result<()> {
    Ok(())
}
