//! Values by number: reading and writing.

use std::ffi::CStr;

use hyd_fmi::Meaning;
use hyd_system::{DaeSystem, Place, Settable, Source, ValueKind, VariableInfo};

use crate::core::{Core, Engine, Known, Mode};
use crate::fault::Fault;

/// What a function of the interface reads or writes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Wanted {
    /// Real numbers.
    Real,
    /// Integers and literals of enumerations.
    Whole,
    Truth,
}

impl Wanted {
    fn suits(self, kind: &ValueKind) -> bool {
        match kind {
            ValueKind::Real => self == Wanted::Real,
            ValueKind::Integer | ValueKind::Enumeration(_) => self == Wanted::Whole,
            ValueKind::Boolean => self == Wanted::Truth,
        }
    }

    fn text(self) -> &'static str {
        match self {
            Wanted::Real => "a real number",
            Wanted::Whole => "an integer",
            Wanted::Truth => "a Boolean",
        }
    }
}

impl Core {
    /// Brings the row of outputs up to date.
    pub(crate) fn refresh(&mut self) -> Result<(), Fault> {
        match self.mode {
            Mode::Instantiated => {
                // Parameters alone are known before the start.
                if self.unstarted && !self.fresh {
                    let start = self.setup.start;
                    let bound = self.system.bind(start);
                    bound.map_err(|failure| {
                        Fault::usage(format!("the start values cannot be computed: {}", failure.reason))
                    })?;
                    self.fresh = true;
                }
                return Ok(());
            }
            Mode::Initialization => self.start()?,
            Mode::Event | Mode::Running | Mode::Terminated => {}
        }
        if self.fresh {
            return Ok(());
        }
        if self.disturbed {
            // What the inputs make of the point is asked for before the step, and they may still change.
            if let (None, Engine::Stepping(steps)) = (&self.unsettled, &self.engine) {
                self.unsettled = Some((steps.clone(), self.system.clone()));
            }
            self.take_inputs()?;
        }
        let row = &mut self.row;
        match &mut self.engine {
            Engine::Exchange(exchange) => {
                exchange.outputs(&mut self.system, row).map_err(|error| Fault::discard(&error))?;
            }
            Engine::Stepping(steps) => {
                // Nobody tries points here: what has no value is worth a message.
                let failed = |error| Fault { harmless: true, ..Fault::end(&error) };
                steps.outputs(&mut self.system, self.at, row).map_err(failed)?;
            }
            Engine::None => return Err(Fault::usage("the start has not been found")),
        }
        self.fresh = true;
        Ok(())
    }

    /// The value behind a number.
    pub(crate) fn value(&mut self, reference: u32, wanted: Wanted) -> Result<f64, Fault> {
        self.values(reference, 1, wanted).map(|values| values[0])
    }

    /// `count` values from a number on, which must be elements of one variable.
    pub(crate) fn values(&mut self, reference: u32, count: usize, wanted: Wanted) -> Result<Vec<f64>, Fault> {
        let known = self.known.clone();
        let meaning = known.catalogue.meaning(reference).ok_or_else(|| unknown(reference))?;
        let (variable, first) = match meaning {
            Meaning::Element(variable, first) => (variable, first),
            Meaning::Text(_) => return Err(Fault::usage(format!("the variable {reference} is a String"))),
            Meaning::Time => return wanted_real(wanted, reference).map(|()| vec![self.time()]),
            other => {
                wanted_real(wanted, reference)?;
                return self.of_interface(other).map(|value| vec![value]);
            }
        };
        let info = &known.loaded.model.tables.variables[variable];
        check_kind(info, first, wanted)?;
        self.refresh()?;
        let range = info.sources.get(first..first + count).ok_or_else(|| unknown(reference))?;
        let value = |(k, source): (usize, &Source)| {
            let value = match source.place {
                Place::Constant(value) => value,
                Place::Parameter(k) => self.system.parameters()[k as usize],
                Place::Output(_) if self.mode == Mode::Instantiated => {
                    let name = info.name.element(first + k);
                    let site = known.inputs.get(&(variable, first + k));
                    let line = site.and_then(|&site| self.system.line_of_input(site)).map(|(value, ..)| value);
                    return match line {
                        Some(value) => Ok(value),
                        None => Err(Fault::usage(format!("`{name}` has no value before the start"))),
                    };
                }
                Place::Output(k) => self.row[k as usize],
            };
            Ok(if source.negated { -value } else { value })
        };
        range.iter().enumerate().map(value).collect()
    }

    /// The String behind a number, which lives as long as the instance.
    pub(crate) fn text(&self, reference: u32) -> Result<&CStr, Fault> {
        match self.known.catalogue.meaning(reference) {
            Some(Meaning::Text(k)) => Ok(&self.known.texts[k]),
            Some(_) => Err(Fault::usage(format!("the variable {reference} is not a String"))),
            None => Err(unknown(reference)),
        }
    }

