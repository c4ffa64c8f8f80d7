//! The table of one shot from the columns of its file: units, times of all columns, the trigger at time 0.

use std::fmt::Write as _;
use std::ops::Range;

use hyd_compiler::did_you_mean;
use hyd_results::format_number;

use super::plan::{Layout, ShotPlan};
use super::raw::Raw;
use crate::Fault;
use crate::record::edge;

/// Digits of a number that was converted: more than a recorder has, fewer than rounding errors show in.
const DIGITS: usize = 12;
/// Times this near to each other, as a part of the shorter period, are one.
const SAME: f64 = 1e-3;
/// Share of repeated times above which the clock is too coarse for the rows.
const TOO_COARSE: f64 = 0.1;
/// Fewest rows of a table of a shot.
const FEWEST: usize = 20;

/// A column of a table.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Column {
    /// Heading in the file.
    pub heading: String,
    /// Name in the table.
    pub name: String,
    /// Unit in the table.
    pub unit: String,
    /// Values; NaN for gaps.
    pub values: Vec<f64>,
}

/// The table of a shot.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Table {
    /// Times (s), ascending, 0 at the trigger where there is one.
    pub times: Vec<f64>,
    /// Columns in the order of the file.
    pub columns: Vec<Column>,
    /// Time of the file (s) that became 0, and whether an edge says so.
    pub zero: Option<(f64, bool)>,
    /// Number of rows left out because their time is that of the row before.
    pub repeated: usize,
    /// Headings that were left out.
    pub skipped: Vec<String>,
}

