//! Tables of time: a function of one variable with time events, at which it may jump.
//!
//! The block of the library keeps the next time event in a discrete variable and hands it to each call.  That variable says in which
//! *stretch* between two events the clock stands, also at an event itself, before and after it; so a value is a function of the
//! time and the next event alone, and nothing has to be remembered.

use crate::external::DataFiles;
use crate::external::pieces::{Cubic, Outside, Pieces};
use crate::external::table_1d::{columns_of, pieces};
use crate::external::table_data::{self, Smoothness};
use crate::values::value::Value;

/// A table.
#[derive(Debug, PartialEq)]
pub struct TimeTable {
    t: Vec<f64>,
    outputs: Vec<Vec<f64>>,
    smoothness: Smoothness,
    /// What holds outside.
    pub outside: Outside,
    /// Before it the table gives 0.
    pub start: f64,
    /// Added to the times of the table.
    pub shift: f64,
    /// Times of the table at which there are events, increasing; the first and the last time are among them.
    pub events: Vec<f64>,
}

/// The function between two events that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// The events (times of the table).
    pub from: f64,
    /// The second of them.
    pub to: f64,
    /// The function.
    pub pieces: Pieces,
}

/// Points closer than this part of their size are one.
const SAME: f64 = 1e-10;

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME * a.abs().max(b.abs()).max(SAME)
}

fn with_jumps(smoothness: Smoothness) -> bool {
    matches!(smoothness, Smoothness::Linear | Smoothness::Constant)
}

impl TimeTable {
    /// `fileName, tableName, table, rows, columns of it, startTime, columns, number of columns, smoothness, extrapolation, shiftTime,
    /// timeEvents, verbose, delimiter, header lines`
    pub(crate) fn made(arguments: &[Value], files: DataFiles<'_>) -> Result<Self, String> {
        let rows = table_data::rows(arguments, (arguments.get(13), arguments.get(14)), files)?;
        let columns = table_data::columns(arguments.get(6))?;
        let smoothness = Smoothness::of(arguments.get(8))?;
        let (mut t, mut outputs) = columns_of(&rows, &columns)?;
        let outside = table_data::outside(arguments.get(9))?;
        if let (true, Outside::Hold, [first, .., last]) = (with_jumps(smoothness), outside, t.as_slice())
            && same(*first, *last)
        {
            // One jump and nothing else: a row a second earlier holds what stands before it.
            t.insert(0, first - 1.0);
            outputs.iter_mut().for_each(|values| values.insert(0, values[0]));
        }
        let n = t.len();
        let smoothness = if n <= 2 && smoothness != Smoothness::Constant { Smoothness::Linear } else { smoothness };
        let with_jumps = with_jumps(smoothness);
        if let Some(k) = (1..n).find(|&k| t[k] < t[k - 1] || !with_jumps && t[k] == t[k - 1]) {
            let (row, kind) = (k + 1, if with_jumps { "not decrease" } else { "increase strictly" });
            return Err(format!("the first column of a table of time must {kind}; row {row} has {}", t[k]));
        }
        if n > 1 && same(t[0], t[n - 1]) {
            return Err("a table of time with several rows needs a time between its first and last one".to_string());
        }
        let start = table_data::real(arguments.get(5), "its start time")?;
        let shift = table_data::real(arguments.get(10), "its shift of time")?;
        let mut events = vec![t[0]];
        // 1: at all points, 2: where the table jumps, 3: nowhere between the first and the last time.
        let choice = table_data::number(arguments.get(11)).unwrap_or(1);
        for k in 1..n.saturating_sub(1) {
            let jumps = same(t[k], t[k - 1]) || same(t[k], t[k + 1]);
            let wanted = choice == 1 || choice == 2 && jumps;
            if wanted && !events.last().is_some_and(|&last| same(last, t[k])) && !same(t[k], t[n - 1]) {
                events.push(t[k]);
            }
        }
        if !same(t[0], t[n - 1]) {
            events.push(t[n - 1]);
        }
        Ok(Self { t, outputs, smoothness, outside, start, shift, events })
    }

    /// The first and the last time of the table.
    pub fn range(&self) -> (f64, f64) {
        (self.t[0], self.t[self.t.len() - 1])
    }

    /// The table has one row, whose values it gives at all times.
    pub fn is_constant(&self) -> bool {
        self.t.len() == 1
    }

