//! `hyd bench import FOLDER`: a lab's files as tables, an import file, a set and a first study.
//!
//! What is assumed about the files is made by `hyd_discovery::Plan`; here they are found, read and written.  All files are
//! written before one of them gets its name, so that a fault leaves nothing behind.  What a person has edited is not written over: the set
//! carries a checksum of itself, and tables are replaced only where a set that was imported names them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Component, Path, PathBuf};

use hyd_discovery::{Asked, Assumptions, Content, Fault, Imported, Plan, RawFile};
use hyd_frames::{Cells, Frame, is_parquet};
use hyd_results::{WholeFile, mat_columns, note_read};
use hyd_run::{read_text, read_to_limit};
use serde_json::Value;

use crate::arguments::{Import, MessageFormat};
use crate::{Failure, output};
use hyd_verbs::hash;
use hyd_verbs::study::failure;

/// Endings of files of text.
const TEXTS: [&str; 5] = ["csv", "tsv", "txt", "dat", "asc"];
/// The import file.
const IMPORT: &str = "import.toml";
/// The set.
const SET: &str = "set.json";
/// The first study.
const STUDY: &str = "study.toml";
/// Key of the checksum of a set.
const CHECKSUM: &str = "imported";
/// Names that one message lists.
const MOST_NAMES: usize = 5;

/// Runs the verb.
pub(crate) fn import(arguments: &Import) -> Result<(), Failure> {
    if arguments.rate.is_some_and(|rate| !(rate > 0.0 && rate.is_finite())) {
        return Err(Failure::Usage("--rate: expected a positive number of samples per second".to_string()));
    }
    if arguments.rate.is_some() && arguments.drop_repeated {
        let sentence =
            "--drop-repeated is about times that files record, and --rate stands for those of files that record none";
        return Err(Failure::Usage(sentence.to_string()));
    }
    if arguments.source.is_dir() { folder(arguments) } else { again(arguments) }
}

/// Imports a folder about which nobody has said anything.
fn folder(arguments: &Import) -> Result<(), Failure> {
    let source = &arguments.source;
    let stem =
        source.canonicalize().ok().and_then(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()));
    let stem = stem.unwrap_or_else(|| "bench".to_string());
    let target = arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{stem}_bench")));
    let is_empty = || fs::read_dir(&target).is_ok_and(|mut entries| entries.next().is_none());
    if target.symlink_metadata().is_ok() && !is_empty() {
        let sentence = format!(
            "`{}` exists already; nothing was written (edit its {IMPORT} and import that, or name another folder with -o)",
            target.display()
        );
        return Err(Failure::Fault(sentence));
    }
    let (names, others) = listing(source)?;
    if names.is_empty() {
        let found =
            if others.is_empty() { "it is empty".to_string() } else { format!("it has {}", shortened(&others)) };
        let endings = TEXTS.join(", .");
        return Err(Failure::Fault(format!(
            "`{}` holds no tables of measurements (.{endings}, .parquet, .mat): {found}",
            source.display()
        )));
    }
    let mut files = Vec::new();
    for name in names {
        let content = read(&source.join(&name)).map_err(failure)?;
        files.push(RawFile { name, content });
    }
    let asked = Asked {
        rate: arguments.rate,
        time: arguments.time.clone(),
        trigger: arguments.trigger.clone(),
        no_trigger: arguments.no_trigger,
        drop_repeated: arguments.drop_repeated,
        skip: arguments.skip.clone(),
    };
    let inside = |fault: Fault| failure(within(source, fault));
    let Assumptions { plan, notes, left_out } =
        Plan::assume(&stem, &way(&target, source), &files, &asked).map_err(inside)?;
    for (name, why) in left_out {
        let sentence = format!("`{}` is left out: {why}", source.join(name).display());
        output::sentence("warning", &sentence, MessageFormat::Text);
    }
    let mut contents: BTreeMap<String, Content> = files.into_iter().map(|file| (file.name, file.content)).collect();
    let mut taken = |name: &str| contents.remove(name).ok_or_else(|| Fault::new(format!("there is no file `{name}`")));
    let outcome = plan.carry_out(&notes, &mut taken).map_err(inside)?;
    let left_out = if others.is_empty() {
        String::new()
    } else {
        format!("left out, because they are not tables: {}\n", shortened(&others))
    };
    write(&target, &outcome, Some(plan.text()), &left_out)
}

