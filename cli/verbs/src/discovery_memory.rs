//! `DIR/fits.jsonl`: what a search has fitted so far, so that `--resume` goes on after an interrupt.
//!
//! The first line says what was searched (a hash of study, set, tables, model, libraries' effects and version); fits of
//! anything else are not taken over.  A line is written after each fit; one that a kill has torn is not read.  A
//! finished search removes it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use hyd_discovery::{Memory, Watch};
use serde_json::{Value, json};

/// Name in the folder of the report.
pub(crate) const MEMORY: &str = "fits.jsonl";

/// Fits in a file.
pub(crate) struct FitsFile {
    path: PathBuf,
    known: BTreeMap<String, Vec<f64>>,
    file: RefCell<File>,
    watch: Watch,
}

impl FitsFile {
    /// Opens the file of a folder; with `resume` fits of the same search are taken over.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(crate) fn open(folder: &Path, hash: u64, resume: bool, watch: &Watch) -> io::Result<Self> {
        let path = folder.join(MEMORY);
        let header = json!({"hyd": env!("CARGO_PKG_VERSION"), "search": format!("{hash:016x}")});
        let known = if resume { read(&path, &header).unwrap_or_default() } else { BTreeMap::new() };
        // Written anew, so that what a kill has torn is gone.
        let mut text = format!("{header}\n");
        for (key, xi) in &known {
            text.push_str(&line(key, xi));
        }
        hyd_results::write_whole(&path, text.as_bytes())?;
        let file = OpenOptions::new().append(true).open(&path)?;
        Ok(Self { path, known, file: RefCell::new(file), watch: watch.clone() })
    }

    /// Number of fits taken over.
    pub(crate) fn taken_over(&self) -> usize {
        self.known.len()
    }

    /// The search is finished.
    pub(crate) fn remove(self) {
        // A file that stays behind is only taken for the same search again.
        let _ = fs::remove_file(&self.path);
    }
}

impl Memory for FitsFile {
    fn recall(&self, key: &str) -> Option<Vec<f64>> {
        self.known.get(key).cloned()
    }

    fn keep(&self, key: &str, xi: &[f64]) {
        // A fit that was ended in the middle is none.
        if self.watch.stopped() {
            return;
        }
        // A disk that is full costs the resumption, not the search; the report tells of a full disk.
        let _ = self.file.borrow_mut().write_all(line(key, xi).as_bytes());
    }
}

fn line(key: &str, xi: &[f64]) -> String {
    // Bits, so that a number comes back as it was.
    let bits: Vec<String> = xi.iter().map(|value| format!("{:016x}", value.to_bits())).collect();
    format!("{}\n", json!({"fit": key, "xi": bits}))
}

fn read(path: &Path, header: &Value) -> Option<BTreeMap<String, Vec<f64>>> {
    let mut lines = BufReader::new(File::open(path).ok()?).lines();
    let first: Value = serde_json::from_str(&lines.next()?.ok()?).ok()?;
    if first != *header {
        return None;
    }
    let mut known = BTreeMap::new();
    for text in lines.map_while(Result::ok) {
        let Ok(own) = serde_json::from_str::<Value>(&text) else { continue };
        let number = |bits: &Value| u64::from_str_radix(bits.as_str()?, 16).ok().map(f64::from_bits);
        let xi = own["xi"].as_array().and_then(|list| list.iter().map(number).collect::<Option<Vec<f64>>>());
        if let (Some(key), Some(xi)) = (own["fit"].as_str(), xi) {
            known.insert(key.to_string(), xi);
        }
    }
    Some(known)
}

/// FNV-1a over what decides a search.
pub fn hash<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    parts.into_iter().fold(0xcbf2_9ce4_8422_2325, |hash, part| part.iter().chain(&[0xff]).fold(hash, step))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_fits_of_the_same_search_are_taken_over() {
        let folder = std::env::temp_dir().join(format!("hyd-fits-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let first = FitsFile::open(&folder, 7, false, &Watch::default()).unwrap();
        first.keep("alone: the base model", &[0.1, -3e-300, f64::MIN_POSITIVE]);
        drop(first);
        let mut file = OpenOptions::new().append(true).open(folder.join(MEMORY)).unwrap();
        file.write_all(b"{\"fit\": \"torn\", \"xi\": [\"3f").unwrap();
        let again = FitsFile::open(&folder, 7, true, &Watch::default()).unwrap();
        assert_eq!(again.taken_over(), 1);
        assert_eq!(again.recall("alone: the base model"), Some(vec![0.1, -3e-300, f64::MIN_POSITIVE]));
        drop(again);
        assert_eq!(FitsFile::open(&folder, 8, true, &Watch::default()).unwrap().taken_over(), 0);
        assert_eq!(FitsFile::open(&folder, 8, false, &Watch::default()).unwrap().taken_over(), 0);
        fs::remove_dir_all(&folder).unwrap();
    }
}
