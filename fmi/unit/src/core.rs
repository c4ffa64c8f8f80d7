//! A unit: the model, what solves it, and the mode it is in.
//!
//! [`Core`] is all that a state of the unit is, so a clone of it is a saved state.  Modes and which calls they allow follow the state machines
//! of FMI 3.0.2, sections 2.3 to 4.2; version 2.0 has the same ones by other names.  What is special to one kind stands in `exchange`
//! (model exchange) and `stepping` (co-simulation), values by number in `values`.

use std::collections::HashMap;
use std::ffi::CString;
use std::sync::Arc;

use hyd_fmi::{Catalogue, Meaning, Starts};
use hyd_payload::{Instance, Loaded, outside_limits};
use hyd_runtime::{Exchange, Onward, Options};
use hyd_system::{AssertionReport, DaeSystem, Source, Structure};

use crate::fault::Fault;

/// Relative tolerance if nobody says otherwise.
const TOLERANCE: f64 = 1e-6;
/// Bounds of the tolerances that the solver takes.
const TOLERANCES: (f64, f64) = (1e-13, 0.1);

/// Who integrates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Somebody else.
    Exchange,
    /// The unit itself.
    Stepping,
}

/// Where in its life a unit is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mode {
    /// Before the start is looked for.
    Instantiated,
    Initialization,
    Event,
    /// Between events: continuous-time mode, or step mode.
    Running,
    Terminated,
}

/// What the run is to be.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Setup {
    pub(crate) start: f64,
    pub(crate) stop: Option<f64>,
    pub(crate) tolerance: Option<f64>,
}

/// What solves the model.
#[derive(Clone)]
pub(crate) enum Engine {
    /// Not yet begun.
    None,
    Exchange(Box<Exchange>),
    Stepping(Box<Onward>),
}

/// How a co-simulation handles events.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Manners {
    /// Events are reported and wait for the importer.
    pub(crate) event_mode: bool,
    /// A step may end before its end.
    pub(crate) early_return: bool,
}

/// What belongs to the model and never changes.
pub(crate) struct Known {
    pub(crate) loaded: Arc<Loaded>,
    /// A number of its own for each payload, by which a saved state knows its unit.
    pub(crate) payload: u64,
    pub(crate) catalogue: Catalogue,
    /// Input site of an element of a variable.
    pub(crate) inputs: HashMap<(usize, usize), usize>,
    /// Variables whose start can be set.
    pub(crate) starts: Starts,
    /// What inputs are before anybody has said so.
    pub(crate) input_starts: Vec<f64>,
    /// Strings, in the order of their numbers.
    pub(crate) texts: Vec<CString>,
}

/// A unit with its state.
#[derive(Clone)]
pub(crate) struct Core {
    pub(crate) known: Arc<Known>,
    pub(crate) kind: Kind,
    pub(crate) manners: Manners,
    pub(crate) mode: Mode,
    pub(crate) setup: Setup,
    pub(crate) system: Instance,
    pub(crate) engine: Engine,
    /// A parameter has been set, so that one may be outside its limits.
    pub(crate) parameters_set: bool,
    /// The values of the start are out of date.
    pub(crate) unstarted: bool,
    /// The communication point (s).
    pub(crate) at: f64,
    /// Inputs have changed since the last step.
    pub(crate) disturbed: bool,
    /// Solver and model as they were before inputs that have changed acted, where they did so because somebody looked at the point.
    pub(crate) unsettled: Option<(Box<Onward>, Instance)>,
    /// Inputs whose slope was set since the last step.
    pub(crate) sloped: Vec<bool>,
    /// An event of the unit's own waits for the importer.
    pub(crate) waiting: bool,
    /// Outputs at the present point, if they are up to date.
    pub(crate) row: Vec<f64>,
    pub(crate) fresh: bool,
    /// The real numbers that were asked for last, which most importers ask for again, and where they stand.
    pub(crate) asked: (Vec<u32>, Vec<Source>),
    /// The model has ended the run: its message.
    pub(crate) ended: Option<String>,
    /// Warnings of a co-simulation that have been told.
    pub(crate) told: usize,
    /// That equations leave variables open has been told, once: which ones may change with every event.
    pub(crate) told_open: bool,
    /// Assertions that are still to be told.
    pub(crate) reports: Vec<AssertionReport>,
}

