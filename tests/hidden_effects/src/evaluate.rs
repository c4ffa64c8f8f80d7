//! The evaluation: for every trial of a shard the set is made in a temporary folder, the command that is judged runs on it as an
//! outside process with a time limit, and one row is appended to a file and flushed.  Trials that the file already holds are
//! skipped, so a run may be killed at any time and started again; a half-written last line is dropped.

use crate::draft::{Draft, Request, TOLERANCES};
use crate::files;
use crate::measure;
use crate::power;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How to run the judged command.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The command.
    pub program: PathBuf,
    /// The study.
    pub study: PathBuf,
    /// Time limit of a trial, s.
    pub limit: f64,
    /// Further arguments.
    pub extra: Vec<String>,
    /// What was judged: a version or commit, repeated in every row.
    pub label: String,
    /// Folder for the sets; each is removed after its trial unless `keep`.
    pub temporary: PathBuf,
    /// Leaves the sets and reports.
    pub keep: bool,
}

/// Runs all `requests` whose rows `out` does not hold yet.
pub fn run(requests: &[Request], judged: &Judged, out: &Path) -> Result<(), String> {
    let done = finished(out)?;
    let mut file =
        std::fs::OpenOptions::new().create(true).append(true).open(out).map_err(|error| shown(out, error))?;
    let left: Vec<&Request> = requests.iter().filter(|request| !done.contains(&request.name)).collect();
    for (place, request) in left.iter().enumerate() {
        let row = trial(request, judged)?;
        writeln!(file, "{row}").and_then(|()| file.sync_data()).map_err(|error| shown(out, error))?;
        println!("{}/{} {} {}", place + 1, left.len(), request.name, line(&row));
    }
    Ok(())
}

fn shown(path: &Path, error: std::io::Error) -> String {
    format!("{}: {error}", path.display())
}

/// Names of the trials in a file of rows; removes a last line that was not finished.
fn finished(out: &Path) -> Result<BTreeSet<String>, String> {
    let Ok(text) = std::fs::read_to_string(out) else { return Ok(BTreeSet::new()) };
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    if whole.len() < text.len() {
        std::fs::write(out, whole).map_err(|error| shown(out, error))?;
    }
    let name = |line: &str| serde_json::from_str::<Value>(line).ok()?["trial"].as_str().map(String::from);
    Ok(whole.lines().filter_map(name).collect())
}

