//! `hyd linearize FILE --at T`: the linear model at a point of a run, as JSON, MAT, or a table of its eigenvalues.

use std::io;
use std::path::Path;
use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel, Goal, Instance};
use hyd_flat::{BlockId, FlatModel};
use hyd_results::{Matrices, RowKind, Sink, write_whole};
use hyd_run::parameters::varied;
use hyd_run::{DONE_AGAIN, WHOLE_LOOPS, check_target};
use hyd_runtime::{LinearModel, OperatingPoint, Options, SolveError, linearize as linear_model, simulate};
use hyd_system::math::hypot;
use hyd_system::{DaeSystem, Source, Tables, significant};
use serde_json::json;

use crate::arguments::Linearize;
use crate::translate::{self, translate, with_whole_loops};
use crate::{Failure, output, parameters, run_failure};

/// Runs the verb.
pub(crate) fn linearize(arguments: &Linearize) -> Result<(), Failure> {
    let format = Format::of(arguments.result.as_deref())?;
    if let Some(path) = &arguments.result {
        check_target("--result", path, &[&arguments.model.file])?;
    }
    let compilation = translate(&arguments.model, Goal::Run)?;
    let model = compilation.model.clone();
    let mut model = model.ok_or_else(|| Failure::Fault("the translation gave no code".to_string()))?;
    let input_names = named_or(&arguments.input, compilation.flat.as_deref(), |flat| &flat.inputs);
    let output_names = named_or(&arguments.output, compilation.flat.as_deref(), |flat| &flat.outputs);
    let (mut system, options) = ready(arguments, &compilation, &model)?;
    let found = |system: &Instance| -> Result<_, Failure> {
        Ok((inputs(system.tables(), &input_names)?, outputs(system.tables(), &output_names)?))
    };
    let (mut inputs, mut outputs) = found(&system)?;
    let mut last = LastRow::default();
    let mut ran = simulate(&mut system, &options, &mut last, &|| false);
    if ran.as_ref().is_err_and(SolveError::may_be_rounding)
        && let Some(whole) = with_whole_loops(&compilation, &arguments.model.set)
    {
        let (mut other, options) = ready(arguments, &compilation, &whole)?;
        let again = simulate(&mut other, &options, &mut last, &|| false);
        if again.is_ok() {
            let sentence = format!("{WHOLE_LOOPS}; the run was {DONE_AGAIN}");
            output::sentence("warning", &sentence, arguments.model.message_format);
            (inputs, outputs) = found(&other)?;
            (ran, system, model) = (again, other, whole);
        }
    }
    let reached = ran.map_err(|error: SolveError| {
        let diagnostic = run_failure::diagnostic(&error, &compilation.files, compilation.flat.as_deref(), None);
        translate::report(&compilation.files, &[diagnostic], arguments.model.message_format);
        Failure::SolverReported
    })?;
    if let Some(message) = &reached.terminated {
        let at = reached.time;
        return Err(Failure::Fault(format!(
            "the model ends the run at t = {at} s, before the time asked for: {message}"
        )));
    }
    let (y, yp) = model.payload().row.point(&last.values);
    let point = OperatingPoint { t: arguments.at, y: &y, yp: &yp };
    let places: Vec<u32> = inputs.iter().map(|&(place, _)| place).collect();
    let sources: Vec<Source> = outputs.iter().map(|(_, source)| *source).collect();
    let mut linear = linear_model(&mut system, point, &places, &sources)
        .map_err(|error| Failure::Fault(format!("there is no linear model at t = {} s: {error}", arguments.at)))?;
    // A parameter may be the negative of what stands at its place.
    for (j, &(_, sign)) in inputs.iter().enumerate() {
        linear.b.iter_mut().chain(&mut linear.d).for_each(|row| row[j] *= sign);
    }
    let tables = system.tables().clone();
    let names = Found {
        model: tables.model.to_string(),
        time: arguments.at,
        states: linear.states.iter().map(|&k| tables.unknown_name(k as usize)).collect(),
        inputs: input_names,
        outputs: outputs.iter().map(|(name, _)| name.clone()).collect(),
        x: linear.states.iter().map(|&k| y[k as usize]).collect(),
        u: inputs.iter().map(|&(place, sign)| sign * system.parameters()[place as usize]).collect(),
        y: sources.iter().map(|source| last.value(*source, system.parameters())).collect(),
        linear,
    };
    names.write(format, arguments)
}

