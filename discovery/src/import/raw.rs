//! A file as columns of numbers, before anything is assumed about what they mean.

use super::clocks::is_called_time;
use super::decode::decode;
use super::fields::{Delimiter, number, split};
use super::layout::{TextLayout, bare};
use super::stamp::{Kind, Stamps};
use super::unit::heading;
use crate::Fault;

/// What a file holds.
pub enum Content {
    /// The bytes of a text.
    Text(Vec<u8>),
    /// Columns of a file that has names and numbers of its own: name and values.
    Columns(Vec<(String, Vec<f64>)>),
}

/// Columns of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Raw {
    /// Headings.
    pub headings: Vec<String>,
    /// Row of units, empty where there is none.
    pub units: Vec<String>,
    /// Values by column; NaN for gaps and for what is not a number.
    pub columns: Vec<Vec<f64>>,
    /// Line of each row; empty where the file has none.
    pub lines: Vec<u32>,
    /// The first field of a column that is not a number: its line and what it is.
    pub texts: Vec<Option<(usize, String)>>,
    /// Lines before the header.
    pub preamble: Vec<String>,
    /// What columns of points in time say.
    pub stamps: Vec<Option<Kind>>,
    /// Columns of times that got another heading, as an earlier one has theirs: position and heading in the file.
    pub renamed: Vec<(usize, String)>,
}

impl Raw {
    /// The line of a row as the beginning of a sentence.
    pub(super) fn place(&self, row: usize) -> String {
        self.lines.get(row).map_or_else(|| format!("row {}", row + 1), |line| format!("line {line}"))
    }

    /// Columns of a file with names.
    ///
    /// # Errors
    /// When columns have different lengths, or two have one name.
    pub(super) fn of_columns(columns: &[(String, Vec<f64>)]) -> Result<Self, Fault> {
        let mut raw = Self::default();
        let Some((first, values)) = columns.first() else { return Err(Fault::new("it holds no columns of numbers")) };
        if values.is_empty() {
            return Err(Fault::new("its columns hold no rows"));
        }
        if let Some((name, own)) = columns.iter().find(|(_, own)| own.len() != values.len()) {
            let (rows, others) = (own.len(), values.len());
            return Err(Fault::new(format!(
                "`{name}` has {rows} rows and `{first}` has {others}; they are not one table"
            )));
        }
        for (name, values) in columns {
            raw.headings.push(name.clone());
            raw.columns.push(values.clone());
            raw.texts.push(None);
            raw.stamps.push(None);
        }
        raw.number_times();
        raw.refuse_twice(0)?;
        Ok(raw)
    }

    /// The text of a file by its layout.
    ///
    /// # Errors
    /// A sentence with the line at fault, without the name of the file.
    pub(super) fn of_text(text: &str, layout: &TextLayout) -> Result<Self, Fault> {
        let mut raw = Self::default();
        let (mut width, mut stamps) = (None, Stamps::default());
        for (k, line) in text.lines().enumerate() {
            let at = k + 1;
            if at == layout.header_line || at == layout.unit_line {
                let mut fields = split(line.trim_start_matches(['#', '%']), layout.delimiter);
                if at == layout.header_line {
                    raw.headings = fields;
                } else {
                    fields.iter_mut().for_each(|field| *field = bare(field).to_string());
                    raw.units = fields;
                }
                continue;
            }
            if at < layout.first_line {
                if layout.header_line == 0 || at < layout.header_line {
                    raw.preamble.push(line.to_string());
                }
                continue;
            }
            if line.trim().is_empty() {
                continue;
            }
            let fields = split(line, layout.delimiter);
            let width = *width.get_or_insert_with(|| {
                let width = raw.begin(&fields);
                stamps = Stamps::of(width);
                width
            });
            let extra = fields.get(width..).unwrap_or_default().iter().find(|field| !field.is_empty());
            if fields.len() < width || extra.is_some() {
                let count = if fields.len() == 1 { "1 field".to_string() } else { format!("{} fields", fields.len()) };
                let before = raw.lines.last().copied().unwrap_or_default();
                let sentence = if raw.lines.is_empty() {
                    format!("line {at} has {count}, and the header {width}")
                } else {
                    format!("line {at} has {count}, and line {before} has {width}")
                };
                return Err(Fault::new(sentence));
            }
            raw.lines.push(u32::try_from(at).unwrap_or(u32::MAX));
            for (column, field) in fields.iter().take(width).enumerate() {
                let value = match number(field, layout.decimal) {
                    Some(gap) if gap.is_nan() => Some(gap),
                    Some(value) => stamps.close(column).then_some(value),
                    None => stamps.next(column, field),
                };
                if value.is_none() && raw.texts[column].is_none() {
                    raw.texts[column] = Some((at, field.chars().take(60).collect()));
                }
                raw.columns[column].push(value.unwrap_or(f64::NAN));
            }
        }
        if raw.lines.is_empty() {
            let line = layout.first_line;
            return Err(Fault::new(format!("line {line}: there are no rows of numbers from this line on")));
        }
        raw.stamps = stamps.into_kinds();
        raw.drop_nameless();
        raw.number_times();
        raw.refuse_twice(layout.header_line)?;
        Ok(raw)
    }