    fn output(&self, output: usize) -> Result<&[f64], String> {
        let found = output.checked_sub(1).and_then(|k| self.outputs.get(k));
        found.map(Vec::as_slice).ok_or_else(|| format!("the table has no output {output}"))
    }

    /// The functions of an output, counted from 1, between events that follow each other.
    pub fn stretches(&self, output: usize) -> Result<Vec<Stretch>, String> {
        let y = self.output(output)?;
        let whole = pieces(&self.t, y, self.smoothness, Outside::Line);
        let part = |pair: &[f64]| {
            let (from, to) = (pair[0], pair[1]);
            // Pieces with a length whose middle lies in the stretch.
            let inside = (0..whole.cubics.len()).filter(|&k| {
                let (a, b) = (whole.ends[k], whole.ends[k + 1]);
                b > a && (a + b) / 2.0 > from && (a + b) / 2.0 < to
            });
            let inside: Vec<usize> = inside.collect();
            let mut ends: Vec<f64> = inside.iter().map(|&k| whole.ends[k]).collect();
            ends.push(to);
            let cubics: Vec<Cubic> = inside.iter().map(|&k| whole.cubics[k]).collect();
            let last = cubics.last().map_or(0.0, |cubic| cubic.at(to - ends[ends.len() - 2]));
            let beyond = [Cubic::constant(0.0); 2];
            Stretch { from, to, pieces: Pieces { ends, cubics, last, beyond, outside: Outside::Hold } }
        };
        Ok(self.events.windows(2).map(part).collect())
    }

    /// What an output is before the first and behind the last time, over the distance from it.
    pub fn beyond(&self, output: usize) -> Result<[Cubic; 2], String> {
        let y = self.output(output)?;
        Ok(pieces(&self.t, y, self.smoothness, self.outside).beyond)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn table(rows: &[[f64; 2]], smoothness: i64, events: i64) -> TimeTable {
        let rows: Vec<Value> = rows.iter().map(|row| Value::array(row.map(Value::Real).to_vec())).collect();
        let none = || Value::Text("NoName".into());
        let whole = Value::Integer;
        let arguments = [
            none(),
            none(),
            Value::array(rows),
            whole(0),
            whole(2),
            Value::Real(0.0),
            Value::array(vec![whole(2)]),
            whole(1),
            whole(smoothness),
            whole(1),
            Value::Real(0.0),
            whole(events),
            Value::Boolean(false),
            Value::Text(",".into()),
            whole(0),
        ];
        TimeTable::made(&arguments, &mut |_| Err::<Arc<str>, String>(String::new())).unwrap()
    }

    const JUMP: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 1.0], [1.0, 5.0], [2.0, 6.0], [4.0, 0.0]];

    #[test]
    fn events_stand_where_they_are_asked_for() {
        assert_eq!(table(&JUMP, 1, 1).events, [0.0, 1.0, 2.0, 4.0]);
        assert_eq!(table(&JUMP, 1, 2).events, [0.0, 1.0, 4.0]);
        assert_eq!(table(&JUMP, 1, 3).events, [0.0, 4.0]);
    }

    #[test]
    fn a_table_may_be_one_jump() {
        let jump = table(&[[7.0, 0.0], [7.0, 1.0]], 3, 1);
        assert_eq!(jump.events, [6.0, 7.0]);
        assert_eq!(jump.stretches(1).unwrap().iter().map(|s| s.pieces.last).collect::<Vec<_>>(), [0.0]);
        assert_eq!(jump.beyond(1).unwrap().map(|line| line.at(3.0)), [0.0, 1.0]);
    }

    #[test]
    fn a_stretch_ends_before_the_jump() {
        let stretches = table(&JUMP, 1, 2).stretches(1).unwrap();
        let at = |k: usize, t: f64| stretches[k].pieces.value(t).unwrap();
        assert_eq!((at(0, 0.5), at(0, 1.0), at(1, 1.0), at(1, 1.5), at(1, 3.0)), (0.5, 1.0, 5.0, 5.5, 3.0));
        let steps = table(&JUMP, 3, 1).stretches(1).unwrap();
        assert_eq!(steps.iter().map(|s| s.pieces.last).collect::<Vec<_>>(), [0.0, 5.0, 6.0]);
    }
}
