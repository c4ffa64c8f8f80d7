//! The sink of a run: streams rows to the result file, keeps the few variables that are shown, tells the progress.

use std::io;
use std::sync::Arc;

use hyd_results::{ResultFile, RowKind, Sink};
use hyd_system::{Place, Tables, VariableInfo};

use crate::progress::Progress;
use crate::selection::Shown;

/// Takes the rows of one run.
pub struct Recorder {
    /// Where all chosen variables go, if a file was asked for.
    pub file: Option<ResultFile>,
    /// Number of rows so far.
    pub rows: usize,
    shown: Vec<Shown>,
    keep: bool,
    times: Vec<f64>,
    values: Vec<Vec<f64>>,
    last: Vec<f64>,
    parameters: Vec<f64>,
    model: String,
    progress: Option<Progress>,
    span: (f64, f64),
    /// Derivatives by parameters: where they stand in a row.
    derivatives: Vec<usize>,
    /// Rows in which some of them are not numbers, and the first such row's time (s).
    unknown: (usize, f64),
}

impl Recorder {
    /// `keep`: all values of the shown variables are needed, not only the last; `span`: start and stop (s); `progress`: how far the run has
    /// come is shown on a terminal.
    pub fn new(shown: Vec<Shown>, keep: bool, span: (f64, f64), progress: bool) -> Self {
        Self {
            file: None,
            rows: 0,
            values: vec![Vec::new(); shown.len()],
            last: vec![f64::NAN; shown.len()],
            shown,
            keep,
            times: Vec::new(),
            parameters: Vec::new(),
            model: String::new(),
            progress: progress.then(Progress::new),
            span,
            derivatives: Vec::new(),
            unknown: (0, f64::NAN),
        }
    }

    /// A sentence on derivatives by parameters that the rows do not have.
    pub fn unknown_derivatives(&self) -> Option<String> {
        let (rows, first) = self.unknown;
        (rows > 0).then(|| {
            let rows = if rows == 1 { "1 row".to_string() } else { format!("{rows} rows") };
            format!("derivatives by parameters are not known in {rows}, first at t = {first} s, and stand as NaN there")
        })
    }

    /// The run is over: wipes the progress.
    pub fn end(&mut self) {
        self.progress = None;
    }

    /// Names, last values and units of the shown variables.
    pub fn last_values(&self) -> Vec<(String, f64, String)> {
        if self.rows == 0 {
            return Vec::new();
        }
        let shown = self.shown.iter().zip(&self.last);
        shown.map(|(shown, value)| (shown.column.name.clone(), *value, shown.unit.clone())).collect()
    }

    /// Times of all rows; none if only last values were kept.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The shown variables with their values; the values are handed over.
    pub fn take_curves(&mut self) -> impl Iterator<Item = (&Shown, Vec<f64>)> {
        self.shown.iter().zip(std::mem::take(&mut self.values))
    }

    /// Name of the model.
    pub fn model(&self) -> &str {
        &self.model
    }
}

/// The name is that of a derivative by a parameter, `d(x)/d(p)`.
fn is_derivative(variable: &VariableInfo) -> bool {
    variable.name.parts.last().is_some_and(|(text, _)| text.contains(")/d("))
}

impl Sink for Recorder {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.model = tables.model.to_string();
        self.parameters = parameters.to_vec();
        self.rows = 0;
        self.unknown = (0, f64::NAN);
        let derived = tables.variables.iter().filter(|own| is_derivative(own));
        let places = derived.flat_map(|own| &own.sources).filter_map(|source| match source.place {
            Place::Output(at) => Some(at as usize),
            _ => None,
        });
        self.derivatives = places.collect();
        self.file.as_mut().map_or(Ok(()), |file| file.begin(tables, parameters))
    }

    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()> {
        self.rows += 1;
        for (k, shown) in self.shown.iter().enumerate() {
            self.last[k] = shown.column.value(values, &self.parameters);
            if self.keep {
                self.values[k].push(self.last[k]);
            }
        }
        if self.keep {
            self.times.push(t);
        }
        if self.derivatives.iter().any(|&at| values.get(at).is_some_and(|value| value.is_nan())) {
            self.unknown = (self.unknown.0 + 1, if self.unknown.0 == 0 { t } else { self.unknown.1 });
        }
        if let Some(progress) = &mut self.progress {
            progress.at(t, self.span.0, self.span.1);
        }
        self.file.as_mut().map_or(Ok(()), |file| file.row(t, values, kind))
    }
}
