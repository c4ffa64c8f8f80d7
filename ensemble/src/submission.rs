//! A sweep that is shared out: what machines without a compiler need to work off a share of it.
//!
//! In the folder of the results stands `submission/`: `submission.json` (this module), the executable of the model, and what else it takes.
//! It is written once, the manifest last and whole, and never changed; which jobs an engine has is known to the engine by the name of
//! the submission, and `jobs.jsonl` tells it to people.  A shard reads the manifest, runs those of its chunks that are not done, and
//! writes each as whole files (`folder`).  Shards know nothing of each other: one may run twice, at the same time or later, and leaves the same bytes.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hyd_results::write_whole;
use serde::{Deserialize, Serialize};

/// Version of the manifest.
const FORMAT: u32 = 1;
/// Name of the manifest.
const MANIFEST: &str = "submission.json";

/// A file that is shipped.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
pub struct Shipped {
    /// Its name in the folder of the submission.
    pub file: String,
    /// Its length.
    pub bytes: u64,
    /// FNV-1a of its bytes, in hexadecimal digits.
    pub hash: String,
}

/// What `submission.json` holds.
#[derive(Serialize, Deserialize, Clone, PartialEq, Eq, Debug)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this form.
    pub format: u32,
    /// By this an engine knows its tasks.
    pub name: String,
    /// Version of what made it.
    pub hyd: String,
    /// The model and its texts, as the executable says with `--version`.
    pub model: String,
    /// A hash of them.
    pub sources: String,
    /// The plan, TOML, with what is left to set at the run.
    pub plan: String,
    /// How many shares there are.
    pub shards: usize,
    /// Number of runs.
    pub members: usize,
    /// Threads of a shard.
    pub threads: usize,
    /// The executable.
    pub executable: Shipped,
    /// The model with whole loops, for runs in which rounding errors grow along a loop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub whole_loops: Option<Shipped>,
    /// Table of recorded inputs, and what they do between samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inputs: Option<(Shipped, Vec<String>)>,
}

impl Manifest {
    /// The present form.
    pub const FORMAT: u32 = FORMAT;
}

/// A submission in its folder.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Submission {
    /// The folder of the results.
    pub root: PathBuf,
    /// What it is.
    pub manifest: Manifest,
}

/// Why a submission cannot be used.
#[derive(Debug)]
pub enum SubmissionError {
    /// There is none.
    None(PathBuf),
    /// A file cannot be read or written.
    Io(PathBuf, io::Error),
    /// The manifest makes no sense, or is of another version.
    Manifest(PathBuf, String),
    /// A file is not what was shipped.
    Changed(PathBuf),
}

impl fmt::Display for SubmissionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SubmissionError::None(root) => write!(f, "`{}` holds no sweep that was shared out", root.display()),
            SubmissionError::Io(path, error) => write!(f, "`{}`: {error}", path.display()),
            SubmissionError::Manifest(path, reason) => write!(f, "`{}`: {reason}", path.display()),
            SubmissionError::Changed(path) => {
                write!(f, "`{}` is not the file that was shipped; choose an empty folder", path.display())
            }
        }
    }
}

impl std::error::Error for SubmissionError {}

impl Submission {
    /// The folder of a submission in that of its results.
    pub fn folder_in(root: &Path) -> PathBuf {
        root.join("submission")
    }

    /// Is there one?
    pub fn exists(root: &Path) -> bool {
        Self::folder_in(root).join(MANIFEST).exists()
    }

    /// Writes a file that is to be shipped, a program that others may run or data; the manifest comes after all of them.
    ///
    /// # Errors
    /// The system's.
    pub fn ship(root: &Path, file: &str, bytes: &[u8], runs: bool) -> Result<Shipped, SubmissionError> {
        let folder = Self::folder_in(root);
        let failed = |path: &Path| {
            let path = path.to_path_buf();
            move |error| SubmissionError::Io(path, error)
        };
        fs::create_dir_all(&folder).map_err(failed(&folder))?;
        let path = folder.join(file);
        write_whole(&path, bytes).map_err(failed(&path))?;
        if runs {
            allow_execution(&path).map_err(failed(&path))?;
        }
        Ok(Shipped { file: file.to_string(), bytes: bytes.len() as u64, hash: hash(bytes) })
    }

    /// Writes the manifest.
    ///
    /// # Errors
    /// The system's.
    pub fn begin(root: &Path, manifest: Manifest) -> Result<Self, SubmissionError> {
        let path = Self::folder_in(root).join(MANIFEST);
        let failed = |error| SubmissionError::Io(path.clone(), error);
        let logs = Self::folder_in(root).join("logs");
        fs::create_dir_all(&logs).map_err(|error| SubmissionError::Io(logs, error))?;
        let text = serde_json::to_string_pretty(&manifest).map_err(|error| failed(error.into()))?;
        write_whole(&path, format!("{text}\n").as_bytes()).map_err(failed)?;
        Ok(Self { root: root.to_path_buf(), manifest })
    }

