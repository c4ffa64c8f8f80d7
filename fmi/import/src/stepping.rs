//! A unit for co-simulation: it brings its own solver, and is asked for one step after the other.
//!
//! Inputs get their values at the begin of a step, with their slopes where the unit can use them; otherwise they are held over it.  Rows
//! of results are those of communication points.  Source: Functional Mock-up Interface 3.0.2, section 4; 2.0.4, section 4.

use std::io;
use std::sync::Arc;

use hyd_results::{RowKind, Sink};
use hyd_system::{
    AssertionReport, InputError, InputSite, Instants, ParameterError, Pattern, Place, Series, Source, Tables,
};

use crate::archive::Unit;
use crate::driver::{Driver, tool};
use crate::fault::Fault;
use crate::followers::Follower;
use crate::host::{Counts, Host};
use crate::protocol::{Operation, values_of};

/// A run of a unit that does not accept steps of different length may miss its end by this part of a step.
const WHOLE: f64 = 1e-6;

/// Times and steps of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct StepOptions {
    /// Start (s).
    pub start: f64,
    /// Stop (s).
    pub stop: f64,
    /// Distance of communication points (s).
    pub step: f64,
    /// Relative tolerance, for the unit's own solver.
    pub tolerance: f64,
}

/// How a run ended.
#[derive(Debug)]
pub enum StepRun {
    /// At its stop.
    Done,
    /// By the unit.
    Terminated,
    /// It was stopped.
    Interrupted,
    /// The unit failed.
    Failed(Fault),
    /// A row cannot be written.
    Sink(io::Error),
}

/// A unit for co-simulation.
pub struct Stepping {
    driver: Driver,
    row: Vec<f64>,
    slopes: Vec<f64>,
    variable_step: bool,
    /// Time reached (s), and steps done.
    pub time: f64,
    /// Steps done.
    pub steps: u64,
    /// What the unit said in the last run, and when (s).
    pub said: Vec<(f64, AssertionReport)>,
}

impl Stepping {
    /// Begins the process of a unit.  `driven`: names of inputs that follow recorded samples.
    ///
    /// # Errors
    /// A sentence: the unit is not for co-simulation, or cannot be loaded.
    pub fn new(unit: &Unit, host: &Host, driven: &[String]) -> Result<Self, Fault> {
        let description = &unit.description;
        let none = || Fault::of(&unit.file, "the unit is not for co-simulation");
        let interface = description.stepping.as_ref().ok_or_else(none)?;
        if interface.needs_tool {
            return Err(Fault::of(
                &unit.file,
                format!("the unit needs the program that made it, {}", tool(description)),
            ));
        }
        let driver = Driver::new(unit, host, driven, (interface, false), (&Pattern::dense(0, 0), None))?;
        Ok(Self {
            row: vec![0.0; values_of(&driver.layout.outputs)],
            slopes: vec![0.0; driver.continuous],
            variable_step: interface.variable_step,
            time: 0.0,
            steps: 0,
            said: Vec::new(),
            driver,
        })
    }

    /// Names and places.
    pub fn tables(&self) -> &Arc<Tables> {
        &self.driver.layout.tables
    }

    /// Inputs that follow samples.
    pub fn inputs(&self) -> &[InputSite] {
        &self.driver.layout.sites
    }

    /// Sets a parameter for the following run.
    ///
    /// # Errors
    /// Why it cannot be set.
    pub fn set_parameter(&mut self, index: usize, value: f64) -> Result<(), ParameterError> {
        self.driver.set_parameter(index, value)
    }

    /// Sets a parameter of type String; none where the unit has none of that name.
    pub fn set_text(&mut self, name: &str, text: &str) -> Option<()> {
        self.driver.set_text(name, text)
    }

    /// Lets the following runs begin with this value of a state; none where the unit has no state of that name, or finds its start by itself.
    pub fn begin_with(&mut self, name: &str, value: f64) -> Option<()> {
        self.driver.start_of(name).map(|position| self.driver.set_start(position, value))
    }

    /// The first parameter that was set to a value outside its limits, as a sentence.
    pub fn outside(&self) -> Option<String> {
        self.driver.outside()
    }

    /// Lets an input follow samples.
    ///
    /// # Errors
    /// Why it cannot.
    pub fn set_input(&mut self, input: usize, series: &Arc<Series>) -> Result<(), InputError> {
        self.driver.follow(input, series)
    }

    /// What the unit has been asked.
    pub fn counts(&self) -> Counts {
        self.driver.remote.counts()
    }

    /// Sentences on what no use is made of.
    pub fn notes(&self) -> &[String] {
        &self.driver.layout.notes
    }

    /// The number of steps of a run.
    ///
    /// # Errors
    /// A sentence: the unit takes steps of one length alone, and the run is not a multiple of them.
    pub fn count(&self, options: &StepOptions) -> Result<u64, String> {
        let StepOptions { start, stop, step, .. } = *options;
        let parts = (stop - start) / step;
        let whole = parts.round();
        if (parts - whole).abs() <= WHOLE {
            return Ok(whole as u64);
        }
        match self.variable_step {
            true => Ok(parts.ceil() as u64),
            false => Err(format!(
                "the unit takes steps of one length alone, and {} s is not a multiple of {step} s",
                stop - start
            )),
        }
    }

