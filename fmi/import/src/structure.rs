//! `ModelStructure`: states, outputs, event indicators, and what derivatives depend on.

use crate::description::{Kind, Number, State, Variable, Version};
use crate::fault::Fault;
use crate::variables::by_reference;
use crate::xml::Element;

/// Event indicators that a unit may have.
const MOST_INDICATORS: usize = 10_000_000;

/// What was read.
#[derive(Default)]
pub(crate) struct Structure {
    pub(crate) states: Vec<State>,
    pub(crate) outputs: Vec<usize>,
    pub(crate) indicators: usize,
}

/// Reads it.
pub(crate) fn read(root: Element<'_>, version: Version, variables: &[Variable]) -> Result<Structure, Fault> {
    let numbers = by_reference(variables);
    let position = |element: Element<'_>, number: u64| -> Result<usize, Fault> {
        let found = match version {
            Version::Two => {
                usize::try_from(number).ok().and_then(|k| k.checked_sub(1)).filter(|&k| k < variables.len())
            }
            Version::Three => u32::try_from(number).ok().and_then(|number| numbers.get(&number).copied()),
        };
        found.ok_or_else(|| element.fault(format!("{number} is not a variable of the unit")))
    };
    let attribute = if version == Version::Two { "index" } else { "valueReference" };
    let own = |element: Element<'_>| -> Result<usize, Fault> {
        let number = element.number(attribute)?;
        position(element, number.ok_or_else(|| element.fault(format!("`{}` has no `{attribute}`", element.name())))?)
    };
    let mut structure = Structure::default();
    if version == Version::Two {
        structure.indicators = root.number("numberOfEventIndicators")?.unwrap_or(0);
    }
    let Some(list) = root.child("ModelStructure") else { return Ok(structure) };
    // In 2.0 unknowns stand within lists.
    let unknowns = |list_name: &str, name: &str| -> Vec<Element<'_>> {
        match version {
            Version::Two => list.child(list_name).into_iter().flat_map(Element::children).collect(),
            Version::Three => list.children().filter(|child| child.name() == name).collect(),
        }
    };
    for element in unknowns("Outputs", "Output") {
        structure.outputs.push(own(element)?);
    }
    for element in unknowns("Derivatives", "ContinuousStateDerivative") {
        let rate = own(element)?;
        let (name, of) = (&variables[rate].name, variables[rate].derivative_of);
        let state = of.ok_or_else(|| element.fault(format!("`{name}` does not say whose derivative it is")))?;
        let real = |k: usize| variables[k].kind == Kind::Number(Number::Float64);
        if !real(rate) || !real(state) || variables[rate].sizes != variables[state].sizes {
            return Err(element.fault(format!("`{name}` and its state are not both real numbers of the same size")));
        }
        let depends = match element.numbers::<u64>("dependencies")? {
            None => None,
            Some(list) => Some(list.into_iter().map(|number| position(element, number)).collect::<Result<_, _>>()?),
        };
        structure.states.push(State { state, rate, depends });
    }
    if version == Version::Three {
        for element in unknowns("", "EventIndicator") {
            structure.indicators += variables[own(element)?].count();
        }
    }
    if structure.indicators > MOST_INDICATORS {
        return Err(root.fault(format!("the unit has more than {MOST_INDICATORS} event indicators")));
    }
    Ok(structure)
}
