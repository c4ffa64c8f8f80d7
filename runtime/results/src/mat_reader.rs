//! A MAT file of version 4 in the layout of Modelica tools, read back as a [`Table`].
//!
//! Takes what [`crate::MatStream`] writes and what Dymola and OpenModelica write alike: texts and matrices upright or transposed
//! (`binNormal`, `binTrans`), numbers of 8 or 4 bytes.  Everything that does not fit is refused with the matrix at fault; sizes
//! are checked against the file before anything is reserved.

use crate::Table;

/// A matrix of the file.
struct Matrix<'a> {
    name: &'a [u8],
    precision: u32,
    rows: usize,
    columns: usize,
    bytes: &'a [u8],
}

/// Reads the bytes of a file; a sentence if they are not such a file.
pub(crate) fn read(bytes: &[u8]) -> Result<Table, String> {
    let matrices = matrices(bytes)?;
    let find = |name: &str| {
        let found = matrices.iter().find(|matrix| matrix.name == name.as_bytes());
        found.ok_or_else(|| format!("matrix `{name}` is missing; it is not a result of a simulation"))
    };
    let class = find("Aclass")?.texts(false);
    let transposed = class.iter().any(|text| text == "binTrans");
    if !transposed && !class.iter().any(|text| text == "binNormal") {
        return Err("matrix `Aclass` says neither `binTrans` nor `binNormal`".to_string());
    }
    let names = find("name")?.texts(transposed);
    let info = find("dataInfo")?.numbers(transposed)?;
    if info.len() != names.len() || info.iter().any(|row| row.len() < 2) {
        return Err("matrices `name` and `dataInfo` do not match".to_string());
    }
    let varying = find("data_2")?;
    let (fixed, mut series) = (find("data_1")?.numbers(!transposed)?, varying.numbers(!transposed)?);
    if varying.rows.min(varying.columns) == 0 {
        series.clear();
    }
    table(&names, &info, &fixed, series)
}

/// Name and columns of a matrix.
pub(crate) type NamedColumns = (String, Vec<Vec<f64>>);

/// All matrices of such a file as columns; those that are not of long numbers have none.
pub(crate) fn numbers(bytes: &[u8]) -> Result<Vec<NamedColumns>, String> {
    let matrices = matrices(bytes)?;
    // Short integers and texts have no columns here, which the caller says.
    let columns = |matrix: &Matrix<'_>| if matrix.precision > 2 { Ok(Vec::new()) } else { matrix.numbers(true) };
    matrices.iter().map(|matrix| Ok((String::from_utf8_lossy(matrix.name).into_owned(), columns(matrix)?))).collect()
}

/// `fixed` and `varying` hold one vector per variable.
fn table(names: &[String], info: &[Vec<f64>], fixed: &[Vec<f64>], varying: Vec<Vec<f64>>) -> Result<Table, String> {
    let mut table = Table { times: varying.first().cloned().unwrap_or_default(), ..Table::default() };
    if table.times.windows(2).any(|pair| pair[1] < pair[0]) || table.times.iter().any(|t| t.is_nan()) {
        return Err("time runs backwards".to_string());
    }
    for (name, place) in names.iter().zip(info).skip(1) {
        let (row, sign) = (place[1].abs() as usize, if place[1] < 0.0 { -1.0 } else { 1.0 });
        let matrix = if place[0] == 1.0 { fixed } else { &varying };
        let found = row.checked_sub(1).and_then(|k| matrix.get(k));
        match found {
            Some(values) if place[0] == 1.0 => {
                let value = values.first().ok_or_else(|| format!("`{name}` has no value"))?;
                table.constants.push((name.clone(), sign * value));
            }
            Some(values) => {
                table.names.push(name.clone());
                table.columns.push(values.iter().map(|value| sign * value).collect());
            }
            None if varying.is_empty() && place[0] != 1.0 => {
                table.names.push(name.clone());
                table.columns.push(Vec::new());
            }
            None => return Err(format!("`{name}` points to row {row}, which does not exist")),
        }
    }
    Ok(table)
}

