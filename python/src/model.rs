//! A model: its texts, its translations, and what can be done with it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use hyd_compiler::{Code, Extras, Files, FlatModel, Goal, Severity, Stage};
use hyd_run::{Failure, InputTable, Selection, parameters, read_text};
use hyd_runtime::SolveError;
use hyd_system::by_part::by_part;
use hyd_system::given::Elements;
use hyd_system::{DaeSystem, Place, Settable, Tables, ValueKind, Variability, VariableInfo};
use hyd_verbs::linear::{Point, linearize};
use hyd_verbs::{Libraries, Request, Run as OneRun, compile_text, run_diagnostic};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::json;

use crate::function::{Function, Wanted};
use crate::inputs::{Inputs, table};
use crate::linear::to_dict;
use crate::messages::{Kept, Message, exception, failed, rejected, stopped, warn, warnings};
use crate::rows::Collector;
use crate::run::Run;
use crate::run_options::RunOptions;
use crate::signals::Signals;
use crate::sources::Texts;
use crate::sweep::{SweepOptions, sweep};
use crate::translated::{Key, Translated, file_access};

/// Translations that are kept beside the first one.
const MOST_TRANSLATIONS: usize = 16;

/// Rows for which there is room at first where every step is one.
const USUAL_STEPS: usize = 1000;

/// `hyd.Model` below its documentation.
#[pyclass(frozen, module = "hyd._hyd")]
pub(crate) struct Model {
    texts: Texts,
    class: Option<String>,
    /// Parameters that were set when it was loaded.
    given: Vec<(String, String)>,
    /// Units that do not fit are errors in libraries, too.
    strict_units: bool,
    base: Arc<Translated>,
    /// Messages about inputs without values, given whenever they are left without.
    open_inputs: Vec<Message>,
    /// What the translation has said beside that, until somebody asks.
    said: Mutex<Vec<Message>>,
    others: Mutex<BTreeMap<Key, Arc<Translated>>>,
}

/// A parameter to set: its name and its value as text.
type Assignment = (String, String);

impl Model {
    fn new(
        py: Python<'_>,
        texts: Texts,
        class: Option<String>,
        given: Vec<Assignment>,
        strict_units: bool,
    ) -> PyResult<Self> {
        let key = Key { set: given.clone(), driven: Vec::new(), strict_units };
        let translated = py.detach(|| Translated::new(&texts, class.as_deref(), key));
        let (base, messages) = translated.map_err(|messages| rejected(py, &messages))?;
        let (open_inputs, messages): (Vec<_>, Vec<_>) = messages.into_iter().partition(|own| own.has(Code::OpenInput));
        let (base, said, others) = (Arc::new(base), Mutex::new(messages), Mutex::default());
        Ok(Self { texts, class, given, strict_units, base, open_inputs, said, others })
    }

    /// What was set when the model was loaded with what is set now; a name is set once.
    fn all(&self, set: Vec<Assignment>) -> Vec<Assignment> {
        let mut all = self.given.clone();
        for (name, value) in set {
            match all.iter_mut().find(|(known, _)| *known == name) {
                Some(known) => known.1 = value,
                None => all.push((name, value)),
            }
        }
        all
    }