    /// Says why a String cannot be set.
    pub(crate) fn set_text(&self, reference: u32) -> Result<(), Fault> {
        self.text(reference)?;
        Err(Fault::usage(format!("the String {reference} cannot be set: it was fixed when the unit was made")))
    }

    /// The real numbers behind a list of numbers, of which each stands for `size` values, at a point; false where other than variables of the model
    /// is asked for, or the start has not been found, which [`Core::values`] answers.
    pub(crate) fn real_list(
        &mut self,
        references: &[u32],
        size: impl Fn(&Known, u32) -> Option<usize>,
        out: &mut [f64],
    ) -> Result<bool, Fault> {
        if self.mode == Mode::Instantiated {
            return Ok(false);
        }
        if self.asked.0 != references {
            self.asked.0.clear();
            self.asked.1.clear();
            let known = self.known.clone();
            for &reference in references {
                let Some(Meaning::Element(variable, first)) = known.catalogue.meaning(reference) else {
                    return Ok(false);
                };
                let info = &known.loaded.model.tables.variables[variable];
                let count = size(&known, reference).filter(|_| Wanted::Real.suits(&info.kind));
                let sources = count.and_then(|count| info.sources.get(first..first + count));
                let Some(sources) = sources else { return Ok(false) };
                self.asked.1.extend_from_slice(sources);
            }
            self.asked.0.extend_from_slice(references);
        }
        if self.asked.1.len() != out.len() {
            return Ok(false);
        }
        self.refresh()?;
        for (out, source) in out.iter_mut().zip(&self.asked.1) {
            let value = match source.place {
                Place::Constant(value) => value,
                Place::Parameter(k) => self.system.parameters()[k as usize],
                Place::Output(k) => self.row[k as usize],
            };
            *out = if source.negated { -value } else { value };
        }
        Ok(true)
    }

    /// The time (s).
    pub(crate) fn time(&self) -> f64 {
        match &self.engine {
            Engine::Exchange(exchange) => exchange.time(),
            _ => self.at,
        }
    }

    /// What only the interface has.
    fn of_interface(&mut self, meaning: Meaning) -> Result<f64, Fault> {
        self.refresh()?;
        let (y, yp, states) = match &self.engine {
            Engine::Exchange(exchange) => {
                let (y, yp) = exchange.point();
                (y.to_vec(), yp.to_vec(), exchange.state_unknowns().to_vec())
            }
            Engine::Stepping(steps) => {
                let (y, yp) = steps.shown();
                let mut is_state = vec![false; y.len()];
                let system: &mut dyn DaeSystem = &mut self.system;
                system.states(&mut is_state);
                let states = (0u32..).zip(&is_state).filter(|(_, state)| **state).map(|(k, _)| k).collect();
                (y.to_vec(), yp.to_vec(), states)
            }
            Engine::None => return Err(Fault::usage("the start has not been found")),
        };
        let state = |k: usize| states.get(k).copied().unwrap_or_default() as usize;
        match meaning {
            Meaning::State(k) => Ok(y[state(k)]),
            Meaning::Rate(k) => Ok(yp[state(k)]),
            Meaning::Indicator(k) => {
                let mut out = vec![0.0; self.structure().roots];
                match &mut self.engine {
                    Engine::Exchange(exchange) => {
                        exchange.indicators(&mut self.system, &mut out).map_err(|error| Fault::discard(&error))?;
                    }
                    _ => self.system.roots(self.at, &y, &yp, &mut out),
                }
                Ok(out[k])
            }
            Meaning::Time | Meaning::Element(..) | Meaning::Text(_) => Ok(self.time()),
        }
    }

