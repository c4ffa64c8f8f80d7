//! What a run of a machine leaves: channels and their derivatives at the output points, and the first value that is outside of its limits.

use std::io;
use std::sync::Arc;

use hyd_results::{RowKind, Sink};
use hyd_system::{Place, Source, Tables, ValueKind, given};

use crate::machine::span::Span;

/// Channels at the output points of a run by the parameter they are derived by, in the order in which parameters were asked for.
pub(crate) type Derivatives = Vec<Vec<Vec<f64>>>;

/// Part of the distance of output points within which a row stands on one.
const ON_POINT: f64 = 1e-6;

/// What a parameter or constant of the model may be.
#[derive(Clone, Debug)]
pub(crate) struct Limit {
    pub(crate) name: String,
    pub(crate) kind: ValueKind,
    pub(crate) source: Source,
    pub(crate) range: (f64, f64),
}

impl Limit {
    /// What is to be said of the value that it has with these parameters, if it is outside.
    fn outside(&self, parameters: &[f64]) -> Option<String> {
        let value = match self.source.place {
            Place::Parameter(k) => *parameters.get(k as usize)?,
            Place::Constant(value) => value,
            Place::Output(_) => return None,
        };
        let value = if self.source.negated { -value } else { value };
        given::outside(|| self.name.clone(), &self.kind, value, self.range).map(|outside| outside.message)
    }
}

/// Channels at the output points.  Where an event happens at an output point, the value after it counts: a measured sample at the
/// instant of switching shows what has been switched.
pub(crate) struct Grid {
    sources: Vec<Source>,
    span: Span,
    parameters: Vec<f64>,
    values: Vec<Vec<f64>>,
    /// Number of parameters by which derivatives follow the values, and of values and parameters without derivatives.
    derived: usize,
    row: usize,
    constants: usize,
    derivatives: Derivatives,
    limits: Vec<Limit>,
    /// Which value of the run is outside of its limits.
    outside: Option<String>,
}

impl Grid {
    /// For these channels and limits of a system with so many values in a row and parameters.
    pub(crate) fn new(sources: Vec<Source>, limits: Vec<Limit>, (row, constants): (usize, usize)) -> Self {
        Self {
            span: Span { start: 0.0, stop: 1.0, intervals: 1 },
            parameters: Vec::new(),
            values: vec![Vec::new(); sources.len()],
            derived: 0,
            row,
            constants,
            derivatives: Vec::new(),
            limits,
            outside: None,
            sources,
        }
    }

    /// The outputs (positions in a row) that channels show.
    pub(crate) fn outputs(&self) -> Vec<u32> {
        let place = |source: &Source| if let Place::Output(k) = source.place { Some(k) } else { None };
        self.sources.iter().filter_map(place).collect()
    }

    /// Before a run over this span, in which the derivatives by so many parameters follow the values.
    pub(crate) fn prepare(&mut self, span: &Span, derived: usize) {
        (self.span, self.derived) = (span.clone(), derived);
        self.outside = None;
        self.derivatives.clear();
        self.derivatives.resize(derived, vec![vec![f64::NAN; span.intervals + 1]; self.sources.len()]);
    }

    /// What a run has left, if all values are finite.
    pub(crate) fn taken(&mut self) -> Option<(Vec<Vec<f64>>, Derivatives)> {
        let is_whole = self.values.iter().flatten().all(|value| value.is_finite());
        is_whole.then(|| (self.values.clone(), std::mem::take(&mut self.derivatives)))
    }

    /// Which value was outside of its limits, if that has ended the run.
    pub(crate) fn refused(&mut self) -> Option<String> {
        self.outside.take()
    }
}

impl Sink for Grid {
    fn begin(&mut self, _tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.outside = self.limits.iter().find_map(|limit| limit.outside(parameters));
        if self.outside.is_some() {
            return Err(io::Error::other("a value is outside of its limits"));
        }
        self.parameters.clear();
        self.parameters.extend_from_slice(parameters);
        for column in &mut self.values {
            column.clear();
            column.resize(self.span.intervals + 1, f64::NAN);
        }
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _kind: RowKind) -> io::Result<()> {
        let place = (t - self.span.start) / self.span.step();
        let k = place.round();
        if (place - k).abs() > ON_POINT || k < 0.0 || k as usize > self.span.intervals {
            // An event between output points.
            return Ok(());
        }
        let k = k as usize;
        for (channel, source) in self.sources.iter().enumerate() {
            // Derivatives of all values follow them, those of one value side by side.
            let (list, place, behind) = match source.place {
                Place::Output(k) => (values, k as usize, self.row),
                Place::Parameter(k) => (self.parameters.as_slice(), k as usize, self.constants),
                Place::Constant(value) => {
                    self.values[channel][k] = if source.negated { -value } else { value };
                    self.derivatives.iter_mut().for_each(|by| by[channel][k] = 0.0);
                    continue;
                }
            };
            let sign = if source.negated { -1.0 } else { 1.0 };
            let value = |place: usize| sign * list.get(place).copied().unwrap_or(f64::NAN);
            self.values[channel][k] = value(place);
            for (parameter, by) in self.derivatives.iter_mut().enumerate() {
                by[channel][k] = value(behind + place * self.derived + parameter);
            }
        }
        Ok(())
    }
}