    /// Makes the columns that a first row asks for; the number of fields of a row.
    fn begin(&mut self, fields: &[String]) -> usize {
        let width = match self.headings.len() {
            0 => fields.len(),
            headings => headings.min(fields.len().max(1)),
        };
        if self.headings.is_empty() {
            self.headings = (1..=width).map(|k| format!("column {k}")).collect();
        }
        self.headings.truncate(width);
        self.columns = vec![Vec::new(); width];
        self.texts = vec![None; width];
        width
    }

    /// Leaves out columns without a heading in which nothing stands: rows may end in a delimiter.
    fn drop_nameless(&mut self) {
        for k in (0..self.headings.len()).rev() {
            let is_empty = self.columns[k].iter().all(|value| value.is_nan()) && self.texts[k].is_none();
            if self.headings[k].is_empty() && is_empty {
                self.headings.remove(k);
                self.columns.remove(k);
                self.texts.remove(k);
                self.stamps.remove(k);
                if k < self.units.len() {
                    self.units.remove(k);
                }
            } else if self.headings[k].is_empty() {
                self.headings[k] = format!("column {}", k + 1);
            }
        }
    }

    /// Gives columns of times that are called alike a number each: `Time [s]`, `Time 2 [s]`.
    fn number_times(&mut self) {
        for k in 1..self.headings.len() {
            let own = self.headings[k].clone();
            let is_twice = self.headings[..k].contains(&own);
            if !is_twice || !is_called_time(&own, self.units.get(k).map(String::as_str)) {
                continue;
            }
            let (name, unit) = heading(&own);
            // The unit is a part of a name like `t_ms`.
            let stem = unit.and_then(|unit| Some(name.strip_suffix(&unit)?.strip_suffix('_')?.to_string()));
            let stem = stem.unwrap_or(name);
            let numbered = (2..).map(|n| own.replacen(&stem, &format!("{stem} {n}"), 1));
            // The numbers are endless, and finitely many headings are taken.
            if let Some(free) = numbered.into_iter().find(|name| !self.headings.contains(name)) {
                self.headings[k] = free;
                self.renamed.push((k, own));
            }
        }
    }

    fn refuse_twice(&self, line: usize) -> Result<(), Fault> {
        for (k, name) in self.headings.iter().enumerate() {
            if let Some(first) = self.headings[..k].iter().position(|other| other == name) {
                let place = if line > 0 { format!("line {line}: ") } else { String::new() };
                let (first, second) = (first + 1, k + 1);
                let sentence =
                    format!("{place}the columns {first} and {second} are both called `{name}`; give one another name");
                return Err(Fault::new(sentence));
            }
        }
        Ok(())
    }
}

/// The text of a file; `stated` is its encoding where somebody has said it.
///
/// # Errors
/// A sentence without the name of the file.
pub(super) fn text_of(bytes: &[u8], stated: Option<&str>) -> Result<(String, &'static str), Fault> {
    decode(bytes, stated)
}

/// The delimiter of a layout that was checked.
pub(super) fn delimiter(name: &str) -> Delimiter {
    Delimiter::of(name).unwrap_or(Delimiter::Character(','))
}
