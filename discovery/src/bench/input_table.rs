//! Recorded inputs of a shot as one table for runs of the model.

use std::fmt::Write;

use hyd_system::{Hold, Series};

use crate::Shot;

/// Rows between two samples of a spline that cannot be given by its samples.
const BETWEEN: usize = 8;
/// Part of the distance of rows by which times differ that are the same but for rounding.
const SAME: f64 = 1e-9;

impl Shot {
    /// Its recorded inputs as the text of a table that covers a time (s), and what they do between its rows; none if it has none.
    pub fn input_table(&self, span: (f64, f64)) -> Option<(String, Vec<(String, Hold)>)> {
        let recorded: Vec<(&str, &Series)> =
            self.inputs.iter().map(|(name, series)| (name.as_str(), &**series)).collect();
        (!recorded.is_empty()).then(|| table(&recorded, span))
    }
}

/// Samples of inputs as a table that covers a time, and what they do between its rows.
fn table(inputs: &[(&str, &Series)], (start, stop): (f64, f64)) -> (String, Vec<(String, Hold)>) {
    let mut times: Vec<f64> =
        inputs.iter().flat_map(|(_, series)| series.times()).copied().chain([start, stop]).collect();
    times.sort_unstable_by(f64::total_cmp);
    let step = (times[times.len() - 1] - times[0]) / times.len() as f64;
    // Of times that differ by rounding the last one: by then all held values have jumped.
    let mut rows: Vec<f64> = Vec::with_capacity(times.len());
    for time in times {
        match rows.last_mut() {
            Some(last) if time - *last <= SAME * step => *last = time,
            _ => rows.push(time),
        }
    }
    // A spline through more points than its samples is another one; in between the rows of a dense table lie on straight lines.
    let is_exact = |series: &Series| series.hold() != Hold::Smooth || series.times() == rows;
    let exact: Vec<bool> = inputs.iter().map(|(_, series)| is_exact(series)).collect();
    if exact.contains(&false) {
        let between = |pair: &[f64]| -> Vec<f64> {
            (0..BETWEEN).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / BETWEEN as f64).collect()
        };
        let last = rows[rows.len() - 1];
        rows = rows.windows(2).flat_map(between).chain([last]).collect();
    }
    let holds = inputs.iter().zip(&exact).map(|((name, series), exact)| {
        // Splines that are exact are given by rows that are not their samples once others are dense.
        let is_spline = series.hold() == Hold::Smooth;
        let hold = if is_spline && (!exact || series.times() != rows) { Hold::Linear } else { series.hold() };
        (name.to_string(), hold)
    });
    let holds = holds.collect();
    let field = |name: &str| {
        if name.contains([',', '"', '\n']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_string() }
    };
    let mut text = String::from("time");
    inputs.iter().for_each(|(name, _)| text.extend([",", &field(name)]));
    text.push('\n');
    for time in rows {
        // Writing to a String cannot fail.
        let _ = write!(text, "{time:?}");
        for (_, series) in inputs {
            let last = series.values()[series.values().len() - 1];
            let value = if time >= series.span().1 { last } else { series.at(time, series.interval(time, 0)).value };
            let _ = write!(text, ",{value:?}");
        }
        text.push('\n');
    }
    (text, holds)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Hold, Series, table};

    /// Rows of a table behind its header.
    fn rows(text: &str) -> Vec<Vec<f64>> {
        text.lines().skip(1).map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect()
    }

    #[test]
    fn inputs_of_other_clocks_stand_in_one_table() {
        let line = Series::new(vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 0.0], Hold::Linear).unwrap();
        let steps = Series::new(vec![0.5, 1.5, 2.5], vec![1.0, 3.0, 5.0], Hold::Zero).unwrap();
        let (text, holds) = table(&[("u[1,2]", &line), ("s", &steps)], (-1.0, 2.0));
        assert!(text.starts_with("time,\"u[1,2]\",s\n-1.0,0.0,1.0\n"), "{text}");
        let wanted = [
            [-1.0, 0.0, 1.0],
            [0.0, 0.0, 1.0],
            [0.5, 1.0, 1.0],
            [1.0, 2.0, 1.0],
            [1.5, 1.0, 3.0],
            [2.0, 0.0, 3.0],
            [2.5, 0.0, 5.0],
        ];
        let found: Vec<Vec<f64>> = rows(&text.replace("\"u[1,2]\"", "u"));
        assert_eq!(found, wanted);
        assert_eq!(holds, [("u[1,2]".to_string(), Hold::Linear), ("s".to_string(), Hold::Zero)]);
    }

    #[test]
    fn splines_keep_their_samples_or_become_dense() {
        let times: Vec<f64> = (0..21).map(|k| 0.05 * f64::from(k)).collect();
        let smooth = Series::new(times.clone(), times.iter().map(|t| (6.0 * t).sin()).collect(), Hold::Smooth).unwrap();
        let (text, holds) = table(&[("u", &smooth)], (0.0, 1.0));
        assert_eq!((rows(&text).len(), holds[0].1), (21, Hold::Smooth));
        // It must hold its end for longer.
        let (text, holds) = table(&[("u", &smooth)], (0.0, 1.5));
        assert_eq!(holds[0].1, Hold::Linear);
        for row in rows(&text) {
            let wanted = (6.0 * row[0].min(1.0)).sin();
            assert!((row[1] - wanted).abs() < 2e-3, "{row:?} instead of {wanted}");
        }
    }
}