    /// Reads the submission of a folder of results.
    ///
    /// # Errors
    /// There is none, or it cannot be read.
    pub fn read(root: &Path) -> Result<Self, SubmissionError> {
        let path = Self::folder_in(root).join(MANIFEST);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(SubmissionError::None(root.to_path_buf()));
            }
            Err(error) => return Err(SubmissionError::Io(path, error)),
        };
        match serde_json::from_str::<Manifest>(&text) {
            Ok(manifest) if manifest.format == FORMAT => Ok(Self { root: root.to_path_buf(), manifest }),
            Ok(manifest) => Err(SubmissionError::Manifest(
                path,
                format!("it is of form {}, and this version reads form {FORMAT}", manifest.format),
            )),
            Err(error) => Err(SubmissionError::Manifest(path, error.to_string())),
        }
    }

    /// Where a file stands.
    pub fn path(&self, shipped: &Shipped) -> PathBuf {
        Self::folder_in(&self.root).join(&shipped.file)
    }

    /// Where failed shards say why.
    pub fn logs(&self) -> PathBuf {
        Self::folder_in(&self.root).join("logs")
    }

    /// The bytes of a file, which must be those that were shipped.
    ///
    /// # Errors
    /// It cannot be read, or has been changed.
    pub fn bytes(&self, shipped: &Shipped) -> Result<Vec<u8>, SubmissionError> {
        let path = self.path(shipped);
        let bytes = fs::read(&path).map_err(|error| SubmissionError::Io(path.clone(), error))?;
        match bytes.len() as u64 == shipped.bytes && hash(&bytes) == shipped.hash {
            true => Ok(bytes),
            false => Err(SubmissionError::Changed(path)),
        }
    }

    /// Notes what an engine was given, for people: a line of `jobs.jsonl`.
    ///
    /// # Errors
    /// The system's.
    pub fn note(&self, engine: &str, jobs: &[String], tasks: usize) -> Result<(), SubmissionError> {
        use std::io::Write;
        let path = Self::folder_in(&self.root).join("jobs.jsonl");
        let line = serde_json::json!({"engine": engine, "jobs": jobs, "tasks": tasks});
        let file = fs::OpenOptions::new().create(true).append(true).open(&path);
        let written = file.and_then(|mut file| writeln!(file, "{line}"));
        written.map_err(|error| SubmissionError::Io(path, error))
    }

    /// The engine that was given tasks last.
    pub fn last_engine(&self) -> Option<String> {
        let text = fs::read_to_string(Self::folder_in(&self.root).join("jobs.jsonl")).ok()?;
        let line: serde_json::Value = serde_json::from_str(text.lines().last()?).ok()?;
        line["engine"].as_str().map(str::to_string)
    }
}

#[cfg(unix)]
fn allow_execution(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let mode = fs::metadata(path)?.permissions().mode();
    // Who may read may run.
    fs::set_permissions(path, fs::Permissions::from_mode(mode | (mode & 0o444) >> 2))
}

#[cfg(not(unix))]
fn allow_execution(_path: &Path) -> io::Result<()> {
    Ok(())
}

/// FNV-1a (Fowler, Noll, Vo), in hexadecimal digits: tells files apart that were changed by mistake, not by an adversary.
pub fn hash(bytes: &[u8]) -> String {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    format!("{:016x}", bytes.iter().fold(0xcbf2_9ce4_8422_2325, step))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_comes_back_and_a_changed_file_is_seen() {
        let root = std::env::temp_dir().join(format!("hyd-submission-{}", std::process::id()));
        assert!(matches!(Submission::read(&root), Err(SubmissionError::None(_))));
        let executable = Submission::ship(&root, "model", b"program", true).unwrap();
        // The value of the published test vector for "foobar" (Noll's page on FNV).
        assert_eq!(hash(b"foobar"), "85944171f73967e8");
        let manifest = Manifest {
            format: FORMAT,
            name: "hyd-1".into(),
            hyd: "0.1.0".into(),
            model: "A".into(),
            sources: "0".into(),
            plan: "seed = 1\n".into(),
            shards: 3,
            members: 7,
            threads: 1,
            executable,
            whole_loops: None,
            inputs: None,
        };
        let made = Submission::begin(&root, manifest.clone()).unwrap();
        let read = Submission::read(&root).unwrap();
        assert_eq!((&read, read.bytes(&manifest.executable).unwrap()), (&made, b"program".to_vec()));
        assert_eq!(read.last_engine(), None);
        read.note("slurm", &["17".into()], 3).unwrap();
        read.note("hq", &["1".into()], 1).unwrap();
        assert_eq!(read.last_engine().as_deref(), Some("hq"));
        fs::write(made.path(&manifest.executable), b"program!").unwrap();
        assert!(matches!(read.bytes(&manifest.executable), Err(SubmissionError::Changed(_))));
        fs::write(Submission::folder_in(&root).join(MANIFEST), "{}").unwrap();
        assert!(matches!(Submission::read(&root), Err(SubmissionError::Manifest(..))));
        fs::remove_dir_all(&root).unwrap();
    }
}
