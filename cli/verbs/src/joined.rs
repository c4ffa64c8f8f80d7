//! Units of other tools that are blocks of a model: their files, opened once, and the systems of both.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use hyd_compiler::did_you_mean;
use hyd_discovery::{Fault, Joiner};
use hyd_flat::{FlatModel, ForeignBlock};
use hyd_fmi_import::{Causality, Host, Kind, Unit, Variable, Whole, Wiring};
use hyd_system::{DaeSystem, NamePattern};

use crate::{Failure, Libraries};

/// The units of a model.
#[derive(Clone)]
pub struct Joined {
    units: Arc<[(Unit, Wiring)]>,
    host: Host,
}

impl Joined {
    /// Opens the units of a model, whose files lie where the texts that name them lie; none where there are no units.
    ///
    /// # Errors
    /// A sentence: a unit that cannot be read or is not for model exchange, or that lacks what the model says it has.
    pub fn open(flat: &FlatModel, libraries: &Libraries, host: Option<&Host>) -> Result<Option<Self>, Failure> {
        let Some(first) = flat.foreign.first() else { return Ok(None) };
        let host = host.ok_or_else(|| {
            Failure::Fault(format!("the unit `{}` of another tool can be run by the command `hyd` alone", first.file))
        })?;
        let units = flat.foreign.iter().map(|block| opened(block, libraries)).collect::<Result<Vec<_>, Failure>>()?;
        Ok(Some(Self { units: units.into(), host: host.clone() }))
    }

    /// The system of a text and its units, with a process of its own for each unit.
    ///
    /// # Errors
    /// Why a unit cannot be loaded.
    pub fn join(&self, text: Box<dyn DaeSystem>) -> Result<Whole, Failure> {
        Whole::new(text, &self.units, &self.host).map_err(|fault| Failure::Fault(fault.to_string()))
    }

    /// Sentences on what no use is made of.
    pub fn notes(&self) -> Vec<String> {
        self.units.iter().flat_map(|(unit, _)| unit.notes.clone()).collect()
    }
}

/// Units of a study, whose archives are unpacked once however many models with them are tried.
pub(crate) struct StudyUnits {
    libraries: Libraries,
    host: Option<Host>,
    known: Mutex<BTreeMap<PathBuf, Unit>>,
}

impl StudyUnits {
    /// None is open yet.
    pub(crate) fn new(libraries: &Libraries, host: Option<&Host>) -> Self {
        Self { libraries: libraries.clone(), host: host.cloned(), known: Mutex::default() }
    }

    /// Keeps a unit that has been opened.
    pub(crate) fn keep(&self, path: PathBuf, unit: Unit) {
        self.known.lock().unwrap_or_else(PoisonError::into_inner).insert(path, unit);
    }

    fn unit(&self, path: &Path) -> Result<Unit, Failure> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(unit) = known.get(path) {
            return Ok(unit.clone());
        }
        hyd_run::note_read(path);
        let unit = Unit::open(path).map_err(|fault| Failure::Fault(fault.to_string()))?;
        known.insert(path.to_path_buf(), unit.clone());
        Ok(unit)
    }
}

impl Joiner for StudyUnits {
    fn join(&self, text: Box<dyn DaeSystem>, blocks: &[ForeignBlock]) -> Result<Box<dyn DaeSystem>, Fault> {
        let host =
            self.host.as_ref().ok_or_else(|| Fault::new("units of other tools are run by the command `hyd` alone"))?;
        let mut units = Vec::with_capacity(blocks.len());
        for block in blocks {
            let path = file_of(block, &self.libraries).map_err(said)?;
            let unit = self.unit(&path).map_err(said)?;
            let wiring = wired(&path, &unit, block).map_err(said)?;
            units.push((unit, wiring));
        }
        let whole = Whole::new(text, &units, host).map_err(|fault| Fault::new(fault.to_string()))?;
        Ok(Box::new(whole))
    }
}

