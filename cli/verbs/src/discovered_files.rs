//! What the written model needs to run, in the folder of a report: copies of the data files that it reads, parameters and recorded
//! inputs of the shots, the text of a law; and the command that runs it.
//!
//! `report.json` says which copies are ours: no other file of that folder is replaced by one, and what an earlier call has written
//! and this one has not is removed.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use hyd_compiler::Severity;
use hyd_discovery::{DataFiles, Report, is_below, quoted};
use hyd_results::{read_as, refuse_read, write_whole};
use serde_json::{Value, json};

use crate::discover::{FILES, unwritable};
use crate::discovery_memory::hash;
use crate::{Failure, Listener};

/// The folder of a report before it is written.
pub(crate) struct ReportFolder {
    path: PathBuf,
    /// What an earlier call has copied, with the fingerprint of its content.
    copied: Vec<(String, String)>,
    /// Files of shots of an earlier call.
    shots: Vec<String>,
}

impl ReportFolder {
    /// Looks into a folder; what is no report is none.
    pub(crate) fn new(path: &Path) -> Self {
        let text = std::fs::read_to_string(path.join("report.json")).unwrap_or_default();
        let run = serde_json::from_str::<Value>(&text).map(|report| report["run"].clone()).unwrap_or_default();
        let list = |key: &str| run[key].as_array().cloned().unwrap_or_default();
        let copied = list("copied").into_iter().filter_map(|own| {
            let name = own["file"].as_str().filter(|name| is_below(name))?;
            Some((name.to_string(), own["fingerprint"].as_str()?.to_string()))
        });
        let shots = list("shots").into_iter().flat_map(|own| [own["parameters"].clone(), own["inputs"].clone()]);
        let shots = shots.filter_map(|own| own.as_str().filter(|name| is_shot(name)).map(String::from));
        Self { path: path.to_path_buf(), copied: copied.collect(), shots: shots.collect() }
    }

    /// Refuses a folder where copies of these files would replace others, or files of these shots what has been read.
    pub(crate) fn check(&self, files: &DataFiles, shots: impl Iterator<Item = usize>) -> Result<(), Failure> {
        for (name, text) in files.iter().filter(|(name, _)| is_below(name) && !FILES.contains(&name.as_str())) {
            if let Place::Other = self.place(name, text) {
                return Err(Failure::Fault(format!(
                    "`{}` is another file than the model reads as `{name}`, which would be copied there; choose another folder for the report",
                    self.path.join(name).display()
                )));
            }
        }
        for number in shots {
            for name in [format!("shots/shot_{number}.toml"), format!("shots/shot_{number}_inputs.csv")] {
                let path = self.path.join(name);
                refuse_read(&path).map_err(|error| unwritable(&path, &error))?;
            }
        }
        Ok(())
    }

