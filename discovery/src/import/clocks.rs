//! Which columns of a file hold times, and which times the other columns belong to.
//!
//! A name like `time`, `Zeit` or `t1` says it, and so does a unit of time on a column that ascends.  `T` is a temperature more often than a
//! time: it is one only where nothing else is.  A column with another number of rows than the rest ends in empty fields, or has some in
//! between; these count for nothing here.

use super::Asked;
use super::raw::Raw;
use super::stamp::Kind;
use super::unit::{heading, unit};
use crate::record::sampling;

/// Names of columns of times, in small letters and without a number behind them.
const TIMES: [&str; 14] = [
    "t",
    "time",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "czas",
    "tid",
    "timestamp",
    "time stamp",
    "zeitstempel",
    "x_value",
    "elapsed",
    "elapsed time",
];
/// Share of uneven steps above which an ascending column is not taken for times.
const UNEVEN: f64 = 0.05;
/// Share of steps back from which on a column is not a column of times with mistakes, but something else.
const BACK: f64 = 0.25;

/// Name and unit of a column.
pub(super) type Part = (String, Option<String>);

/// Does a heading say by its name alone that times stand below it?  `T` does not.
pub(super) fn is_called_time(text: &str, unit_below: Option<&str>) -> bool {
    let (name, own) = heading(text);
    let own = unit_below.filter(|own| !own.is_empty()).map(String::from).or(own);
    let is_time = own.as_ref().is_none_or(|own| unit(own).is_some_and(|unit| unit.si == "s"));
    let stem = stem(&name, own.as_deref());
    is_time && stem != "T" && TIMES.contains(&stem.to_lowercase().as_str())
}

/// The name of a column without its unit and its number.
fn stem<'a>(name: &'a str, own: Option<&str>) -> &'a str {
    let bare = own.and_then(|own| name.strip_suffix(own)?.strip_suffix('_')).unwrap_or(name);
    bare.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_' || c == ' ')
}

/// Values of a column without its gaps.
fn filled(raw: &Raw, k: usize) -> Vec<f64> {
    raw.columns[k].iter().copied().filter(|value| value.is_finite()).collect()
}

/// What is asked about columns.
struct Columns<'a> {
    raw: &'a Raw,
    parts: &'a [Part],
    is_skipped: &'a dyn Fn(usize) -> bool,
}

impl Columns<'_> {
    fn ascends(&self, k: usize) -> bool {
        let values = filled(self.raw, k);
        values.len() > 2 && values.windows(2).all(|pair| pair[1] > pair[0])
    }

    fn is_even(&self, k: usize) -> bool {
        sampling(&filled(self.raw, k)).is_some_and(|own| own.uneven < UNEVEN)
    }

    /// It goes back too often, or never on, to be a column of times with mistakes.
    fn wanders(&self, k: usize) -> bool {
        let values = filled(self.raw, k);
        let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
        let back = steps().filter(|step| *step < 0.0).count();
        back as f64 > BACK * values.len() as f64 || !steps().any(|step| step > 0.0)
    }

    /// Is the unit one of time?  None where no unit is stated.
    fn in_time(&self, k: usize) -> Option<bool> {
        self.parts[k].1.as_ref().map(|own| unit(own).is_some_and(|unit| unit.si == "s"))
    }

    fn kind(&self, k: usize) -> Option<Kind> {
        self.raw.stamps.get(k).copied().flatten()
    }

    fn stem(&self, k: usize) -> &str {
        stem(&self.parts[k].0, self.parts[k].1.as_deref())
    }

    fn is_named(&self, k: usize) -> bool {
        TIMES.contains(&self.stem(k).to_lowercase().as_str())
    }

    /// `T` without a unit: a temperature more often than a time.
    fn is_doubtful(&self, k: usize) -> bool {
        self.in_time(k).is_none() && self.stem(k) == "T"
    }

    /// One of several words of its name says that it holds times: `t_slow`, `Time Channel 2`.
    fn has_word(&self, k: usize) -> bool {
        let is_word = |word: &str| word != "T" && TIMES.contains(&word.to_lowercase().as_str());
        self.parts[k].0.split([' ', '_', '-', '.']).next().is_some_and(is_word)
    }

    /// By name or unit it can be nothing else.
    fn is_clock(&self, k: usize) -> bool {
        match self.in_time(k) {
            Some(false) => false,
            Some(true) => self.is_named(k) || self.ascends(k) || self.has_word(k) && !self.wanders(k),
            None if self.is_doubtful(k) => false,
            None => self.is_named(k) || self.has_word(k) && self.ascends(k) && self.is_even(k),
        }
    }
}