/// Imports by an import file that a person may have edited.
fn again(arguments: &Import) -> Result<(), Failure> {
    let source = &arguments.source;
    let is_said = arguments.rate.is_some() || arguments.trigger.is_some() || arguments.no_trigger;
    if is_said || arguments.drop_repeated || !(arguments.time.is_empty() && arguments.skip.is_empty()) {
        let sentence = "--rate, --time, --drop-repeated, --trigger, --no-trigger and --skip are for folders; an import file says these \
                        things itself";
        return Err(Failure::Usage(sentence.to_string()));
    }
    if source.exists() && source.extension().is_none_or(|ending| ending != "toml") {
        let sentence = format!("`{}` is neither a folder nor an import file (.toml)", source.display());
        return Err(Failure::Fault(sentence));
    }
    let text = read_text(source).map_err(|error| Failure::Fault(error.to_string()))?;
    let shown = source.display();
    let plan = Plan::parse(&text).map_err(|fault| Failure::Fault(format!("`{shown}`: {fault}")))?;
    let own = source.parent().unwrap_or(Path::new("")).to_path_buf();
    let folder = own.join(&plan.folder);
    let mut contents = |name: &str| {
        let is_inside =
            Path::new(name).components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !is_inside {
            return Err(Fault::new(format!("`{shown}`: the file `{name}` lies outside of `{}`", folder.display())));
        }
        read(&folder.join(name))
    };
    let outcome = plan.carry_out(&BTreeMap::new(), &mut contents).map_err(|fault| failure(within(&folder, fault)))?;
    match &arguments.output {
        None => write(if own.as_os_str().is_empty() { Path::new(".") } else { &own }, &outcome, None, ""),
        Some(target) => {
            let moved = Plan { folder: way(target, &folder), ..plan };
            write(target, &outcome, Some(moved.text()), "")
        }
    }
}

/// A fault of a file in a folder: what begins with the name of a file gets its folder, too.
fn within(folder: &Path, fault: Fault) -> Fault {
    let named = fault.sentence.strip_prefix('`').and_then(|rest| rest.split_once('`'));
    match named {
        Some((name, rest)) if folder.join(name).exists() && !Path::new(name).exists() => {
            Fault::new(format!("`{}`{rest}", folder.join(name).display()))
        }
        _ => fault,
    }
}

/// Names of the tables in a folder, sorted, and of what else is in it.
fn listing(folder: &Path) -> Result<(Vec<String>, Vec<String>), Failure> {
    let failed = |error: std::io::Error| Failure::Fault(format!("`{}` cannot be read: {error}", folder.display()));
    let (mut names, mut others) = (Vec::new(), Vec::new());
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if name.starts_with('.') {
            continue;
        }
        let is_table =
            path.is_file() && (TEXTS.contains(&ending.as_str()) || matches!(ending.as_str(), "parquet" | "mat"));
        if is_table { names.push(name) } else { others.push(name) }
    }
    names.sort();
    others.sort();
    Ok((names, others))
}

fn shortened(names: &[String]) -> String {
    let more = names.len().saturating_sub(MOST_NAMES);
    let shown: Vec<String> = names.iter().take(MOST_NAMES).map(|name| format!("`{name}`")).collect();
    if more > 0 { format!("{} and {more} more", shown.join(", ")) } else { shown.join(", ") }
}

/// What a file holds.
fn read(path: &Path) -> Result<Content, Fault> {
    let shown = path.display();
    if !path.is_file() {
        let what = if path.is_dir() { "is a folder, not a file" } else { "does not exist" };
        return Err(Fault::new(format!("`{shown}` {what}")));
    }
    note_read(path);
    let wrong = |sentence: String| Fault::new(format!("`{shown}`: {sentence}"));
    if is_parquet(path) {
        let frame = Frame::read(path).map_err(|error| wrong(error.to_string()))?;
        let (mut columns, mut others) = (Vec::new(), Vec::new());
        for (name, cells) in frame.columns {
            match cells {
                Cells::Numbers(values) => columns.push((name, values)),
                Cells::Wholes(values) => columns.push((name, values.into_iter().map(|value| value as f64).collect())),
                Cells::Texts(_) => others.push(name),
            }
        }
        say_left_out(path, "they hold texts, not numbers", &others);
        return Ok(Content::Columns(columns));
    }
    let file = File::open(path).map_err(|error| Fault::new(format!("`{shown}` cannot be read: {error}")))?;
    let bytes = read_to_limit(path, file).map_err(|error| Fault::new(error.to_string()))?;
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mat")) {
        let found = mat_columns(&bytes).map_err(wrong)?;
        say_left_out(path, "they are not vectors of real numbers", &found.others);
        return Ok(Content::Columns(found.columns));
    }
    Ok(Content::Text(bytes))
}

/// Says which parts of a file are left out.
fn say_left_out(path: &Path, why: &str, names: &[String]) {
    if !names.is_empty() {
        let sentence = format!("`{}`: left out, for {why}: {}", path.display(), shortened(names));
        output::sentence("warning", &sentence, MessageFormat::Text);
    }
}