/// Why a unit cannot be used, as a fault of the study.
fn said(failure: Failure) -> Fault {
    match failure {
        Failure::Fault(sentence) | Failure::Usage(sentence) | Failure::Solver(sentence) => Fault::new(sentence),
        _ => Fault::new("a unit cannot be used"),
    }
}

/// Where the file of a unit lies.
pub(crate) fn file_of(block: &ForeignBlock, libraries: &Libraries) -> Result<PathBuf, Failure> {
    let folder = Path::new(&*block.written_in).parent().unwrap_or(Path::new(""));
    let path = libraries.file_of(folder, &block.file);
    path.map_err(|why| Failure::Fault(format!("`{}`: the unit {why}", block.written_in)))
}

/// One unit, checked.
fn opened(block: &ForeignBlock, libraries: &Libraries) -> Result<(Unit, Wiring), Failure> {
    let path = file_of(block, libraries)?;
    hyd_run::note_read(&path);
    let unit = Unit::open(&path).map_err(|fault| Failure::Fault(fault.to_string()))?;
    let wiring = wired(&path, &unit, block)?;
    Ok((unit, wiring))
}

/// The names of a block, checked.
fn wired(path: &Path, unit: &Unit, block: &ForeignBlock) -> Result<Wiring, Failure> {
    let refused = |sentence: String| Failure::Fault(format!("`{}`: {sentence}", path.display()));
    if unit.description.exchange.is_none() {
        return Err(refused(format!(
            "{} is a unit for co-simulation alone, which advances by steps of its own; a block of a model must be one for model exchange",
            shown(&block.path)
        )));
    }
    check(unit, block).map_err(refused)?;
    Ok(Wiring {
        path: block.path.to_string(),
        inputs: block.inputs.clone(),
        outputs: block.outputs.clone(),
        parameters: block.parameters.clone(),
        declared: block.declared.clone(),
    })
}

/// Says whether a variable can be what a name stands for.
type Wanted<'a> = dyn Fn(&Variable) -> bool + 'a;

/// Refuses names that the unit does not have.
fn check(unit: &Unit, block: &ForeignBlock) -> Result<(), String> {
    let is_input = |own: &Variable| own.causality == Causality::Input;
    let is_set = |own: &Variable| {
        matches!(own.causality, Causality::Parameter | Causality::Input) || unit.description.is_start_free(own)
    };
    let is_computed =
        |own: &Variable| matches!(own.causality, Causality::Output | Causality::Local | Causality::Independent);
    let (is_input, is_set, is_computed): (&Wanted<'_>, &Wanted<'_>, &Wanted<'_>) = (&is_input, &is_set, &is_computed);
    for (pairs, what, wanted) in [
        (&block.inputs, "input", is_input),
        (&block.outputs, "variable that it computes", is_computed),
        (&block.parameters, "parameter that can be set", is_set),
    ] {
        if pairs.is_empty() {
            continue;
        }
        let variables = unit.description.variables.iter();
        let numbers = variables.filter(|own| !matches!(own.kind, Kind::Text | Kind::Binary | Kind::Clock));
        let names: Vec<String> = numbers.filter(|own| wanted(own)).flat_map(element_names).collect();
        if let Some((name, own)) = pairs.iter().find(|(_, own)| !names.contains(own)) {
            let hint = did_you_mean(own, names.iter().map(String::as_str));
            let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
            return Err(format!("`{name}` is said to be `{own}` of the unit, which has no {what} of that name{hint}"));
        }
    }
    Ok(())
}

/// Full names of the elements of a variable.
pub(crate) fn element_names(variable: &Variable) -> impl Iterator<Item = String> + use<> {
    let parts = vec![(variable.name.clone(), variable.sizes.clone())];
    let pattern = NamePattern { parts, derivative: false };
    (0..variable.count()).map(move |element| pattern.element(element))
}

fn shown(path: &str) -> String {
    if path.is_empty() { "the model".to_string() } else { format!("`{path}`") }
}
