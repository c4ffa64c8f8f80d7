//! What `hyd simulate` says at the end, for people and as JSON.

use std::fmt::Write as _;

use crate::run_profile::RunProfile;
use hyd_runtime::{MethodPhase, Statistics};
use hyd_system::significant;
use serde::ser::{Serialize, SerializeMap, Serializer};

/// Counters of the solver.
#[derive(serde::Serialize, Clone, Copy, PartialEq, Debug)]
pub struct Counters {
    steps: u64,
    steps_by_order: [u64; 5],
    one_step_steps: u64,
    residuals: u64,
    jacobians: u64,
    factorisations: u64,
    newton_iterations: u64,
    error_rejections: u64,
    convergence_failures: u64,
    state_events: u64,
    time_events: u64,
}

impl Counters {
    /// Events of both kinds.
    pub fn events(&self) -> u64 {
        self.state_events + self.time_events
    }
}

impl From<&Statistics> for Counters {
    fn from(s: &Statistics) -> Self {
        Self {
            steps: s.steps,
            steps_by_order: s.steps_by_order,
            one_step_steps: s.one_step_steps,
            residuals: s.residuals,
            jacobians: s.jacobians,
            factorisations: s.factorisations,
            newton_iterations: s.newton_iterations,
            error_rejections: s.error_rejections,
            convergence_failures: s.convergence_failures,
            state_events: s.state_events,
            time_events: s.time_events,
        }
    }
}

/// A method from a time on, and why.
#[derive(serde::Serialize, Clone, PartialEq, Debug)]
pub struct MethodUse {
    from: f64,
    method: &'static str,
    reason: String,
}

impl From<&MethodPhase> for MethodUse {
    fn from(phase: &MethodPhase) -> Self {
        Self { from: phase.from, method: phase.method.name(), reason: phase.reason.to_string() }
    }
}

/// What is said of a model that is a unit of another tool.
#[derive(serde::Serialize, Clone, PartialEq, Debug)]
pub struct UnitUse {
    /// Its file.
    pub file: String,
    /// Version of the interface.
    pub version: &'static str,
    /// The program that made it, `""` if it does not say.
    pub tool: String,
    /// `model-exchange` or `co-simulation`.
    pub kind: &'static str,
    /// Distance of communication points (s), in co-simulation.
    pub step: Option<f64>,
    /// It runs in a process of its own, as all code of others does.
    pub own_process: bool,
    /// Questions to it.
    pub calls: u64,
}

/// How a run ended.
#[derive(serde::Serialize, Clone, Copy, PartialEq, Eq, Debug)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// At the stop time.
    Done,
    /// By `terminate` in the model.
    Terminated,
    /// By Ctrl-C.
    Interrupted,
    /// The solver gave up, or an assertion failed.
    Failed,
}

/// Names, values and units of a few variables at the end.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct FinalValues(pub Vec<(String, f64, String)>);

impl Serialize for FinalValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value, _) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// Changes of method that the text shows.
const MOST_CHANGES: usize = 4;

/// The summary of a run; the fields are those of the JSON object.  Times in s, `translate_s` and `simulate_s` CPU seconds.
#[derive(serde::Serialize, Clone, PartialEq, Debug)]
pub struct RunSummary {
    /// How the run ended.
    pub status: Status,
    /// Why the run ended, unless at its stop time.
    pub message: Option<String>,
    /// Name of the model.
    pub model: String,
    /// The model is a unit of another tool.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitUse>,
    /// Start time.
    pub start: f64,
    /// Stop time asked for.
    pub stop: f64,
    /// Time reached.
    pub time: f64,
    /// Relative tolerance.
    pub tolerance: f64,
    /// Method asked for.
    pub solver: &'static str,
    /// Methods used from when on.
    pub methods: Vec<MethodUse>,
    /// Number of states.
    pub states: usize,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Different expressions, 0 where that is not known.
    pub templates: usize,
    /// Bytes of machine code, 0 when interpreted.
    pub code_bytes: usize,
    /// Until the system was ready.
    pub translate_s: f64,
    /// For the run.
    pub simulate_s: f64,
    /// Counters of the solver.
    pub counters: Counters,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Where loops of equations went over to another of their solutions.
    pub jumps: Vec<String>,
    /// File of results.
    pub result: Option<String>,
    /// Picture.
    pub plot: Option<String>,
    /// The warning that was told with its place in the text already.
    #[serde(skip)]
    pub told: Option<String>,
    /// Page of its profile.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile_page: Option<String>,
    /// Where its time went, if that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<RunProfile>,
    /// A few variables at the end.
    #[serde(rename = "final")]
    pub final_values: FinalValues,
    /// How many more there are.
    #[serde(skip)]
    pub left_out: usize,
}