    /// The translation for these parameters and recorded inputs; made again where they decide sizes or structure, or cannot be set.  `later`: what
    /// gets its value after that.
    fn translated(
        &self,
        py: Python<'_>,
        set: &[Assignment],
        driven: Vec<String>,
        later: &[String],
    ) -> PyResult<Arc<Translated>> {
        let base = &self.base;
        let are_open = driven.is_empty();
        if are_open {
            let fed: Vec<String> = set.iter().map(|(name, _)| name).chain(later).cloned().collect();
            let open = self.open_inputs.iter().filter(|own| !own.is_of_open_input(&fed)).cloned();
            warn(py, &open.collect::<Vec<_>>())?;
        }
        let tables = base.model().tables();
        let is_run_time = |own: &&Assignment| {
            self.given.contains(*own)
                || !base.compilation.set_at_translation.contains(&own.0)
                    && parameters::changes(tables, std::slice::from_ref(*own), &[]).is_ok()
        };
        let mut structural: Vec<Assignment> = set.iter().filter(|own| !is_run_time(own)).cloned().collect();
        if structural.is_empty() && driven.is_empty() {
            return Ok(base.clone());
        }
        // What was given before stands under the new values.
        let mut all = self.given.clone();
        all.retain(|(name, _)| structural.iter().all(|(own, _)| own != name));
        all.append(&mut structural);
        let key = Key { set: all, driven, strict_units: self.strict_units };
        let known = self.others.lock().unwrap_or_else(PoisonError::into_inner).get(&key).cloned();
        if let Some(known) = known {
            return Ok(known);
        }
        let made = py.detach(|| Translated::new(&self.texts, self.class.as_deref(), key.clone()));
        let (made, mut messages) = made.map_err(|messages| rejected(py, &messages))?;
        messages.retain(|own| !(are_open && own.has(Code::OpenInput)));
        let made = Arc::new(made);
        {
            let mut others = self.others.lock().unwrap_or_else(PoisonError::into_inner);
            if others.len() >= MOST_TRANSLATIONS {
                others.pop_first();
            }
            others.insert(key, made.clone());
        }
        // Where a filter makes an exception of it the translation is kept.
        warn(py, &messages)?;
        Ok(made)
    }
}

#[pymethods]
impl Model {
    /// Loads a file.
    #[staticmethod]
    fn load(
        py: Python<'_>,
        file: PathBuf,
        class: Option<String>,
        set: Vec<Assignment>,
        libraries: (Vec<PathBuf>, bool),
        strict_units: bool,
    ) -> PyResult<Self> {
        let text = read_text(&file)
            .map_err(|error| rejected(py, &[Message::of(&Files::new(), &file_access(error.to_string()))]))?;
        let name = file.display().to_string();
        Self::new(py, Texts::new(name, text, Some(file), &of_folders(libraries)), class, set, strict_units)
    }

    /// Takes a text.
    #[staticmethod]
    fn of_text(
        py: Python<'_>,
        text: String,
        name: String,
        class: Option<String>,
        set: Vec<Assignment>,
        libraries: (Vec<PathBuf>, bool),
        strict_units: bool,
    ) -> PyResult<Self> {
        Self::new(py, Texts::new(name, text, None, &of_folders(libraries)), class, set, strict_units)
    }

    /// The names of files of parameters with their values as text.
    #[staticmethod]
    fn parameter_file(py: Python<'_>, file: PathBuf) -> PyResult<Vec<Assignment>> {
        hyd_run::parameter_file::read(&file).map_err(|failure| failed(py, &failure, &[]))
    }

    /// Everything that makes the model, for pickles.
    fn state(&self) -> String {
        json!({"texts": self.texts.state(), "class": self.class, "given": self.given, "strict_units": self.strict_units}).to_string()
    }

    /// A model from what `state` gave.
    #[staticmethod]
    fn of_state(py: Python<'_>, state: &str) -> PyResult<Self> {
        let made = || {
            let state: serde_json::Value = serde_json::from_str(state).ok()?;
            let given = state["given"].as_array()?.iter();
            let given = given.map(|own| Some((own[0].as_str()?.to_string(), own[1].as_str()?.to_string())));
            let class = state["class"].as_str().map(str::to_string);
            let strict_units = state["strict_units"].as_bool()?;
            Some((Texts::from_state(&state["texts"])?, class, given.collect::<Option<Vec<_>>>()?, strict_units))
        };
        let broken = || exception(py, "usage", Some("this is not the state of a model"), &[], None);
        let (texts, class, given, strict_units) = made().ok_or_else(broken)?;
        Self::new(py, texts, class, given, strict_units)
    }