fn line(row: &Value) -> String {
    let ids: Vec<&str> = row["named"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    format!(
        "-> {} {} ({:.0} s)",
        row["status"].as_str().unwrap_or("?"),
        ids.join(" "),
        row["wall"].as_f64().unwrap_or(0.0)
    )
}

/// One trial: set, run, row.
pub fn trial(request: &Request, judged: &Judged) -> Result<Value, String> {
    let draft = Draft::draw(request)?;
    let (ideal, recorded) = measure::all(&draft)?;
    let failed = |failure: crate::integrator::Failure| format!("{}: {failure:?}", request.name);
    let signature = measure::signature(&draft, &ideal).map_err(failed)?;
    let power = power::power(&draft, &ideal).map_err(failed)?;
    let each = if request.effects.len() > 1 { power::power_of_each(&draft, &ideal)? } else { vec![power] };
    let folder = judged.temporary.join(&request.name);
    files::write(&draft, &measure::times(), &recorded, &signature, &folder)?;
    // What is judged must not be able to see the answers.
    std::fs::remove_file(folder.join("ANSWERS.json")).map_err(|error| shown(&folder, error))?;
    let mut row = json!({"trial": request.name, "seed": request.seed, "kind": draft.kind(), "truth": files::truths(&draft),
        "base_model": draft.base_model(), "channels": draft.channels, "shots": draft.shots.len(),
        "scattered": draft.shots.iter().any(|shot| shot.scatter != [1.0; 5]), "correlation": draft.correlation,
        "noise": draft.noise, "disturbances": request.disturbances, "raw_power": power.raw, "power": power.projected,
        "power_of_each": each.iter().map(|power| power.projected).collect::<Vec<_>>(), "judged": judged.label});
    let report = ask(request, judged, &folder, &mut row)?;
    row["fitted"] = pulls(&draft, &report);
    if !judged.keep {
        let _ = std::fs::remove_dir_all(&folder);
    }
    Ok(row)
}

/// Runs the judged command on the set and puts what it says into the row; the whole report.
fn ask(request: &Request, judged: &Judged, folder: &Path, row: &mut Value) -> Result<Value, String> {
    let report = folder.join("report");
    let log = std::fs::File::create(folder.join("log.txt")).map_err(|error| shown(folder, error))?;
    let both = log.try_clone().map_err(|error| shown(folder, error))?;
    let (start, before) = (Instant::now(), children_seconds());
    let mut child = Command::new(&judged.program)
        .arg("discover")
        .arg(&judged.study)
        .arg("--bench")
        .arg(folder.join(format!("{}.json", request.name)))
        .arg("--report")
        .arg(&report)
        .args(&judged.extra)
        .stdin(Stdio::null())
        .stdout(log)
        .stderr(both)
        .spawn()
        .map_err(|error| shown(&judged.program, error))?;
    let end = loop {
        if let Some(status) = child.try_wait().map_err(|error| error.to_string())? {
            break status.code().map_or("killed".into(), |code| format!("code {code}"));
        }
        if start.elapsed().as_secs_f64() > judged.limit {
            let _ = child.kill();
            let _ = child.wait();
            break "time limit".to_string();
        }
        std::thread::sleep(Duration::from_millis(50));
    };
    row["end"] = json!(end);
    row["wall"] = json!(start.elapsed().as_secs_f64());
    row["cpu"] = json!(before.and_then(|before| Some(children_seconds()? - before)));
    let text = std::fs::read_to_string(report.join("report.json")).unwrap_or_default();
    match serde_json::from_str::<Value>(&text) {
        Ok(found) if end != "time limit" => {
            take(&found, row);
            return Ok(found);
        }
        _ => {
            row["status"] = json!("none");
            row["named"] = json!([]);
            let log = std::fs::read_to_string(folder.join("log.txt")).unwrap_or_default();
            row["message"] = json!(log.lines().rev().take(4).collect::<Vec<_>>().join(" | "));
        }
    }
    Ok(Value::Null)
}

/// How far each fitted parameter is from what was drawn, in its standard errors: `(found - drawn)/error`, by name.
fn pulls(draft: &Draft, report: &Value) -> Value {
    let fitted = report["parameters"].as_array().into_iter().flatten();
    let one = |own: &Value| {
        let name = own["name"].as_str()?;
        let place = TOLERANCES.iter().position(|(known, _)| *known == name)?;
        let (value, error) = (own["after"]["value"].as_f64()?, own["after"]["stderr"].as_f64()?);
        let pull = (value - draft.factors[place]) / error;
        (error > 0.0).then(|| (name.to_string(), json!((pull * 100.0).round() / 100.0)))
    };
    fitted.filter_map(one).collect::<serde_json::Map<_, _>>().into()
}

/// The parts of a report that are judged.
fn take(report: &Value, row: &mut Value) {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    // A law is what no catalogue holds, and not a name.
    let law = report["law"].as_object().map(|_| report["location"][0]["id"].clone());
    let mut effects = list(&report["effects"]);
    effects.retain(|effect| law.as_ref() != Some(&effect["id"]));
    row["law"] = json!({"equation": report["law"]["with"], "terms": report["law"]["terms"]});
    row["status"] = report["status"].clone();
    row["named"] = effects.iter().map(|effect| effect["id"].clone()).collect();
    row["kinds"] = effects.iter().map(|effect| effect["kind"].clone()).collect();
    row["components"] = effects.iter().map(|effect| effect["component"].clone()).collect();
    row["parameters"] = effects.iter().map(|effect| effect["parameters"].clone()).collect();
    row["ambiguous"] = report["ambiguous"].clone();
    let place =
        |site: &Value| json!({"component": site["component"], "equation": site["equation"], "score": site["score"]});
    row["location"] = list(&report["location"]).iter().take(5).map(place).collect();
    for part in ["train", "heldout"] {
        let gap = &report["gap"][part];
        row["gap"][part] = json!({"before": gap["before"], "after": gap["after"]});
    }
    row["held_out"] = json!(list(&report["shots"]["heldout"]).len());
    let candidate = |found: &Value| json!({"effect": found["effect"], "fall": found["cost_drop"], "power": found["power"], "promise": found["promise"]});
    let all = list(&report["candidates"]);
    row["candidates"] = all.iter().take(6).map(candidate).collect();
    // Before any candidate was fitted: with and without the share that nuisances take.
    row["promised"] = highest(&all, "promise");
    row["alone"] = highest(&all, "alone");
    row["proposed"] = report.get("proposed").or(report.get("term")).cloned().unwrap_or(Value::Null);
    row["reason"] = report["reason"].clone();
    row["resembles"] = report["resembles"].clone();
    row["simulations"] = report["simulations"].clone();
    row["seconds"] = report["seconds"].clone();
}

/// The three candidates of the first pass with the highest numbers under `key`: `[effect, number]`.
fn highest(candidates: &[Value], key: &str) -> Value {
    let first = candidates.iter().filter(|found| found["pass"] == 1 && found.get("alone").is_some());
    let mut ranked: Vec<(&Value, f64)> = first.filter_map(|own| Some((&own["effect"], own[key].as_f64()?))).collect();
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
    ranked.iter().take(3).map(|(effect, value)| json!([effect, value])).collect()
}

/// CPU seconds of finished child processes, where the system tells (Linux counts in hundredths).
fn children_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = text.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |place: usize| fields.get(place)?.parse::<f64>().ok();
    Some((ticks(13)? + ticks(14)?) / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_a_killed_run_are_taken_up() {
        let path = std::env::temp_dir().join(format!("rows-{}.jsonl", std::process::id()));
        std::fs::write(&path, "{\"trial\":\"a\"}\n{\"trial\":\"b\"}\n{\"trial\":\"c\",").expect("written");
        let done = finished(&path).expect("read");
        assert_eq!(done.into_iter().collect::<Vec<_>>(), ["a", "b"]);
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "{\"trial\":\"a\"}\n{\"trial\":\"b\"}\n");
        std::fs::remove_file(&path).expect("removed");
    }
}
