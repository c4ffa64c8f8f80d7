//! The numbers of any MAT file of version 4 or 5 as columns, whatever wrote it.
//!
//! Vectors are columns, matrices as many as they have columns, or rows where these are fewer.  Vectors within structures and cells have
//! the names of all that they stand in, but for what a single structure of the file is called.  A structure with a `time` and
//! `signals`, as Simulink saves it ("Structure With Time"), is one column for each signal.  Times of structures that agree are one
//! column.  Version 7.3 is HDF5, which is not read.

use crate::mat_reader;
use crate::mat5::{self, Value};

/// Most columns of all matrices.
const MOST_COLUMNS: usize = 10_000;
/// What MATLAB makes numbers of the times of a timetable with.
const SECONDS: &str = "s.Time = seconds(s.Time); ";
/// Name of the times of a structure, and of all that agree.
const TIME: &str = "time";

/// Columns of a MAT file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct MatColumns {
    /// Names and values.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Names of what is not a vector or matrix of real numbers.
    pub others: Vec<String>,
    /// Names of the columns that are the times of a structure.
    times: Vec<String>,
    /// Names and classes of objects of MATLAB's own.
    objects: Vec<(String, String)>,
}

/// Reads the bytes of a MAT file.
///
/// # Errors
/// A sentence without the name of the file.
pub fn mat_columns(bytes: &[u8]) -> Result<MatColumns, String> {
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
        return Err("it is a MAT file of version 7.3, which is not supported; save it with -v7".to_string());
    }
    let mut found = MatColumns::default();
    if mat5::is_mat5(bytes) {
        // What has no name is for MATLAB itself.
        let variables: Vec<_> = mat5::variables(bytes)?.into_iter().filter(|(name, _)| !name.is_empty()).collect();
        let is_single = variables.len() == 1;
        for (name, value) in variables {
            let is_bare = is_single && matches!(&value, Value::Structures { rows, .. } if rows.len() == 1);
            found.take(name, value, is_bare)?;
        }
        found.merge_times();
    } else {
        for (name, columns) in mat_reader::numbers(bytes)? {
            found.add(name, columns)?;
        }
    }
    if found.columns.is_empty() {
        let others = found.others.join(", ");
        let others = if others.is_empty() { String::new() } else { format!("; it has: {others}") };
        return Err(format!("it holds no vectors of real numbers{others}{}", found.way_out()));
    }
    Ok(found)
}

impl MatColumns {
    /// How MATLAB writes what its objects hold as vectors; empty without such objects.
    fn way_out(&self) -> String {
        let Some((name, class)) = self.objects.first() else { return String::new() };
        // Times of the rows are durations, which are objects themselves.
        let (what, table, times) = match class.as_str() {
            "table" => ("table", name.clone(), ""),
            "timetable" => ("timetable", format!("timetable2table({name})"), SECONDS),
            "Simulink.SimulationData.Dataset" => {
                ("data set of Simulink", format!("timetable2table(extractTimetable({name}))"), SECONDS)
            }
            _ => return format!(" (`{name}` is a MATLAB object of class `{class}`, which only MATLAB reads)"),
        };
        format!(
            " (`{name}` is a {what}, which only MATLAB reads: there, `s = table2struct({table}, 'ToScalar', true); \
             {times}save('columns.mat', '-struct', 's', '-v7')` saves its columns)"
        )
    }

