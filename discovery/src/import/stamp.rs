//! Points in time as fields: `2024-03-01 23:59:59.900`, `01.03.2024 22:59:59,900`, `22:59:59,900`, as seconds from the first row of a file.
//!
//! Days are counted by the Gregorian calendar (H. Hinnant, "chrono-Compatible Low-Level Date Algorithms", `days_from_civil`).  A time of day
//! without a date goes on into the next day where it would go back by more than half a day.  `03/01/2024` is not read, for it is two days.

/// Nanoseconds of a second.
const SECOND: i64 = 1_000_000_000;
/// Nanoseconds of a day.
const DAY: i64 = 86_400 * SECOND;
/// Forms that are read, for messages.
pub(super) const FORMS: &str = "`2024-03-01 23:59:59.9`, `01.03.2024 23:59:59,9` and `23:59:59.9`";

/// What a field of a column says.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// A day alone.
    Day,
    /// A time of day alone.
    Time,
    /// Both.
    Point,
}

/// The point in time in a field: what it says and its nanoseconds, since 1970 where it has a date.
pub(super) fn stamp(field: &str) -> Option<(Kind, i64)> {
    let field = field.trim();
    // Most fields are numbers.
    if !field.is_ascii() || field.len() < 7 || !field.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    match field.split_once([' ', 'T']) {
        Some((day, time)) => Some((Kind::Point, date(day)? * DAY + in_zone(time.trim())?)),
        None if field.contains(':') => Some((Kind::Time, time_of_day(field)?)),
        None => Some((Kind::Day, date(field)? * DAY)),
    }
}

/// An integer of so many digits.
fn whole(text: &str, digits: std::ops::RangeInclusive<usize>) -> Option<i64> {
    let suits = digits.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    suits.then(|| text.parse().ok()).flatten()
}

/// Days since 1970 of `2024-03-01`, `2024/03/01` or `01.03.2024`.
fn date(text: &str) -> Option<i64> {
    let mark = ['-', '/', '.'].into_iter().find(|mark| text.contains(*mark))?;
    let parts: Vec<&str> = text.split(mark).collect();
    let [first, month, last] = parts.as_slice() else { return None };
    let (year, day) = if mark == '.' { (last, first) } else { (first, last) };
    let (year, month, day) = (whole(year, 4..=4)?, whole(month, 1..=2)?, whole(day, 1..=2)?);
    if !((1..=12).contains(&month) && (1..=31).contains(&day) && (1900..2200).contains(&year)) {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    Some(era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468)
}

/// Nanoseconds of a time of day that may be followed by its zone: `Z`, `+01:00`.
fn in_zone(text: &str) -> Option<i64> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let Some(at) = text.rfind(['+', '-']) else { return time_of_day(text) };
    let (hours, minutes) = text[at + 1..].split_once(':').or_else(|| text[at + 1..].split_at_checked(2))?;
    let minutes = if minutes.is_empty() { 0 } else { whole(minutes, 2..=2)? };
    let ahead = (whole(hours, 2..=2)? * 60 + minutes) * 60 * SECOND;
    let sign = if text[at..].starts_with('+') { 1 } else { -1 };
    Some(time_of_day(text[..at].trim())? - sign * ahead)
}

/// Nanoseconds of `23:59:59`, with a fraction after a point or a comma.
fn time_of_day(text: &str) -> Option<i64> {
    let parts: Vec<&str> = text.split(':').collect();
    let [hours, minutes, seconds] = parts.as_slice() else { return None };
    let (seconds, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ""));
    let (hours, minutes, seconds) = (whole(hours, 1..=2)?, whole(minutes, 2..=2)?, whole(seconds, 2..=2)?);
    if hours > 23 || minutes > 59 || seconds > 60 {
        return None;
    }
    let nanoseconds = if fraction.is_empty() { 0 } else { whole(&format!("{fraction:0<9}"), 9..=9)? };
    Some(((hours * 60 + minutes) * 60 + seconds) * SECOND + nanoseconds)
}

