//! The tools: what each is called, takes and does.

mod check;
mod discover;
mod documentation;
mod equations;
mod explain;
mod fit;
mod simulate;
mod sweep;

use std::path::PathBuf;

use hyd_compiler::{Code, Compilation, Diagnostic, Extras, Files, Goal};
use hyd_run::Failure;
use hyd_verbs::study::{Opened, StudyFiles, open};
use hyd_verbs::unit::is_unit;
use hyd_verbs::{Listener, Request, compile_file, first_name};
use serde_json::{Value, json};

use crate::answer::Answer;
use crate::arguments::{Argument, Given, Kind, optional, required, schema};
use crate::calls::{Call, Workplace};

/// A tool.
pub(crate) struct Tool {
    pub(crate) name: &'static str,
    title: &'static str,
    says: &'static str,
    pub(crate) arguments: &'static [Argument],
    /// Writes no files.
    is_reading: bool,
    /// `Err`: which argument makes no sense, and what would.
    pub(crate) run: fn(&Call<'_>) -> Result<Answer, String>,
}

/// All tools, in the order in which they are needed.
pub(crate) static TOOLS: [&Tool; 8] = [
    &check::TOOL,
    &explain::TOOL,
    &documentation::TOOL,
    &equations::TOOL,
    &simulate::TOOL,
    &sweep::TOOL,
    &fit::TOOL,
    &discover::TOOL,
];

impl Tool {
    /// As the list of tools has it.
    pub(crate) fn described(&self) -> Value {
        json!({"name": self.name, "title": self.title, "description": self.says, "inputSchema": schema(self.arguments),
            "annotations": {"readOnlyHint": self.is_reading, "destructiveHint": false, "idempotentHint": true, "openWorldHint": false}})
    }
}

const FILE: Argument =
    required("file", Kind::Text, "the model's file (*.hyd or *.mo), relative to the folder that is served");
const CLASS: Argument =
    optional("class", Kind::Text, "full name of the class [default: the last complete model of the file]");
const STOP: Argument =
    optional("stop", Kind::Number, "stop time in s [default: as the model says, else 1 s after the start]");
const TOLERANCE: Argument =
    optional("tolerance", Kind::Number, "relative tolerance [default: as the model says, else 1e-6]");
const LIBRARIES: Argument = optional(
    "libraries",
    Kind::Texts,
    "further folders with libraries, relative to the folder that is served; those of the server and the built-in library are there anyway",
);
const PARAMETER_FILE: Argument = optional(
    "parameter_file",
    Kind::Text,
    "file (*.toml) of lines NAME = VALUE, such as `fit` writes with `write_parameters`, relative to the folder that is served; `parameters` overrides it",
);
const STUDY: Argument = required(
    "study",
    Kind::Text,
    "the study (*.toml): which model, which channel is which variable, what may be off; relative to the folder that is served",
);
const BENCH: Argument = required(
    "bench",
    Kind::Text,
    "the set of shots (*.json): what the lab knows of its bench, and its tables; relative to the folder that is served",
);
const SEED: Argument = optional("seed", Kind::Natural, "seed of random starts [default: 1]");

/// The model's file.
fn model_file(workplace: &Workplace, given: &Given) -> Result<PathBuf, String> {
    let file = workplace.folder.file("file", given.needed("file"))?;
    match is_unit(&file) {
        false => Ok(file),
        true => Err(format!(
            "`file`: `{}` is a unit of another tool, whose code would run on this machine; only texts of models are taken",
            file.display()
        )),
    }
}

/// Parameters by full name: of a file first, then those that are given one by one.
fn set_parameters(call: &Call<'_>) -> Result<Result<Vec<(String, String)>, Answer>, String> {
    let given = &call.given;
    let mut set = Vec::new();
    if let Some(name) = given.text("parameter_file") {
        match hyd_run::parameter_file::read(&call.workplace.folder.file("parameter_file", name)?) {
            Ok(read) => set = read,
            Err(failure) => return Ok(Err(Answer::failed(&failure, &call.kept))),
        }
    }
    set.append(&mut given.values("parameters"));
    Ok(Ok(set))
}

/// Translates a model; what the compiler says is kept.  `later`: what gets its value after the translation.
fn translated(
    call: &Call<'_>,
    file: &std::path::Path,
    (class, set): (Option<&str>, &[(String, String)]),
    (goal, later): (Goal, &[String]),
) -> Result<Result<Compilation, Answer>, String> {
    let libraries = call.workplace.libraries(&call.given)?;
    let extras = Extras { strict_units: call.workplace.strict_units, ..Extras::default() };
    let request = Request { class: class.map(str::to_string), set: set.to_vec(), goal };
    let mut compilation = match compile_file(file, &libraries, &request, &extras) {
        Ok(compilation) => compilation,
        Err(refused) => return Ok(Err(rejected(call, &refused))),
    };
    let is_later = |message: &str| first_name(message).is_some_and(|own| later.iter().any(|name| name == own));
    compilation.diagnostics.retain(|own| own.code != Code::OpenInput || !is_later(&own.message));
    Ok(Ok(compilation))
}

/// The answer where a file cannot be read.
fn rejected(call: &Call<'_>, refused: &Diagnostic) -> Answer {
    call.kept.diagnostics(&Files::new(), std::slice::from_ref(refused));
    Answer::failed(&Failure::Reported, &call.kept)
}

/// The same for what must be free of errors: other messages are kept.
fn runnable(
    call: &Call<'_>,
    file: &std::path::Path,
    own: (Option<&str>, &[(String, String)]),
    later: &[String],
) -> Result<Result<Compilation, Answer>, String> {
    let compilation = match translated(call, file, own, (Goal::Run, later))? {
        Ok(compilation) => compilation,
        Err(answer) => return Ok(Err(answer)),
    };
    call.kept.diagnostics(&compilation.files, &compilation.diagnostics);
    match compilation.has_errors() {
        false => Ok(Ok(compilation)),
        true => Ok(Err(Answer::failed(&Failure::Reported, &call.kept))),
    }
}

/// Opens study and set, and lets what ends the call end the work on them.
fn opened(call: &Call<'_>) -> Result<(StudyFiles, Result<Opened, Failure>), String> {
    let folder = &call.workplace.folder;
    let files = StudyFiles {
        study: folder.file("study", call.given.needed("study"))?,
        bench: folder.file("bench", call.given.needed("bench"))?,
        libraries: call.workplace.libraries(&call.given)?,
        threads: None,
        // The code of units of other tools does not run here.
        host: None,
    };
    let opened = open(&files, &call.kept).map(|mut opened| {
        opened.setup.watch.stop = call.stop();
        opened
    });
    Ok((files, opened))
}

/// The files of a folder and below, by name.
fn files_below(folder: &std::path::Path, files: &mut Vec<String>) {
    let mut entries: Vec<_> =
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        match path.is_dir() {
            true => files_below(&path, files),
            false => files.push(path.display().to_string()),
        }
    }
}

/// Adds what was said on the way to the data of an answer.
fn with_messages(call: &Call<'_>, mut data: Value) -> Value {
    let (messages, count) = call.kept.messages();
    if let (Value::Object(data), true) = (&mut data, count > 0) {
        data.insert("messages".into(), messages);
    }
    data
}
