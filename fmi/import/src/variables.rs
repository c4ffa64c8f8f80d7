//! `ModelVariables`: names, types, sizes, start values.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::description::{Causality, Changes, Initial, Kind, Number, Variable, Version};
use crate::fault::Fault;
use crate::types::{Type, Types};
use crate::xml::{Element, shortened};

/// Elements that one unit may have in all.
const MOST_ELEMENTS: usize = 20_000_000;

/// Attributes of a value: its own, else those of its type.
#[derive(Clone, Copy)]
struct Value<'a, 't> {
    element: Element<'a>,
    declared: Option<&'t Type<'a>>,
}

impl<'a> Value<'a, '_> {
    fn text(self, name: &str) -> Option<&'a str> {
        self.element
            .attribute(name)
            .or_else(|| self.declared.and_then(|declared| declared.attributes.get(name).copied()))
    }

    fn number(self, name: &str) -> Result<Option<f64>, Fault> {
        let Some(text) = self.text(name) else { return Ok(None) };
        let value = text.trim().parse::<f64>().ok().filter(|value| !value.is_nan());
        let wrong = || self.element.fault(format!("`{name}` is `{}`, which is not a number", shortened(text)));
        value.map(Some).ok_or_else(wrong)
    }
}

/// Reads the list.
pub(crate) fn read(root: Element<'_>, version: Version, types: &Types<'_>) -> Result<Vec<Variable>, Fault> {
    let list = root.child("ModelVariables").ok_or_else(|| root.fault("there is no `ModelVariables`"))?;
    let mut variables: Vec<Variable> = Vec::new();
    let mut derivatives: Vec<(usize, u64, Element<'_>)> = Vec::new();
    let mut names = HashSet::new();
    let mut elements = 0usize;
    let mut aliases = Vec::new();
    let sizes = structural(list, version)?;
    for element in list.children() {
        let (value, kind) = match version {
            Version::Two if element.name() != "ScalarVariable" => continue,
            Version::Two => inner(element)?,
            Version::Three => match kind(element.name()) {
                Some(kind) => (element, kind),
                None => {
                    return Err(element.fault(format!("`{}` is not a type of variables", shortened(element.name()))));
                }
            },
        };
        let declared = match value.attribute("declaredType") {
            Some(name) => {
                let unknown = || value.fault(format!("there is no type `{}`", shortened(name)));
                Some(types.get(name).ok_or_else(unknown)?)
            }
            None => None,
        };
        let value = Value { element: value, declared };
        let variable = variable(element, value, kind, version, &sizes)?;
        elements = elements.saturating_add(variable.count());
        if elements > MOST_ELEMENTS {
            return Err(element.fault(format!("the unit has more than {MOST_ELEMENTS} values")));
        }
        if let Some(of) = value.element.number::<u64>("derivative")? {
            derivatives.push((variables.len(), of, value.element));
        }
        if version == Version::Three {
            for alias in element.children().filter(|child| child.name() == "Alias") {
                let text = |name: &str, own: &Arc<str>| alias.attribute(name).map_or_else(|| own.clone(), Arc::from);
                let mut other = variable.clone();
                other.name = alias.required("name")?.into();
                other.description = text("description", &variable.description);
                other.display_unit = text("displayUnit", &variable.display_unit);
                other.line = alias.line();
                // A further name of an input is not a further input.
                if matches!(other.causality, Causality::Input | Causality::Output) {
                    other.causality = Causality::Local;
                }
                aliases.push(other);
            }
        }
        if !names.insert(variable.name.clone()) {
            return Err(element.fault(format!("the name `{}` stands twice in the list", shortened(&variable.name))));
        }
        variables.push(variable);
    }
    refer(&mut variables, &derivatives, version)?;
    // Positions stay those of the list; aliases come behind.
    for alias in aliases {
        if names.insert(alias.name.clone()) {
            variables.push(alias);
        }
    }
    Ok(variables)
}

/// The element of a variable of 2.0 that holds its value.
fn inner(element: Element<'_>) -> Result<(Element<'_>, Kind), Fault> {
    let found = element.children().find_map(|child| {
        let kind = match child.name() {
            "Real" => Kind::Number(Number::Float64),
            "Integer" => Kind::Number(Number::Int32),
            "Boolean" => Kind::Number(Number::Boolean),
            "String" => Kind::Text,
            "Enumeration" => Kind::Enumeration(Arc::from([])),
            _ => return None,
        };
        Some((child, kind))
    });
    found.ok_or_else(|| element.fault("the variable has no type"))
}

fn kind(name: &str) -> Option<Kind> {
    Some(match name {
        "Float32" => Kind::Number(Number::Float32),
        "Float64" => Kind::Number(Number::Float64),
        "Int8" => Kind::Number(Number::Int8),
        "UInt8" => Kind::Number(Number::UInt8),
        "Int16" => Kind::Number(Number::Int16),
        "UInt16" => Kind::Number(Number::UInt16),
        "Int32" => Kind::Number(Number::Int32),
        "UInt32" => Kind::Number(Number::UInt32),
        "Int64" => Kind::Number(Number::Int64),
        "UInt64" => Kind::Number(Number::UInt64),
        "Boolean" => Kind::Number(Number::Boolean),
        "Enumeration" => Kind::Enumeration(Arc::from([])),
        "String" => Kind::Text,
        "Binary" => Kind::Binary,
        "Clock" => Kind::Clock,
        _ => return None,
    })
}

/// Start values of what sizes may refer to.
fn structural(list: Element<'_>, version: Version) -> Result<HashMap<u32, u32>, Fault> {
    let mut sizes = HashMap::new();
    if version == Version::Two {
        return Ok(sizes);
    }
    for element in list.children().filter(|element| element.name() == "UInt64") {
        if let (Some(reference), Some(start)) = (element.number("valueReference")?, element.attribute("start"))
            && let Ok(start) = start.trim().parse()
        {
            sizes.insert(reference, start);
        }
    }
    Ok(sizes)
}

fn variable(
    element: Element<'_>,
    value: Value<'_, '_>,
    kind: Kind,
    version: Version,
    structural: &HashMap<u32, u32>,
) -> Result<Variable, Fault> {
    let causality = causality(element)?;
    let changes = changes(element, &kind, causality)?;
    let kind = match (kind, value.declared.and_then(|declared| declared.literals.clone())) {
        (Kind::Enumeration(_), Some(literals)) => Kind::Enumeration(literals),
        (kind, _) => kind,
    };
    let sizes = match version {
        Version::Two => Vec::new(),
        Version::Three => sizes(element, structural)?,
    };
    let count = sizes.iter().try_fold(1usize, |product, &size| product.checked_mul(size as usize));
    let count = count.filter(|count| *count <= MOST_ELEMENTS);
    let count = count.ok_or_else(|| element.fault(format!("the array has more than {MOST_ELEMENTS} elements")))?;
    let (start, text) = starts(value, &kind, count)?;
    let named = |name: &str| value.text(name).unwrap_or_default().into();
    let limit = |name: &str, else_: f64| Ok::<f64, Fault>(value.number(name)?.unwrap_or(else_));
    let is_number = !matches!(kind, Kind::Text | Kind::Binary | Kind::Clock);
    let (min, max) = match is_number {
        true => (limit("min", f64::NEG_INFINITY)?, limit("max", f64::INFINITY)?),
        false => (f64::NEG_INFINITY, f64::INFINITY),
    };
    let nominal = if is_number { value.number("nominal")? } else { None };
    let reference = element.number("valueReference")?;
    Ok(Variable {
        name: element.required("name")?.into(),
        reference: reference.ok_or_else(|| element.fault("the variable has no `valueReference`"))?,
        description: element.attribute("description").unwrap_or_default().into(),
        initial: initial(element, causality, changes)?,
        causality,
        changes,
        kind,
        sizes,
        unit: named("unit"),
        display_unit: named("displayUnit"),
        min,
        max,
        nominal: nominal.filter(|value| value.is_finite() && *value != 0.0).map(f64::abs),
        start,
        text,
        derivative_of: None,
        line: element.line(),
    })
}

fn causality(element: Element<'_>) -> Result<Causality, Fault> {
    Ok(match element.attribute("causality") {
        None | Some("local") => Causality::Local,
        Some("parameter") => Causality::Parameter,
        Some("structuralParameter") => Causality::Structural,
        Some("calculatedParameter") => Causality::Calculated,
        Some("input") => Causality::Input,
        Some("output") => Causality::Output,
        Some("independent") => Causality::Independent,
        Some(other) => return Err(element.fault(format!("`{}` is not a causality", shortened(other)))),
    })
}

fn changes(element: Element<'_>, kind: &Kind, causality: Causality) -> Result<Changes, Fault> {
    Ok(match element.attribute("variability") {
        Some("constant") => Changes::Constant,
        Some("fixed") => Changes::Fixed,
        Some("tunable") => Changes::Tunable,
        Some("discrete") => Changes::Discrete,
        Some("continuous") => Changes::Continuous,
        Some(other) => return Err(element.fault(format!("`{}` is not a variability", shortened(other)))),
        // 3.0 says so; in 2.0 all are continuous, which makes no sense for these.
        None => match (kind, causality) {
            (_, Causality::Parameter | Causality::Structural | Causality::Calculated) => Changes::Fixed,
            (Kind::Number(Number::Float32 | Number::Float64), _) => Changes::Continuous,
            _ => Changes::Discrete,
        },
    })
}

fn initial(element: Element<'_>, causality: Causality, changes: Changes) -> Result<Initial, Fault> {
    Ok(match element.attribute("initial") {
        Some("exact") => Initial::Exact,
        Some("approx") => Initial::Approx,
        Some("calculated") => Initial::Calculated,
        Some(other) => return Err(element.fault(format!("`{}` is not a kind of start value", shortened(other)))),
        None => match (causality, changes) {
            (_, Changes::Constant) => Initial::Exact,
            (Causality::Parameter | Causality::Structural | Causality::Input, _) => Initial::Exact,
            _ => Initial::Calculated,
        },
    })
}

fn sizes(element: Element<'_>, structural: &HashMap<u32, u32>) -> Result<Vec<u32>, Fault> {
    let one = |dimension: Element<'_>| match dimension.number("start")? {
        Some(size) => Ok(size),
        None => {
            let reference: Option<u32> = dimension.number("valueReference")?;
            let found = reference.and_then(|reference| structural.get(&reference).copied());
            found.ok_or_else(|| dimension.fault("the size of the array is not known"))
        }
    };
    element.children().filter(|child| child.name() == "Dimension").map(one).collect()
}

