//! `hyd linearize FILE --at T`: the linear model at a point of a run, as JSON, MAT, or a table of its eigenvalues.

use std::io;
use std::path::Path;

use hyd_compiler::Goal;
use hyd_results::write_whole;
use hyd_run::check_target;
use hyd_system::math::hypot;
use hyd_system::significant;
use hyd_verbs::linear::{Linear, Point, linearize as linear};

use crate::arguments::Linearize;
use crate::terminal::Terminal;
use crate::translate::translate;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn linearize(arguments: &Linearize) -> Result<(), Failure> {
    let format = Format::of(arguments.result.as_deref())?;
    if let Some(path) = &arguments.result {
        check_target("--result", path, &[&arguments.model.file])?;
    }
    let compilation = translate(&arguments.model, Goal::Run)?;
    let point = Point {
        at: arguments.at,
        inputs: arguments.input.clone(),
        outputs: arguments.output.clone(),
        tolerance: arguments.tolerance,
    };
    let found =
        linear(&compilation, &arguments.model.set, &point, &Terminal(arguments.model.message_format), &|| false)?;
    write(&found, format, arguments)
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

/// Writes the file that is asked for, and prints.
fn write(found: &Linear, format: Format, arguments: &Linearize) -> Result<(), Failure> {
    let bytes = match format {
        Format::Text => Vec::new(),
        Format::Json => found.json().into_bytes(),
        Format::Mat => found.mat(),
    };
    if let Some(path) = &arguments.result {
        let failed = |error: io::Error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
        write_whole(path, &bytes).map_err(failed)?;
    }
    output::print(&if arguments.json { found.json() } else { text(found, arguments.result.as_deref()) })
}

fn text(found: &Linear, path: Option<&Path>) -> String {
    let (x, u, y) = (found.states.len(), found.inputs.len(), found.outputs.len());
    let mut text = format!("{} at {} s: {x} states, {u} inputs, {y} outputs\n", found.model, found.time);
    if let Some(path) = path {
        text.push_str(&format!("  linear model in {}\n", path.display()));
    }
    text.push_str("\neigenvalues (1/s), frequency (Hz), damping ratio\n");
    for &(re, im) in &found.linear.eigenvalues {
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
