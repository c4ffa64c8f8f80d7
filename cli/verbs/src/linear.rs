//! The linear model at a point of a run, with its names, as data, JSON and MAT file.

use std::io;
use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel, Instance, Severity};
use hyd_flat::{BlockId, FlatModel};
use hyd_results::{Column, Matrices, RowKind, Sink};
use hyd_run::parameters::{self, varied};
use hyd_run::{DONE_AGAIN, Failure, WHOLE_LOOPS};
use hyd_runtime::{LinearModel, OperatingPoint, Options, SolveError, linearize as linear_model, simulate};
use hyd_system::{DaeSystem, Source, Tables};
use serde_json::json;

use crate::translate::with_whole_loops;
use crate::{Listener, run_failure};

/// Which linear model is wanted.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Time (s).
    pub at: f64,
    /// Parameters that are its inputs; none: the inputs of the model.
    pub inputs: Vec<String>,
    /// Variables that are its outputs; none: the outputs of the model.
    pub outputs: Vec<String>,
    /// Relative tolerance of the run to the point; none: as the model says, else 1e-6.
    pub tolerance: Option<f64>,
}

/// The linear model of a translated model at a point; `set`: all parameters that are set.  `stop` is asked after every step.
///
/// # Errors
/// Names that are not known, a run that does not come to the point, a point without a linear model.
pub fn linearize(
    compilation: &Compilation,
    set: &[(String, String)],
    point: &Point,
    listener: &dyn Listener,
    stop: &dyn Fn() -> bool,
) -> Result<Linear, Failure> {
    let model = compilation.model.clone();
    let mut model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let input_names = named_or(&point.inputs, compilation.flat.as_deref(), |flat| &flat.inputs);
    let output_names = named_or(&point.outputs, compilation.flat.as_deref(), |flat| &flat.outputs);
    let (mut system, options) = ready(point, set, compilation, &model)?;
    let found = |system: &Instance| -> Result<_, Failure> {
        Ok((inputs(system.tables(), &input_names)?, outputs(system.tables(), &output_names)?))
    };
    let (mut inputs, mut outputs) = found(&system)?;
    let mut last = LastRow::default();
    let mut ran = simulate(&mut system, &options, &mut last, stop);
    if ran.as_ref().is_err_and(SolveError::may_be_of_loops)
        && let Some(whole) = with_whole_loops(compilation, set)
    {
        let (mut other, options) = ready(point, set, compilation, &whole)?;
        let again = simulate(&mut other, &options, &mut last, stop);
        if again.is_ok() {
            let sentence = format!("{WHOLE_LOOPS}; the run was {DONE_AGAIN}");
            listener.sentence(Severity::Warning, &sentence);
            (inputs, outputs) = found(&other)?;
            (ran, system, model) = (again, other, whole);
        }
    }
    let reached = ran.map_err(|error: SolveError| {
        if matches!(error, SolveError::Interrupted { .. }) {
            return Failure::Solver(error.to_string());
        }
        let diagnostic = run_failure::diagnostic(&error, &compilation.files, compilation.flat.as_deref(), None);
        listener.diagnostics(&compilation.files, &[diagnostic]);
        Failure::SolverReported
    })?;
    if let Some(message) = &reached.terminated {
        let at = reached.time;
        return Err(Failure::Fault(format!(
            "the model ends the run at t = {at} s, before the time asked for: {message}"
        )));
    }
    let (y, yp) = model.payload().row.point(&last.values);
    let place = OperatingPoint { t: point.at, y: &y, yp: &yp };
    let places: Vec<u32> = inputs.iter().map(|&(place, _)| place).collect();
    let sources: Vec<Source> = outputs.iter().map(|(_, source)| *source).collect();
    let mut linear = linear_model(&mut system, place, &places, &sources)
        .map_err(|error| Failure::Fault(format!("there is no linear model at t = {} s: {error}", point.at)))?;
    // A parameter may be the negative of what stands at its place.
    for (j, &(_, sign)) in inputs.iter().enumerate() {
        linear.b.iter_mut().chain(&mut linear.d).for_each(|row| row[j] *= sign);
    }
    let tables = system.tables().clone();
    Ok(Linear {
        model: tables.model.to_string(),
        time: point.at,
        states: linear.states.iter().map(|&k| tables.unknown_name(k as usize)).collect(),
        inputs: input_names,
        outputs: outputs.iter().map(|(name, _)| name.clone()).collect(),
        x: linear.states.iter().map(|&k| y[k as usize]).collect(),
        u: inputs.iter().map(|&(place, sign)| sign * system.parameters()[place as usize]).collect(),
        y: sources.iter().map(|source| last.value(*source, system.parameters())).collect(),
        linear,
    })
}

