//! A unit of another tool as the model of a study: a system for each thread, each with a process of its own.

use std::path::Path;

use hyd_discovery::{Fault, ForeignModel};
use hyd_fmi_import::{Causality, Exchange, Host, Kind, Unit};
use hyd_system::{DaeSystem, NamePattern};

use crate::Failure;

/// A unit, and how its processes are begun.
#[derive(Clone)]
pub struct UnitModel {
    unit: Unit,
    host: Host,
}

impl UnitModel {
    /// Opens a unit for model exchange.  `class`: what the study calls the model.
    ///
    /// # Errors
    /// A sentence: it cannot be read, is not for model exchange, is another model.
    pub(crate) fn open(file: &Path, host: Option<&Host>, class: &str) -> Result<Self, Failure> {
        let refused = |sentence: String| Failure::Fault(format!("`{}`: {sentence}", file.display()));
        let host =
            host.ok_or_else(|| refused("units of other tools are fitted by the command `hyd fit` alone".into()))?;
        let unit = Unit::open(file).map_err(|fault| Failure::Fault(fault.to_string()))?;
        if *unit.description.model != *class {
            return Err(refused(format!(
                "it is a unit of the model `{}`, and the study names `{class}`",
                unit.description.model
            )));
        }
        if unit.description.exchange.is_none() {
            return Err(refused("it is for co-simulation alone, and a fit needs model exchange".into()));
        }
        Ok(Self { unit, host: host.clone() })
    }

    fn element_names(variable: &hyd_fmi_import::Variable) -> impl Iterator<Item = String> {
        let parts = vec![(variable.name.clone(), variable.sizes.clone())];
        let pattern = NamePattern { parts, derivative: false };
        (0..variable.count()).map(move |element| pattern.element(element))
    }
}

impl ForeignModel for UnitModel {
    fn instantiate(&self, driven: &[String]) -> Result<Box<dyn DaeSystem>, Fault> {
        let made = Exchange::new(&self.unit, &self.host, driven);
        made.map(|system| Box::new(system) as Box<dyn DaeSystem>).map_err(|fault| Fault::new(fault.to_string()))
    }

    fn inputs(&self) -> Vec<String> {
        let variables = self.unit.description.variables.iter();
        let inputs =
            variables.filter(|own| own.causality == Causality::Input && !matches!(own.kind, Kind::Text | Kind::Binary));
        inputs.flat_map(Self::element_names).collect()
    }

    fn limits(&self) -> Vec<(String, (f64, f64))> {
        let variables = self.unit.description.variables.iter();
        let settable = variables.filter(|own| matches!(own.causality, Causality::Parameter | Causality::Input));
        let limited = settable.filter(|own| own.min > f64::NEG_INFINITY || own.max < f64::INFINITY);
        limited.flat_map(|own| Self::element_names(own).map(|name| (name, (own.min, own.max)))).collect()
    }
}