impl Core {
    /// A unit of a model.
    ///
    /// # Errors
    /// A sentence.
    pub(crate) fn new(
        (loaded, payload): (Arc<Loaded>, u64),
        (kind, manners): (Kind, Manners),
        input_starts: Vec<f64>,
        texts: Vec<CString>,
    ) -> Result<Self, String> {
        let model = &loaded.model;
        if kind == Kind::Exchange && !model.structure.delays.is_empty() {
            return Err("the model has delays, so it has no finite state: it is for co-simulation only".to_string());
        }
        let catalogue = Catalogue::new(model, texts.len());
        let catalogue = catalogue.ok_or("the model has more variables than there are numbers for them")?;
        let inputs = input_sites(model);
        let starts = Starts::new(model);
        let mut system = loaded.instantiate();
        let row = vec![0.0; model.structure.outputs];
        let start = model.experiment.start.unwrap_or(0.0);
        for (input, &value) in input_starts.iter().enumerate() {
            system.hold_input(input, value, (0.0, start));
        }
        Ok(Self {
            known: Arc::new(Known { loaded: loaded.clone(), payload, catalogue, inputs, starts, input_starts, texts }),
            kind,
            manners,
            asked: (Vec::new(), Vec::new()),
            mode: Mode::Instantiated,
            setup: Setup { start, stop: None, tolerance: None },
            system,
            engine: Engine::None,
            parameters_set: false,
            unstarted: true,
            at: start,
            disturbed: false,
            unsettled: None,
            sloped: vec![false; model.structure.inputs.len()],
            waiting: false,
            row,
            fresh: false,
            ended: None,
            told: 0,
            told_open: false,
            reports: Vec::new(),
        })
    }

    /// As it was when it was made.
    ///
    /// # Errors
    /// A sentence.
    pub(crate) fn reset(&mut self) -> Result<(), Fault> {
        let Known { loaded, payload, input_starts, texts, .. } = &*self.known;
        let again =
            Self::new((loaded.clone(), *payload), (self.kind, self.manners), input_starts.clone(), texts.clone());
        *self = again.map_err(Fault::usage)?;
        Ok(())
    }

    pub(crate) fn structure(&self) -> &Structure {
        &self.known.loaded.model.structure
    }

    /// An error where the mode is none of these.
    pub(crate) fn allow(&self, call: &str, modes: &[Mode]) -> Result<(), Fault> {
        match modes.contains(&self.mode) {
            true => Ok(()),
            false => Err(Fault::usage(format!("{call} must not be called in the mode {:?}", self.mode))),
        }
    }

    /// What the run is to be.
    pub(crate) fn set_up(&mut self, setup: Setup) -> Result<(), Fault> {
        self.allow("setting up the experiment", &[Mode::Instantiated])?;
        let stop_is_ahead = setup.stop.is_none_or(|stop| stop.is_finite() && stop >= setup.start);
        if !setup.start.is_finite() || !stop_is_ahead {
            return Err(Fault::usage(format!(
                "a run from {} s to {} s is not possible",
                setup.start,
                setup.stop.unwrap_or(f64::INFINITY)
            )));
        }
        if let Some(tolerance) = setup.tolerance.filter(|tolerance| !(*tolerance > 0.0 && tolerance.is_finite())) {
            return Err(Fault::usage(format!("the tolerance {tolerance} is not a positive number")));
        }
        self.setup = setup;
        self.at = setup.start;
        Ok(())
    }

    pub(crate) fn enter_initialization(&mut self) -> Result<(), Fault> {
        self.allow("entering initialization", &[Mode::Instantiated])?;
        (self.mode, self.unstarted, self.fresh) = (Mode::Initialization, true, false);
        Ok(())
    }