/// Columns of points in time while a file is read.
#[derive(Clone, Debug, Default)]
pub(super) struct Stamps {
    /// What each column says, where it holds points in time.
    kinds: Vec<Option<Kind>>,
    /// Columns in which something else stands.
    closed: Vec<bool>,
    /// The last point of each column.
    last: Vec<Option<i64>>,
    /// The first point of the file by what it says; columns of one kind count from the same one.
    first: [Option<i64>; 3],
}

impl Stamps {
    /// Makes room for columns.
    pub(super) fn of(width: usize) -> Self {
        Self { kinds: vec![None; width], closed: vec![false; width], last: vec![None; width], first: [None; 3] }
    }

    /// A number stands in a column: it holds no points in time unless it did before, in which case the number is none of it.
    pub(super) fn close(&mut self, column: usize) -> bool {
        self.closed[column] = true;
        self.kinds[column].is_none()
    }

    /// The next field of a column as seconds from the first row of the file; none where it is no point in time of the column's kind.
    pub(super) fn next(&mut self, column: usize, field: &str) -> Option<f64> {
        if self.closed[column] && self.kinds[column].is_none() {
            return None;
        }
        let Some((kind, mut point)) = stamp(field) else {
            self.closed[column] = true;
            return None;
        };
        if *self.kinds[column].get_or_insert(kind) != kind {
            return None;
        }
        let first = *self.first[kind as usize].get_or_insert(point);
        if kind == Kind::Time {
            let before = self.last[column].unwrap_or(first);
            point += ((before - point + DAY / 2).div_euclid(DAY)) * DAY;
        }
        self.last[column] = Some(point);
        Some((point - first) as f64 / SECOND as f64)
    }

    /// What each column says, where it holds points in time.
    pub(super) fn into_kinds(self) -> Vec<Option<Kind>> {
        self.kinds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_time_are_read() {
        // Seconds since 1970 as `date -u -d ... +%s` says them.
        for (field, kind, seconds, nanoseconds) in [
            ("2024-03-01 23:59:59.900", Kind::Point, 1_709_337_599, 900_000_000),
            ("2024/03/01 23:59:59,900", Kind::Point, 1_709_337_599, 900_000_000),
            ("01.03.2024 23:59:59", Kind::Point, 1_709_337_599, 0),
            ("2024-02-29T00:00:00Z", Kind::Point, 1_709_164_800, 0),
            ("2024-03-01T01:30:00+01:00", Kind::Point, 1_709_253_000, 0),
            ("2024-03-01T01:30:00-0130", Kind::Point, 1_709_262_000, 0),
            ("1.3.2024", Kind::Day, 1_709_251_200, 0),
            ("22:59:59,900", Kind::Time, 82_799, 900_000_000),
            ("0:00:00.000000001", Kind::Time, 0, 1),
        ] {
            assert_eq!(stamp(field), Some((kind, seconds * SECOND + nanoseconds)), "{field}");
        }
        for field in ["12.5", "1.5e-3", "03/01/2024 10:00:00", "10:30", "24:00:00", "2024-13-01", "10:00:61", "1.2.3"] {
            assert_eq!(stamp(field), None, "{field}");
        }
    }

    #[test]
    fn times_of_day_go_on_after_midnight() {
        let mut stamps = Stamps::of(2);
        let mut next = |column, field| stamps.next(column, field).map(|t| (t * 1e3).round() / 1e3);
        assert_eq!(next(0, "23:59:59.9"), Some(0.0));
        assert_eq!(next(0, "00:00:00.1"), Some(0.2));
        assert_eq!(next(0, "00:00:00.2"), Some(0.3));
        // A second column counts from the same point.
        assert_eq!(next(1, "00:00:00.0"), Some(0.1));
        assert_eq!(next(1, "2024-03-01 00:00:01"), None);
        assert_eq!(stamps.into_kinds(), [Some(Kind::Time); 2]);
    }
}
