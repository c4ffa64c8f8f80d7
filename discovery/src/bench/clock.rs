//! Clocks of a table: the columns of times, and the channels and inputs that are read by each.
//!
//! As a rule a table has one clock.  Recorders with several rates write several columns of times side by side, each as long as its own
//! record; all of them are brought to the times of all, with gaps where a channel was not read.

use crate::magnitude::{is_plausible, shown};
use crate::study::Study;

/// A clock and what it reads.
pub(crate) struct Clock {
    /// Column of its times; none where samples are counted.
    pub place: Option<usize>,
    /// Its columns, by their places in the table.
    pub columns: Vec<usize>,
    /// Times (s), ascending.
    pub times: Vec<f64>,
    /// Values by column.
    pub values: Vec<Vec<f64>>,
    /// Lines of the table.
    pub lines: Vec<u64>,
}

impl Clock {
    /// The clocks of a table with these columns, the study's own first; `is_read` says which columns count.
    ///
    /// # Errors
    /// A sentence on a column of times that is not there.
    pub(crate) fn all(
        header: &[String],
        study: &Study,
        is_read: &dyn Fn(&str) -> bool,
        missing: &dyn Fn(&str) -> String,
    ) -> Result<Vec<Self>, String> {
        let mut clocks: Vec<(Option<&str>, Self)> = Vec::new();
        for (place, name) in header.iter().enumerate().filter(|(_, name)| is_read(name)) {
            // A column that is a channel and an input has the clock of the channel.
            let own = study.channels.get(name).and_then(|own| own.time.as_deref()).or_else(|| {
                study.inputs.values().find(|input| input.column == *name).and_then(|own| own.time.as_deref())
            });
            let clock = own.or(study.shots.rate.is_none().then_some(&study.shots.time));
            let known = clocks.iter().position(|(known, _)| *known == clock);
            let known = match known {
                Some(known) => known,
                None => {
                    let find = |clock: &str| header.iter().position(|name| name == clock).ok_or_else(|| missing(clock));
                    let at = clock.map(find).transpose()?;
                    let (columns, values) = (Vec::new(), Vec::new());
                    let new = Self { place: at, columns, times: Vec::new(), values, lines: Vec::new() };
                    clocks.push((clock, new));
                    clocks.len() - 1
                }
            };
            clocks[known].1.columns.push(place);
            clocks[known].1.values.push(Vec::new());
        }
        Ok(clocks.into_iter().map(|(_, clock)| clock).collect())
    }

    /// Takes a row; `alone`: the table has no other clock.  `number` reads a field of the row.
    pub(crate) fn take(
        &mut self,
        (line, row): (u64, u64),
        study: &Study,
        alone: bool,
        number: &dyn Fn(usize) -> Result<f64, String>,
    ) -> Result<(), String> {
        let values = self.columns.iter().map(|&column| number(column)).collect::<Result<Vec<f64>, String>>()?;
        let t = match self.place {
            Some(place) => number(place)? * study.shots.time_scale,
            // A study has a rate where it has no column of times.
            None => row as f64 / study.shots.rate.unwrap_or(1.0),
        };
        if t.is_nan() && !alone && values.iter().all(|value| value.is_nan()) {
            // Its record is over, or it was not read at this time.
            return Ok(());
        }
        if !t.is_finite() {
            return Err(format!("line {line}: a time is missing"));
        }
        if !is_plausible(t) {
            return Err(format!("line {line}: {} s is not a time", shown(t)));
        }
        if let Some(&last) = self.times.last()
            && t <= last
        {
            return Err(format!("line {line}: the time {t} s does not come after {last} s; times must ascend"));
        }
        self.times.push(t);
        self.lines.push(line);
        self.values.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
        Ok(())
    }

    /// The position of a column among its own.
    pub(crate) fn column(&self, place: usize) -> Option<usize> {
        self.columns.iter().position(|column| *column == place)
    }

    /// The values of one of its columns at these times, which hold all of its own; NaN where it has none.
    pub(crate) fn at(&self, column: usize, times: &[f64]) -> Vec<f64> {
        if times.len() == self.times.len() {
            return self.values[column].clone();
        }
        let mut own = self.times.iter().zip(&self.values[column]).peekable();
        let value = |time: &f64| own.next_if(|(t, _)| *t <= time).map_or(f64::NAN, |(_, value)| *value);
        times.iter().map(value).collect()
    }
}

/// The times of several clocks together.
pub(crate) fn all_times<'c>(clocks: impl Iterator<Item = &'c Clock>) -> Vec<f64> {
    let mut times: Vec<f64> = clocks.flat_map(|clock| &clock.times).copied().collect();
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    times
}
