//! `--set NAME=VALUE`: found by full name, refused with a reason, applied to a translated system.
//!
//! What decides sizes or structure was used by the compiler; everything else is run-time data of the system.

use hyd_compiler::{Code, Diagnostic};
use hyd_flat::{FlatModel, VariableBlock};
use hyd_source::did_you_mean;
use hyd_system::{DaeSystem, NamePattern, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

/// Elements of a variable that a name means: one of them, or all where the name is that of a whole array.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Elements {
    One(usize),
    All,
}

/// Messages for assignments that are not used: no such parameter, not settable, not a value of its type.
pub(crate) fn refuse_unknown(flat: &FlatModel, set: &[(String, String)], used: &[String]) -> Vec<Diagnostic> {
    let mut wrong = Vec::new();
    for (name, value) in set.iter().filter(|(name, _)| !used.contains(name)) {
        let found = flat.variables.raw.iter().find_map(|block| Some((block, elements(&block.name, name)?)));
        match found {
            None => wrong.push(unknown(flat, name)),
            Some((block, elements)) => wrong.extend(refuse(block, elements, name, value)),
        }
    }
    wrong
}

fn unknown(flat: &FlatModel, name: &str) -> Diagnostic {
    let settable = flat.variables.raw.iter().filter(|block| block.settable == Settable::Yes && block.count > 0);
    let names: Vec<String> = settable.map(|block| block.name.element(0)).collect();
    let whole = name.split('[').next().unwrap_or(name);
    let array = flat.variables.raw.iter().find(|block| elements(&block.name, whole) == Some(Elements::All));
    if let Some(block) = array.filter(|_| name.ends_with(']')) {
        let sizes: Vec<&u32> = block.name.parts.iter().flat_map(|(_, sizes)| sizes).collect();
        let message = format!("`{name}` is outside of `{whole}`, which has the sizes {sizes:?}");
        return Diagnostic::error(Code::NoSuchParameter, message).with(block.origin.span, "declared here");
    }
    let hint = did_you_mean(name, names.iter().map(String::as_str)).or_else(|| {
        // Perhaps only the component before the name is missing.
        let inside = names.iter().find(|full| full.rsplit('.').next() == Some(name));
        inside.map(|full| format!("did you mean `{full}`?"))
    });
    Diagnostic::error(Code::NoSuchParameter, format!("the model has no parameter `{name}`")).maybe_help(hint)
}

fn refuse(block: &VariableBlock, elements: Elements, name: &str, value: &str) -> Option<Diagnostic> {
    let reason = match block.settable {
        Settable::Yes => {
            let count = if elements == Elements::All { block.count as usize } else { 1 };
            return values(&block.kind, value, count).err().map(|reason| {
                Diagnostic::error(Code::NoSuchParameter, format!("`{name}` cannot be set to `{value}`: {reason}"))
                    .with(block.origin.span, "declared here")
            });
        }
        Settable::Structural => {
            "it decides sizes or structure, so it must be set before translation, and this value was not taken"
        }
        Settable::No if block.variability == Variability::Constant => "it is a constant",
        Settable::No if block.variability == Variability::Parameter => {
            "it is final, or its value follows from other parameters by declaration"
        }
        Settable::No => "it is a variable, not a parameter",
    };
    let message = format!("`{name}` cannot be set: {reason}");
    Some(Diagnostic::error(Code::NoSuchParameter, message).with(block.origin.span, "declared here"))
}

/// Sets the run-time parameters of a system.  All have passed [`refuse_unknown`].
pub(crate) fn apply(system: &mut dyn DaeSystem, set: &[(String, String)], used: &[String]) -> Result<(), String> {
    let tables = system.tables().clone();
    for (name, text) in set.iter().filter(|(name, _)| !used.contains(name)) {
        let found = tables.variables.iter().find_map(|info| Some((info, elements(&info.name, name)?)));
        let (info, elements) = found.ok_or_else(|| format!("the translated model has no parameter `{name}`"))?;
        for (index, value) in places(info, elements, text).map_err(|why| format!("`{name}={text}`: {why}"))? {
            system.set_parameter(index, value).map_err(|_| format!("`{name}` cannot be set to `{text}`"))?;
        }
    }
    Ok(())
}

/// Where a varied parameter stands in `DaeSystem::parameters`, with its sign; an array stands in several places.
pub(crate) fn varied(tables: &Tables, name: &str) -> Result<Vec<(usize, f64)>, String> {
    let found = tables.variables.iter().find_map(|info| Some((info, elements(&info.name, name)?)));
    let Some((info, elements)) = found else {
        let settable = tables.variables.iter().filter(|info| info.settable == Settable::Yes && info.name.count() > 0);
        let names: Vec<String> = settable.map(|info| info.name.element(0)).collect();
        let hint =
            did_you_mean(name, names.iter().map(String::as_str)).map_or_else(String::new, |hint| format!("; {hint}"));
        return Err(format!("the model has no parameter `{name}`{hint}"));
    };
    match info.settable {
        Settable::Yes => {}
        Settable::Structural => {
            return Err(format!(
                "`{name}` cannot be varied: it decides sizes or structure, so every value is a model of its own"
            ));
        }
        Settable::No if info.variability > Variability::Parameter => {
            return Err(format!("`{name}` cannot be varied: it is a variable, not a parameter"));
        }
        Settable::No => return Err(format!("`{name}` cannot be varied: it is constant, final or follows from others")),
    }
    let range = match elements {
        Elements::One(k) => k..k + 1,
        Elements::All => 0..info.sources.len(),
    };
    let place = |source: &Source| match source.place {
        Place::Parameter(k) => Ok((k as usize, if source.negated { -1.0 } else { 1.0 })),
        _ => Err(format!("`{name}` cannot be varied: its value is not kept as run-time data")),
    };
    info.sources.get(range).unwrap_or_default().iter().map(place).collect()
}

