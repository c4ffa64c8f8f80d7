//! The machine that code is made for: host architecture, instruction set extensions and code generator settings.
//!
//! Everything that depends on the target is decided here, so that a fixed baseline for shipped code replaces the
//! detected features in one place.

use std::sync::Arc;

use cranelift_codegen::isa::{CallConv, OwnedTargetIsa, TargetIsa};
use cranelift_codegen::settings::{self, Configurable};

/// A target with the decisions derived from it.
pub struct Target {
    /// The instruction set with its features.
    pub isa: Arc<dyn TargetIsa>,
    /// Calling convention of entry points and of the functions behind the table.
    pub convention: CallConv,
    /// `floor`, `ceil` and `trunc` are single instructions; otherwise they are called through the table.
    pub rounds_inline: bool,
}

/// The machine this process runs on, with all features it has.
///
/// # Errors
/// A sentence, when the architecture is not supported.
pub fn host() -> Result<Target, String> {
    let builder = cranelift_native::builder().map_err(|e| format!("no code generator for this machine: {e}"))?;
    let mut flags = settings::builder();
    let verify = if cfg!(debug_assertions) { "true" } else { "false" };
    let choices = [("opt_level", "speed"), ("is_pic", "true"), ("enable_verifier", verify)];
    for (name, value) in choices {
        flags.set(name, value).map_err(|e| format!("code generator setting `{name}`: {e}"))?;
    }
    let isa: OwnedTargetIsa = builder.finish(settings::Flags::new(flags)).map_err(|e| e.to_string())?;
    // That of `extern "C"` in this process.
    let convention = if cfg!(all(target_arch = "aarch64", target_vendor = "apple")) {
        CallConv::AppleAarch64
    } else if cfg!(all(target_arch = "x86_64", windows)) {
        CallConv::WindowsFastcall
    } else {
        CallConv::SystemV
    };
    Ok(Target { convention, rounds_inline: isa.has_round(), isa })
}