fn matrices(file: &[u8]) -> Result<Vec<Matrix<'_>>, String> {
    let mut all = Vec::new();
    let mut bytes = file;
    while !bytes.is_empty() {
        let word = |k: usize| {
            let at = bytes.get(4 * k..4 * k + 4).and_then(|b| b.try_into().ok());
            at.map(u32::from_le_bytes).ok_or_else(|| "the file ends within a header".to_string())
        };
        let (kind, rows, columns, length) = (word(0)?, word(1)? as usize, word(2)? as usize, word(4)? as usize);
        let precision = kind / 10 % 10;
        let size = match precision {
            0 => 8,
            1 | 2 => 4,
            3 | 4 => 2,
            5 => 1,
            _ => return Err("it is not a MAT file of version 4".to_string()),
        };
        if kind >= 1000 || word(3)? != 0 {
            return Err("it is not a MAT file of version 4 with little-endian real numbers".to_string());
        }
        let name_end = 20usize.checked_add(length).filter(|&end| length > 0 && end <= bytes.len());
        let name = name_end.map(|end| &bytes[20..end - 1]).ok_or("the file ends within a name")?;
        let total = rows.checked_mul(columns).and_then(|n| n.checked_mul(size));
        let end = total.and_then(|n| n.checked_add(20 + length)).filter(|&end| end <= bytes.len());
        let shown = String::from_utf8_lossy(name);
        // A matrix without elements has any number of rows or columns in no bytes, and each of them becomes a vector.
        if rows.max(columns) > file.len() {
            return Err(format!(
                "matrix `{shown}` has {rows} rows and {columns} columns, more than such a file can hold"
            ));
        }
        let end = end.ok_or_else(|| format!("the file ends within matrix `{shown}`"))?;
        all.push(Matrix { name, precision, rows, columns, bytes: &bytes[20 + length..end] });
        bytes = &bytes[end..];
    }
    if all.is_empty() { Err("the file is empty".to_string()) } else { Ok(all) }
}

impl Matrix<'_> {
    /// The rows, or the columns if `transposed`, as texts without padding.
    fn texts(&self, transposed: bool) -> Vec<String> {
        let (count, width) = if transposed { (self.columns, self.rows) } else { (self.rows, self.columns) };
        let at = |text: usize, k: usize| {
            let place = if transposed { text * self.rows + k } else { k * self.rows + text };
            self.character(place)
        };
        let text = |text: usize| {
            let bytes: Vec<u8> = (0..width).map(|k| at(text, k)).collect();
            String::from_utf8_lossy(&bytes).trim_end_matches([' ', '\0']).to_string()
        };
        (0..count).map(text).collect()
    }

    /// A character; some tools store them as numbers.
    fn character(&self, place: usize) -> u8 {
        if self.precision == 5 {
            return self.bytes.get(place).copied().unwrap_or(0);
        }
        self.number(place).unwrap_or(0.0) as u8
    }

    /// The columns, or the rows if not `by_column`, as numbers.
    fn numbers(&self, by_column: bool) -> Result<Vec<Vec<f64>>, String> {
        if self.precision > 2 {
            return Err(format!("matrix `{}` holds no numbers", String::from_utf8_lossy(self.name)));
        }
        let (count, width) = if by_column { (self.columns, self.rows) } else { (self.rows, self.columns) };
        let at = |line: usize, k: usize| {
            let place = if by_column { line * self.rows + k } else { k * self.rows + line };
            self.number(place).unwrap_or(f64::NAN)
        };
        Ok((0..count).map(|line| (0..width).map(|k| at(line, k)).collect()).collect())
    }

    fn number(&self, place: usize) -> Option<f64> {
        let size = if self.precision == 0 { 8 } else { 4 };
        let bytes = self.bytes.get(place * size..(place + 1) * size)?;
        Some(match self.precision {
            0 => f64::from_le_bytes(bytes.try_into().ok()?),
            1 => f32::from_le_bytes(bytes.try_into().ok()?).into(),
            _ => i32::from_le_bytes(bytes.try_into().ok()?).into(),
        })
    }
}
