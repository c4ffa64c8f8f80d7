//! The JSON Schemas of studies and sets: the examples of the repository validate, wrong ones do not, and no field is missing.
//!
//! The validator knows the words of JSON Schema (draft 2020-12) that the two schemas use, and fails on any other.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use hyd_discovery::{Bench, Study};
use hyd_tests::models::root;
use serde_json::{Value, json};

/// What is wrong with a value, the place first.
fn faults(schema: &Value, root: &Value, value: &Value, place: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut wrong = |is_wrong: bool, words: &str| {
        if is_wrong {
            found.push(format!("{place}: {words}"));
        }
    };
    let mut inner: Vec<String> = Vec::new();
    for (word, rule) in schema.as_object().expect("a schema is an object") {
        let number = || value.as_f64().zip(rule.as_f64());
        match word.as_str() {
            "$schema" | "$defs" | "title" | "description" => {}
            "$ref" => {
                let pointer = rule.as_str().and_then(|own| own.strip_prefix('#')).expect("a reference within the file");
                inner.extend(faults(root.pointer(pointer).expect("what is referred to"), root, value, place));
            }
            "type" => {
                let of = |rule: &Value| match rule.as_str().expect("a type") {
                    "object" => value.is_object(),
                    "array" => value.is_array(),
                    "string" => value.is_string(),
                    "boolean" => value.is_boolean(),
                    "number" => value.is_number(),
                    "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
                    other => panic!("type {other}"),
                };
                let is = rule.as_array().map_or_else(|| of(rule), |rules| rules.iter().any(of));
                wrong(!is, &format!("it is not of type {rule}"));
            }
            "enum" => wrong(!rule.as_array().unwrap().contains(value), &format!("it is not one of {rule}")),
            "minimum" => wrong(number().is_some_and(|(own, limit)| own < limit), "too small"),
            "exclusiveMinimum" => wrong(number().is_some_and(|(own, limit)| own <= limit), "too small"),
            "maximum" => wrong(number().is_some_and(|(own, limit)| own > limit), "too large"),
            "exclusiveMaximum" => wrong(number().is_some_and(|(own, limit)| own >= limit), "too large"),
            "minItems" => {
                wrong(value.as_array().is_some_and(|own| (own.len() as u64) < rule.as_u64().unwrap()), "too short")
            }
            "minProperties" => {
                wrong(value.as_object().is_some_and(|own| (own.len() as u64) < rule.as_u64().unwrap()), "empty");
            }
            "minLength" => {
                wrong(value.as_str().is_some_and(|own| (own.len() as u64) < rule.as_u64().unwrap()), "empty")
            }
            "required" => {
                let missing = rule.as_array().unwrap().iter().any(|name| value.get(name.as_str().unwrap()).is_none());
                wrong(missing, &format!("one of {rule} is missing"));
            }
            "not" => wrong(faults(rule, root, value, place).is_empty(), "it is what it must not be"),
            "oneOf" => {
                let fits =
                    rule.as_array().unwrap().iter().filter(|own| faults(own, root, value, place).is_empty()).count();
                wrong(fits != 1, &format!("it fits {fits} of the forms"));
            }
            "items" => {
                for (k, own) in value.as_array().into_iter().flatten().enumerate() {
                    inner.extend(faults(rule, root, own, &format!("{place}/{k}")));
                }
            }
            "properties" => {
                for (name, own) in value.as_object().into_iter().flatten() {
                    if let Some(rule) = rule.get(name) {
                        inner.extend(faults(rule, root, own, &format!("{place}/{name}")));
                    }
                }
            }
            "additionalProperties" => {
                let known = |name: &String| schema.get("properties").is_some_and(|own| own.get(name).is_some());
                for (name, own) in value.as_object().into_iter().flatten().filter(|(name, _)| !known(name)) {
                    match rule {
                        Value::Bool(false) => inner.push(format!("{place}: there is no `{name}`")),
                        rule => inner.extend(faults(rule, root, own, &format!("{place}/{name}"))),
                    }
                }
            }
            other => panic!("the validator does not know `{other}`"),
        }
    }
    found.extend(inner);
    found
}

fn schema(kind: &str) -> Value {
    let text = fs::read_to_string(root().join(format!("docs/schema/{kind}.schema.json"))).expect("the schema");
    serde_json::from_str(&text).expect("JSON")
}

fn all_faults(kind: &str, value: &Value) -> Vec<String> {
    let schema = schema(kind);
    faults(&schema, &schema, value, "")
}

fn toml_as_json(text: &str) -> Value {
    let table: toml::Table = toml::from_str(text).expect("TOML");
    serde_json::to_value(table).expect("JSON")
}

/// Files below a folder with this ending.
fn files(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("listed").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && !name.starts_with('.') {
            files(&path, ending, found);
        } else if name.ends_with(ending) {
            found.push(path);
        }
    }
}