/// Positions in `DaeSystem::parameters` with their new values.
fn places(info: &VariableInfo, elements: Elements, text: &str) -> Result<Vec<(usize, f64)>, String> {
    let range = match elements {
        Elements::One(k) => k..k + 1,
        Elements::All => 0..info.sources.len(),
    };
    let values = values(&info.kind, text, range.len())?;
    let mut places = Vec::new();
    let sources = info.sources.get(range).unwrap_or_default();
    for (source, value) in sources.iter().zip(values) {
        match source.place {
            Place::Parameter(k) => places.push((k as usize, if source.negated { -value } else { value })),
            _ => return Err("its value is not kept as run-time data".to_string()),
        }
    }
    Ok(places)
}

/// Which elements of a pattern a name means.
fn elements(pattern: &NamePattern, name: &str) -> Option<Elements> {
    let bare: String = pattern.parts.iter().map(|(text, _)| &**text).collect();
    if pattern.derivative || !name.starts_with(&*pattern.parts.first()?.0) {
        None
    } else if pattern.parts.iter().all(|(_, dims)| dims.is_empty()) {
        (bare == name).then_some(Elements::One(0))
    } else if bare == name {
        Some(Elements::All)
    } else {
        let spaceless: String = name.chars().filter(|c| !c.is_whitespace()).collect();
        (0..pattern.count()).find(|&k| pattern.element(k) == spaceless).map(Elements::One)
    }
}

/// `count` numbers from a text: one value for all, or a list in braces, nested as the array is.
fn values(kind: &ValueKind, text: &str, count: usize) -> Result<Vec<f64>, String> {
    if !text.starts_with('{') {
        return value(kind, text).map(|value| vec![value; count]);
    }
    let inner: String = text.chars().filter(|c| !matches!(c, '{' | '}')).collect();
    let list = inner.split(',').map(|item| value(kind, item.trim())).collect::<Result<Vec<f64>, String>>()?;
    if list.len() == count { Ok(list) } else { Err(format!("it has {count} elements, not {}", list.len())) }
}

fn value(kind: &ValueKind, text: &str) -> Result<f64, String> {
    match kind {
        ValueKind::Real => {
            let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| "it is a Real and needs a finite number".to_string())
        }
        ValueKind::Integer => {
            let number = text.parse::<i32>().map_err(|_| "it is an Integer and needs a whole number".to_string());
            number.map(f64::from)
        }
        ValueKind::Boolean => match text {
            "true" => Ok(1.0),
            "false" => Ok(0.0),
            _ => Err("it is a Boolean: `true` or `false`".to_string()),
        },
        ValueKind::Enumeration(literals) => {
            let last = text.rsplit('.').next().unwrap_or(text);
            let position = literals.iter().position(|literal| **literal == *last);
            position.map(|k| (k + 1) as f64).ok_or_else(|| format!("it is one of {}", literals.join(", ")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn array() -> NamePattern {
        NamePattern { parts: vec![("a".into(), vec![4]), (".b".into(), vec![2, 3])], derivative: false }
    }

    #[test]
    fn names_mean_elements_or_whole_arrays() {
        assert_eq!(elements(&array(), "a[2].b[1, 3]"), Some(Elements::One(8)));
        assert_eq!(elements(&array(), "a.b"), Some(Elements::All));
        assert_eq!(elements(&array(), "a[5].b[1,1]"), None);
        assert_eq!(elements(&NamePattern::scalar("m"), "m"), Some(Elements::One(0)));
        assert_eq!(elements(&NamePattern::scalar("m"), "mm"), None);
    }

    #[test]
    fn values_fit_their_type() {
        let modes = ValueKind::Enumeration(["off".into(), "on".into()].into());
        assert_eq!(values(&ValueKind::Real, "1.5e-3", 1), Ok(vec![1.5e-3]));
        assert_eq!(values(&ValueKind::Real, "{{1, 2}, {3, 4}}", 4), Ok(vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(values(&ValueKind::Real, "7", 3), Ok(vec![7.0; 3]));
        assert_eq!(values(&ValueKind::Boolean, "true", 1), Ok(vec![1.0]));
        assert_eq!(values(&modes, "Pkg.Mode.on", 1), Ok(vec![2.0]));
        let refused: [(&ValueKind, &str, usize, &str); 6] = [
            (&ValueKind::Real, "abc", 1, "it is a Real and needs a finite number"),
            (&ValueKind::Real, "inf", 1, "it is a Real and needs a finite number"),
            (&ValueKind::Integer, "1.5", 1, "it is an Integer and needs a whole number"),
            (&ValueKind::Boolean, "1", 1, "it is a Boolean: `true` or `false`"),
            (&modes, "auto", 1, "it is one of off, on"),
            (&ValueKind::Real, "{1, 2}", 3, "it has 3 elements, not 2"),
        ];
        for (kind, text, count, reason) in refused {
            assert_eq!(values(kind, text, count), Err(reason.to_string()));
        }
    }
}
