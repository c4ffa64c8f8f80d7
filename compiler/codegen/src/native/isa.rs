//! The machine that code is made for: architecture, instruction set extensions and code generator settings.
//!
//! Extensions are those of the fixed baseline of [`hyd_payload::target`], whatever else this machine has.

use std::sync::Arc;

use cranelift_codegen::isa::{CallConv, OwnedTargetIsa, TargetIsa, lookup_by_name};
use cranelift_codegen::settings::{self, Configurable};
use hyd_payload::target;

/// A target with the decisions derived from it.
pub(super) struct Target {
    /// The instruction set with its features.
    pub isa: Arc<dyn TargetIsa>,
    /// The same with registers allocated in one pass, for functions that are too long for anything else.
    pub hasty: Arc<dyn TargetIsa>,
    /// Calling convention of entry points and of the functions behind the table.
    pub convention: CallConv,
    /// `floor`, `ceil` and `trunc` are single instructions; otherwise they are called through the table.
    pub rounds_inline: bool,
    /// The extensions that code may use.
    pub features: u32,
}

/// The kind of machine this process runs on.
///
/// # Errors
/// A sentence, when the architecture is not supported.
pub(super) fn host() -> Result<Target, String> {
    let target = target::Target::host().ok_or("there is no code generator for this machine")?;
    // The operating system matters for the calling convention alone, which is given with every function.
    let (name, extensions, convention): (_, &[&str], _) = match target {
        target::Target::X86SystemV => ("x86_64-unknown-linux", &X86_SETTINGS, CallConv::SystemV),
        target::Target::X86Windows => ("x86_64-pc-windows", &X86_SETTINGS, CallConv::WindowsFastcall),
        target::Target::Arm => ("aarch64-unknown-linux", &[], CallConv::SystemV),
        target::Target::ArmApple => ("aarch64-apple-darwin", &[], CallConv::AppleAarch64),
    };
    let isa = instruction_set(name, extensions, "backtracking")?;
    let hasty = instruction_set(name, extensions, "single_pass")?;
    Ok(Target { convention, rounds_inline: isa.has_round(), isa, hasty, features: target.features() })
}

fn instruction_set(name: &str, extensions: &[&str], registers: &str) -> Result<OwnedTargetIsa, String> {
    let mut builder = lookup_by_name(name).map_err(|e| format!("no code generator for this machine: {e}"))?;
    for setting in extensions {
        builder.enable(setting).map_err(|e| format!("code generator setting `{setting}`: {e}"))?;
    }
    let mut flags = settings::builder();
    let verify = if cfg!(debug_assertions) { "true" } else { "false" };
    let choices =
        [("opt_level", "speed"), ("is_pic", "true"), ("enable_verifier", verify), ("regalloc_algorithm", registers)];
    for (name, value) in choices {
        flags.set(name, value).map_err(|e| format!("code generator setting `{name}`: {e}"))?;
    }
    builder.finish(settings::Flags::new(flags)).map_err(|e| e.to_string())
}

/// The code generator's names for [`target::X86_BASELINE`].
const X86_SETTINGS: [&str; target::X86_BASELINE.len()] =
    ["has_sse3", "has_ssse3", "has_sse41", "has_sse42", "has_popcnt"];
