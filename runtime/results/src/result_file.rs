//! The file of a run: a format chosen by its name, written under a temporary name until it is whole.
//!
//! A run that came to its end gives `F.csv`; one that failed or was stopped gives `F.partial.csv`, and one whose process is killed
//! leaves only the temporary file: nothing that is not whole stands under a name that says so, or replaces what is whole.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_system::{Tables, VariableInfo};

use crate::{CsvStream, MatStream, RowFile, RowKind, Sink, WholeFile};

/// The formats of this crate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Format {
    /// Text, `.csv` and everything that is no other format.
    Csv,
    /// MAT version 4, `.mat`.
    Mat,
}

impl Format {
    /// The format that the ending of a name asks for.
    pub fn of(path: &Path) -> Self {
        let extension = path.extension().unwrap_or_default();
        if extension.eq_ignore_ascii_case("mat") { Format::Mat } else { Format::Csv }
    }
}

/// A result file in the making.
pub struct ResultFile {
    path: PathBuf,
    whole: WholeFile,
    rows: Box<dyn RowFile>,
    count: u64,
}

impl ResultFile {
    /// Opens a file in the format of its name for the variables that `keep` accepts.
    pub fn create(path: &Path, keep: impl FnMut(&VariableInfo, &str) -> bool + Send + 'static) -> io::Result<Self> {
        Self::with(path, |file| {
            Ok(match Format::of(path) {
                Format::Csv => Box::new(CsvStream::new(file, keep)),
                Format::Mat => Box::new(MatStream::new(file, keep)?),
            })
        })
    }

    /// Opens a file whose rows `make` writes.
    pub fn with(path: &Path, make: impl FnOnce(File) -> io::Result<Box<dyn RowFile>>) -> io::Result<Self> {
        let whole = WholeFile::create(path)?;
        let rows = make(whole.writer()?)?;
        Ok(Self { path: path.to_path_buf(), whole, rows, count: 0 })
    }

    /// The run is over: gives the file its name.  `None` if there were no rows.
    pub fn complete(self) -> io::Result<Option<PathBuf>> {
        let path = self.path.clone();
        self.close(&path)
    }

    /// The run failed or was stopped: what there is gets a name that says so.  `None` if there were no rows.
    pub fn partial(self) -> io::Result<Option<PathBuf>> {
        let path = partial(&self.path);
        self.close(&path)
    }

    fn close(mut self, path: &Path) -> io::Result<Option<PathBuf>> {
        if self.count == 0 {
            return Ok(None);
        }
        self.rows.finish()?;
        self.whole.finish_as(path).map(Some)
    }
}

impl Sink for ResultFile {
    fn begin(&mut self, tables: &Arc<Tables>, parameters: &[f64]) -> io::Result<()> {
        self.rows.begin(tables, parameters)
    }

    fn row(&mut self, t: f64, values: &[f64], kind: RowKind) -> io::Result<()> {
        self.count += 1;
        self.rows.row(t, values, kind)
    }
}

/// `F.csv` to `F.partial.csv`: the name of what is not whole.
pub fn partial(path: &Path) -> PathBuf {
    match path.extension() {
        Some(extension) => path.with_extension(format!("partial.{}", extension.to_string_lossy())),
        None => path.with_extension("partial"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partial_results_have_a_name_of_their_own() {
        assert_eq!(partial(Path::new("a/b.csv")), Path::new("a/b.partial.csv"));
        assert_eq!(partial(Path::new("b")), Path::new("b.partial"));
    }

    #[test]
    fn the_name_chooses_the_format() {
        assert_eq!(Format::of(Path::new("a.MAT")), Format::Mat);
        assert_eq!(Format::of(Path::new("a.mat.csv")), Format::Csv);
    }
}