/// Start values as numbers, or as a text.
fn starts(value: Value<'_, '_>, kind: &Kind, count: usize) -> Result<(Vec<f64>, Option<String>), Fault> {
    let element = value.element;
    if *kind == Kind::Text {
        let own = element.attribute("start");
        let inner = || element.child("Start").and_then(|start| start.attribute("value"));
        return Ok((Vec::new(), own.or_else(inner).map(str::to_string)));
    }
    if matches!(kind, Kind::Binary | Kind::Clock) {
        return Ok((Vec::new(), None));
    }
    let Some(text) = element.attribute("start") else { return Ok((Vec::new(), None)) };
    let one = |word: &str| {
        let value = match (kind, word) {
            (Kind::Number(Number::Boolean), "true" | "1") => Some(1.0),
            (Kind::Number(Number::Boolean), "false" | "0") => Some(0.0),
            (Kind::Number(Number::Boolean), _) => None,
            (Kind::Number(Number::Float32 | Number::Float64), _) => word.parse::<f64>().ok(),
            _ => word.parse::<i128>().ok().map(|value| value as f64),
        };
        value.ok_or_else(|| element.fault(format!("the start value `{}` is not of its type", shortened(word))))
    };
    let mut list = text.split_whitespace().map(one).collect::<Result<Vec<f64>, Fault>>()?;
    if list.len() == 1 && count != 1 {
        list = vec![list[0]; count];
    }
    if list.len() != count {
        return Err(element.fault(format!("there are {} start values for {count} elements", list.len())));
    }
    Ok((list, None))
}

/// Says of which variables others are the derivatives: by position from 1 in 2.0, by number in 3.0.
fn refer(variables: &mut [Variable], list: &[(usize, u64, Element<'_>)], version: Version) -> Result<(), Fault> {
    let by_reference = by_reference(variables);
    for &(rate, of, element) in list {
        let state = match version {
            Version::Two => usize::try_from(of).ok().and_then(|of| of.checked_sub(1)).filter(|&k| k < variables.len()),
            Version::Three => u32::try_from(of).ok().and_then(|of| by_reference.get(&of).copied()),
        };
        let state = state.ok_or_else(|| element.fault(format!("`derivative` is {of}, which is not a variable")))?;
        variables[rate].derivative_of = Some(state);
    }
    Ok(())
}

/// The first variable of each number; only in 3.0 are numbers the same for all types.
pub(crate) fn by_reference(variables: &[Variable]) -> HashMap<u32, usize> {
    let mut found = HashMap::with_capacity(variables.len());
    for (k, variable) in variables.iter().enumerate() {
        found.entry(variable.reference).or_insert(k);
    }
    found
}