    /// What the translation has said; once.
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let said = std::mem::take(&mut *self.said.lock().unwrap_or_else(PoisonError::into_inner));
        warnings(py, &said)
    }

    /// Full name of the class.
    #[getter]
    fn name(&self) -> String {
        self.base.compilation.model_name.as_deref().unwrap_or_default().to_string()
    }

    /// Name of the text in messages.
    #[getter]
    fn file(&self) -> String {
        self.texts.name.clone()
    }

    /// What the model says of itself.
    #[getter]
    fn description(&self) -> String {
        self.base.model().payload().identity.description.to_string()
    }

    /// Start, stop, tolerance and interval by the model's annotation.
    #[getter]
    fn experiment(&self) -> (Option<f64>, Option<f64>, Option<f64>, Option<f64>) {
        let own = self.base.model().payload().experiment;
        (own.start, own.stop, own.tolerance, own.interval)
    }

    /// Names of the parameters that can be set, and of those that decide sizes or structure.
    fn settable(&self) -> Vec<String> {
        let can = |info: &&VariableInfo| info.settable != Settable::No && info.name.count() > 0;
        let tables = self.base.model().tables();
        tables.variables.iter().filter(can).map(|info| stem(&info.name.element(0), info.name.count())).collect()
    }

    /// True if this names a parameter or a part of one, whatever its value.
    fn is_parameter(&self, name: &str) -> bool {
        let tables = self.base.model().tables();
        let names = || tables.variables.iter().map(|info| &info.name);
        let pair = [(name.to_string(), "0".to_string())];
        names().any(|own| Elements::of(own, name).is_some())
            || by_part(&pair, names()).is_ok_and(|own| own[..] != pair[..])
    }

    /// Names of the model's own inputs of type Real, and of its outputs.
    fn ends(&self) -> (Vec<String>, Vec<String>) {
        let Some(flat) = self.base.compilation.flat.as_deref() else { return Default::default() };
        let outputs = flat.outputs.iter().map(|&block| &flat.variables[block].name);
        (FlatModel::real_inputs(flat), outputs.flat_map(|name| (0..name.count()).map(|k| name.element(k))).collect())
    }

    /// All scalar variables and parameters with what is known of them, as dictionaries.
    fn variables<'py>(&self, py: Python<'py>, parameters: bool) -> PyResult<Bound<'py, PyList>> {
        let model = self.base.model();
        let (tables, payload) = (model.tables(), model.payload());
        let mut system = model.instantiate();
        let set = parameters::apply(&mut system, &self.given, &self.base.compilation.set_at_translation);
        set.map_err(|sentence| failed(py, &Failure::Fault(sentence), &[]))?;
        // Where a binding has no value at the start, its parameter has none here.
        let _ = system.bind(payload.experiment.start.unwrap_or(0.0));
        let limits: BTreeMap<(u32, u32), (f64, f64)> =
            payload.parameters.limits.iter().map(|own| ((own.variable, own.element), (own.min, own.max))).collect();
        let list = PyList::empty(py);
        for (k, info) in tables.variables.iter().enumerate() {
            if (info.variability <= Variability::Parameter) != parameters {
                continue;
            }
            for (element, source) in info.sources.iter().enumerate() {
                let (min, max) = limits.get(&(k as u32, element as u32)).copied().unwrap_or((f64::NAN, f64::NAN));
                let own = describe(py, info, element)?;
                let value = match source.place {
                    Place::Parameter(place) => system.parameters().get(place as usize).copied(),
                    Place::Constant(value) => Some(value),
                    Place::Output(_) => None,
                };
                own.set_item("value", value.map(|value| if source.negated { -value } else { value }))?;
                own.set_item("min", Some(min).filter(|value| value.is_finite()))?;
                own.set_item("max", Some(max).filter(|value| value.is_finite()))?;
                list.append(own)?;
            }
        }
        Ok(list)
    }

    /// The text of a stage of the translation.
    fn equations(&self, py: Python<'_>, stage: &str) -> PyResult<String> {
        let wanted = match stage {
            "flat" => Stage::Flat,
            "system" => Stage::System,
            "reduced" => Stage::Reduced,
            "sorted" => Stage::Sorted,
            "jacobian" => Stage::Jacobian,
            "c" => Stage::C,
            other => {
                let sentence = format!("stage: `{other}` is not flat, system, reduced, sorted, jacobian or c");
                return Err(failed(py, &Failure::Usage(sentence), &[]));
            }
        };
        let again = || {
            // Stages on the way are not kept where code is made.
            let request = Request { class: self.class.clone(), set: self.given.clone(), goal: Goal::Check };
            let extras = Extras { strict_units: self.strict_units, ..Extras::default() };
            let mut sources = self.texts.sources().ok()?;
            compile_text(&mut sources, &self.texts.name, &self.texts.text, &request, &extras).print(wanted)
        };
        let text = py.detach(|| self.base.compilation.print(wanted).or_else(again));
        text.ok_or_else(|| failed(py, &Failure::Fault("the translation did not come to this stage".to_string()), &[]))
    }

    /// What a variable equals, what it is solved from, and where that stands in the text.
    fn explain(&self, py: Python<'_>, variable: &str) -> PyResult<String> {
        let explained = py.detach(|| self.base.compilation.explain(variable));
        let explained = explained.unwrap_or_else(|| Err("the translation did not come so far".to_string()));
        explained.map_err(|sentence| failed(py, &Failure::Usage(sentence), &[]))
    }

    /// One run, and its warnings.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        set: Vec<Assignment>,
        options: RunOptions,
        inputs: Option<Inputs>,
        hold: Vec<String>,
        sensitivity: Vec<String>,
    ) -> PyResult<(Run, Bound<'py, PyList>)> {
        let usage = |failure: Failure| failed(py, &failure, &[]);
        let arguments = options.arguments(sensitivity).map_err(usage)?;
        hyd_run::check_usage(&arguments, None).map_err(usage)?;
        let selection = Selection::new(arguments.variables.as_deref()).map_err(usage)?;
        let table = table(inputs, hold).map_err(usage)?;
        let set = self.all(set);
        let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
        let translated = self.translated(py, &set, driven, &[])?;
        let experiment = &translated.model().payload().experiment;
        let experiment = InputTable::experiment(table.as_ref(), experiment, arguments.start);
        let options = hyd_run::options(&arguments, &experiment).map_err(usage)?;
        if let Some(outside) = translated.outside(&set, options.start) {
            return Err(rejected(py, &[outside]));
        }
        let promised = if arguments.every_step { USUAL_STEPS } else { options.intervals };
        let one = OneRun {
            units: None,
            compilation: &translated.compilation,
            set: &set,
            table: table.as_ref(),
            arguments: &arguments,
            drawn: false,
            only_shown: false,
            translate_s: translated.translate_s,
            progress: false,
        };
        let (ran, caught) = py.detach(|| {
            let signals = Signals::new();
            let collect = || {
                let chosen = (arguments.variables.as_deref(), selection.clone());
                Collector::new(&translated.layout, chosen, promised)
            };
            let ran = one.simulate(&|| translated.whole(), &collect, &|| signals.stop());
            let ran = ran.map(|(outcome, rows)| (outcome.summary, outcome.result, Arc::new(rows.finish())));
            (ran, signals.caught())
        });
        let (summary, result, rows) = match (ran, caught) {
            (Ok((summary, _, rows)), Some(caught)) => {
                let message = summary.message.clone();
                let run = Py::new(py, Run::new(rows, summary))?.into_any();
                return Err(stopped(py, caught, message.as_deref(), &[], Some(run)));
            }
            (Err(_), Some(caught)) => return Err(stopped(py, caught, None, &[], None)),
            (Err(failure), None) => return Err(failed(py, &failure, &[])),
            (Ok(ended), None) => ended,
        };
        let said = summary.warnings.iter().map(|text| Message::sentence(Severity::Warning, text));
        let jumps = summary.jumps.iter().map(|text| Message::sentence(Severity::Note, text));
        let mut said: Vec<Message> = said.chain(jumps).collect();
        let run = Run::new(rows, summary);
        if let Err(error) = result {
            let kind = match error {
                SolveError::Option(_) => return Err(failed(py, &Failure::Usage(error.to_string()), &[])),
                SolveError::Sink { .. } | SolveError::Assertion { .. } => "model",
                _ => "run",
            };
            let (files, flat) = (&translated.compilation.files, translated.compilation.flat.as_deref());
            said.push(Message::of(files, &run_diagnostic(&error, files, flat, None)));
            let run = Py::new(py, run)?.into_any();
            return Err(exception(py, kind, None, &said, Some(run)));
        }
        Ok((run, warnings(py, &said)?))
    }

    /// Many runs.
    fn sweep<'py>(
        &self,
        py: Python<'py>,
        set: Vec<Assignment>,
        options: SweepOptions,
        inputs: Option<Inputs>,
        hold: Vec<String>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let table = table(inputs, hold).map_err(|failure| failed(py, &failure, &[]))?;
        let mut set = self.all(set);
        let driven = table.as_ref().map(InputTable::names).unwrap_or_default();
        let varied: Vec<String> = options.varied().collect();
        // What was given when the model was loaded may vary now.
        set.retain(|(name, _)| !(varied.contains(name) && self.given.iter().any(|(own, _)| own == name)));
        let translated = self.translated(py, &set, driven, &varied)?;
        sweep(py, (&translated, set), options, table.as_ref(), progress)
    }

    /// The linear model at a point of a run.
    fn linearize<'py>(
        &self,
        py: Python<'py>,
        set: Vec<Assignment>,
        at: f64,
        inputs: Vec<String>,
        outputs: Vec<String>,
        tolerance: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let set = self.all(set);
        let translated = self.translated(py, &set, Vec::new(), &[])?;
        let start = translated.model().payload().experiment.start.unwrap_or(0.0);
        if let Some(outside) = translated.outside(&set, start) {
            return Err(rejected(py, &[outside]));
        }
        let point = Point { at, inputs, outputs, tolerance };
        let kept = Kept::default();
        let (linear, caught) = py.detach(|| {
            let signals = Signals::new();
            let linear = linearize(&translated.compilation, &set, &point, &kept, &|| signals.stop());
            (linear, signals.caught())
        });
        let messages = kept.take();
        if let Some(caught) = caught {
            return Err(stopped(py, caught, None, &messages, None));
        }
        let linear = to_dict(py, linear.map_err(|failure| failed(py, &failure, &messages))?)?;
        linear.set_item("warnings", warnings(py, &messages)?)?;
        Ok(linear)
    }

    /// A function of parameters.
    fn function(&self, py: Python<'_>, set: Vec<Assignment>, wanted: Wanted) -> PyResult<Function> {
        let set = self.all(set);
        let translated = self.translated(py, &set, Vec::new(), wanted.parameters())?;
        Function::new(py, translated, set, wanted)
    }
}

