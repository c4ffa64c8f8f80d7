//! The archive: description, library, payload.  Entries have no time of their own, so the same model gives the same bytes.

use std::io::{self, Cursor, Write};

use hyd_payload::target::Target;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::facts::{Text, Version};

/// The file below `resources` that holds the payload.
pub const PAYLOAD: &str = "model.hyd";
/// The file below `resources` that holds what inputs are before anybody has said so: a number of eight bytes, low ones first, for each.
pub const INPUTS: &str = "inputs.hyd";
/// The file below `resources` that holds the Strings: UTF-8, each with a zero behind it.
pub const TEXTS: &str = "texts.hyd";
/// The list of connectors.
const TERMINALS: &str = "terminalsAndIcons/terminalsAndIcons.xml";
/// Enough for code; more takes longer than the rest of the translation.
const LEVEL: i64 = 5;

/// What stands in the archive.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The description.
    pub description: &'a [u8],
    /// The list of connectors, if there are any.
    pub terminals: Option<&'a [u8]>,
    /// The library for this machine.
    pub library: &'a [u8],
    /// The payload.
    pub payload: &'a [u8],
    /// Start values of the inputs, in the order of their sites.
    pub inputs: &'a [f64],
    /// Strings, in the order of their numbers.
    pub texts: &'a [Text],
}

/// The name that files and functions of the unit go by: a name of C made of that of the model.
pub fn identifier(model: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut name: String = model.chars().map(letter).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        name.insert(0, '_');
    }
    name
}

/// What a unit with this payload is known by.
pub fn token(payload: &[u8]) -> String {
    format!("{{hyd-{:016x}}}", hyd_payload::format::fingerprint(payload).unwrap_or_default())
}

/// Folder and ending of the library for this machine; none where no code can be made for it.
fn place(version: Version) -> Option<(&'static str, &'static str)> {
    let target = Target::host()?;
    let ending = match target {
        Target::X86Windows => "dll",
        _ if cfg!(target_vendor = "apple") => "dylib",
        _ => "so",
    };
    let apple = cfg!(target_vendor = "apple");
    let folder = match (version, target) {
        (Version::Two, Target::X86Windows) => "win64",
        (Version::Two, _) if apple => "darwin64",
        (Version::Two, Target::X86SystemV) => "linux64",
        (Version::Two, _) => "aarch64-linux",
        (Version::Three, Target::X86Windows) => "x86_64-windows",
        (Version::Three, Target::X86SystemV) if apple => "x86_64-darwin",
        (Version::Three, Target::X86SystemV) => "x86_64-linux",
        (Version::Three, _) if apple => "aarch64-darwin",
        (Version::Three, _) => "aarch64-linux",
    };
    Some((folder, ending))
}

/// The bytes of the archive of a model with this name.
///
/// # Errors
/// This machine has no name in the interface, or the archive would be larger than archives can be.
pub fn pack(version: Version, model: &str, parts: Parts<'_>) -> io::Result<Vec<u8>> {
    let none = || io::Error::other("there is no name for this machine among those of the interface");
    let (folder, ending) = place(version).ok_or_else(none)?;
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options =
        SimpleFileOptions::default().compression_method(CompressionMethod::Deflated).compression_level(Some(LEVEL));
    let library = format!("binaries/{folder}/{}.{ending}", identifier(model));
    let inputs: Vec<u8> = parts.inputs.iter().flat_map(|value| value.to_le_bytes()).collect();
    let texts: Vec<u8> = parts.texts.iter().flat_map(|text| text.value.bytes().chain([0])).collect();
    let names = [PAYLOAD, INPUTS, TEXTS].map(|file| format!("resources/{file}"));
    let terminals = parts.terminals.map(|bytes| (TERMINALS, bytes, 0o644));
    let files: [(&str, &[u8], u32); 5] = [
        ("modelDescription.xml", parts.description, 0o644),
        (library.as_str(), parts.library, 0o755),
        (&names[0], parts.payload, 0o644),
        (&names[1], &inputs, 0o644),
        (&names[2], &texts, 0o644),
    ];
    for (name, bytes, mode) in files.into_iter().chain(terminals) {
        archive.start_file(name, options.unix_permissions(mode))?;
        archive.write_all(bytes)?;
    }
    Ok(archive.finish()?.into_inner())
}