    /// Sets the value behind a number: of a parameter before the start, of an input at any time.
    pub(crate) fn set(&mut self, reference: u32, offset: usize, value: f64, wanted: Wanted) -> Result<(), Fault> {
        let known = self.known.clone();
        let meaning = known.catalogue.meaning(reference).ok_or_else(|| unknown(reference))?;
        let Meaning::Element(variable, first) = meaning else {
            return Err(Fault::usage(format!("the variable {reference} cannot be set")));
        };
        let (element, info) = (first + offset, &known.loaded.model.tables.variables[variable]);
        check_kind(info, first, wanted)?;
        let name = || info.name.element(element);
        if let Some(&site) = known.inputs.get(&(variable, element)) {
            if !value.is_finite() {
                return Err(Fault { harmless: true, ..Fault::usage(format!("`{}` cannot be {value}", name())) });
            }
            // A slope that was set since the last step belongs to it, whichever of the two was set first.
            let sloped = self.sloped.get(site).copied().unwrap_or_default();
            let slope = if sloped { self.system.line_of_input(site).map_or(0.0, |(_, slope, _)| slope) } else { 0.0 };
            return self.hold(site, value, slope);
        }
        let tables = &known.loaded.model.tables;
        let start = known.starts.parameter_of.get(&variable);
        if start.is_some() && !matches!(self.mode, Mode::Instantiated | Mode::Initialization) {
            let sentence = format!("`{}` has its start value set before the start alone", name());
            return Err(Fault::usage(sentence));
        }
        // Who sets it sets what its start follows.
        let info = start.map_or(info, |&parameter| &tables.variables[parameter]);
        let source = info.sources.get(element).ok_or_else(|| unknown(reference))?;
        let (Settable::Yes, Place::Parameter(k)) = (&info.settable, source.place) else {
            let reason = match info.settable {
                Settable::Structural => "it decides sizes or structure and was fixed when the unit was made",
                _ => "it is neither a parameter that can be set nor an input",
            };
            return Err(Fault::usage(format!("`{}` cannot be set: {reason}", name())));
        };
        if !matches!(self.mode, Mode::Instantiated | Mode::Initialization) {
            return Err(Fault::usage(format!(
                "`{}` is a fixed parameter, which cannot be set after the start",
                name()
            )));
        }
        let value = if source.negated { -value } else { value };
        let set = self.system.set_parameter(k as usize, value);
        set.map_err(|_| Fault::usage(format!("`{}` cannot be {value}: it is not a value of its type", name())))?;
        (self.unstarted, self.fresh, self.parameters_set) = (true, false, true);
        Ok(())
    }

    /// Lets an input rise by a slope from its present value on.
    pub(crate) fn set_slope(&mut self, reference: u32, slope: f64) -> Result<(), Fault> {
        let site = match self.known.catalogue.meaning(reference) {
            Some(Meaning::Element(variable, element)) => {
                check_kind(&self.known.loaded.model.tables.variables[variable], element, Wanted::Real)?;
                self.known.inputs.get(&(variable, element)).copied()
            }
            _ => None,
        };
        let site = site.ok_or_else(|| Fault::usage(format!("the variable {reference} is not an input")))?;
        if !slope.is_finite() {
            return Err(Fault::usage(format!("an input cannot have the slope {slope}")));
        }
        let t = self.time();
        self.sloped[site] = true;
        let (value, old, from) = self.system.line_of_input(site).unwrap_or((0.0, 0.0, t));
        self.hold(site, value + old * (t - from), slope)
    }

    /// Lets an input follow a line through `value` from now on.
    pub(crate) fn hold(&mut self, site: usize, value: f64, slope: f64) -> Result<(), Fault> {
        let t = match self.mode {
            Mode::Instantiated | Mode::Initialization => self.setup.start,
            _ => self.time(),
        };
        let before = self.system.line_of_input(site);
        if before.is_some_and(|(old, old_slope, from)| {
            (old + old_slope * (t - from)).to_bits() == value.to_bits() && old_slope.to_bits() == slope.to_bits()
        }) {
            return Ok(());
        }
        // Events that an earlier value has caused here, when somebody looked at the point, have not happened.
        if let Some((steps, system)) = self.unsettled.take() {
            let lines = (0..self.structure().inputs.len()).map(|site| self.system.line_of_input(site));
            let lines: Vec<_> = lines.collect();
            self.told = self.told.min(steps.warnings().len());
            (self.engine, self.system) = (Engine::Stepping(steps), system);
            for (site, line) in lines.into_iter().enumerate() {
                if let Some((value, slope, from)) = line {
                    self.system.hold_input(site, value, (slope, from));
                }
            }
        }
        self.system.hold_input(site, value, (slope, t));
        self.fresh = false;
        match (&mut self.engine, self.mode) {
            (_, Mode::Instantiated | Mode::Initialization) => self.unstarted = true,
            (Engine::Exchange(exchange), _) => exchange.forget(),
            _ => self.disturbed = true,
        }
        Ok(())
    }
}

fn unknown(reference: u32) -> Fault {
    Fault::usage(format!("there is no variable with the value reference {reference}"))
}

fn wanted_real(wanted: Wanted, reference: u32) -> Result<(), Fault> {
    match wanted {
        Wanted::Real => Ok(()),
        _ => Err(Fault::usage(format!("the variable {reference} is not {}", wanted.text()))),
    }
}

fn check_kind(info: &VariableInfo, element: usize, wanted: Wanted) -> Result<(), Fault> {
    match wanted.suits(&info.kind) {
        true => Ok(()),
        false => Err(Fault::usage(format!("`{}` is not {}", info.name.element(element), wanted.text()))),
    }
}