/// A system with its parameters set, and the times of its run.
fn ready(
    point: &Point,
    set: &[(String, String)],
    compilation: &Compilation,
    model: &CompiledModel,
) -> Result<(Instance, Options), Failure> {
    let mut system = model.instantiate();
    parameters::apply(&mut system, set, &compilation.set_at_translation).map_err(Failure::Fault)?;
    let experiment = &model.payload().experiment;
    let start = experiment.start.unwrap_or(0.0);
    let mut options = Options::new(start, point.at);
    options.tolerance = point.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
    options.intervals = 1;
    options.check().map_err(|error| Failure::Usage(error.to_string()))?;
    Ok((system, options))
}

/// The names the user gave, or those of the model's own inputs or outputs.
fn named_or(names: &[String], flat: Option<&FlatModel>, ends: fn(&FlatModel) -> &[BlockId]) -> Vec<String> {
    let Some(flat) = flat.filter(|_| names.is_empty()) else { return names.to_vec() };
    let blocks = ends(flat).iter().map(|&block| &flat.variables[block].name);
    blocks.flat_map(|name| (0..name.count()).map(|k| name.element(k))).collect()
}

/// Positions of inputs among the parameters, with their signs.
fn inputs(tables: &Tables, names: &[String]) -> Result<Vec<(u32, f64)>, Failure> {
    let one = |name: &String| {
        let (_, places) = varied(tables, name)
            .map_err(|why| Failure::Fault(why.replace("cannot be varied", "cannot be an input")))?;
        match places.as_slice() {
            &[(place, sign)] => Ok((place as u32, sign)),
            _ => Err(Failure::Usage(format!("--input `{name}` is an array; name its elements"))),
        }
    };
    names.iter().map(one).collect()
}

/// Outputs with their sources.
fn outputs(tables: &Tables, names: &[String]) -> Result<Vec<(String, Source)>, Failure> {
    let one = |name: &String| {
        let found = tables.find(name).map(|(variable, element)| variable.sources[element]);
        let source = found.ok_or_else(|| Failure::Fault(format!("the model has no variable `{name}`")))?;
        Ok((name.clone(), source))
    };
    names.iter().map(one).collect()
}

/// Keeps the last row of a run.
#[derive(Default)]
struct LastRow {
    values: Vec<f64>,
}

impl LastRow {
    fn value(&self, source: Source, parameters: &[f64]) -> f64 {
        Column { name: String::new(), source }.value(&self.values, parameters)
    }
}

impl Sink for LastRow {
    fn begin(&mut self, _tables: &Arc<Tables>, _parameters: &[f64]) -> io::Result<()> {
        Ok(())
    }

    fn row(&mut self, _t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        self.values.clear();
        self.values.extend_from_slice(values);
        Ok(())
    }
}

/// A linear model with names and values of the point.
#[derive(Clone, Debug)]
pub struct Linear {
    /// Name of the model.
    pub model: String,
    /// Time of the point (s).
    pub time: f64,
    /// Names of the states.
    pub states: Vec<String>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// States at the point.
    pub x: Vec<f64>,
    /// Inputs at the point.
    pub u: Vec<f64>,
    /// Outputs at the point.
    pub y: Vec<f64>,
    /// Matrices and eigenvalues.
    pub linear: LinearModel,
}

impl Linear {
    /// One line of JSON.
    pub fn json(&self) -> String {
        let LinearModel { a, b, c, d, eigenvalues, .. } = &self.linear;
        let eigenvalues: Vec<[f64; 2]> = eigenvalues.iter().map(|&(re, im)| [re, im]).collect();
        let object = json!({"model": self.model, "time": self.time, "states": self.states, "inputs": self.inputs,
            "outputs": self.outputs, "x": self.x, "u": self.u, "y": self.y, "A": a, "B": b, "C": c, "D": d,
            "eigenvalues": eigenvalues});
        format!("{object}\n")
    }

    /// A MAT file.
    pub fn mat(&self) -> Vec<u8> {
        let (x, u) = (self.states.len(), self.inputs.len());
        let column = |values: &[f64]| values.iter().map(|&value| vec![value]).collect::<Vec<_>>();
        let eigenvalues: Vec<Vec<f64>> = self.linear.eigenvalues.iter().map(|&(re, im)| vec![re, im]).collect();
        let mut file = Matrices::new();
        for (name, rows, columns) in [
            ("A", &self.linear.a, x),
            ("B", &self.linear.b, u),
            ("C", &self.linear.c, x),
            ("D", &self.linear.d, u),
            ("x", &column(&self.x), 1),
            ("u", &column(&self.u), 1),
            ("y", &column(&self.y), 1),
            ("eigenvalues", &eigenvalues, 2),
            ("time", &vec![vec![self.time]], 1),
        ] {
            file.matrix(name, rows, columns);
        }
        for (name, texts) in [("xName", &self.states), ("uName", &self.inputs), ("yName", &self.outputs)] {
            file.names(name, texts);
        }
        file.bytes().to_vec()
    }
}