    /// Values of the start, if something has changed since they were found.
    pub(crate) fn start(&mut self) -> Result<(), Fault> {
        if !self.unstarted {
            return Ok(());
        }
        self.fresh = false;
        let Setup { start, stop, tolerance } = self.setup;
        let model = &self.known.loaded.model;
        let tolerance = tolerance.or(model.experiment.tolerance).unwrap_or(TOLERANCE);
        let tolerance = tolerance.clamp(TOLERANCES.0, TOLERANCES.1);
        let failed = |error: hyd_runtime::SolveError| Fault { harmless: true, ..Fault::end(&error) };
        // Where values cannot be bound, the start says why.
        let limits = &model.parameters.limits;
        if self.parameters_set
            && !limits.is_empty()
            && self.system.bind(start).is_ok()
            && let Some(sentence) = outside_limits(limits, &self.system)
        {
            return Err(Fault::usage(sentence));
        }
        match self.kind {
            Kind::Exchange => {
                let mut exchange = Box::new(Exchange::new(&model.structure, self.system.is_affine()));
                let settled = exchange.begin(&mut self.system, (start, stop), tolerance).map_err(failed)?;
                self.ended = settled.terminated;
                self.reports.extend(exchange.reports());
                self.engine = Engine::Exchange(exchange);
            }
            Kind::Stepping => {
                let known = stop.or(model.experiment.stop).filter(|&stop| stop > start);
                let options = Options::new(start, known.unwrap_or(start + 1.0)).with_tolerance(tolerance);
                let mut steps = Box::new(Onward::new(&model.structure, options));
                steps.begin(&mut self.system).map_err(failed)?;
                self.engine = Engine::Stepping(steps);
            }
        }
        (self.unstarted, self.disturbed, self.unsettled) = (false, false, None);
        Ok(())
    }

    pub(crate) fn exit_initialization(&mut self) -> Result<(), Fault> {
        self.allow("leaving initialization", &[Mode::Initialization])?;
        self.start()?;
        self.mode = match self.kind {
            Kind::Stepping if !self.manners.event_mode => Mode::Running,
            _ => Mode::Event,
        };
        Ok(())
    }

    pub(crate) fn terminate(&mut self) -> Result<(), Fault> {
        self.allow("terminating", &[Mode::Event, Mode::Running, Mode::Initialization])?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    /// True if [`Core::take_reports`] has something to give.
    pub(crate) fn has_reports(&self) -> bool {
        let of_engine = match &self.engine {
            Engine::Exchange(exchange) => exchange.has_reports(),
            Engine::Stepping(steps) => steps.warnings().len() > self.told || !self.told_open && steps.leaves_open(),
            Engine::None => false,
        };
        of_engine || !self.reports.is_empty()
    }

    /// Assertions of level warning that are still to be told.
    pub(crate) fn take_reports(&mut self) -> Vec<AssertionReport> {
        match &mut self.engine {
            Engine::Exchange(exchange) => self.reports.extend(exchange.reports()),
            Engine::Stepping(steps) => {
                let warnings = steps.warnings();
                self.reports.extend(warnings.iter().skip(self.told).map(|warning| warning.report.clone()));
                self.told = warnings.len();
                if !self.told_open && steps.leaves_open() {
                    self.told_open = true;
                    let message = steps.undetermined().iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
                    self.reports.push(AssertionReport { message, error: false, file: "".into(), line: 0 });
                }
            }
            Engine::None => {}
        }
        std::mem::take(&mut self.reports)
    }
}

/// The input site of each element that is one.
fn input_sites(model: &hyd_payload::Model) -> HashMap<(usize, usize), usize> {
    let mut sites: HashMap<&str, usize> = HashMap::new();
    sites.extend(model.structure.inputs.iter().enumerate().map(|(k, site)| (&*site.name, k)));
    let mut found = HashMap::new();
    if sites.is_empty() {
        return found;
    }
    for (variable, info) in model.tables.variables.iter().enumerate() {
        for element in 0..info.sources.len() {
            if let Some(&site) = sites.get(info.name.element(element).as_str()) {
                found.insert((variable, element), site);
            }
        }
    }
    found
}

impl Known {
    /// How many values a number stands for in version 3.0.
    pub(crate) fn size(&self, reference: u32) -> Option<usize> {
        match self.catalogue.meaning(reference)? {
            Meaning::Element(variable, 0) if self.catalogue.is_array(variable) => {
                Some(self.loaded.model.tables.variables[variable].sources.len())
            }
            _ => Some(1),
        }
    }
}
