//! `sweep`: many runs with varied parameters, into a folder.

use std::path::{Path, PathBuf};

use hyd_compiler::Severity;
use hyd_run::{DrawMethod, Failure, InputArguments, MessageFormat, Plan, SweepArguments};
use hyd_run::{failures_told, override_plan, prepare, read_plan, runs_done_again};
use hyd_verbs::Listener;
use hyd_verbs::sweep::sweep as sweep_model;

use super::{CLASS, LIBRARIES, PARAMETER_FILE, STOP, TOLERANCE, Tool, runnable, with_messages};
use crate::answer::Answer;
use crate::arguments::{Given, Kind, optional, required};
use crate::calls::Call;

/// What shows that a folder holds a sweep.
const MARK: &str = "sweep.json";

pub(super) const TOOL: Tool = Tool {
    name: "sweep",
    title: "Run a model many times",
    says: "Runs a model many times with varied parameters, on all cores, into a folder of Parquet files: members.parquet has a row for each run with its \
           parameters, last values and measures, rows.parquet all rows where `rows` is true. The same call on the same folder completes what is missing. \
           Gives how many runs were done, how many failed and why, and the files.",
    arguments: &[
        required("file", Kind::Text, "the model's file, or a plan (*.toml), relative to the folder that is served"),
        CLASS,
        optional(
            "vary",
            Kind::Values,
            "parameters by full name with what they run through, in the units of the model: FROM:TO:COUNT, log:FROM:TO:COUNT, A,B,C or [A, B, C], or a \
             distribution drawn `samples` times: uniform(a, b), loguniform(a, b), normal(mean, deviation), lognormal(median, deviation), triangular(low, mode, \
             high); such as {\"p0\": \"8e6:20e6:7\"}",
        ),
        optional("parameters", Kind::Values, "parameters that do not vary, by full name, in the units of the model"),
        PARAMETER_FILE,
        optional("samples", Kind::Count, "number of draws from distributions"),
        optional(
            "method",
            Kind::Word(&["lhs", "random"]),
            "how draws fill their space: a Latin hypercube or at random [default: lhs]",
        ),
        optional("seed", Kind::Natural, "seed of the draws [default: 0]"),
        optional(
            "measure",
            Kind::Texts,
            "expressions that are measured of every run, such as max(y), when(y > 4e-3), mean(p)/2; each is a column of members.parquet",
        ),
        optional("variables", Kind::Text, "regular expression: the variables whose full name matches are kept"),
        optional("rows", Kind::Flag, "keeps all rows of every run, not only the last"),
        STOP,
        TOLERANCE,
        optional("intervals", Kind::Count, "number of equal output intervals of a run, where rows are kept"),
        required(
            "result",
            Kind::Text,
            "folder of the results, relative to the folder that is served; a new one, or one with the same sweep",
        ),
        LIBRARIES,
    ],
    is_reading: false,
    run: sweep,
};

fn sweep(call: &Call<'_>) -> Result<Answer, String> {
    let (workplace, given) = (call.workplace, &call.given);
    let named = workplace.folder.file("file", given.needed("file"))?;
    let root = workplace.folder.target_folder("result", given.needed("result"), MARK)?;
    let (mut plan, file) = match plan(call, named)? {
        Ok(found) => found,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let parameters =
        given.text("parameter_file").map(|name| workplace.folder.file("parameter_file", name)).transpose()?;
    let arguments = SweepArguments { parameters, ..arguments(given, root) };
    plan.class = given.text("class").map(str::to_string).or(plan.class);
    if let Err(failure) = override_plan(&mut plan, &arguments) {
        return Ok(Answer::failed(&failure, &call.kept));
    }
    let class = plan.class.clone();
    let prepared = match prepare(&arguments, plan) {
        Ok(prepared) => prepared,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let set: Vec<(String, String)> = prepared.plan().set.clone().into_iter().collect();
    let varied: Vec<String> = prepared.plan().vary.iter().map(|own| own.parameter.clone()).collect();
    let compilation = match runnable(call, &file, (class.as_deref(), &set), &varied)? {
        Ok(compilation) => compilation,
        Err(answer) => return Ok(answer),
    };
    let stop = call.stop();
    let stopped = move || stop.load(std::sync::atomic::Ordering::Relaxed);
    let swept = sweep_model((&compilation, &set), None, &prepared, &call.kept, |subject| {
        prepared.work(subject, &|done, all| call.progress.part(done, all), &stopped)
    });
    let swept = match swept {
        Ok(swept) => swept,
        Err(failure) => return Ok(Answer::failed(&failure, &call.kept)),
    };
    let report = &swept.report;
    if report.whole_loops > 0 {
        call.kept.sentence(Severity::Warning, &runs_done_again(report.whole_loops));
    }
    for (severity, sentence) in failures_told(report) {
        let severity = match severity {
            "error" => Severity::Error,
            "warning" => Severity::Warning,
            _ => Severity::Note,
        };
        call.kept.sentence(severity, &sentence);
    }
    let is_hopeless = report.failed > 0 && report.failed == report.before + report.now;
    let mut text = call.kept.text() + &swept.text();
    if report.interrupted {
        text.push_str("interrupted; the same call goes on where it was stopped\n");
    }
    let data = with_messages(call, swept.json());
    Ok(Answer { text, data, is_error: is_hopeless || report.interrupted })
}

/// The plan of the file, if it is one, and the model's file.
fn plan(call: &Call<'_>, named: PathBuf) -> Result<Result<(Plan, PathBuf), Failure>, String> {
    if !named.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return super::model_file(call.workplace, &call.given).map(|file| Ok((Plan::default(), file)));
    }
    let plan = match read_plan(&named) {
        Ok(plan) => plan,
        Err(failure) => return Ok(Err(failure)),
    };
    let shown = named.display();
    let Some(model) = plan.model.clone() else {
        return Err(format!("`file`: the plan `{shown}` names no model (model = \"FILE\")"));
    };
    let folder = named.parent().unwrap_or(Path::new(""));
    let file = call
        .workplace
        .libraries(&call.given)?
        .file_of(folder, &model)
        .map_err(|why| format!("`file`: the model {why}"))?;
    match hyd_verbs::unit::is_unit(&file) {
        false => Ok(Ok((plan, file))),
        true => Err(format!("`file`: the plan `{shown}` names a unit of another tool; only texts of models are taken")),
    }
}

fn arguments(given: &Given, root: PathBuf) -> SweepArguments {
    SweepArguments {
        vary: given.lists("vary"),
        samples: given.count("samples"),
        method: match given.text("method") {
            Some("random") => Some(DrawMethod::Random),
            Some(_) => Some(DrawMethod::Lhs),
            None => None,
        },
        seed: given.natural("seed"),
        result: Some(root),
        rows: given.flag("rows"),
        measure: given.texts("measure"),
        shard: None,
        inputs: InputArguments::default(),
        threads: None,
        variables: given.text("variables").map(str::to_string),
        stop: given.number("stop"),
        tolerance: given.number("tolerance"),
        intervals: given.count("intervals"),
        set: given.values("parameters"),
        parameters: None,
        message_format: MessageFormat::Json,
        json: true,
    }
}
