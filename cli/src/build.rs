//! `hyd build FILE -o EXE`: the model as an executable that needs neither `hyd` nor a compiler.
//!
//! The executable is a prebuilt launcher with the compiled model behind it.  The launcher stands beside `hyd`, where
//! `cargo build --release` puts both; `HYD_LAUNCHER` names another one.

use std::path::{Path, PathBuf};

use hyd_compiler::{Extras, FlatModel, Goal, Loops};
use hyd_payload::{executable, format};
use hyd_results::write_whole;
use hyd_source::did_you_mean;
use hyd_system::DaeSystem;

use crate::arguments::Build;
use crate::translate::translate_with;
use crate::{Failure, output};
use hyd_run::{check_target, parameters};

/// Environment variable that names the launcher.
const LAUNCHER_VARIABLE: &str = "HYD_LAUNCHER";
/// File name of the launcher.
const LAUNCHER: &str = if cfg!(windows) { "hyd-launcher.exe" } else { "hyd-launcher" };

/// Runs the verb.
pub(crate) fn build(arguments: &Build) -> Result<(), Failure> {
    check_target("-o", &arguments.output, &[&arguments.model.file])?;
    let launcher = launcher(&arguments.output)?;
    let loops = if arguments.whole_loops { Loops::Whole } else { Loops::Torn };
    let driven = arguments.input.clone().unwrap_or_default().0;
    let extras = Extras { loops, driven: &driven, ..Extras::default() };
    let compilation = translate_with(&arguments.model, Goal::Run, &extras)?;
    let model = compilation.model.as_ref();
    let model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let mut payload = model.stored().map_err(|reason| {
        Failure::Fault(format!(
            "no code could be generated for the derivatives of `{}`: {reason}",
            model.tables().model
        ))
    })?;
    let sites = &payload.structure.inputs;
    if let Some(name) = driven.iter().find(|name| sites.iter().all(|site| *site.name != ***name)) {
        let known = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
        let hint = did_you_mean(name, known.iter().map(String::as_str));
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        return Err(Failure::Usage(format!("--input: the model has no input `{name}` of type Real at its top{hint}")));
    }
    let changes = parameters::changes(model.tables(), &arguments.model.set, &compilation.set_at_translation);
    payload.parameters.preset = changes.map_err(Failure::Fault)?;
    // What the executable begins with must be what a run could be given.
    let mut system = model.instantiate();
    for &(index, value) in &payload.parameters.preset {
        let refused = |_| Failure::Fault(format!("a parameter cannot be set to {value}"));
        system.set_parameter(index as usize, value).map_err(refused)?;
    }
    let bytes = executable::join(&launcher, &format::write(&payload));
    let path = &arguments.output;
    let failed = |error: std::io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
    write_whole(path, &bytes).map_err(failed)?;
    allow_execution(path).map_err(failed)?;
    let code = model.statistics();
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

/// The bytes of the launcher, which `output` must not be, nor this program.
fn launcher(output: &Path) -> Result<Vec<u8>, Failure> {
    let path = match std::env::var_os(LAUNCHER_VARIABLE).filter(|path| !path.is_empty()) {
        Some(path) => PathBuf::from(path),
        None => beside_us()?,
    };
    let own = std::env::current_exe().unwrap_or_default();
    check_target("-o", output, &[&path, &own])?;
    let bytes = std::fs::read(&path);
    let bytes =
        bytes.map_err(|error| Failure::Fault(format!("the launcher `{}` cannot be read: {error}", path.display())))?;
    match executable::is_launcher(&bytes) {
        true => Ok(bytes),
        false => Err(Failure::Fault(format!(
            "`{}` is not a launcher for this version of hyd; `cargo build --release` makes both anew",
            path.display()
        ))),
    }
}

/// The launcher in the folder of this program, or in the one above (where programs of tests stand a level deeper).
fn beside_us() -> Result<PathBuf, Failure> {
    let own = std::env::current_exe();
    let own = own.map_err(|error| Failure::Fault(format!("the place of this program is not known: {error}")))?;
    let found = own.ancestors().skip(1).take(2).map(|folder| folder.join(LAUNCHER)).find(|path| path.is_file());
    found.ok_or_else(|| {
        let folder = own.parent().unwrap_or(Path::new("")).display().to_string();
        Failure::Fault(format!(
            "there is no `{LAUNCHER}` in `{folder}`; `cargo build --release` makes it, and {LAUNCHER_VARIABLE} may name another place"
        ))
    })
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