/// The way from one folder to another, relative where both are known.
fn way(from: &Path, to: &Path) -> String {
    let absolute = |path: &Path| {
        // A folder that is not there yet lies in one that is.
        path.canonicalize().ok().or_else(|| {
            let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
            Some(parent.canonicalize().ok()?.join(path.file_name()?))
        })
    };
    let (Some(from), Some(to)) = (absolute(from), absolute(to)) else { return to.display().to_string() };
    let shared = from.components().zip(to.components()).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return to.display().to_string();
    }
    let up = from.components().skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(to.components().skip(shared)).collect();
    if way.as_os_str().is_empty() { ".".to_string() } else { way.to_string_lossy().replace('\\', "/") }
}

/// A set with the checksum of itself.
fn sealed(set: &str) -> String {
    let Ok(Value::Object(mut object)) = serde_json::from_str(set) else { return set.to_string() };
    let sum = hash([Value::Object(object.clone()).to_string().as_bytes()]);
    object.insert(CHECKSUM.into(), format!("{sum:016x}").into());
    format!("{:#}\n", Value::Object(object))
}

/// The tables of a set that was imported and not edited since; none for any other text.
fn imported(text: &str) -> Option<BTreeSet<String>> {
    let Ok(Value::Object(mut object)) = serde_json::from_str(text) else { return None };
    let sum = object.remove(CHECKSUM)?;
    let own = format!("{:016x}", hash([Value::Object(object.clone()).to_string().as_bytes()]));
    let files = object.get("experiments")?.as_array()?.iter().filter_map(|own| own.get("file")?.as_str());
    (sum == own.as_str()).then(|| files.map(String::from).collect())
}

/// Writes everything, or nothing.
fn write(target: &Path, outcome: &Imported, plan: Option<String>, left_out: &str) -> Result<(), Failure> {
    let set_path = target.join(SET);
    let before = match fs::read_to_string(&set_path) {
        Ok(text) => Some(imported(&text).ok_or_else(|| {
            Failure::Fault(format!(
                "`{}` was edited since it was imported; nothing was written. What you know of the bench belongs under `[set]` of the \
                 import file, conditions belong under `[[shot]]`; or move the set away",
                set_path.display()
            ))
        })?),
        Err(_) => None,
    };
    let mut files: Vec<(PathBuf, String)> = Vec::new();
    for (name, text) in &outcome.tables {
        let path = target.join(name);
        let own = before.as_ref().is_some_and(|files| files.contains(name));
        if path.symlink_metadata().is_ok() && !own {
            let sentence = format!("`{}` exists and was not made by an import; nothing was written", path.display());
            return Err(Failure::Fault(sentence));
        }
        files.push((path, text.clone()));
    }
    files.push((set_path, sealed(&outcome.set)));
    if let Some(text) = plan {
        let path = target.join(IMPORT);
        if path.symlink_metadata().is_ok() {
            return Err(Failure::Fault(format!("`{}` exists already; nothing was written", path.display())));
        }
        files.push((path, text));
    }
    let study = target.join(STUDY);
    let has_study = study.symlink_metadata().is_ok();
    if !has_study {
        files.push((study, outcome.study.clone()));
    }
    let is_new = !target.exists();
    let written = write_all(target, &files);
    if written.is_err() && is_new {
        // Only an empty folder is removed; the error that is reported says more.
        let _ = fs::remove_dir(target);
    }
    written?;
    let count = outcome.tables.len();
    let tables = if count == 1 { "1 table".to_string() } else { format!("{count} tables") };
    let others: Vec<String> = files
        .iter()
        .skip(count)
        .filter_map(|(path, _)| path.file_name().map(|name| name.to_string_lossy().into_owned()))
        .collect();
    let kept = if has_study { format!("; {STUDY} is left as it is") } else { String::new() };
    output::print(&format!(
        "{}{left_out}{tables} and {} in {}{kept}\n",
        outcome.words,
        others.join(", "),
        target.display()
    ))
}

fn write_all(target: &Path, files: &[(PathBuf, String)]) -> Result<(), Failure> {
    let failed = |path: &Path, error: &std::io::Error| {
        Failure::Fault(format!("`{}` cannot be written: {error}", path.display()))
    };
    fs::create_dir_all(target).map_err(|error| failed(target, &error))?;
    let mut whole = Vec::new();
    for (path, text) in files {
        let file = WholeFile::create(path).map_err(|error| failed(path, &error))?;
        file.writer().and_then(|mut writer| writer.write_all(text.as_bytes())).map_err(|error| failed(path, &error))?;
        whole.push((path, file));
    }
    for (path, file) in whole {
        file.finish().map_err(|error| failed(path, &error))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{imported, sealed};

    #[test]
    fn sets_that_were_edited_are_known() {
        let set = sealed("{\"experiments\": [{\"file\": \"a.csv\"}], \"noise_std\": {\"p\": 1.5}}");
        assert_eq!(imported(&set), Some(["a.csv".to_string()].into()));
        assert_eq!(imported(&set.replace("1.5", "2.5")), None);
        // Another layout of the same text says the same.
        assert!(imported(&set.replace('\n', " ")).is_some());
        assert_eq!(imported("{\"experiments\": []}"), None);
    }
}
