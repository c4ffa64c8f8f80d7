//! The commands: `generate` writes a set, `check` holds the drive against sets of known answers, `evaluate` runs a
//! plan's trials against a command and appends a row for each, `derivatives` lets a simple method answer the same
//! trials, `summary` puts tables of rows into a page.

use hidden_effects::disturb::KINDS;
use hidden_effects::draft::{CHANNELS, Draft, Points, Request, Stated, draw_together};
use hidden_effects::effects::{CATALOGUE, OUTSIDE};
use hidden_effects::evaluate::{Judged, run};
use hidden_effects::random::Stream;
use hidden_effects::{diagram, files, known, matching, measure, plan, power, rows, summary};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.first().map(String::as_str) {
        Some("generate") => generate(&arguments),
        Some("check") => check(&arguments),
        Some("evaluate") => evaluate(&arguments),
        Some("derivatives") => derivatives(&arguments),
        Some("summary") => summary(&arguments),
        Some("effects") => {
            effects();
            Ok(())
        }
        _ => {
            Err("usage: hidden-effects generate|check|evaluate|derivatives|summary|effects ... (see README.md)".into())
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// The word after `--name`.
fn option<'a>(arguments: &'a [String], name: &str) -> Option<&'a str> {
    let place = arguments.iter().position(|argument| argument == name)?;
    arguments.get(place + 1).map(String::as_str)
}

fn effects() {
    for effect in CATALOGUE.iter().chain(&OUTSIDE) {
        println!(
            "{:<22} {:<8} size {:<8} at {}",
            effect.id,
            effect.kind.word(),
            effect.size_name,
            effect.places.join(", ")
        );
    }
}

fn generate(arguments: &[String]) -> Result<(), String> {
    let kind = option(arguments, "--kind").unwrap_or("effect");
    let seed: u64 = option(arguments, "--seed").unwrap_or("1").parse().map_err(|_| "--seed takes an integer")?;
    let size: Option<f64> =
        option(arguments, "--size").map(str::parse).transpose().map_err(|_| "--size takes a number")?;
    let folder = PathBuf::from(option(arguments, "--out").ok_or("--out FOLDER is needed")?);
    let chosen: Vec<String> = match (kind, option(arguments, "--effect")) {
        ("null", _) => Vec::new(),
        (_, Some(list)) => list.split(',').map(String::from).collect(),
        ("pair" | "triple", None) => {
            let count = if kind == "pair" { 2 } else { 3 };
            let drawn = draw_together(&mut Stream::new(seed, "together"), count);
            drawn.iter().map(|effect| effect.id.to_string()).collect()
        }
        _ => return Err("--effect ID[,ID] is needed (see `effects`)".into()),
    };
    let mut sizes = Stream::new(seed, "sizes");
    let effects = chosen.into_iter().map(|id| (id, size.unwrap_or_else(|| sizes.log_uniform(0.5, 2.0)))).collect();
    let name = option(arguments, "--name").map_or_else(|| format!("{kind}{seed}"), String::from);
    let disturbances: Vec<String> = match option(arguments, "--disturb") {
        Some(list) => list.split(',').map(String::from).collect(),
        None => Vec::new(),
    };
    if let Some(unknown) = disturbances.iter().find(|own| !KINDS.contains(&own.as_str())) {
        return Err(format!("no disturbance `{unknown}`: {}", KINDS.join(", ")));
    }
    let first =
        option(arguments, "--first").map(str::parse).transpose().map_err(|_| "--first takes a number of shots")?;
    let points = Points { first, more: further(arguments)? };
    let draft = Draft::draw(&Request { name, seed, effects, disturbances, points })?;
    let (ideal, recorded) = measure::all(&draft)?;
    let signature = measure::signature(&draft, &ideal).map_err(|failure| format!("{failure:?}"))?;
    files::write(&draft, &measure::times(), &recorded, &signature, &folder)?;
    println!("{} in {}", draft.request.name, folder.display());
    if !draft.truth.is_empty() {
        let power = power::power(&draft, &ideal).map_err(|failure| format!("{failure:?}"))?;
        println!("  squared signature {:.0}, after projection of what may be fitted {:.0}", power.raw, power.projected);
    }
    for &channel in &draft.channels {
        println!("  {:<6} hidden part {:8.2} standard deviations", CHANNELS[channel], signature[channel]);
    }
    Ok(())
}

/// Shots of `--shot p0_Pa,U0_V,C_F,pulse_s`.
fn further(arguments: &[String]) -> Result<Vec<Stated>, String> {
    let wrong = |text: &str| format!("--shot {text}: write p0_Pa,U0_V,C_F,pulse_s");
    let shots = arguments.windows(2).filter(|pair| pair[0] == "--shot").map(|pair| {
        let numbers: Vec<f64> =
            pair[1].split(',').map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong(&pair[1]))?;
        let [p_0, u_0, capacity, pulse] = numbers[..] else { return Err(wrong(&pair[1])) };
        Ok(Stated { p_0, u_0, capacity, pulse })
    });
    shots.collect()
}