/// A number with as many digits as a measurement may have.
pub(super) fn rounded(value: f64) -> f64 {
    // The text of a finite number is a number.
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// Makes the table of a shot.
///
/// # Errors
/// A sentence with the line at fault, without the name of the file.
pub(super) fn table(raw: &Raw, layout: &Layout, shot: &ShotPlan) -> Result<Table, Fault> {
    let position = |heading: &str| {
        raw.headings.iter().position(|own| own == heading).ok_or_else(|| {
            let hint = did_you_mean(heading, raw.headings.iter().map(String::as_str));
            let hint = hint.unwrap_or_else(|| format!("it has: {}", raw.headings.join(", ")));
            Fault::new(format!("there is no column `{heading}`; {hint}"))
        })
    };
    for heading in layout.columns.keys() {
        position(heading)?;
    }
    let is_known = |heading: &String| layout.columns.contains_key(heading) || layout.times.contains_key(heading);
    if let Some(heading) = raw.headings.iter().find(|heading| !is_known(heading)) {
        let sentence = format!("the import file says nothing of the column `{heading}`; `skip = true` leaves it out");
        return Err(Fault::new(sentence));
    }
    let clock = |heading: Option<&String>| -> Result<Clock, Fault> {
        match (heading.or(layout.time.as_ref()), layout.rate) {
            (Some(heading), None) => {
                let scale = layout.times.get(heading).copied().unwrap_or(1.0);
                Clock::read(raw, position(heading)?, scale, layout.drop_repeated)
            }
            (_, rate) => {
                let rate = rate.unwrap_or(1.0);
                let count = raw.columns.first().map_or(0, Vec::len);
                let times = (0..count).map(|k| rounded(k as f64 / rate)).collect();
                Ok(Clock { column: None, times, rows: (0..count).collect(), repeated: 0 })
            }
        }
    };
    let main = clock(None)?;
    let mut others: Vec<(String, Clock)> = Vec::new();
    let mut columns: Vec<(Column, Option<usize>)> = Vec::new();
    let mut skipped = Vec::new();
    for (k, heading) in raw.headings.iter().enumerate() {
        let Some(plan) = layout.columns.get(heading) else { continue };
        if plan.skip {
            skipped.push(heading.clone());
            continue;
        }
        if let Some((line, text)) = &raw.texts[k] {
            return Err(Fault::new(format!(
                "line {line}, column `{heading}`: `{text}` is not a number; `skip = true` leaves the column out"
            )));
        }
        let own = match &plan.time {
            None => None,
            Some(name) => {
                if !others.iter().any(|(other, _)| other == name) {
                    others.push((name.clone(), clock(Some(name))?));
                }
                others.iter().position(|(other, _)| other == name)
            }
        };
        let clock = own.map_or(&main, |k| &others[k].1);
        clock.check(raw, k)?;
        let rows = &clock.rows;
        let is_plain = plan.scale == 1.0 && plan.offset == 0.0;
        let converted = |value: f64| if is_plain { value } else { rounded(plan.scale * value + plan.offset) };
        let values = rows.iter().map(|&row| converted(raw.columns[k][row])).collect();
        let (heading, name, unit) = (heading.clone(), plan.name.clone(), plan.unit.clone());
        if name == "time_s" || columns.iter().any(|(other, _)| other.name == name) {
            return Err(Fault::new(format!("two columns would be called `{name}`; give one another `name`")));
        }
        columns.push((Column { heading, name, unit, values }, own));
    }
    if columns.is_empty() {
        return Err(Fault::new("all of its columns are left out"));
    }
    let mut zero = shot.zero.map(|zero| (zero, false));
    if let Some(trigger) = &layout.trigger {
        let found = columns.iter().find(|(column, _)| column.heading == *trigger || column.name == *trigger);
        let Some((column, own)) = found else {
            return Err(Fault::new(format!("there is no column `{trigger}` for the trigger")));
        };
        let times = &own.map_or(&main, |k| &others[k].1).times;
        let part = part(times, shot);
        let edge = edge(&times[part.clone()], &column.values[part]);
        let within = if shot.begin.or(shot.end).is_some() { " between `begin` and `end`" } else { "" };
        let edge =
            edge.ok_or_else(|| Fault::new(format!("the trigger `{trigger}` never leaves its first level{within}")))?;
        zero = Some((rounded(edge.time), true));
    }
    let (mut times, mut columns) = joined(&main, &others, columns);
    let part = part(&times, shot);
    if part.is_empty() {
        let (first, last) = (times[0], times[times.len() - 1]);
        return Err(Fault::new(format!("no row lies between `begin` and `end`; its times are {first} to {last} s")));
    }
    if part.len() < times.len() {
        times = times[part.clone()].to_vec();
        for column in &mut columns {
            column.values = column.values[part.clone()].to_vec();
        }
    }
    if times.len() < FEWEST {
        return Err(Fault::new(format!("{} rows are too few: a shot has at least {FEWEST}", times.len())));
    }
    let shift = zero.map_or(0.0, |zero| zero.0);
    let times = times.into_iter().map(|t| rounded(t - shift)).collect();
    let repeated = main.repeated + others.iter().map(|(_, clock)| clock.repeated).sum::<usize>();
    Ok(Table { times, columns, zero, repeated, skipped })
}

/// The rows between the beginning and the end of a shot.
fn part(times: &[f64], shot: &ShotPlan) -> Range<usize> {
    let first = shot.begin.map_or(0, |begin| times.partition_point(|t| *t < begin));
    let end = shot.end.map_or(times.len(), |end| times.partition_point(|t| *t <= end));
    first.min(end)..end
}

/// Times and the rows that have one.
struct Clock {
    /// Its column, where there is one.
    column: Option<usize>,
    times: Vec<f64>,
    rows: Vec<usize>,
    /// Number of rows left out because their time is that of the row before.
    repeated: usize,
}

impl Clock {
    /// Refuses values of a column that have no time.
    fn check(&self, raw: &Raw, column: usize) -> Result<(), Fault> {
        let Some(own) = self.column else { return Ok(()) };
        let rows = raw.columns[own].iter().zip(&raw.columns[column]);
        match rows.into_iter().position(|(time, value)| time.is_nan() && !value.is_nan()) {
            None => Ok(()),
            Some(row) => Err(Fault::new(format!(
                "{}, column `{}`: a time is missing, and `{}` has a value there",
                raw.place(row),
                raw.headings[own],
                raw.headings[column]
            ))),
        }
    }

    /// Reads a column of times; rows without a time belong to other columns.
    fn read(raw: &Raw, column: usize, scale: f64, drop_repeated: bool) -> Result<Self, Fault> {
        let heading = &raw.headings[column];
        if let Some((line, text)) = &raw.texts[column] {
            return Err(Fault::new(format!("line {line}, column `{heading}`: `{text}` is not a time")));
        }
        let (mut times, mut rows): (Vec<f64>, Vec<usize>) = (Vec::new(), Vec::new());
        let mut repeated = 0;
        for (row, &value) in raw.columns[column].iter().enumerate() {
            if value.is_nan() {
                continue;
            }
            let t = rounded(value * scale);
            if let Some(&last) = times.last()
                && t <= last
            {
                if t == last && drop_repeated {
                    repeated += 1;
                    continue;
                }
                let what = if t == last { "stands twice" } else { "goes back" };
                let remedy = if t == last { remedy(&raw.columns[column]) } else { String::new() };
                return Err(Fault::new(format!(
                    "{}, column `{heading}`: the time {what}: {t} s after {last} s; times must ascend{remedy}",
                    raw.place(row)
                )));
            }
            times.push(t);
            rows.push(row);
        }
        if times.is_empty() {
            return Err(Fault::new(format!("column `{heading}` holds no times")));
        }
        Ok(Self { column: Some(column), times, rows, repeated })
    }
}

/// What can be done about times that stand twice.
fn remedy(times: &[f64]) -> String {
    let filled: Vec<f64> = times.iter().copied().filter(|t| t.is_finite()).collect();
    let twice = filled.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if twice as f64 > TOO_COARSE * filled.len() as f64 {
        return format!(
            " ({twice} of {} rows have the time of the row before, so the clock is too coarse for them; --rate HZ, or `rate` in the \
             import file, says how many samples there are per second)",
            filled.len()
        );
    }
    " (--drop-repeated, or `drop_repeated = true` in the import file, leaves out rows whose time is that of the row before)".to_string()
}

/// The times of all clocks, and the columns over them with gaps where a column has no value.
fn joined(main: &Clock, others: &[(String, Clock)], columns: Vec<(Column, Option<usize>)>) -> (Vec<f64>, Vec<Column>) {
    if others.is_empty() {
        return (main.times.clone(), columns.into_iter().map(|(column, _)| column).collect());
    }
    let all = || std::iter::once(main).chain(others.iter().map(|(_, clock)| clock));
    let period =
        |clock: &Clock| (clock.times[clock.times.len() - 1] - clock.times[0]) / clock.times.len().max(2) as f64;
    let near = SAME * all().map(period).fold(f64::INFINITY, f64::min);
    let mut every: Vec<f64> = all().flat_map(|clock| clock.times.iter().copied()).collect();
    every.sort_unstable_by(f64::total_cmp);
    let mut times: Vec<f64> = Vec::new();
    for t in every {
        if times.last().is_none_or(|last| t - last > near) {
            times.push(t);
        }
    }
    let spread = |(column, own): (Column, Option<usize>)| {
        let clock = own.map_or(main, |k| &others[k].1);
        let mut values = vec![f64::NAN; times.len()];
        for (t, value) in clock.times.iter().zip(&column.values) {
            // The last time that is not after it is the one it was merged into.
            let place = times.partition_point(|own| own <= t).saturating_sub(1);
            values[place] = *value;
        }
        Column { values, ..column }
    };
    let columns = columns.into_iter().map(spread).collect();
    (times, columns)
}

impl Table {
    /// The table as CSV.
    pub(super) fn csv(&self) -> String {
        let mut text = String::from("time_s");
        for column in &self.columns {
            text.push(',');
            text.push_str(&column.name);
        }
        text.push('\n');
        for (row, t) in self.times.iter().enumerate() {
            format_number(*t, &mut text);
            for column in &self.columns {
                text.push(',');
                if column.values[row].is_finite() {
                    format_number(column.values[row], &mut text);
                }
            }
            // Writing to a string cannot fail.
            let _ = writeln!(text);
        }
        text
    }
}
