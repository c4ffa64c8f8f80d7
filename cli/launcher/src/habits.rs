//! The forms that users of OpenModelica's executables write: `-stopTime=1`, `-override a=1,b=2`, `-r=F.mat`.
//!
//! They become options of ours before the command line is read; `-x=v` and `-x v` are the same.  What has no counterpart is refused
//! with the option to use, never ignored.

use std::ffi::{OsStr, OsString};

use hyd_payload::Backend;

/// Options with a value, and what they become.
const FORMS: [(&str, &str); 6] = [
    ("-startTime", "--start"),
    ("-stopTime", "--stop"),
    ("-tolerance", "--tolerance"),
    ("-numberOfIntervals", "--intervals"),
    ("-r", "--result"),
    ("-variableFilter", "--variables"),
];
/// Options that are not carried over, and what to do.
const REFUSED: [(&str, &str); 4] = [
    ("-stepSize", "use --intervals N"),
    ("-s", "use --solver auto, bdf or esdirk"),
    ("-outputFormat", "the name of --result decides: .csv, .mat or .parquet"),
    ("-overrideFile", "use --parameters FILE.toml"),
];

/// The arguments in our own forms.
///
/// # Errors
/// A sentence, for an option that has no counterpart or lacks its value.
pub fn rewrite(arguments: &[OsString]) -> Result<Vec<OsString>, String> {
    let mut out = Vec::with_capacity(arguments.len());
    let mut rest = arguments.iter();
    out.extend(rest.next().cloned());
    while let Some(argument) = rest.next() {
        let Some((name, value)) = single_dash(argument) else {
            out.push(argument.clone());
            continue;
        };
        if let Some((_, advice)) = REFUSED.iter().find(|(form, _)| *form == name) {
            return Err(format!("`{name}` is not known here: {advice}"));
        }
        let form = FORMS.iter().find(|(form, _)| *form == name);
        if form.is_none() && name != "-override" {
            out.push(argument.clone());
            continue;
        }
        let value = match value {
            Some(value) => value.to_string(),
            None => match rest.next().and_then(|next| next.to_str()) {
                Some(next) => next.to_string(),
                None => return Err(format!("`{name}` needs a value")),
            },
        };
        match form {
            Some((_, ours)) => out.push(format!("{ours}={value}").into()),
            None => overrides(&value, &mut out)?,
        }
    }
    Ok(out)
}

/// Name and value of an argument with one dash.
fn single_dash(argument: &OsStr) -> Option<(&str, Option<&str>)> {
    let text = argument.to_str()?;
    if !text.starts_with('-') || text.starts_with("--") {
        return None;
    }
    Some(match text.split_once('=') {
        Some((name, value)) => (name, Some(value)),
        None => (text, None),
    })
}

/// `a=1,b=2`, where times and tolerance are options of the run.  Commas inside brackets and braces belong to names and lists.
fn overrides(text: &str, out: &mut Vec<OsString>) -> Result<(), String> {
    let mut depth = 0;
    let mut parts = vec![String::new()];
    for c in text.chars() {
        match c {
            '[' | '{' => depth += 1,
            ']' | '}' => depth -= 1,
            _ => {}
        }
        match parts.last_mut() {
            Some(last) if c != ',' || depth > 0 => last.push(c),
            _ => parts.push(String::new()),
        }
    }
    for part in parts {
        let (name, value) = part.split_once('=').ok_or_else(|| format!("-override: `{part}` is not NAME=VALUE"))?;
        let (name, value) = (name.trim(), value.trim());
        match name {
            "startTime" => out.push(format!("--start={value}").into()),
            "stopTime" => out.push(format!("--stop={value}").into()),
            "tolerance" => out.push(format!("--tolerance={value}").into()),
            "stepSize" => return Err(format!("-override: `{name}` cannot be set")),
            _ => out.push(format!("--set={name}={value}").into()),
        }
    }
    Ok(())
}

/// The backend that the arguments ask for; it is needed before the others can be read.
pub fn backend(arguments: &[OsString]) -> Backend {
    let interpreted = arguments.windows(2).any(|pair| pair[0] == "--backend" && pair[1] == "vm")
        || arguments.iter().any(|argument| argument == "--backend=vm");
    if interpreted { Backend::Vm } else { Backend::Native }
}