fn check(arguments: &[String]) -> Result<(), String> {
    let folder = Path::new(option(arguments, "--bench").ok_or("--bench FOLDER with ANSWERS.json is needed")?);
    let text = std::fs::read_to_string(folder.join("ANSWERS.json")).map_err(|error| error.to_string())?;
    let answers: serde_json::Value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    println!("RMS of recorded minus simulated, in standard deviations, by {}", CHANNELS.join(" "));
    for (name, answer) in answers.as_object().into_iter().flatten() {
        for (words, forms, bare) in
            [("nothing put in", false, true), ("as drawn", false, false), ("other forms", true, false)]
        {
            let left = known::left(folder, name, answer, forms, bare)?;
            let shown: Vec<String> =
                left.iter().map(|value| value.map_or("     -".into(), |value| format!("{value:6.2}"))).collect();
            println!("{name} {words:<15} {}", shown.join(" "));
        }
    }
    Ok(())
}

/// Appends the answers of matched derivatives to those trials that have none.
fn derivatives(arguments: &[String]) -> Result<(), String> {
    let out = option(arguments, "--out").ok_or("--out ANSWERS.jsonl is needed")?;
    let shown = |error: std::io::Error| format!("{out}: {error}");
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(out).map_err(shown)?;
    let rows = rows::Row::read(&files_of_rows(arguments))?;
    for row in rows.iter().filter(|row| row.by_derivatives().is_none()) {
        let request = row.request().ok_or("a row without what was hidden")?;
        let draft = Draft::draw(&request)?;
        let (_, recorded) = measure::all(&draft)?;
        let answer = matching::name(&draft, &recorded).unwrap_or("");
        let line = serde_json::json!({"trial": request.name, "seed": request.seed, "by_derivatives": answer});
        writeln!(file, "{line}").map_err(shown)?;
    }
    Ok(())
}

fn files_of_rows(arguments: &[String]) -> Vec<&Path> {
    let mut files: Vec<&Path> = arguments.iter().filter(|name| name.ends_with(".jsonl")).map(Path::new).collect();
    files.sort_unstable();
    files.dedup();
    files
}

fn summary(arguments: &[String]) -> Result<(), String> {
    let page = Path::new(option(arguments, "--page").ok_or("--page PAGE.md is needed")?);
    let rows = rows::Row::read(&files_of_rows(arguments))?;
    let shown = |error: std::io::Error| format!("{}: {error}", page.display());
    let text = std::fs::read_to_string(page).map_err(shown)?;
    std::fs::write(page, summary::into_page(&text, &rows)?).map_err(shown)?;
    if let Some(picture) = option(arguments, "--picture") {
        std::fs::write(picture, diagram::reliability(&rows)).map_err(|error| format!("{picture}: {error}"))?;
    }
    println!("{} trials in {}", rows.len(), page.display());
    Ok(())
}

fn evaluate(arguments: &[String]) -> Result<(), String> {
    let needed = |name: &str| option(arguments, name).ok_or(format!("{name} is needed"));
    let text = std::fs::read_to_string(needed("--plan")?).map_err(|error| error.to_string())?;
    let parsed: serde_json::Value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    let from_file = option(arguments, "--seed-file").map(std::fs::read_to_string).transpose();
    let from_file = from_file.map_err(|error| format!("--seed-file: {error}"))?;
    let seed = option(arguments, "--seed").or(from_file.as_deref().map(str::trim)).map(str::parse).transpose();
    let seed: Option<u64> = seed.map_err(|_| "a seed is an integer")?;
    let requests = plan::shard(plan::requests(&parsed, seed)?, option(arguments, "--shard").unwrap_or("1/1"))?;
    let temporary =
        option(arguments, "--sets").map_or_else(|| std::env::temp_dir().join("hidden-effects"), PathBuf::from);
    let judged = Judged {
        program: PathBuf::from(needed("--hyd")?),
        study: PathBuf::from(option(arguments, "--study").unwrap_or("models/single_acting_drive/bench.toml")),
        limit: option(arguments, "--limit").unwrap_or("900").parse().map_err(|_| "--limit takes seconds")?,
        extra: Vec::new(),
        label: option(arguments, "--label").unwrap_or("").to_string(),
        temporary,
        keep: arguments.iter().any(|argument| argument == "--keep"),
    };
    run(&requests, &judged, Path::new(needed("--out")?))
}