/// A system with its parameters set, and the times of its run.
fn ready(
    arguments: &Linearize,
    compilation: &Compilation,
    model: &CompiledModel,
) -> Result<(Instance, Options), Failure> {
    let mut system = model.instantiate();
    parameters::apply(&mut system, &arguments.model.set, &compilation.set_at_translation).map_err(Failure::Fault)?;
    let experiment = &model.payload().experiment;
    let start = experiment.start.unwrap_or(0.0);
    let mut options = Options::new(start, arguments.at);
    options.tolerance = arguments.tolerance.or(experiment.tolerance).unwrap_or(options.tolerance);
    options.intervals = 1;
    options.check().map_err(|error| Failure::Usage(error.to_string()))?;
    Ok((system, options))
}

/// How the linear model is written.
#[derive(Clone, Copy)]
enum Format {
    Text,
    Json,
    Mat,
}

impl Format {
    fn of(path: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(Format::Text) };
        match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("json") => Ok(Format::Json),
            Some("mat") => Ok(Format::Mat),
            _ => Err(Failure::Usage(format!(
                "--result `{}`: a linear model is written as .json or .mat",
                path.display()
            ))),
        }
    }
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
        hyd_results::Column { name: String::new(), source }.value(&self.values, parameters)
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
struct Found {
    model: String,
    time: f64,
    states: Vec<String>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    x: Vec<f64>,
    u: Vec<f64>,
    y: Vec<f64>,
    linear: LinearModel,
}

impl Found {
    fn write(&self, format: Format, arguments: &Linearize) -> Result<(), Failure> {
        let bytes = match format {
            Format::Text => Vec::new(),
            Format::Json => self.json().into_bytes(),
            Format::Mat => self.mat(),
        };
        if let Some(path) = &arguments.result {
            let failed = |error: io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
            write_whole(path, &bytes).map_err(failed)?;
        }
        output::print(&if arguments.json { self.json() } else { self.text(arguments.result.as_deref()) })
    }

    fn json(&self) -> String {
        let LinearModel { a, b, c, d, eigenvalues, .. } = &self.linear;
        let eigenvalues: Vec<[f64; 2]> = eigenvalues.iter().map(|&(re, im)| [re, im]).collect();
        let object = json!({"model": self.model, "time": self.time, "states": self.states, "inputs": self.inputs,
            "outputs": self.outputs, "x": self.x, "u": self.u, "y": self.y, "A": a, "B": b, "C": c, "D": d,
            "eigenvalues": eigenvalues});
        format!("{object}\n")
    }

    fn mat(&self) -> Vec<u8> {
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

    fn text(&self, path: Option<&Path>) -> String {
        let (x, u, y) = (self.states.len(), self.inputs.len(), self.outputs.len());
        let mut text = format!("{} at {} s: {x} states, {u} inputs, {y} outputs\n", self.model, self.time);
        if let Some(path) = path {
            text.push_str(&format!("  linear model in {}\n", path.display()));
        }
        text.push_str("\neigenvalues (1/s), frequency (Hz), damping ratio\n");
        for &(re, im) in &self.linear.eigenvalues {
            // Of a pair one line is enough.
            if im < 0.0 {
                continue;
            }
            let size = hypot(re, im);
            let line = match im > 0.0 {
                true => format!(
                    "  {} +- {}i   {}   {}\n",
                    significant(re),
                    significant(im),
                    significant(size / (2.0 * std::f64::consts::PI)),
                    significant(-re / size)
                ),
                false => format!("  {}\n", significant(re)),
            };
            text.push_str(&line);
        }
        text
    }
}