    /// Runs the unit and hands rows to the sink: that of the start, and one for every so many steps.  `stop` is asked after every
    /// step; true ends the run.
    pub fn run(
        &mut self,
        options: &StepOptions,
        (count, every): (u64, u64),
        sink: &mut dyn Sink,
        stop: &dyn Fn() -> bool,
    ) -> StepRun {
        match self.go(options, (count, every), sink, stop) {
            Ok(ended) => ended,
            Err(failed) => failed,
        }
    }

    fn go(
        &mut self,
        options: &StepOptions,
        (count, every): (u64, u64),
        sink: &mut dyn Sink,
        stop: &dyn Fn() -> bool,
    ) -> Result<StepRun, StepRun> {
        let StepOptions { start, stop: end, step, tolerance } = *options;
        (self.time, self.steps) = (start, 0);
        self.said.clear();
        (self.driver.tolerance, self.driver.stop) = (tolerance, end);
        let instants = Instants::of_run(start);
        let name = self.driver.layout.tables.model.clone();
        let beginning = self.driver.beginning(start);
        let beginning = beginning.map_err(|reason| StepRun::Failed(Fault::of(&name, reason)))?;
        let asked = self.driver.remote.ask(Operation::Start, |writer| beginning.write(writer)).map(|_| ());
        asked.and_then(|()| self.driver.read_parameters()).map_err(|_| self.failed())?;
        sink.begin(&self.driver.layout.tables, &self.driver.parameters).map_err(StepRun::Sink)?;
        self.row(sink)?;
        self.listen();
        for k in 0..count {
            if stop() {
                return Ok(StepRun::Interrupted);
            }
            // Points are multiples of the step, so that rounding does not add up.
            let (t, next) = (self.time, if k + 1 == count { end } else { start + (k + 1) as f64 * step });
            for follower in &mut self.driver.layout.followers {
                Follower::pass(follower, t, instants);
            }
            let terminated = self.step(t, next)?;
            self.steps += 1;
            self.listen();
            if terminated || k + 1 == count || (k + 1).is_multiple_of(every) {
                self.row(sink)?;
            }
            if terminated {
                return Ok(StepRun::Terminated);
            }
        }
        Ok(StepRun::Done)
    }

    /// Takes what the unit has said.
    fn listen(&mut self) {
        let time = self.time;
        self.said.extend(self.driver.reports().into_iter().map(|report| (time, report)));
    }

    /// One step; true if the unit ends the run.
    fn step(&mut self, t: f64, next: f64) -> Result<bool, StepRun> {
        let driver = &mut self.driver;
        for (k, follower) in driver.layout.followers.iter_mut().enumerate() {
            let sample = follower.at(t);
            driver.input_values[k] = sample.value;
            if let Some(slope) = self.slopes.get_mut(k) {
                *slope = sample.slope;
            }
        }
        let (inputs, slopes) = (&driver.input_values, &self.slopes);
        let asked = driver.remote.ask(Operation::Step, |writer| {
            writer.real(t);
            writer.real(next - t);
            writer.reals(inputs);
            writer.reals(slopes);
        });
        let ended = asked.map(|mut reader| (reader.real(), reader.number() != 0));
        let (reached, terminated) = ended.map_err(|_| self.failed())?;
        self.time = if terminated { reached.clamp(t, next) } else { next };
        Ok(terminated)
    }

    fn row(&mut self, sink: &mut dyn Sink) -> Result<(), StepRun> {
        if !self.row.is_empty() {
            let asked =
                self.driver.remote.ask(Operation::Outputs, |_| {}).map(|mut reader| reader.reals(&mut self.row));
            asked.map_err(|_| self.failed())?;
            self.check_row()?;
        }
        sink.row(self.time, &self.row, RowKind::Normal).map_err(StepRun::Sink)
    }

    /// Values that are not finite are no result, whatever status the unit gave with them.
    fn check_row(&self) -> Result<(), StepRun> {
        let Some(bad) = self.row.iter().position(|value| !value.is_finite()) else { return Ok(()) };
        let tables = &self.driver.layout.tables;
        let name = tables.variables.iter().find_map(|info| {
            let is_bad = |source: &Source| matches!(source.place, Place::Output(k) if k as usize == bad);
            info.sources.iter().position(is_bad).map(|element| info.name.element(element))
        });
        let (name, value) = (name.unwrap_or_default(), self.row[bad]);
        let sentence = format!("`{name}` is {value} at t = {} s", self.time);
        Err(StepRun::Failed(Fault::of(&tables.model, sentence)))
    }

    fn failed(&self) -> StepRun {
        StepRun::Failed(self.driver.remote.why())
    }
}