#[test]
fn every_study_of_the_repository_validates() {
    let mut found = Vec::new();
    files(&root(), ".toml", &mut found);
    files(&root().join("cli/src/new"), ".toml.txt", &mut found);
    let mut count = 0;
    for path in found {
        let text = fs::read_to_string(&path).expect("read").replace("{quoted}", "\"x\"");
        if text.contains("\n[channels]\n") {
            assert_eq!(all_faults("study", &toml_as_json(&text)), Vec::<String>::new(), "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 2, "{count} studies");
}

#[test]
fn every_set_of_the_repository_validates() {
    let mut found = Vec::new();
    files(&root(), ".json", &mut found);
    files(&root().join("cli/src/new"), ".json.txt", &mut found);
    let mut count = 0;
    for path in found {
        let text = fs::read_to_string(&path).expect("read").replace("{quoted}", "\"x\"");
        if text.contains("\"experiments\": [") {
            let value = serde_json::from_str(&text).expect("JSON");
            assert_eq!(all_faults("set", &value), Vec::<String>::new(), "{}", path.display());
            count += 1;
        }
    }
    assert!(count >= 11, "{count} sets");
}

#[test]
fn wrong_files_do_not_validate() {
    let study = "file = \"m.hyd\"\n[models]\ndefault = \"M\"\n[channels]\ny = { variable = \"y\" }\n";
    assert_eq!(all_faults("study", &toml_as_json(study)), Vec::<String>::new());
    for lines in [
        "[chanels]",
        "[shots]\ntime_scale = 0.0",
        "[shots]\nhold_out = [1.5]",
        "[nuisances]\nk = 0.3",
        "[nuisances]\nk = { parameter = \"k\", relative = 0.1, absolute = 1.0 }",
        "[run]\ntolerance = 0.1",
        "[[shots.masks]]\nbelow = 1.0",
    ] {
        let text = format!("{study}{lines}\n");
        assert!(!all_faults("study", &toml_as_json(&text)).is_empty(), "{lines}");
        // What the schema refuses the program refuses, too.
        assert!(Study::parse(&text).is_err(), "{lines}");
    }
    for set in [
        json!({}),
        json!({"experiments": []}),
        json!({"experiments": [{"shot": 1}]}),
        json!({"experiments": [{"file": "a.csv", "shot": 1.5}]}),
        json!({"experiments": [{"file": "a.csv"}], "noise_std": {"p": -1}}),
        json!({"experiments": [{"file": "a.csv"}], "sensor_gain_1sigma": "0.1"}),
    ] {
        assert!(!all_faults("set", &set).is_empty(), "{set}");
    }
}

/// The fields that a part of a study has, as the program lists them when it meets an unknown one.
fn fields_of(channel: &str, lines: &str) -> BTreeSet<String> {
    let text = format!(
        "file = \"m\"\nmodels = {{ default = \"M\" }}\nchannels = {{ y = {{ {channel} = \"y\" }} }}\n{lines}\n"
    );
    let said = Study::parse(&text).expect_err("an unknown field").sentence;
    let (_, list) = said.split_once("expected").unwrap_or_else(|| panic!("{said}"));
    let list = list.split(';').next().unwrap_or_default();
    list.split('`').skip(1).step_by(2).map(String::from).collect()
}

#[test]
fn no_field_is_missing() {
    let study = schema("study");
    for (place, channel, lines) in [
        ("", "variable", "zzzzzz = 1"),
        ("/$defs/channel", "zzzzzz", ""),
        ("/$defs/nuisance", "variable", "[nuisances.z]\nzzzzzz = 1"),
        ("/$defs/shots", "variable", "[shots]\nzzzzzz = 1"),
        ("/$defs/mask", "variable", "[[shots.masks]]\nzzzzzz = 1"),
        ("/$defs/run", "variable", "[run]\nzzzzzz = 1"),
    ] {
        let known = study.pointer(place).and_then(|own| own["properties"].as_object()).expect("properties");
        assert_eq!(known.keys().cloned().collect::<BTreeSet<_>>(), fields_of(channel, lines), "{place}");
    }
    let set = schema("set");
    let known: BTreeSet<&str> = set["properties"].as_object().expect("properties").keys().map(String::as_str).collect();
    let fields: BTreeSet<&str> = Bench::KEYS.iter().chain(&Bench::REMARKS).copied().collect();
    assert_eq!(known, fields);
    // The keys are those of the structure that is read.
    let text = fs::read_to_string(root().join("discovery/src/bench/mod.rs")).expect("the source");
    let (_, rest) = text.split_once("struct Stated {\n").expect("the structure");
    let body = rest.split_once("\n}").expect("its end").0;
    let names = body.lines().filter_map(|line| line.trim().split_once(": ")).map(|(name, _)| name);
    assert_eq!(names.collect::<BTreeSet<_>>(), Bench::KEYS.into_iter().collect());
}

#[test]
fn the_program_prints_them() {
    for kind in ["study", "set"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
        let output = command.args(["bench", "schema", kind]).output().expect("it runs");
        assert_eq!(serde_json::from_slice::<Value>(&output.stdout).expect("JSON"), schema(kind));
    }
}