impl RunSummary {
    /// One line of JSON.
    pub fn json(&self) -> String {
        let text = serde_json::to_string(self);
        text.expect("invariant: plain data with text keys has a JSON form") + "\n"
    }

    /// A few lines for people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_text(&mut text);
        text
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        let ended = match self.status {
            Status::Done => "done",
            Status::Terminated => "terminated by the model",
            Status::Interrupted => "interrupted",
            Status::Failed => "failed",
        };
        writeln!(out, "{}: {} to {} s, {ended}", self.model, self.start, self.time)?;
        if let (Status::Terminated, Some(message)) = (self.status, &self.message) {
            writeln!(out, "  {message}")?;
        }
        let c = &self.counters;
        match &self.unit {
            Some(unit) => Self::write_unit(unit, self.states, out)?,
            None => writeln!(
                out,
                "  {} states, {} unknowns; {} templates, {} bytes of code",
                self.states, self.unknowns, self.templates, self.code_bytes
            )?,
        }
        if let Some(step) = self.unit.as_ref().and_then(|unit| unit.step) {
            writeln!(out, "  {} steps of {} s", c.steps, significant(step))?;
            return self.write_end(out);
        }
        writeln!(
            out,
            "  {} steps ({} rejected, {} not converged), {} residuals, {} Jacobians, {} factorisations",
            c.steps, c.error_rejections, c.convergence_failures, c.residuals, c.jacobians, c.factorisations
        )?;
        writeln!(out, "  {} state events, {} time events", c.state_events, c.time_events)?;
        self.write_methods(out)?;
        self.write_end(out)
    }

    fn write_unit(unit: &UnitUse, states: usize, out: &mut String) -> std::fmt::Result {
        let tool = if unit.tool.is_empty() { String::new() } else { format!(" by {}", unit.tool) };
        let kind =
            if unit.step.is_some() { "co-simulation".to_string() } else { format!("model exchange, {states} states") };
        let place = if unit.own_process { " of its process" } else { "" };
        writeln!(out, "  unit of FMI {}{tool}; {kind}; {} calls{place}", unit.version, unit.calls)
    }

    /// Times, files and values.
    fn write_end(&self, out: &mut String) -> std::fmt::Result {
        let (translated, simulated) = (duration(self.translate_s), duration(self.simulate_s));
        let made = if self.unit.is_some() { "loaded" } else { "translated" };
        writeln!(out, "  {made} in {translated}, simulated in {simulated} of CPU time")?;
        for (what, path) in [("results", &self.result), ("picture", &self.plot), ("profile", &self.profile_page)] {
            if let Some(path) = path {
                writeln!(out, "  {what} in {path}")?;
            }
        }
        self.write_values(out)?;
        self.profile.as_ref().map_or(Ok(()), |profile| out.write_str(&profile.text()))
    }

    /// The methods by number of steps, and the first changes with their reasons.
    fn write_methods(&self, out: &mut String) -> std::fmt::Result {
        let one_step = self.counters.one_step_steps;
        if one_step == 0 && self.methods.len() < 2 {
            return Ok(());
        }
        writeln!(
            out,
            "  method {}: {} steps of bdf, {one_step} of esdirk",
            self.solver,
            self.counters.steps - one_step
        )?;
        for change in self.methods.iter().skip(1).take(MOST_CHANGES) {
            writeln!(out, "    from {} s {}: {}", significant(change.from), change.method, change.reason)?;
        }
        match self.methods.len().saturating_sub(1 + MOST_CHANGES) {
            0 => Ok(()),
            more => writeln!(out, "    and {more} more changes"),
        }
    }

    fn write_values(&self, out: &mut String) -> std::fmt::Result {
        let values = &self.final_values.0;
        if values.is_empty() {
            return Ok(());
        }
        writeln!(out, "\nvalues at {} s", self.time)?;
        let width = values.iter().map(|(name, ..)| name.chars().count()).max().unwrap_or(0);
        for (name, value, unit) in values {
            let line = format!("  {name:<width$}  {:>14} {unit}", significant(*value));
            writeln!(out, "{}", line.trim_end())?;
        }
        match self.left_out {
            0 => Ok(()),
            more => writeln!(out, "  ... and {more} more; `--variables REGEX` chooses"),
        }
    }
}

fn duration(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}
