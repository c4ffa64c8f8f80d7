//! The sink of a run: streams rows to the result file, keeps the few variables that are shown, tells the progress.

use std::io;
use std::sync::Arc;

use hyd_report::{Curve, Figure};
use hyd_results::{ResultFile, RowKind, Sink};
use hyd_system::Tables;

use crate::progress::Progress;
use crate::selection::Shown;

/// Takes the rows of one run.
pub(super) struct Recorder {
    /// Where all chosen variables go, if a file was asked for.
    pub(super) file: Option<ResultFile>,
    /// Number of rows so far.
    pub(super) rows: usize,
    shown: Vec<Shown>,
    keep: bool,
    times: Vec<f64>,
    values: Vec<Vec<f64>>,
    last: Vec<f64>,
    parameters: Vec<f64>,
    model: String,
    progress: Option<Progress>,
    span: (f64, f64),
}

impl Recorder {
    /// `keep`: all values of the shown variables are needed, not only the last; `span`: start and stop (s).
    pub(super) fn new(shown: Vec<Shown>, keep: bool, span: (f64, f64)) -> Self {
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
            progress: Some(Progress::new()),
            span,
        }
    }

    /// The run is over: wipes the progress.
    pub(super) fn end(&mut self) {
        self.progress = None;
    }

    /// Names, last values and units of the shown variables.
    pub(super) fn last_values(&self) -> Vec<(String, f64, String)> {
        if self.rows == 0 {
            return Vec::new();
        }
        let shown = self.shown.iter().zip(&self.last);
        shown.map(|(shown, value)| (shown.column.name.clone(), *value, shown.unit.clone())).collect()
    }

    /// The picture of the shown variables.
    pub(super) fn figure(&mut self) -> Figure {
        let times: Arc<[f64]> = self.times.as_slice().into();
        let values = std::mem::take(&mut self.values);
        let curves = self.shown.iter().zip(values).map(|(shown, values)| {
            let curve = Curve { name: shown.column.name.clone(), run: 0, times: times.clone(), values };
            (shown.unit.clone(), curve)
        });
        Figure { title: Some(self.model.clone()), ..Figure::by_unit(Vec::new(), curves) }
    }
}

impl Sink for Recorder {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.model = tables.model.to_string();
        self.parameters = parameters.to_vec();
        self.rows = 0;
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
        if let Some(progress) = &mut self.progress {
            progress.at(t, self.span.0, self.span.1);
        }
        self.file.as_mut().map_or(Ok(()), |file| file.row(t, values, kind))
    }
}
