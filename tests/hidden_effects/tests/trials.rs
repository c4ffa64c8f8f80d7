//! Trials as a whole: the same name and seed give the same files, a plain null is noise around the believed drive, every effect
//! moves a channel, and an evaluation writes one row a trial, once.

use hidden_effects::draft::{Draft, NOISE, Points, Request};
use hidden_effects::effects::{CATALOGUE, OUTSIDE};
use hidden_effects::evaluate::{Judged, run};
use hidden_effects::{files, measure, shot};
use std::path::PathBuf;

fn request(name: &str, effects: &[(&str, f64)]) -> Request {
    let effects = effects.iter().map(|(id, size)| (id.to_string(), *size)).collect();
    Request { name: name.into(), seed: 11, effects, disturbances: Vec::new(), points: Points::default() }
}

#[test]
fn draws_repeat() {
    let table = |name: &str| {
        let draft = Draft::draw(&request(name, &[])).expect("a draft");
        let (_, recorded) = measure::all(&draft).expect("runs");
        (files::set(&draft).to_string(), files::table(&draft, &measure::times(), &recorded[0]))
    };
    assert_eq!(table("a"), table("a"));
    assert_ne!(table("a").1, table("b").1);
}

#[test]
fn the_noise_of_a_null_is_what_the_set_states() {
    let draft = Draft::draw(&request("null", &[])).expect("a draft");
    let (ideal, recorded) = measure::all(&draft).expect("runs");
    for &channel in &draft.channels {
        let residuals: Vec<f64> = ideal
            .iter()
            .flatten()
            .zip(recorded.iter().flatten())
            .map(|(ideal, seen)| seen[channel] - draft.gain[channel] * ideal[channel] - draft.offset[channel])
            .collect();
        let rms = (residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64).sqrt();
        // At least 3000 samples, correlated by at most 0.5 (variance of the square's mean up by 5/3).
        let wanted = measure::sigma(&draft, channel);
        assert!((rms / wanted - 1.0).abs() < 0.08, "channel {channel}: {rms} for {wanted} ({})", NOISE[channel]);
    }
}

#[test]
fn every_effect_moves_something() {
    for effect in CATALOGUE.iter().chain(&OUTSIDE) {
        let draft = Draft::draw(&request(effect.id, &[(effect.id, 1.0)])).expect("a draft");
        let moved = (0..draft.shots.len()).any(|place| {
            let (machine, conditions) = draft.actual(place);
            let (plain, unmoved) = draft.without_effects(place);
            let run = |machine, conditions| shot::run(machine, conditions, &measure::times(), 1e-8).expect("runs");
            let (with, without) = (run(&machine, &conditions), run(&plain, &unmoved));
            draft.channels.iter().any(|&channel| {
                let far = |row: &[f64; 6], base: &[f64; 6]| (row[channel] - base[channel]).abs();
                let most = with.iter().zip(&without).map(|(row, base)| far(row, base)).fold(0.0, f64::max);
                most + draft.extra_offset[channel].abs() > 3.0 * measure::sigma(&draft, channel)
            })
        });
        assert!(moved, "{}", effect.id);
    }
    assert!(Draft::draw(&request("x", &[("no_such_effect", 1.0)])).is_err());
}

/// A judged command that always says the same, written as a script.
#[cfg(unix)]
#[test]
fn an_evaluation_can_be_taken_up_again() {
    use std::os::unix::fs::PermissionsExt;
    let folder = std::env::temp_dir().join(format!("hidden-effects-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("made");
    let program = folder.join("always");
    let script = "#!/bin/sh\nset -e\nls \"$(dirname \"$4\")\" | grep -q ANSWERS && exit 3\nmkdir -p \"$6\"\n\
        echo '{\"status\": \"named\", \"effects\": [{\"id\": \"chamber_leakage\", \"kind\": \"physics\"}]}' > \"$6/report.json\"\n";
    std::fs::write(&program, script).expect("written");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("allowed");
    let judged = Judged {
        program,
        study: PathBuf::from("study.toml"),
        limit: 20.0,
        extra: Vec::new(),
        label: "script".into(),
        temporary: folder.join("sets"),
        keep: false,
    };
    let out = folder.join("rows.jsonl");
    let requests = [request("one", &[("chamber_leakage", 1.0)]), request("two", &[])];
    run(&requests[..1], &judged, &out).expect("runs");
    run(&requests, &judged, &out).expect("runs");
    let text = std::fs::read_to_string(&out).expect("rows");
    let rows: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).expect("a row")).collect();
    assert_eq!(rows.len(), 2);
    assert_eq!((&rows[0]["trial"], &rows[0]["named"][0]), (&"one".into(), &"chamber_leakage".into()));
    assert!(rows[0]["power"].as_f64().expect("a number") > 100.0 && rows[1]["kind"] == "null");
    std::fs::remove_dir_all(&folder).expect("removed");
}
