//! From the resources of the unit to a model that is ready to run.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_fmi::{INPUTS, PAYLOAD, TEXTS};
use hyd_payload::format::FormatError;
use hyd_payload::{Backend, Loaded, format};

/// Reads and maps the model; `token`: what the unit is known by.  The number is another one, all but surely, for another payload.
///
/// # Errors
/// A sentence.
pub(crate) fn load(resources: &Path, token: &str) -> Result<(Arc<Loaded>, u64), String> {
    let path = resources.join(PAYLOAD);
    let bytes = std::fs::read(&path).map_err(|error| format!("`{}` cannot be read: {error}", path.display()))?;
    let wanted = hyd_fmi::token(&bytes);
    if wanted != token {
        return Err(format!(
            "the unit is known by `{wanted}`, not by `{token}`: description and resources do not belong together"
        ));
    }
    let said = |error: FormatError| format!("`{}`: {error}", path.display());
    let (model, backend) = match format::read(&bytes, true) {
        Ok(model) => (model, Backend::Native),
        // An older processor interprets it.
        Err(FormatError::Processor(_)) => (format::read(&bytes, false).map_err(said)?, Backend::Vm),
        Err(error) => return Err(said(error)),
    };
    let loaded = Loaded::new(model, backend).map_err(|reason| format!("`{}`: {reason}", path.display()))?;
    Ok((Arc::new(loaded), format::fingerprint(&bytes).unwrap_or_default()))
}

/// Start values of `count` inputs.
///
/// # Errors
/// A sentence.
pub(crate) fn inputs(resources: &Path, count: usize) -> Result<Vec<f64>, String> {
    let path = resources.join(INPUTS);
    let bytes = std::fs::read(&path).map_err(|error| format!("`{}` cannot be read: {error}", path.display()))?;
    let (numbers, rest) = bytes.as_chunks::<8>();
    match numbers.len() == count && rest.is_empty() {
        true => Ok(numbers.iter().map(|&number| f64::from_le_bytes(number)).collect()),
        false => Err(format!("`{}` does not belong to the model", path.display())),
    }
}

/// The Strings.
///
/// # Errors
/// A sentence.
pub(crate) fn texts(resources: &Path) -> Result<Vec<CString>, String> {
    let path = resources.join(TEXTS);
    let bytes = std::fs::read(&path).map_err(|error| format!("`{}` cannot be read: {error}", path.display()))?;
    let read = bytes.split_inclusive(|&byte| byte == 0).map(|text| CString::from_vec_with_nul(text.to_vec()));
    read.collect::<Result<_, _>>().map_err(|_| format!("`{}` is cut short", path.display()))
}

/// The folder behind a URI of version 2.0, `file:///tmp/my%20unit/resources`; a bare path is taken as it is.
///
/// # Errors
/// A sentence.
pub(crate) fn folder(location: &str) -> Result<PathBuf, String> {
    let Some(rest) = location.strip_prefix("file:") else {
        return match location.contains("://") {
            true => Err(format!("`{location}`: only files can be read")),
            false => Ok(PathBuf::from(location)),
        };
    };
    // `file:///path`, `file:/path` and `file://localhost/path` are in use.
    let path = match rest.strip_prefix("//") {
        Some(after) => after.strip_prefix("localhost").unwrap_or(after),
        None => rest,
    };
    let bytes = decode(path).ok_or_else(|| format!("`{location}`: it is not a valid URI"))?;
    let path = String::from_utf8(bytes).map_err(|_| format!("`{location}`: it is not a text in UTF-8"))?;
    let drive = path.strip_prefix('/').filter(|rest| rest.as_bytes().get(1) == Some(&b':'));
    Ok(PathBuf::from(drive.unwrap_or(&path)))
}

/// Bytes with `%20` and the like decoded.
fn decode(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte != b'%' {
            out.push(byte);
            continue;
        }
        let digits = std::str::from_utf8(rest.get(..2)?).ok()?;
        out.push(u8::from_str_radix(digits, 16).ok()?);
        rest = &rest[2..];
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::folder;
    use std::path::PathBuf;

    #[test]
    fn locations_become_folders() {
        for (location, path) in [
            ("file:///tmp/my%20unit/resources", "/tmp/my unit/resources"),
            ("file:/tmp/x", "/tmp/x"),
            ("file://localhost/tmp/x", "/tmp/x"),
            ("file:///C:/x", "C:/x"),
            ("/tmp/x", "/tmp/x"),
        ] {
            assert_eq!(folder(location), Ok(PathBuf::from(path)), "{location}");
        }
        assert!(folder("http://x/y").is_err());
        assert!(folder("file:///a%2").is_err());
        assert!(folder("file:///a%zz").is_err());
    }
}