/// Positions of the columns of times.
pub(super) fn clocks(
    (raw, parts): (&Raw, &[Part]),
    is_skipped: &dyn Fn(usize) -> bool,
    asked: &Asked,
    notes: &mut Vec<String>,
) -> Vec<usize> {
    let own = Columns { raw, parts, is_skipped };
    let all = || (0..parts.len()).filter(|&k| !(own.is_skipped)(k));
    let is_asked = |k: &usize| asked.time.iter().any(|name| *name == raw.headings[*k] || *name == parts[*k].0);
    let wanted: Vec<usize> = all().filter(is_asked).collect();
    if !wanted.is_empty() {
        return wanted;
    }
    let likely: Vec<usize> = all().filter(|&k| own.kind(k).is_none() && own.is_clock(k)).collect();
    let mut found = Vec::new();
    for &k in &likely {
        let beside = likely.iter().any(|&other| other != k && own.ascends(other));
        // A name of one letter to which no column belongs says nothing.
        let is_last = likely.iter().chain([&parts.len()]).any(|&other| other == k + 1);
        let is_letter = own.stem(k) == "t" && is_last;
        match own.in_time(k).is_none() && beside {
            true if own.wanders(k) => notes.push(format!(
                "`{}` goes up and down, so it is taken for a channel and not for times",
                raw.headings[k]
            )),
            true if is_letter => notes.push(format!(
                "no column stands to the right of `{}`, so it is taken for a channel and not for times",
                raw.headings[k]
            )),
            _ => found.push(k),
        }
    }
    if !found.is_empty() {
        let also = all().filter(|&k| own.is_doubtful(k) && own.ascends(k));
        let names: Vec<String> = also.map(|k| format!("`{}`", raw.headings[k])).collect();
        if !names.is_empty() {
            notes.push(format!("{} is taken for a channel, for there are other times", names.join(", ")));
        }
        return found;
    }
    let is_point =
        |k: &usize| matches!(own.kind(*k), Some(Kind::Time | Kind::Point)) && (own.is_named(*k) || own.ascends(*k));
    let points: Vec<usize> = all().filter(is_point).collect();
    if !points.is_empty() {
        return points;
    }
    // A first column that ascends evenly, but does not merely count.
    let counts = raw.columns.first().is_some_and(|values| {
        values.windows(2).all(|pair| pair[1] - pair[0] == 1.0) && values.first().is_some_and(|v| *v == 0.0 || *v == 1.0)
    });
    let is_first = |k: usize| parts[k].1.is_none() && own.kind(k).is_none() && own.ascends(k) && own.is_even(k);
    if all().next() == Some(0) && is_first(0) && !counts && !own.is_doubtful(0) {
        notes.push(format!("no column is called a time; `{}`, which ascends evenly, is taken for it", raw.headings[0]));
        return vec![0];
    }
    // With a rate nothing has to be a time.
    if asked.rate.is_some() {
        return Vec::new();
    }
    all().filter(|&k| own.is_doubtful(k) && !own.wanders(k)).collect()
}

/// The clock of a column, as a position among the clocks: the nearest one to the left of it that has a time wherever it has a value.
pub(super) fn clock_of(raw: &Raw, clocks: &[usize], k: usize, notes: &mut Vec<String>) -> Option<usize> {
    let covers = |clock: &usize| {
        raw.columns[*clock].iter().zip(&raw.columns[k]).all(|(time, value)| value.is_nan() || !time.is_nan())
    };
    let nearest = clocks.iter().rposition(|clock| *clock < k).or(if clocks.is_empty() { None } else { Some(0) })?;
    let left = clocks[..=nearest].iter().rposition(covers);
    let own = left.or_else(|| clocks.iter().position(covers)).unwrap_or(nearest);
    if own != nearest {
        let (name, not, time) = (&raw.headings[k], &raw.headings[clocks[nearest]], &raw.headings[clocks[own]]);
        notes.push(format!("`{name}` has values where `{not}` has no time: it belongs to the times of `{time}`"));
    }
    Some(own)
}

