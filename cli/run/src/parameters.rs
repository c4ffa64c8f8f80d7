//! Parameters by name: `NAME=VALUE` found in the tables of a system, refused with a reason, applied.

pub use hyd_payload::outside_limits as outside;
use hyd_source::did_you_mean;
use hyd_system::by_part::by_part;
use hyd_system::given::{self, Elements};
use hyd_system::{DaeSystem, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

/// Sets the run-time parameters of a system, but for those in `used`, which the compiler took.
///
/// # Errors
/// A sentence: no such parameter, not settable, not a value of its type.
pub fn apply(system: &mut dyn DaeSystem, set: &[(String, String)], used: &[String]) -> Result<(), String> {
    let tables = system.tables().clone();
    for (name, text) in &open(&tables, set, used)? {
        for (index, value) in change(&tables, name, text)? {
            system.set_parameter(index, value).map_err(|_| format!("`{name}` cannot be set to `{text}`"))?;
        }
    }
    Ok(())
}

/// What [`apply`] sets: positions in `DaeSystem::parameters` with their values.
///
/// # Errors
/// As [`apply`].
pub fn changes(tables: &Tables, set: &[(String, String)], used: &[String]) -> Result<Vec<(u32, f64)>, String> {
    let mut list = Vec::new();
    for (name, text) in &open(tables, set, used)? {
        list.extend(change(tables, name, text)?.into_iter().map(|(index, value)| (index as u32, value)));
    }
    Ok(list)
}

/// The assignments that are left to the run.
fn open(tables: &Tables, set: &[(String, String)], used: &[String]) -> Result<Vec<(String, String)>, String> {
    let open: Vec<(String, String)> = set.iter().filter(|(name, _)| !used.contains(name)).cloned().collect();
    by_part(&open, tables.variables.iter().map(|info| &info.name))
}

fn change(tables: &Tables, name: &str, text: &str) -> Result<Vec<(usize, f64)>, String> {
    let (info, elements) = find(tables, name)?;
    refuse(info, name, "set")?;
    places(info, elements, text).map_err(|why| format!("`{name}={text}`: {why}"))
}

/// The variable of this name.
fn find<'a>(tables: &'a Tables, name: &str) -> Result<(&'a VariableInfo, Elements), String> {
    let found = tables.variables.iter().find_map(|info| Some((info, Elements::of(&info.name, name)?)));
    found.ok_or_else(|| {
        let settable = tables.variables.iter().filter(|info| info.settable == Settable::Yes && info.name.count() > 0);
        let names: Vec<String> = settable.map(|info| info.name.element(0)).collect();
        let hint = did_you_mean(name, names.iter().map(String::as_str)).or_else(|| {
            // Perhaps only the component before the name is missing.
            let inside = names.iter().find(|full| full.rsplit('.').next() == Some(name));
            inside.map(|full| format!("did you mean `{full}`?"))
        });
        let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
        format!("the model has no parameter `{name}`{hint}")
    })
}

/// Why a variable cannot be `set` or `varied`.
fn refuse(info: &VariableInfo, name: &str, what: &str) -> Result<(), String> {
    let reason = match info.settable {
        Settable::Yes => return Ok(()),
        Settable::Structural => "it decides sizes or structure, so every value is a model of its own",
        Settable::No if info.variability == Variability::Constant => "it is a constant",
        Settable::No if info.variability == Variability::Parameter => {
            "it is final, or its value follows from other parameters by declaration"
        }
        Settable::No => "it is a variable, not a parameter",
    };
    Err(format!("`{name}` cannot be {what}: {reason}"))
}

/// The type of a varied parameter, and where it stands in `DaeSystem::parameters`, with its sign; an array stands in
/// several places.
///
/// # Errors
/// A sentence.
pub fn varied(tables: &Tables, name: &str) -> Result<(ValueKind, Vec<(usize, f64)>), String> {
    let (info, elements) = find(tables, name)?;
    refuse(info, name, "varied")?;
    let range = elements.range(&info.name);
    let place = |source: &Source| match source.place {
        Place::Parameter(k) => Ok((k as usize, if source.negated { -1.0 } else { 1.0 })),
        _ => Err(format!("`{name}` cannot be varied: its value is not kept as run-time data")),
    };
    let places = info.sources.get(range).unwrap_or_default().iter().map(place).collect::<Result<_, String>>()?;
    Ok((info.kind.clone(), places))
}

/// Positions in `DaeSystem::parameters` with their new values.
fn places(info: &VariableInfo, elements: Elements, text: &str) -> Result<Vec<(usize, f64)>, String> {
    let range = elements.range(&info.name);
    let values = given::numbers(&info.kind, text, &elements.sizes(&info.name))?;
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