    /// Takes up a variable or a part of one; the parts of one `is_bare` have no other names than their own.
    fn take(&mut self, name: String, value: Value, is_bare: bool) -> Result<(), String> {
        let within = |part: &str| if is_bare { part.to_string() } else { format!("{name}_{part}") };
        match value {
            Value::Numbers(columns) => return self.add(name, columns),
            Value::Text(_) | Value::Other => self.others.push(name),
            Value::Object(class) => {
                self.objects.push((name.clone(), class));
                self.others.push(name);
            }
            Value::Cells(parts) if parts.is_empty() => self.others.push(name),
            Value::Structures { rows, .. } if rows.is_empty() => self.others.push(name),
            Value::Cells(parts) => {
                for (k, part) in parts.into_iter().enumerate() {
                    self.take(within(&(k + 1).to_string()), part, false)?;
                }
            }
            Value::Structures { fields, mut rows } => {
                let place = |name: &str| fields.iter().position(|own| own == name);
                if let ([row], Some(time), Some(signals)) = (&mut rows[..], place(TIME), place("signals"))
                    && let Value::Structures { fields: parts, .. } = &row[signals]
                    && let Some(values) = parts.iter().position(|own| own == "values")
                {
                    let label = parts.iter().position(|own| own == "label");
                    let times = std::mem::replace(&mut row[time], Value::Other);
                    let signals_of = std::mem::replace(&mut row[signals], Value::Other);
                    if let Value::Structures { rows, .. } = signals_of {
                        self.signals(&name, times, rows, (values, label))?;
                    }
                    // Its other fields, but for the name of the block that wrote it.
                    let others = fields.iter().zip(std::mem::take(row)).enumerate();
                    for (k, (field, value)) in others {
                        if k != time && k != signals && field != "blockName" {
                            self.take(within(field), value, false)?;
                        }
                    }
                    return Ok(());
                }
                let is_array = rows.len() > 1;
                for (k, row) in rows.into_iter().enumerate() {
                    for (field, value) in fields.iter().zip(row) {
                        let part = within(&if is_array { format!("{}_{field}", k + 1) } else { field.clone() });
                        if field == TIME {
                            self.times.push(part.clone());
                        }
                        self.take(part, value, false)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes up signals that share their times; each has its label, or the name of the whole.
    fn signals(
        &mut self,
        name: &str,
        times: Value,
        signals: Vec<Vec<Value>>,
        (values, label): (usize, Option<usize>),
    ) -> Result<(), String> {
        let own = format!("{name}_{TIME}");
        self.times.push(own.clone());
        self.take(own, times, false)?;
        let is_single = signals.len() == 1;
        for (k, mut signal) in signals.into_iter().enumerate() {
            let own = match label.map(|label| &signal[label]) {
                Some(Value::Text(text)) if !text.is_empty() && !is_single => text.clone(),
                _ if is_single => name.to_string(),
                _ => format!("{name}_{}", k + 1),
            };
            let value = signal.swap_remove(values);
            self.take(own, value, false)?;
        }
        Ok(())
    }

    /// Times of structures that agree, with a variable `time` if there is one, are one column before all others.
    fn merge_times(&mut self) {
        let is_time = |name: &str| name == TIME || self.times.iter().any(|own| own == name);
        let mut times = self.columns.iter().filter(|(name, _)| is_time(name));
        let Some((_, first)) = times.next() else { return };
        let first = first.clone();
        if self.times.is_empty() || times.any(|(_, own)| *own != first) {
            return;
        }
        let mut merged = vec![(TIME.to_string(), first)];
        merged.extend(std::mem::take(&mut self.columns).into_iter().filter(|(name, _)| !is_time(name)));
        self.columns = merged;
    }

    fn add(&mut self, name: String, columns: Vec<Vec<f64>>) -> Result<(), String> {
        let rows = columns.first().map_or(0, Vec::len);
        // A wide matrix has a signal in each row.
        let series: Vec<Vec<f64>> = match columns.len() > rows {
            true => (0..rows).map(|row| columns.iter().map(|column| column[row]).collect()).collect(),
            false => columns,
        };
        if self.columns.len() + series.len() > MOST_COLUMNS {
            return Err(format!("`{name}`: there are more than {MOST_COLUMNS} columns"));
        }
        match series.as_slice() {
            [] => self.others.push(name),
            [only] if only.len() < 2 => self.others.push(name),
            [_] => self.columns.extend(series.into_iter().map(|own| (name.clone(), own))),
            _ => {
                let numbered = series.into_iter().enumerate();
                self.columns.extend(numbered.map(|(k, own)| (format!("{name}_{}", k + 1), own)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const MATRIX: u32 = 14;
    const COMPRESSED: u32 = 15;

    fn element(kind: u32, bytes: &[u8]) -> Vec<u8> {
        let mut all = [kind.to_le_bytes(), (bytes.len() as u32).to_le_bytes()].concat();
        all.extend(bytes);
        if kind != COMPRESSED {
            all.resize(all.len().next_multiple_of(8), 0);
        }
        all
    }

    fn matrix(name: &str, class: u32, rows: u32, columns: u32, numbers: &[u8]) -> Vec<u8> {
        let dimensions = [rows.to_le_bytes(), columns.to_le_bytes()].concat();
        let flags = [class.to_le_bytes(), [0; 4]].concat();
        element(
            MATRIX,
            &[element(6, &flags), element(5, &dimensions), element(1, name.as_bytes()), numbers.to_vec()].concat(),
        )
    }

    fn file(elements: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
        bytes.resize(124, b' ');
        bytes.extend(b"\x00\x01IM");
        bytes.extend(elements.concat());
        bytes
    }

    #[test]
    fn vectors_and_matrices_become_columns() {
        // Numbers are often written as a smaller type; two bytes stand within the tag.
        let small = [&(1_u32 | 2 << 16).to_le_bytes()[..], &[5, 0xff, 0, 0]].concat();
        let packed =
            miniz_oxide::deflate::compress_to_vec_zlib(&matrix("p", 6, 2, 2, &doubles(&[1.0, 2.0, 3.0, 4.0])), 6);
        let bytes = file(&[
            matrix("t", 6, 2, 1, &doubles(&[0.0, 0.5])),
            element(COMPRESSED, &packed),
            matrix("n", 8, 1, 2, &small),
            matrix("fs", 6, 1, 1, &doubles(&[1e4])),
            matrix("words", 4, 1, 2, &small),
        ]);
        let found = mat_columns(&bytes).unwrap();
        let expected = [("t", [0.0, 0.5]), ("p_1", [1.0, 2.0]), ("p_2", [3.0, 4.0]), ("n", [5.0, -1.0])];
        let expected: Vec<(String, Vec<f64>)> =
            expected.iter().map(|(name, values)| ((*name).to_string(), values.to_vec())).collect();
        assert_eq!((found.columns, found.others), (expected, vec!["fs".to_string(), "words".to_string()]));
        for end in 0..bytes.len() {
            // Whatever is cut off, there is an answer.
            let _ = mat_columns(&bytes[..end]);
        }
    }

    /// A structure whose fields are matrices without names.
    fn structure(name: &str, fields: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let length = [&(5_u32 | 4 << 16).to_le_bytes()[..], &8_u32.to_le_bytes()].concat();
        let names: Vec<u8> = fields.iter().flat_map(|(name, _)| format!("{name:\0<8}").into_bytes()).collect();
        let parts: Vec<u8> = fields.iter().flat_map(|(_, part)| part.clone()).collect();
        matrix(name, 2, 1, 1, &[length, element(1, &names), parts].concat())
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        element(9, &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
    }

    fn column(values: &[f64]) -> Vec<u8> {
        matrix("", 6, values.len() as u32, 1, &doubles(values))
    }

    fn text(words: &str) -> Vec<u8> {
        let units: Vec<u8> = words.encode_utf16().flat_map(u16::to_le_bytes).collect();
        matrix("", 4, 1, words.len() as u32, &element(4, &units))
    }

    #[test]
    fn structures_become_columns_with_their_names() {
        let own = |parts: &[(&str, &[f64])]| -> Vec<(String, Vec<f64>)> {
            parts.iter().map(|(name, values)| ((*name).to_string(), values.to_vec())).collect()
        };
        // A single one of the file needs no name; one within another one does.
        let inner = structure("", &[("p", column(&[5.0, 6.0])), ("note", text("first shot"))]);
        let single = structure("data", &[("t", column(&[0.0, 0.1])), ("tank", inner)]);
        let found = mat_columns(&file(std::slice::from_ref(&single))).unwrap();
        assert_eq!(found.columns, own(&[("t", &[0.0, 0.1]), ("tank_p", &[5.0, 6.0])]));
        assert_eq!(found.others, ["tank_note"]);
        let two = file(&[single, matrix("u", 6, 2, 1, &doubles(&[1.0, 2.0]))]);
        assert_eq!(mat_columns(&two).unwrap().columns[1].0, "data_tank_p");
        // Signals one below the other.
        let wide = mat_columns(&file(&[matrix("log", 6, 2, 3, &doubles(&[0.0, 7.0, 0.1, 8.0, 0.2, 9.0]))])).unwrap();
        assert_eq!(wide.columns, own(&[("log_1", &[0.0, 0.1, 0.2]), ("log_2", &[7.0, 8.0, 9.0])]));
        // Cells are numbered.
        let cells = matrix("runs", 1, 1, 2, &[column(&[1.0, 2.0]), column(&[3.0, 4.0])].concat());
        let found = mat_columns(&file(&[cells])).unwrap();
        assert_eq!(found.columns, own(&[("runs_1", &[1.0, 2.0]), ("runs_2", &[3.0, 4.0])]));
        for end in 0..two.len() {
            let _ = mat_columns(&two[..end]);
        }
    }

    #[test]
    fn signals_with_their_time_are_one_table() {
        let log = |name: &str, times: &[f64], values: &[f64]| {
            let signals = structure("", &[("values", column(values)), ("label", text(""))]);
            structure(name, &[("time", column(times)), ("signals", signals), ("blockNam", text("To Workspace"))])
        };
        let both = file(&[log("Theta", &[0.0, 0.5], &[3.0, 3.1]), log("Speed", &[0.0, 0.5], &[0.0, -1.0])]);
        let found = mat_columns(&both).unwrap();
        let names: Vec<&str> = found.columns.iter().map(|own| own.0.as_str()).collect();
        assert_eq!(names, ["time", "Theta", "Speed"]);
        // Times of their own stay apart.
        let apart = file(&[log("Theta", &[0.0, 0.5], &[3.0, 3.1]), log("Speed", &[0.0, 0.4], &[0.0, -1.0])]);
        let found = mat_columns(&apart).unwrap();
        let names: Vec<&str> = found.columns.iter().map(|own| own.0.as_str()).collect();
        assert_eq!(names, ["Theta_time", "Theta", "Speed_time", "Speed"]);
        // A variable of that name is not a clock, and one called `time` is the same clock where it agrees.
        let rise = matrix("rise_time", 6, 2, 1, &doubles(&[1.0, 2.0]));
        let clock = matrix("time", 6, 2, 1, &doubles(&[0.0, 0.5]));
        for (first, expected) in
            [(rise.clone(), ["time", "rise_time", "Theta"].as_slice()), (clock, &["time", "Theta"])]
        {
            let found = mat_columns(&file(&[first, log("Theta", &[0.0, 0.5], &[3.0, 3.1])])).unwrap();
            assert_eq!(found.columns.iter().map(|own| own.0.as_str()).collect::<Vec<_>>(), expected);
        }
        let alone = mat_columns(&file(&[rise, matrix("t", 6, 2, 1, &doubles(&[0.0, 0.5]))])).unwrap();
        assert_eq!(alone.columns[0].0, "rise_time");
    }

    #[test]
    fn what_is_not_read_is_said() {
        assert!(mat_columns(b"MATLAB 7.3 MAT-file").unwrap_err().contains("-v7"));
        assert!(mat_columns(&file(&[])).unwrap_err().starts_with("it holds no vectors"));
        assert!(mat_columns(&file(&[element(COMPRESSED, b"nonsense")])).is_err());
        assert!(mat_columns(b"").is_err());
        // A table as MATLAB writes it.
        let words = |text: &str| element(1, text.as_bytes());
        let flags = element(6, &[17u32.to_le_bytes(), [0; 4]].concat());
        let table = element(MATRIX, &[flags, words("data"), words("MCOS"), words("table")].concat());
        let message = mat_columns(&file(&[table])).unwrap_err();
        assert!(
            message.contains("`data` is a table, which only MATLAB reads") && message.contains("table2struct(data, "),
            "{message}"
        );
    }
}