/// Are the times of two columns the same?
pub(super) fn are_same(raw: &Raw, a: usize, b: usize) -> bool {
    let pairs = raw.columns[a].iter().zip(&raw.columns[b]);
    pairs.into_iter().all(|(a, b)| a == b || a.is_nan() && b.is_nan())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Headings of the columns that are taken for times; each column is a heading and what it holds.
    fn found(columns: &[(&str, &str)]) -> Vec<String> {
        let value = |how: &str, row: usize| match how {
            "up" => 0.01 * row as f64,
            // Ascends, but not evenly.
            "heats" => (row as f64).sqrt() + 20.0,
            "short" if row >= 50 => f64::NAN,
            "short" => 0.02 * row as f64,
            "sparse" if !row.is_multiple_of(10) => f64::NAN,
            "sparse" => 0.01 * row as f64,
            "slips" if row == 30 => 0.0,
            "slips" => 0.01 * row as f64,
            "still" => 20.0,
            _ => ((row * 37) % 11) as f64,
        };
        let columns: Vec<(String, Vec<f64>)> = columns
            .iter()
            .map(|(name, how)| ((*name).to_string(), (0..100).map(|row| value(how, row)).collect()))
            .collect();
        let raw = Raw::of_columns(&columns).expect("a table");
        let parts: Vec<Part> = raw.headings.iter().map(|own| heading(own)).collect();
        let all = clocks((&raw, &parts), &|_| false, &Asked::default(), &mut Vec::new());
        all.into_iter().map(|k| raw.headings[k].clone()).collect()
    }

    #[test]
    fn columns_of_times_are_told_from_temperatures() {
        for (columns, expected) in [
            (&[("t", "up"), ("y", ""), ("T", "")][..], &["t"][..]),
            (&[("t", "up"), ("y", ""), ("T", "heats")], &["t"]),
            (&[("T", "heats"), ("y", ""), ("t", "up")], &["t"]),
            (&[("T", "heats"), ("Time", "up"), ("y", "")], &["Time"]),
            (&[("time", "up"), ("y", ""), ("time2", "short"), ("T", "heats")], &["time", "time2"]),
            (&[("t1", "up"), ("y", ""), ("t2", "up"), ("T2", "")], &["t1", "t2"]),
            (&[("T1", "up"), ("y", ""), ("T2", "short"), ("z", "")], &["T1", "T2"]),
            (&[("T1", "up"), ("y", ""), ("T2", "still"), ("z", "")], &["T1"]),
            (&[("T", "up"), ("y", "")], &["T"]),
            (&[("sample", "up"), ("y", ""), ("T", "heats")], &["sample"]),
            (&[("Time", "up"), ("y", ""), ("t", "heats")], &["Time"]),
            (&[("time", "up"), ("temps", ""), ("y", "")], &["time"]),
            (
                &[("t_fast [s]", "up"), ("y", ""), ("t_slow [s]", "short"), ("T [degC]", "")],
                &["t_fast [s]", "t_slow [s]"],
            ),
            (&[("t_fast [s]", "up"), ("y", ""), ("t_slow [s]", "sparse"), ("T", "")], &["t_fast [s]", "t_slow [s]"]),
            (&[("time_fast", "up"), ("y", ""), ("time_slow", "short"), ("T", "")], &["time_fast", "time_slow"]),
            // What is a time with a mistake stays one, so that the mistake is told.
            (&[("t", "up"), ("y", ""), ("t2", "slips"), ("z", "")], &["t", "t2"]),
            (&[("t_a [s]", "up"), ("y", ""), ("t_b [s]", "slips"), ("z", "")], &["t_a [s]", "t_b [s]"]),
            (&[("t", "up"), ("delay [s]", ""), ("T_oil", "heats"), ("t_oil", "heats"), ("y", "")], &["t"]),
        ] {
            assert_eq!(found(columns), expected, "{columns:?}");
        }
    }

    #[test]
    fn names_of_times() {
        for (heading, below, expected) in [
            ("Time [s]", None, true),
            ("Zeit", Some("ms"), true),
            ("Zeit", Some(""), true),
            ("t_ms", None, true),
            ("t 2", None, true),
            ("T", None, false),
            ("t", Some("degC"), false),
            ("y", None, false),
        ] {
            assert_eq!(is_called_time(heading, below), expected, "{heading}");
        }
    }
}