/// Where classes come from: folders, and whether data files may stand outside of them.
fn of_folders((folders, allow_outside): (Vec<PathBuf>, bool)) -> Libraries {
    Libraries { folders, allow_outside, ..Libraries::default() }
}

/// A name without the subscripts at its end, if it names one of several elements.
fn stem(name: &str, count: usize) -> String {
    match name.rfind('[') {
        Some(at) if count > 1 && name.ends_with(']') => name[..at].to_string(),
        _ => name.to_string(),
    }
}

/// What the tables say of an element.
fn describe<'py>(py: Python<'py>, info: &VariableInfo, element: usize) -> PyResult<Bound<'py, PyDict>> {
    let own = PyDict::new(py);
    own.set_item("name", info.name.element(element))?;
    own.set_item("unit", &*info.unit)?;
    own.set_item("description", &*info.description)?;
    let (kind, literals) = match &info.kind {
        ValueKind::Real => ("Real", None),
        ValueKind::Integer => ("Integer", None),
        ValueKind::Boolean => ("Boolean", None),
        ValueKind::Enumeration(names) => ("enumeration", Some(names.iter().map(|name| &**name).collect::<Vec<_>>())),
    };
    own.set_item("kind", kind)?;
    own.set_item("literals", literals)?;
    let settable = match info.settable {
        Settable::Yes => "yes",
        Settable::Structural => "structural",
        Settable::No => "no",
    };
    own.set_item("settable", settable)?;
    own.set_item("protected", info.protected)?;
    Ok(own)
}

/// The names of tables by which a column may be asked for.
pub(crate) fn near(tables: &Tables, name: &str) -> Option<String> {
    let names: Vec<String> =
        tables.variables.iter().filter(|info| info.name.count() > 0).map(|info| info.name.element(0)).collect();
    hyd_compiler::did_you_mean(name, names.iter().map(String::as_str)).or_else(|| {
        // Perhaps only the component before the name is missing.
        let inside = names.iter().find(|full| full.rsplit('.').next() == Some(name));
        inside.map(|full| format!("did you mean `{full}`?"))
    })
}