    fn place(&self, name: &str, text: &str) -> Place {
        let path = self.path.join(name);
        let is_read = read_as(&path).is_some();
        match std::fs::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Place::Free,
            Ok(bytes) if bytes == text.as_bytes() && (is_read || !self.is_ours(name, &bytes)) => Place::There,
            Ok(bytes) if !is_read && self.is_ours(name, &bytes) => Place::Free,
            // A text may have been read with marks of its encoding that are no part of it.
            Ok(_) if is_read && hyd_run::read_text(&path).is_ok_and(|own| own == *text) => Place::There,
            _ => Place::Other,
        }
    }

    fn is_ours(&self, name: &str, bytes: &[u8]) -> bool {
        let fingerprint = fingerprint(bytes);
        self.copied.iter().any(|(own, known)| own == name && *known == fingerprint)
    }

    /// Copies the units of other tools that the model of a report holds, so that it runs there.
    fn copy_units(
        &self,
        units: &[(String, Vec<u8>)],
        copied: &mut Vec<Value>,
        listener: &dyn Listener,
    ) -> Result<(), Failure> {
        for (name, bytes) in units {
            let path = self.path.join(name);
            let known = std::fs::read(&path).ok();
            let is_free = known.as_ref().is_none_or(|known| known == bytes || self.is_ours(name, known));
            if !is_below(name) || !is_free {
                listener.sentence(
                    Severity::Warning,
                    &format!(
                        "`{}` is not replaced by the unit `{name}`, so that `{}` does not run there",
                        path.display(),
                        Report::MODEL
                    ),
                );
                continue;
            }
            if known.as_ref() != Some(bytes) {
                let folder = path.parent().unwrap_or(&self.path);
                let done = std::fs::create_dir_all(folder).and_then(|()| write_whole(&path, bytes));
                done.map_err(|error| unwritable(&path, &error))?;
            }
            copied.push(json!({"file": name, "fingerprint": fingerprint(bytes)}));
        }
        Ok(())
    }

    /// Writes the files that the model of a report needs and removes those of an earlier one; the report learns which copies are its own.
    /// `units`: the units of other tools in it, by the names under which it reads them.
    pub(crate) fn write(
        &self,
        report: &mut Report,
        units: &[(String, Vec<u8>)],
        listener: &dyn Listener,
    ) -> Result<(), Failure> {
        let mut written: Vec<&str> = Vec::new();
        for shot in &report.shots {
            self.save(&shot.file, &shot.parameters)?;
            written.push(&shot.file);
            if let Some((name, text)) = &shot.inputs {
                self.save(name, text)?;
                written.push(name);
            }
        }
        let mut copied = Vec::new();
        for (name, text) in &report.data {
            match self.place(name, text) {
                Place::Free => {
                    self.save(name, text)?;
                    copied.push(json!({"file": name, "fingerprint": fingerprint(text.as_bytes())}));
                    written.push(name);
                }
                Place::There => written.push(name),
                Place::Other => listener.sentence(Severity::Warning, &format!(
                    "`{}` is another file than the model reads as `{name}`, so that it is not replaced and `{}` does not run as it was found",
                    self.path.join(name).display(),
                    Report::MODEL
                )),
            }
        }
        if let Some((name, text)) = &report.law {
            match self.place(name, text) {
                Place::Free => {
                    self.save(name, text)?;
                    copied.push(json!({"file": name, "fingerprint": fingerprint(text.as_bytes())}));
                    written.push(name);
                }
                Place::There => written.push(name),
                Place::Other => listener.sentence(
                    Severity::Warning,
                    &format!(
                        "`{}` is not the law of an earlier report and is not replaced; the law stands in `{}`",
                        self.path.join(name).display(),
                        Report::MODEL
                    ),
                ),
            }
        }
        if report.model.is_some() {
            self.copy_units(units, &mut copied, listener)?;
            written.extend(units.iter().map(|(name, _)| name.as_str()));
        }
        for name in &report.lost {
            listener.sentence(Severity::Warning, &format!(
                "`{}` reads `{name}`, whose name does not stand in its text, so that it needs the file in its old place",
                Report::MODEL
            ));
        }
        let ours = self
            .copied
            .iter()
            .filter(|(name, _)| std::fs::read(self.path.join(name)).is_ok_and(|bytes| self.is_ours(name, &bytes)));
        for name in self.shots.iter().chain(ours.map(|(name, _)| name)).filter(|name| !written.contains(&name.as_str()))
        {
            let path = self.path.join(name);
            match refuse_read(&path).and_then(|()| std::fs::remove_file(&path)) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(Failure::Fault(format!("`{}` cannot be removed: {error}", path.display())));
                }
                _ => {}
            }
        }
        if let Some(run) = report.json.get_mut("run").and_then(Value::as_object_mut) {
            run.insert("copied".into(), copied.into());
            let model = report.model.as_ref().map(|text| fingerprint(text.as_bytes()));
            run.insert("fingerprint".into(), model.into());
        }
        Ok(())
    }

    fn save(&self, name: &str, text: &str) -> Result<(), Failure> {
        let path = self.path.join(name);
        let folder = path.parent().unwrap_or(&self.path);
        let done = std::fs::create_dir_all(folder).and_then(|()| write_whole(&path, text.as_bytes()));
        done.map_err(|error| unwritable(&path, &error))
    }

    /// The line that says how the model is run, under the conditions of the first fitted shot; none if nothing was named.
    pub(crate) fn command(&self, report: &Report) -> Option<String> {
        let shot = report.shots.iter().find(|shot| shot.is_fitted)?;
        let shown = |name: &str| quoted(&self.path.join(name).display().to_string());
        Some(format!("to run it: {}\n", shot.command(Report::MODEL, &shown)))
    }
}

/// What stands where a copy is to be.
enum Place {
    /// Nothing, or a copy of our own.
    Free,
    /// The file itself, or one that is the same.
    There,
    /// Another file.
    Other,
}

pub(crate) fn fingerprint(bytes: &[u8]) -> String {
    format!("{:016x}", hash([bytes]))
}

/// True for names of files of shots as reports have them.
fn is_shot(name: &str) -> bool {
    let stem = name.strip_prefix("shots/shot_");
    let number = stem.and_then(|stem| stem.strip_suffix(".toml").or_else(|| stem.strip_suffix("_inputs.csv")));
    number.is_some_and(|number| number.chars().all(|c| c.is_ascii_digit() || c == '_'))
}
