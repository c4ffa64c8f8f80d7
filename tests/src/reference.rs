//! Stored reference solutions and the comparison with them.
//!
//! A reference is a table of columns over time (`tests/data/reference`, origin in its README).  A comparison goes through all
//! samples of all compared columns and reports, per column out of bounds, the worst sample with both values.

use std::fmt::Write;

use crate::models::root;
use crate::runs::Run;

/// A table read from a file.
pub struct Reference {
    name: String,
    header: Vec<String>,
    columns: Vec<Vec<f64>>,
}

/// A variable of the model, the column of the reference, and how far they may be apart (unit of the variable).
pub struct Limit {
    /// Name in the model.
    pub variable: &'static str,
    /// Name of the column.
    pub column: &'static str,
    /// Largest difference.
    pub limit: f64,
}

/// Variable, column, largest difference.
pub const fn limit(variable: &'static str, column: &'static str, limit: f64) -> Limit {
    Limit { variable, column, limit }
}

impl Reference {
    /// Reads `tests/data/reference/<name>.csv`.
    pub fn read(name: &str) -> Self {
        let path = root().join("tests/data/reference").join(format!("{name}.csv"));
        let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let header: Vec<String> = reader.headers().expect("header").iter().map(str::to_string).collect();
        let mut columns = vec![Vec::new(); header.len()];
        for record in reader.records() {
            for (column, text) in columns.iter_mut().zip(&record.expect("record")) {
                column.push(text.parse().unwrap_or_else(|_| panic!("{name}: `{text}` is not a number")));
            }
        }
        assert!(columns[0].len() > 40, "{name}: too few samples");
        Self { name: name.to_string(), header, columns }
    }

    /// A column by its header; panics with the name if there is none.
    pub fn column(&self, name: &str) -> &[f64] {
        let position = self.header.iter().position(|header| header == name);
        &self.columns[position.unwrap_or_else(|| panic!("{} has no column `{name}`", self.name))]
    }

    /// Time of the last sample (s).
    pub fn stop(&self) -> f64 {
        self.column("time_s")[self.intervals()]
    }

    /// Number of equal intervals between samples.
    pub fn intervals(&self) -> usize {
        self.columns[0].len() - 1
    }

    /// Largest minus smallest value of a column.
    pub fn range(&self, name: &str) -> f64 {
        let column = self.column(name);
        let largest = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        largest - column.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Compares a run whose grid is that of the reference; panics with a report if a limit is passed.
    pub fn compare(&self, run: &Run, limits: &[Limit]) {
        let times = self.column("time_s");
        same_grid(&self.name, run.rows.times(), times);
        let mut report = String::new();
        for limit in limits {
            let (actual, expected) = (run.values(limit.variable), self.column(limit.column));
            report.push_str(&verdict(limit.variable, times, &actual, expected, limit.limit));
        }
        assert!(report.is_empty(), "{} differs from {}:\n{report}", run.rows.tables().model, self.name);
    }

    /// Limits of `fraction` of the range of each column.
    pub fn fractions(&self, pairs: &[(&'static str, &'static str)], fraction: f64) -> Vec<Limit> {
        pairs.iter().map(|&(variable, column)| limit(variable, column, fraction * self.range(column))).collect()
    }
}

/// Panics unless both grids have the same times up to rounding.
fn same_grid(name: &str, actual: &[f64], expected: &[f64]) {
    assert_eq!(actual.len(), expected.len(), "{name}: number of samples");
    let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12;
    assert!(actual.iter().zip(expected).all(close), "{name}: output points are not the samples");
}

/// Empty, or a line about the worst sample of a variable that is further off than `limit`.
pub fn verdict(variable: &str, times: &[f64], actual: &[f64], expected: &[f64], limit: f64) -> String {
    let mut line = String::new();
    // Not a number counts as infinitely far off.
    let difference = |k: usize| {
        let difference = (actual[k] - expected[k]).abs();
        if difference.is_nan() { f64::INFINITY } else { difference }
    };
    let worst = (0..times.len()).max_by(|&a, &b| difference(a).total_cmp(&difference(b)));
    let Some(worst) = worst else { return "nothing to compare\n".to_string() };
    let late = (0..times.len()).filter(|&k| difference(k) > limit).count();
    if difference(worst) > limit {
        let (time, is, should) = (times[worst], actual[worst], expected[worst]);
        writeln!(
            line,
            "{variable} at {time} s: {is:e} instead of {should:e}, off by {:.3e} where {limit:.3e} is allowed \
             ({late} of {} samples beyond)",
            difference(worst),
            times.len(),
        )
        .expect("invariant: writing to a text cannot fail");
    }
    line
}
