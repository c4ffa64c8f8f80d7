//! `simulate`: one run, its statistics, and how far its variables went.

use std::io;
use std::sync::Arc;

use hyd_results::{RowKind, Sink};
use hyd_run::{RunArguments, Selection, Shown, Status, check_usage, clock, finish};
use hyd_system::Tables;
use hyd_verbs::{Listener, Run, run_diagnostic, with_whole_loops};
use serde_json::{Value, json};

use super::{CLASS, FILE, LIBRARIES, PARAMETER_FILE, STOP, TOLERANCE, Tool};
use super::{model_file, runnable, set_parameters, with_messages};
use crate::answer::Answer;
use crate::arguments::{Kind, optional};
use crate::calls::Call;

/// Variables of an answer.
const MOST_VARIABLES: usize = 60;
/// Endings of files of results.
pub(super) const RESULTS: [&str; 3] = ["csv", "mat", "parquet"];

pub(super) const TOOL: Tool = Tool {
    name: "simulate",
    title: "Simulate a model",
    says: "Translates a model and runs it. Gives how the run ended, the statistics of the solver, and of each chosen variable the least, the largest and \
           the last value with its unit. All rows are written only where `result` names a file.",
    arguments: &[
        FILE,
        CLASS,
        optional(
            "parameters",
            Kind::Values,
            "parameters by full name with values in the units of the model, such as {\"p0\": 15e6, \"spring.k\": 3000}; arrays are lists",
        ),
        PARAMETER_FILE,
        optional("start", Kind::Number, "start time in s [default: as the model says, else 0]"),
        STOP,
        TOLERANCE,
        optional("intervals", Kind::Count, "number of equal output intervals [default: as the model says, else 500]"),
        optional(
            "variables",
            Kind::Text,
            "regular expression: the variables whose full name matches are returned and written, such as ^(x|der\\(x\\))$ [default: returned are a few of the \
             top level, written are all]",
        ),
        optional(
            "result",
            Kind::Text,
            "file for the rows, .csv, .mat or .parquet, relative to the folder that is served; a new one [default: none is written]",
        ),
        LIBRARIES,
    ],
    is_reading: false,
    run: simulate,
};

fn simulate(call: &Call<'_>) -> Result<Answer, String> {
    let (workplace, given) = (call.workplace, &call.given);
    let begin = clock::cpu_seconds();
    let file = model_file(workplace, given)?;
    let result = given.text("result").map(|name| workplace.folder.target("result", name, &RESULTS)).transpose()?;
    let arguments = RunArguments {
        start: given.number("start"),
        stop: given.number("stop"),
        tolerance: given.number("tolerance"),
        intervals: given.count("intervals"),
        result,
        variables: given.text("variables").map(str::to_string),
        json: true,
        ..RunArguments::default()
    };
    if let Err(failure) = check_usage(&arguments, Some(&file)) {
        return Ok(Answer::failed(&failure, &call.kept));
    }
    let set = match set_parameters(call)? {
        Ok(set) => set,
        Err(answer) => return Ok(answer),
    };
    let compilation = match runnable(call, &file, (given.text("class"), &set), &[])? {
        Ok(compilation) => compilation,
        Err(answer) => return Ok(answer),
    };
    // Only now is it known which files are read.
    if let Err(failure) = check_usage(&arguments, None) {
        return Ok(Answer::failed(&failure, &call.kept));
    }
    let run = Run {
        units: None,
        compilation: &compilation,
        set: &set,
        table: None,
        arguments: &arguments,
        drawn: false,
        only_shown: false,
        translate_s: clock::cpu_seconds() - begin,
        progress: false,
    };
    let extremes = || Extremes::new(arguments.variables.as_deref());
    let whole = || with_whole_loops(&compilation, &set);
    let (outcome, extremes) = match run.simulate(&whole, &extremes, &|| call.stopped()) {
        Ok(ran) => ran,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let summary = &outcome.summary;
    if let (Some(path), Some(_)) = (&arguments.result, &summary.result) {
        workplace.folder.wrote(path);
    }
    let mut data: Value = serde_json::from_str(&summary.json()).unwrap_or_default();
    if let Value::Object(fields) = &mut data {
        // The list of variables has these, with units.
        fields.remove("final");
        fields.insert("variables".into(), extremes.json());
        if extremes.left_out > 0 {
            fields.insert("variables_left_out".into(), extremes.left_out.into());
        }
    }
    let is_whole = matches!(summary.status, Status::Done | Status::Terminated);
    let told = summary.text();
    // What the summary says of last values, the table says, too.
    let told = told.split_once("\n\nvalues at ").map_or(told.as_str(), |(before, _)| before).trim_end().to_string();
    if let Err(error) = outcome.result {
        let failure = finish(summary, error, &|error, kept| {
            let diagnostic = run_diagnostic(error, &compilation.files, compilation.flat.as_deref(), kept);
            call.kept.diagnostics(&compilation.files, &[diagnostic]);
        });
        let text = Answer::failed(&failure, &call.kept).text;
        return Ok(Answer {
            text: format!("{text}{told}\n{}", extremes.text()),
            data: with_messages(call, data),
            is_error: true,
        });
    }
    let warnings: String =
        summary.warnings.iter().map(|warning| format!("warning: {}\n", warning.trim_end())).collect();
    let text = format!("{}{warnings}{told}\n{}", call.kept.text(), extremes.text());
    Ok(Answer { text, data: with_messages(call, data), is_error: !is_whole })
}

/// Least, largest and last values of the chosen variables.
struct Extremes {
    selection: Selection,
    shown: Vec<Shown>,
    parameters: Vec<f64>,
    /// By variable.
    values: Vec<[f64; 3]>,
    /// Variables that match and are not told.
    left_out: usize,
    rows: usize,
}

impl Extremes {
    fn new(pattern: Option<&str>) -> Self {
        Self {
            // A pattern that is none has been refused before.
            selection: Selection::new(pattern).unwrap_or_default(),
            shown: Vec::new(),
            parameters: Vec::new(),
            values: Vec::new(),
            left_out: 0,
            rows: 0,
        }
    }

    fn told(&self) -> impl Iterator<Item = (&Shown, [f64; 3])> {
        self.shown.iter().zip(self.values.iter().copied()).filter(|_| self.rows > 0)
    }

    fn json(&self) -> Value {
        let one = |(shown, [least, largest, last]): (&Shown, [f64; 3])| json!({"name": shown.column.name, "unit": shown.unit, "min": least, "max": largest, "final": last});
        self.told().map(one).collect()
    }

    fn text(&self) -> String {
        let mut text = String::new();
        if self.rows > 0 {
            text.push_str("variable: min, max, final, unit\n");
        }
        let significant = hyd_system::significant;
        for (shown, [least, largest, last]) in self.told() {
            let line = format!(
                "  {}: {}, {}, {} {}",
                shown.column.name,
                significant(least),
                significant(largest),
                significant(last),
                shown.unit
            );
            text.push_str(line.trim_end());
            text.push('\n');
        }
        if self.left_out > 0 {
            text.push_str(&format!("  {} more; `variables` chooses\n", self.left_out));
        }
        text
    }
}

impl Sink for Extremes {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.shown = self.selection.shown(tables);
        self.left_out = self.selection.left_out(tables, self.shown.len());
        if self.shown.len() > MOST_VARIABLES {
            self.left_out += self.shown.len() - MOST_VARIABLES;
            self.shown.truncate(MOST_VARIABLES);
        }
        self.parameters = parameters.to_vec();
        self.values = vec![[f64::INFINITY, f64::NEG_INFINITY, f64::NAN]; self.shown.len()];
        self.rows = 0;
        Ok(())
    }

    fn row(&mut self, _t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        self.rows += 1;
        for (shown, [least, largest, last]) in self.shown.iter().zip(&mut self.values) {
            *last = shown.column.value(values, &self.parameters);
            *least = least.min(*last);
            *largest = largest.max(*last);
        }
        Ok(())
    }
}
